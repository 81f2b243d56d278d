"""What a build writes passes `unitcad check` as it is, against its manifest too."""

import pytest
from typer.testing import CliRunner

from unitcad.cli import app
from unitcad.export.printing import stl
from unitcad.kernels.mesh import arrays, realise
from unitcad.shape import cut, cylinder
from unitcad.validation.load import every_template

ALL_FORMATS = {"encapsulating", "forearm-patch", "forearm-pockets"}
IN_CI = {*ALL_FORMATS, "embedded", "hex-19"}


@pytest.mark.parametrize(
    "template",
    [pytest.param(one, marks=() if one in IN_CI else pytest.mark.long) for one in sorted(every_template())],
)
def test_a_result_passes_check_and_its_manifest(template, tmp_path):
    passes(template, tmp_path, "stl,3mf,step,glb" if template in ALL_FORMATS else "stl,3mf")


def test_an_array_of_a_body_file_in_pockets_passes_check(tmp_path):
    """Its disc is 0.03 mm larger than said, which a pocket takes."""
    body = realise(cut(cylinder(7.03, 0, 4.5), [cylinder(3.7, -1, 2)]), 96)
    (tmp_path / "disc.stl").write_bytes(stl(*arrays(body), "disc"))
    layer = '[[unit.layers]]\nmaterial = "ecoflex-00-30"\nwall_mm = 2.0\ncap_mm = 1.25\n'
    unit = f'name = "discs"\narray = "pockets"\n[unit]\ndesign = "disc.stl"\ndiameter_mm = 14.0\n{layer}'
    (tmp_path / "array.toml").write_text(f'{unit}[layout]\nkind = "grid"\ncolumns = 2\nrows = 1\npitch_mm = 20.0\n')
    passes(str(tmp_path / "array.toml"), tmp_path, "stl,3mf,step,glb")


def passes(subject, out, formats):
    built = CliRunner().invoke(
        app, ["build", subject, "-o", str(out), "--only", "unit,moulds", "--formats", formats, "--no-check"]
    )
    if subject == "custom/dome":  # has no moulds
        return
    assert built.exit_code == 0, built.output
    folder = built.stdout.splitlines()[-1]
    for arguments in ([folder], ["--manifest", folder]):
        checked = CliRunner().invoke(app, ["check", *arguments])
        assert checked.exit_code == 0, checked.output
