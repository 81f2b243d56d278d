"""Starting a server: where it binds, what it needs, and what it refuses before it starts."""

import subprocess
import sys
import threading
import time

import pytest
from running import serving

from unitcad.arrays.array_file import array_templates
from unitcad.errors import Refusal, UnitcadError, WrongArgument
from unitcad.serve.server import serve
from unitcad.validation import custom_templates, templates


def test_a_design_that_is_code_needs_a_word(tmp_path):
    with pytest.raises(Refusal, match="--allow-code"):
        serve("custom/dome")
    text = custom_templates()["custom/dome"].read_text("utf-8")
    with serving(tmp_path, "custom/dome", "--allow-code") as own:
        assert "faults" not in own.ask(text)
        # A change of the numbers is no new code, nor is another shipped design; a name that no spec gives is.
        assert "faults" not in own.ask(text, "unit", [{"path": "name", "value": "mine"}])
        lugs = custom_templates()["custom/strap-lugs"].read_text("utf-8")
        assert "faults" not in own.ask(lugs)
        assert own.ask(text, "unit", [{"path": "design", "value": "strap-lugs.py:strap_lugs"}])["faults"]


def test_shipped_code_runs_with_a_word_alone(server):
    lugs = custom_templates()["custom/strap-lugs"].read_text("utf-8")
    assert server.ask(lugs)["faults"]


def test_a_port_that_is_taken_is_told(server):
    with pytest.raises(UnitcadError, match=f"127.0.0.1:{server.port}"):
        serve(None, port=server.port)


def test_a_spec_that_is_not_there_is_refused():
    with pytest.raises(WrongArgument):
        serve("encapsulatin")


def test_the_token_differs_from_start_to_start(tmp_path):
    tokens = set()
    for _ in range(2):
        with serving(tmp_path) as own:
            tokens.add(own.token)
    assert len(tokens) == 2
    assert all(len(token) >= 24 for token in tokens)


def test_without_the_extra_it_says_how_to_get_it():
    code = (
        "import sys\n"
        "for name in ('starlette', 'uvicorn', 'tomlkit'): sys.modules[name] = None\n"
        "sys.argv = ['unitcad', 'serve']\n"
        "from unitcad.cli import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True)
    assert done.returncode == 2
    assert "[serve]" in done.stderr


def test_a_question_under_way_does_not_hold_up_the_end(tmp_path):
    """Ctrl-C ends the server quietly: the question, some seconds of work, is answered that the server is ending."""
    text = array_templates()["wrist-band"].read_text("utf-8")
    answers = []
    with serving(tmp_path) as own:
        own.ask(text)
        asking = threading.Thread(target=lambda: answers.append(own.send("/ask", {"text": text, "what": "moulds"})[0]))
        asking.start()
        time.sleep(1.0)
    asking.join(20)
    assert answers == [500]


def test_a_folder_of_specs_opens_its_only_one_or_names_them(tmp_path):
    text = templates()["embedded"].read_text("utf-8")
    (tmp_path / "settings.toml").write_text("colour = 1")
    (tmp_path / "one.toml").write_text(text)
    with serving(tmp_path, ".") as own:
        assert b"one.toml" in own.send("/")[1]
    (tmp_path / "two.toml").write_text(text)
    with pytest.raises(UnitcadError, match=r"one.toml, two.toml: give one of them"):
        serve(str(tmp_path))
