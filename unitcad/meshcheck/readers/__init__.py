"""Readers: a file's bytes to meshes, or to the build of a 3MF, and what the file itself breaks."""
