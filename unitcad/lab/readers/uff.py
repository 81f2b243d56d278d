"""Universal files (.uff, .unv): data sets 58 and 58b that are time records, by pyuff. Polytec exports them too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from unitcad.lab.readers import Channel, Layout, Unreadable
from unitcad.lab.units import LENGTHS, Stated

ENDINGS = (".uff", ".unv")
LIBRARY = "pyuff"
TIME_RESPONSE = (0, 1)
"""Function types that are a record over time: general, time response."""
TIME_UNITS = 17
"""The abscissa's specific data type that is time."""
OVER_TIME = {8: "", 11: "/s", 12: "/s2"}
"""The ordinate's specific data types that are a motion: displacement, velocity, acceleration."""


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the time records of a universal file as channels. Raises Unreadable for a file without any."""
    import pyuff

    if not path.read_bytes().rstrip().endswith(b"-1"):
        raise Unreadable(str(path), None, "is cut off: it does not end with the -1 that closes a data set")
    file = pyuff.UFF(str(path))
    kinds = [int(kind) for kind in file.get_set_types()]
    if 0 in kinds:
        raise Unreadable(str(path), None, f"the type of its data set {kinds.index(0) + 1} can't be read")
    sets: list[Any] = [file.read_sets(i) for i, kind in enumerate(kinds) if kind == 58]
    records = [one for one in sets if int(one["func_type"]) in TIME_RESPONSE]
    if not records:
        listed = ", ".join(map(str, kinds)) or "none"
        raise Unreadable(str(path), None, f"has no time record (its data sets: {listed})")
    units: list[Any] = [file.read_sets(i) for i, kind in enumerate(kinds) if kind == 164]
    lengths = [float(one["length"]) for one in units]
    return [_record(path, one, lengths) for one in records]


def _record(path: Path, one: dict[str, Any], lengths: list[float]) -> Channel:
    """Return a data set's channel and samples. Raises Unreadable if its header and its data disagree."""
    name = _label(one["ordinate_axis_lab"]) or _label(one["rsp_ent_name"]) or _label(one["id1"]) or "record"
    data = np.asarray(one["data"])
    where = f"{path.name}: data set {name!r}"
    if np.iscomplexobj(data) or data.ndim != 1:
        raise Unreadable(str(path), None, f"{where} is no real record over time")
    count = int(one["num_pts"])
    if len(data) != count or len(data) < 2:
        raise Unreadable(str(path), None, f"{where} states {count} points and has {len(data)}")
    if int(one["abscissa_spec_data_type"]) not in (0, TIME_UNITS):
        raise Unreadable(str(path), None, f"{where} does not run over time")
    if int(one["abscissa_spacing"]) != 1:
        raise Unreadable(str(path), None, f"{where} is not sampled evenly; resample it, or export text with its time")
    step = float(one["abscissa_inc"])
    label = _label(one["ordinate_axis_units_lab"])
    unit = Stated(label) if label else _by_type(int(one["ordinate_spec_data_type"]), lengths)
    return Channel(data, name, unit.unit, step if step > 0 else None, unit.doubt)


def _by_type(kind: int, lengths: list[float]) -> Stated:
    """Return the unit of a data set without a label: that of its kind in the file's units (data set 164)."""
    over = OVER_TIME.get(kind)
    if over is None or not lengths:
        return Stated()
    unit = next((name for name, metres in LENGTHS.items() if abs(lengths[-1] * metres - 1) < 1e-3), None)
    if unit is None or len(set(lengths)) > 1:
        return Stated(doubt="it has no label of a unit, and the length of data set 164 is no known unit's")
    return Stated(unit + over)


def _label(text: str) -> str:
    return "" if text.strip().upper() == "NONE" else text.strip()
