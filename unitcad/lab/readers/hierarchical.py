"""HDF5, and MATLAB files of version 7.3, which are HDF5, by h5py: read in blocks."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from unitcad import children
from unitcad.geometry.arrays import Floats
from unitcad.lab.readers.recording_layout import Layout
from unitcad.lab.readers.whole import columns_of
from unitcad.lab.recording import Channel, Recording, Unreadable, is_time

ENDINGS = (".h5", ".hdf5")
HDF5_MARK = b"\x89HDF\r\n\x1a\n"
MOST_COLUMNS = 4096
LONGEST_S = 60.0
"""Seconds after which a file that is not listed yet is taken for a damaged one."""


def read(path: Path, layout: Layout) -> Recording:
    """Return the numeric data sets of one or two dimensions; those of two give a channel per line of the shorter side.

    Data that lies in other files is refused. Raises Unreadable.
    """
    found = _listed(path)
    if not found:
        raise Unreadable(str(path), None, "holds no data set of numbers")

    def blocks(indices: tuple[int, ...]) -> Iterator[Floats]:
        import h5py

        with h5py.File(path, "r") as file:
            lazy = [_Column(file[found[i][0]], found[i][1]) for i in indices]
            yield from columns_of(path, [found[i][2].name for i in indices], lazy)  # type: ignore[arg-type]

    channels = tuple(channel for _, _, channel in found)
    times = [i for i, one in enumerate(channels) if is_time(one.name.rpartition("/")[2], one.unit)]
    return Recording(path, "hdf5", channels, blocks, times[0] if len(times) == 1 else None)


class _Column:
    """A line of a data set, which is read when it is sliced; `place` is its index and the side that samples run on."""

    def __init__(self, data: Any, place: tuple[int, int]) -> None:
        self.data, self.index, self.side = data, *place

    def __len__(self) -> int:
        return self.data.shape[self.side]

    def __getitem__(self, span: slice) -> Floats:
        if self.data.ndim == 1:
            return self.data[span]
        return self.data[span, self.index] if self.side == 0 else self.data[self.index, span]


def _listed(path: Path) -> list[tuple[str, tuple[int, int], Channel]]:
    """Return a file's columns as a process of its own lists them: HDF5 may never return from a damaged file."""
    _expect_whole(path)
    code = "from unitcad.lab.readers.hierarchical import tell; import sys; tell(sys.argv[1])"
    try:
        done = children.run([sys.executable, "-P", "-c", code, str(path.resolve())], timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        raise Unreadable(str(path), None, f"is damaged: HDF5 did not return in {LONGEST_S:g} s") from None
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:] or ["HDF5 crashed"]
        if "No module named 'h5py'" in said[0]:
            raise ModuleNotFoundError(said[0], name="h5py")
        raise Unreadable(str(path), None, f"is damaged, or no {path.suffix} file ({said[0][:200]})")
    listed = json.loads(done.stdout)
    return [(name, (i, side), Channel(title, unit, count=count)) for name, i, side, title, unit, count in listed]


def tell(path: str) -> None:
    """Print a file's columns as JSON, after a look at the first and the last sample of each."""
    import h5py

    found = _columns(Path(path))
    with h5py.File(path, "r") as file:
        for name, place, _ in found:
            column = _Column(file[name], place)
            _ = column[0:1], column[len(column) - 1 : len(column)]
    print(json.dumps([[name, *place, one.name, one.unit, one.count] for name, place, one in found]))


def _columns(path: Path) -> list[tuple[str, tuple[int, int], Channel]]:
    import h5py

    sizes = [("STD_I", bits) for bits in (8, 16, 32, 64)] + [("STD_U", bits) for bits in (8, 16, 32, 64)]
    sizes += [("IEEE_F", bits) for bits in (16, 32, 64)]
    plain = [getattr(h5py.h5t, f"{start}{bits}{order}") for start, bits in sizes for order in ("LE", "BE")]
    found: list[tuple[str, tuple[int, int], Channel]] = []

    def visit(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset) or name.startswith("#") or node.ndim not in (1, 2):
            return
        if node.dtype.kind not in "fiu" or not node.shape or max(node.shape) < 2:
            return
        if node.is_virtual or node.external:
            raise Unreadable(str(path), None, f"{name} lies in another file")
        if not node.id.get_storage_size():
            raise Unreadable(str(path), None, f"{name} has no samples stored")
        if not any(node.id.get_type() == kind for kind in plain):
            raise Unreadable(str(path), None, f"the numbers of {name} have no standard layout: it is damaged")
        side = 0 if node.ndim == 1 or node.shape[0] >= node.shape[1] else 1
        count = 1 if node.ndim == 1 else min(node.shape)
        if count > MOST_COLUMNS:
            return
        unit = next((_text(node.attrs[key]) for key in ("unit", "units") if key in node.attrs), "")
        for i in range(count):
            title = name if count == 1 else f"{name}:{i + 1}"
            found.append((name, (i, side), Channel(title, unit, count=node.shape[side])))

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _expect_whole(path: Path) -> None:
    """Raise Unreadable where the file does not end where its superblock states."""
    size = path.stat().st_size
    with open(path, "rb") as file:
        base = 0
        while base < size and file.read(8) != HDF5_MARK:
            base = 2 * base or 512
            file.seek(base)
        rest = file.read(64)
    if len(rest) < 64:
        raise Unreadable(str(path), None, "is no HDF5 file")
    at = {0: 32, 1: 36}.get(rest[0], 20)
    lengths = rest[5] if rest[0] < 2 else rest[1]
    end = int.from_bytes(rest[at : at + 8], "little")
    if lengths == 8 and end not in (size, size - base):
        raise Unreadable(str(path), None, f"states {end} bytes and has {size}: it was not closed, or is damaged")


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value if isinstance(value, str) else ""
