"""The settings of `unitcad check` in a file: table [check] of unitcad.toml, or [tool.unitcad.check] of pyproject.toml.

The nearest file with such a table, from the working directory upwards, is used; in one folder unitcad.toml comes first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from unitcad import files
from unitcad.errors import Refusal, UnitcadError, unknown_key
from unitcad.files import seen_from
from unitcad.spec.toml import parse_toml


class Settings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename="kebab"):
    """Keys of a settings file, by the options' names; None or empty for a missing key."""

    select: list[str] = []
    ignore: list[str] = []
    per_file_ignores: dict[str, list[str]] = {}
    fail_on: Literal["error", "warning"] | None = None
    printer: str | None = None
    unit: str | None = None
    strict: bool | None = None
    exclude: list[str] = []
    strict_3mf: bool | None = field(default=None, name="3mf-strict")
    max_faces: Annotated[int, Meta(ge=1)] | None = None
    timeout: Annotated[float, Meta(ge=0.001)] | None = None
    memory: Annotated[int, Meta(ge=200)] | None = None
    baseline: str | None = None


NAMES = ("unitcad.toml", "pyproject.toml")


@dataclass(frozen=True, kw_only=True)
class Configuration:
    """Settings with the file they come from, None for none, and the table's name there."""

    settings: Settings | None = None
    path: Path | None = None
    table: str = ""

    def name(self, key: str) -> str:
        """Name a key in an error: file, table and key."""
        return f"{self.shown}: {self.table}.{key}"

    def chosen(self, key: str, given: Any) -> tuple[str, Any]:
        """Return an option's name and the value `given` to it; without one, the name and the value of its setting."""
        return (f"--{key}", given) if given is not None else (self.name(key), self.value(key))

    def value(self, key: str) -> Any:
        """Return the value of a setting, None without a file."""
        return getattr(self.settings, key, None)

    @property
    def shown(self) -> str | None:
        """Path of the file from the working directory."""
        return None if self.path is None else seen_from(self.path)

    @property
    def baseline(self) -> Path | None:
        """Path of the baseline, which the file gives from its own folder."""
        if self.path is None or self.value("baseline") is None:
            return None
        return Path(seen_from(self.path.parent / self.value("baseline")))

    def ignored(self, path: str) -> list[str]:
        """Return prefixes of codes that per-file-ignores drops for a file; patterns start at the settings' folder."""
        if self.path is None or self.settings is None:
            return []
        below = seen_from(path, self.path.parent)
        return [
            code for pattern, codes in self.settings.per_file_ignores.items() if _fits(below, pattern) for code in codes
        ]

    def left_out(self, given: Sequence[str]) -> Callable[[str], bool]:
        """Return whether `exclude` or one of the patterns `given` on the command line names a path or a folder of it.

        Patterns start at the folder of the settings, and those given at the working directory.
        """
        set_here = [] if self.path is None or self.settings is None else self.settings.exclude
        sets = [(Path.cwd() if self.path is None else self.path.parent, set_here), (Path.cwd(), given)]

        def named(path: str) -> bool:
            for folder, patterns in sets:
                below = Path(seen_from(path, folder)) if patterns else Path()
                for pattern in patterns:
                    if any(_fits(part.as_posix(), pattern.rstrip("/")) for part in (below, *below.parents)):
                        return True
            return False

        return named


def _fits(path: str, pattern: str) -> bool:
    return fnmatchcase(path, pattern) or ("/" not in pattern and fnmatchcase(Path(path).name, pattern))


def find(named: str | None = None, *, wanted: bool = True) -> Configuration:
    """Read the settings of the file `named`, else of the nearest one that has any; without `wanted` none.

    Raises UnitcadError for a file that can't be read, Refusal for a key or value that can't be.
    """
    if not wanted:
        if named is not None:
            raise UnitcadError("--config and --no-config exclude each other")
        return Configuration()
    if named is not None:
        configuration = _read(Path(named))
        if configuration is None:
            raise UnitcadError(f"--config {named}: has no table [{_table(Path(named), {})}]")
        return configuration
    here = Path.cwd()
    for folder in (here, *here.parents):
        for name in NAMES:
            if (folder / name).is_file() and (configuration := _read(folder / name)):
                return configuration
    return Configuration()


def _table(path: Path, data: Mapping[str, Any]) -> str:
    """Name the table: unitcad.toml takes pyproject.toml's name for it as well."""
    return "tool.unitcad.check" if path.name == "pyproject.toml" or "tool" in data else "check"


def _read(path: Path) -> Configuration | None:
    """Read the settings of a file; None without such a table. A unit's spec named unitcad.toml has none."""
    shown, text = seen_from(path.absolute()), files.read_text(path)
    if path.name == "pyproject.toml" and "unitcad" not in text and "\\" not in text:  # with escapes it may be meant
        return None

    data: Any = parse_toml(text, shown)
    table = _table(path, data)
    *above, last = table.split(".")
    if not above and "design" in data:
        return None
    for key in above:
        data = data.get(key, {})
        if not isinstance(data, Mapping):
            return None
    try:
        if data and (above or path.name in NAMES):
            for key in data:
                if key != last:
                    raise unknown_key(".".join([*above, key]), data[key], [last])
        if last not in data:
            return None
        from unitcad.spec.convert import convert

        settings = convert(_mapping(table, data[last]), Settings, table)
    except Refusal as error:
        raise Refusal(f"{shown}: {error.field}", error.value, error.limit, error.nearest) from None
    return Configuration(settings=settings, path=path.absolute(), table=table)


def _mapping(table: str, data: Any) -> Mapping[str, Any]:
    if isinstance(data, Mapping):
        return data
    raise Refusal(table, data, "takes a table")
