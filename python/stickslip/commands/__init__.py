"""The sub-commands of the command line, one a file: `add` declares its options, `run` does the work."""
