"""Processes that a test started, and those below them."""

import time

import psutil


def until(true, seconds=60.0):
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "the condition did not come true"
        time.sleep(0.02)


def below(process, least=1):
    """Return all processes below one, once there are at least so many."""
    until(lambda: len(psutil.Process(process.pid).children(recursive=True)) >= least)
    return psutil.Process(process.pid).children(recursive=True)


def left(processes, seconds=10.0):
    """Return the names of the processes that still run after some seconds; one that only waits to be reaped is gone."""
    end = time.monotonic() + seconds
    while running := [name for process in processes if (name := _running(process))]:
        if time.monotonic() > end:
            break
        time.sleep(0.02)
    return running


def _running(process):
    try:
        return "" if process.status() == psutil.STATUS_ZOMBIE else process.name()
    except psutil.NoSuchProcess:
        return ""
