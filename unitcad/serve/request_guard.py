"""The guard of requests: checks Host, Origin and token.

A page of another site can reach the loopback address through the person's browser. Its requests carry its own Origin,
or under DNS rebinding its own Host, and never the token. A result's page is apart from the server too, and its links to
files next to it are another site's: they carry their folder's key in their path.
"""

from __future__ import annotations

import hashlib
import hmac
from pathlib import PurePosixPath
from urllib.parse import parse_qs

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

TOKEN_HEADER = b"x-unitcad-token"
FILES = "/files/"
LARGEST_BODY = 4 << 20
"""Bytes of a request's body."""
LONGEST_TARGET = 4000
"""Bytes of a request's path and query: each of a path's folders costs a check of its key."""
ALWAYS = (
    (b"cache-control", b"no-store"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
)


class AccessKeys:
    """Keys with fewer rights than the token: a cookie for the page, a key for a folder's files.

    All are derived from the token, which can't be recovered from them, and end with it.
    """

    def __init__(self, token: str) -> None:
        self._token = token.encode()
        self.cookie = self._made("cookie")
        """Reads only the page itself, which has no token."""

    def address(self, file: str) -> str:
        """Return the path of a file below /files/, with the key of its folder: it reads that folder and those in it."""
        return f"{self._made(f'folder {PurePosixPath(file).parent}')}/{file}"

    def file(self, address: str) -> str | None:
        """Return the file that a path below /files/ means; None without the key of one of the folders that it is in."""
        key, _, file = address.partition("/")
        folders = PurePosixPath(file).parents
        good = [hmac.compare_digest(key.encode(), self._made(f"folder {folder}").encode()) for folder in folders]
        return file if any(good) else None

    def _made(self, what: str) -> str:
        return hmac.new(self._token, what.encode("utf-8", "replace"), hashlib.sha256).hexdigest()


class RequestGuard:
    """ASGI middleware in front of `app`: passes a request on, or refuses it with one line.

    Host is the loopback at `port`. A request carries the token in a header, which a page of another site can't set, or,
    if it only reads, in its query. Two of `keys` replace it: the page itself is read with the cookie of the name
    `cookie`, and a file with its folder's key in its path.
    """

    def __init__(self, app: ASGIApp, token: str, port: int, cookie: str, keys: AccessKeys) -> None:
        self.app, self.token, self.cookie, self.keys = app, token.encode(), cookie.encode(), keys
        self.hosts = [f"{name}:{port}" for name in ("127.0.0.1", "localhost")]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # no web sockets here
            return
        answering = self.app
        if refused := self._refused(scope):
            status, reason = refused
            # The rest of the body is not waited for.
            answering = PlainTextResponse(f"{reason}\n", status, headers={"connection": "close"})
        await answering(scope, receive, _with_headers(send))

    def _refused(self, scope: Scope) -> tuple[int, str] | None:
        """Return the status and the reason for which a request is refused by its head; None if it is not."""
        headers = [(name.lower(), value) for name, value in scope["headers"]]
        hosts = [value.decode("latin-1").lower() for name, value in headers if name == b"host"]
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return 421, "this server answers only to its own address"
        origins = [value.decode("latin-1").lower() for name, value in headers if name == b"origin"]
        if any(origin != f"http://{hosts[0]}" for origin in origins):
            return 403, "a request from another site"
        if len(scope["raw_path"]) + len(scope["query_string"]) > LONGEST_TARGET:
            return 414, f"an address has at most {LONGEST_TARGET} bytes"
        path: str = scope["path"]
        reads = scope["method"] == "GET" and path.startswith(FILES)
        keyed = reads and self.keys.file(path.removeprefix(FILES)) is not None
        said = {name: value for name, value in headers if name.startswith(b"sec-fetch-")}
        # A browser opens a page or a download: no script or picture of a page asks for it.
        opened = (said.get(b"sec-fetch-mode"), said.get(b"sec-fetch-dest")) == (b"navigate", b"document")
        if not (keyed and opened) and any(
            name == b"sec-fetch-site" and value in (b"cross-site", b"same-site") for name, value in headers
        ):
            return 403, "a request from another site"
        if scope["method"] not in ("GET", "POST"):
            return 405, "only GET and POST"
        if not keyed and not self._has_token(scope, headers):
            return 403, "no valid token: open the address that unitcad serve printed"
        lengths = [value for name, value in headers if name == b"content-length"]
        if any(not value.isdigit() or int(value) > LARGEST_BODY for value in lengths):
            return 413, f"a body has at most {LARGEST_BODY} bytes"
        if any(name == b"transfer-encoding" for name, _ in headers):
            return 411, "a body states its length"
        return None

    def _has_token(self, scope: Scope, headers: list[tuple[bytes, bytes]]) -> bool:
        given = [value for name, value in headers if name == TOKEN_HEADER]
        if scope["method"] == "GET":
            query = parse_qs(scope["query_string"].decode("latin-1"))
            given += [value.encode("latin-1", "replace") for value in query.get("token", [])]
            if scope["path"] == "/" and self._has_cookie(headers):
                return True
        return any(hmac.compare_digest(value, self.token) for value in given)

    def _has_cookie(self, headers: list[tuple[bytes, bytes]]) -> bool:
        parts = [
            part.strip().partition(b"=") for name, value in headers if name == b"cookie" for part in value.split(b";")
        ]
        return any(
            key == self.cookie and hmac.compare_digest(text, self.keys.cookie.encode()) for key, _, text in parts
        )


def _with_headers(send: Send) -> Send:
    async def headed(message: Message) -> None:
        if message["type"] == "http.response.start":
            names = {name.lower() for name, _ in message["headers"]}
            message["headers"] = [*message["headers"], *(each for each in ALWAYS if each[0] not in names)]
        await send(message)

    return headed
