"""Connections whose headers come in time: one that is slow, or too many that wait, keep nobody else out."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEADERS_S = 10.0
"""Seconds that a request's headers may take, or a new connection may be silent."""
MOST_WAITING = 200
"""Connections that wait for headers; a further one closes the one that waits longest."""


class Connection(H11Protocol):
    """An HTTP/1.1 connection that is closed where a request's headers are not whole after `headers_s`."""

    headers_s = HEADERS_S
    most_waiting = MOST_WAITING
    since = 0.0
    _late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for headers."""
        super().connection_made(transport)
        self._wait()
        waiting = [one for one in self.connections if isinstance(one, Connection) and one._late]
        if len(waiting) > self.most_waiting:
            min(waiting, key=lambda one: one.since).transport.abort()

    def data_received(self, data: bytes) -> None:
        """Take bytes in, and wait on where they hold no whole headers."""
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._done()
        elif self._late is None:
            self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._done()
        super().connection_lost(exc)

    def _wait(self) -> None:
        self.since = time.monotonic()
        self._late = self.loop.call_later(self.headers_s, self.transport.abort)

    def _done(self) -> None:
        if self._late:
            self._late.cancel()
            self._late = None
