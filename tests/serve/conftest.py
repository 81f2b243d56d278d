"""One server for the tests that only ask."""

import pytest

pytest.importorskip("starlette", reason="the extra serve is not installed")
pytest.importorskip("uvicorn", reason="the extra serve is not installed")
pytest.importorskip("tomlkit", reason="the extra serve is not installed")
from running import serving

from unitcad.validation import templates


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """A server of the default template."""
    with serving(tmp_path_factory.mktemp("served")) as running:
        yield running


@pytest.fixture(scope="session")
def text():
    """The text of the encapsulating template."""
    return templates()["encapsulating"].read_text("utf-8")
