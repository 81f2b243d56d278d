"""Every key of a spec changes a written file or what the checks find: none is read by nothing."""

import base64
import copy
import typing
from functools import cache
from itertools import product
from pathlib import Path
from typing import Literal

import msgspec
import pytest
from trimesh import creation

from unitcad import catalogue
from unitcad.cache import MemoryStore, digest
from unitcad.casting import views
from unitcad.catalogue.entries import kinds_of
from unitcad.errors import Refusal
from unitcad.pipeline.make import make
from unitcad.pipeline.result import Progress
from unitcad.pipeline.unit import Unit
from unitcad.spec.body_file import on_grid
from unitcad.spec.custom_code import ANY, allow, allow_nothing
from unitcad.spec.fields import alternatives, entry_in, fields_of, notes, table_in
from unitcad.spec.raw import OUTPUTS, RawSpec
from unitcad.validation import from_data, put, read

OWN = "ours"
ENTRIES = {
    "materials": (catalogue.Material, catalogue.MaterialEntry, OWN),
    "motors": (catalogue.Motor, catalogue.MotorEntry, OWN),
    "printers": (catalogue.Printer, catalogue.PrinterEntry, OWN),
    "tissue": (catalogue.Tissue, catalogue.TissueEntry, f"{OWN}.skin"),
}
"""Free tables of the spec: a whole entry, what a spec may give of one, and the name of one in the specs below."""
PROVENANCE = ("status", "source")
"""Say where a value comes from. The casting procedure writes them beside a silicone's values; no file reads others'."""
_SOURCE = """from unitcad.shape import cut, cylinder
def drawn(radius, height): return cut(cylinder(radius, 0, height), [cylinder(4, -1, 2.2)])
def plain(spec): return drawn(6, spec.parameters["height_mm"])
def wide(spec): return drawn(7, spec.parameters["height_mm"])
"""


@cache
def _fit_text():
    return Path(__file__).with_name("lab-fit.toml").read_text("utf-8")


def _body_text(length):
    box = creation.box((16, length, 7))
    held = on_grid("", "layer1", box.apply_translation((0, 0, 3.5)).vertices, box.faces)
    return " ".join(
        ("unitcad bodies 1\nlayer1", *(base64.b64encode(part).decode() for part in (held.vertices, held.faces)))
    )


OTHERS = {
    "name": ("another",),
    "design": ("d.py:wide",),
    "layers.0.material": ("ecoflex-00-50",),
    "motor.part": ("VC0820B006F",),
    "moulds.printer": ("fdm-0.25",),
    "moulds.cavities": ([2, 1], "fill"),
    "moulds.bed_x_mm": (60.0,),
    "moulds.bed_y_mm": (40.0,),
    "estimate.tissue": ("forearm",),
    "output.formats": (["stl", "glb"],),
    "materials.ours.like": ("dragon-skin-30",),
    "materials.ours.shore": ("31A",),
    "motors.ours.leads": ("pads",),
    "motors.ours.like": ("VC0820B006F",),
    "printers.ours.like": ("fdm-0.25",),
    "printers.ours.bed_x_mm": (60.0,),
    "printers.ours.bed_y_mm": (40.0,),
    "design_source": (_SOURCE.replace("2.2", "2.4"),),
    "motor.at": ([0.5, 0.0, 0.0],),
    "moulds.parting": ("z=1",),
    "body.file": ("other.stl",),
    "body.file_source": (_body_text(17),),
    "estimate.fit": ("other.toml",),
    "estimate.fit_source": (_fit_text().replace("synthetic-bench", "another"),),
}
"""Values for keys whose type and range give none: names, texts and lists."""
FIRST = {
    "output.tolerance_mm": ("whole", 0.05),
    "moulds.bed_z_mm": ("tall", 30.0),
    "moulds.sprue_mm": ("injected", 3.5),
    "moulds.vents": ("injected", 12),
    "wires.diameter_mm": ("wires", 0.6),
    "wires.count": ("wires", 3),
    "wires.length_mm": ("wires", 50.0),
    "materials.ours.quasistatic_modulus_kpa": ("pulled", 60.0),
    "moulds.xy_play_mm": ("whole", 2.0),
    "printers.ours.bed_z_mm": ("tall, own printer", 30.0),
    "printers.ours.xy_play_mm": ("own", 2.0),
}
"""The spec and the value that show the effect of a key, where others take long to."""


@cache
def _bases():
    """Specs that between them have every table; the cheap ones first."""
    coarse = {"formats": ["stl", "3mf"], "tolerance_mm": 0.2}
    whole = {**read("encapsulating"), "output": coarse}

    def values(kind, name):
        entry = msgspec.to_builtins(getattr(catalogue, kind)()[name])
        return {key: value["value"] for key, value in entry.items() if isinstance(value, dict)}

    body = {"density_kg_m3": 1100.0, "poisson_ratio": 0.45}
    own = copy.deepcopy(
        {
            **whole,
            "materials": {OWN: values("materials", "ecoflex-00-30")},
            "motors": {OWN: {**values("motors", "VC0720B001F"), "frequency_hz": 120.0, "amplitude_um": 250.0}},
            "printers": {OWN: values("printers", "fdm-0.4")},
            "tissue": {
                OWN: {
                    "skin": {**body, "thickness_mm": 2.0, "youngs_modulus_kpa": 100.0, "loss_factor": 0.2},
                    "rest": {**body, "shear_modulus_kpa": 20.0, "viscosity_pa_s": 3.0},
                }
            },
            "motor": {"part": OWN},
            "moulds": {"printer": OWN},
            "estimate": {"tissue": OWN},
        }
    )
    own["layers"][0]["material"] = OWN
    like = copy.deepcopy(own)
    like["materials"][OWN] = {"like": "ecoflex-00-30"}
    like["motors"][OWN] = {"like": "VC0720B001F"}
    like["printers"][OWN] = {"like": "fdm-0.4"}
    like["tissue"][OWN]["skin"].update(shear_modulus_kpa=30.0, viscosity_pa_s=1.0)
    return {
        "whole": whole,
        "own": own,
        "like": like,
        "fitted": {**whole, "estimate": {"fit": "lab-fit.toml", "fit_source": _fit_text()}},
        "pulled": {**own, "estimate": {"tissue": OWN, "moduli": "quasi-static"}},
        "open rings": {**read("embedded"), "output": coarse},
        "wires": {**{k: v for k, v in whole.items() if k != "fpcb"}, "wires": {"diameter_mm": 0.5}},
        "injected": {**whole, "moulds": {"pour": "injected", "vents": 8}},
        "tall": {**whole, "moulds": {"plinth_height_mm": 40.0}},
        "tall, own printer": {**own, "moulds": {"printer": OWN, "plinth_height_mm": 40.0}},
        "custom": {
            **{key: value for key, value in whole.items() if key != "fpcb"},
            "layers": whole["layers"][:1],
            "design": "d.py:plain",
            "design_source": _SOURCE,
            "parameters": {"height_mm": 4.0},
        },
        "body": {
            **{key: value for key, value in whole.items() if key not in ("design", "diameter_mm", "fpcb")},
            "body": {"file": "box.stl", "file_source": _body_text(16)},
            "layers": [{"material": "ecoflex-00-30"}, {"material": "ecoflex-00-30", "thickness_mm": 1.5}],
        },
    }


def _keys(table, path):
    """Every key below a table that holds a value, and its kind: of lists the first entry, of free tables an own one."""
    for key, field in fields_of(table).items():
        below = table_in(field.type) or table_in(entry_in(field.type))
        where = f"{path}{key}"
        if where in ENTRIES:
            entry, given, inside = ENTRIES[where]
            kinds = dict(kinds_of(entry))
            yield from ((f"{where}.{inside}.{name}", kinds.get(name, f.type)) for name, f in fields_of(given).items())
        elif below:
            yield from _keys(below, f"{where}.0." if entry_in(field.type) else f"{where}.")
        elif key == "parameters":
            yield f"{where}.height_mm", float
        else:
            yield where, field.type


KEYS = dict(_keys(RawSpec, ""))


def _within(kind, now):
    """Values of a kind: near the present one, then all over its range."""
    for one in alternatives(kind):
        if typing.get_origin(one) is Literal:
            yield from (word for word in typing.get_args(one) if word != now)
        elif typing.get_origin(one) is tuple and typing.get_origin(typing.get_args(one)[0]) is Literal:
            yield [typing.get_args(typing.get_args(one)[0])[0]]
        elif one is bool:
            yield not now
        elif one in (int, float):
            bounds = [note for note in notes(kind) if note.ge is not None and note.le is not None]
            low, high = (float(bounds[0].ge or 0), float(bounds[0].le or 0)) if bounds else (0.0, 1e3)
            start = now if isinstance(now, int | float) and not isinstance(now, bool) else (low * high) ** 0.5
            wanted = [start * f for f in (1.1, 0.9, 1.3, 0.6, 2.0, 0.3, 4.0)] + [low, high]
            yield from (one(round(v, 6)) for v in wanted if low <= v <= high and one(round(v, 6)) != now)


def _at(data, path):
    for step in path.split("."):
        data = data[int(step)] if isinstance(data, list) else data.get(step) if isinstance(data, dict) else None
    return data


_STORE = MemoryStore()


@cache
def _resolved(base):
    return msgspec.to_builtins(from_data(_bases()[base]))


@cache
def _before(base, checked):
    return _written(_bases()[base], checked)


def _written(data, checked):
    """The content of each file that is written, as a hash, but for the spec itself; and what the checks find."""
    product = make(Unit(from_data(data)), OUTPUTS, checked, _STORE, Progress())
    own = {path: digest(content) for path, content in product.own.items()}
    for path in ("spec.toml", "manifest.json"):
        del own[path]
    found = {key: repr(product.manifest[key]) for key in ("mould_checks", "check", "warnings")}
    return {**own, **product.shared, **found}


def _changes(path):
    """Specs, and accepted values of a key for each."""
    if path in FIRST:
        yield FIRST[path]
    for name in _bases():
        present = _at(_resolved(name), path)
        yield from ((name, value) for value in (*OTHERS.get(path, ()), *_within(KEYS[path], present)))


def _effect(name, path, value):
    """The files that a change of a key changes, without checks or else with them; where it is refused, the refusal.

    That names the key. What a printer can't make is refused in the name of the mould's length.
    """
    data = copy.deepcopy(_bases()[name])
    put(data, path, value)
    try:
        for checked in (False, True):
            after, before = _written(data, checked), _before(name, checked)
            if changed := [file for file in before.keys() | after.keys() if before.get(file) != after.get(file)]:
                return changed
    except Refusal as refusal:
        named = path.startswith("printers.") or path.rpartition(".")[2] in str(refusal)
        return [str(refusal)] if named else []
    return []


@pytest.mark.parametrize("path", [path for path in KEYS if path.rpartition(".")[2] not in PROVENANCE])
def test_every_key_changes_something(path):
    assert any(_effect(name, path, value) for name, value in _changes(path))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("density_g_cm3", {"value": 1.07, "source": "our own scale"}),
        ("density_g_cm3", {"value": 1.07, "status": "paper"}),
        ("poisson_ratio", {"value": 0.4999, "low": 0.49}),
        ("poisson_ratio", {"value": 0.4999, "high": 0.49995}),
        ("status", "paper"),
        ("source", "our own scale"),
    ],
)
def test_provenance_and_range_of_a_silicone_are_written(path, value):
    assert _effect("own", f"materials.{OWN}.{path}", value)


def test_a_key_that_is_read_by_nothing_is_seen(monkeypatch):
    """Planted: nothing depends on the room's temperature any more, neither times nor words."""
    planted = {"at_room": lambda value, room_c: value, "in_room": lambda *_: "", "other_rooms": lambda room_c: ""}
    for reader, name in product(("figures", "preparation", "pouring", "procedure", "procedure_text"), planted):
        monkeypatch.setattr(f"unitcad.casting.{reader}.{name}", planted[name], raising=False)
    _before.cache_clear()
    assert not any(_effect("whole", "casting.room_c", value) for value in (20.0, 30.0))
    _before.cache_clear()


@pytest.fixture(autouse=True, scope="module")
def _code_may_run():
    allow({ANY})
    yield
    allow_nothing()


@pytest.fixture(autouse=True, scope="module")
def _pictures_are_lists():
    """A picture's bytes are the list of what is in it: drawing takes four times as long as all the rest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(views.BenchPictures, "picture", lambda bench, name: repr(bench._views[name]).encode())
        yield
