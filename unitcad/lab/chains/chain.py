"""What a signal chain gives to a campaign: an amplitude of samples, and what people are told beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from msgspec import Meta

from unitcad.geometry.arrays import Floats
from unitcad.lab.chains.line_fit import LineFit
from unitcad.spec.asked import Table

Hertz = Annotated[float, Meta(ge=1, le=500)]
ChainName = Annotated[str, Meta(min_length=1, max_length=40)]


class ChainTable(Table, frozen=True, kw_only=True):
    """The chains and their parameters; the first one's levels are the result. The paper's are assumed ones."""

    use: Annotated[tuple[ChainName, ...], Meta(min_length=1, max_length=8)] = ("line",)
    mains_hz: Annotated[float, Meta(ge=40, le=400)] = 50.0
    band_hz: tuple[Hertz, Hertz] = (60.0, 250.0)
    order: Annotated[int, Meta(ge=1, le=10)] = 4
    q: Annotated[float, Meta(ge=1, le=1000)] = 30.0
    zero_phase: bool = True
    measure: Literal["rms", "peak"] = "rms"
    trim_s: Annotated[float, Meta(ge=0, le=1000)] = 0.25


@dataclass(frozen=True)
class Chain:
    """A chain with its parameters set.

    `amplitude(x, rate, fit)` is the amplitude (peak) of samples x (n) at `rate` in Hz, in their unit; `fit` is what
    the chain `line` says of them. It raises Refusal for a record that it can't take. `unfit(fits)` says why a chain
    gives no amplitude of a record with such lines, empty where it does. `gain(hz)` is the chain's gain of an amplitude,
    None for a chain without filters. `each_line`: it has an amplitude of every line, not of all in one.
    """

    name: str
    amplitude: Callable[[Floats, float, LineFit], float]
    unfit: Callable[[list[LineFit]], str] = lambda fits: ""
    gain: Callable[[float], float] | None = None
    each_line: bool = False
    zeros_hz: float | None = None
    """The frequency whose multiples the chain takes away."""
    pass_hz: tuple[float, float] | None = None
    assumed: Mapping[str, Any] = field(default_factory=dict)
    """Parameters that the chain's source does not state, with the values that are assumed."""

    @property
    def assumed_text(self) -> str:
        """What the chain assumes, as keys of [chain] with their values."""
        shown = {True: "true", False: "false"}
        return ", ".join(
            f"{key} {shown[value] if isinstance(value, bool) else f'{value:g}' if isinstance(value, float) else value}"
            for key, value in self.assumed.items()
        )
