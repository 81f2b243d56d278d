"""What a file's first bytes say it is, whatever its name says."""

from __future__ import annotations

from pathlib import PurePath

SUFFIXES = {".stl", ".3mf", ".obj", ".ply", ".off", ".glb", ".step", ".stp"}
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
    (b"ISO-10303-21", "step"),
    (b"version https://git-lfs", "a Git LFS pointer"),
    (b"glTF", "glb"),
)
_TEXT_MARKS = (b"<!doctype html", b"<html", b"<head", b"<body")


def foreign(head: bytes) -> str | None:
    """The name of a format that is certainly no STL, OBJ, PLY or OFF; None where that can't be said."""
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


def kind_of(path: str, head: bytes) -> str:
    """The reader for a file: stl, 3mf, obj, ply, off, glb, step, or "" for a suffix that none reads."""
    suffix = PurePath(path).suffix.lower()
    if suffix not in SUFFIXES:
        return ""
    return {".stp": "step"}.get(suffix, suffix[1:])
