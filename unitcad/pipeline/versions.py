"""What a result's bytes depend on besides its spec: this package and the kernels."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
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
    root = Path(str(files("unitcad")))
    named = {file.relative_to(root).as_posix(): file for file in root.rglob("*") if file.suffix in (".py", ".toml")}
    for name, file in sorted(named.items()):
        digest.update(f"{name}\n".encode() + file.read_bytes())
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
    try:
        return version(name)
    except PackageNotFoundError:
        return None
