"""`unitcad check --pictures`: a picture a finding, without CAD, a display or a GPU."""

import json
import re

import numpy as np
import pytest
from PIL import Image
from shapes import box, stl
from test_check_command import run

from unitcad.export import finding_pictures
from unitcad.meshcheck import Options, check_bytes

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
    assert {entry.name for entry in (folder / "a.stl").iterdir()} == {f"{code}.png" for code in codes}
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


def test_faces_on_each_other_are_drawn_once():
    """A file with 40,000 copies of a face took minutes: each was drawn pixel by pixel."""
    often = np.concatenate([box(), *[box()[4:5]] * 40_000])
    once, many = (
        finding_pictures._scene(check_bytes(stl(faces), "a.stl", Options(draw=True)).meshes[0])
        for faces in (CROSSED, often)
    )
    assert once.drawn.tolist() == [*range(len(CROSSED))]
    assert (many.faces == once.faces[:12]).all()
    assert many.drawn.tolist() == [*range(12), *[4] * 40_000]
