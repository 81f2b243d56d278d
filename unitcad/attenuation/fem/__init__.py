"""Finite elements of a unit on tissue: model `fem`. Needs scikit-fem (extra `fem`)."""
