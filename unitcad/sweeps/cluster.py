"""A Dask cluster, reached by its scheduler's address, plain (tcp://) or by certificates (tls://)."""

from __future__ import annotations

import asyncio
import logging
import ssl
import time
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unitcad.errors import Refusal, UnitcadError, missing_extra
from unitcad.files import no_such_file

DASK_SECONDS = 6.0
"""Seconds that a scheduler may take to answer: with imports and start-up the command ends within ten."""
ENCRYPTED = ("tls://", "wss://")


@dataclass(frozen=True)
class Certificates:
    """Certificate files (PEM) for a TLS connection; Dask's configuration gives those that are None."""

    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None

    def given(self) -> dict[str, tuple[str, Path]]:
        """Return the option and the path of each file that is given, by Dask's name."""
        named = {
            "tls_ca_file": ("--tls-ca-file", self.ca),
            "tls_client_cert": ("--tls-cert", self.cert),
            "tls_client_key": ("--tls-key", self.key),
        }
        return {name: (option, path) for name, (option, path) in named.items() if path is not None}


FROM_DASK = Certificates()


def check_certificates(certificates: Certificates, scheduler: str | None) -> None:
    """Refuse certificates for a connection that uses none, and files that are not there. Raises Refusal."""
    for option, path in certificates.given().values():
        if scheduler is None or not scheduler.startswith(ENCRYPTED):
            raise Refusal(option, str(path), "needs a --scheduler at tls://")
        if not path.is_file():
            raise Refusal(option, str(path), no_such_file(path))


def dask_executor(address: str, certificates: Certificates = FROM_DASK) -> tuple[Executor, int]:
    """Connect to a Dask cluster; return its executor, and how many tasks it runs at once.

    Raises UnitcadError without the extra, for certificates that can't be used, or if no scheduler answers in time.
    """
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address, parse_host_port
        from distributed.comm.core import connect
        from distributed.comm.registry import get_backend
        from distributed.security import Security
    except ImportError:
        raise missing_extra("dask", "--scheduler needs Dask") from None

    try:
        scheme, place = parse_address(address)
        get_backend(scheme)
        parse_host_port(place)
    except (ValueError, TypeError) as error:
        raise UnitcadError(f"--scheduler {address}: not a scheduler's address ({error})") from None

    try:
        security = Security(**{name: str(path) for name, (_, path) in certificates.given().items()})
        arguments = security.get_connection_args("client")
    except (OSError, ssl.SSLError, ValueError, TypeError) as error:
        raise UnitcadError(f"--scheduler {address}: the certificates can't be used: {error}") from None
    if address.startswith(ENCRYPTED) and arguments.get("ssl_context") is None:
        raise UnitcadError(
            f"--scheduler {address}: needs --tls-ca-file, --tls-cert and --tls-key, or the same in Dask's "
            "configuration (distributed.comm.tls)"
        )

    async def ask() -> Any:
        comm = await connect(address, timeout=DASK_SECONDS, **arguments)
        await comm.write({"op": "identity", "reply": True})
        answer = await comm.read()
        await comm.close()
        return answer

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    # Ask first: a client that reaches no scheduler takes long to give up.
    start = time.monotonic()
    try:
        # In a thread of its own, since a notebook has an event loop running in this one.
        with ThreadPoolExecutor(1) as thread:
            answer = thread.submit(lambda: asyncio.run(asyncio.wait_for(ask(), DASK_SECONDS))).result()
    except (OSError, TimeoutError) as error:
        waited = time.monotonic() - start > DASK_SECONDS - 1
        why = f" ({error})" if str(error) else ""
        raise UnitcadError(
            f"--scheduler {address}: no answer{f' within {DASK_SECONDS:g} s' if waited else ''}{why}"
        ) from None
    except Exception:  # bytes that are not Dask's end in anything: a length read from them in a MemoryError
        answer = None
    if not isinstance(answer, dict) or answer.get("type") != "Scheduler":
        raise UnitcadError(f"--scheduler {address}: the server at this address is not a Dask scheduler")
    client = Client(address, timeout=DASK_SECONDS, set_as_default=False, security=security)
    cores: Any = client.ncores()
    threads = sum(cores.values())
    if not threads:
        client.close()
        raise UnitcadError(f"--scheduler {address}: it has no workers")
    return client.get_executor(pure=False), threads
