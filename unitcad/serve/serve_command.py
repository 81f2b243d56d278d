"""unitcad serve."""

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.shared_options import AllowCode
from unitcad.extras import missing_extra
from unitcad.validation import default_template


def serve(
    source: Annotated[
        str | None,
        typer.Argument(
            metavar="[SPEC]",
            help=f"Spec or array file, template, or folder of results. Default: {default_template()}.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DIR", help="Folder of builds and sweeps from the page.")
    ] = Path("out"),
    port: Annotated[
        int, typer.Option(metavar="PORT", min=0, max=65535, help="Port of the page; 0 takes a free one.")
    ] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    cupboard: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File of what you own: the pickers offer only its entries. Default: all."),
    ] = None,
    code: AllowCode = False,
) -> None:
    """Open a live page of a spec in the browser.

    A change of a number shows unit, moulds, refusals and estimate at once. Ctrl-C ends it.
    """

    def ready(address: str) -> None:
        typer.echo(address)
        if browser:
            # open() waits for the end of a browser in the terminal, or of one that $BROWSER names.
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    try:
        from unitcad.serve.server import serve as run
    except ImportError as error:
        raise missing_extra("serve", f"the live page needs {error.name}") from None
    run(source, port=port, out=out, code=code, cupboard=cupboard, ready=ready)
