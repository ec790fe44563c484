"""The commands, by what they are about; each is a thin wrapper over one function of the pipeline."""
