"""Odd bodies, queries, headers and paths on every route: each gets one line, none ends in a fault of the server."""

import itertools
import json
import os

import pytest
from running import serving

from tests.in_process import unitcad
from unitcad.serve.request_guard import AccessKeys
from unitcad.validation import templates

TEXT = templates()["embedded"].read_text("utf-8")
DEEP = 1
for _ in range(500):
    DEEP = [DEEP]
READ = ["/", "/files/{key}/x.json", "/files/{key}/loop.json", "/files/{key}/secret.json", "/job/x", "/variant/x",
        "/variant/loop", "/nothing", "/ask"]  # fmt: skip
PATHS = ["", "/", "%00", "/%ff%fe", "/" + "a/" * 1500, "/" + "a/" * 7000, "/..", "//", "/\u00e9".encode().hex(), "/%"]
QUERIES = ["", "?", "?&&&&", "?" + "&".join(f"a{i}=1" for i in range(50)), "?token", "?token=%ff", "?token=%00",
           "?" + "&" * 3000, "?token=" + "x" * 9000, "?%", "?token=\u00e9"]  # fmt: skip
HEADERS = [
    "", "Range: bytes=0-", "Range: bytes=-", "Range: bytes=9-1,x", "Range: " + "bytes=" + "0-0," * 900 + "1-1",
    "If-Range: x", "Cookie: ;;=;=", "Cookie: " + "a=b;" * 1000, "Content-Length: 0", "Content-Length: -1",
    "Content-Length: " + "9" * 5000, "Content-Length: 1\r\nContent-Length: 2", "Transfer-Encoding: x",
    "Expect: 100-continue", "Upgrade: websocket\r\nConnection: Upgrade", "Origin: ", "Sec-Fetch-Site: \xff",
    "X-Unitcad-Token: \xff", "Accept: \xff\xfe", "Content-Type: \xff",
]  # fmt: skip
VALUES = [None, [None], {"a": {"b": None}}, DEEP, [[]], {}, [{}], "", "\0", "\u202e", 10**30, 1e308, True]
PLACES = ["name", "layers", "layers.0", "motor", "motor.x"]
EDITS = [
    *({"path": path, "value": value} for path in PLACES for value in VALUES),
    *({"path": path, "value": 1} for path in (".", "..", "a.", "a.b.c", ".".join("a" * 150), "\n", "layers.9", '"')),
    *({"path": path, "remove": True} for path in (".", "layers", "layers.0", "layers.x", "name.x", "motor.part.x")),
    *({"path": "name", "value": value, "toml": True} for value in ("", "[" * 400, "1979-05-27", "{a=1", "'''", 5)),
]  # fmt: skip
BODIES = [
    b"", b"\0", b"null", b"[]", b"{", b'"\xff"', b"[" * 5000, b'{"text": "\\ud800"}', b'{"text": 1e999}',
    b'{"text": "x", "text": "y"}', b"9" * 5000, b'{"text": "\\u0000", "name": "a.toml", "job": "0123456789abcdef"}',
    json.dumps({"text": "a" + ".a" * 3000 + "=1"}).encode(), json.dumps({"text": "a=" + "[" * 3000}).encode(),
    json.dumps({"text": "a=" + "9" * 5000}).encode(), json.dumps({"text": f"{'a' * 70_000} = 1"}).encode(),
    b'{"text": "\\ud800", "name": "a.toml"}',
]  # fmt: skip


@pytest.fixture(scope="session")
def own(server):
    """The server, with a loop of links and a file that nobody may read among its results."""
    out = server.folder / "out"
    out.mkdir(exist_ok=True)
    (out / "x.json").write_text("{}")
    (out / "loop.json").symlink_to(out / "loop.json")
    (out / "secret.json").write_text("{}")
    (out / "secret.json").chmod(0)
    return server


def status(server, head, body=b""):
    """The status of the answer to a request; 0 if the connection is closed without one."""
    answer = server.raw(head.encode("latin-1") + body, seconds=15.0)
    return int(answer.split(b" ")[1]) if answer else 0


def test_odd_addresses_and_headers_are_no_fault_of_the_server(own):
    key = AccessKeys(own.token).address("x.json").partition("/")[0]
    targets = [(route + path, "") for route, path in itertools.product(READ, PATHS)]
    targets += [(route + query, "") for route, query in itertools.product(READ, QUERIES)]
    targets += [(route, header) for route, header in itertools.product(READ, HEADERS)]
    for (target, header), token in itertools.product(targets, ("", f"X-Unitcad-Token: {own.token}\r\n")):
        lines = f"{header}\r\n" if header else ""
        address = target.replace("{key}", key)
        head = f"GET {address} HTTP/1.1\r\nHost: 127.0.0.1:{own.port}\r\nConnection: close\r\n{token}{lines}\r\n"
        assert status(own, head) < 500, (target[:80], header[:80], token)


@pytest.mark.parametrize("route", ["/ask", "/save", "/build", "/sweep", "/cancel", "/", "/job/x", "/files/x"])
def test_odd_bodies_are_no_fault_of_the_server(own, route):
    for body in BODIES:
        assert own.send(route, body=body)[0] < 500, body[:80]


@pytest.mark.parametrize(("kind", "step"), [("edits", 1), ("since", 3)])
def test_odd_edits_are_no_fault_of_the_server(own, kind, step):
    for edit in EDITS[::step]:
        code, content, _ = own.send("/ask", {"text": TEXT, kind: [edit]})
        assert code < 500, (edit, content)
        assert b"internal error" not in content, edit


def test_a_batch_that_has_gone_is_told(tmp_path):
    batch = tmp_path / "batch"
    batch.mkdir()
    (batch / "sweep.toml").write_text(
        'name = "results"\nbase = "embedded"\n[sweep]\nmode = "product"\ndiameter_mm = [13]\n'
    )
    done = unitcad("batch", batch / "sweep.toml", "-o", tmp_path, "--only", "estimate", "--report")
    assert done.returncode == 0
    with serving(tmp_path, "results") as one:
        os.rename(tmp_path / "results", tmp_path / "gone")
        for loop in (False, True):
            if loop:
                (tmp_path / "results").symlink_to("results")
            code, content, _ = one.send("/")
            assert code == 422, content
            assert b"results" in content
            assert one.send("/variant/x")[0] in (404, 422)
