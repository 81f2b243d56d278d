"""What is known of one record: amplitude as displacement, by each chain, and what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.lab.chains.line_fit import Line
from unitcad.lab.lab_rules import LabFinding


@dataclass(frozen=True)
class RecordResult:
    """A record's figures; amplitudes (peak) and standard uncertainties in um. `ratio` is to the motor's own channel.

    `usable`: it counts for levels. `by_chain` has each chain's amplitude over which a level is taken, without the
    chains that the record is not fit for; `by_line` the same of each line in the band by the chain `line`, with its
    frequency; `gains` what a chain's filters pass of the line; `picture` the samples and the spectrum of its first
    section, in the sensor's unit.
    """

    file: str
    sha256: str
    role: str
    rate_hz: float
    samples: int
    amplitude_um: float
    u_um: float
    shared: float
    frequency_hz: float
    drift: float
    snr: float
    steady_s: float
    masked: float
    lines: tuple[Line, ...]
    ratio: float | None
    lag_deg: float | None
    by_chain: dict[str, float]
    by_line: tuple[tuple[float, float], ...]
    gains: dict[str, float]
    findings: tuple[LabFinding, ...]
    usable: bool
    unit: str
    picture: tuple[Floats, Floats, Floats, Floats]

    @property
    def length_s(self) -> float:
        """The record's length in s."""
        return self.samples / self.rate_hz

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-ready data, six significant digits; a record that counts for nothing has no uncertainty."""
        short = {key: _short(value) for key, value in vars(self).items() if isinstance(value, float | int | str)}
        if not self.usable:
            short |= {"u_um": None, "shared": None}
        size = "amplitude_um" if self.ratio is None else "ratio"
        short["length_s"] = _short(self.length_s)
        short["by_chain"] = {name: _short(value) for name, value in self.by_chain.items()}
        short["by_line"] = [{"frequency_hz": _short(hertz), size: _short(value)} for hertz, value in self.by_line]
        short["gains"] = {name: _short(value) for name, value in self.gains.items()}
        short["lines"] = [
            {
                "frequency_hz": _short(one.frequency_hz),
                "amplitude_um": _short(one.amplitude),
                "u_um": _short(one.u) if self.usable else None,
            }
            for one in self.lines
        ]
        short["findings"] = [one.as_dict() for one in self.findings]
        return short


def _short(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.6g}") if np.isfinite(value) else None
    return value
