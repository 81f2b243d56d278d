"""`unitcad.estimate` and its result."""

# pyright: strict
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from unitcad import text
from unitcad.arguments import texts
from unitcad.attenuation.edge.estimates import summary
from unitcad.estimate_inputs import estimate_spec
from unitcad.spec.raw import Model
from unitcad.validation import Changes, Source, load


@dataclass(frozen=True, repr=False)
class EdgeEstimate:
    """Fraction of the motor's vibration that reaches the unit's edge, by model.

    Attributes
    ----------
    answer : str
        The sentence that leads the estimate.
    edge : dict of str to float or None
        Amplitude at the edge over the motor's, by model; None if a model gives no number.
    table_error : dict of str to float
        Geometric-mean factor by which each model misses the measured levels; 1 is exact.
    measured : float or None
        Measured amplitude at the edge over the motor's, if the article has this unit.
    frequency_hz : float
        Frequency of the drive, Hz.
    data : dict
        The whole estimate, as ``unitcad estimate --json`` prints it.

    Examples
    --------
    >>> import unitcad
    >>> unitcad.estimate("encapsulating").frequency_hz
    125.0
    """

    data: dict[str, Any]

    @property
    def answer(self) -> str:
        """The two lines that lead the estimate: the measured or expected level, and the paper's analytic model."""
        return "\n".join(summary(self.data)["lines"])

    @property
    def edge(self) -> dict[str, float | None]:
        """The amplitude at the edge over the motor's, by model; None if no number can be given."""
        return {model: row["edge"] for model, row in summary(self.data)["models"].items()}

    @property
    def table_error(self) -> dict[str, float]:
        """The geometric-mean factor by which each model misses the measured levels; 1 is exact."""
        return {model: row["table_error"] for model, row in summary(self.data)["models"].items()}

    @property
    def measured(self) -> float | None:
        """The measured amplitude at the edge over the motor's; None for a unit that nobody measured."""
        return summary(self.data)["measured"]

    @property
    def frequency_hz(self) -> float:
        """The frequency of the drive, Hz."""
        return float(summary(self.data)["frequency_hz"])

    def __repr__(self) -> str:
        levels = ", ".join(f"{model} {text.shown(level)}" for model, level in self.edge.items())
        name = text.shorten(str(self.data["variant"]["name"]), 40)
        return f"EdgeEstimate({name!r}: {self.frequency_hz:g} Hz; edge over motor: {levels})"

    def _repr_html_(self) -> str:
        rows = [(model, level, self.table_error[model]) for model, level in self.edge.items()]
        head = ("model", "edge over motor", "error against the measured table, factor")
        measured = f"; measured {text.shown(self.measured)}" if self.measured is not None else ""
        return text.table(head, rows, f"{self.data['variant']['name']}, {self.frequency_hz:g} Hz{measured}")


def estimate(
    source: Source,
    *,
    set: Changes = (),
    models: Sequence[Model] | Model | None = None,
    frequency_hz: float | None = None,
) -> EdgeEstimate:
    """Estimate the vibration at a unit's edge, and on the skin beyond it.

    Nothing is drawn or written. The estimate is fitted to nine measured units: read its error with it.

    Parameters
    ----------
    source : str, path, dict, Spec or Variant
        Name of a template, path of a TOML file (with a path separator or ending in .toml), or a spec's data.
    set : dict or sequence of str, optional
        Changes by dotted path: ``{"layers.0.wall_mm": 1.2}`` or ``["layers.0.wall_mm=1.2"]``. Lengths in mm.
    models : str or sequence of str, optional
        Models of the level: "rule", "published", "corrected", "divider"; "fem" needs scikit-fem and seconds.
        Default: those of the spec.
    frequency_hz : float, optional
        Frequency of the drive, Hz, 1 to 5000. Default: that of the spec or the motor.

    Returns
    -------
    EdgeEstimate
        Levels by model, as fractions of the motor's amplitude, with their errors.

    Raises
    ------
    Refusal
        For an invalid value, and for a custom design that no model describes.

    Examples
    --------
    >>> import unitcad
    >>> estimated = unitcad.estimate("encapsulating")
    >>> estimated.measured
    0.0517
    """
    spec = load(source, set)
    chosen = {
        "estimate.models": None if models is None else texts("models", models),
        "estimate.frequency_hz": frequency_hz,
    }
    wanted = {path: value for path, value in chosen.items() if value is not None}
    return EdgeEstimate(estimate_spec(load(spec, wanted)))
