"""What others put into a folder is neither removed nor written through, and no special file is read."""

import contextlib
import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import filelock
import pytest

from unitcad import files
from unitcad.documents import read_json
from unitcad.errors import UnitcadError
from unitcad.pipeline.write import build, clear_leftovers, replacing, subject
from unitcad.report import write_report
from unitcad.validation import load

pytestmark = pytest.mark.skipif(os.name != "posix", reason="links and pipes as POSIX has them")


def folder_name(spec):
    return subject(spec).folder_name


def _letter(folder):
    folder.mkdir(parents=True)
    (folder / "letter.txt").write_text("keep")
    return folder


@pytest.mark.parametrize(
    "name", [".tmp-photos-20240101", ".tmp-x-old", ".tmp-x-99999999", ".tmp-", ".tmp-0123456789abcdef"]
)
def test_a_folder_of_others_stays_whatever_its_name(name, tmp_path):
    letter = _letter(tmp_path / name) / "letter.txt"
    build(load("single-embedded", ["output.formats=[]"]), tmp_path, only=["estimate"])
    clear_leftovers(tmp_path)
    assert letter.read_text() == "keep"
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    "mark",
    [
        "",
        "unitcad scratch 1\nfedcba9876543210\n\n",
        "unitcad scratch 2\n0123456789abcdef\n\n",
        "unitcad scratch 1\n0123456789abcdef\n../x\n",
        "unitcad scratch 1\n0123456789abcdef\n..\n",
        "unitcad scratch 1\n0123456789abcdef\n",
    ],
)
def test_a_folder_with_a_mark_that_is_not_its_own_stays(mark, tmp_path):
    folder = _letter(tmp_path / "out" / ".tmp-0123456789abcdef")
    (folder / files.MARK).write_text(mark)
    clear_leftovers(tmp_path / "out")
    assert (folder / "letter.txt").exists()


def test_what_a_killed_process_left_goes_and_what_a_live_one_has_stays(tmp_path):
    code = (
        "import os, sys; from pathlib import Path; from unitcad import files\n"
        f"with files.scratch(Path({str(tmp_path)!r})) as folder:\n"
        "    (folder / 'half').write_text('half'); print('in', flush=True); sys.stdin.readline()\n"
        "    os._exit(9)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout.readline()
        clear_leftovers(tmp_path)
        assert len(list(tmp_path.iterdir())) == 1
        child.communicate(b"\n")
    assert len(list(tmp_path.iterdir())) == 1
    clear_leftovers(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_scratch_folder_whose_work_ends_while_another_process_looks_is_removed(tmp_path, monkeypatch):
    """Its lock is then made anew by the one that looks, and would stay."""
    marked, work = files._marked, files.scratch(tmp_path, "result")

    def look(folder):
        name = marked(folder)
        monkeypatch.setattr(files, "_marked", marked)
        work.__exit__(None, None, None)
        return name

    work.__enter__()
    monkeypatch.setattr(files, "_marked", look)
    clear_leftovers(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_scratch_folder_that_another_process_takes_for_a_leftover_is_made_again(tmp_path, monkeypatch):
    acquire, taken = filelock.FileLock.acquire, []

    def late(lock, blocking):
        if not taken:
            taken.append(lock.lock_file)
            raise filelock.Timeout(lock.lock_file)
        return acquire(lock, blocking=blocking)

    monkeypatch.setattr(filelock.FileLock, "acquire", late)
    with files.scratch(tmp_path) as folder:
        assert str(folder / files.LOCK) not in taken
        assert (folder / files.MARK).exists()


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a"
    files.write(path, b"old", sync=True)
    with pytest.raises(KeyboardInterrupt), files.writing(path) as file:
        file.write(b"half")
        raise KeyboardInterrupt
    with pytest.raises(FileExistsError):
        files.write_new(path, b"new")
    with _files_limited_to(10):
        for put in (files.write, files.write_new):
            with pytest.raises(OSError, match="File too large"):
                put(tmp_path / "b", b"more than ten")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~_umask()


@contextlib.contextmanager
def _files_limited_to(size):
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def _umask():
    found = os.umask(0)
    os.umask(found)
    return found


def test_a_link_planted_in_a_results_place_is_not_written_through(tmp_path):
    spec = load("single-embedded", ["output.formats=[]"])
    folder = build(spec, tmp_path, only=["estimate"]).folder
    target = tmp_path / "target"
    target.write_text("keep")
    for name in ("report.html", "timings.json", f".tmp-report.html-{os.getpid()}"):
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(target)
    build(spec, tmp_path, only=["estimate"])
    write_report(folder)
    assert target.read_text() == "keep"
    elsewhere = tmp_path / "elsewhere"
    folder.rename(elsewhere)
    folder.symlink_to(elsewhere)
    before = sorted(path.name for path in elsewhere.iterdir())
    with pytest.raises(UnitcadError, match="is a link"):
        build(spec, tmp_path, only=["estimate"])
    with pytest.raises(UnitcadError, match="is a link"), replacing(tmp_path / folder_name(spec)):
        pass
    assert sorted(path.name for path in elsewhere.iterdir()) == before


@pytest.mark.parametrize("kind", ["pipe", "socket", "folder", "/dev/zero", "large", "link"])
def test_what_is_no_regular_file_of_a_fair_size_is_refused(kind, tmp_path):
    path = tmp_path / "file"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "socket":
        os.mknod(path, stat.S_IFSOCK)
    elif kind == "folder":
        path.mkdir()
    elif kind == "large":
        with open(path, "wb") as file:
            file.truncate(files.LARGEST + 1)
    elif kind == "link":
        (tmp_path / "target").write_text("text")
        path.symlink_to(tmp_path / "target")
        assert files.read_text(path) == "text"
    else:
        path = Path(kind)
    reason = {"large": "larger than 16 MB", "/dev/zero": "a device"}.get(kind, f"is a {kind}")
    with pytest.raises(UnitcadError, match=reason):
        files.read(path, links=kind != "link")


@pytest.mark.parametrize("text", ['{"a": NaN}', '{"a": 1e999}', "[" * 100_000, "1" * 5000, '{"a": ', "\x00", ""])
def test_json_that_is_none_is_one_clear_error(text, tmp_path):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(UnitcadError, match=r"a\.json: not JSON"):
        read_json(tmp_path / "a.json")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ("build pipe.toml", "not a regular file"),
        ("estimate large.toml", "larger than 16 MB"),
        ("check --manifest /dev/zero", "not a regular file"),
    ],
)
def test_no_command_hangs_on_or_swallows_what_is_no_spec(arguments, reason, tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    with open(tmp_path / "large.toml", "wb") as file:
        file.truncate(10_000_000_000)
    started = f"import sys; sys.argv[1:] = {arguments.split()!r}; from unitcad.cli import main; main()"
    limited = f"import resource; resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30)); {started}"
    command = [sys.executable, "-P", "-c", limited]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert reason in done.stderr


def test_scratch_of_a_process_that_ended_before_its_mark_is_removed(tmp_path):
    """A folder with our token and nothing but the empty lock, or nothing for a minute; any other one stays."""
    locked, empty, photo, fresh = folders = [tmp_path / f".tmp-{i:016x}" for i in range(4)]
    for folder in folders:
        folder.mkdir()
    for folder in (locked, photo):
        (folder / files.LOCK).touch()
    (photo / "photo.jpg").write_bytes(b"1")
    os.utime(empty, times=(0, time.time() - files.EMPTY_S - 1))
    clear_leftovers(tmp_path)
    assert sorted(tmp_path.iterdir()) == [photo, fresh]
    assert sorted(file.name for file in photo.iterdir()) == ["photo.jpg", files.LOCK]


@pytest.mark.parametrize("kind", ["device", "pipe", "folder"])
@pytest.mark.parametrize("linked", [False, True])
def test_nothing_but_a_file_is_replaced(kind, linked, tmp_path):
    """As root, a rename would put a file in the place of /dev/null."""
    target = tmp_path / "target"
    if kind == "device":
        try:
            os.mknod(target, stat.S_IFCHR | 0o666, os.makedev(1, 3))
        except PermissionError:
            pytest.skip("only root makes devices")
    else:
        {"pipe": os.mkfifo, "folder": os.mkdir}[kind](target)
    path = tmp_path / "link" if linked else target
    if linked:
        path.symlink_to(target)
    before = os.lstat(path)
    with pytest.raises(UnitcadError, match=f"{path.name}: is a {kind}, not a regular file"):
        files.write(path, b"x")
    assert os.lstat(path) == before
    assert not list(tmp_path.glob(".tmp-*"))
