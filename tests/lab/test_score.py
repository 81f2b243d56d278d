"""`unitcad score`: a digitised figure against every model with constants that were fixed before; what is refused."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from unitcad.attenuation.edge.models import MODELS, stored
from unitcad.catalogue import figures
from unitcad.cli import app
from unitcad.errors import Refusal, UnitcadError
from unitcad.estimate_inputs import estimate_spec
from unitcad.lab.scoring import COLUMNS, load_figure, score_figure
from unitcad.validation import load

HEAD = ",".join(COLUMNS) + "\n"


def written(folder, *rows):
    path = folder / "figure.csv"
    path.write_text("# a comment\n" + HEAD + "".join(f"{row}\n" for row in rows))
    return str(path)


def test_the_levels_are_those_of_an_estimate_and_do_not_depend_on_the_figure(tmp_path):
    """Blind: a figure that is ten times off changes its score, and no model's level."""
    row = "embedded D30/E10,0,{},0.05,figure 8"
    data = score_figure(load_figure(written(tmp_path, row.format(0.62))))
    spec = load("embedded", {"layers.0.material": "dragon-skin-30", "layers.1.material": "ecoflex-00-10"})
    expected = estimate_spec(spec)
    (one,) = data["units"]
    for model in MODELS:
        assert one["levels"][model] == pytest.approx(expected["models"][model]["edge_level"]["value"], rel=1e-5)
        factor = np.exp(abs(np.log(one["levels"][model] / 0.62)))
        assert data["scores"][model] == pytest.approx(factor, rel=1e-4)
    assert (one["p10"], one["p90"]) == pytest.approx((expected["answer"]["p10"], expected["answer"]["p90"]), rel=1e-5)
    other = score_figure(load_figure(written(tmp_path, row.format(0.062))))
    assert other["units"][0]["levels"] == one["levels"]
    assert (data["coverage"], other["coverage"]) == ("1 of 1", "0 of 1")


def test_a_unit_that_the_constants_were_fitted_to_is_not_scored(tmp_path):
    data = score_figure(load_figure(written(tmp_path, "embedded E10/D30,0,0.156,,text", "single E10,0,0.4518,,text")))
    assert [one["blind"] for one in data["units"]] == [False, False]
    assert set(data["scores"].values()) == {None}
    s = stored()["rule"]["s"]
    assert data["units"][1]["levels"]["rule"] == pytest.approx(s, rel=1e-5)


def test_points_farther_out_are_over_the_unit_s_own_level(tmp_path):
    rows = ["embedded D30/D10,0,0.5,,f", "embedded D30/D10,10,0.1,,f"]
    data = score_figure(load_figure(written(tmp_path, *rows)))
    (one,) = data["decay"]
    curve = estimate_spec(load("embedded"))["layered"]["drives"]["flat"]["u"]
    assert one["measured"] == 0.2
    assert one["flat"] == pytest.approx({key: curve[key][10] for key in ("value", "low", "high")}, rel=1e-4)
    assert data["decay_scores"]["flat"] == pytest.approx(curve["value"][10] / 0.2, rel=1e-4)


def test_the_shipped_figure_says_that_it_is_synthetic_and_is_scored(tmp_path):
    assert set(figures()) == {"synthetic"}
    assert "SYNTHETIC" in figures()["synthetic"].read_text()
    done = CliRunner().invoke(app, ["score", "synthetic"], env={"COLUMNS": "160"})
    assert done.exit_code == 0
    assert "encapsulating E10/D30 *" in done.stdout
    assert "factor error, blind" in done.stdout
    data = json.loads(CliRunner().invoke(app, ["score", "synthetic", "--json"]).stdout)
    assert data == json.loads(json.dumps(score_figure(load_figure("synthetic"))))
    assert len(data["decay"]) == 5


@pytest.mark.parametrize(
    ("row", "field", "limit"),
    [
        ("embeded D30/E10,0,0.6,,f", "unit", "closest: embedded"),
        ("embedded D30/X10,0,0.6,,f", "unit", "unknown name"),
        ("single D30/E10,0,0.6,,f", "unit", "single has one silicone"),
        ("embedded D30,0,0.6,,f", "unit", "a design two or more"),
        ("embedded D30/E10,0,62,,f", "value", "not per cent"),
        ("embedded D30/E10,0,0,,f", "value", "from 1e-06"),
        ("embedded D30/E10,-1,0.6,,f", "distance_mm", "from 0 to 30"),
        ("embedded D30/E10,0,x,,f", "value", "must be a number"),
        ("embedded D30/E10,0,0.6", "row", "must have 5 cells"),
        ("embedded D30/E10,0,0.6,,f,g", "row", "must have 5 cells"),
        ("embedded D30/E10,5,0.2,,f", "distance_mm", "needs a row at 0 mm"),
        ("embedded D10/D10,0,0.4,,f", "unit", "name it single D10"),
    ],
)
def test_what_is_refused(tmp_path, row, field, limit):
    with pytest.raises(Refusal) as refused:
        load_figure(written(tmp_path, row))
    assert (refused.value.field, refused.value.line) == (field, 3)
    assert limit in str(refused.value)


def test_files_that_are_no_figures_are_refused(tmp_path):
    with pytest.raises(Refusal, match="FIGURE = 'synthetc': unknown name; closest: synthetic"):
        load_figure("synthetc")
    with pytest.raises(UnitcadError):
        load_figure(str(tmp_path / "none.csv"))
    with pytest.raises(Refusal, match="has no points"):
        load_figure(written(tmp_path))
    (tmp_path / "a.csv").write_text("unit,value\n")
    with pytest.raises(Refusal, match="must be unit,distance_mm,value,error,source"):
        load_figure(str(tmp_path / "a.csv"))
