"""Studies of accuracy against peers and references: `python -m benchmarks.accuracy NAME`."""
