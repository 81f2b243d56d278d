"""The guard of requests: addresses, keys, Host, Origin and token, and limits in size, time and number."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import hmac
import ipaddress
import socket
from dataclasses import dataclass
from pathlib import PurePosixPath
from urllib.parse import parse_qs

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from unitcad.errors import WrongArgument


class AccessKeys:
    """The cookie and the folders' keys of a server with a token."""

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


LOOPBACK = "127.0.0.1"
TOKEN = "UNITCAD_TOKEN"
"""Environment variable with the token; other users of a machine can read a command's arguments."""
_OWN = ("localhost", "127.0.0.1", "[::1]")
ANY_ADDRESS = "*"
"""Stands for every Host that is an address itself, not a name: no other site's name can be made to mean one."""
_ELSEWHERE = ("192.0.2.1", 9)
"""An address for documentation. Nothing is sent to it: a way there tells this machine's own address."""


def check_address(host: str, token: str | None) -> None:
    """Raise WrongArgument for an address beyond the loopback without a token, and for a token easily guessed."""
    try:
        loopback = ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = host == "localhost"
    if not loopback and not token:
        limit = f"is not this machine's loopback address; another one needs a token of yours, in the variable {TOKEN}"
        raise WrongArgument("host", host, limit, LOOPBACK)
    if token is not None and (len(token) < 16 or not token.isascii() or not token.isprintable() or " " in token):
        raise WrongArgument(TOKEN, "(not shown)", "needs at least 16 printable ASCII characters without spaces")


def hosts(host: str, port: int) -> frozenset[str]:
    """Return the values of Host under which a browser may ask for the server at an address."""
    if _is_any(host):
        names = {*_OWN, socket.gethostname().lower(), ANY_ADDRESS}
    else:
        own = f"[{host}]" if ":" in host else host
        names = {own, *_OWN} if host in ("localhost", LOOPBACK, "::1") else {own}
    return frozenset(f"{name}:{port}" for name in names)


def means(host: str, allowed: frozenset[str]) -> bool:
    """Tell whether a Host, in lower case, is among the allowed ones of `hosts`."""
    if host in allowed:
        return True
    name, _, port = host.rpartition(":")
    if f"{ANY_ADDRESS}:{port}" not in allowed:
        return False
    bare = name[1:-1] if name.startswith("[") and name.endswith("]") else name
    with contextlib.suppress(ValueError):
        return (ipaddress.ip_address(bare).version == 6) == (bare != name)
    return False


def shown(host: str) -> str:
    """Return the host of the address to open: of one that means all, this machine's own."""
    if not _is_any(host):
        return f"[{host}]" if ":" in host else host
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.connect(_ELSEWHERE)
        return str(one.getsockname()[0])
    return LOOPBACK


def _is_any(host: str) -> bool:
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_unspecified
    return False


TOKEN_HEADER = b"x-unitcad-token"
FILES = "/files/"
LARGEST_BODY = 4 << 20
"""Bytes of a request's body."""
LONGEST_TARGET = 4000
"""Bytes of a request's path and query: each of a path's folders costs a check of its key."""
BODY_S = 10.0
"""Seconds that a request's body may take."""
MOST_REQUESTS = 32
"""Requests that are answered at the same time; more are sent away."""
ALWAYS = (
    (b"cache-control", b"no-store"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
)


@dataclass(frozen=True)
class Limits:
    """Bounds of a request: bytes of its body, seconds until it is there, requests at the same time."""

    body: int = LARGEST_BODY
    seconds: float = BODY_S
    requests: int = MOST_REQUESTS


class RequestGuard:
    """ASGI middleware in front of `app`: passes a request on, its body whole, or refuses it with one line.

    `hosts` are the values of Host that mean this server (`addresses.hosts`). A request carries the token in a header,
    which a page of another site can't set, or, if it only reads, in its query. Two of `keys` replace it: the
    page itself is read with the cookie of the name `cookie`, and a file with its folder's key in its path.
    """

    def __init__(
        self, app: ASGIApp, token: str, hosts: frozenset[str], cookie: str, keys: AccessKeys, limits: Limits
    ) -> None:
        self.app, self.token, self.hosts, self.limits = app, token.encode(), hosts, limits
        self.cookie, self.keys = cookie.encode(), keys
        self._under_way = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # no web sockets here
            return
        refused = self._refused(scope)
        if refused is None and self._under_way >= self.limits.requests:
            refused = 503, "too many requests at the same time"
        if refused:
            await self._answer(*refused, scope, receive, send)
            return
        self._under_way += 1
        try:
            body = await self._body(receive)
            if isinstance(body, tuple):
                await self._answer(*body, scope, receive, send)
            else:
                await self._answered(body, scope, receive, _with_headers(send))
        finally:
            self._under_way -= 1

    def _refused(self, scope: Scope) -> tuple[int, str] | None:
        """Return the status and the reason for which a request is refused by its head; None if it is not."""
        headers = [(name.lower(), value) for name, value in scope["headers"]]
        hosts = [value.decode("latin-1").lower() for name, value in headers if name == b"host"]
        if len(hosts) != 1 or not means(hosts[0], self.hosts):
            return 421, "this server answers only to its own address"
        origins = [value.decode("latin-1").lower() for name, value in headers if name == b"origin"]
        if any(origin != f"http://{hosts[0]}" for origin in origins):
            return 403, "a request from another site"
        if len(scope["raw_path"]) + len(scope["query_string"]) > LONGEST_TARGET:
            return 414, f"an address has at most {LONGEST_TARGET} bytes"
        keyed = self._has_folder_key(scope)
        if not (keyed and _is_opened(headers)) and any(
            name == b"sec-fetch-site" and value in (b"cross-site", b"same-site") for name, value in headers
        ):
            return 403, "a request from another site"
        if scope["method"] not in ("GET", "POST"):
            return 405, "only GET and POST"
        if not keyed and not self._has_token(scope, headers):
            return 403, "no valid token: open the address that unitcad serve printed"
        lengths = [value for name, value in headers if name == b"content-length"]
        if any(not value.isdigit() or int(value) > self.limits.body for value in lengths):
            return 413, f"a body has at most {self.limits.body} bytes"
        return None

    def _has_folder_key(self, scope: Scope) -> bool:
        path: str = scope["path"]
        return (
            scope["method"] == "GET" and path.startswith(FILES) and self.keys.file(path.removeprefix(FILES)) is not None
        )

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

    async def _answered(self, body: bytes, scope: Scope, receive: Receive, send: Send) -> None:
        """Have the app answer, as long as somebody waits for it."""
        gone = asyncio.create_task(_gone(receive))
        answering = asyncio.ensure_future(self.app(scope, _at_once(body, gone), send))
        try:
            await asyncio.wait([answering, gone], return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (answering, gone):
                task.cancel()
            await asyncio.wait([answering, gone])
        if not answering.cancelled():
            answering.result()

    async def _body(self, receive: Receive) -> bytes | tuple[int, str]:
        """Return a request's body, or the status and the reason for which it is refused."""
        parts, size = [], 0
        try:
            async with asyncio.timeout(self.limits.seconds):
                while True:
                    message = await receive()
                    if message["type"] == "http.disconnect":
                        return 400, "the request was broken off"
                    part = message.get("body", b"")
                    size += len(part)
                    if size > self.limits.body:
                        return 413, f"a body has at most {self.limits.body} bytes"
                    parts.append(part)
                    if not message.get("more_body"):
                        return b"".join(parts)
        except TimeoutError:
            return 408, f"the body took more than {self.limits.seconds:g} s"

    async def _answer(self, status: int, reason: str, scope: Scope, receive: Receive, send: Send) -> None:
        # The rest of the body is not waited for.
        response = PlainTextResponse(reason + "\n", status, headers={"connection": "close"})
        await response(scope, receive, _with_headers(send))


def _is_opened(headers: list[tuple[bytes, bytes]]) -> bool:
    """Tell whether a browser opens a page or a download with a request: no script or picture of a page asks for it."""
    said = {name: value for name, value in headers if name.startswith(b"sec-fetch-")}
    return (said.get(b"sec-fetch-mode"), said.get(b"sec-fetch-dest")) == (b"navigate", b"document")


async def _gone(receive: Receive) -> Message:
    """Wait until the asker has left or has the whole answer."""
    while (message := await receive())["type"] != "http.disconnect":
        pass
    return message


def _at_once(body: bytes, gone: asyncio.Task[Message]) -> Receive:
    """Return a `receive` that gives a body that is there already, then that the asker is gone."""
    left: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def whole() -> Message:
        return left.pop() if left else await asyncio.shield(gone)

    return whole


def _with_headers(send: Send) -> Send:
    async def headed(message: Message) -> None:
        if message["type"] == "http.response.start":
            names = {name.lower() for name, _ in message["headers"]}
            message["headers"] = [*message["headers"], *(each for each in ALWAYS if each[0] not in names)]
        await send(message)

    return headed
