"""Finite elements of a unit on its body: model `mechanics`. Needs scikit-fem (extra `fem`)."""
