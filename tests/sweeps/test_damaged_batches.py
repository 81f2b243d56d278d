"""Damage to a batch's cache and results: the next run ends with the same bytes, or with one clear error about it."""

import json
import os
import random
import shutil

import pytest
from batching import bytes_of, leftovers, ring_sweep
from batching import made as make

from unitcad.errors import UnitcadError
from unitcad.sweeps.journal import JOURNAL

FAR = 4_000_000_000


class Batch:
    """A finished batch with its cache, as a folder to be copied."""

    def __init__(self, folder):
        self.folder, self.out, self.cache = folder, folder / "out", folder / "cache"

    def run(self, sweep):
        return make(sweep, self.out, verify=True, cache=self.cache)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    sweep = ring_sweep(folder / "s", heights=[2.0, 3.0], materials=2)
    batch = Batch(folder / "batch")
    assert batch.run(sweep).ok == 4
    return batch, sweep


def _cut(file, dice):
    content = file.read_bytes()
    _anew(file, content[: dice.randrange(len(content))])


def _flipped(file, dice):
    content = bytearray(file.read_bytes())
    content[dice.randrange(len(content))] ^= 1 << dice.randrange(8)
    _anew(file, bytes(content))


def _gone(file, dice):
    shutil.rmtree(file) if file.is_dir() and not file.is_symlink() else file.unlink()


def _linked(file, dice):
    aside = next(parent.parent for parent in file.parents if parent.name in ("out", "cache")) / "aside"
    aside = aside.with_name(f"aside{len(list(aside.parent.iterdir()))}")
    shutil.move(file, aside)
    file.symlink_to(aside)


def _dangling(file, dice):
    _gone(file, dice)
    file.symlink_to("nowhere")


def _folder(file, dice):
    _gone(file, dice)
    file.mkdir()
    (file / "file").touch()


def _pipe(file, dice):
    _gone(file, dice)
    os.mkfifo(file)


def _file(folder, dice):
    _gone(folder, dice)
    folder.write_text("something else")


def _anew(file, content):
    """As a new file: a result is a link to the cache."""
    file.unlink()
    file.write_bytes(content)


def _emptied(file, dice):
    _anew(file, b"")


ANY  = {
    "emptied": _emptied, "cut": _cut, "flipped": _flipped, "gone": _gone, "linked": _linked, "dangling": _dangling,
    "a folder": _folder, "a pipe": _pipe,
    "zeros": lambda file, dice: _anew(file, b"\0" * file.stat().st_size),
    "longer": lambda file, dice: _anew(file, file.read_bytes() + dice.randbytes(1000)),
    "nonsense": lambda file, dice: _anew(file, b'[{"a": 1e999}]'),
    "of the future": lambda file, dice: os.utime(file, (FAR, FAR)),
}  # fmt: skip


def _swapped(folder, dice):
    """Each file of a folder of entries under the name of another one."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    contents = [path.read_bytes() for path in paths]
    for path, content in zip(paths, contents[1:] + contents[:1], strict=True):
        _anew(path, content)


def _each(change):
    def changed(folder, dice):
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            change(path, dice)

    return changed


IN_CACHE = {
    **{
        f"{kind}: each {how}": (kind, _each(change))
        for kind in ("data", "files", "content")
        for how, change in ANY.items()
    },
    **{f"{kind}: swapped": (kind, _swapped) for kind in ("data", "files")},
    **{f"{kind}: gone": (kind, _gone) for kind in ("data", "files", "content", "tmp", "locks", "unitcad-cache", "")},
    "mark: emptied": ("unitcad-cache", _emptied),
    "a lock is a folder": ("locks/x", lambda path, dice: path.mkdir()),
    "tmp holds a folder": ("tmp/x", lambda path, dice: path.mkdir()),
    "tmp holds a pipe": ("tmp/x", lambda path, dice: os.mkfifo(path)),
    "tmp is a file": ("tmp", _file),
    "the cache is a file": ("", _file),
}
REFUSED_CACHE = {"tmp is a file", "the cache is a file"}

IN_RESULTS = {
    **{
        f"{file}: {how}": (f"VARIANT/{file}", change)
        for file in ("manifest.json", "spec.toml", "timings.json", "unit/layer1.stl")
        for how, change in ANY.items()
    },
    "the variant: gone": ("VARIANT", _gone),
    "the variant: a file": ("VARIANT", _file),
    "the variant: linked": ("VARIANT", _linked),
    "the variant's folder of files: a file": ("VARIANT/unit", _file),
    "the variant's folder of files: linked": ("VARIANT/unit", _linked),
    "the variant's lock: left behind": ("LOCK", lambda path, dice: path.touch()),
    **{f"{file}: {how}": (file, ANY[how]) for file in ("batch.json", "variants.csv", "timings.json") for how in ANY},
    **{f"{JOURNAL}: {how}": (JOURNAL, ANY[how]) for how in ANY},
    **{f"batch.lock: {how}": ("batch.lock", ANY[how]) for how in ("gone", "linked", "dangling", "a folder", "a pipe")},
}
REFUSED = {
    *(f"{JOURNAL}: {how}" for how in ("linked", "a folder", "a pipe")),
    *(f"batch.lock: {how}" for how in ("linked", "dangling", "a folder")),
    *(f"{file}: a folder" for file in ("batch.json", "variants.csv", "timings.json")),
    *(f"{file}: a pipe" for file in ("batch.json", "variants.csv", "timings.json")),
    f"{JOURNAL}: nonsense",
}
FAILED = {"the variant: a file", "the variant: linked"}
"""A variant whose place is taken by something that is not ours fails with that reason; nothing is overwritten."""


def _copied(made, folder):
    shutil.copytree(made.folder, folder, symlinks=True)
    return Batch(folder)


def _cases(kinds, count):
    """Return each kind of damage with three seeds, of which `count` kinds with the first seed are not `long`."""
    share = random.Random(1).sample(sorted(kinds), count)
    return [
        pytest.param(kind, seed, marks=() if kind in share and not seed else pytest.mark.long)
        for kind in kinds
        for seed in range(3)
    ]


@pytest.mark.parametrize(("kind", "seed"), _cases(IN_CACHE, 8))
def test_a_damaged_cache(kind, seed, made, tmp_path):
    """The damage, then the batch into a new folder: all comes out of the cache, or is made again."""
    batch, sweep = _copied(made[0], tmp_path / "batch"), made[1]
    shutil.rmtree(batch.out)
    place, change = IN_CACHE[kind]
    change(batch.cache / place, random.Random(f"{kind} {seed}"))
    if kind in REFUSED_CACHE:
        with pytest.raises(UnitcadError, match="choose another with --cache"):
            batch.run(sweep)
        return
    for _ in range(2):
        summary = batch.run(sweep)
        assert (summary.ok, summary.failed, summary.stopped) == (4, 0, "")
        assert bytes_of(batch.out) == bytes_of(made[0].out)
        assert not any(path.is_symlink() for path in batch.out.rglob("*"))
        shutil.rmtree(batch.out)


@pytest.mark.parametrize(("kind", "seed"), _cases(IN_RESULTS, 12))
def test_damaged_results(kind, seed, made, tmp_path):
    batch, sweep = _copied(made[0], tmp_path / "batch"), made[1]
    variant = json.loads((batch.out / "batch.json").read_text())["variants"][1]["folder"]
    place, change = IN_RESULTS[kind]
    place = place.replace("VARIANT", variant).replace("LOCK", f".{variant}.lock")
    change(batch.out / place, random.Random(f"{kind} {seed}"))
    if kind in REFUSED:
        with pytest.raises((UnitcadError, OSError)) as error:
            batch.run(sweep)
        assert place.partition("/")[0] in str(error.value) or str(batch.out) in str(error.value)
        return
    try:
        summary = batch.run(sweep)
    except UnitcadError as error:
        # A journal of which nothing is left is not begun anew without a word.
        assert place == JOURNAL
        assert "no journal of a batch" in str(error)
        return
    if kind in FAILED:
        assert (summary.ok, summary.failed) == (3, 1)
        assert f"{variant}: is a" in summary.failures[0].reason
        return
    assert (summary.ok, summary.failed, summary.stopped) == (4, 0, "")
    assert bytes_of(batch.out) == bytes_of(made[0].out)
    assert not any(path.is_symlink() for path in batch.out.rglob("*"))
    assert not leftovers(batch.out)
    assert batch.run(sweep).resumed == 4
