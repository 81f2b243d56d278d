"""An S3-compatible server for tests (moto's), in a process of its own, and stores that fail on request."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from unitcad.cache.objects import Objects

_SERVE = """
import sys
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer("127.0.0.1", 0)
server.start()
print(server.get_host_and_port()[1], flush=True)
sys.stdin.read()
"""
BUCKET = "units"


@contextmanager
def s3_server() -> Iterator[dict[str, str]]:
    """Run a server with one bucket; yield the environment in which s3fs, boto and their children reach it."""
    child = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", _SERVE],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert child.stdout
    assert child.stdin
    port = next(line.strip() for line in child.stdout if line.strip().isdigit())  # it says more than the port
    environment = {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    os.environ.update(environment)
    try:
        import s3fs

        s3fs.S3FileSystem.clear_instance_cache()  # one may know the address of another server
        s3fs.S3FileSystem().mkdir(BUCKET)
        yield environment
    finally:
        for name in environment:
            del os.environ[name]
        child.kill()
        child.stdin.close()
        child.stdout.close()
        child.wait()


class Faulty:
    """Objects of which reads or writes go wrong: `fault(verb, name, count)` tells when, from a count of 1 on for each.

    A write that goes wrong raises OSError, a read is cut in the middle.
    """

    def __init__(self, inner: Objects, fault: Callable[[str, str, int], bool]) -> None:
        self.inner, self.fault, self.counts = inner, fault, {"put": 0, "get": 0}

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def put(self, name: str, content: bytes) -> None:
        self._count("put", name)
        self.inner.put(name, content)

    def create(self, name: str, content: bytes) -> bool:
        self._count("put", name)
        return self.inner.create(name, content)

    def get(self, name: str, start: int = 0, end: int | None = None) -> bytes:
        content = self.inner.get(name, start, end)
        self.counts["get"] += 1
        return content[: len(content) // 2] if self.fault("get", name, self.counts["get"]) else content

    def _count(self, verb: str, name: str) -> None:
        self.counts[verb] += 1
        if self.fault(verb, name, self.counts[verb]):
            raise OSError("503 Slow Down")
