"""Names, units and step of the columns of a text file, by the lines above its numbers."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from unitcad.lab.units import (
    TIMES,
    Scope,
    Stated,
    folded,
    in_name,
    is_known_unit,
    is_signal_unit,
    is_unit_key,
    plain,
    stated,
)
from unitcad.text import some


@dataclass(frozen=True)
class Header:
    """Names ("" without one) and units of the columns, and their step in s if the header states it.

    `index`: the first column only counts the samples.
    """

    names: Sequence[str]
    units: Sequence[Stated]
    step_s: float | None = None
    index: bool = False


_ALONE = re.compile(r"[\[(][^\[\]()]*[\])]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_KEY_LINE = re.compile(r"\W*?([^\W\d][\w .-]*?)\s*[:=;,\t]\s*(.*)")
_TIME_AXIS = re.compile(r"(?:x|h|t|horizontal|time|abscissa)(?:axis)?units?")
_WITH_BRACKETS = re.compile(r"[^\s\[(]+(?:\s*[\[(][^\[\]()]*[\])])*|[\[(][^\[\]()]*[\])]")
_MENTION = re.compile(r"[\[(]([^\[\]()]*)[\])]|(?<!\d )\b(?:in|as) ([^\s,;:]+)|(?<![\d.] )(?<!\S)([^\s,;:=\d]+/s\S*)")
"""Places of a unit in a text: in brackets, behind the word in, or any speed that is no number's."""
_END_OF_HEADER = "***End_of_Header***"


def quoted(line: str, delimiter: str, strict: bool = True) -> list[str]:
    """Return the fields of a line with quotes; none if one is not closed."""
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=strict, skipinitialspace=strict), [])
    except csv.Error:
        return []


def read_header(lines: Sequence[str], delimiter: str, width: int) -> Header:
    """Return the header of `width` columns from the lines above their numbers.

    The last line has names, names with units in brackets, or units below a line of names. Lines of a key, such as
    Vertical Units, state units as well. A unit that the header mentions, but of no column that is known, is a doubt.
    """
    lines = [line for line in lines if line.strip()]
    rows = [_words(line, delimiter) for line in lines]
    if any(row[:1] == [_END_OF_HEADER] for row in rows):
        return _labview(rows, width)
    step, index = _rigol(rows[-2:])
    table = [row[:width] if index else row for row in (_fitting(line, delimiter, width) for line in lines[-2:])]
    table = [row for row in table if len(row) == width]
    names, units = _names_and_units(table, width, index)
    for i, one in enumerate(_by_key(lines, width, 1 if width > 1 else 0)):
        if units[i] == Stated():
            units[i] = one
    return Header(names, _with_mentions(units, lines), step, index)


def units_in_lines(lines: Sequence[str], count: int) -> list[Stated]:
    """Return the units of `count` columns of samples by lines of text next to them."""
    return _with_mentions(_by_key(lines, count, 0), lines)


def _with_mentions(units: list[Stated], lines: Sequence[str]) -> list[Stated]:
    """Return units, with a doubt for a column without one if the lines mention a unit that no column has."""
    said = {plain(one.unit) for one in units}
    found = [found[1] or found[2] or found[3] for line in lines for found in _MENTION.finditer(line.replace('"', ""))]
    words = (word.strip() for word in found if is_signal_unit(word) and plain(word) not in said)
    if not (mentioned := list(dict.fromkeys(words))):
        return units
    doubt = Stated(doubt=f"its header mentions {some(mentioned)}, but of no column that is known")
    return [doubt if one == Stated() else one for one in units]


def _words(line: str, delimiter: str) -> list[str]:
    """Return the cells of a header's line, without the sign of a comment."""
    line = re.sub(r"^[#%]+ *(?=[^\s,;])", "", line.strip(" "))  # not of a percentage
    if delimiter == " ":
        return line.split()
    return [word.strip() for word in quoted(line.rstrip().removesuffix(delimiter), delimiter, strict=False)]


def _fitting(line: str, delimiter: str, width: int) -> list[str]:
    """Return a header's line in as many cells as columns, by the delimiter of the numbers or by another one."""
    own = _words(line, delimiter)
    if len(own) == width:
        return own
    clean = re.sub(r"^[#%]+ *(?=[^\s,;])", "", line.strip(" "))
    others = [_words(line, other) for other in ("\t", ";", ",") if other in line]
    others += [re.split(r"\s{2,}", clean.strip()), _WITH_BRACKETS.findall(clean)]
    return next((row for row in others if len(row) == width > 1), own)


def _names_and_units(rows: Sequence[Sequence[str]], width: int, index: bool) -> tuple[list[str], list[Stated]]:
    """Return names and units by the last lines of as many cells as columns."""
    names, units = [""] * width, [Stated()] * width
    if not rows:
        return names, units
    last, above = rows[-1], rows[0] if len(rows) == 2 else None
    alone = [_ALONE.fullmatch(word) is not None for word in last]
    unit = [is_known_unit(word) or one for word, one in zip(last, alone, strict=True)]
    whole = any(last) and all(one for word, one in zip(last, unit, strict=True) if word)
    signals = [is_signal_unit(word) and len(word) > 1 for word in last[1:]]  # one letter may be a name
    below_names = above is not None and (index or (any(signals) and (unit[0] or not last[0] or all(signals))))
    if whole or below_names:
        if above is not None:
            names = list(above)
        elif not all(alone):
            names = [word.strip("[]() ") for word in last]
        texts = [word.strip("[]() ") for word in last]
        units = [Stated(text) if text else Stated() for text in texts]
    elif not any(alone):  # a unit by itself among names: its spaces have split them
        for i, word in enumerate(last):
            names[i], units[i] = in_name(word)
    return names, units


def _by_key(lines: Sequence[str], width: int, first: int) -> list[Stated]:
    """Return the columns' units by lines of a key and its values; column `first` is the first one of samples."""
    samples, time = {}, ""
    for line in lines:
        found = _KEY_LINE.fullmatch(line.replace('"', "").strip())
        if found is None:
            continue
        key, rest = found[1], found[2]
        values = [part.strip(" '") for part in re.split(r"[;,\t]", rest)]
        while values and not values[-1]:
            values.pop()
        if _TIME_AXIS.fullmatch(folded(key)):
            time = values[0] if values and plain(values[0]) in TIMES else time
        elif is_unit_key(key) and values:
            samples[key] = values if len(values) > 1 else values[0]
    out = [Stated()] * width
    for key, values in samples.items():
        at = 0 if isinstance(values, list) and len(values) == width else first
        for i, one in enumerate(stated([Scope("its header's", {key: values})], width - at), at):
            if out[i] == Stated():
                out[i] = one
            elif plain(out[i].unit) != plain(one.unit):
                out[i] = Stated(doubt=f"its header states {out[i].unit or 'an unclear unit'} and {one.unit}")
    if time and first:
        out[0] = Stated(time)
    return out


def _rigol(rows: Sequence[Sequence[str]]) -> tuple[float | None, bool]:
    """Return the step of an oscilloscope whose first column is an index (Rigol), and whether it is one."""
    if len(rows) < 2 or rows[0][:1] != ["X"] or rows[1][:1] != ["Sequence"] or "Increment" not in rows[0]:
        return None, False
    value = [*rows[1], *[""] * len(rows[0])][rows[0].index("Increment")]
    return (float(value) if _NUMBER.fullmatch(value) and float(value) > 0 else None), True


def _labview(rows: Sequence[Sequence[str]], width: int) -> Header:
    """Return the header of a LabVIEW file, which has a value for each channel next to each key."""
    keys = {row[0]: [*row[1:], *[""] * width] for row in rows if row}
    labels = next((values for key, values in keys.items() if folded(key) == "yunitlabel"), [""] * width)
    units = ["s" if keys.get("X_Dimension", [""])[0] in ("", "Time") else "", *labels][:width]
    step = keys.get("Delta_X", [""])[0].replace(",", ".")
    names = rows[-1] if rows[-1][0] == "X_Value" else []
    rising = float(step) if _NUMBER.fullmatch(step) else 0.0
    return Header([*names, *[""] * width][:width], [Stated(one) for one in units], rising if rising > 0 else None)


def beside(lines: list[str]) -> list[str]:
    """Return the lines of an oscilloscope that writes its header next to the data (Tektronix) with the header above."""
    first = next((line for line in lines if line.strip()), "")
    if not re.match(r'"?Record Length"?,', first) or first.count(",") < 4:
        return lines
    rows = [[cell.strip(' "') for cell in line.split(",")] for line in lines if line.strip(" ,")]
    starts = range(0, len(rows[0]) - 4, 6)
    said = [{row[k]: row[k + 1] for row in rows if len(row) > k + 1} for k in starts]
    names = [f"{one.get('Source', f'CH{i}')} ({one.get('Vertical Units', '')})" for i, one in enumerate(said, 1)]
    head = ",".join([f"Time ({said[0].get('Horizontal Units', '')})", *names])
    return [head, *(",".join([row[3], *(row[k + 4] for k in starts)]) for row in rows if len(row) > starts[-1] + 4)]
