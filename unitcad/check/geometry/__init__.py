"""Geometry of triangle meshes, without rules: what the rules judge by."""
