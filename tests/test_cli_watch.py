"""`unitcad build --watch`: a build after every save, a refusal in between, the end by Ctrl-C."""

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time

import pytest
from typer.testing import CliRunner

from unitcad.cli import app
from unitcad.cli.build_command import wait_for_saves
from unitcad.errors import WrongArgument
from unitcad.validation import templates


@contextlib.contextmanager
def killed(process):
    """Leave no process behind, whatever fails."""
    try:
        yield
    finally:
        process.kill()


def test_every_save_is_built_and_a_refusal_leaves_the_last_result(tmp_path):
    spec = tmp_path / "mine.toml"
    text = templates()["single-embedded"].read_text("utf-8")
    spec.write_text(text)
    command = [sys.executable, "-P", "-m", "unitcad", "build", "mine.toml", "--watch", "--only", "unit"]
    lines = queue.Queue()
    with (
        subprocess.Popen(
            command,
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process,
        killed(process),
    ):
        assert process.stdout
        stream = process.stdout
        threading.Thread(target=lambda: [lines.put(line) for line in stream], daemon=True).start()

        def until_waiting():
            got = []
            while not (got and got[-1].startswith("waiting for a save")):
                got.append(lines.get(timeout=120))
            return got

        first = until_waiting()
        spec.write_text(text.replace("diameter_mm = ", "diameter_mm = -"))
        refused = until_waiting()
        temporary = tmp_path / "mine.toml~"
        temporary.write_text(text.replace('name = "', 'name = "second-'))
        os.replace(temporary, spec)  # how most editors save
        second = until_waiting()
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0
    assert any(line.startswith("out/single-embedded-") for line in first)
    assert any("error: mine.toml:" in line and "diameter_mm" in line for line in refused)
    assert any(line.startswith("out/second-") for line in second)
    assert len(list((tmp_path / "out").glob("*/manifest.json"))) == 2


def test_files_that_a_spec_names_are_watched(tmp_path):
    spec, design = tmp_path / "mine.toml", tmp_path / "mine.py"
    spec.write_text('design = "mine.py:mine"\n')
    design.write_text("a = 1\n")
    told = wait_for_saves([spec])
    next(told)
    threading.Timer(0.5, lambda: design.write_text("a = 12\n")).start()
    begun = time.monotonic()
    next(told)
    assert time.monotonic() - begun > 0.4


def test_a_template_can_not_be_saved():
    result = CliRunner().invoke(app, ["build", "embedded", "--watch"])
    assert isinstance(result.exception, WrongArgument)
    assert json.dumps("embedded").strip('"') in str(result.exception)


@pytest.mark.parametrize("text", ["", "a = [", "design = 3"])
def test_a_text_that_is_no_spec_is_watched_too(tmp_path, text):
    spec = tmp_path / "mine.toml"
    spec.write_text(text)
    told = wait_for_saves([spec])
    next(told)
    threading.Timer(0.3, spec.unlink).start()
    next(told)
