"""Documents and files: read with a clear refusal, written whole or not at all."""
