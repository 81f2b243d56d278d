"""Settings of a check: the table [check] of the nearest unitcad.toml with one, from the working directory upwards."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.documents import parse_toml
from unitcad.errors import Refusal, UnitcadError, unknown_key, unknown_name
from unitcad.files import path_seen_from


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Keys of a settings file, by the options' names; None or empty for a missing key."""

    select: list[str] = field(default_factory=list)
    ignore: list[str] = field(default_factory=list)
    per_file_ignores: dict[str, list[str]] = field(default_factory=dict)
    fail_on: str | None = None
    printer: str | None = None
    unit: str | None = None
    strict: bool | None = None
    exclude: list[str] = field(default_factory=list)
    strict_3mf: bool | None = None
    max_faces: int | None = None
    timeout: float | None = None
    memory: int | None = None
    baseline: str | None = None


NAME = "unitcad.toml"


@dataclass(frozen=True, kw_only=True)
class Configuration:
    """Settings with the file they come from, None for none."""

    settings: Settings = field(default_factory=Settings)
    path: Path | None = None

    def name(self, key: str) -> str:
        """Name a key in an error: file, table and key."""
        return f"{self.shown}: check.{key}"

    def chosen(self, key: str, given: Any) -> tuple[str, Any]:
        """Return an option's name and the value `given` to it; without one, the name and the value of its setting."""
        return (f"--{key}", given) if given is not None else (self.name(key), getattr(self.settings, key))

    @property
    def shown(self) -> str | None:
        """Path of the file from the working directory."""
        return None if self.path is None else path_seen_from(self.path)

    @property
    def baseline(self) -> Path | None:
        """The file of known findings that the settings name, from their folder."""
        if self.path is None or self.settings.baseline is None:
            return None
        return Path(path_seen_from(self.path.parent / self.settings.baseline))

    def ignored(self, path: str) -> list[str]:
        """Return prefixes of codes that per-file-ignores drops for a file; patterns start at the settings' folder."""
        if self.path is None:
            return []
        below = path_seen_from(path, self.path.parent)
        return [
            code for pattern, codes in self.settings.per_file_ignores.items() if _fits(below, pattern) for code in codes
        ]

    def left_out(self, given: Sequence[str]) -> Callable[[str], bool]:
        """Return whether `exclude` or one of the patterns `given` on the command line names a path or a folder of it.

        Patterns start at the folder of the settings, and those given at the working directory.
        """
        sets = [(Path.cwd() if self.path is None else self.path.parent, self.settings.exclude), (Path.cwd(), given)]

        def named(path: str) -> bool:
            for folder, patterns in sets:
                below = Path(path_seen_from(path, folder)) if patterns else Path()
                for pattern in patterns:
                    if any(_fits(part.as_posix(), pattern.rstrip("/")) for part in (below, *below.parents)):
                        return True
            return False

        return named


def _fits(path: str, pattern: str) -> bool:
    return fnmatchcase(path, pattern) or ("/" not in pattern and fnmatchcase(Path(path).name, pattern))


def find(named: str | None = None) -> Configuration:
    """Read the settings of the file `named`, else of the nearest one that has any.

    Raises UnitcadError for a file that can't be read, Refusal for a key or value that can't be.
    """
    if named is not None:
        configuration = _read(Path(named))
        if configuration is None:
            raise UnitcadError(f"--config {named}: has no table [check]")
        return configuration
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / NAME).is_file() and (configuration := _read(folder / NAME)):
            return configuration
    return Configuration()


def _read(path: Path) -> Configuration | None:
    """Read the settings of a file; None without such a table. A unit's spec named unitcad.toml has none."""
    shown = path_seen_from(path.absolute())
    data: Any = parse_toml(files.read_text(path), shown)
    if "design" in data:
        return None
    try:
        for key in data if path.name == NAME else ():
            if key != "check":
                raise unknown_key(key, data[key], ["check"])
        if "check" not in data:
            return None
        settings = _settings(_table("check", data["check"]))
    except Refusal as error:
        raise Refusal(f"{shown}: {error.field}", error.value, error.limit, error.nearest) from None
    return Configuration(settings=settings, path=path.absolute())


def _settings(table: Mapping[str, Any]) -> Settings:
    """Return the settings of a table. Raises Refusal for the first key or value that is none."""
    values = {}
    for key, value in table.items():
        if key not in _KEYS:
            raise unknown_key(f"check.{key}", value, _KEYS)
        name, take = _KEYS[key]
        values[name] = take(f"check.{key}", value)
    return Settings(**values)


def _table(field: str, value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise Refusal(field, value, "takes a table")
    return value


def _text(field: str, value: Any) -> str:
    if not isinstance(value, str):
        raise Refusal(field, value, "takes a text")
    return value


def _texts(field: str, value: Any) -> list[str]:
    if not isinstance(value, list):
        raise Refusal(field, value, "takes a list")
    return [_text(f"{field}.{i}", one) for i, one in enumerate(value)]


def _ignores(field: str, value: Any) -> dict[str, list[str]]:
    return {pattern: _texts(f"{field}.{pattern}", codes) for pattern, codes in _table(field, value).items()}


def _level(field: str, value: Any) -> str:
    if _text(field, value) not in LEVELS:
        raise unknown_name(field, value, LEVELS)
    return value


def _flag(field: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise Refusal(field, value, "takes true or false")
    return value


def _whole(least: int) -> Callable[[str, Any], int]:
    def take(field: str, value: Any) -> int:
        if not isinstance(value, int) or isinstance(value, bool):
            raise Refusal(field, value, "takes a whole number")
        if not least <= value < 2**63:
            limit = f"must be at least {least}" if value < least else "is too large for a number here"
            raise Refusal(field, value, limit, least if value < least else None)
        return value

    return take


def _seconds(field: str, value: Any) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise Refusal(field, value, "takes a number")
    if not math.isfinite(value):
        raise Refusal(field, value, "must be a finite number")
    if value < LEAST_SECONDS:
        raise Refusal(field, value, f"must be at least {LEAST_SECONDS}", LEAST_SECONDS)
    return float(value)


LEVELS = ("error", "warning")
LEAST_SECONDS = 0.001
_KEYS: dict[str, tuple[str, Callable[[str, Any], Any]]] = {
    "select": ("select", _texts),
    "ignore": ("ignore", _texts),
    "per-file-ignores": ("per_file_ignores", _ignores),
    "fail-on": ("fail_on", _level),
    "printer": ("printer", _text),
    "unit": ("unit", _text),
    "strict": ("strict", _flag),
    "exclude": ("exclude", _texts),
    "3mf-strict": ("strict_3mf", _flag),
    "max-faces": ("max_faces", _whole(1)),
    "timeout": ("timeout", _seconds),
    "memory": ("memory", _whole(200)),
    "baseline": ("baseline", _text),
}
"""The keys of the table, each with its attribute and the function that takes its value."""
