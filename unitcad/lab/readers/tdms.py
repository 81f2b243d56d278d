"""TDMS of LabVIEW and NI loggers, by npTDMS."""

from __future__ import annotations

import logging
import struct
import warnings
from pathlib import Path

import numpy as np

from unitcad.lab.readers import Channel, Layout, Unreadable

ENDINGS = (".tdms",)
LIBRARY = "nptdms"
MOST_SCALES = 100
"""Scales of a channel: the library looks for each one that is stated."""


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the channels of a TDMS file, named group/channel. Raises Unreadable if it has no numbers."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    log_manager.set_level(logging.CRITICAL)  # it writes whole damaged strings to standard error
    stated = _raw_bytes(path, path.stat().st_size)
    found = []
    with warnings.catch_warnings(), open(path, "rb") as opened, TdmsFile.open(opened) as file:
        warnings.simplefilter("error")
        everything = [channel for group in file.groups() for channel in group.channels()]
        sizes = [getattr(channel.data_type, "size", None) for channel in everything]
        if stated is not None and None not in sizes:
            held = sum(len(channel) * (bytes_ or 0) for channel, bytes_ in zip(everything, sizes, strict=True))
            if held != stated:
                raise Unreadable(str(path), None, f"its channels state {held} bytes of samples, its segments {stated}")
        if file.file_status.channel_statuses is not None:
            raise Unreadable(str(path), None, "its last segment has fewer samples than it states: it is damaged")
        for place in (file, *file.groups(), *everything):  # a channel has its own scales, or its group's, or the file's
            scales = place.properties.get("NI_Number_Of_Scales", 0)
            if not isinstance(scales, int | np.integer) or scales > MOST_SCALES:
                limit = f"states {scales} scales of a channel; at most {MOST_SCALES} are read"
                raise Unreadable(str(path), None, limit)
        for channel in everything:
            if not (isinstance(channel.dtype, np.dtype) and channel.dtype.kind in "fiu" and len(channel)):
                continue
            step, unit = channel.properties.get("wf_increment"), channel.properties.get("unit_string")
            known = isinstance(step, float | int) and np.isfinite(step) and step > 0
            name = f"{channel.group_name}/{channel.name}"
            found.append(
                Channel(channel[:], name, unit if isinstance(unit, str) else "", float(step) if known else None)
            )
    if not found:
        raise Unreadable(str(path), None, "has no channel of numbers")
    return found


def _raw_bytes(path: Path, size: int) -> int | None:
    """Walk the segments' lead-ins; return the bytes of their raw data, None for raw data of DAQmx.

    Raises Unreadable if a segment does not begin at the end of the one before, or the last one does not end with the
    file.
    """
    raw, at, plain = 0, 0, True
    with open(path, "rb") as file:
        while at < size:
            file.seek(at)
            lead = file.read(_LEAD)
            if len(lead) < _LEAD or not lead.startswith(b"TDSm"):
                raise Unreadable(str(path), None, f"has no segment at byte {at}, although it states one")
            (contents,) = struct.unpack("<I", lead[4:8])
            _, following, before = struct.unpack(f"{'>' if contents & _BIG_ENDIAN else '<'}IQQ", lead[8:])
            plain = plain and not contents & _DAQMX
            raw += following - before
            at += _LEAD + following
    if at != size or raw < 0:
        raise Unreadable(str(path), None, f"states {at} bytes and has {size}: it was not closed, or is damaged")
    return raw if plain else None


_LEAD = 28
"""Bytes of a segment's lead-in: tag, contents, version, bytes to the next segment, bytes to the raw data."""
_BIG_ENDIAN = 1 << 6
"""Of the contents, which are little-endian in every file."""
_DAQMX = 1 << 7
