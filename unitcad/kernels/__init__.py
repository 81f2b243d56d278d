"""Kernels: shape trees to meshes by manifold3d, to boundary representations by OCCT, build123d and CadQuery."""
