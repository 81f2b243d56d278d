"""A baseline: known findings are listed and do not fail, new ones do; the order of vertices does not matter."""

import json

import numpy as np
import pytest
from shapes import box, stl
from test_check_command import run

CROSSED = np.concatenate([box(), box((4, 4, 4), (8, 3, 3))])
TOUCHING = np.concatenate([box(), box((4, 4, 4), (10, 3, 3))])
INVERTED = np.concatenate([box(), box((2, 2, 2), (20, 0, 0))[:, ::-1]])
CAVITY = np.concatenate([box(), box((4, 4, 4), (3, 3, 3))[:, ::-1]])
FILM = box((20, 20, 0.2))
TABLE = np.concatenate([box((40, 40, 5), (0, 0, 20)), box((5, 5, 20.001), (0, 0, 0))])
DEGENERATE = np.concatenate([box(), np.array([[[0, 0, 0], [10, 0, 0], [5, 0, 0]]], float)])
CASES = {"hole": box()[2:], "crossed": CROSSED, "touching": TOUCHING, "inverted": INVERTED, "cavity": CAVITY,
         "film": FILM, "table": TABLE, "double": np.concatenate([box(), box()[:1]]), "degenerate": DEGENERATE}  # fmt: skip
WRITE, KNOWN = ("--write-baseline", "known.json"), ("--baseline", "known.json")


def shuffled(triangles, seed):
    """The same surface as another program may write it: faces in another order, each from another corner."""
    rng = np.random.default_rng(seed)
    turned = np.array([np.roll(face, rng.integers(3), axis=0) for face in triangles])
    return turned[rng.permutation(len(turned))]


def known_of(result):
    (entry,) = json.loads(result.stdout)["files"]
    return {found["code"]: found["known"] for found in entry["findings"]}


@pytest.mark.parametrize("name", CASES)
def test_a_new_export_of_the_same_part_has_nothing_new(tmp_path, name):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(CASES[name]))
    printed = ["--printer", "fdm-0.4", "--fail-on", "warning"]
    found = known_of(run("a.stl", *printed, "--json", cwd=tmp_path))
    assert found
    assert not any(found.values())
    assert run("a.stl", *printed, *WRITE, cwd=tmp_path).returncode == 0
    first = (tmp_path / "known.json").read_bytes()
    for seed in range(3):
        path.write_bytes(stl(shuffled(CASES[name], seed)))
        result = run("a.stl", *printed, *KNOWN, "--json", cwd=tmp_path)
        assert known_of(result) == dict.fromkeys(found, True)
        assert result.returncode == 0
        assert json.loads(result.stdout)["baseline"] == "known.json"
    path.write_bytes(stl(CASES[name]))
    run("a.stl", *printed, *WRITE, cwd=tmp_path)
    assert (tmp_path / "known.json").read_bytes() == first


@pytest.mark.parametrize(
    ("worse", "code"),
    [(box()[4:], "T001"), (np.concatenate([box()[2:], box((1, 1, 1), (30, 0, 0))[2:]]), "T001"),
     (np.concatenate([box()[2:], box((4, 4, 4), (8, 3, 3))]), "G001"), (box()[:10], "T001")],
    ids=["larger hole", "second hole", "another fault", "hole elsewhere"],
)  # fmt: skip
def test_a_new_fault_fails(tmp_path, worse, code):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(box()[2:]))
    run("a.stl", *WRITE, cwd=tmp_path)
    assert run("a.stl", *KNOWN, cwd=tmp_path).returncode == 0
    path.write_bytes(stl(worse))
    result = run("a.stl", *KNOWN, "--json", cwd=tmp_path)
    assert result.returncode == 1
    assert known_of(result)[code] is False


@pytest.mark.parametrize("side", [0.003, 0.0299])
def test_places_are_compared_in_steps_of_the_files_size(tmp_path, side):
    """A diagonal of 17 mm has steps of 0.01 mm; a place may lie one step farther, and rounding adds half of one."""
    path = tmp_path / "a.stl"
    path.write_bytes(stl(box()[2:]))
    run("a.stl", *WRITE, cwd=tmp_path)
    path.write_bytes(stl(box(at=(side, 0, 0))[2:]))
    assert run("a.stl", *KNOWN, cwd=tmp_path).returncode == (side > 0.015)


def test_new_places_come_first_and_the_message_counts(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(np.concatenate([box((30, 30, 30))[2:], box()])))
    run("a.stl", *WRITE, cwd=tmp_path)
    path.write_bytes(stl(np.concatenate([box((30, 30, 30))[2:], box(at=(50, 0, 0))[2:]])))
    (entry,) = json.loads(run("a.stl", *KNOWN, "--json", "--select", "T001", cwd=tmp_path).stdout)["files"]
    (found,) = entry["findings"]
    assert found["message"] == "8 boundary edges (4 in the baseline)"
    assert [place["xyz"][0] >= 50 for place in found["locations"]] == [True] * 4 + [False]


def test_every_place_is_listed_and_five_are_shown(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(np.concatenate([box(at=(20 * k, 0, 0))[2:] for k in range(40)])))
    result = run("a.stl", *WRITE, "--json", "--select", "T001", cwd=tmp_path)
    assert len(json.loads(result.stdout)["files"][0]["findings"][0]["locations"]) == 5
    (entry,) = json.loads((tmp_path / "known.json").read_text())["files"]["a.stl"]
    assert (entry["count"], len(entry["places"])) == (160, 160)


def test_known_findings_in_every_format(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box()[2:]))
    run("a.stl", *WRITE, cwd=tmp_path)
    text = run("a.stl", *KNOWN, cwd=tmp_path).stdout
    assert text.startswith("a.stl: passed but for 1 known finding: 10 x 10 x 10 mm")
    assert text.endswith("1 file: 1 passed, 1 known finding\n")
    assert "T001" not in text
    assert "::" not in run("a.stl", *KNOWN, "--output-format", "github", cwd=tmp_path).stdout
    (result,) = json.loads(run("a.stl", *KNOWN, "--output-format", "sarif", cwd=tmp_path).stdout)["runs"][0]["results"]
    assert result["baselineState"] == "unchanged"
    assert result["suppressions"] == [{"kind": "external", "status": "accepted"}]
    junit = run("a.stl", *KNOWN, "--output-format", "junit", cwd=tmp_path).stdout
    assert 'failures="0"' in junit
    assert "T001 known: 4 boundary edges" in junit
    assert "T001" not in run("a.stl", *KNOWN, "--output-format", "markdown", cwd=tmp_path).stdout
    assert run("a.stl", *KNOWN, "--quiet", cwd=tmp_path).stdout == "1 file: 1 passed, 1 known finding\n"


def test_an_error_that_ended_a_check_or_one_of_a_manifest_is_never_known(tmp_path):
    (tmp_path / "cut.stl").write_bytes(stl(box())[:-80])
    assert run("cut.stl", *WRITE, cwd=tmp_path).returncode == 1
    assert run("cut.stl", *KNOWN, cwd=tmp_path).returncode == 1
    (tmp_path / "good.stl").write_bytes(stl(box()))
    part = {"name": "a", "role": "unit", "volume_mm3": 7.0, "files": {"stl": {"path": "good.stl"}}}
    (tmp_path / "manifest.json").write_text(json.dumps({"parts": [part]}))
    assert run("--manifest", ".", *WRITE, cwd=tmp_path).returncode == 1


def test_files_are_found_from_the_baselines_folder_and_others_stay(tmp_path):
    (tmp_path / "sub").mkdir()
    for name in ("a.stl", "sub/b.stl", "sub/gone.stl"):
        (tmp_path / name).write_bytes(stl(box()[2:]))
    run(".", *WRITE, cwd=tmp_path)
    (tmp_path / "sub" / "gone.stl").unlink()
    assert run("b.stl", "../a.stl", "--baseline", "../known.json", cwd=tmp_path / "sub").returncode == 0
    (tmp_path / "a.stl").write_bytes(stl(box()))
    run("a.stl", *WRITE, cwd=tmp_path)
    assert list(json.loads((tmp_path / "known.json").read_text())["files"]) == ["sub/b.stl"]


def test_an_unfinished_check_keeps_its_known_findings(tmp_path):
    (tmp_path / "part.stl").write_bytes(stl(CROSSED))
    run("part.stl", *WRITE, cwd=tmp_path)
    known = (tmp_path / "known.json").read_bytes()
    assert "G001" in known.decode()
    assert "F011" in run("part.stl", *WRITE, "--max-faces", "3", cwd=tmp_path).stdout
    assert (tmp_path / "known.json").read_bytes() == known


def test_the_baseline_of_the_settings(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a.stl").write_bytes(stl(box()[2:]))
    (tmp_path / "unitcad.toml").write_text('[check]\nbaseline = "known.json"\n')
    assert run("sub/a.stl", cwd=tmp_path).returncode == 2
    assert run("sub/a.stl", *WRITE, cwd=tmp_path).returncode == 0
    assert run("a.stl", cwd=tmp_path / "sub").returncode == 0


@pytest.mark.parametrize(
    "content",
    [b"", b"{}", b"[]", b"\xff", b'{"unitcad-baseline": 1}', b'{"unitcad-baseline": 2, "files": {}}', b"[" * 50_000,
     b'{"unitcad-baseline": 1, "files": {"a.stl": 3}}', b'{"unitcad-baseline": 1, "files": {"a.stl": [{"code": 3}]}}',
     b'{"unitcad-baseline": 1, "files": {"a": [{"code": "T001", "severity": "error", "count": 1, "places": [[1]]}]}}',
     b'{"unitcad-baseline": 1, "files": {"a": [{"code": "T001", "severity": "bad", "count": 1}]}}',
     b'{"unitcad-baseline": 1, "files": {"a": [{"code": "T001", "severity": "error", "count": 1, "step": 0}]}}',
     b'{"unitcad-baseline": 1, "files": {"a": [{"code": "T001", "severity": "error", "count": 1, "places": [[1, NaN, 2]]}]}}'],
)  # fmt: skip
@pytest.mark.parametrize("more", [KNOWN, WRITE], ids=["read", "write"])
def test_another_file_in_place_of_a_baseline_is_one_error_and_stays(tmp_path, content, more):
    (tmp_path / "a.stl").write_bytes(stl(box()[2:]))
    (tmp_path / "known.json").write_bytes(content)
    result = run("a.stl", *more, cwd=tmp_path)
    assert (result.returncode, result.stdout, len(result.stderr.splitlines())) == (2, "", 1)
    assert (tmp_path / "known.json").read_bytes() == content
