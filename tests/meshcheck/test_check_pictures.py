"""`unitcad check --pictures`: a picture a finding and a coloured 3MF, without CAD, a display or a GPU."""

import importlib.util
import io
import json
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
import zipfile

import numpy as np
import pytest
import trimesh
from PIL import Image
from shapes import CUBE_CORNERS, CUBE_FACES, box, mesh_xml, model_xml, package, stl
from test_check_command import run

from unitcad.export import finding_pictures
from unitcad.meshcheck import check_file

CROSSED = np.concatenate([box(), box((4, 4, 4), (8, 3, 3))])
CAVITY = np.concatenate([box((20, 20, 20)), box((5, 5, 5), (7, 7, 7))[:, ::-1]])


def views(path):
    """The pixels of a picture's two views."""
    return np.hsplit(np.array(Image.open(path)), 2)


def reddish(pixels):
    """Which pixels have the hue of an error."""
    red, green, blue = np.moveaxis(pixels.astype(int), 2, 0)
    return (red > 90) & (green < 0.3 * red) & (blue < 0.3 * red)


def test_each_finding_has_a_picture_of_the_part_and_of_the_place(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(CROSSED))
    (tmp_path / "good.stl").write_bytes(stl(box()))
    plain = run(".", "--json", cwd=tmp_path)
    result = run(".", "--json", "--pictures", "pictures", cwd=tmp_path)
    assert (result.stdout, result.returncode) == (plain.stdout, 1)
    folder = tmp_path / "pictures"
    assert [entry.name for entry in folder.iterdir()] == ["a.stl"]
    codes = [found["code"] for found in json.loads(result.stdout)["files"][0]["findings"]]
    assert sorted(entry.name for entry in (folder / "a.stl").iterdir()) == sorted(
        [*(f"{code}.png" for code in codes), "findings.3mf"]
    )
    whole, near = views(folder / "a.stl" / "G001.png")
    assert reddish(whole).mean() > 0.02
    assert reddish(near).mean() > 2 * reddish(whole).mean()
    first = (folder / "a.stl" / "G001.png").read_bytes()
    run(".", "--jobs", "2", "--pictures", "pictures", cwd=tmp_path)
    assert (folder / "a.stl" / "G001.png").read_bytes() == first


@pytest.mark.parametrize(
    ("name", "code", "triangles"),
    [("double", "T009", np.concatenate([box(), box()[4:5]])), ("inverted", "T008", box()[:, ::-1]),
     ("cavity", "D004", CAVITY)],
)  # fmt: skip
def test_the_faces_concerned_are_seen_in_the_near_view(tmp_path, name, code, triangles):
    (tmp_path / "a.stl").write_bytes(stl(triangles))
    run("a.stl", "--select", code, "--printer", "fdm-0.4", "--pictures", "p", cwd=tmp_path)
    _, near = views(tmp_path / "p" / "a.stl" / f"{code}.png")
    coloured = np.ptp(near.astype(int), axis=2) > 100
    assert coloured.mean() > 0.005


def test_a_hidden_place_is_seen_through_a_cut(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(CAVITY))
    run("a.stl", "--select", "G006", "--pictures", "p", cwd=tmp_path)
    orange = [np.ptp(view.astype(int), axis=2) > 100 for view in views(tmp_path / "p" / "a.stl" / "G006.png")]
    assert not orange[0].any()
    assert orange[1].mean() > 0.05


def test_the_faces_at_a_hole_are_coloured(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box()[2:]))
    run("a.stl", "--pictures", "p", cwd=tmp_path)
    assert all(reddish(view).mean() > 0.02 for view in views(tmp_path / "p" / "a.stl" / "T001.png"))


def painted(data):
    """Colour and vertices of the triangles of each object."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        root = ET.fromstring(archive.read("3D/3dmodel.model"))
    core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    colours = [base.get("displaycolor", "") for base in root.iter(f"{core}base")]
    found = []
    for thing in root.iter(f"{core}object"):
        default = thing.get("pindex", "0")
        found.append([colours[int(face.get("p1", default))] for face in thing.iter(f"{core}triangle")])
    return found


def test_the_3mf_has_the_faces_in_the_colour_of_the_worst_severity(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(np.concatenate([box(), box()[4:5], box(at=(30, 0, 0))[2:]])))
    result = run("a.stl", "--json", "--all-locations", "--pictures", "p", cwd=tmp_path)
    findings = json.loads(result.stdout)["files"][0]["findings"]
    worst = {}
    for found in sorted(findings, key=lambda item: ["info", "warning", "error"].index(item["severity"])):
        worst |= dict.fromkeys((face for place in found["locations"] for face in place["faces"]), found["severity"])
    written = (tmp_path / "p" / "a.stl" / "findings.3mf").read_bytes()
    (colours,) = painted(written)
    names = {finding_pictures.printing.colour_hex(rgb): name for name, rgb in finding_pictures.COLOURS.items()}
    shown = {i: names[colour] for i, colour in enumerate(colours) if colour in names}
    assert {face: shown.get(face) for face in worst} == worst
    assert len(colours) == 23


def test_the_3mf_opens_elsewhere(tmp_path):
    resources = (
        f'<object id="1" name="good">{mesh_xml()}</object>'
        f'<object id="2" name="open">{mesh_xml(CUBE_CORNERS * 10 + 40, CUBE_FACES[2:])}</object>'
    )
    build = '<build><item objectid="1"/><item objectid="2"/></build>'
    (tmp_path / "a.3mf").write_bytes(package(model_xml(resources, build)))
    run("a.3mf", "--pictures", "p", cwd=tmp_path)
    made = tmp_path / "p" / "a.3mf" / "findings.3mf"
    report = check_file(made)
    assert {found.code for found in report.findings} == {"T001"}
    assert report.facts.triangles == 22
    if importlib.util.find_spec("networkx"):  # which trimesh wants for 3MF
        assert sum(len(mesh.faces) for mesh in trimesh.load_scene(made).geometry.values()) == 22
    slicer = shutil.which("prusa-slicer")
    if slicer is None:
        pytest.skip("needs PrusaSlicer for its own word")
    environment = {**os.environ, "LC_ALL": "C.UTF-8"}
    done = subprocess.run([slicer, "--info", str(made)], capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0, done.stderr
    assert re.findall(r"number_of_facets = +(\d+)", done.stdout)[-1] == "10"


def test_files_without_a_mesh_or_a_finding_have_no_picture(tmp_path):
    (tmp_path / "good.stl").write_bytes(stl(box()))
    (tmp_path / "cut.stl").write_bytes(stl(box())[:-80])
    (tmp_path / "nan.stl").write_bytes(stl(box((np.nan, 1, 1))))
    result = run(".", "--pictures", "p", cwd=tmp_path)
    assert result.returncode == 1
    assert result.stderr == ""
    assert not (tmp_path / "p").exists()


def test_a_finding_without_a_place_shows_the_whole_part(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box((0.2, 0.3, 0.4)), header=b"solid"))
    run("a.stl", "--pictures", "p", cwd=tmp_path)
    for code in ("F007", "S001"):
        picture = np.array(Image.open(tmp_path / "p" / "a.stl" / f"{code}.png"))
        assert picture.shape[1] == finding_pictures.SIZE[0]
        assert 0.2 < (picture < 250).any(axis=2).mean() < 0.9


@pytest.mark.parametrize(
    ("path", "name"),
    [("a.stl", "a.stl"), ("./a.stl", "a.stl"), ("sub/a.stl", r"sub_a\.stl-[0-9a-f]{8}"), ("...stl", r"stl-[0-9a-f]{8}"),
     ("CON.stl", r"CON\.stl-[0-9a-f]{8}"), ("ä<b>&.stl", r"b_\.stl-[0-9a-f]{8}"), ("../a.stl", r"a\.stl-[0-9a-f]{8}"),
     ("\udce4", "file-[0-9a-f]{8}"), ("x" * 300 + ".stl", r"x{76}\.stl-[0-9a-f]{8}")],
)  # fmt: skip
def test_folders_have_plain_names_of_their_own(path, name):
    assert re.fullmatch(name, finding_pictures.folder_name(path))


def test_a_folder_that_cannot_be_written_is_one_error(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box()[2:]))
    (tmp_path / "p").write_text("a file")
    for jobs in ("1", "2"):
        result = run("a.stl", "a.stl", "--pictures", "p", "--jobs", jobs, cwd=tmp_path)
        assert (result.returncode, len(result.stderr.splitlines())) == (2, 1)
