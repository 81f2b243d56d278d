"""The question that a suite answers, and the answer in one number, from its stored result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.accuracy.result import Result, Table, shown
from unitcad.attenuation.edge.words import ANY_FORM


def question(result: Result) -> str:
    """Return the question of a suite; its title if none is written here."""
    return _QUESTIONS[result.suite][0] if result.suite in _QUESTIONS else result.title


def answer(result: Result) -> str:
    """Return the answer in one sentence; the suite's worst case if a quick run lacks the table, or none is written."""
    worst = result.summary.worst
    try:
        return _QUESTIONS[result.suite][1](result)
    except LookupError:
        return f"Worst case: {worst}." if worst else ""


def _table(result: Result, title: str) -> Table:
    """Return the table whose title begins so. Raises LookupError without one."""
    for table in result.tables:
        if table.title.startswith(title):
            return table
    raise LookupError(title)


def _column(table: Table, name: str) -> list[Any]:
    return [row[table.columns.index(name)] for row in table.rows]


def _tessellation(result: Result) -> str:
    at_default = ("manifold3d, area-true", 0.01)
    rows = [(table, row) for table in result.tables for row in table.rows if row[:2] == at_default]
    far = max((float(row[table.columns.index("distance, mm")] or 0) for table, row in rows), default=0.0)
    return f"At the default tolerance of 0.01 mm no mesh is farther than {shown(far)} mm from its solid."


def _kernels(result: Result) -> str:
    apart = _column(_table(result, "Largest difference"), "volume, relative")
    within = f"within {shown(max(apart))} of the volume; the two OCCT libraries within {shown(min(apart))}"
    return f"All bodies agree {within}."


def _moulds(result: Result) -> str:
    checks = _table(result, "Worst value")
    return f"{sum(_column(checks, 'broken'))} of {sum(_column(checks, 'findings'))} findings are broken."


def _hankel(result: Result) -> str:
    for case, error, pick in result.summary.picks:
        if " damped" in case and error == "1e-06":
            time = pick.partition(": ")[2].partition(" (")[0]
            return f"An error of 1e-6 takes {time} for 13 radii on the forearm."
    raise LookupError("damped, 1e-06")


def _stability(result: Result) -> str:
    classes = _table(result, "Response of random media, by class")
    over = max(float(value) for value in _column(classes, "largest error over its bound") if value is not None)
    broken = sum(_column(classes, "bounds broken"))
    return f"{broken} bounds were broken; the largest true error is {shown(over)} of its bound."


def _models(result: Result) -> str:
    return f"The estimate misses a new unit by {ANY_FORM}."


def _fem(result: Result) -> str:
    for promise in result.promises:
        if promise.what.startswith("bonded units at fineness 1:"):
            return f"At the default mesh a level of a bonded unit is within {shown(promise.value)} of its limit."
    raise LookupError("bonded units at fineness 1")


def _skin(result: Result) -> str:
    inside = _column(_table(result, "Published measurements"), "ranges overlap")
    return f"{inside.count('yes')} of {len(inside)} published figures overlap the range of the forearm template."


def _design(result: Result) -> str:
    held = {row[0]: row[1] for row in _table(result, "Are 80 % ranges").rows}
    return f"The 80 % range of the rule held for {held['rule']} measured units."


def _extremes(result: Result) -> str:
    return f"{result.promises[0].value:g}: {result.summary.worst}."


def _left_out(result: Result) -> str:
    shares = [float(row[3] or 0) for row in _table(result, "By template").rows if row[1] == "STL, no checks"]
    return f"STL without checks takes {100 * min(shares):.0f} to {100 * max(shares):.0f} % of the time for everything."


def _measure(result: Result) -> str:
    return f"{result.summary.picks[0][1]}, from a record of 2 s with the chain `line`."


def _speed(result: Result) -> str:
    pick = result.summary.picks[0][2]
    time, _, ratio = pick.partition(" (")[0].rpartition(": ")[2], "", pick.rpartition("CadQuery ")[2].partition(" ")[0]
    return f"STL of the ten bodies from a cold start takes {time}; plain CadQuery takes {ratio} times as long."


_QUESTIONS: dict[str, tuple[str, Callable[[Result], str]]] = {
    "tessellation": ("How far are the meshes from the solids?", _tessellation),
    "kernels": ("Do the geometry kernels agree?", _kernels),
    "moulds": ("Do the moulds of random specs pass their checks?", _moulds),
    "hankel": ("How long does a response take for a wanted error?", _hankel),
    "stability": ("Does the error bound of a response hold for extreme media?", _stability),
    "models": ("How far is the estimate from measured units?", _models),
    "fem": ("How exact are the finite elements of a unit?", _fem),
    "skin": ("Does the curve on the skin agree with published measurements?", _skin),
    "design": ("How often does the range of a proposal hold?", _design),
    "extremes": ("How many specs end in anything but a build or a refusal?", _extremes),
    "left-out": ("How much time do fewer outputs save?", _left_out),
    "measure": ("How exact is an amplitude from a record?", _measure),
    "speed": ("How fast is a build?", _speed),
}
