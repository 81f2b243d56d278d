"""Damaged recordings: a refusal or the right columns, never a crash, a hang, or a column that has shifted."""

import time

import numpy as np
import pytest
from recordings import CENTRES, FORMATS

from unitcad.errors import UnitcadError
from unitcad.lab.readers import open_recording

LONGEST = 90.0
"""Seconds that a damaged file of some kilobytes may take."""


def mutated(content, rng):
    """Change, insert, remove, copy or cut off some bytes.

    Bytes removed in one place and as many inserted in another are no damage that a format without checksums shows.
    """
    data = bytearray(content)
    moves = rng.random() < 0.6
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(0, max(len(data), 1)))
        span = min(int(rng.integers(1, 9)), len(data) - at)
        match int(rng.integers(0, 6 if moves else 3)):
            case 0:
                data[at : at + 1] = bytes([int(rng.integers(0, 256))])
            case 1:
                data[at : at + 1] = b"\n,;\t .0-\xff\x00"[int(rng.integers(0, 10)) :][:1]
            case 2:
                other = int(rng.integers(0, max(len(data) - span, 1)))
                data[at : at + span] = data[other : other + span]
            case 3:
                del data[at : at + span]
            case 4:
                data[at:at] = bytes(data[at : at + span])
            case _:
                if rng.random() < 0.3:
                    del data[at:]
    return mutated(content, rng) if moves and len(data) == len(content) else bytes(data)


def shifted(path):
    """Read a file; say which column holds values that are another column's, if one does."""
    recording = open_recording(path)
    names = {channel.name.rpartition("/")[2]: i for i, channel in enumerate(recording.channels)}
    if path.suffix == ".wav":
        names = {name: i for i, name in enumerate(CENTRES) if i < len(recording.channels)}
    factor = 2**15 / 50 if path.name == "int.wav" else 1.0
    for name, centre in CENTRES.items():
        if name not in names:
            continue
        found = recording.columns((names[name],))[:, 0] * factor
        away = np.abs(found - centre) > 51
        if away.sum() > 12:
            return f"{name}: {away.sum()} of {len(found)} values are not its own, such as {found[away][:3]}"
    return None


@pytest.mark.parametrize("many", [False, pytest.param(True, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", FORMATS)
def test_a_damaged_recording_is_refused_or_right(name, many, tmp_path):
    FORMATS[name](tmp_path / name)
    content = (tmp_path / name).read_bytes()
    own_process = name in ("v73.mat", "plain.h5")
    refused, wrong = 0, []
    for i in range(2000 if many else 6 if own_process else 60):
        (tmp_path / name).write_bytes(mutated(content, np.random.default_rng([1, i])))
        began = time.perf_counter()
        try:
            fault = shifted(tmp_path / name)
        except UnitcadError:
            refused, fault = refused + 1, None
        if fault:
            wrong.append(f"{i}: {fault}")
        if time.perf_counter() - began > LONGEST:
            wrong.append(f"{i}: took {time.perf_counter() - began:.0f} s")
    assert wrong == []
    assert refused > 1
