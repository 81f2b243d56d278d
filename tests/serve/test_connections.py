"""Who is let in at which address, and connections whose headers do not come."""

import contextlib
import socket
import time

import pytest
from running import against, serving

from unitcad.errors import UnitcadError
from unitcad.serve.addresses import hosts, means
from unitcad.serve.server import Connection, serve
from unitcad.validation import templates

HALF = b"GET / HTTP/1.1\r\n"
LAST = b"GET / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
KEPT = b"GET / HTTP/1.1\r\nHost: x\r\n\r\n"


class Quick(Connection):
    """A connection that waits for headers for a short time, one of few."""

    headers_s = 0.3
    most_waiting = 20


async def _hello(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"hi"})


def _run(client):
    against(_hello, Quick, client, timeout_keep_alive=1)


def _read(line):
    """What comes back until the server closes."""
    parts = []
    with contextlib.suppress(ConnectionResetError):
        while part := line.recv(4096):
            parts.append(part)
    return b"".join(parts)


@pytest.mark.parametrize(("sent", "answers"), [([], 0), ([HALF], 0), ([KEPT, HALF], 1), ([KEPT + HALF], 1)])
def test_headers_that_do_not_come_are_not_waited_for(sent, answers):
    """Of a new connection, of a request begun, of the next one on a connection that is kept."""

    def client(connect):
        line = connect()
        for part in sent:
            line.sendall(part)
            time.sleep(0.1)
        assert _read(line).count(b"200 OK") == answers

    _run(client)


def test_a_connection_that_is_used_is_not_cut_off():
    def client(connect):
        line = connect()
        line.sendall(KEPT)
        time.sleep(0.5)
        line.sendall(LAST)
        assert _read(line).count(b"200 OK") == 2

    _run(client)


def test_connections_that_wait_keep_nobody_out():
    def client(connect):
        waiting = [connect() for _ in range(100)]
        for each in waiting:
            with contextlib.suppress(OSError):  # the oldest ones have to go
                each.sendall(HALF)
        begun, line = time.monotonic(), connect()
        line.sendall(LAST)
        assert b"200 OK" in _read(line)
        assert time.monotonic() - begun < 2.0

    _run(client)


@pytest.mark.parametrize("wildcard", ["0.0.0.0", "::"])
def test_at_all_addresses_a_host_is_an_address_or_an_own_name(wildcard):
    allowed = hosts(wildcard, 8000)
    own = ["127.0.0.1:8000", "192.168.1.7:8000", "[fe80::1]:8000", "localhost:8000", f"{socket.gethostname()}:8000"]
    for host in own:
        assert means(host.lower(), allowed), host
    for host in ("evil.example:8000", "192.168.1.7", "192.168.1.7:80", "fe80::1:8000", "[192.168.1.7]:8000",
                 "192.168.1.7.evil.example:8000", "[evil]:8000", "*:80", ":8000", "0x7f.1:8000"):  # fmt: skip
        assert not means(host, allowed), host
    assert not means("192.168.1.7:8000", hosts("127.0.0.1", 8000))
    assert means("192.168.1.7:8000", hosts("192.168.1.7", 8000))


def test_a_folder_of_specs_opens_its_only_one_or_names_them(tmp_path):
    text = templates()["embedded"].read_text("utf-8")
    (tmp_path / "settings.toml").write_text("colour = 1")
    (tmp_path / "one.toml").write_text(text)
    with serving(tmp_path, ".") as own:
        assert b"one.toml" in own.send("/")[1]
    (tmp_path / "two.toml").write_text(text)
    with pytest.raises(UnitcadError, match=r"one.toml, two.toml: give one of them"):
        serve(str(tmp_path))
