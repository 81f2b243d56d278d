"""What a result's bytes depend on besides its spec: this package and the kernels."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path

from unitcad import __version__

MESH_KERNELS = ("manifold3d", "numpy")
BREP_KERNELS = ("build123d", "cadquery", "cadquery-ocp", "cadquery-ocp-novtk")
PICTURE_KERNELS = ("vtk",)


@cache
def code_version() -> str:
    """Return the version and twelve digits over the package's own files, so that a changed line reuses nothing."""
    digest = hashlib.sha256()
    root = str(files("unitcad"))
    # os.walk, which takes a third of the time of Path.rglob: every command that builds waits for it.
    named = {
        os.path.relpath(path, root).replace(os.sep, "/"): path
        for folder, _, names in os.walk(root)
        for name in names
        if name.endswith((".py", ".toml")) and (path := os.path.join(folder, name))
    }
    for name, path in sorted(named.items()):
        digest.update(f"{name}\n".encode() + Path(path).read_bytes())
    return f"{__version__}+{digest.hexdigest()[:12]}"


def kernel_versions(formats: Sequence[str]) -> dict[str, str]:
    """Return the versions of the kernels that make `formats`; what is not installed is left out."""
    names = (
        *MESH_KERNELS,
        *(BREP_KERNELS if "step" in formats else ()),
        *(PICTURE_KERNELS if "png" in formats else ()),
    )
    return {name: installed for name in names if (installed := _version(name))}


@cache
def _version(name: str) -> str | None:
    from importlib.metadata import PackageNotFoundError, version  # takes long to import

    try:
        return version(name)
    except PackageNotFoundError:
        return None
