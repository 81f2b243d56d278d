"""Geometry of triangle meshes, which the rules use."""
