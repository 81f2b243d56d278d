"""Files against a manifest: volume, solids, hash, missing files; tools get the printer's rules, other parts do not."""

import hashlib
import json
import os
from pathlib import Path

import numpy as np
import pytest
from shapes import box, stl

import unitcad
from unitcad.catalogue import printers
from unitcad.errors import UnitcadError
from unitcad.meshcheck import Options
from unitcad.meshcheck import manifest as listing
from unitcad.meshcheck.file_checks import check_files

BASE = stl(box((20, 20, 5)))
FILM = stl(box((20, 3, 0.11)))


def written(folder, **change):
    (folder / "unit").mkdir()
    (folder / "base.stl").write_bytes(BASE)
    (folder / "unit" / "film.stl").write_bytes(FILM)
    parts = [
        _part("base", "tool", "base.stl", BASE, 2000.0) | change,
        _part("film", "unit", "unit/film.stl", FILM, 6.6),
    ]
    (folder / "manifest.json").write_text(json.dumps({"parts": parts}))
    return folder


def _part(name, role, path, content, volume):
    digest = hashlib.sha256(content).hexdigest()
    return {"name": name, "role": role, "volume_mm3": volume, "files": {"stl": {"path": path, "sha256": digest}}}


def judged(folder):
    listed = listing.read(str(folder))
    reports = list(check_files(listing.work(listed, [], lambda path: Options(), printers())))
    compared = [listing.compare(listed, report, Options()) for report in reports]
    return {Path(report.path).name: report for report in compared}


def codes(report):
    return [found.code for found in report.findings]


TWO = stl(np.concatenate([box((20, 20, 5)), box((1, 1, 1), (40, 0, 0))]))


@pytest.mark.parametrize(
    ("volume", "content", "found"),
    [
        (2000.0, BASE, []),
        (2003.0, BASE, ["M001"]),
        (2000.0, TWO, ["M002", "M003"]),
        (2000.0, stl(box((20, 20, 5)), header=b"other"), ["M003"]),
        (2000.0, None, ["F012", "M004"]),
    ],
    ids=["good", "volume", "solids", "hash", "missing"],
)
def test_files_are_held_to_the_manifest_and_only_tools_to_the_printer(tmp_path, volume, content, found):
    folder = written(tmp_path, volume_mm3=volume)
    (folder / "base.stl").unlink() if content is None else (folder / "base.stl").write_bytes(content)
    reports = judged(folder)
    assert {name: codes(report) for name, report in reports.items()} == {"base.stl": found, "film.stl": []}


def test_m004_a_file_that_the_manifest_does_not_list(tmp_path):
    folder = written(tmp_path)
    (folder / "other.stl").write_bytes(BASE)
    listed = listing.read(str(folder))
    (report,) = check_files(listing.work(listed, [str(folder / "other.stl")], lambda path: Options(), printers()))
    assert codes(listing.compare(listed, report, Options())) == ["M004"]


def test_a_tool_below_the_floor_is_warned_of(tmp_path):
    folder = written(tmp_path)
    parts = json.loads((folder / "manifest.json").read_text())
    parts["parts"][1]["role"] = "tool"
    (folder / "manifest.json").write_text(json.dumps(parts))
    assert "D001" in codes(judged(folder)["film.stl"])


OUTSIDE = [
    "../secret.stl", "unit/../../secret.stl", "unit/../base.stl", "{tmp}/secret.stl", "C:\\secret.stl",
    "\\\\host\\a.stl", "..\\secret.stl", "file-link.stl", "folder-link/secret.stl", "", ".",
]  # fmt: skip


@pytest.mark.parametrize("path", OUTSIDE)
@pytest.mark.parametrize("suffix", ["stl", "step"])
def test_m005_nothing_outside_the_folder_is_read(tmp_path, path, suffix, monkeypatch):
    folder = tmp_path / "build"
    folder.mkdir()
    written(folder)
    secret = tmp_path / "secret.stl"
    secret.write_bytes(stl(box()[2:]))
    (folder / "file-link.stl").symlink_to(secret)
    (folder / "folder-link").symlink_to(tmp_path, target_is_directory=True)
    data = json.loads((folder / "manifest.json").read_text())
    listed = {"path": path.replace("{tmp}", str(tmp_path)), "sha256": "0" * 64}
    data["parts"].append({"name": "x", "role": "unit", "volume_mm3": 1.0, "files": {suffix: listed}})
    (folder / "manifest.json").write_text(json.dumps(data))
    opened = []
    plain_open = Path.open
    monkeypatch.setattr(Path, "open", lambda self, *a, **k: opened.append(str(self)) or plain_open(self, *a, **k))
    plain_os_open = os.open
    monkeypatch.setattr(os, "open", lambda path, *a, **k: opened.append(str(path)) or plain_os_open(path, *a, **k))
    assert {name: codes(report) for name, report in judged(folder).items()} == {"base.stl": [], "film.stl": []}
    (report,) = listing.check_unread(listing.read(str(folder)), [], lambda path: Options(select=("M005",)))
    assert Path(report.path).name == "manifest.json"
    assert codes(report) == ["M005"]
    assert report.findings[0].severity == "error"
    ours = Path(unitcad.__file__).parent  # the list of printers, which the first one who asks reads
    asked = {Path(name).name for name in opened if not Path(name).is_relative_to(ours)}
    assert asked <= {"manifest.json", "base.stl", "film.stl"}


def test_links_that_stay_inside_the_folder_are_followed(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    folder = written(home)
    (tmp_path / "also").symlink_to(home, target_is_directory=True)
    (folder / "base.stl").rename(folder / "real.stl")
    (folder / "base.stl").symlink_to("real.stl")
    assert {name: codes(report) for name, report in judged(tmp_path / "also").items()} == {
        "base.stl": [], "film.stl": []
    }  # fmt: skip


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs FIFOs")
def test_a_manifest_that_is_no_regular_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "manifest.json")
    with pytest.raises(UnitcadError, match="not a regular file"):
        listing.read(str(tmp_path))
