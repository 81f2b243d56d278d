"""Settings for every test: hypothesis draws the same examples each time and is not hurried by a loaded machine."""

import os
import signal
import sys
from itertools import groupby, islice
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("unitcad", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unitcad")
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # in the background of a script; commands would ignore it too
    signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path.append(str(Path(__file__).parent / "report"))


def pytest_addoption(parser):
    parser.addoption("--cases", type=int, help="run the first N cases of each test, for a look at all of them")
    parser.addoption("--first", type=int, help="run the first N tests of each file, for a look at all of them")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Count a test that drives a browser or the slicer as long, unless it is marked `smoke`; keep `--cases` and `--first`."""
    for option, end in (("cases", "["), ("first", "::")):
        if most := config.getoption(option):
            groups = groupby(items, lambda item, end=end: item.nodeid.partition(end)[0])
            items[:] = [item for _, group in groups for item in islice(group, most)]
    for item in items:
        slow = "browser" in item.fixturenames or item.get_closest_marker("slicer")
        if slow and not item.get_closest_marker("smoke"):
            item.add_marker(pytest.mark.long)


@pytest.fixture(scope="session")
def browser():
    """Chromium. Its absence is a failure in CI and a reason to skip elsewhere."""
    import chromium

    if chromium.executable() is None and not os.environ.get("CI"):
        pytest.skip("no chromium on this machine (Debian's package of that name)")
    with chromium.browser() as browser:
        yield browser
