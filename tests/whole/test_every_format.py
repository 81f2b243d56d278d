"""Every template and every spec of the gallery makes each kind of file, and each sheet of a drawing has outlines."""

from pathlib import Path

import pytest

from tests.drawn_sheets import faults
from unitcad.cache import MemoryStore
from unitcad.errors import Refusal
from unitcad.export import lengths
from unitcad.export.drawing import pages
from unitcad.kernels.mesh import bounds, realise
from unitcad.pipeline import optional, workshop
from unitcad.pipeline.plan import plan
from unitcad.pipeline.result import Progress
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


@pytest.mark.parametrize("name", every_spec())
def test_meshes_assemblies_and_drawings_of_every_spec(name):
    moulds = subject_of(name).moulds.blank
    for planned in plan(moulds, ("unit", "moulds"), ("stl", "3mf", "glb")):
        if planned.form in ("stl", "3mf", "glb"):
            assert len(planned.make()) > 84, planned.path
    sheets = list(workshop.sheets(moulds, ("unit", "moulds"), "0" * 64))
    for sheet, page in zip(sheets, pages(sheets), strict=True):
        assert not list(faults(page)), sheet.facts[0][0]
    printed = [body for body in moulds.plan.pieces if body.made == "printed"]
    for sheet, body in zip(sheets[1:], printed, strict=True):
        x0, y0, z0, x1, y1, z1 = bounds(realise(body.shape, moulds.segments, 1.0))
        sizes = [(one.name, one.value) for one in sheet.checks if one.name in ("length", "width", "height")]
        named = dict(sizes[::-1])
        assert [named[name] for name in ("length", "width", "height")] == pytest.approx(
            [x1 - x0, y1 - y0, z1 - z0], abs=0.01
        )


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

    monkeypatch.setattr(lengths, "heights", broken)
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

    monkeypatch.setattr(workshop, "sheets", broken)
    subject = load_subject("embedded", {"output.formats": ["pdf"]})
    with pytest.raises(type(error)):
        subject.make(("unit",), False, MemoryStore(), Progress())
