"""Maps and files of an array's crosstalk."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from html import escape
from itertools import groupby
from typing import Any

from unitcad.arrays.array import Array
from unitcad.arrays.circuit.circuit_files import circuit_files, has_circuit, outline_path
from unitcad.arrays.circuit.outline import circuit_body, outline
from unitcad.arrays.crosstalk import crosstalk, crosstalk_csv
from unitcad.arrays.sheet import rounded, slot_profile
from unitcad.errors import Missing, Refusal
from unitcad.export.chart import number
from unitcad.shape import Profile
from unitcad.text import number as number_of

STEPS = 21
_LIGHT, _DARK = (247, 251, 255), (8, 64, 129)
_INK = "#111111"
_FONT = 'font-family="sans-serif"'
_MOST_NUMBERS, _MOST_NAMES = 20, 40
"""Units up to which each cell has its number, and each row and column its name."""
_LETTER = 0.6
"""Width of a letter over its size, about the mean."""
_PAGE = 640.0
_SCALE_PX = 90.0


def heat_map_svg(data: Mapping[str, Any], drive: str | None = None, target: str = "centre") -> str:
    """Return the matrix of `crosstalk_matrix.crosstalk` as an SVG document, in per cent.

    A row is a unit that vibrates, a column one that it reaches. `drive`: else that of each row's own motor; `target`:
    "centre" or "nearest_edge".
    """
    places = data["places"]
    names = [place["name"] for place in places]
    drives = [drive or place["drive"] for place in places]
    matrix = [data["matrix"][of][target][i] for i, of in enumerate(drives)]
    n = len(names)
    cell = min(56.0, max(2.0, _PAGE / n))
    left, top = (64.0, 74.0) if n <= _MOST_NAMES else (34.0, 60.0)
    high = _largest(value for row in matrix for value in row if value is not None)
    wide, tall = max(left + n * cell + _SCALE_PX, 470.0), top + n * cell + 20.0
    part = {"centre": "the middle", "nearest_edge": "the nearest edge"}[target]
    driven = " and ".join(sorted(set(drives)))
    head = f"{data['array']}: how much of a unit's motion at its edge reaches {part} of another, % ({driven} drive)"
    parts = [_open(wide, tall), _text(8, 20, head, 12, "start")]
    parts += _cells(matrix, left, top, cell, high)
    for i, name in enumerate(names if n <= _MOST_NAMES else ()):
        size = min(11.0, 0.8 * cell)
        parts.append(_text(left - 5, top + (i + 0.5) * cell + 0.35 * size, name, size, "end"))
        parts.append(_text(left + (i + 0.5) * cell, top - 6, name, size, "middle"))
    if n <= _MOST_NUMBERS:
        size = min(11.0, 0.36 * cell)
        for i, row in enumerate(matrix):
            for j, value in enumerate(row):
                if value is not None:
                    at = left + (j + 0.5) * cell, top + (i + 0.5) * cell + 0.35 * size
                    parts.append(_text(*at, _percent(value), size, "middle", _ink(_share(value, high))))
    above = top - 26 if n <= _MOST_NAMES else top - 8
    parts.append(_text(left + n * cell / 2, above, "unit that is reached", 11, "middle"))
    middle = top + n * cell / 2
    turned = f'transform="translate(16 {number(middle)}) rotate(-90)"'
    parts.append(f'<text {turned} font-size="11" text-anchor="middle">unit that vibrates</text>')
    parts += _scale(left + n * cell + 24, top, min(n * cell, 240.0), high)
    return "\n".join([*parts, "</svg>", ""])


def patch_map_svg(
    array: Array,
    data: Mapping[str, Any] | None = None,
    circuit: Profile | None = None,
    key: str = "root_sum_of_squares",
) -> str:
    """Return the patch from outside as an SVG document: sheet, strap slots, units by name, the circuit if given.

    With the `data` of `crosstalk_matrix.crosstalk` each unit is coloured by the amplitude that all others together give
    it, in per cent of one unit's level at its edge; `key`: "root_sum_of_squares", or "sum" for the worst phases.
    """
    drawn = array.sheet.outline if circuit is None else tuple(
        pick(a, b) for pick, a, b in zip((min, min, max, max), array.sheet.outline, circuit.bounds, strict=True)
    )  # fmt: skip
    scale = min(8.0, _PAGE / (drawn[2] - drawn[0]), _PAGE / (drawn[3] - drawn[1]))
    edge, top = 16.0, 44.0
    wide = max((drawn[2] - drawn[0]) * scale + 2 * edge + (_SCALE_PX if data else 0.0), 470.0)
    tall = (drawn[3] - drawn[1]) * scale + top + edge
    values = data["sums"]["own_drive"][key] if data else None
    high = _largest(values or ())
    how = {"sum": "all in phase", "root_sum_of_squares": "root of the sum of squares"}[key]
    head = [array.name]
    if data:
        head = [f"{array.name}: amplitude at each unit from all others", f"in % of one unit's edge level ({how})"]
    wide = max(wide, *(_LETTER * 12 * len(line) + 16 for line in head))
    parts = [_open(wide, tall), *(_text(8, 20 + 15 * i, line, 12, "start") for i, line in enumerate(head))]
    parts.append(
        f'<g transform="translate({number(edge - drawn[0] * scale)} {number(top + drawn[3] * scale)}) '
        f'scale({number(scale)})" stroke-width="{0.8 / scale:.4f}">'
    )
    slots = "".join(outline_path(slot_profile(slot)) for slot in array.sheet.strap_slots)
    outer = outline_path(rounded(array.sheet.outline, array.sheet.corner_mm))
    parts.append(
        f'<path d="{outer}{slots}" fill="#e4f2e4" stroke="#4f7f4f" fill-rule="evenodd"><title>sheet</title></path>'
    )
    for i, place in enumerate(array.places):
        fill = _colour(_share(values[i], high)) if values else "#ffffff"
        title = place.name if values is None else f"{place.name}: {_percent(values[i])} %"
        parts.append(
            f'<circle cx="{number(place.x)}" cy="{number(-place.y)}" r="{number(place.radius)}" fill="{fill}" '
            f'stroke="#33566e"><title>{escape(title)}</title></circle>'
        )
    if circuit is not None:
        parts.append(f'<path d="{outline_path(circuit)}" fill="none" stroke="#a85a12"><title>circuit</title></path>')
    parts.append("</g>")
    size = min(13.0, 0.6 * min(place.radius for place in array.places) * scale)
    for i, place in enumerate(array.places):
        x = edge + (place.x - drawn[0]) * scale
        y = top + (drawn[3] - place.y) * scale
        fill = _ink(_share(values[i], high)) if values else _INK
        parts.append(_text(x, y - (0.1 if values else -0.35) * size, place.name, size, "middle", fill))
        if values:
            parts.append(_text(x, y + 1.0 * size, _percent(values[i]), size, "middle", fill))
    if values:
        parts += _scale(wide - _SCALE_PX + 20, top, min(240.0, tall - top - edge), high)
    return "\n".join([*parts, "</svg>", ""])


def _cells(matrix: Sequence[Sequence[float | None]], left: float, top: float, cell: float, high: float) -> list[str]:
    """Draw the cells, those of one colour as one path; runs of one colour in a row are one rectangle."""
    paths: dict[str, list[str]] = {}
    for i, row in enumerate(matrix):
        steps = ["#d9d9d9" if value is None else _colour(_share(value, high)) for value in row]
        j = 0
        for colour, run in groupby(steps):
            length = len(list(run))
            at = f"M{number(left + j * cell)} {number(top + i * cell)}"
            paths.setdefault(colour, []).append(
                f"{at}h{number(length * cell)}v{number(cell)}h{number(-length * cell)}z"
            )
            j += length
    return [f'<path fill="{colour}" d="{"".join(parts)}"/>' for colour, parts in sorted(paths.items())]


def _largest(values: Iterable[float]) -> float:
    """Return the value that the scale of colours ends at: the largest, 1 if there is none, as of a single unit."""
    return max(values, default=0.0) or 1.0


def _share(value: float, high: float) -> float:
    """Return a value's place from 0 to `high`, as both are written."""
    return float(_percent(value)) / float(_percent(high))


def _colour(share: float) -> str:
    """Return the colour of a share from 0 to 1, in `STEPS` steps."""
    step = round(share * (STEPS - 1)) / (STEPS - 1)
    return "#" + "".join(f"{round(a + (b - a) * step):02x}" for a, b in zip(_LIGHT, _DARK, strict=True))


def _ink(share: float) -> str:
    """Return the text's colour on the colour of a share."""
    return "#ffffff" if share > 0.55 else _INK


def _scale(x: float, y: float, length: float, high: float) -> list[str]:
    """Draw the scale of colours, in per cent."""
    part = length / STEPS
    bars = [
        f'<rect x="{number(x)}" y="{number(y + length - (i + 1) * part)}" width="14" height="{number(part + 0.3)}" '
        f'fill="{_colour(i / (STEPS - 1))}"/>'
        for i in range(STEPS)
    ]
    marks = [
        _text(x + 18, y + length - share * length + 4, f"{_percent(share * high)} %", 11, "start")
        for share in (0.0, 0.5, 1.0)
    ]
    return [*bars, *marks]


def _open(wide: float, tall: float) -> str:
    size = f"{number(wide)} {number(tall)}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" width="{number(wide)}" height="{number(tall)}" '
        f'{_FONT}><rect width="{number(wide)}" height="{number(tall)}" fill="#ffffff"/>'
    )


def _text(x: float, y: float, content: str, size: float, anchor: str, fill: str = _INK) -> str:
    return (
        f'<text x="{number(x)}" y="{number(y)}" font-size="{number(size)}" text-anchor="{anchor}" fill="{fill}">'
        f"{escape(content)}</text>"
    )


@lru_cache(maxsize=4096)
def _percent(value: float) -> str:
    """Return a fraction in per cent: two digits, three from 100 on."""
    shown = 100.0 * value
    return f"{shown:.0f}" if shown >= 9.95 else number_of(shown, 2)


JSON = "crosstalk.json"


def crosstalk_files(
    array: Array, circuit: Profile | None = None, data: dict[str, Any] | None = None
) -> dict[str, bytes]:
    """Return the files by their names; `circuit` is drawn on the patch, `data` the result of `crosstalk`, if known.

    Raises Refusal for units without an estimate.
    """
    data = data or crosstalk(array)
    return {
        JSON: (json.dumps(data, indent=1, allow_nan=False) + "\n").encode(),
        "crosstalk.csv": crosstalk_csv(array),
        "crosstalk.svg": heat_map_svg(data).encode(),
        "crosstalk-edge.svg": heat_map_svg(data, target="nearest_edge").encode(),
        "crosstalk-patch.svg": patch_map_svg(array, data, circuit).encode(),
    }


CROSSTALK = JSON
STEP = "circuit.step"


def extras(array: Array, only: Sequence[str]) -> tuple[dict[str, bytes], dict[str, str]]:
    """Return circuit and crosstalk files by path, for the outputs `only`, and the reason for a missing one.

    Raises Refusal for a circuit that does not fit.
    """
    files: dict[str, bytes] = {}
    lacking: dict[str, str] = {}
    if "unit" in only:
        files, lacking = circuit_files(array)
        if files and "step" in array.unit.output.formats:
            try:
                from unitcad.export.step import content

                files[STEP] = content([circuit_body(array)], "circuit")
            except Missing as missing:
                lacking[STEP] = str(missing)
    if "estimate" in only:
        try:
            files |= crosstalk_files(array, outline(array) if has_circuit(array) else None)
        except Refusal as refusal:
            lacking[CROSSTALK] = str(refusal)
    return files, lacking
