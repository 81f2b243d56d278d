"""Geometry of points, boxes and triangles in numpy arrays, shared by the mesh check and the mould checks."""
