"""The page of an array: 3D view, patch, crosstalk, tools, circuit, places, casting and units; no connection."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import Manifold

from unitcad import files
from unitcad.arrays.array import Array
from unitcad.arrays.array_file import array_of
from unitcad.arrays.array_map import array_map
from unitcad.arrays.layouts import layouts
from unitcad.arrays.patch import PatchMoulds, PatchPart, patch_bodies, patch_moulds, patch_parts
from unitcad.casting.steps import duration
from unitcad.documents import read_json, read_toml
from unitcad.errors import UnitcadError
from unitcad.export import glb
from unitcad.export.raster import Surface, draw
from unitcad.kernels.mesh import arrays, bounds
from unitcad.meshcheck.findings import counted
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Plan, Step
from unitcad.pipeline.manifest import BENCH, PAGE, Manifest
from unitcad.pipeline.plan import glb_content, glb_part, joint_glb
from unitcad.report.html_page import MAP, VIEW, compress, drawing, picture, plain_page
from unitcad.report.read_results import expect, read_sound, read_table
from unitcad.shape import union
from unitcad.shape.tree import Body
from unitcad.skin_map import map_data
from unitcad.text import number

BELOW = 14.0
"""Distance by which inserted parts are drawn out of a sheet, towards the skin, mm."""


def patch_model(array: Array) -> dict[str, Any]:
    """Return the patch in the form of `page.model`, its GLB file as bytes; a body at several places is there once."""
    parts = _by_kind(patch_parts(array))
    shared = {part.name for part in parts if part.body.made == "cast" and not part.places}
    return {
        "makes": "patch",
        "unit": patch_glb(patch_moulds(array).blank, parts),
        "unit_apart": {part.name: [0.0, 0.0, 0.0 if part.name in shared else -BELOW] for part in parts},
        "row": min((place.y for place in array.places), key=abs),
        "axes": {"y": "along x", "x": "along y", "z": "level"},
    }


def _by_kind(parts: Sequence[PatchPart]) -> list[PatchPart]:
    """Return parts of which those that are put in, each a body of its own round a limb, are one for each kind."""
    put_in: dict[str, list[Body]] = {}
    for part in parts:
        if part.body.made != "cast" and not part.places:
            put_in.setdefault(part.body.kind, []).append(part.body)
    kept = [part for part in parts if part.body.made == "cast" or part.places]
    whole = (replace(bodies[0], name=kind, shape=union(b.shape for b in bodies)) for kind, bodies in put_in.items())
    return [*kept, *(PatchPart(body.name, body) for body in whole)]


def patch_glb(moulds: MouldSet, parts: Sequence[PatchPart]) -> bytes:
    """Return the GLB of an array's whole patch: the mesh of each distinct body once, a node at each of its places."""
    return joint_glb(
        moulds,
        [
            replace(
                glb_part(moulds, part.body),
                name=part.name,
                places=[glb.Standing(f"{p.name}-{part.body.name}", p.x, p.y, p.angle_deg) for p in part.places],
            )
            for part in parts
        ],
    )


def tools_model(array: Array) -> dict[str, Any]:
    """Return the tools of an array's sheet for the viewer, and their silicone: a GLB file as bytes, each pour.

    Lengths in mm. Raises UnitcadError if the tools can't be made.
    """
    moulds = patch_moulds(array).blank
    plan, apart = moulds.plan, dict(take_apart(moulds))
    pieces = {name: [piece.name for piece in plan.pieces_of(name)] for step in plan.steps for name in step.tools}
    bodies = {body.step: body.name for body in moulds.unit}

    def flat(step: Step) -> str:
        return "-flat" if is_moved_later(plan, step) else ""

    return {
        "moulds": glb_content(moulds, list(apart)),
        "moulds_apart": {body.name: list(offset) for body, offset in apart.items()},
        "cells": [],
        "moments": [
            {
                "title": f"Pour {step.index}, struck off",
                "parts": [
                    *(piece for name in step.tools for piece in pieces[name]),
                    *(bodies[i] + flat(step) for i in range(1, step.index + 1)),
                ],
            }
            for step in plan.steps
        ],
    }


LARGEST = 8_000_000
"""Bytes of a drawing or picture, at most."""
SIDES = ("skin-side", "bent", "back")
WORDS = {
    "patch-skin-side.png": "The patch from the skin's side",
    "patch-back.png": "The patch from its back",
    "patch-bent.png": "The patch round its limb",
    "tools.png": "Tools and cast silicone, taken apart",
    "crosstalk-patch.svg": "Vibration at each unit from all others, on the patch",
    "crosstalk.svg": "Crosstalk from each unit (row) to each other one (column)",
    "circuit.svg": "Outline of the circuit, pads and rows",
}
ARRAY_FILE = "array.toml"


class ArrayManifest(Manifest):
    """An array's manifest: `mould_checks`, `check` and `parts` are those of its tools and sheet and of its units.

    `array` has construction, layout, sheet, and the places with the folder of their unit's own result.
    """

    array: dict[str, Any]


def write_array_page(folder: Path, warn: Callable[[str], None]) -> Path:
    """Write `folder`/report.html of an array and return its path. Raises UnitcadError for a damaged manifest."""
    manifest = read_json(folder / "manifest.json", links=False)
    expect(manifest, ArrayManifest, folder / "manifest.json")
    target = folder / PAGE
    files.write(target, _page(folder, manifest, warn).encode("utf-8", "replace"))
    return target


def _page(folder: Path, manifest: ArrayManifest, warn: Callable[[str], None]) -> str:
    array, drawn = manifest["array"], [Path(path).name for path in manifest["pictures"]]

    def say(fault: str) -> None:
        warn(f"warning: {fault}")

    def table(name: str) -> dict[str, Any]:
        return read_sound(folder / name, read_table, say) or {}

    crosstalk = table("crosstalk.json")
    model = _model(folder, bool(crosstalk), warn)

    def figures(*paths: str) -> list[str]:
        return [_figure(folder / path, say) for path in paths]

    parts = [
        '<div class="top"><div>',
        f"<h1>{escape(manifest['name'])}</h1>",
        f'<p class="line">{escape(_line(array))}</p>',
        _chips(manifest),
        "</div></div>",
        *_section("3D", [VIEW if model else ""]),
        *_section("Warnings", [f"<p>{escape(line)}</p>" for line in manifest["warnings"]]),
        *_section("Patch", [*figures(*(f"pictures/patch-{side}.png" for side in SIDES)), _worn(array)]),
        *_section("Crosstalk", [_answer(crosstalk), *figures("crosstalk-patch.svg", "crosstalk.svg")]),
        *_section("Motion of the skin", [MAP if model and "skin_map" in model else ""]),
        *_section("Tools", figures(*(f"pictures/{name}" for name in drawn if not name.startswith("patch-")))),
        *_section("Circuit", figures("circuit.svg")),
        *_section("Casting", list(_casting(folder, table("casting.json")))),
        *_section("Units", [_units(folder, manifest)]),
        *_section("Places", [_places(array)]),
        *_section("Checks", [_checks(manifest)]),
        *_section("Files", [_files(manifest)]),
    ]
    return plain_page(manifest["name"], "\n".join(parts), model)


def _model(folder: Path, mapped: bool, warn: Callable[[str], None]) -> dict[str, Any] | None:
    """Return what the 3D view shows, and the map of the skin's motion if it is `mapped`.

    None, and a warning, if it can't be made, as of a unit that runs code.
    """
    try:
        array = array_of(read_toml(folder / ARRAY_FILE, links=False))
        model = {**patch_model(array), **tools_model(array)}
    except UnitcadError as error:
        warn(f"warning: no 3D view: {error}")
        return None
    if mapped:
        try:
            model["skin_map"] = map_data(array_map(array))
        except UnitcadError as error:
            warn(f"warning: no map of the skin's motion: {error}")
    return model | {key: compress(model[key]) for key in ("unit", "moulds")}


def _figure(path: Path, say: Callable[[str], None]) -> str:
    """Return a drawing or picture with its caption."""
    content = read_sound(path, partial(files.read, largest=LARGEST, links=False), say)
    if content is None:
        return ""
    words = WORDS.get(path.name) or f"Pour {path.stem.removeprefix('pour')}, cut open"
    is_svg = path.suffix == ".svg"
    image = drawing(content.decode("utf-8", "replace"), words) if is_svg else picture(content, words)
    return f"<figure>{image}<figcaption>{escape(words)}</figcaption></figure>"


def _line(array: Mapping[str, Any]) -> str:
    x0, y0, x1, y1 = array["sheet"]["outline_mm"]
    thick = array["sheet"]["high_mm"] - array["sheet"]["low_mm"]
    pitch = f", {number(array['pitch_mm'], 3)} mm from unit to unit" if array["pitch_mm"] else ""
    limb = f", for a limb of radius {number(array['radius_mm'], 3)} mm" if array["radius_mm"] else ""
    return (
        f"{counted(len(array['places']), 'unit')}, {array['construction']}{pitch}, on a sheet of "
        f"{number(x1 - x0, 3)} x {number(y1 - y0, 3)} x {number(thick, 3)} mm of {array['sheet']['material']}{limb}"
    )


def _worn(array: Mapping[str, Any]) -> str:
    """Say how the array bends round its limb."""
    bent = array.get("bending")
    if not bent:
        return ""
    flat = bent["strain_units_flat"]
    between = f", {number(100 * flat, 2)} % between units that stay flat" if flat else ""
    if array["cast"] == "curved":
        return (
            f"<p>Cast around the limb: worn, it is not stretched. Laid flat for its circuit, the sheet's faces are "
            f"stretched by {number(100 * bent['strain'], 2)} %{between}. At its edge a unit is "
            f"{number(bent['sagitta_mm'], 2)} mm off the skin (computed).</p>"
        )
    return (
        f"<p>Cast flat and bent: the sheet's middle, at a radius of {number(bent['middle_radius_mm'], 4)} mm, keeps "
        f"its length. A whole turn is {number(bent['closed_length_mm'], 4)} mm, which leaves "
        f"{number(bent['between_ends_mm'], 3)} mm between the ends. The sheet's faces are stretched by "
        f"{number(100 * bent['strain'], 2)} %{between}. At its edge a unit that stays flat is "
        f"{number(bent['sagitta_mm'], 2)} mm off the skin (computed).</p>"
    )


def _chips(manifest: ArrayManifest) -> str:
    findings, check = manifest["mould_checks"], manifest["check"]
    passed = sum(each["ok"] for each in findings)
    good = passed == len(findings) and not check["errors"]
    chips = [f"checks: {passed} of {len(findings)}"] if findings else ["checks: not run"]
    chips.append(f"{counted(check['errors'], 'error')} and {counted(check['warnings'], 'warning')} in the files")
    marked = "".join(f'<li class="chip {"good" if good else "bad"}">{escape(text)}</li>' for text in chips)
    return f'<ul class="chips">{marked}</ul>'


def _section(title: str, content: Iterable[str]) -> Iterator[str]:
    there = [part for part in content if part]
    if there:
        yield from (f"<section><h2>{escape(title)}</h2>", *there, "</section>")


def _answer(crosstalk: Mapping[str, Any]) -> str:
    lines = crosstalk.get("answer")
    if not lines or not isinstance(lines, list):  # none, or another program's file
        return ""
    first, *others = (escape(str(line)) for line in lines)
    return f'<p class="lead">{first}</p>' + "".join(f"<p>{line}</p>" for line in others)


def _casting(folder: Path, casting: Mapping[str, Any]) -> Iterator[str]:
    if not casting:
        return
    total, bench = duration(casting["earliest_finish_min"]), duration(casting["bench_min"])
    also = ', <a href="bench.html">bench page</a>' if (folder / BENCH).is_file() else ""
    yield (
        f"<p>{escape(total)} from the printed pieces on, of which {escape(bench)} at the bench. "
        f'<a href="casting.md">Procedure</a>{also}, <a href="bom.csv">bill</a>.</p>'
    )
    grams = [(item["item"], f"{number(item['quantity'], 3)} g") for item in casting["bill"] if item["unit"] == "g"]
    yield _table(("silicone", "to mix"), grams)


def _units(folder: Path, manifest: ArrayManifest) -> str:
    array = manifest["array"]
    count = Counter(place["unit"] for place in array["places"])
    rows = []
    for unit in array["units"]:
        page = f"{unit}/{PAGE}" if (folder / unit / PAGE).is_file() else f"{unit}/casting.md"
        rows.append(f'<tr><td><a href="{escape(page)}">{escape(unit)}</a></td><td>{count[unit]}</td></tr>')
    level = manifest["estimate"]
    said = f"<p>{escape(level['line'])}</p>" if level else ""
    return f"<table><thead><tr><th>unit</th><th>places</th></tr></thead><tbody>{''.join(rows)}</tbody></table>{said}"


def _places(array: Mapping[str, Any]) -> str:
    note = f"Seen from the back. {layouts()[array['layout']['kind']].naming}"
    head = ["place", "x, mm", "y, mm", "unit"]
    rows = [
        [p["name"], number(p["x_mm"], 4), number(p["y_mm"], 4), p["unit"].rpartition("/")[2]] for p in array["places"]
    ]
    if array["construction"] == "pockets":
        note += " The angle is that of the tail, counter-clockwise from x."
        head += ["tail's angle, degrees", "tail's end"]
        for row, place in zip(rows, array["places"], strict=True):
            under = place["name"] in array.get("covered_tails", [])
            row += [number(place["angle_deg"], 4), "under the sheet: solder wires on" if under else "free"]
    return f'<p class="note">{note}</p>' + _table(head, rows)


def _checks(manifest: ArrayManifest) -> str:
    broken = "".join(
        f"<li>{escape(each['code'])} {escape(each['where'])}: {each['value']:.3g} {escape(each['unit'])}, limit "
        f"{each['limit']:.3g}. {escape(each['advice'])}</li>"
        for each in manifest["mould_checks"]
        if not each["ok"]
    )
    meshes = "".join(
        f"<li>{escape(each['path'])}: {escape(each['code'])} {escape(each['message'])}</li>"
        for each in manifest["check"]["findings"]
    )
    return f"<ul>{broken}{meshes}</ul>" if broken or meshes else ""


def _files(manifest: ArrayManifest) -> str:
    own = [(path, entry["bytes"]) for path, entry in manifest["files"].items() if not path.startswith("units/")]
    rows = "".join(
        f'<tr><td><a href="{escape(path)}">{escape(path)}</a></td><td>{number(size / 1000, 3)} kB</td></tr>'
        for path, size in own
    )
    return f"<details><summary>{len(own)} files</summary><table><tbody>{rows}</tbody></table></details>"


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    top = "".join(f"<th>{escape(text)}</th>" for text in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


FINEST = 2.0
"""Length of an edge, at most, before it is mapped, mm: a long one would cut across the arc."""


def bent(array: Array, solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh of a cast solid around the limb: vertices (n, 3) in mm and faces (m, 3).

    x becomes the angle x over the middle's radius, z the distance from the limb's axis, which is y: the sheet's middle
    keeps its length. The middle of the array is on top. A curved casting is so already.
    """
    radius, middle = array.radius_mm, array.middle_radius_mm
    assert radius is not None  # an array that is worn flat has no such picture
    assert middle is not None
    if array.cast == "curved":
        vertices, faces = arrays(solid)
        return np.asarray(vertices, float) + np.array([0.0, 0.0, radius]), np.asarray(faces, np.int64)
    vertices, faces = arrays(solid.refine_to_length(FINEST))
    points = np.asarray(vertices, float)
    angle, distance = points[:, 0] / middle, radius + points[:, 2]
    around = np.column_stack([distance * np.sin(angle), points[:, 1], distance * np.cos(angle)])
    return around, np.asarray(faces, np.int64)


def limb(array: Array) -> Manifold:
    """Return the limb that the array is worn on as a cylinder, a little longer than the sheet is wide."""
    _, y0, _, y1 = array.sheet.outline
    length = 1.1 * (y1 - y0)
    cylinder = Manifold.cylinder(length, array.radius_mm or 0.0, circular_segments=180, center=True)
    return cylinder.rotate((90.0, 0.0, 0.0)).translate((0.0, (y0 + y1) / 2, 0.0))


SIZE = (960, 640)
"""Of a picture, px."""
GAP = 8.0
"""Between two pieces taken apart, mm."""
_Eye = tuple[float, float, float]
SKIN = (0.93, 0.80, 0.72)
ALONG = (0.35, -0.9, 0.45)
"""Along the limb, from the outside: sheet, units and skin are seen."""
SKIN_SIDE, BACK, ABOVE = (0.45, -0.8, -0.9), (0.45, -0.8, 0.9), (0.45, -1.0, 0.55)


def pictures(moulds: PatchMoulds) -> dict[str, Callable[[], bytes]]:
    """Return a function that draws the PNG of each picture, by its path."""

    def shown(eye: _Eye, surfaces: Callable[[], Iterable[Surface]]) -> Callable[[], bytes]:
        return lambda: draw(list(surfaces()), eye, SIZE)

    def patch() -> Iterable[Surface]:
        return (_solid(moulds, body) for body in patch_bodies(moulds.array))

    def worn() -> Iterable[Surface]:
        yield Surface(*arrays(limb(moulds.array)), SKIN)
        for body in patch_bodies(moulds.array):
            yield Surface(*bent(moulds.array, moulds.mesh(body)), body.colour)

    apart = shown(ABOVE, lambda: (_solid(moulds, *moved) for moved in take_apart(moulds)))
    names = {"patch-skin-side": shown(SKIN_SIDE, patch), "patch-back": shown(BACK, patch), "tools": apart}
    if moulds.array.radius_mm is not None:
        names["patch-bent"] = shown(ALONG, worn)
    names |= {f"pour{s.index}": shown(ABOVE, partial(_cut_open, moulds, s)) for s in moulds.plan.steps}
    return {f"pictures/{name}.png": picture for name, picture in names.items()}


def _solid(moulds: MouldSet, body: Body, by: _Eye = (0.0, 0.0, 0.0)) -> Surface:
    return Surface(*arrays(moulds.mesh(body).translate(by)), body.colour)


def take_apart(moulds: MouldSet) -> Iterator[tuple[Body, tuple[float, float, float]]]:
    """Yield tools and cast layers and how far each is moved (mm) to be shown apart.

    One over the other in the order of the pours; the pieces of a tool next to each other.
    """
    plan, top = moulds.plan, -np.inf
    first = [tool for tool in plan.tools if tool.step is None and tool.kind != "blade"]
    later = [row for step in plan.steps for row in _of_pour(moulds, step)]
    rows = [(first, 0.0), *((row, GAP) for row in later), (plan.of_kind("blade"), GAP)]
    for bodies, gap in rows:
        low = min((bounds(moulds.mesh(body))[2] for body in bodies), default=np.inf)
        up = max(0.0, top + gap - low) if gap and bodies else 0.0
        for body in bodies:
            top = max(top, bounds(moulds.mesh(body))[5] + up)
            pieces = plan.pieces_of(body.name) if body.role == "tool" else (body,)
            columns = next((split.columns for split in plan.splits if split.tool == body.name), 1)
            for k, piece in enumerate(pieces):
                row, column = divmod(k, columns)
                aside = column - (columns - 1) / 2, (len(pieces) / columns - 1) / 2 - row
                yield piece, (aside[0] * GAP, aside[1] * GAP, float(up))


def is_moved_later(plan: Plan, step: Step) -> bool:
    """Tell whether a pour's silicone is taken out and inserted into the last pour at another place."""
    last = plan.steps[-1]
    return step.index < last.index and not set(step.layer) <= set(last.earlier)


def _of_pour(moulds: MouldSet, step: Step) -> Iterator[tuple[Body, ...]]:
    """Yield the parts of one pour, from below: base and filaments, inserted layers, cup, silicone, lid."""
    plan, colours = moulds.plan, {body.step: body for body in moulds.unit}
    own = (*plan.standing(step, "base"), *plan.standing(step, "filament"))
    yield tuple(tool for tool in own if tool.step == step.index)
    before = plan.steps[step.index - 2] if step.index > 1 else None
    if before and is_moved_later(plan, before):
        yield tuple(colours[index] for index in range(1, step.index))
    yield from ((cup,) for cup in plan.standing(step, "cup"))
    cast = colours[step.index]
    if is_moved_later(plan, step):
        cast = replace(cast, name=f"{cast.name}-flat", shape=union(step.layer))
    yield (cast,)
    yield from ((lid,) for lid in plan.standing(step, "lid"))


def _cut_open(moulds: PatchMoulds, step: Step) -> Iterator[Surface]:
    """Yield a pour as it is struck off, without its nearer half: cut through a row of units."""
    y = min((place.y for place in moulds.array.places), key=abs) + 1 / 512
    solids = [(moulds.solids[name], moulds.plan.tool(name).colour) for name in step.tools]
    colours = {body.step: body.colour for body in moulds.unit}
    for shapes, pour in ((step.earlier, 1), (step.layer, step.index)):
        solids += [(solid, colours[pour]) for solid in moulds.meshes(shapes)]
    for solid, colour in solids:
        yield Surface(*arrays(solid.trim_by_plane((0, 1, 0), y)), colour)
