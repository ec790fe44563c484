"""What labels faces, tested on takes and signers that it did not learn from."""
