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
    """Level at a unit's edge, with its 80 % range and the measurement of that unit.

    Printed, it is the one line that every command shows.

    Attributes
    ----------
    level : float or None
        Amplitude at the edge over the motor's, by the leading model; None if it is not known.
    low, high : float or None
        Ends of the 80 % range of the level.
    measured : float or None
        Measured amplitude at the edge over the motor's, if this unit was measured.
    lines : list of str
        The level, the model behind it with its error, and the paper's analytic model, in words.
    models : dict of str to float or None
        Level by each model that was asked for, all units alike: the leading model's lacks the share of the own errors
        of measured units near this one, which `level` has. None if a model gives no number.
    frequency_hz : float
        Frequency of the drive, Hz.
    data : dict
        The whole estimate, as ``unitcad estimate --json`` prints it.

    Examples
    --------
    >>> import unitcad
    >>> estimated = unitcad.estimate("encapsulating")
    >>> print(estimated)
    Level at the edge: 4.6 % of the motor's amplitude (3.1 to 6.8). Measured in the paper for this unit: 5.2 %.
    >>> round(estimated.level, 3), round(estimated.low, 3), round(estimated.high, 3), estimated.measured
    (0.046, 0.031, 0.068, 0.0517)
    """

    data: dict[str, Any]

    @property
    def level(self) -> float | None:
        """The amplitude at the edge over the motor's, by the leading model; None if it is not known."""
        return summary(self.data)["level"]

    @property
    def low(self) -> float | None:
        """The lower end of the level's 80 % range."""
        return summary(self.data)["low"]

    @property
    def high(self) -> float | None:
        """The upper end of the level's 80 % range."""
        return summary(self.data)["high"]

    @property
    def measured(self) -> float | None:
        """The measured amplitude at the edge over the motor's; None for a unit that nobody measured."""
        return summary(self.data)["measured"]

    @property
    def lines(self) -> list[str]:
        """The level, the model behind it with its error, and the paper's analytic model, in words."""
        return self.data["answer"]["lines"]

    @property
    def models(self) -> dict[str, float | None]:
        """The level by each model that was asked for, all units alike; None if a model gives no number."""
        return {name: block["edge_level"].get("value") for name, block in self.data["models"].items()}

    @property
    def frequency_hz(self) -> float:
        """The frequency of the drive, Hz."""
        return float(summary(self.data)["frequency_hz"])

    def __str__(self) -> str:
        return summary(self.data)["line"]

    def __repr__(self) -> str:
        return f"EdgeEstimate({text.shorten(str(self.data['variant']['name']), 40)!r}: {self})"

    def _repr_html_(self) -> str:
        row = (self.level, self.low, self.high, self.measured)
        return text.table(("level at the edge", "low", "high", "measured"), [row], repr(self))


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
        Models in the data: "rule", "published", "corrected"; "fem" needs scikit-fem and seconds. The level does not
        depend on them. Default: those of the spec.
    frequency_hz : float, optional
        Frequency of the drive, Hz, 1 to 5000. Default: that of the spec or the motor.

    Returns
    -------
    EdgeEstimate
        The level with its range, and all data behind it.

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
