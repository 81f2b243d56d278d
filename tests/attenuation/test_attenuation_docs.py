"""The pages of the estimate have the computed numbers, and claim no more for a model than over the baseline."""

import json
from pathlib import Path

import numpy as np

from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.edge.models import BASELINE, RULE
from unitcad.attenuation.edge.scores import scores
from unitcad.attenuation.edge.scoring import assessments, choice, in_order, leave_one_class_out
from unitcad.text import number

DOCS = Path(__file__).parents[2] / "docs"


def page(name):
    return (DOCS / "explanation" / f"{name}.md").read_text("utf-8")


def test_scores_of_the_estimate_are_the_computed_ones():
    text, found, out = page("estimate"), assessments(), leave_one_class_out()
    for name in in_order(found):
        one = found[name]
        cells = [
            f"{one.leave_one_out.geometric_mean:.2f}",
            f"{one.leave_one_out_range.low:.2f} to {one.leave_one_out_range.high:.2f}",
            f"{one.leave_one_out.worst:.2f}",
            f"{max(errors[name] for errors in out.values()):.2f}",
        ]
        assert f"| {name} | {' | '.join(cells)} |" in text
    assert f"it scores {choice().score.geometric_mean:.2f}." in text
    assert (scores().lead.coverage, "It held eight of the nine" in text) == (8, True)
    assert found[BASELINE].leave_one_out.geometric_mean < 1.05 * found[RULE].leave_one_out.geometric_mean
    assert not any(word in text.lower() for word in ("validated", "accurate", "predicts", "proves"))


def test_finite_elements_are_the_stored_draws():
    text, data = page("finite-elements"), json.loads((DOCS / "fem.json").read_text("utf-8"))
    draws, drawn = np.array(data["draws"]), np.array(data["nominal"])
    for i, (name, measured) in enumerate(zip(data["units"], measured_table().levels, strict=True)):
        ends = np.moveaxis(100 * np.percentile(draws[:, i], (50, 5, 95), axis=0), 0, -1).reshape(-1, 3)
        cells = [
            "{} ({} to {}); {}".format(*(number(value, 2) for value in (*own, nominal)))
            for own, nominal in zip(ends, 100 * drawn[i].ravel(), strict=True)
        ]
        assert f"| {name} | {100 * measured:.4g} | {' | '.join(cells)} |" in text
    for name, one in data["searches"].items():
        if "either" not in name:
            row = f"{one['count']} | {one['best']:.2f} | {one['nested']:.2f} | {one['chance']:.2g}"
            assert f"| {name.replace('edge', 'own edge')} | {row} |" in text
