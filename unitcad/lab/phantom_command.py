"""unitcad phantom: procedure for the bench, printable pieces, tissue entry, expected response."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from unitcad import files
from unitcad.casting.figures import DATASHEET_C, MIXING_MIN, POURING_MIN, for_casting
from unitcad.catalogue import printers
from unitcad.cli.output import print_json, progress, warn
from unitcad.cli.shared_options import AsJson, Out
from unitcad.export import printing, svg
from unitcad.export.printing import print_ready
from unitcad.json_text import rounded
from unitcad.kernels.mesh import arrays, realise
from unitcad.lab.phantom import (
    LOSS_FACTOR,
    PLATE_PLAY,
    SEGMENTS,
    THINNER_MM,
    PhantomLayer,
    PhantomSet,
    Recipe,
    load_phantom,
    phantom_set,
    printed_pieces,
    stiffening,
    thinned,
    tissue_table,
)
from unitcad.meshcheck import Options, check_file
from unitcad.text import markdown, toml, toml_key

NEAR_LAYER = 0.02
"""A height this much of a printed layer off the grid counts as on it."""
EDGE_MM = 10.0
"""Nothing is measured nearer to the walls than this: the silicone climbs there."""


@dataclass(frozen=True)
class PhantomPour:
    """One pour: grams of part A, part B and thinner to weigh, and the weight of a millimetre of the layer."""

    layer: PhantomLayer
    recipe: Recipe
    part_a_g: float
    part_b_g: float
    thinner_g: float
    grams_per_mm: float


def pours(phantom: PhantomSet) -> list[PhantomPour]:
    """Return the pours in their order, the lowest layer first."""
    found = []
    for layer, one, volume in zip(phantom.table.layers, phantom.recipes, phantom.volumes_mm3, strict=True):
        box = volume * one.density_g_cm3 / 1e3
        total = box * (1 + phantom.table.waste)
        silicone = total * 100.0 / (100.0 + layer.thinner_pct)
        part_b = silicone / (1 + float(for_casting(one.silicone, "mix_ratio")))
        found.insert(0, PhantomPour(layer, one, silicone - part_b, part_b, total - silicone, box / layer.thickness_mm))
    return found


def casting_markdown(phantom: PhantomSet) -> str:
    """Write the procedure for the bench, with the sheet to fill in: two labs' phantoms can be compared by it."""
    found = pours(phantom)
    figures = []
    for i, p in enumerate(found, 1):
        edge = f"frame {i}, {p.layer.thickness_mm:g} mm" if i > 1 else f"the tray's rim, {p.layer.thickness_mm:g} mm"
        grams = f"{p.part_a_g:.1f}", f"{p.part_b_g:.1f}", f"{p.thinner_g:.1f}"
        silicone = p.recipe.silicone
        times = silicone.pot_life_min, silicone.cure_h
        hours = ["not known" if time is None else f"{float(time):.3g}" for time in times]
        figures.append((f"{i}", p.layer.name, edge, silicone.name, *grams, *hours, f"{p.grams_per_mm:.2f}"))
    sections = {
        "Recipe": [*_recipe(phantom), "", *_moduli(phantom)],
        "Before the first pour": _steps(_preparation(phantom)),
        "Pours": [
            *_table(
                "pour,layer,struck off at,silicone,A in g,B in g,thinner in g,pot life in min,cure in h,g a mm", figures
            ),
            "",
            f"Grams have {100 * phantom.table.waste:g} % extra. Thinner is by weight (assumed). Pot life and cure are "
            f"those without thinner at {DATASHEET_C:g} degC (data sheet); thinner makes both longer.",
            "",
            *_steps(_POUR),
        ],
        "Marks, and out of the box": _steps(_release(phantom)),
        "What to expect": _expectations(phantom),
        "Buy and have ready": _table("item,quantity,note", bill(phantom)),
        "Bench sheet": [
            "Date:                    Made by:                    Room, degC:",
            "",
            *_table(
                "pour,lot A / lot B,A in g,B in g,thinner in g,mixed at,poured at,box before in g,box after in g,"
                "thickness in mm,frame's height in mm",
                [(f"{i}", *[""] * 10) for i in range(1, len(found) + 1)],
            ),
        ],
    }
    lines = [
        f"# Casting the phantom {markdown(phantom.table.name)}",
        "",
        "Nothing of this tooling has been printed yet: every clearance is a choice with a check behind it. The phantom "
        "is repeatable, not skin-like: read [what to expect](#what-to-expect) first.",
    ]
    for title, texts in sections.items():
        lines += ["", f"## {title}", "", *texts]
    return "\n".join(lines) + "\n"


def _steps(texts: Iterable[str]) -> list[str]:
    return [f"{i}. {text}" for i, text in enumerate(texts, 1)]


def _table(head: str, rows: Iterable[tuple[str, ...]]) -> list[str]:
    names = head.split(",")
    return [f"| {' | '.join(row)} |" for row in (names, ["---"] * len(names), *rows)]


def _recipe(phantom: PhantomSet) -> list[str]:
    rows = [
        (
            layer.name, one.silicone.name, f"{layer.thinner_pct:g}",
            f"{one.modulus_kpa:.3g} ({one.low_kpa:.3g} to {one.high_kpa:.3g})", f"{layer.thickness_mm:g}",
        )
        for layer, one in zip(phantom.table.layers, phantom.recipes, strict=True)
    ]  # fmt: skip
    return _table("layer from the skin down,silicone,thinner to 100 of A + B,E in kPa,thickness in mm", rows)


_READY = {
    "scale": "reads 0.1 g",
    "level": "0.2 mm over the box's side",
    "calliper": "0.02 mm",
    "mixing cups and sticks": "a set for each pour",
    "vacuum chamber and pump": "degasses each mix before it is poured",
    "release agent, petroleum jelly, talc, nitrile gloves": "for all pours",
    "tape or clips": "hold the frames down",
    "pen": "marks the skin through the lid",
    "thin blade": "loosens the slab from the wall",
    "emery paper, fine": "roughens the plate",
    "silicone primer": "optional: bonds the lowest layer to the plate, in place of roughening it",
}


def bill(phantom: PhantomSet) -> Iterator[tuple[str, str, str]]:
    """Yield item, quantity and remark of the pieces to print, cut, buy and weigh."""
    for body in printed_pieces(phantom.tools):
        yield body.name, "1", f"print {'upside down' if body.upside_down else 'as drawn'} on {phantom.printer.name}"
    yield "plate", "1", f"acrylic, {_plate(phantom)}"
    found = pours(phantom)
    for name in dict.fromkeys(one.silicone.name for one in phantom.recipes):
        own = [p for p in found if p.recipe.silicone.name == name]
        parts = sum(p.part_a_g for p in own), sum(p.part_b_g for p in own)
        yield name, f"{parts[0]:.4g} g of A, {parts[1]:.4g} g of B", ""
    yield "silicone thinner", f"{sum(p.thinner_g for p in found):.4g} g", "of the silicones' maker"
    for item, note in _READY.items():
        yield item, "", note


def _plate(phantom: PhantomSet) -> str:
    side = 2 * (phantom.size.inner - PLATE_PLAY)
    return f"{side:.1f} x {side:.1f} x {phantom.table.plate_thickness_mm:g} mm"


def _moduli(phantom: PhantomSet) -> Iterator[str]:
    """Return the source of the moduli, the table of thinned silicones, and the effect of the frequency."""
    hertz = phantom.table.frequency_hz
    yield f"Moduli: {thinned()['source']}. They are quasi-static."
    yield "The range is two standard deviations of that table."
    yield (
        f"The upper end of a range has a factor of {stiffening(hertz):.3g} for {hertz:g} Hz, by the catalogue's "
        "fractional law (assumed to hold with thinner)."
    )


def _preparation(phantom: PhantomSet) -> Iterator[str]:
    table, found = phantom.table, pours(phantom)
    yield (
        "Print the pieces in the orientation of their files: the blade edge up, the lid flat. "
        "Uncured resin and latex keep silicone from curing: wash and post-cure resin prints fully, cast a small trial "
        "on each, and wear nitrile gloves."
    )
    height = float(phantom.printer.layer_mm)
    for p in found[1:]:
        thickness = p.layer.thickness_mm
        if abs(thickness / height - round(thickness / height)) > NEAR_LAYER:
            yield (
                f"Print the frame of the {p.layer.name} in layers of {thickness / math.ceil(thickness / height):.4g} "
                f"mm: {thickness:g} mm is no whole number of {height:g} mm layers, and half a layer more or less "
                "shows in the response."
            )
    sensitive = min(phantom.expected.sensitivity.items(), key=lambda pair: -abs(pair[1]))
    yield (
        f"Measure every frame's height at eight places. The {sensitive[0]} {THINNER_MM:g} mm thinner changes the "
        f"response at {max(table.points_mm):g} mm by {100 * sensitive[1]:.2g} %: reprint a frame that is more than "
        "0.05 mm off."
    )
    yield (
        f"Cut the acrylic plate, {_plate(phantom)}. Lay it into the tray, clean, and seal its edge all round with a "
        "thin bead of petroleum jelly; the holes below stay free."
    )
    yield (
        "Release agent sparingly on the inner walls of tray and frames, none on the plate. Silicone that cures on "
        f"acrylic does not bond to it: the {found[0].layer.name} only clings. Roughen the plate with emery paper, "
        "use a silicone primer on it, or take a perforated one. Check before measuring: pushed sideways with a finger, "
        "the slab must not slip, and through the plate from below no air shows. Level the tray to 0.2 mm over its side."
    )


_POUR = (
    "From the second pour on, when the layer before is firm: trim the film off the rim below, put the frame on the "
    "pegs and press it down all round. Hold it with tape on the outside or clips at the ears: nothing may be on the "
    "rim that the blade runs on. A thin line of petroleum jelly between the rims keeps it tight; wipe off the excess "
    "inside. No release agent on the silicone: the layers must bond.",
    "Weigh the box with its content, and write that down.",
    f"Weigh part A, part B and thinner. Mix for {MIXING_MIN:g} min (assumed), scraping the walls; degas; the pot life "
    f"runs from now, and pouring takes {POURING_MIN:g} min or more.",
    "Pour in a thin thread at one corner until the silicone rises above the rim, and prick the bubbles that rise.",
    "Strike off with the blade: along x, its edge on the rim at both sides, drawn once from one end to the other along "
    "y, between the pegs. Wipe the rims and weigh the box again: the difference over the grams a millimetre is the "
    "thickness. Top up and strike again if it is low by 0.05 mm or more.",
    "Cure level, covered, until a touch on the overflow is dry. Much thinner stays tacky: talc, after the last layer.",
)


def _release(phantom: PhantomSet) -> Iterator[str]:
    seat = phantom.table.unit_diameter_mm
    yield (
        f"Talc the skin, put the lid on and mark with a pen: the seat of the unit, a circle of {seat:g} mm whose "
        "notch is the point at 0 mm, and the points at "
        f"{', '.join(f'{d:g}' for d in sorted(phantom.table.points_mm))} mm from its edge. Take the lid off."
    )
    yield "Measure in the box: its walls count in the design. Fix the tray on the table with clamps at its ears."
    yield (
        "To take the slab out: lift the frames off, run a thin wet blade round the wall, and push the plate up "
        "through the four holes of the tray, evenly. The cavity widens upwards. Never pull the silicone: it is "
        "carried on its plate."
    )
    yield (
        "Thinner migrates between layers and out of the skin, so the moduli change with age: write down the age at "
        "each measurement, and compare labs at the same age, such as 7 days (assumed)."
    )
    yield f"Keep the measured points {EDGE_MM:g} mm or more from the walls. Cut nothing off the skin."


def _expectations(phantom: PhantomSet) -> Iterator[str]:
    table, e = phantom.table, phantom.expected
    yield (
        f"|u_z| of the skin at {table.frequency_hz:g} Hz over its value at the unit's edge, the motor's disc pressing "
        "evenly, by the layered solver with moduli from quasi-static compression. The range takes loss factors "
        f"({LOSS_FACTOR[1]:g} to {LOSS_FACTOR[2]:g}, assumed), moduli (up to the effect of the frequency) and "
        "thicknesses each by itself."
    )
    yield ""
    rows = zip(e.value, e.low, e.high, e.forearm, strict=True)
    cells = [(f"{mm:g}", *(f"{u:.3f}" for u in row)) for mm, row in zip(e.distances_mm, rows, strict=True)]
    yield from _table("mm from the edge,expected,low,high,the forearm template", cells)
    yield ""
    for name, change in e.sensitivity.items():
        yield f"- {name} {THINNER_MM:g} mm thinner: {100 * change:+.2g} % at {e.distances_mm[-1]:g} mm"
    yield ""
    yield (
        "It is repeatable, not skin-like: silicone decays too little, and the curve is off the forearm template's "
        f"by a factor of {e.factor:.2g} on average. Two labs compare their chains on it, not their skins."
    )
    yield ""
    yield (
        f"A wall sends back {e.echo_pct:.2g} % at {e.distances_mm[-1]:g} mm at most: {phantom.size.inner:g} mm "
        f"from the unit's centre, and {e.wall_mm:g} mm would give {table.most_echo_pct:g} % (a mirror's estimate)."
    )


FINISHED = "casting.md"
"""The file that is put in place last: a folder that has it is whole."""


def contents(phantom: PhantomSet, stage: Callable[[str], None] = lambda name: None) -> dict[str, bytes]:
    """Return the files of a phantom's folder by their names, the pieces as STL and one 3MF."""
    found: dict[str, bytes] = {}
    parts = []
    for body in printed_pieces(phantom.tools):
        stage(body.name)
        ready = print_ready(*arrays(realise(body.shape, SEGMENTS)), body.upside_down)
        found[f"moulds/{body.name}.stl"] = printing.stl(*ready, body.name)
        parts.append(printing.MeshPart(body.name, body.colour, *ready))
    bed = float(phantom.printer.bed_x_mm), float(phantom.printer.bed_y_mm)
    found["moulds/moulds.3mf"] = printing.content(parts, bed)
    stage("pages")
    # The box filled, cut through the pegs of one side and, of the lid, nothing: frames, layers and plate.
    shown = [body for body in phantom.tools if body.kind in ("base", "frame") or body.made == "cut"]
    regions = svg.cut([*shown, *phantom.layers], SEGMENTS)
    texts = {
        "section.svg": svg.section(regions, title=f"Phantom {phantom.table.name}: box and layers", ground=""),
        "response.json": json.dumps(rounded(asdict(phantom.expected)), indent=1, allow_nan=False) + "\n",
        "tissue.toml": tissue_toml(phantom),
        FINISHED: casting_markdown(phantom),
    }
    return {**found, **{name: text.encode() for name, text in texts.items()}}


def tissue_toml(phantom: PhantomSet) -> str:
    """Return [tissue.NAME] for a spec, which chooses it by estimate.tissue."""
    name = toml_key(f"phantom-{phantom.table.name}")
    lines = [
        "# For a spec: paste it there, and choose it:",
        "# [estimate]",
        f'# tissue = "phantom-{phantom.table.name}"',
    ]
    for layer, table in tissue_table(phantom).items():
        lines += ["", f"[tissue.{name}.{toml_key(layer)}]", *(f"{key} = {toml(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def write(folder: Path, found: Mapping[str, bytes], printer: str) -> list[str]:
    """Write the files into a folder, then check the meshes there; return the findings that are errors, as lines.

    All are written under another name first; the procedure is put in place last. Raises OSError if that fails.
    """
    files.replace_all(folder, found, FINISHED)
    meshes = sorted(str(folder / name) for name in found if name.endswith((".stl", ".3mf")))
    options = Options(printer=printers()[printer])
    return [
        f"{Path(path).name}: {finding.code} {finding.message}"
        for path in meshes
        for finding in check_file(path, options).findings
        if finding.severity == "error"
    ]


def phantom(
    source: Annotated[
        str, typer.Argument(metavar="[PHANTOM]", help="Phantom file, or name of a shipped one (unitcad list phantoms).")
    ] = "skin",
    out: Out = Path("out"),
    as_json: AsJson = False,
) -> None:
    """Make a skin phantom to cast, and its response.

    Box with a screed frame a layer, lid, procedure with recipe and bench sheet, the tissue for an estimate, and the
    response to expect. The last line printed is the folder.
    """

    table = load_phantom(source)
    with progress("phantom") as stage:
        stage("response")
        made = phantom_set(table)
        found = contents(made, stage)
        stage("checks")
        folder = out / f"phantom-{table.name}"
        faults = write(folder, found, made.printer.name)
    if as_json:
        print_json({"folder": str(folder), "findings": faults, "response": asdict(made.expected)})
    else:
        off = f"{made.expected.factor:.2g}"
        typer.echo(f"repeatable, not skin-like: its response is off the forearm template by a factor of {off}")
        typer.echo(str(folder))
    for fault in faults:
        warn(f"finding: {fault}")
    if faults:
        raise typer.Exit(1)
