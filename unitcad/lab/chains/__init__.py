"""Signal chains: an amplitude of samples, with its gain and assumptions; `chain.use` of a campaign names them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from msgspec import Meta

from unitcad.catalogue.entries import between
from unitcad.errors import Refusal, unknown_name
from unitcad.geometry.arrays import Floats
from unitcad.rooms import load
from unitcad.spec.raw import Table

Phase = Callable[[Floats], Floats]
"""A line's phase in rad over time in s."""


@dataclass(frozen=True)
class LineFit:
    """A record's line: amplitude (peak) with its standard uncertainty, in the signal's unit.

    `u_noise` is the part of `u` from the noise next to the line. `value` is the complex amplitude against `phase`.
    `drift` is the range of the frequency over its mean, `snr` the amplitude over the residual's standard deviation,
    `scatter` the standard deviation of the amplitude of blocks over
    their mean. `masked` is the fraction of samples excluded by their residual, `dropped` the same if one of them
    exceeds noise, otherwise 0; `missing` the fraction without numbers.
    """

    amplitude: float
    u: float
    u_noise: float
    value: complex
    frequency_hz: float
    drift: float
    snr: float
    scatter: float
    start_s: float
    end_s: float
    masked: float
    dropped: float
    missing: float
    mains_hz: float
    """The multiple of the mains' frequency that the record can't tell from the line; 0 if there is none."""
    second_hz: float
    """The frequency of another line near this one; 0 if there is none."""
    phase: Phase = field(compare=False, repr=False)


Hertz = Annotated[float, between(1, 500)]
ChainName = Annotated[str, Meta(min_length=1, max_length=40)]


class ChainTable(Table, frozen=True, kw_only=True):
    """The signal chains and their parameters."""

    use: Annotated[
        tuple[ChainName, ...],
        Meta(
            min_length=1,
            max_length=8,
            description="signal chains, line or bandpass; the first one's levels are the result",
        ),
    ] = ("line",)
    mains_hz: Annotated[float, between(40, 400, "frequency of the mains")] = 50.0
    band_hz: Annotated[tuple[Hertz, Hertz], Meta(description="band in which the motor's line is searched")] = (
        60.0,
        250.0,
    )
    order: Annotated[int, between(1, 10, "order of the band-pass (chain bandpass)")] = 4
    q: Annotated[float, between(1, 1000, "quality of the comb filter (chain bandpass)")] = 30.0
    zero_phase: Annotated[bool, Meta(description="whether filters run forwards and backwards (chain bandpass)")] = True
    measure: Annotated[Literal["rms", "peak"], Meta(description="amplitude as rms or peak (chain bandpass)")] = "rms"
    trim_s: Annotated[float, between(0, 1000, "seconds cut from both ends after filtering (chain bandpass)")] = 0.25


@dataclass(frozen=True)
class Chain:
    """A chain with its parameters set.

    `amplitude(x, rate, fit)` is the amplitude (peak) of samples x (n) at `rate` in Hz, in their unit; `fit` is the
    result of the chain `line` for them. It raises Refusal for a record that it can't take. `unfit(fits)` is the reason
    why a chain gives no amplitude for such lines, empty if it does. `gain(hz)` is the chain's gain of an amplitude,
    None for a chain without filters.
    """

    name: str
    amplitude: Callable[[Floats, float, LineFit], float]
    unfit: Callable[[list[LineFit]], str] = lambda fits: ""
    gain: Callable[[float], float] | None = None
    assumed: Mapping[str, Any] = field(default_factory=dict)
    """Parameters that the chain's source does not state, with the values that are assumed."""

    @property
    def assumed_text(self) -> str:
        """The chain's assumptions, as keys of [chain] with their values."""
        shown = {True: "true", False: "false"}
        return ", ".join(
            f"{key} {shown[value] if isinstance(value, bool) else f'{value:g}' if isinstance(value, float) else value}"
            for key, value in self.assumed.items()
        )


CHAINS = {name: f"unitcad.lab.chains.{name}:chain" for name in ("line", "bandpass")}
"""The function that returns a chain with a campaign's parameters, as "module:name"."""


def chains_of(table: ChainTable) -> tuple[Chain, ...]:
    """Return the chains that a campaign uses, in its order. Raises Refusal for a name that is none, or comes twice."""
    for i, name in enumerate(table.use):
        if name not in CHAINS:
            raise unknown_name(f"chain.use.{i}", name, CHAINS)
    if len(set(table.use)) < len(table.use):
        raise Refusal("chain.use", list(table.use), "has a chain twice", list(dict.fromkeys(table.use)))
    return tuple(load(CHAINS[name])(table) for name in table.use)
