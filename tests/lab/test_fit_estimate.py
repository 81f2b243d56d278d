"""A lab's fit in `estimate` and `build`: its constants, its ranges, its own measurement, its name; what is refused."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from scipy import stats
from typer.testing import CliRunner

from unitcad.attenuation.edge.models import stored
from unitcad.attenuation.edge.ranges import predictive
from unitcad.cli import app
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input, estimate_spec, fit_of, frequency_table_of_spec
from unitcad.lab.fit_command import fit_toml
from unitcad.lab.fitting import fit_lab, load_fit_lab
from unitcad.validation import load


@pytest.fixture(scope="module")
def text() -> str:
    return fit_toml(fit_lab(load_fit_lab("synthetic-bench")))


@pytest.fixture
def fit_file(text: str, tmp_path: Path) -> Path:
    path = tmp_path / "lab-fit.toml"
    path.write_text(text)
    return path


def test_the_level_is_by_the_fit_s_constants_with_a_students_t_range(fit_file: Path, text: str) -> None:
    spec = load("embedded", {"estimate.fit": str(fit_file)})
    data, plain = estimate_spec(spec), estimate_spec(load("embedded"))
    fit = tomllib.loads(text)
    for model, block in data["models"].items():
        one, before = fit["model"][model], plain["models"][model]
        assert "predictive" not in before
        s = one["constants"]["s"] / stored()[model]["s"]
        if model in ("published", "corrected"):
            assert block["edge_level"]["value"] == pytest.approx(s * before["edge_level"]["value"], rel=1e-5)
        g = np.ones(1)
        if model == "divider":
            x = one["constants"]["kappa"] * 355 / 15
            assert block["edge_level"]["value"] == pytest.approx(one["constants"]["s"] / (1 + x), rel=1e-8)
            g = np.array([-x / (1 + x), 1.0])
        if model == "rule":
            assert block["edge_level"]["value"] == pytest.approx(
                one["constants"]["s"] * one["constants"]["q"], rel=1e-5
            )
            g = np.ones(2)
        scale = one["model_error"] * np.sqrt(1 + g @ np.array(one["covariance"]) @ g)
        centre = np.log(block["edge_level"]["value"])
        ends = np.exp(stats.t.ppf([0.1, 0.9], one["degrees_of_freedom"], centre, scale))
        assert [block["predictive"]["p10"], block["predictive"]["p90"]] == pytest.approx(ends, rel=1e-7)
        made = predictive(fit_of(spec), model, estimate_input(spec))  # type: ignore[arg-type]
        assert made == pytest.approx((one["degrees_of_freedom"], centre, scale), rel=1e-7)
        error = block["fit_error"]
        assert error["left_out"]["geometric_mean"] == one["left_out"]
        assert error["left_out"]["low"] < one["left_out"] < error["left_out"]["high"]
        assert (error["own_left_out"], error["own_by_stored"]) == (one["own_left_out"], one["own_by_stored"])
        assert error["held_80"] == one["held"]
        assert error["baseline"] == fit["model"]["baseline"]["left_out"]
        assert block["table_error"] == before["table_error"]  # of the stored constants, and said to be
        assert "fit_error" not in before
    assert data["table_error"]["constants"].startswith("the stored ones")
    assert "constants" not in plain["table_error"]
    assert data["fit"]["name"] == "synthetic-bench"
    assert data["fit"]["left_out"]["baseline"]["geometric_mean"] == fit["model"]["baseline"]["left_out"]
    assert data["fit"]["leads"] == data["answer"]["model"] == "rule"
    assert [own["value"] for own in data["own_measured"]] == [0.098]
    assert data["measured"]["level"] == plain["measured"]["level"]
    thicker = load(spec, {"layers.0.wall_mm": 1.3})
    assert estimate_spec(thicker)["own_measured"] == []
    table = frequency_table_of_spec(spec, [100.0])
    assert table["fit"] == {key: data["fit"][key] for key in ("file", "sha256", "name")}
    rows = table["frequencies"]
    assert rows[0]["edge_level"]["rule"]["value"] == pytest.approx(data["models"]["rule"]["edge_level"]["value"])


def test_a_spec_names_its_fit_and_stands_alone(fit_file: Path, tmp_path: Path) -> None:
    (tmp_path / "u.toml").write_text(
        Path("templates/embedded.toml").read_text() + '\n[estimate]\nfit = "lab-fit.toml"\n'
    )
    spec = load(str(tmp_path / "u.toml"))
    assert spec.estimate.fit == "lab-fit.toml"
    fit_file.unlink()
    again = load(spec, {"layers.0.wall_mm": 1.3})
    assert again.estimate.fit_source == spec.estimate.fit_source
    changed = spec.estimate.fit_source.replace('"synthetic-bench"', '"other"')  # type: ignore[union-attr]
    (tmp_path / "other.toml").write_text(changed)
    other = load(spec, {"estimate.fit": str(tmp_path / "other.toml")})
    assert estimate_spec(other)["fit"]["name"] == "other"
    assert other.estimate.fit == "other.toml"


def test_builds_follow_the_fit(fit_file: Path, text: str, tmp_path: Path) -> None:
    """Another fit is another result; the same fit the same bytes."""

    def built(out: str, *options: str) -> Path:
        words = ["build", "embedded", "--only", "estimate", "-o", str(tmp_path / out), *options]
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0, done.output
        return Path(done.stdout.strip().splitlines()[-1])

    plain, fitted = built("a"), built("a", "--fit", str(fit_file))
    again = built("b", "--fit", str(fit_file))
    assert plain.name != fitted.name == again.name
    assert (fitted / "estimate.json").read_bytes() == (again / "estimate.json").read_bytes()
    assert "predictive" in (fitted / "estimate.json").read_text()
    fit_file.write_text(text.replace('"synthetic-bench"', '"other"'))
    assert built("a", "--fit", str(fit_file)).name not in (plain.name, fitted.name)


def test_the_terminal_shows_fit_range_and_own_measurement(fit_file: Path) -> None:
    done = CliRunner().invoke(app, ["estimate", "embedded", "--fit", str(fit_file), "--details"])
    assert done.exit_code == 0
    for words in ("P10 to P90", "measured here", "synthetic-bench", "rule leads", "error by the lab's fit"):
        assert words in done.output
    own = fit_of(load("embedded", {"estimate.fit": str(fit_file)}))
    assert own is not None
    by_fit = done.output.split("error by the lab's fit")[1]
    for name in ("rule", "divider", "published", "corrected"):
        assert f"x {own.model[name].left_out:.2f}" in by_fit
    assert "9.8 %" in done.output.splitlines()[1]
    assert "By a rule fitted to 3 units of synthetic-bench and the paper's nine" in done.output
    shown = json.loads(CliRunner().invoke(app, ["estimate", "embedded", "--fit", str(fit_file), "--json"]).output)
    assert len(shown["fit"]["sha256"]) == 64


def test_a_sweep_s_table_takes_the_fit(fit_file: Path, tmp_path: Path) -> None:
    from unitcad.sweeps.estimate_table import evaluate
    from unitcad.sweeps.sweep import load_sweep

    (tmp_path / "s.toml").write_text(
        'base = "./u.toml"\n[sweep]\nmode = "product"\n"layers.0.material" = ["ecoflex-00-10", "dragon-skin-30"]\n'
    )
    (tmp_path / "u.toml").write_text(
        Path("templates/embedded.toml").read_text() + '\n[estimate]\nfit = "lab-fit.toml"\n'
    )
    sweep = load_sweep(tmp_path / "s.toml")
    levels = next(iter(evaluate(sweep, sweep.count))).levels["published"]
    exact = estimate_spec(load(str(tmp_path / "u.toml")))["models"]["published"]["edge_level"]["value"]
    assert levels[0] == pytest.approx(exact)


def _bad(text: str, *path: object, value: object) -> str:
    data = tomllib.loads(text)
    node = data
    for step in path[:-1]:
        node = node[step]  # type: ignore[index]
    if value is None:
        del node[path[-1]]  # type: ignore[arg-type]
    else:
        node[path[-1]] = value  # type: ignore[index]
    return tomli_w.dumps(data)


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        (("model", "published"), None, "model.published: is required"),
        (("model", "published", "constants"), {"kappa": 1.0}, "must be s"),
        (("model", "published", "constants", "s"), -1.0, "model.published.constants.s"),
        (("model", "published", "degrees_of_freedom"), 0, "degrees_of_freedom"),
        (("model", "divider", "covariance"), [[1.0]], "needs 2 rows"),
        (("model", "divider", "covariance"), [[1.0, 3.0], [3.0, 1.0]], "is no covariance"),
        (("model", "published", "model_error"), 0.0, "model_error"),
        (("format",), 2, "format"),
        (("moduli",), "quasi-static", "quasi-static moduli"),
        (("surprise",), 1, "surprise"),
    ],
)
def test_a_bad_fit_is_refused(text: str, path: tuple, value: object, says: str, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(_bad(text, *path, value=value))
    done = CliRunner().invoke(app, ["estimate", "embedded", "--fit", str(tmp_path / "bad.toml")])
    assert isinstance(done.exception, Refusal)
    assert done.exception.exit_code == 2
    assert says in str(done.exception)


@pytest.mark.parametrize("content", [b"", b"\x00\xff", b"[[[", b"a = 1\n" * 3])
def test_what_is_no_fit_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(content)
    with pytest.raises(Refusal, match=r"estimate\.fit"):
        load("embedded", {"estimate.fit": str(tmp_path / "bad.toml")})
    with pytest.raises(Refusal, match=r"estimate\.fit"):
        load("embedded", {"estimate.fit": "not-there.toml"})
