"""Starting the live page: the token, the spec that it begins with."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import socket
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

import uvicorn

from unitcad.documents import parse_toml, read_toml
from unitcad.errors import Refusal, UnitcadError, WrongArgument
from unitcad.files import read_text, scratch, sha256
from unitcad.pipeline.write import clear_leftovers
from unitcad.report.page import page_data
from unitcad.report.read_results import compound_in, is_variant
from unitcad.rooms import expect_none_but
from unitcad.serve.answers import answers_about
from unitcad.serve.application import Live, application
from unitcad.serve.cupboard_choices import held_in
from unitcad.serve.jobs import RESULTS, temporary_folder
from unitcad.serve.messages import ALL, Source
from unitcad.spec.custom_code import files_named, is_body_file, is_custom
from unitcad.text import some
from unitcad.validation import compound_kind, custom_templates, default_template, every_template
from unitcad.validation.load import is_path, named_file

LOOPBACK = "127.0.0.1"
MOST_REQUESTS = 200
"""Connections and requests at the same time; more are sent away."""
DEFAULT_OUT = Path("out")


def serve(
    source: str | None,
    *,
    port: int = 0,
    out: Path = DEFAULT_OUT,
    code: bool = False,
    cupboard: Path | None = None,
    ready: Callable[[str], None] = lambda address: None,
) -> None:
    """Serve the live page of a spec on the loopback until it is interrupted; `ready` takes its address with the token.

    `source` is a file of a spec or an array, a template's name, a result's folder, or a batch's, whose rows
    open live; None: the default template. `port` 0: any that is free. `cupboard`: a file of what a person has, whose
    entries the pickers offer.
    Raises Refusal for a spec whose design is code unless `code`, and UnitcadError for a port that is taken.
    """
    token = secrets.token_urlsafe(24)
    held = held_in(cupboard) if cupboard else ALL
    source, batch = _source(source)
    if batch and out == DEFAULT_OUT:
        out = batch.resolve().with_name(f"{batch.resolve().name}-live")
    elif out != DEFAULT_OUT:
        with temporary_folder(out), scratch(out):  # a folder that can't be written is refused before the page opens
            pass
    for folder in (out, *out.glob(f"sweep-*/{RESULTS}")):
        with contextlib.suppress(OSError):  # it is not there, or not to be changed
            clear_leftovers(folder)
    path = named_file(source or default_template(), every_template(), "spec", WrongArgument)
    known, text = sha256(path), read_text(path)
    data = parse_toml(text, str(path))  # a file that is no TOML is refused at once
    own = source is not None and is_path(source) and source not in custom_templates()
    folder = path.parent.resolve() if own else Path.cwd()
    if not compound_kind(data):
        expect_none_but("spec", data, str(path), "spec", WrongArgument)
    trusted = [_trusted_source(data, path, code)]
    plain = {name: each for name, each in every_template().items() if name not in custom_templates()}
    starts: dict[str, str | None] = {name: read_text(each) for name, each in plain.items()}
    for name, each in custom_templates().items():
        try:
            trusted.append(_trusted_source(read_toml(each), each, code))
            starts[name] = read_text(each)
        except Refusal:
            starts[name] = None
    with _listen(port) as listening:
        bound = listening.getsockname()[1]
        live = Live(
            text, path.name if own else f"{path.stem}.toml", folder, out,
            [source for source in trusted if source.named], starts, token, bound, batch, held,
            known if own and not is_variant(folder) else "",
        )  # fmt: skip
        address = f"http://{LOOPBACK}:{bound}/?token={token}"
        config = uvicorn.Config(
            application(live), log_level="error", access_log=False, server_header=False, date_header=False,
            timeout_keep_alive=5, timeout_graceful_shutdown=2, limit_concurrency=MOST_REQUESTS, http="h11",
            h11_max_incomplete_event_size=16384, ws="none", lifespan="on",
        )  # fmt: skip
        server = uvicorn.Server(config)
        # Ctrl-C is how a server is ended.
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(_told(server, listening, lambda: ready(address), live.close))


async def _told(
    server, listening: socket.socket, ready: Callable[[], None], close: Callable[[], Awaitable[None]]
) -> None:
    """Run a server, and report when it answers and when a signal ends it; `close` then ends its waiting requests."""
    running = asyncio.create_task(server.serve(sockets=[listening]))
    while not (server.started or running.done()):
        await asyncio.sleep(0.01)
    if server.started:
        ready()
    while not (server.should_exit or running.done()):
        await asyncio.sleep(0.05)
    await close()
    await running


def _source(source: str | None) -> tuple[str | None, Path | None]:
    """Return the first spec and the folder of a batch. Raises UnitcadError for a folder without a result."""
    if source is None or source in every_template() or not Path(source).is_dir():
        return source, None
    folder = Path(source)
    if is_variant(folder):
        kind = compound_in(folder)
        return str(folder / f"{kind.name if kind else 'spec'}.toml"), None
    try:
        page_data(folder, modelled=None)
    except UnitcadError as error:
        specs = sorted(path for path in folder.glob("*.toml") if _is_spec(path))
        if len(specs) == 1:
            return str(specs[0]), None
        if specs:
            raise UnitcadError(f"{error}; it has {some(path.name for path in specs)}: give one of them") from None
        raise
    return None, folder


def _is_spec(path: Path) -> bool:
    """Tell whether a file is a spec of a unit or of an array: by its keys, not by its values."""
    try:
        data = read_toml(path)
    except UnitcadError:
        return False
    return bool(compound_kind(data)) or {"name", "layers"} <= set(data)


def _listen(port: int) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((LOOPBACK, port))
        listening.listen(100)
    except OSError as error:
        listening.close()
        raise UnitcadError(f"{LOOPBACK}:{port}: {error.strerror}; choose another with --port, or 0 for any") from None
    return listening


def _trusted_source(data: Mapping[str, Any], path: Path, code: bool) -> Source:
    """Return a spec's files, which a page's texts may name. Raises Refusal for a design that is code, unless `code`."""
    answers = answers_about(data)
    named = answers.named_files(data)
    for field, unit in answers.units(data, path.parent):
        design = files_named(unit).get("design")
        if design and is_custom(design) and not is_body_file(design) and not code:
            raise Refusal(field, design, "is code; it runs in the live page only with --allow-code: read it first")
    return Source(str(path.parent.resolve()), named)
