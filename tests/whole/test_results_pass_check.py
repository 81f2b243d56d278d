"""What a build writes passes `unitcad check` as it is, against its manifest too; another reader takes its GLB files."""

from pathlib import Path

import pytest
import trimesh

from tests.in_process import unitcad
from unitcad.export.printing import stl
from unitcad.kernels.mesh import arrays, realise
from unitcad.shape import cut, cylinder
from unitcad.validation.load import every_template

SMALL = "layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3,8]", "moulds.cavities=[1,1]"
PAIR = [word for change in SMALL for word in ("--set", change)]
ALL = "stl,3mf,step,glb"
BUILT = {"encapsulating": [ALL], "forearm-patch": ["stl,3mf,glb", *PAIR], "forearm-pockets": [ALL, *PAIR]}


@pytest.mark.parametrize("template", BUILT)
def test_a_result_of_all_formats_passes_check_and_its_manifest(template, tmp_path):
    passes(template, tmp_path, *BUILT[template])


@pytest.mark.long
@pytest.mark.parametrize("template", sorted(every_template()))
def test_a_result_passes_check_and_its_manifest(template, tmp_path):
    passes(template, tmp_path, "stl,3mf")


def test_an_array_of_a_body_file_in_pockets_passes_check(tmp_path):
    """Its disc is 0.03 mm larger than said, which a pocket takes."""
    body = realise(cut(cylinder(7.03, 0, 4.5), [cylinder(3.7, -1, 2)]), 96)
    (tmp_path / "disc.stl").write_bytes(stl(*arrays(body), "disc"))
    layer = '[[unit.layers]]\nmaterial = "ecoflex-00-30"\nwall_mm = 2.0\ncap_mm = 1.25\n'
    unit = f'name = "discs"\narray = "pockets"\n[unit]\ndesign = "disc.stl"\ndiameter_mm = 14.0\n{layer}'
    (tmp_path / "array.toml").write_text(f'{unit}[layout]\nkind = "grid"\ncolumns = 2\nrows = 1\npitch_mm = 20.0\n')
    passes(tmp_path / "array.toml", tmp_path, "stl,3mf,glb")


def passes(subject, out, formats, *sets):
    built = unitcad("build", subject, "-o", out, "--only", "unit,moulds", "--formats", formats, "--no-check", *sets)
    assert built.returncode == 0, built.stderr
    folder = built.stdout.splitlines()[-1]
    for arguments in ([folder], ["--manifest", folder]):
        checked = unitcad("check", *arguments)
        assert checked.returncode == 0, checked.stdout
    drawn = list(Path(folder).rglob("*.glb"))
    assert bool(drawn) == ("glb" in formats)
    for file in drawn:
        for name, mesh in trimesh.load_scene(file).geometry.items():
            mesh.merge_vertices(merge_norm=True)  # a corner has a normal for each face
            assert mesh.is_volume, f"{name} of {file.name}: open, or wound apart, or inside out"
