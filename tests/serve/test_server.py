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
from unitcad.validation import custom_templates


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "::", "example.com"])
def test_another_address_needs_a_token(host):
    with pytest.raises(WrongArgument, match="loopback"):
        serve(None, host=host)


@pytest.mark.parametrize("token", ["short", "has a space in it now", "é" * 20])
def test_a_token_can_not_be_guessed(token):
    with pytest.raises(WrongArgument, match="16 printable"):
        serve(None, token=token)


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
