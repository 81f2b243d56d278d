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
CASES = {"hole": box()[2:], "crossed": CROSSED, "touching": TOUCHING, "inverted": INVERTED, "cavity": CAVITY,
         "film": FILM, "table": TABLE, "double": np.concatenate([box(), box()[:1]])}  # fmt: skip
KNOWN = ["--baseline", "known.json"]


def shuffled(triangles, seed):
    """The same surface as another program may write it: faces in another order, each from another corner."""
    rng = np.random.default_rng(seed)
    turned = np.array([np.roll(face, rng.integers(3), axis=0) for face in triangles])
    return turned[rng.permutation(len(turned))]


def verdicts(result):
    (entry,) = json.loads(result.stdout)["files"]
    return {found["code"]: found["known"] for found in entry["findings"]}


@pytest.mark.parametrize("name", CASES)
def test_a_new_export_of_the_same_part_holds_nothing_new(tmp_path, name):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(CASES[name]))
    printed = ["--printer", "fdm-0.4", "--fail-on", "warning"]
    found = verdicts(run("a.stl", *printed, "--json", cwd=tmp_path))
    assert found
    assert not any(found.values())
    assert run("a.stl", *printed, *KNOWN, "--write-baseline", cwd=tmp_path).returncode == 0
    first = (tmp_path / "known.json").read_bytes()
    for seed in range(4):
        path.write_bytes(stl(shuffled(CASES[name], seed)))
        result = run("a.stl", *printed, *KNOWN, "--json", cwd=tmp_path)
        assert verdicts(result) == dict.fromkeys(found, True)
        assert result.returncode == 0
        assert json.loads(result.stdout)["baseline"] == "known.json"
    path.write_bytes(stl(CASES[name]))
    run("a.stl", *printed, *KNOWN, "--write-baseline", cwd=tmp_path)
    assert (tmp_path / "known.json").read_bytes() == first


@pytest.mark.parametrize(
    ("worse", "code"),
    [(box()[4:], "T001"), (np.concatenate([box()[2:], box((1, 1, 1), (30, 0, 0))[2:]]), "T001"),
     (np.concatenate([box()[2:], box((4, 4, 4), (8, 3, 3))]), "G001"), (box((10, 10, 10))[:10], "T001")],
    ids=["larger hole", "second hole", "another fault", "hole elsewhere"],
)  # fmt: skip
def test_what_is_new_fails(tmp_path, worse, code):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(box()[2:]))
    run("a.stl", *KNOWN, "--write-baseline", cwd=tmp_path)
    assert run("a.stl", *KNOWN, cwd=tmp_path).returncode == 0
    path.write_bytes(stl(worse))
    result = run("a.stl", *KNOWN, "--json", cwd=tmp_path)
    assert result.returncode == 1
    assert verdicts(result)[code] is False


def test_new_places_come_first_and_the_message_counts(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(np.concatenate([box((30, 30, 30))[2:], box()])))
    run("a.stl", *KNOWN, "--write-baseline", cwd=tmp_path)
    path.write_bytes(stl(np.concatenate([box((30, 30, 30))[2:], box(at=(50, 0, 0))[2:]])))
    (entry,) = json.loads(run("a.stl", *KNOWN, "--json", "--select", "T001", cwd=tmp_path).stdout)["files"]
    (found,) = entry["findings"]
    assert found["message"] == "8 boundary edges (4 in the baseline)"
    assert [place["xyz"][0] >= 50 for place in found["locations"]] == [True] * 4 + [False]


def test_known_findings_in_every_format(tmp_path):
    (tmp_path / "a.stl").write_bytes(stl(box()[2:]))
    run("a.stl", *KNOWN, "--write-baseline", cwd=tmp_path)
    text = run("a.stl", *KNOWN, cwd=tmp_path).stdout
    assert text.startswith("a.stl: T001 error (known): 4 boundary edges")
    assert text.endswith("1 file: 1 passed, 1 known finding\n")
    assert "How to fix" not in text
    github = run("a.stl", *KNOWN, "--output-format", "github", cwd=tmp_path).stdout
    assert github.startswith("known: a.stl: T001 error (known): ")
    assert "::" not in github
    (result,) = json.loads(run("a.stl", *KNOWN, "--output-format", "sarif", cwd=tmp_path).stdout)["runs"][0]["results"]
    assert (result["baselineState"], result["suppressions"]) == ("unchanged", [{"kind": "external"}])
    junit = run("a.stl", *KNOWN, "--output-format", "junit", cwd=tmp_path).stdout
    assert 'failures="0"' in junit
    assert "T001 error (known)" in junit


def test_what_ended_the_judgement_or_breaks_a_manifest_is_never_known(tmp_path):
    (tmp_path / "cut.stl").write_bytes(stl(box())[:-80])
    assert run("cut.stl", *KNOWN, "--write-baseline", cwd=tmp_path).returncode == 1
    assert run("cut.stl", *KNOWN, cwd=tmp_path).returncode == 1
    (tmp_path / "good.stl").write_bytes(stl(box()))
    part = {"name": "a", "role": "unit", "volume_mm3": 7.0, "files": {"stl": {"path": "good.stl"}}}
    (tmp_path / "manifest.json").write_text(json.dumps({"parts": [part]}))
    assert run("--manifest", ".", *KNOWN, "--write-baseline", cwd=tmp_path).returncode == 1


def test_files_are_found_from_the_baselines_folder_and_others_stay(tmp_path):
    (tmp_path / "sub").mkdir()
    for name in ("a.stl", "sub/b.stl", "sub/gone.stl"):
        (tmp_path / name).write_bytes(stl(box()[2:]))
    run(".", *KNOWN, "--write-baseline", cwd=tmp_path)
    (tmp_path / "sub" / "gone.stl").unlink()
    assert run("b.stl", "../a.stl", "--baseline", "../known.json", cwd=tmp_path / "sub").returncode == 0
    (tmp_path / "a.stl").write_bytes(stl(box()))
    run("a.stl", *KNOWN, "--write-baseline", cwd=tmp_path)
    assert list(json.loads((tmp_path / "known.json").read_text())["files"]) == ["sub/b.stl"]


def test_the_baseline_of_the_settings(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a.stl").write_bytes(stl(box()[2:]))
    (tmp_path / "unitcad.toml").write_text('[check]\nbaseline = "known.json"\n')
    assert run("sub/a.stl", cwd=tmp_path).returncode == 2
    assert run("a.stl", "--write-baseline", cwd=tmp_path / "sub").returncode == 0
    assert run("sub/a.stl", cwd=tmp_path).returncode == 0
    assert run("sub/a.stl", "--no-config", cwd=tmp_path).returncode == 1
    assert run("sub/a.stl", "--no-config", "--write-baseline", cwd=tmp_path).returncode == 2


@pytest.mark.parametrize(
    "content",
    [b"", b"{}", b"[]", b"\xff", b'{"unitcad-baseline": 1}', b'{"unitcad-baseline": 2, "files": {}}', b"[" * 50_000,
     b'{"unitcad-baseline": 1, "files": {"a.stl": 3}}', b'{"unitcad-baseline": 1, "files": {"a.stl": [{"code": 3}]}}',
     b'{"unitcad-baseline": 1, "files": {"a": [{"code": "T001", "severity": "error", "count": 1, "places": [[1]]}]}}'],
)  # fmt: skip
@pytest.mark.parametrize("more", [[], ["--write-baseline"]])
def test_what_is_no_baseline_is_one_error_and_stays(tmp_path, content, more):
    (tmp_path / "a.stl").write_bytes(stl(box()[2:]))
    (tmp_path / "known.json").write_bytes(content)
    result = run("a.stl", *KNOWN, *more, cwd=tmp_path)
    assert (result.returncode, result.stdout, len(result.stderr.splitlines())) == (2, "", 1)
    assert (tmp_path / "known.json").read_bytes() == content
    # In this program's words, not those of the library that reads it.
    assert not any(word in result.stderr for word in ("Expected", "Object", "malformed", "$", "`int`"))


def test_all_locations_are_listed_on_request(tmp_path):
    many = np.concatenate([box(at=(20 * i, 0, 0))[2:] for i in range(40)])
    (tmp_path / "a.stl").write_bytes(stl(many))

    def places(*more):
        (entry,) = json.loads(run("a.stl", "--json", "--select", "T001", *more, cwd=tmp_path).stdout)["files"]
        (found,) = entry["findings"]
        assert found["count"] == 160
        return found["locations"]

    assert len(places()) == 5
    everything = places("--all-locations")
    assert len({tuple(place["xyz"]) for place in everything}) == 160
    assert everything[:5] == places()
    run("a.stl", *KNOWN, "--write-baseline", cwd=tmp_path)
    assert (len(places(*KNOWN)), len(places(*KNOWN, "--all-locations"))) == (5, 160)
    (entry,) = json.loads((tmp_path / "known.json").read_text())["files"]["a.stl"][:1]
    assert len(entry["places"]) == 160


def test_an_unfinished_check_keeps_what_was_known(tmp_path):
    (tmp_path / "part.stl").write_bytes(stl(CROSSED))
    write = ("part.stl", *KNOWN, "--write-baseline")
    run(*write, cwd=tmp_path)
    known = (tmp_path / "known.json").read_bytes()
    assert "G001" in known.decode()
    assert "F011" in run(*write, "--max-faces", "3", cwd=tmp_path).stdout
    assert (tmp_path / "known.json").read_bytes() == known
