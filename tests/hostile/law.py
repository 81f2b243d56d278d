"""The law of a stranger's input: exit 0, 1 or 2, within time and memory, no internal error, nothing written outside.

A fresh process loads the commands and forks one child a command, so that a command costs some hundredths of a second
and has its own limits. `python law.py` is that process.
"""

import atexit
import contextlib
import json
import os
import resource
import select
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

CPU_S = 10.0
"""Seconds of the processor that a command may take, with the processes that it waited for."""
PEAK_MB = 500.0
"""Resident memory of the largest of its processes."""
WALL_S = 90.0
"""Seconds after which a command counts as one that hangs; the machine may be busy with other work."""
ADDRESS_SPACE = 6 << 30
FORBIDDEN = ("internal error", "check itself failed", "Traceback", "(a bug", "RecursionError", "Segmentation")
WRITES = ("os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.symlink", "os.link", "os.truncate", "os.chmod")
PRELOAD = (
    "unitcad.api", "unitcad.checks", "unitcad.estimate_inputs", "unitcad.casting.procedure", "unitcad.export.svg",
    "unitcad.export.finding_pictures", "unitcad.report.page", "scipy.optimize", "scipy.signal", "scipy.io", "h5py",
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What a command did: exit code (None: it was killed, by `signal`), costs, output, writes outside its folder."""

    words: list
    code: int | None
    signal: int | None
    cpu_s: float
    peak_mb: float
    said: str
    outside: list

    def broken(self):
        """The parts of the law that it broke."""
        found = []
        if self.code not in (0, 1, 2):
            found.append(f"exit {self.code}, signal {self.signal}")
        if self.cpu_s > CPU_S:
            found.append(f"{self.cpu_s:.1f} s")
        if self.peak_mb > PEAK_MB:
            found.append(f"{self.peak_mb:.0f} MB")
        found += [word for word in FORBIDDEN if word in self.said]
        found += [f"wrote {path}" for path in self.outside]
        if self.code == 2 and "error" not in self.said:
            found.append("exit 2 without a word")
        return found


class Law:
    """Runs commands; as a context. `cwd` of each is its own, in which alone it may write."""

    def __enter__(self):
        environment = {
            **os.environ,
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        environment.pop("UNITCAD_TRACEBACK", None)
        self.process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )
        assert self.process.stdout.readline() == "ready\n"
        return self

    def __exit__(self, *raised):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()

    def run(self, words, cwd, until=""):
        """Run a command; with `until`, interrupt it when it has said that."""
        self.process.stdin.write(json.dumps({"words": [str(word) for word in words], "cwd": str(cwd), "until": until}))
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return Outcome(**json.loads(self.process.stdout.readline()))


def _audit(allowed, note):
    """Note every write of Python code to a path that is not below one of the allowed folders."""

    def look(event, arguments):
        if event == "open":
            path, mode, flags = arguments
            writes = flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) if flags else "w" in (mode or "")
            paths = [path] if writes else []
        else:
            paths = arguments[:2] if event in ("os.rename", "os.link") else arguments[:1] if event in WRITES else []
        for path in paths:
            if isinstance(path, str | bytes | os.PathLike):
                path = os.fsdecode(path)
                real = os.path.join(os.path.realpath(os.path.dirname(path) or "."), os.path.basename(path))
                if not any(real == root or real.startswith(f"{root}/") for root in allowed) and real != os.devnull:
                    os.write(note, f"{event} {real}\n".encode("utf-8", "replace"))

    sys.addaudithook(look)


def _command(job, said, note):
    """Be the command: in its folder, with its limits."""
    from unitcad.cli import main

    os.setsid()
    os.chdir(job["cwd"])
    for name in ("HOME", "TMPDIR", "XDG_CACHE_HOME"):
        os.environ[name] = job["cwd"]
    os.environ["UNITCAD_CACHE"] = os.path.join(job["cwd"], "cache")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(said, 1)
    os.dup2(said, 2)
    sys.stdout, sys.stderr = (open(handle, "w", encoding="utf-8", buffering=1) for handle in (1, 2))  # noqa: SIM115
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
    resource.setrlimit(resource.RLIMIT_CPU, (int(2 * CPU_S), int(2 * CPU_S)))
    _audit([os.path.realpath(job["cwd"])], note)
    sys.argv = ["unitcad", *job["words"]]
    code = 0
    try:
        main()
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 0
    except BaseException:
        import traceback

        traceback.print_exc()
        code = 99
    with contextlib.suppress(BaseException):
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


def _wait(pid, job, said):
    """Wait for a command; return its status and what it used. One that hangs is killed with its processes."""
    end, interrupted = time.monotonic() + WALL_S, False
    handle = os.pidfd_open(pid)
    try:
        while not select.select([handle], [], [], 0.2 if job["until"] else WALL_S)[0]:
            if (
                job["until"]
                and not interrupted
                and job["until"] in os.pread(said, 100_000, 0).decode("utf-8", "replace")
            ):
                os.kill(pid, signal.SIGINT)
                interrupted = True
            if time.monotonic() > end:
                break
    finally:
        os.close(handle)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)  # it, or what it left behind
    _, status, used = os.wait4(pid, 0)
    return status, used, interrupted


def _lines(handle):
    return sorted(set(os.pread(handle, 1_000_000, 0).decode("utf-8", "replace").splitlines()))


def _written(path, began):
    """Whether a try to write there came to something: the audit hook sees it before the system refuses it."""
    try:
        return os.lstat(path).st_ctime >= began - 1 and not path.startswith("/proc/")
    except FileNotFoundError:
        return any(Path(path).parent.glob(".tmp-*"))
    except OSError:
        return False


def _serve():
    from importlib import import_module

    from unitcad.rooms import commands, load

    for command in commands().values():
        load(command.run)
    for name in PRELOAD:
        import_module(name)
    print("ready", flush=True)
    for line in sys.stdin:
        job = json.loads(line)
        said, note = (os.memfd_create(name) for name in ("said", "note"))
        began, pid = time.time(), os.fork()
        if pid == 0:
            _command(job, said, note)
        status, used, interrupted = _wait(pid, job, said)
        code = os.WEXITSTATUS(status) if os.WIFEXITED(status) else None
        outcome = {
            "words": job["words"],
            "code": 0 if interrupted and code == 130 else code,
            "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
            "cpu_s": used.ru_utime + used.ru_stime,
            "peak_mb": used.ru_maxrss / 1000,
            "said": os.pread(said, 1_000_000, 0).decode("utf-8", "replace"),
            "outside": [line for line in _lines(note) if _written(line.partition(" ")[2], began)],
        }
        os.close(said)
        os.close(note)
        print(json.dumps(outcome), flush=True)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    _serve()
