"""Finite elements of a unit on its body: model `fem`. Needs scikit-fem (extra `fem`)."""
