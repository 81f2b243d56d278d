"""The routes of the live page: each parses a message, asks a worker or a job, and answers with JSON."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any, TypeVar

import msgspec
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from unitcad.documents import parse_json
from unitcad.errors import Refusal, UnitcadError
from unitcad.files import names_device, read, read_text, regular, write
from unitcad.json_text import parse_message
from unitcad.report.page import page_data
from unitcad.serve.jobs import Jobs, build_folder, sweep_folder
from unitcad.serve.live_page import HEADER_POLICY, live_page
from unitcad.serve.messages import ALL, Ask, Build, Cancel, Fault, Held, JobId, Save, Sweep, Trusted
from unitcad.serve.questions import ANSWER_S, Questions, Superseded
from unitcad.serve.request_guard import AccessKeys, RequestGuard
from unitcad.text import toml
from unitcad.workers import NoWorker, WorkerEnded

T = TypeVar("T", bound=msgspec.Struct)
FILE_TYPES = {
    ".html": "text/html; charset=utf-8", ".svg": "image/svg+xml", ".png": "image/png", ".json": "application/json",
    ".md": "text/plain; charset=utf-8", ".csv": "text/csv; charset=utf-8", ".toml": "text/plain; charset=utf-8",
    ".stl": "model/stl", ".3mf": "model/3mf", ".step": "model/step", ".glb": "model/gltf-binary",
    ".dxf": "image/vnd.dxf", ".gcode": "text/plain; charset=utf-8",
}  # fmt: skip
_SANDBOX = "sandbox allow-scripts allow-downloads allow-popups; frame-ancestors 'self'"
"""A result's page runs apart: it can reach neither the token nor this server."""


def application(live: Live) -> RequestGuard:
    """Return the ASGI application of a live page."""
    routes = [
        Route("/", live.page),
        Route("/files/{path:path}", live.file),
        Route("/job/{job}", live.job),
        Route("/variant/{folder}", live.variant),
        _post("/ask", Ask, live.questions.ask),
        _post("/save", Save, live.save),
        _post("/build", Build, live.build),
        _post("/sweep", Sweep, live.sweep),
        _post("/cancel", Cancel, live.cancel),
    ]
    inner = Starlette(routes=routes, lifespan=live.lifespan)
    return RequestGuard(inner, live.token, live.port, live.cookie, live.keys)


@dataclass(eq=False)
class Live:
    """The handlers of the routes, with a worker for each kind of question and the jobs.

    `text` is the first text, `name` its file's, `trusted` the files that texts may name, `starts` the texts to start
    from. `folder`: for saved specs; `out`: for results, whose files are served. `batch`: a folder of variants that the
    page lists. `held`: the entries that the pickers offer. `known`: the SHA-256 of the file that was opened.
    """

    text: str
    name: str
    folder: Path
    out: Path
    trusted: Trusted
    starts: Mapping[str, str | None]
    token: str
    port: int
    batch: Path | None = None
    held: Held = ALL
    known: str = ""

    def __post_init__(self) -> None:
        self.cookie = f"unitcad-{self.port}"
        self.keys = AccessKeys(self.token)
        self.questions = Questions(self.text, self.trusted, self.held)
        self.jobs = Jobs(self.out, self.keys)
        self._saving = asyncio.Lock()

    @contextlib.asynccontextmanager
    async def lifespan(self, app: Starlette) -> AsyncIterator[None]:
        """Warm the workers up at the start, end workers and jobs at the end."""
        for what in ANSWER_S:
            self.questions.pool(what)
        try:
            yield
        finally:
            await self.close()

    async def close(self) -> None:
        """End jobs and workers; a question under way is answered that the server is ending."""
        await asyncio.gather(self.jobs.close(), self.questions.close())

    async def page(self, request: Request) -> Response:
        """Answer with the page, with the cookie that loads it again."""
        batch = None
        if self.batch:
            try:
                batch = (await asyncio.to_thread(page_data, self.batch, modelled=None))[0]
            except (UnitcadError, OSError, RuntimeError) as error:  # RuntimeError: a loop of links
                return PlainTextResponse(f"{error}\n", 422)
        html = live_page(self.text, self.name, str(self.folder), self.starts, batch, self.known)
        headers = {"content-security-policy": HEADER_POLICY}
        response = Response(html, media_type="text/html; charset=utf-8", headers=headers)
        response.set_cookie(self.cookie, self.keys.cookie, httponly=True, samesite="strict")
        return response

    async def save(self, save: Save) -> bytes:
        """Write the text as a file in the server's folder."""
        path = self.folder / save.name
        if names_device(save.name):
            raise Refusal("name", save.name, "is the name of a device on Windows", f"my-{save.name}")
        content = save.text.encode("utf-8")
        async with self._saving:
            await asyncio.to_thread(_write, path, content, save)
        # Work in progress is saved too, and the page says that it is refused.
        refused = None
        try:
            await self._resolved(save.text)
        except UnitcadError as error:
            refused = str(error)
        return msgspec.json.encode({"path": str(path), "refused": refused, "known": _digest(content)})

    async def build(self, build: Build) -> bytes:
        """Start the full build of the text."""
        given, code = await self._resolved(build.text)
        # Braces of an argument are placeholders of files.
        arguments = ["build", "{spec}", "-o", str(self.out).replace("{", "{{").replace("}", "}}"), *code]
        state = self.jobs.start("the build", arguments, {"spec.toml": given["text"]}, build_folder(self.out))
        return msgspec.json.encode(state)

    async def sweep(self, sweep: Sweep) -> bytes:
        """Start the batch of a key's values."""
        values = values_of(sweep)
        given, code = await self._resolved(sweep.text)
        asked = f'base = "spec.toml"\n\n[sweep]\nmode = "product"\n{toml(sweep.key)} = {toml(values)}\n'
        # A folder of its own, which has the sweep file next to the results, in RESULTS: the file's name.
        arguments = ["batch", "{sweep}", "-o", "{folder}", "--report", *code]
        # The base has only the keys of the text: defaults follow the key's values as they do on the page.
        files, first = {"spec.toml": given["asked"], "sweep.toml": asked}, f"0 of {len(values)} variants"
        state = self.jobs.start("the sweep", arguments, files, sweep_folder(self.out), first)
        return msgspec.json.encode(state)

    async def _resolved(self, text: str) -> tuple[dict[str, Any], list[str]]:
        """Return the resolved spec of a text as `text`, the text without files as `asked`, the option its code needs.

        Raises UnitcadError for a text that is refused.
        """
        async with self.questions.turns["unit"]:
            content = await self.questions.call(
                "unit", "unitcad.serve.answers:resolve", text.encode("utf-8", "replace"), self.questions.trusted,
                seconds=10.0,
            )  # fmt: skip
        given = parse_json(content, "the answer")
        if "refused" in given:
            raise UnitcadError(given["refused"])
        return given, ["--allow-code"] if given["code"] else []

    async def variant(self, request: Request) -> Response:
        """Answer with the spec of a variant of the batch, as text."""
        root, folder = self.batch, request.path_params["folder"]
        path = _within(root, f"{folder}/spec.toml") if root else None
        if path is None:
            return PlainTextResponse("no such variant\n", 404)
        try:
            text = await asyncio.to_thread(read_text, path)
            return _json(msgspec.json.encode({"text": text}))
        except (UnitcadError, OSError) as error:
            return _json(msgspec.json.encode({"faults": [Fault(str(error))]}), 422)

    async def job(self, request: Request) -> Response:
        """Answer with how far a job is."""
        try:
            name = msgspec.convert(request.path_params["job"], JobId)
            return _json(msgspec.json.encode(self.jobs.state(name)))
        except (msgspec.ValidationError, UnitcadError):
            return PlainTextResponse("no such job\n", 404)

    async def cancel(self, cancel: Cancel) -> bytes:
        """End a job."""
        return msgspec.json.encode(await self.jobs.cancel(cancel.job))

    async def file(self, request: Request) -> Response:
        """Answer with a file of a result, which runs apart from this server; its path begins with a folder's key."""
        asked = self.keys.file(request.path_params["path"])
        path = _within(self.out, asked) if asked else None
        try:
            file = open(path, "rb", opener=regular(links=False)) if path else None  # noqa: SIM115  # by _pieces
        except (UnitcadError, OSError):  # it has gone meanwhile, or may not be read
            file = None
        if path is None or file is None:
            return PlainTextResponse("no such file\n", 404)
        headers = {"content-security-policy": _SANDBOX}
        return StreamingResponse(_pieces(file), media_type=FILE_TYPES[path.suffix], headers=headers)


def _post(path: str, kind: type[T], handle: Callable[[T], Awaitable[bytes]]) -> Route:
    """Return the route of a kind of message: the answer is that of `handle`, or the one fault."""

    async def endpoint(request: Request) -> Response:
        if request.headers.get("content-type", "").partition(";")[0].strip() != "application/json":
            return PlainTextResponse("messages are application/json\n", 415)
        try:
            message = parse_message(await request.body(), kind)
        except UnitcadError as error:
            return PlainTextResponse(f"not a message that this page sends: {error}\n", 400)
        try:
            return _json(await handle(message))
        except Superseded:
            # No fault: a browser would tell of one in its console.
            return _json(msgspec.json.encode({"superseded": True}))
        except (WorkerEnded, NoWorker) as error:
            return _json(msgspec.json.encode({"faults": [Fault(str(error))], "again": True}), 500)
        except Refusal as error:
            fault = Fault(str(error), error.field, error.as_dict()["nearest"])
            return _json(msgspec.json.encode({"faults": [fault]}), 422)
        except (UnitcadError, OSError) as error:
            return _json(msgspec.json.encode({"faults": [Fault(str(error))]}), 422)

    return Route(path, endpoint, methods=["POST"])


def values_of(sweep: Sweep) -> list[float] | list[str]:
    """Return the values of a sweep. Raises Refusal for fewer than two."""
    if sweep.words:
        words = list(dict.fromkeys(sweep.words))
        if len(words) < 2:
            raise Refusal("words", words[0], "a sweep needs two values or more")
        return words
    if not sweep.low < sweep.high:
        raise Refusal("high", sweep.high, f"must be above low, {sweep.low:g}")
    step = (sweep.high - sweep.low) / (sweep.count - 1)
    values = [round(sweep.low + i * step, 6) for i in range(sweep.count)]
    # A count of units takes no 3.0.
    return [int(value) for value in values] if all(value.is_integer() for value in values) else values


def _write(path: Path, content: bytes, save: Save) -> None:
    """Write a spec; without `replace`, only over the same or the known file. Raises Refusal, OSError."""
    if os.path.lexists(path) and not save.replace:
        found = ""
        with contextlib.suppress(UnitcadError):  # a link, no regular file, or larger than a spec
            found = _digest(read(path, links=False))
        if found not in (save.known, _digest(content)) or not found:
            why = "was changed on disk since this page opened or saved it" if save.known else "exists already"
            raise Refusal("name", path.name, f"{why}; replace it, or choose another name")
    write(path, content)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _pieces(file: IO[bytes]) -> Iterator[bytes]:
    with file:
        while piece := file.read(1 << 18):
            yield piece


def _json(content: bytes, status: int = 200) -> Response:
    return Response(content, status, media_type="application/json")


def _within(root: Path, asked: str) -> Path | None:
    """Return the regular file below a folder that a request's path means; None if it means none, or a way out."""
    parts = PurePosixPath(asked).parts
    if (
        not parts
        or "\0" in asked
        or "\\" in asked
        or any(part in ("..", ".", "/") or part.startswith(".") for part in parts)
    ):
        return None
    path = root.joinpath(*parts)
    if path.suffix not in FILE_TYPES:
        return None
    try:
        real = path.resolve(strict=True)
        inside = real.is_relative_to(root.resolve(strict=True))
    except (OSError, RuntimeError, ValueError):  # RuntimeError: a loop of links
        return None
    return real if inside and real.is_file() else None
