"""TDMS of LabVIEW and NI loggers, by npTDMS."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from unitcad.lab.readers import Channel, Layout, Unreadable
from unitcad.lab.units import Scope, stated

ENDINGS = (".tdms",)
LIBRARY = "nptdms"


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the channels of a TDMS file, named group/channel. Raises Unreadable if it is cut off."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    log_manager.set_level(logging.CRITICAL)  # it writes whole damaged strings to standard error
    found = []
    with open(path, "rb") as opened, TdmsFile.open(opened) as file:
        everything = [channel for group in file.groups() for channel in group.channels()]
        if file.file_status.channel_statuses is not None:
            raise Unreadable(str(path), None, "its last segment has fewer samples than it states: it is damaged")
        for channel in everything:
            if not (isinstance(channel.dtype, np.dtype) and channel.dtype.kind in "fiu" and len(channel)):
                continue
            step = channel.properties.get("wf_increment")
            known = isinstance(step, float | int) and np.isfinite(step) and step > 0
            scopes = [
                Scope("its properties", channel.properties),
                Scope("its group's properties", file[channel.group_name].properties, (channel.name,)),
                Scope("the file's properties", file.properties, (channel.name,)),
            ]
            (unit,) = stated(scopes)
            name = f"{channel.group_name}/{channel.name}"
            found.append(Channel(channel[:], name, unit.unit, float(step) if known else None, unit.doubt, unit.likely))
    return found
