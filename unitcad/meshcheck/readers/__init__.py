"""Readers: a file's bytes to meshes, or to the build of a 3MF, and the rules that the file itself breaks.

The reader of a file, by its suffix, and its format by its first bytes.

The reader of a format is the function of its module's name in this folder: `.stl` is read by read_stl.read_stl.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import PurePath
from pkgutil import iter_modules

from unitcad.meshcheck.findings import Finding
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.meshcheck.rules.f_file import Deadline, Limits

Reader = Callable[[memoryview, Limits, Deadline, list[Finding]], Mesh | None]
"""A function that reads a mesh from bytes and adds findings about the file itself.

It returns None if the findings leave no mesh, and raises `Unreadable` if it cannot read on.
"""
_READ = "read_"
SUFFIXES = {f".{name.removeprefix(_READ)}" for _, name, _ in iter_modules(__path__) if name.startswith(_READ)}
SUFFIXES |= {".stp"}
_MAGIC = (
    (b"PK\x03\x04", "zip"),
    (b"PK\x05\x06", "zip"),
    (b"\x1f\x8b", "gzip"),
    (b"BZh", "bzip2"),
    (b"\xfd7zXZ", "xz"),
    (b"7z\xbc\xaf", "7z"),
    (b"Rar!", "rar"),
    (b"\x89PNG", "png"),
    (b"\xff\xd8\xff", "jpeg"),
    (b"GIF8", "gif"),
    (b"%PDF", "pdf"),
    (b"ISO-10303-21", "STEP"),
    (b"version https://git-lfs", "a Git LFS pointer"),
    (b"glTF", "binary glTF"),
)
_TEXT_MARKS = (b"<!doctype html", b"<html", b"<head", b"<body")


def foreign(head: bytes) -> str | None:
    """Name a format that is certainly not STL, OBJ, PLY or OFF; None if the bytes show none."""
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    if any(start.startswith(mark) for mark in _TEXT_MARKS):
        return "a web page"
    if start.startswith((b"<?xml", b"<error")):
        return "a web page" if b"<html" in start[:2000] else "XML"
    if start.startswith((b'{"', b"{\n", b"{\r")):
        return "JSON"
    return None


def kind_of(path: str) -> str:
    """Return the reader for a file: stl, 3mf, obj, ply, off, step, or "" for a suffix that none reads."""
    suffix = PurePath(path).suffix.lower()
    if suffix not in SUFFIXES:
        return ""
    return {".stp": "step"}.get(suffix, suffix[1:])


_OTHERS = {".glb": "glTF", ".gltf": "glTF", ".amf": "AMF", ".fbx": "FBX", ".dae": "COLLADA", ".x3d": "X3D"}
_OTHERS |= {".igs": "IGES", ".iges": "IGES", ".blend": "Blender", ".f3d": "Fusion", ".fcstd": "FreeCAD"}


def unknown(suffix: str) -> str:
    """Say that no reader reads files of a suffix, and which formats slicers take."""
    kind = _OTHERS.get(suffix.lower())
    what = f"{kind} is not checked" if kind else f"suffix {suffix!r} is not a mesh format"
    return f"{what}; export STL, 3MF or OBJ, which every slicer takes (checked: {', '.join(sorted(SUFFIXES))})"


def reader_of(kind: str) -> Reader:
    """Return the reader of a format with one mesh; its module is loaded by the first file that needs it."""
    name = f"{_READ}{kind}"
    return getattr(import_module(f"{__name__}.{name}"), name)
