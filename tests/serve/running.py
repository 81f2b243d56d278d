"""A server that runs as a command, and a client that speaks to it as its page does."""

import asyncio
import contextlib
import json
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

MESSAGE = {"Content-Type": "application/json"}


class Server:
    """A running `unitcad serve`: its address, its token, its process, the folder in which it runs."""

    def __init__(self, url, process, folder):
        self.url, self.process, self.folder = url, process, Path(folder)
        self.base, _, self.token = url.partition("/?token=")
        self.port = int(self.base.rpartition(":")[2])

    def send(
        self,
        path,
        message=None,
        *,
        headers=None,
        body=None,
        method=None,
    ):
        """Send a message as the page does; `headers` replace the page's, "" leaves one out."""
        if message is not None:
            body = json.dumps(message).encode()
        given = {"X-Unitcad-Token": self.token, **(MESSAGE if body is not None else {}), **(headers or {})}
        request = urllib.request.Request(
            self.base + path, body, {name: value for name, value in given.items() if value != ""}, method=method
        )
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                return answer.status, answer.read(), dict(answer.headers)
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read(), dict(error.headers)

    def ask(self, text, what="unit", edits=None):
        """Ask about a text; returns the answer."""
        status, content, _ = self.send("/ask", {"text": text, "what": what, "edits": edits or []})
        assert status == 200, content
        return json.loads(content)

    def ended(self, state, seconds=60.0):
        """Wait for the end of a job; return its last state and the stages that it named."""
        stages, end = [state["stage"]], time.monotonic() + seconds
        while not state["ended"]:
            assert time.monotonic() < end
            time.sleep(0.02)
            state = json.loads(self.send(f"/job/{state['job']}")[1])
            stages += [state["stage"]] if state["stage"] != stages[-1] else []
        return state, stages

    def raw(self, content, seconds=20.0):
        """Send bytes over a socket and return what comes back until the server closes or `seconds` have passed."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=seconds) as line:
            line.sendall(content)
            got = b""
            with contextlib.suppress(TimeoutError, ConnectionResetError):
                while part := line.recv(65536):
                    got += part
                    if b"\r\n\r\n" in got:
                        break
            return got


def apart(coroutine):
    """Run a coroutine in a thread of its own, since a browser's test leaves a loop in the main one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, coroutine).result()


@contextlib.contextmanager
def serving(folder, *arguments):
    """Run `unitcad serve` in a folder, without a browser unless asked for."""
    command = [sys.executable, "-P", "-m", "unitcad", "serve", "--no-browser", *arguments]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            yield Server(process.stdout.readline().strip(), process, folder)
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
            told = process.stderr.read()
            assert (told, process.returncode) == ("", 0), told
