"""Where each motor sits on the common circuit, as a table for whoever draws the copper or places the motors."""

from __future__ import annotations

import csv
import io

from unitcad.arrays.array import Array
from unitcad.arrays.circuit.wiring import Wiring
from unitcad.spec import motor_of


def pad_table(array: Array, laid: Wiring) -> bytes:
    """Return a CSV file: a row for each motor's pad, in mm as in the array's frame, and one for the end of the tail.

    x and y from the array's middle, seen from outside; `z_mm`: the pad's face towards the motor, over the skin.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("name", "what", "x_mm", "y_mm", "z_mm", "diameter_mm", "unit", "motor"))
    for pad, place in zip(laid.pads, array.places, strict=True):
        at = (_mm(pad.x), _mm(pad.y), _mm(laid.low), _mm(2 * pad.radius))
        rows.writerow((pad.name, "pad", *at, place.unit.name, motor.name if (motor := motor_of(place.unit)) else ""))
    width = _mm(2 * laid.spine[-1].half)
    rows.writerow(("tail", "end of the tail", _mm(laid.end[0]), _mm(laid.end[1]), _mm(laid.low), width, "", ""))
    return text.getvalue().encode()


def _mm(value: float) -> str:
    return f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")
