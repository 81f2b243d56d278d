"""The steps from the printer to an empty mould, and the plates to print."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from unitcad.casting.figures import (
    FDM_ERROR,
    print_min,
)
from unitcad.casting.plates import made_pieces, mould_plates
from unitcad.casting.resin import clean_resin, in_resin, plate_sentences
from unitcad.casting.steps import BenchStep, duration
from unitcad.casting.views import picture_path
from unitcad.catalogue import Material, Printer, inhibitors
from unitcad.designs.limits import leaf_mm
from unitcad.moulds.base import GRIP_GAP, GRIP_LENGTH
from unitcad.moulds.cup import ribs
from unitcad.moulds.layout import BLADE_HEIGHT
from unitcad.moulds.lid import DENT, TILT_DEG
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.lettering import seen
from unitcad.spec import MOTOR_SIZES, printer_of
from unitcad.spec.raw import MouldsTable
from unitcad.text import join_words, number, spaced

PERIMETERS = 3
INFILL_PERCENT = 20
SPARE = 2.0
"""Extra length of a piece of filament over its way through base and core, mm."""
FOOT_MM = 0.2
"""Elephant foot compensation of a printer whose entry has none, mm."""
MEASURED_MM = 0.05
"""Difference of a measured length from the drawn one from which it is worth to build again (assumed)."""
GOOD_DEG = {"a phone": 0.2, "a spirit level of 0.5 mm/m": 0.03}
"""Tilt that is left if the level reads none (assumed): two steps of a phone; a builder's level, turned end for end."""


def slicer_settings(moulds: MouldSet) -> dict[str, str]:
    """Return the settings of the sheet for each piece, by PrusaSlicer's names, of filament or of resin."""
    layer = f"{moulds.spec.moulds.layer_mm:g}"
    if in_resin(moulds):
        return {"layer_height": layer, "pad_enable": "0", "supports_enable": "0"}
    return {
        "elefant_foot_compensation": f"{foot_mm(printer_of(moulds.spec)) if _has_foot(moulds) else 0:g}",
        "fill_density": f"{INFILL_PERCENT}%",
        "layer_height": layer,
        "perimeters": str(PERIMETERS),
        "support_material": "0",
    }


def print_description(moulds: MouldSet) -> str:
    """Return the settings of the plates in words, the first layer's height among them, which no setting carries."""
    said = [in_layers(moulds.spec.moulds)]
    if in_resin(moulds):
        return f"Print in this attitude: {said[0]}; flat on the plate, no supports, no pad; casting.md has the wells"
    said += [f"{key.replace('_', ' ')} {value}" for key, value in slicer_settings(moulds).items() if "layer" not in key]
    return f"Print in this attitude: {'; '.join(said)}"


def in_layers(lengths: MouldsTable) -> str:
    """Write the layers of the printer."""
    return f"layers {number(lengths.layer_mm, 3)}, first layer {number(lengths.first_layer_mm, 3)} mm"


def foot_mm(printer: Printer) -> float:
    """Return the elephant foot compensation of a printer, mm."""
    return FOOT_MM if printer.elephant_foot_mm is None else float(printer.elephant_foot_mm)


def _has_foot(moulds: MouldSet) -> bool:
    """Tell whether the first layers of a piece would be in the way if they are wider."""
    return bool(moulds.plan.of_kind("cup") or moulds.plan.splits)


@dataclass(frozen=True)
class Size:
    """A length to measure before printing: its name, its paths in the source, mm as drawn, the assumption about it."""

    what: str
    keys: tuple[str, ...]
    value_mm: float
    assumed: str = ""


@dataclass(frozen=True)
class Printing:
    """The lengths to measure and the plates to print; `source` is the file in which others may be asked for.

    `plates` are the files; `minutes` and `cm3` (solid, so at most) are those of all; `how` has a sentence or two each.
    """

    sizes: tuple[Size, ...]
    source: str
    plates: tuple[str, ...]
    minutes: float
    cm3: float
    of: str
    how: tuple[str, ...]
    layer_mm: float
    first_layer_mm: float


def printing(moulds: MouldSet, solid_mm3: float, tallest_mm: float = 0.0) -> Printing:
    """Return the plates to print, and how. `solid_mm3`: volume of all printed pieces, solid; 0: their meshes'.

    `tallest_mm`: height of a piece that may be higher than core and blade.
    """
    spec, plan, lengths, resin = moulds.spec, moulds.plan, moulds.spec.moulds, in_resin(moulds)
    printed = [tool for tool in made_pieces(moulds) if tool.made == "printed"]
    mixed = {tool.kind for tool in printed if not tool.upside_down}
    turned = dict.fromkeys(
        spaced(t.name.partition("-")[0]) if t.kind in mixed else f"{t.kind}s" if t.step else t.kind
        for t in printed
        if t.upside_down
    )
    solid_mm3 = solid_mm3 or sum(moulds.mesh(tool).volume() for tool in printed)
    files = mould_plates(moulds)
    standing = plan.dimensions.core_height - moulds.plate[0]
    tallest = max(standing, BLADE_HEIGHT if plan.of_kind("blade") else 0.0, tallest_mm)
    minutes, cm3 = 5.0 * max(round(print_min(spec, solid_mm3, tallest) / 5), 1), solid_mm3 / 1000
    takes = f"About {duration(minutes)}, at most {number(cm3, 2)} cm3 of"
    names = [join_words(plan.called(one.name).replace(",", "") for one in plate) for plate in files.values()]
    there = "; ".join(f"{path} with {each}" for path, each in zip(files, names, strict=True))
    plates = f"Plate: {there}"
    if len(files) > 1:
        plates = f"{len(files)} plates, since one bed does not hold all: {there}"
    attitude = f" ({join_words(turned)} upside down)" if turned else ""
    how = [f"{plates}. Print the pieces as they lie{attitude}, without supports."]
    layers = f"Printer {lengths.printer}, {in_layers(lengths)}"
    if resin:
        how.append(
            f"{takes} resin. {layers}. Compensate the first layers' growth (bottom tolerance): it narrows a bore."
        )
        how += plate_sentences(moulds)
    else:
        foot = f", elephant foot compensation {number(foot_mm(printer_of(spec)), 3)} mm" if _has_foot(moulds) else ""
        low, high = (number(error, 2) for error in FDM_ERROR)
        how.append(f"{takes} filament (a slicer says {low} to {high} times that).")
        how.append(f"{layers}, {PERIMETERS} perimeters, {INFILL_PERCENT} % infill{foot} (in the 3MF for PrusaSlicer).")
        first = number(lengths.first_layer_mm, 3)
        how.append(f"Set the first layer to {first} mm in the slicer: no 3MF carries it, and heights depend on it.")
    altered = []
    if lengths.shrinkage_percent:
        altered.append(
            f"the tools are larger by {number(lengths.shrinkage_percent, 2)} %, for the silicone's shrinkage"
        )
    if lengths.bore_compensation_mm:
        wider = number(lengths.bore_compensation_mm, 2)
        altered.append(f"bores are wider by {wider} mm a side, which the printer takes away")
    if altered:
        how.append(f"In the files {', and '.join(altered)}.")
    if plan.of_kind("cup"):
        how.append(f"New printer: print the fit coupon (unitcad coupon {lengths.printer}).")
    return Printing(
        sizes(moulds),
        moulds.source.file,
        tuple(files),
        minutes,
        cm3,
        "resin" if resin else "filament",
        tuple(how),
        lengths.layer_mm,
        lengths.first_layer_mm,
    )


def sizes(moulds: MouldSet) -> tuple[Size, ...]:
    """Return the lengths of bought parts that the tools are drawn for."""
    path, spec = moulds.source.path, moulds.source.unit
    assumed = moulds.assumed
    lengths = {} if spec.motor.absent else {f"motor.{size}": getattr(spec.motor, size) for size in MOTOR_SIZES}
    if spec.fpcb:
        lengths["fpcb.thickness_mm"] = spec.fpcb.thickness_mm
    if spec.wires:
        lengths["wires.diameter_mm"] = spec.wires.diameter_mm
    if moulds.plan.of_kind("filament"):
        lengths["moulds.filament_mm"] = spec.moulds.filament_mm
    words = {"fpcb": "circuit", "moulds": "filament", "wires": "wire"}
    found = []
    for key, value in lengths.items():
        table, _, name = key.partition(".")
        what = f"{words.get(table, table)}{'' if table == 'moulds' else f' {name[:-3]}'}"
        found.append(Size(what, (path + key,), value, assumed.get(key, "")))
    return tuple(found)


def preparation(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe the way from the printer to an empty mould; `silicones` are those that a resin may keep from curing."""
    spec, plan, dims, lengths = moulds.spec, moulds.plan, moulds.plan.dimensions, moulds.spec.moulds
    cups, cells, label = len(plan.steps), len(plan.layout.cells), seen(plan.label)
    own = [f"C{step.index:X} on {spaced(step.cup)}" for step in plan.steps]
    own += [f"L{step.index:X} on {spaced(step.lid)}" for step in plan.steps if step.lid]
    own += [f"F on the {plan.called(tray.name)}" for tray in plan.of_kind("tray")]
    pieces = " Pieces of one tool have a number too." if plan.splits else ""
    marks = f"{label[:2]} and {label[2:]} on {'cups and lids' if plan.of_kind('lid') else 'cups'}, {join_words(own)}"
    if any(len(plan.pieces_of(cup.name)) > 1 for cup in plan.of_kind("cup")):
        marks = f"{join_words(own)}, and after it {label} where the piece has room"
    yield BenchStep(
        "Sort the pieces",
        f"Engraved: {seen('B')}{label} on the base, {marks}.{pieces}",
        picture_path("pieces"),
        minutes=5.0,
    )
    cut = [tongue for tongue in plan.of_kind("tongue") if tongue.made == "cut"]
    if cut and dims.exit:
        length = plan.layout.cup[0] - min(abs(c.x) for c in plan.layout.cells) + GRIP_GAP + GRIP_LENGTH
        yield BenchStep(
            "Cut the tongues",
            f"Cut {'one tongue' if len(cut) == 1 else f'{len(cut)} tongues'} of {number(length, 2)} x "
            f"{number(dims.exit.width, 3)} mm from film or steel {number(dims.exit.height, 3)} mm thick, without burr, "
            f"one end hollow to the ledge's radius of {number(dims.ledge_radius, 3)} mm. Fold tape over the other "
            f"end's last {number(GRIP_LENGTH, 2)} mm: you pull by this tab.",
            picture_path("pieces"),
            minutes=5.0 * len(cut),
            required_tools=("flat pliers", "adhesive tape"),
        )
    yield from cleaning(moulds, silicones)
    yield from joining(moulds)
    required_tools = ("paper",)
    fits = "Put each cup on the plinth once, dry; its cut corner lets it on one way only."
    standing, leaf = ribs(moulds.frame), leaf_mm(printer_of(spec))
    if plan.pins:
        fits = (
            "Put each cup over the pins once, dry; one pin stands off the square of the others, so it goes on one way "
            "only. It must lie flat: no paper goes under it. If it rocks, cut off the first layer's bulge round pins "
            "and holes and scrape both faces clean."
        )
    elif standing and leaf:
        fits = (
            f"Press each cup onto the plinth once by hand, cut corner over cut corner. Its {len(standing)} ribs stand "
            f"on leaves {number(leaf, 2)} mm thick, which bend and centre it; print a cup with a broken leaf again."
        )
    elif standing:
        fits = (
            "Press each cup onto the plinth once, dry, cut corner over cut corner, by hand or in a vice between two "
            f"boards: its {len(standing)} ribs are crushed and centre it from then on."
        )
        required_tools = ("paper", "vice and two boards")
    if not plan.pins:
        fits += (
            f" It sits if paper folded to {number(lengths.seat_relief_mm, 3)} mm goes under it on all four sides. If "
            "it rocks, scrape plinth and seat clean."
        )
        fits += " Put each lid on its cup once, cut corner over cut corner." if plan.of_kind("lid") else ""
    yield BenchStep(
        "Try every cup, dry", fits, picture_path("dry-fit"), minutes=5.0 * cups, required_tools=required_tools
    )
    if plan.of_kind("filament"):
        several_rows = len({cell.y for cell in plan.layout.cells}) > 1
        between = " If its groove ends under the plate, cut the bent end to length." if several_rows else ""
        yield BenchStep(
            "Filament in",
            "Bend each filament by a right angle, warm from hot water, one leg "
            f"{number(dims.core_height - moulds.plate[0] + SPARE, 2)} mm long.{between} Push that leg up through the "
            "core until the other is in the plate's groove. Trim it flush with the core's top.",
            picture_path("filament"),
            minutes=3.0 * cells,
            required_tools=("sharp knife",),
        )
    core = moulds.dimensions.core_height
    # The first whose rim takes a level: nothing on the base is higher.
    cup = spaced(next((step for step in plan.steps if step.rim >= core - 1e-9), plan.steps[-1]).cup)
    enough, tool = fall(moulds)
    if plan.steps[-1].injected:
        enough, tool = f"Within {number(TILT_DEG, 2)} degrees is good enough for the vents.", "level"
    yield level(
        f"Put the base in its final place, {cup} on it. Lay a level on the rim, along and across, and shim the base's "
        f"corners with paper. {enough} Take {cup} off.",
        tool,
    )


def level(text: str, tool: str) -> BenchStep:
    """Say how level the mould must be, and how to see it."""
    return BenchStep("Level the bench", text, minutes=5.0, required_tools=(tool, "paper"))


def kept_away(silicones: Iterable[Material]) -> str:
    """Return the sentence on surfaces that keep these silicones from curing; empty if none is known."""
    surfaces = inhibitors(silicones)
    return f" Keep {join_words(surfaces)} away from them: this silicone does not cure there." if surfaces else ""


def cleaning(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how printed pieces get clean; `silicones` are those that a surface may keep from curing."""
    if not in_resin(moulds):
        yield BenchStep(
            "Clean",
            "Brush off strings and loose bits. Run a fingernail round every bore and rim: cut off what catches."
            f"{kept_away(silicones)}",
            minutes=10.0,
            required_tools=("hand brush", "sharp knife"),
        )
        return
    yield from clean_resin(moulds, silicones, kept_away(silicones))


def fall(moulds: MouldSet) -> tuple[str, str]:
    """Say which level is good enough for an open pour, and what error remains; return the level among the tools too."""
    what, wide = moulds.plan.widest or ("cavity", 2 * moulds.dimensions.outer_radius)
    left = {name: wide * math.tan(math.radians(tilt)) for name, tilt in GOOD_DEG.items()}
    name = next((name for name, error in left.items() if error <= DENT), list(left)[-1])
    turned, tool = (", turned end for end,", "spirit level") if name != "a phone" else ("", "level")
    said = (
        f"{name.capitalize()}{turned} is good enough: {number(GOOD_DEG[name], 2)} degrees leave "
        f"{number(left[name], 1)} mm across the {what} of {number(wide, 3)} mm."
    )
    return said, tool


def joining(moulds: MouldSet) -> Iterator[BenchStep]:
    """Say how the pieces of split tools go together, before the first pour, and how their seams are sealed."""
    plan = moulds.plan
    if not plan.splits:
        return
    called = {split.tool: plan.called(split.tool) for split in plan.splits}
    parts = join_words(f"{called[split.tool]} in {len(split.pieces)} pieces" for split in plan.splits)
    (base, *cups), below = plan.splits, called[plan.splits[0].tool]
    upper = [name for tool, name in called.items() if plan.tool(tool).kind == "cup"]
    play = number(base.seams[0].play, 2)
    first = "left" if base.seams[0].across == "x" else "back"
    text = (
        f"Printed in pieces: {parts}, numbered from the {first}. Cut off the first layer's bulge along the "
        "dovetails. Push each piece straight down onto its neighbour, dovetail into dovetail, until a fingernail feels "
        "no step; scrape dovetails that jam. Seal each seam from outside, never on a face that silicone touches: tape "
        f"over the underside of the {below} and over the seam's ends"
    )
    if upper:
        in_line, at = "The pins hold the pieces of each cup in line", {seam.at for cup in cups for seam in cup.seams}
        if any(seam.at in at for seam in base.seams):
            in_line = (
                "Where base and cup are cut at the same gap, only dovetails and tape align them: keep the base on one "
                "flat board, and before each pour lay the blade's edge over that seam on the rim: no light may show "
                "under it"
            )
        text += (
            f"; petroleum jelly rubbed into the underside of {join_words(upper)}, flush. The tape stays on until the "
            f"{below} is off. {in_line}"
        )
    yield BenchStep(
        "Join the pieces",
        f"{text}. Trim the fin of {play} mm that silicone makes in a seam with the flash.",
        picture_path("pieces"),
        minutes=3.0 * sum(len(split.pieces) - 1 for split in plan.splits),
        required_tools=("wide adhesive tape", *["petroleum jelly"] * bool(upper)),
    )
