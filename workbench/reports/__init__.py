"""The report of a corpus as one HTML page."""
