"""Readers of recordings, one file a format; `formats.open_recording` chooses by the file's name and first bytes."""
