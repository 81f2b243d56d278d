"""The script that the whole command is timed beside writes the same bodies as unitcad: names, and volumes by OCCT."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("OCP")
import step_reader

from unitcad.export import step
from unitcad.pipeline.variant import Variant

SCRIPTS = Path(__file__).parents[2] / "benchmarks" / "encapsulating"


def test_the_bare_script_draws_what_unitcad_draws(tmp_path):
    lengths = tmp_path / "lengths.json"
    for words in (["lengths.py", lengths], ["bare_occt.py", lengths, tmp_path / "bare", "step"]):
        subprocess.run([sys.executable, *map(str, [SCRIPTS / words[0], *words[1:]])], check=True, capture_output=True)
    variant = Variant.of("encapsulating")
    for name, bodies in (("unit", variant.unit), ("moulds", variant.plan.tools)):
        step.write(tmp_path / f"{name}.step", bodies, name)
        ours = {one.name: one.measures for one in step_reader.read(tmp_path / f"{name}.step")}
        bare = {one.name: one.measures for one in step_reader.read(tmp_path / "bare" / f"{name}.step")}
        assert list(bare) == list(ours)
        for part, measured in ours.items():
            assert bare[part].solids == 1
            # Half of what the speed suite allows: a pry slot or a flare of another depth shows.
            assert bare[part].volume == pytest.approx(measured.volume, rel=5e-5), part
            assert bare[part].box == pytest.approx(measured.box, abs=2e-3), part
