"""A leak and bore coupon: a small mould of one layer, printed in about ten minutes and measured with calipers.

Base, cup and tongue are drawn as those of a unit; only the plate is thin and ends with the cup. So the seat, the bore,
the ribs, the window and the first layers are those of the moulds that follow.

            rim
    .------.    .----------------.    bore: from below, through the recess; rim: from above
    | cup  |    ========== tongue      window: its width in the cup
    |  .---'----'----------.     |
    '--|     plinth        |-----'    seated: over all, the cup pressed home
    .----------------------------.
    '---------- base ------------'    across: cup and base together

Each reading corrects one length of the printer's entry by its difference from the drawn length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from msgspec import Meta, Struct, structs, to_builtins

from unitcad import files
from unitcad.casting.coupon import SHARES, Coupon, write_pieces
from unitcad.casting.figures import FDM_ERROR, print_min
from unitcad.casting.preparation import foot_mm, in_layers, print_description, slicer_settings
from unitcad.catalogue import Printer, PrinterEntry, choose, printers
from unitcad.catalogue.entries import FirstLayer, between, kinds_of
from unitcad.designs.dimensions import Exit
from unitcad.errors import Refusal
from unitcad.export import printing, raster
from unitcad.kernels.mesh import arrays
from unitcad.moulds.base import core, notch, outline, plate_top, plinth
from unitcad.moulds.cup import SLOPE, ribs, skirt_end, window_section
from unitcad.moulds.layout import MARK
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Extrude, cut, union
from unitcad.shape.tree import Body
from unitcad.spec import Spec
from unitcad.spec.layers import layers_of
from unitcad.text import number, toml
from unitcad.validation import from_data

BORE, RESIN_BORE, TAIL, PLATE = 8.0, 14.0, 2.0, 1.2
"""Diameter of the bore, width of the tail, least thickness of the plate, mm. Leaves of resin need longer faces."""
FILL = "washing-up liquid"
"""As thick as a thin silicone, about 500 cps, and it comes off with water."""
LEAK_MIN = 10
SLICED_MM = 0.05
"""Error of a height from which the slicer's first layer is suspected, mm: a smaller one is squish."""
PLAY_MM = 1.0
"""Most by which a length is printed too large or too small, mm: beyond it the caliper is on another face."""
FOOT = "elephant_foot_mm"
"""The key that a spec's moulds don't have."""
_OF_RIBS = "seated", "outside", "across", "ribs"
_Length = Annotated[float, between(0, 100)]


class Readings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Readings of both coupons: lengths of the leak coupon, mm; stations of the fit coupon, 1 to 5."""

    bore_mm: Annotated[_Length | None, Meta(description="bore of the cup, from its seat's side")] = None
    rim_mm: Annotated[_Length | None, Meta(description="the same bore at its rim, which was on the bed")] = None
    window_mm: Annotated[_Length | None, Meta(description="width of the window")] = None
    tongue_mm: Annotated[_Length | None, Meta(description="width of the tongue's thin end")] = None
    cup_mm: Annotated[_Length | None, Meta(description="height of the cup")] = None
    seated_mm: Annotated[_Length | None, Meta(description="height of base and cup, the cup pressed home")] = None
    outside_mm: Annotated[_Length | None, Meta(description="width of the cup along y, halfway up")] = None
    across_mm: Annotated[_Length | None, Meta(description="largest width along y of the cup pressed on its base")] = (
        None
    )
    first_layer_mm: Annotated[FirstLayer | None, Meta(description="first layer that the slicer was set to")] = None
    leak: Annotated[Literal["none", "seat", "tongue", "both"] | None, Meta(description="where liquid came out")] = None
    recess: Annotated[int, between(1, 5, "station of the fit coupon's recess")] | None = None
    ribs: Annotated[int, between(1, 5, "station of the fit coupon's ribs")] | None = None
    window: Annotated[int, between(1, 5, "station of the fit coupon's window")] | None = None
    hole: Annotated[int, between(1, 5, "station of the fit coupon's filament hole")] | None = None
    wall: Annotated[int, between(1, 5, "station of the fit coupon's wall")] | None = None
    number: Annotated[int, between(1, 5, "station of the fit coupon's engraving")] | None = None


@dataclass(frozen=True)
class Gauge:
    """A length to measure: its name, the place of the jaws, mm as drawn, the accepted readings, what it shows."""

    name: str
    place: str
    drawn_mm: float
    low_mm: float
    high_mm: float
    shows: str
    setting: str


@dataclass(frozen=True)
class Setting:
    """A length of the printer's entry that readings give: its key, mm, and the reason."""

    key: str
    value: float
    why: str


class LeakCoupon:
    """The coupon of a printer: its pieces, its gauges, its page.

    `name`: a printer of the catalogue, or of the user's `own` entries. Raises Refusal for another one.
    """

    def __init__(self, name: str, own: Mapping[str, PrinterEntry] | None = None) -> None:
        self.printer = choose("PRINTER", name, printers(own))
        self.resin = self.printer.technology.value == "sla"
        self.own: dict[str, Any] = to_builtins((own or {}).get(name)) or {}
        self.spec = _spec(name, {name: self.own} if self.own else {}, RESIN_BORE if self.resin else BORE)
        self.moulds = MouldSet(self.spec)

    @property
    def like(self) -> str | None:
        """The shipped printer that an entry of the user's is like; None for an entry with all keys of its own."""
        return self.own.get("like") if self.own else self.printer.name

    @cached_property
    def pieces(self) -> tuple[Body, ...]:
        """Base, cup and tongue, as they are assembled."""
        frame, lay = self.moulds.frame, self.moulds.frame.lay
        plate = Extrude(outline(lay.cup, MARK), self.bottom, plate_top(self.spec))
        solid = union((plate, plinth(frame), core(frame.dims)))
        base = cut(solid, [notch(frame, self.exit, 1)])
        plan = self.moulds.plan
        bodies = [replace(plan.of_kind("base")[0], name="leak-base", shape=base)]
        for kind in ("cup", "tongue"):
            piece = plan.of_kind(kind)[0]
            bodies.append(replace(piece, name=f"leak-{kind}", shape=piece.file or piece.shape, file=None))
        return tuple(bodies)

    @property
    def exit(self) -> Exit:
        """The way out of the tail."""
        return cast("Exit", self.moulds.frame.dims.exit)

    @property
    def bottom(self) -> float:
        """Return z of the plate's lower face: whole layers under its upper one, so the rest is printed as a mould's."""
        return plate_top(self.spec) - layers_of(self.spec).up(PLATE)

    @property
    def ribbed(self) -> bool:
        """Whether ribs centre the cup."""
        return bool(ribs(self.moulds.frame))

    @property
    def printed(self) -> tuple[Body, ...]:
        """The pieces that are printed: of resin no tongue."""
        return tuple(body for body in self.pieces if body.made == "printed")

    @property
    def minutes(self) -> float:
        """Roughly how long it prints, min."""
        solid = sum(self.moulds.mesh(body).volume() for body in self.printed)
        return print_min(self.spec, solid, self.drawn["seated"])

    @cached_property
    def drawn(self) -> dict[str, float]:
        """The length of each gauge as drawn, mm; heights as the printer's layers make them."""
        frame, moulds = self.moulds.frame, self.spec.moulds
        dims, lay, layers = frame.dims, frame.lay, layers_of(self.spec)
        half, _, _ = window_section(self.spec, self.exit, dims.heights[0])
        rim, seat = dims.heights[0], -self.bottom
        return {
            "bore": 2 * dims.outer_radius,
            "rim": 2 * dims.outer_radius,
            "window": 2 * half,
            "tongue": self.exit.width,
            "cup": layers.printed(rim - skirt_end(self.spec)),
            "seated": layers.printed(seat) + layers.printed(rim),
            "outside": 2 * lay.cup[1],
            "across": 2 * lay.cup[1],
            "first_layer": moulds.first_layer_mm,
        }

    @cached_property
    def gauges(self) -> dict[str, Gauge]:
        """The lengths to measure, by name, each with the readings that its key can make up for."""
        m, drawn = self.spec.moulds, self.drawn
        pressed = m.rib_interference_mm / SLOPE
        foot = self.foot_mm
        rows = (
            ("bore", "the cup's bore from below, through the recess, jaws at its seat",
             2 * (0.5 - m.bore_compensation_mm), 0.5, "the bore",
             "bore_compensation_mm = now + (drawn - bore) / 2, at least 0"),
            ("rim", "the same bore at the rim that was on the bed", 1.0, 2 * foot or 0.5, "squish sideways",
             f"elephant_foot_mm = {number(foot, 3)} + (bore - rim) / 2" if foot else
             "the slicer's bottom tolerance: (bore - rim) / 2 more"),
            ("window", "the window's width in the cup's wall", 1.0, PLAY_MM, "the tongue's fit",
             "window_clearance_mm and plinth_clearance_mm: "
             f"now + ({number(drawn['window'] - drawn['tongue'], 3)} - (window - tongue)) / 2"),
            ("tongue", "the tongue's width, at its thin end", 1.0, PLAY_MM, "the tongue's fit", "see window"),
            ("cup", "the cup's height, rim to skirt", 0.5, 0.5, "squish in height",
             "no key: the slicer's first layer, or its Z offset"),
            ("seated", "base and cup over all, pressed together by hand", 1.0, pressed + PLAY_MM, "rib crush",
             f"rib_interference_mm = now - {number(SLOPE, 3)} (seated - drawn)"),
            ("outside", "the cup's width along y, halfway up", 1.0, PLAY_MM, "the cup's middle", "see across"),
            ("across", "cup and base together along y, the cup pushed sideways", 1.0, 1.5 * PLAY_MM, "play",
             "rib_interference_mm = now + (across - outside)"),
        )  # fmt: skip
        return {
            name: Gauge(name, place, drawn[name], drawn[name] - less, drawn[name] + more, shows, setting)
            for name, place, less, more, shows, setting in rows
            if self.ribbed or name not in _OF_RIBS
        }

    @property
    def foot_mm(self) -> float:
        """Elephant foot compensation of the slicer, mm; 0 of resin."""
        return 0.0 if self.resin else foot_mm(self.printer)

    def settings(self, readings: Readings) -> tuple[list[Setting], list[str]]:
        """Return the lengths of the printer's entry that readings give, and advice that no key carries.

        A station of the fit coupon was tried by hand: its value goes before a computed one. Raises Refusal for a
        reading out of its range, and for one that needs another.
        """
        self._check(readings)
        found, advice = self._computed(readings)
        for name, fit in Coupon(self.printer).fits.items():
            station = getattr(readings, name)
            if station is not None:
                found[fit.key] = Setting(fit.key, fit.values_mm[station - 1], f"station {station} of the fit coupon")
        return [found[key] for key, _ in kinds_of(Printer) if key in found], advice

    def _check(self, readings: Readings) -> None:
        for name, gauge in self.gauges.items():
            value = getattr(readings, f"{name}_mm")
            if value is not None and not gauge.low_mm <= value <= gauge.high_mm:
                limit = (
                    f"{gauge.place}: drawn {number(gauge.drawn_mm, 4)} mm; the printer's entry can make up for "
                    f"{number(gauge.low_mm, 4)} to {number(gauge.high_mm, 4)} mm"
                )
                nearest = gauge.low_mm if value < gauge.low_mm else gauge.high_mm
                raise Refusal(f"readings.{name}_mm", value, limit, round(nearest, 3))
        given = {key: value for key, value in structs.asdict(readings).items() if value is not None}
        for key, value in given.items():
            if key.removesuffix("_mm") in _OF_RIBS and not self.ribbed:
                raise Refusal(f"readings.{key}", value, f"the cups of {self.printer.name} have no ribs")
        for one, other in (("rim", "bore"), ("window", "tongue"), ("tongue", "window"), ("across", "outside")):
            if f"{one}_mm" in given and f"{other}_mm" not in given:
                raise Refusal(f"readings.{other}_mm", None, f"is required with {one}_mm")
        if not given:
            raise Refusal("readings", None, f"has no value; give one of {', '.join(structs.asdict(readings))}")

    def _computed(self, readings: Readings) -> tuple[dict[str, Setting], list[str]]:
        m, drawn, found, advice = self.spec.moulds, self.drawn, dict[str, Setting](), list[str]()

        def put(key: str, value: float, why: str) -> None:
            found[key] = Setting(key, round(value, 3) + 0.0, why)

        r = readings
        low = 0.0
        if r.first_layer_mm is not None:
            put("first_layer_mm", r.first_layer_mm, "as the slicer was set")
            low = r.first_layer_mm - m.first_layer_mm
        squish = 0.0
        if r.cup_mm is not None:
            squish = r.cup_mm - drawn["cup"] - low
            advice += self._height_advice(squish, r)
        if r.bore_mm is not None:
            error = (drawn["bore"] - r.bore_mm) / 2
            put("bore_compensation_mm", max(m.bore_compensation_mm + error, 0.0), f"the bore is {_off(-2 * error)}")
        if r.bore_mm is not None and r.rim_mm is not None:
            squeezed = (r.bore_mm - r.rim_mm) / 2
            why = f"the rim's bore is {_off(r.rim_mm - r.bore_mm)} than that at the seat"
            if self.resin:
                advice.append(f"Bottom tolerance in the slicer: {number(squeezed, 2)} mm more, since {why}.")
            else:
                put(FOOT, max(self.foot_mm + squeezed, 0.0), why)
        if r.window_mm is not None and r.tongue_mm is not None:
            wanted = (drawn["window"] - drawn["tongue"]) / 2
            short = wanted - (r.window_mm - r.tongue_mm) / 2
            why = f"tongue and window leave {number(wanted - short, 3)} mm a side, drawn {number(wanted, 3)}"
            put("window_clearance_mm", max(m.window_clearance_mm + short, 0.01), why)
            put("plinth_clearance_mm", max(m.plinth_clearance_mm + short, 0.01), why)
        crush, why = m.rib_interference_mm, list[str]()
        if r.seated_mm is not None:
            up = max(r.seated_mm - drawn["seated"] - 2 * (low + squish), 0.0)
            crush -= SLOPE * up
            why.append(f"the pressed cup stands {number(up, 2)} mm too high")
        if r.across_mm is not None and r.outside_mm is not None:
            shift = max(r.across_mm - r.outside_mm, 0.0)
            crush += shift
            why.append(f"it moves {number(shift, 2)} mm sideways")
        if why:
            least = 0.01
            put("rib_interference_mm", max(crush, least), " and ".join(why))
            if crush < least:
                advice.append("The plinth itself is tight: give window and tongue, which correct plinth_clearance_mm.")
        if r.leak in ("seat", "both"):
            advice.append(
                "Seat: press the cup home; if it is and liquid still comes, rub seat and plinth flat on 400 grit paper "
                "over glass, and smear petroleum jelly on the seat."
            )
        if r.leak in ("tongue", "both"):
            advice.append("Tongue: print another one with the window_clearance_mm above, and grease it.")
        return found, advice

    def _height_advice(self, off: float, readings: Readings) -> list[str]:
        m = self.spec.moulds
        if abs(off) < SLICED_MM:
            return [f"Heights: the cup is {_off(off)} than its layers, which is squish. Change nothing."]
        told = f"Heights: the cup is {_off(off)} than its layers."
        if readings.first_layer_mm is None:
            told += f" If the slicer's first layer was not {number(m.first_layer_mm, 3)} mm, read first_layer_mm again."
        return [
            f"{told} Otherwise {'lower' if off > 0 else 'raise'} the nozzle by {number(abs(off), 2)} mm (Z offset)."
        ]

    def entry(self, settings: Sequence[Setting], readings: Readings) -> str:
        """Return the keys of an entry of the user's own, as TOML: this printer, with the measured lengths."""
        read = [f"{key} {value}" for key, value in structs.asdict(readings).items() if value is not None]
        said = f"unitcad coupon {self.printer.name}: {', '.join(read)}"
        kept = {key: value for key, value in self.own.items() if key not in ("like", "status", "source")}
        default = {key: self.own[key] for key in ("status", "source") if key in self.own}
        values = {key: value if isinstance(value, dict) else {"value": value, **default} for key, value in kept.items()}
        lines = [
            *([f"like = {toml(self.like)}"] if self.like else []),
            'status = "measured"',
            f"source = {toml(said)}",
        ]
        values |= {setting.key: setting.value for setting in settings}
        order = [key for key, _ in kinds_of(Printer) if key in values]
        return "\n".join([*lines, *(f"{key} = {toml(values[key])}" for key in order)])

    def options(self, settings: Sequence[Setting], name: str) -> list[str]:
        """Return the options of `unitcad build` that set the lengths; `name`: of the entry, for a key only of it."""
        said = [f"--set moulds.{each.key}={each.value:g}" for each in settings if each.key != FOOT]
        for each in settings:
            if each.key == FOOT:
                said += [
                    f"--set printers.{name}.like={self.like or self.printer.name}",
                    f"--set printers.{name}.{FOOT}={each.value:g}",
                ]
                said.append(f"--set moulds.printer={name}")
        return said

    def markdown(self) -> str:
        """Explain how to print, fill and measure the coupon, with the key that each reading sets."""
        name, low, high = self.printer.name, *(round(self.minutes * error) for error in FDM_ERROR)
        takes = f"about {round(self.minutes)} minutes" if self.resin else f"{low} to {high} minutes"
        lines = [
            f"# Leak and bore coupon for {name}",
            "",
            f"Print `leak-coupon.3mf` as it lies: {in_layers(self.spec.moulds)}, without supports. It takes {takes}.",
            *(
                [f"Cut the tongue, {TAIL:g} mm wide, from film of {number(self.spec.moulds.slot_height_mm, 3)} mm."]
                if self.resin
                else []
            ),
            "",
            "1. Measure base, cup and tongue on their own.",
            "2. Press the cup onto the base, push the tongue in. Measure again.",
            f"3. Fill the cup with {FILL} and wait {LEAK_MIN} minutes on paper. Note where it comes out.",
            "",
            "| reading | place of the jaws | drawn, mm | shows | key of the printer's entry |",
            "| --- | --- | --- | --- | --- |",
        ]
        for gauge in self.gauges.values():
            lines.append(
                f"| `{gauge.name}_mm` | {gauge.place} | {number(gauge.drawn_mm, 4)} | {gauge.shows} | {gauge.setting} |"
            )
        lines += [
            "| `leak` | liquid on the paper: none, seat, tongue or both | none | seal | advice |",
            "",
            "Write the readings into `readings.toml`, or give each with `--read`. This prints the options of",
            "`unitcad build`, and adds an entry to a cupboard, your own catalogue file:",
            "",
            "```",
            f"unitcad coupon {name} --read bore_mm={number(self.drawn['bore'] - 0.15, 4)} --read leak=none",
            f"unitcad coupon {name} --read readings.toml --name mine --cupboard cupboard.toml",
            "```",
        ]
        return "\n".join(lines) + "\n"

    def form(self) -> str:
        """Return the text of readings.toml: every reading, commented, with its drawn length."""
        lines = [f"# Readings of the coupons of {self.printer.name}, mm. Remove the # before what you have read.", ""]
        for gauge in self.gauges.values():
            lines.append(f"# {gauge.name}_mm = {number(gauge.drawn_mm, 4)}  # {gauge.place}")
        first = number(self.spec.moulds.first_layer_mm, 3)
        lines += [
            f"# first_layer_mm = {first}  # the slicer's",
            '# leak = "none"  # none, seat, tongue or both',
            "",
            "# Stations of the fit coupon, 1 to 5; station 3 has the catalogue's value.",
        ]
        middle = SHARES.index(1.0) + 1
        lines += [f"# {name} = {middle}  # {fit.choose}" for name, fit in Coupon(self.printer).fits.items()]
        return "\n".join(lines) + "\n"

    def picture(self) -> bytes:
        """Draw the pieces taken apart, and assembled in section, as a PNG."""
        parts, lift = [], {"leak-base": 0.0, "leak-tongue": 7.0, "leak-cup": 12.0}
        beside = 1.5 * self.drawn["outside"]
        for body in self.pieces:
            mesh, name = self.moulds.mesh(body), body.name.removeprefix("leak-")
            half = mesh.trim_by_plane((0, 1, 0), 1 / 512).translate((beside, 0, 0))
            apart = mesh.translate((0, 0, lift[body.name]))
            parts += [raster.Surface(*arrays(apart), body.colour, name), raster.Surface(*arrays(half), body.colour)]
        return raster.draw(parts, (0.35, -1.0, 0.45), (1200, 640))

    def write(self, folder: Path) -> None:
        """Write the pieces, the plate, the page and the form into a folder. Raises OSError if it can't be written."""
        parts = write_pieces(folder, ((body, self.moulds.mesh(body)) for body in self.printed))
        bed = float(self.printer.bed_x_mm), float(self.printer.bed_y_mm)
        plate = printing.content(parts, bed, slicer_settings(self.moulds), print_description(self.moulds))
        files.write(folder / "leak-coupon.3mf", plate)
        files.write(folder / "leak-coupon.md", self.markdown().encode())
        files.write(folder / "leak-coupon.png", self.picture())
        files.write(folder / "readings.toml", self.form().encode())


def _off(difference: float) -> str:
    """Write a difference: 0.15 mm wider or higher."""
    return f"{number(abs(difference), 2)} mm {'larger' if difference > 0 else 'smaller'}"


def _spec(printer: str, own: dict[str, Any], bore: float) -> Spec:
    """Return the spec of the coupon's unit."""
    return from_data(
        {
            "name": "leak-coupon",
            "design": "encapsulating",
            "diameter_mm": bore,
            "motor": {"diameter_mm": bore - 3.0, "thickness_mm": 1.05},
            "fpcb": {"tail": "one", "tail_width_mm": TAIL, "pad_diameter_mm": bore - 4.0},
            "layers": [{"material": "ecoflex-00-30", "wall_mm": 1.2, "cap_mm": 1.2}],
            "moulds": {"printer": printer, "shrinkage_percent": 0.0},
            **({"printers": own} if own else {}),
        }
    )
