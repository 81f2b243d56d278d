"""The pipeline from a subject to a folder of files; each step runs once."""
