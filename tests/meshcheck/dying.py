"""Options whose use ends the process, for the test of workers that die."""

import os
import time
from dataclasses import dataclass

from unitcad.meshcheck import Options


@dataclass(frozen=True)
class Deadly(Options):
    """`fatal`: kill the process at the first look at it."""

    def __init__(self, fatal):
        super().__init__(unit="die" if fatal else None)

    def __getattribute__(self, name):
        value = object.__getattribute__(self, name)
        if name == "unit" and value == "die" and os.environ.get("PYTEST_CURRENT_TEST") is None:
            os._exit(9)
        return value


def aborts(path):
    os.abort()


def prints(path):
    print("noise")
    raise ModuleNotFoundError("OCP")


def hangs(path):
    time.sleep(60)
