"""A layered half-space under a load: waves, their propagation through layers, loads, and the Hankel integral."""
