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
from unitcad.casting.sentences import say
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
GOOD_DEG = {"phone": 0.2, "spirit_level": 0.03}
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
    layers = in_layers(moulds.spec.moulds)
    if in_resin(moulds):
        return say("print.attitude_resin", layers=layers)
    own = (f"{key.replace('_', ' ')} {value}" for key, value in slicer_settings(moulds).items() if "layer" not in key)
    return say("print.attitude_filament", settings="; ".join((layers, *own)))


def in_layers(lengths: MouldsTable) -> str:
    """Write the layers of the printer."""
    return say("print.layers", layer=number(lengths.layer_mm, 3), first=number(lengths.first_layer_mm, 3))


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
    time, most = duration(minutes), number(cm3, 2)
    names = [join_words(plan.called(one.name).replace(",", "") for one in plate) for plate in files.values()]
    there = "; ".join(f"{path} with {each}" for path, each in zip(files, names, strict=True))
    listed = "print.one_plate" if len(files) == 1 else "print.several_plates"
    lie = "print.some_turned" if turned else "print.as_they_lie"
    how = [say(listed, lie, count=len(files), plates=there, turned=join_words(turned) if turned else "")]
    layers, printer = in_layers(lengths), lengths.printer
    if resin:
        how.append(say("print.resin", time=time, cm3=most, printer=printer, layers=layers))
        how += plate_sentences(moulds)
    else:
        low, high = (number(error, 2) for error in FDM_ERROR)
        how.append(say("print.filament", time=time, cm3=most, low=low, high=high))
        how.append(
            say(
                "print.settings_foot" if _has_foot(moulds) else "print.settings",
                printer=printer,
                layers=layers,
                perimeters=PERIMETERS,
                infill=INFILL_PERCENT,
                foot=number(foot_mm(printer_of(spec)), 3),
            )
        )
        how.append(say("print.first_layer", first=number(lengths.first_layer_mm, 3)))
    percent, wider = number(lengths.shrinkage_percent, 2), number(lengths.bore_compensation_mm, 2)
    if lengths.shrinkage_percent:
        altered = "print.larger_wider" if lengths.bore_compensation_mm else "print.larger"
        how.append(say(altered, percent=percent, wider=wider))
    elif lengths.bore_compensation_mm:
        how.append(say("print.wider", wider=wider))
    if plan.of_kind("cup"):
        how.append(say("print.fit_coupon", printer=printer))
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
    marked = "sort.cups_and_lids" if plan.of_kind("lid") else "sort.cups"
    if any(len(plan.pieces_of(cup.name)) > 1 for cup in plan.of_kind("cup")):
        marked = "sort.split_cups"
    yield BenchStep(
        say("sort.title"),
        say(
            marked,
            "sort.split" if plan.splits else "",
            base=f"{seen('B')}{label}",
            first=label[:2],
            second=label[2:],
            own=join_words(own),
            label=label,
        ),
        picture_path("pieces"),
        minutes=5.0,
    )
    cut = [tongue for tongue in plan.of_kind("tongue") if tongue.made == "cut"]
    if cut and dims.exit:
        length = plan.layout.cup[0] - min(abs(c.x) for c in plan.layout.cells) + GRIP_GAP + GRIP_LENGTH
        yield BenchStep(
            say("cut_tongues.title"),
            say(
                "cut_tongues.text",
                tongues="one tongue" if len(cut) == 1 else f"{len(cut)} tongues",
                length=number(length, 2),
                width=number(dims.exit.width, 3),
                height=number(dims.exit.height, 3),
                radius=number(dims.ledge_radius, 3),
                tab=number(GRIP_LENGTH, 2),
            ),
            picture_path("pieces"),
            minutes=5.0 * len(cut),
            required_tools=("flat pliers", "adhesive tape"),
        )
    yield from cleaning(moulds, silicones)
    yield from joining(moulds)
    required_tools = ("paper",)
    standing, leaf = ribs(moulds.frame), leaf_mm(printer_of(spec))
    fits = "dry_fit.plain"
    if plan.pins:
        fits = "dry_fit.pins"
    elif standing and leaf:
        fits = "dry_fit.leaves"
    elif standing:
        fits = "dry_fit.ribs"
        required_tools = ("paper", "vice and two boards")
    yield BenchStep(
        say("dry_fit.title"),
        say(
            fits,
            "" if plan.pins else "dry_fit.paper",
            "dry_fit.lids" if plan.of_kind("lid") and not plan.pins else "",
            ribs=len(standing),
            leaf=number(leaf, 2),
            relief=number(lengths.seat_relief_mm, 3),
        ),
        picture_path("dry-fit"),
        minutes=5.0 * cups,
        required_tools=required_tools,
    )
    if plan.of_kind("filament"):
        several_rows = len({cell.y for cell in plan.layout.cells}) > 1
        yield BenchStep(
            say("filament.title"),
            say(
                "filament.bend",
                "filament.several_rows" if several_rows else "",
                "filament.push",
                length=number(dims.core_height - moulds.plate[0] + SPARE, 2),
            ),
            picture_path("filament"),
            minutes=3.0 * cells,
            required_tools=("sharp knife",),
        )
    core = moulds.dimensions.core_height
    # The first whose rim takes a level: nothing on the base is higher.
    cup = spaced(next((step for step in plan.steps if step.rim >= core - 1e-9), plan.steps[-1]).cup)
    enough, tool = fall(moulds)
    if plan.steps[-1].injected:
        enough, tool = say("level.vents", degrees=number(TILT_DEG, 2)), "level"
    yield level(say("level.text", cup=cup, enough=enough), tool)


def level(text: str, tool: str) -> BenchStep:
    """Say how level the mould must be, and how to see it."""
    return BenchStep(say("level.title"), text, minutes=5.0, required_tools=(tool, "paper"))


def kept_away(silicones: Iterable[Material]) -> str:
    """Return the sentence on surfaces that keep these silicones from curing; empty if none is known."""
    surfaces = inhibitors(silicones)
    return f" {say('clean.inhibitors', surfaces=join_words(surfaces))}" if surfaces else ""


def cleaning(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how printed pieces get clean; `silicones` are those that a surface may keep from curing."""
    if not in_resin(moulds):
        yield BenchStep(
            say("clean.title"),
            say("clean.text") + kept_away(silicones),
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
    phone = name == "phone"
    enough = say(
        "level.phone" if phone else "level.spirit_level",
        degrees=number(GOOD_DEG[name], 2),
        error=number(left[name], 1),
        area=what,
        wide=number(wide, 3),
    )
    return enough, "level" if phone else "spirit level"


def joining(moulds: MouldSet) -> Iterator[BenchStep]:
    """Say how the pieces of split tools go together, before the first pour, and how their seams are sealed."""
    plan = moulds.plan
    if not plan.splits:
        return
    called = {split.tool: plan.called(split.tool) for split in plan.splits}
    parts = join_words(f"{called[split.tool]} in {len(split.pieces)} pieces" for split in plan.splits)
    base, *cups = plan.splits
    upper = [name for tool, name in called.items() if plan.tool(tool).kind == "cup"]
    in_line = ""
    if upper:
        at = {seam.at for cup in cups for seam in cup.seams}
        in_line = "join.same_gap" if any(seam.at in at for seam in base.seams) else "join.pins"
    yield BenchStep(
        say("join.title"),
        say(
            "join.text",
            "join.seal_cups" if upper else "join.seal_base",
            in_line,
            "join.fin",
            parts=parts,
            first="left" if base.seams[0].across == "x" else "back",
            base=called[base.tool],
            cups=join_words(upper) if upper else "",
            play=number(base.seams[0].play, 2),
        ),
        picture_path("pieces"),
        minutes=3.0 * sum(len(split.pieces) - 1 for split in plan.splits),
        required_tools=("wide adhesive tape", *["petroleum jelly"] * bool(upper)),
    )
