"""Results that several tests look at, and the browser that they look with."""

import pytest
from msgspec.structs import replace

from unitcad.cache import MemoryStore
from unitcad.pipeline.write import build
from unitcad.report import write_report
from unitcad.validation import load


@pytest.fixture(scope="session")
def hostile():
    """A name that would be markup if it were not kept text."""
    return "<script>alert('x')</script> \"quoted\" & <b>bold</b>"


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """One variant's folder, with everything that a build of STL makes."""
    return build(load("encapsulating", ['output.formats=["stl"]']), tmp_path_factory.mktemp("one")).folder


@pytest.fixture(scope="session")
def sweep(tmp_path_factory, hostile):
    """A folder of nine variants: two designs, three walls and three materials, one with markup for a name."""
    out, store = tmp_path_factory.mktemp("sweep"), MemoryStore()
    for wall in (1.0, 1.25, 1.5):
        for material in ("ecoflex-00-10", "dragon-skin-10-medium"):
            changes = [f"layers.0.wall_mm={wall}", f'layers.0.material="{material}"', "output.formats=[]"]
            build(
                load("embedded", [*changes, f'name="e {wall} {material}"']), out, only=["unit", "moulds"], store=store
            )
        changes = [f"layers.0.wall_mm={wall}", "output.formats=[]", f'name="c {wall}"']
        build(load("encapsulating", changes), out, only=["unit"], check=False, store=store)
    spec = replace(load("single-embedded", ["output.formats=[]"]), name=hostile)
    build(spec, out, store=store)
    write_report(out)
    return out


@pytest.fixture(scope="session")
def page(built):
    """The page of one variant."""
    return write_report(built)
