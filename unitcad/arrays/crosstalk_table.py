"""The crosstalk of an array as a CSV table: a row for each two units, at the unit's own frequency and over a band."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from unitcad.arrays.array import Array
from unitcad.arrays.crosstalk_matrix import BAND_HZ, DIGITS, Decays

DRIVES = ("flat", "axial")


def crosstalk_csv(array: Array, band: Sequence[float] = BAND_HZ) -> bytes:
    """Return a CSV file: `from` drives, `to` is moved; distances along the skin in mm, from the middle of `from`.

    The other columns are |u| over that at the edge of `from`, to the `centre` and the nearest `edge` of `to`, by drive,
    at `frequency_hz` and then at each frequency of the band. Raises Refusal as `crosstalk_matrix.crosstalk`.
    """
    units = Decays(array)
    apart = ~np.eye(units.pairs.count, dtype=bool)
    heads, columns = [], []
    for hertz in (None, *band):
        for drive in DRIVES:
            both = units.both(drive, hertz)[apart]
            suffix = "" if hertz is None else f"_{hertz:g}hz"
            heads += [f"{drive}_centre{suffix}", f"{drive}_edge{suffix}"]
            columns += [both[:, 0], both[:, 1]]
    values = np.round(np.stack(columns, axis=1), DIGITS)
    distances = np.round(np.stack([units.pairs.centre[apart], units.pairs.edge[apart]], axis=1), 4)
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("from", "to", "distance_mm", "edge_mm", "frequency_hz", *heads))
    names = [place.name for place in array.places]
    for (i, j), away, of in zip(np.argwhere(apart).tolist(), distances.tolist(), values.tolist(), strict=True):
        rows.writerow((names[i], names[j], *away, units.inputs[units.kind[i]].frequency.middle, *of))
    return text.getvalue().encode()
