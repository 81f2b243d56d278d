"""Layers of one body from a file: its surface, moved inwards. Loaded for a spec with [body] only."""
