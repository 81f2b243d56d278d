"""Realisations of one tree: manifold3d for meshes; OCCT, build123d and CadQuery for boundary representations."""
