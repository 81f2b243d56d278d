"""Connections that send headers and take answers in time: slow ones, or too many that wait, keep nobody else out."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEADERS_S = 10.0
"""Seconds that a request's headers may take, or a new connection may be silent."""
WRITE_S = 30.0
"""Seconds for which a client may take nothing of an answer."""
MOST_WAITING = 200
"""Connections that wait for headers; a further one closes the one that waits longest."""


class Connection(H11Protocol):
    """An HTTP/1.1 connection, closed if headers are not whole after `headers_s` or nothing is taken for `write_s`."""

    headers_s = HEADERS_S
    write_s = WRITE_S
    most_waiting = MOST_WAITING
    since = 0.0
    _late: asyncio.TimerHandle | None = None
    _unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for headers."""
        super().connection_made(transport)
        self._wait()
        waiting = [one for one in self.connections if isinstance(one, Connection) and one._late]
        if len(waiting) > self.most_waiting:
            min(waiting, key=lambda one: one.since).transport.abort()

    def data_received(self, data: bytes) -> None:
        """Take bytes in, and wait for more until the headers are whole."""
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._done()
        elif self._late is None:
            self._wait()

    def pause_writing(self) -> None:
        """Begin to wait until the client takes something."""
        super().pause_writing()
        self._unread = self.loop.call_later(self.write_s, self.transport.abort)

    def resume_writing(self) -> None:
        """Write on."""
        self._taken()
        super().resume_writing()

    def timeout_keep_alive_handler(self) -> None:
        """Close a connection without a further request; the rest of its last answer has its time too."""
        super().timeout_keep_alive_handler()
        self._taken()
        self._unread = self.loop.call_later(self.write_s, self.transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        self._done()
        self._taken()
        super().connection_lost(exc)

    def _wait(self) -> None:
        self.since = time.monotonic()
        self._late = self.loop.call_later(self.headers_s, self.transport.abort)

    def _taken(self) -> None:
        if self._unread:
            self._unread.cancel()
            self._unread = None

    def _done(self) -> None:
        if self._late:
            self._late.cancel()
            self._late = None
