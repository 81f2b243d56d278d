"""Requests of others: another site's, a rebound name's, without the token, too large, out of the folder."""

import itertools
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import pytest

from unitcad.serve.request_guard import LARGEST_BODY, AccessKeys
from unitcad.validation import templates

HOSTS = ["evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example", "0.0.0.0", "[::]"]
ORIGINS = ["http://evil.example", "https://127.0.0.1", "null", "http://localhost", "file://", "http://127.0.0.1:1"]
TOKENS = ["", "x", "0" * 32, "é" * 16, "a" * 5000]
PATHS = [
    "../../etc/passwd", "..%2f..%2fetc%2fpasswd", "%2e%2e/%2e%2e/etc/passwd", "....//....//etc/passwd", "/etc/passwd",
    "//etc/passwd", "C:%5cwindows", "..%5c..%5csecret.toml", "a/../../secret.toml", ".hidden/x.json", "link.html",
    "linked/secret.toml", "secret.toml%00.html", "%00", "~root/x.html", "proc/self/environ", "out/../secret.toml",
]  # fmt: skip
MESSAGES  = [
    [], None, 3, "text", {}, {"text": 5}, {"text": "x", "what": "secrets"}, {"text": "x", "other": 1},
    {"text": "x", "edits": [{"path": "name", "value": 1, "code": "x"}]}, {"text": "x", "edits": [{}] * 60},
    {"text": "x" * 1_000_001}, {"text": "x", "page": "../x"}, {"text": "x", "edits": {"path": "name"}},
]  # fmt: skip


ROUTES = ["/ask", "/save", "/build", "/sweep", "/cancel", "/"]
NAMES = [
    "../x.toml", "/tmp/x.toml", "a/b.toml", ".x.toml", "x.py", "x.toml\n", "", "x" * 200 + ".toml", "..toml/",
]  # fmt: skip


@dataclass(frozen=True)
class Hostile:
    """A request that is refused with `status`: a route with a message or a body, and headers in place of the page's."""

    path: str
    status: int
    message: Any = None
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes | None = None


def _with(status, name, values, routes):
    """Every value of a header on every route, with a message that would be answered."""
    ask = {"text": templates()["embedded"].read_text("utf-8")}
    return [
        Hostile(route, status, None if route == "/" or "x" in route else ask, {name: value.encode().decode("latin-1")})
        for route, value in itertools.product(routes, values)
    ]


FORM = {"Content-Type": "application/x-www-form-urlencoded"}
HOSTILE = {
    "other Host": _with(421, "Host", HOSTS, ROUTES),
    "other Origin": _with(403, "Origin", ORIGINS, ROUTES),
    "other site": _with(403, "Sec-Fetch-Site", ["cross-site", "same-site"], ROUTES),
    "no token": _with(403, "X-Unitcad-Token", TOKENS, [*ROUTES, "/files/x.json", "/job/x", "/variant/x"]),
    "no message": [
        *(Hostile(route, 400, body=json.dumps(message).encode()) for route in ROUTES[:5] for message in MESSAGES),
        *(Hostile("/ask", 400, body=body) for body in (b"{", b"\xff\xfe", b"[" * 100_000)),
        Hostile("/ask", 415, body=b"text=x", headers=FORM),
        Hostile("/ask", 415, body=b"{}", headers={"Content-Type": "text/plain"}),
    ],
    "file name": [Hostile("/save", 400, {"text": "", "name": name}) for name in NAMES],
    "other method": [
        Hostile(route, 405, headers={"Method": method}) for route in ROUTES for method in ("PUT", "DELETE", "OPTIONS")
    ],
}
"""Requests by what is hostile in them. Paths, huge bodies and code have tests of their own, below."""


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_requests_are_refused(server, kind):
    for one in HOSTILE[kind]:
        headers = dict(one.headers)
        method = headers.pop("Method", None)
        status, content, answered = server.send(one.path, one.message, headers=headers, body=one.body, method=method)
        assert status == one.status, (one.path, headers, str(one.message)[:80], content[:80])
        assert "Access-Control-Allow-Origin" not in answered


def test_a_cookie_reads_the_page_alone(server, text):
    """A form of another site could make the browser send it, and a server of another port gets it."""
    page = server.send("/")
    kept = page[2]["set-cookie"].partition(";")[0]
    assert server.token not in str(page)
    cookie = {"X-Unitcad-Token": "", "Cookie": kept}
    assert server.send("/", headers=cookie)[0] == 200
    assert server.send("/", headers={**cookie, "Cookie": f"unitcad-{server.port}={server.token}"})[0] == 403
    assert server.send("/ask", {"text": text}, headers=cookie)[0] == 403
    assert server.send("/job/0123456789abcdef", headers=cookie)[0] == 403
    assert server.send("/files/x.json", headers=cookie)[0] == 403


OPENED = {
    "X-Unitcad-Token": "",
    "Sec-Fetch-Site": "cross-site",
    "Sec-Fetch-Mode": "navigate",
    "Sec-Fetch-Dest": "document",
}


def test_a_folder_s_key_opens_its_files_alone(server, text):
    """What a result's own page has, which runs as another site."""
    for file in ("one/report.html", "one/deep/base.stl", "other/spec.toml", "at-root.json"):
        (server.folder / "out" / file).parent.mkdir(parents=True, exist_ok=True)
        (server.folder / "out" / file).write_text("{}")
    address = AccessKeys(server.token).address("one/report.html")
    key = address.partition("/")[0]
    for file in ("one/report.html", "one/deep/base.stl"):
        status, _, headers = server.send(f"/files/{key}/{file}", headers=OPENED)
        assert status == 200
        assert headers["content-security-policy"].startswith("sandbox ")
        assert "Access-Control-Allow-Origin" not in headers
    for path in (
        f"{key}/other/spec.toml", f"{key}/at-root.json", f"{key}/spec.toml", "one/report.html", key, f"{key}/",
        f"/{key}/one/report.html", f"{key[:-1]}/one/report.html", f"{key.upper()}/one/report.html",
        "%c3%a9/one/report.html",
    ):  # fmt: skip
        assert server.send(f"/files/{path}", headers=OPENED)[0] == 403, path
    assert server.send(f"/files/{key}/one/../other/spec.toml", headers=OPENED)[0] == 404
    assert server.send("/files/one/report.html")[0] == 404  # the token alone is no key
    for path, message in (("/", None), ("/ask", {"text": text}), (f"/job/{key}", None), (f"/{key}/", None)):
        assert server.send(path, message, headers={**OPENED, "Sec-Fetch-Site": "none"})[0] == 403
    # What a script, a picture or a frame of such a page asks for, and another site's form.
    for headers in (
        {"Origin": "null"}, {"Origin": "http://evil.example"}, {"Sec-Fetch-Mode": "cors"},
        {"Sec-Fetch-Mode": "no-cors"}, {"Sec-Fetch-Dest": "iframe"}, {"Sec-Fetch-Dest": "image"},
        {"Sec-Fetch-Dest": "script"}, {"Sec-Fetch-Dest": ""},
    ):  # fmt: skip
        assert server.send(f"/files/{address}", headers={**OPENED, **headers})[0] == 403, headers
    assert server.send(f"/files/{address}", headers={**OPENED, "Host": "evil.example"})[0] == 421
    assert server.send(f"/files/{address}", {"text": text}, headers=OPENED)[0] == 403


def test_a_request_has_one_host(server):
    two = f"GET /?token={server.token} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nHost: evil.example\r\n\r\n"
    assert b" 421 " in server.raw(two.encode()) or b" 400 " in server.raw(two.encode())
    none = f"GET /?token={server.token} HTTP/1.0\r\n\r\n"
    assert b" 421 " in server.raw(none.encode())


def test_no_path_leads_out_of_a_result(server):
    result = server.folder / "out" / "result"
    (result / ".hidden").mkdir(parents=True)
    for file in (result / "fine.json", result / ".hidden" / "x.json", server.folder / "secret.toml"):
        file.write_text("{}")
    (result / "link.html").symlink_to(server.folder / "secret.toml")
    (result / "linked").symlink_to(server.folder)
    key = AccessKeys(server.token).address("result/fine.json").partition("/")[0]
    assert server.send(f"/files/{key}/result/fine.json")[0] == 200
    for path in [*PATHS, *(f"{key}/{path}" for path in PATHS), *(f"{key}/result/{path}" for path in PATHS)]:
        line = f"GET /files/{path} HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nX-Unitcad-Token: {server.token}\r\n\r\n"
        answer = server.raw(line.encode("latin-1"))
        assert answer.split(b" ")[1] in (b"404", b"400"), (path, answer[:200])


def test_a_huge_body_is_refused_before_it_is_read(server):
    head = f"POST /ask HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nX-Unitcad-Token: {server.token}\r\n"
    told = head + f"Content-Type: application/json\r\nContent-Length: {LARGEST_BODY + 1}\r\n\r\n"
    assert b" 413 " in server.raw(told.encode())
    untold = head + "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    assert b" 411 " in server.raw(untold.encode())


CODE = [
    'design = "{file}:evil"',
    'design = "evil.py:evil"\ndesign_source = {source}',
    'design = "{file}:evil"\ndesign_source = {source}',
]
ASKED_OF_CODE = ["unit", "moulds", "estimate", "/build", "/sweep"]


@pytest.mark.parametrize("design", CODE)
def test_code_in_a_text_does_not_run(server, text, tmp_path, design):
    """A design of the page's own, by its file's path or by its source in the text."""
    marker = tmp_path / "ran"
    file = tmp_path / "evil.py"
    file.write_text(f"open({str(marker)!r}, 'w').close()\ndef evil(spec): return {{}}\n")
    one = text.replace('design = "encapsulating"', design.format(file=file, source=json.dumps(file.read_text())))
    assert one != text
    for what in ASKED_OF_CODE:
        if what.startswith("/"):
            sweep = {"key": "diameter_mm", "low": 13, "high": 14, "count": 2} if what == "/sweep" else {}
            assert server.send(what, {"text": one, **sweep})[0] == 422
            continue
        answer = server.ask(one, what)
        assert "model" not in answer
        assert "faults" in answer or what == "estimate"
    assert not marker.exists()


def test_files_that_a_text_names_are_not_read(server, text, tmp_path):
    secret = tmp_path / "secret.toml"
    secret.write_text('password = "hunter2"')
    for one in (
        text + f'\n[estimate]\nfit = "{secret}"\n',
        text.replace('design = "encapsulating"', f'design = "{secret}.stl"'),
    ):
        answer = server.ask(one, "estimate")
        assert answer["faults"]
        assert "hunter2" not in json.dumps(answer)


def test_specs_are_saved_in_the_folder_alone(server, text):
    """Of saves at once under a new name one is made."""
    before, file = set(server.folder.iterdir()), server.folder / "mine.toml"
    saves = [{"text": f"{text}# {i}\n", "name": file.name} for i in range(8)]
    with ThreadPoolExecutor(8) as apart:
        answers = list(apart.map(lambda save: server.send("/save", save), saves))
    assert sorted(status for status, *_ in answers) == [200, *[422] * 7]
    made = next(i for i, (status, *_) in enumerate(answers) if status == 200)
    status, content, _ = server.send("/save", {"text": text, "name": file.name})
    assert (status, b"exists already" in content) == (422, True)
    assert file.read_text() == saves[made]["text"]
    assert server.send("/save", {"text": text, "name": file.name, "replace": True})[0] == 200
    assert file.read_text() == text
    assert set(server.folder.iterdir()) == before | {file}


def test_the_page_can_be_framed_by_nobody_and_contacts_its_own_server_alone(server):
    status, content, headers = server.send(f"/?token={server.token}", headers={"X-Unitcad-Token": ""})
    assert status == 200
    assert headers["x-frame-options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert "HttpOnly" in headers["set-cookie"]
    assert "SameSite=strict" in headers["set-cookie"]
    assert b"connect-src &#x27;self&#x27;" in content
    assert b"default-src &#x27;none&#x27;" in content
