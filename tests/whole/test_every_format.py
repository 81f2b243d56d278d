"""Every template and every spec of the gallery makes each kind of file, and each sheet of a drawing has outlines."""

import base64
import re
import zlib
from pathlib import Path

import pytest

from unitcad.cache import MemoryStore
from unitcad.errors import Refusal
from unitcad.export import drawing as sheet
from unitcad.export.chart import coord
from unitcad.kernels.mesh import bounds, realise
from unitcad.pipeline import optional, unit
from unitcad.pipeline.plan import plan
from unitcad.pipeline.result import Progress
from unitcad.pipeline.scenes import drawing
from unitcad.pipeline.subjects import load_subject
from unitcad.pipeline.write import build
from unitcad.spec.raw import FORMATS
from unitcad.validation import every_template

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"
SLOW = {"sleeve-curved", "gel-dome"}
"""Its meshes and drawings alone take more than 5 s."""


def every_spec():
    """Return the names of all templates and files of the gallery that `build` takes."""
    kinds = ("fits/", "lab/", "phantoms/", "sweeps/", "targets/")
    named = [name for name in every_template() if not name.startswith(kinds)]
    named += [str(path) for path in sorted(GALLERY.glob("*.toml"))]
    return [pytest.param(name, marks=pytest.mark.long if Path(name).stem in SLOW else ()) for name in named]


def subject_of(name, **changes):
    """Load a spec or an array with coarse facets."""
    changes = {"output.tolerance_mm": 0.1, **changes}
    try:
        return load_subject(name, changes)
    except Refusal:  # of an array
        return load_subject(name, {f"unit.{key}": value for key, value in changes.items()})


def pages(content):
    """Return the codes of the pages of a PDF."""
    streams = re.findall(rb"stream\r?\n(.+?)endstream", content, re.S)
    return [zlib.decompress(base64.a85decode(each.strip().removesuffix(b"~>"))).decode("latin-1") for each in streams]


@pytest.mark.parametrize("name", every_spec())
def test_meshes_assemblies_and_drawings_of_every_spec(name):
    moulds = subject_of(name).moulds.blank
    for planned in plan(moulds, ("unit", "moulds"), ("stl", "3mf", "glb")):
        if planned.form in ("stl", "3mf", "glb"):
            assert len(planned.make()) > 84, planned.path
    unit, *tools = pages(drawing(moulds, ("unit", "moulds")))
    printed = [body for body in moulds.plan.pieces if body.made == "printed"]
    assert len(tools) == len(printed)
    for page, body in zip(tools, printed, strict=True):
        # Two views are filled; sections and outlines have the piece's own width and height.
        assert len(re.findall(r"\b[fB]\*?$", page, re.M)) >= 2, body.name
        x0, y0, _, x1, y1, _ = bounds(realise(body.shape, moulds.segments, 1.0))
        assert f"({coord(x1 - x0, 2)}) Tj" in page, body.name
        assert f"({coord(y1 - y0, 2)}) Tj" in page, body.name
    assert len(re.findall(r"\b[fB]\*?$", unit, re.M)) >= 2


@pytest.mark.long
@pytest.mark.parametrize("name", every_spec())
def test_every_format_of_every_spec_is_made(name, tmp_path):
    pytest.importorskip("OCP")
    done = build(subject_of(name, **{"output.formats": list(FORMATS)}), tmp_path, check=False)
    assert [each for each in done.manifest["skipped"] if each["reason"].startswith(optional.UNMADE)] == []
    assert (done.folder / "drawing.pdf").stat().st_size > 1000
    made = {path.suffix for path in done.folder.rglob("*") if path.is_file()}
    assert {".stl", ".3mf", ".step", ".glb", ".png", ".svg", ".pdf"} <= made


@pytest.mark.parametrize("fault", [ValueError("no loops"), Refusal("design", "x", "is too thin")], ids=type)
def test_a_drawing_that_can_not_be_made_costs_the_drawing_and_a_sentence(fault, tmp_path, monkeypatch):
    def broken(*given, **named):
        raise fault

    monkeypatch.setattr(sheet, "upright", broken)
    monkeypatch.delenv("UNITCAD_TRACEBACK", raising=False)
    done = build(load_subject("embedded", {"output.formats": ["stl", "pdf"]}), tmp_path, only=("moulds",))
    assert done.ok
    assert not (done.folder / "drawing.pdf").exists()
    (lacking,) = [each for each in done.manifest["skipped"] if each["output"] == "drawing.pdf"]
    assert lacking["reason"].startswith("could not be made: ")
    assert str(fault) in lacking["reason"]
    assert ("a bug" in lacking["reason"]) == isinstance(fault, ValueError)


@pytest.mark.parametrize("error", [MemoryError(), OSError(28, "No space left on device")], ids=type)
def test_a_lack_of_the_machine_ends_the_build(error, monkeypatch):
    def broken(*given):
        raise error

    monkeypatch.setattr(unit, "drawing", broken)
    subject = load_subject("embedded", {"output.formats": ["pdf"]})
    with pytest.raises(type(error)):
        subject.make(("unit",), False, MemoryStore(), Progress())
