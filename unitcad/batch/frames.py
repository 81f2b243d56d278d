"""Messages over a pipe: eight bytes of length, then the message."""

from __future__ import annotations

from typing import IO


def send(pipe: IO[bytes], message: bytes) -> None:
    """Write one message. Raises OSError where the reader is gone."""
    pipe.write(len(message).to_bytes(8, "little"))
    pipe.write(message)
    pipe.flush()


def receive(pipe: IO[bytes]) -> bytes:
    """Read one message. Raises EOFError where the other end is gone."""
    return _exactly(pipe, int.from_bytes(_exactly(pipe, 8), "little"))


def _exactly(pipe: IO[bytes], count: int) -> bytes:
    content = pipe.read(count)
    if content is None or len(content) < count:
        raise EOFError
    return content
