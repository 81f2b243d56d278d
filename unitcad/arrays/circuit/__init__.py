"""The common circuit of an array: its wiring, its outline, and the files that a maker of flexible circuits reads."""
