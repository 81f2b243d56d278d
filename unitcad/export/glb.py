"""glTF 2.0 in one binary file: named, coloured meshes as assembled, in metres and y up as the format asks.

Written after the glTF 2.0 specification (Khronos Group, 2021). Positions stay in mm, z up, in the buffers; one root
node turns and scales them. Same input, same bytes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from unitcad.export.printing import TooThin, single_precision
from unitcad.geometry.arrays import unique_rows

CREASE_DEG = 20.0
"""Faces that meet at more than this angle are not shaded as one surface."""
_FLOAT, _UINT16, _UINT32, _ARRAY, _ELEMENTS = 5126, 5123, 5125, 34962, 34963
_HALF = math.sqrt(0.5)


@dataclass(frozen=True)
class Standing:
    """One of several places of a mesh: a name, the turn about z (degrees), then the move (mm)."""

    name: str
    x: float
    y: float
    angle_deg: float = 0.0


@dataclass(frozen=True)
class GlbPart:
    """A named closed mesh: colour as three sRGB numbers 0 to 1, vertices (n, 3) in mm, faces (m, 3).

    `extras`: plain values that programs may read. `places`: its copies; none for as it is, under its own name. The file
    has its mesh once, for any number of copies.
    """

    name: str
    colour: tuple[float, float, float]
    vertices: np.ndarray
    faces: np.ndarray
    extras: Mapping[str, Any] = field(default_factory=dict)
    places: Sequence[Standing] = ()


def content(parts: Sequence[GlbPart]) -> bytes:
    """Return the bytes of the file.

    Raises TooThin, with a part's name, if single precision can't represent its mesh.
    """
    buffer = bytearray()
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []

    def stored(data: np.ndarray, kind: str, component: int, target: int, limits: bool = False) -> int:
        raw = data.tobytes()
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(raw), "target": target})
        buffer.extend(raw + b"\0" * (-len(raw) % 4))
        entry: dict[str, Any] = {"bufferView": len(views) - 1, "componentType": component, "count": len(data)}
        entry["type"] = kind
        if limits:
            entry |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        accessors.append(entry)
        return len(accessors) - 1

    meshes, materials, nodes = [], [], []
    for part in parts:
        mesh = part.vertices.astype(np.float64).tobytes(), part.faces.astype(np.int64).tobytes()
        try:
            vertices, normals, faces = _ready(*mesh)
        except TooThin as error:
            raise TooThin(f"{part.name}: {error.fault}", error.at) from None
        wide = len(vertices) > 65535
        corners = faces.ravel().astype("<u4" if wide else "<u2")
        primitive = {
            "attributes": {
                "POSITION": stored(vertices.astype("<f4"), "VEC3", _FLOAT, _ARRAY, limits=True),
                "NORMAL": stored(normals.astype("<f4"), "VEC3", _FLOAT, _ARRAY),
            },
            "indices": stored(corners, "SCALAR", _UINT32 if wide else _UINT16, _ELEMENTS),
            "material": len(materials),
        }
        meshes.append({"name": part.name, "primitives": [primitive]})
        materials.append(_material(part))
        node = {"name": part.name, "mesh": len(meshes) - 1, "extras": dict(sorted(part.extras.items()))}
        for place in part.places:
            half = math.radians(place.angle_deg) / 2
            turn = {"rotation": [0.0, 0.0, math.sin(half), math.cos(half)]} if place.angle_deg else {}
            nodes.append({**node, "name": place.name, **turn, "translation": [place.x, place.y, 0.0]})
        nodes += [] if part.places else [node]
    root = {
        "name": "assembly",
        "children": list(range(1, len(nodes) + 1)),
        "rotation": [-_HALF, 0.0, 0.0, _HALF],
        "scale": [0.001, 0.001, 0.001],
    }
    document = {
        "asset": {"version": "2.0", "generator": "unitcad"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [root, *nodes],
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(buffer)}],
    }
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    return _pack((b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", bytes(buffer)))


@lru_cache(maxsize=32)
def _ready(vertices: bytes, faces: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a mesh in single precision, shaded: kept, since most bodies stay as they are while one number changes."""
    corners = np.frombuffer(vertices).reshape(-1, 3) + 0.0
    return shading_normals(*single_precision(corners, np.frombuffer(faces, np.int64).reshape(-1, 3)))


def shading_normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices (n, 3), unit normals (n, 3) and faces for shading; a vertex on a crease becomes several.

    A corner's normal is the mean, weighted by angle, of the faces round its vertex that meet its own face at less than
    CREASE_DEG.
    """
    corners = vertices.astype(np.float64)[faces]
    normal = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    ahead, behind = _unit(np.roll(corners, -1, axis=1) - corners), _unit(np.roll(corners, 1, axis=1) - corners)
    angle = np.arccos(np.clip(np.einsum("fck,fck->fc", ahead, behind), -1, 1)).ravel()
    vertex, face = faces.ravel(), np.repeat(np.arange(len(faces)), 3)
    first, second = _pairs_round(vertex)
    near = np.einsum("ik,ik->i", normal[face[first]], normal[face[second]]) > math.cos(math.radians(CREASE_DEG))
    first, second = first[near], second[near]
    weighted = normal[face[second]] * angle[second, None]
    sums = np.stack([np.bincount(first, column, len(vertex)) for column in weighted.T], axis=1)
    smooth = _unit(sums).round(5) + 0.0
    unique, index = unique_rows(np.column_stack([vertex, smooth]))
    return vertices[unique[:, 0].astype(int)], _unit(unique[:, 1:]), index.reshape(-1, 3)


def _pairs_round(vertex: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return every ordered pair of corners that share a vertex, a corner with itself too."""
    order = np.argsort(vertex, kind="stable")
    _, start, count = np.unique(vertex[order], return_index=True, return_counts=True)
    per_corner = np.repeat(count, count)
    first = np.repeat(order, per_corner)
    within = np.arange(len(first)) - np.repeat(np.cumsum(per_corner) - per_corner, per_corner)
    second = order[np.repeat(np.repeat(start, count), per_corner) + within]
    return first, second


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1.0)


def _material(part: GlbPart) -> dict[str, Any]:
    """Return a glTF material, whose colours are linear, of a part's sRGB colour (IEC 61966-2-1)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in part.colour]
    return {
        "name": part.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*(round(c, 6) for c in linear), 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.7,
        },
    }


def _pack(*chunks: tuple[bytes, bytes]) -> bytes:
    body = b"".join(len(data).to_bytes(4, "little") + kind + data for kind, data in chunks)
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(body)).to_bytes(4, "little") + body
