"""Three realisations of one tree: manifold3d for meshes, build123d and CadQuery (both OCCT) for boundary representations."""
