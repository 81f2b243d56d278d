"""An S3-compatible server for tests (moto's), in a process of its own, and stores that fail on request."""

import os
import subprocess
import sys
from contextlib import contextmanager

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
def s3_server():
    """Run a server with one bucket; yield the environment in which s3fs, boto and their children reach it."""
    child = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", _SERVE],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
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

    def __init__(self, inner, fault):
        self.inner, self.fault, self.counts = inner, fault, {"put": 0, "get": 0}

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def put(self, name, content):
        self._count("put", name)
        self.inner.put(name, content)

    def create(self, name, content):
        self._count("put", name)
        return self.inner.create(name, content)

    def get(self, name, start=0, end=None):
        content = self.inner.get(name, start, end)
        self.counts["get"] += 1
        return content[: len(content) // 2] if self.fault("get", name, self.counts["get"]) else content

    def _count(self, verb, name):
        self.counts[verb] += 1
        if self.fault(verb, name, self.counts[verb]):
            raise OSError("503 Slow Down")
