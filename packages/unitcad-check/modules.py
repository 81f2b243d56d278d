"""The modules of the wheel: those of unitcad that the check needs, under a name that unitcad itself does not use."""

import re
import shutil
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCE = Path(__file__).resolve().parents[2]
NAME = "unitcad_check"
PARTS = ("errors", "text", "files", "workers", "documents", "extras", "hook_words", "geometry", "meshcheck")
"""Modules and packages of unitcad."""
_IMPORTS = re.compile(rf"\bunitcad(?=\.({'|'.join(PARTS)})\b)|(?<=\bfrom )unitcad(?= import\b)")
_COMMAND = re.compile(r"\bunitcad check(?= --)")


def write(folder: Path) -> None:
    """Write the package into a folder that is not there."""
    folder.mkdir()
    version = re.search(r'^__version__ = ".*"$', (SOURCE / "unitcad/__init__.py").read_text("utf-8"), re.MULTILINE)
    (folder / "__init__.py").write_text(f'"""Checks of mesh files, from unitcad."""\n\n{version[0]}\n', "utf-8")
    for part in PARTS:
        file, room = SOURCE / "unitcad" / f"{part}.py", SOURCE / "unitcad" / part
        for path in [file] if file.is_file() else sorted(room.rglob("*.py")):
            target = folder / path.relative_to(SOURCE / "unitcad")
            target.parent.mkdir(parents=True, exist_ok=True)
            text = _IMPORTS.sub(NAME, path.read_text("utf-8"))
            target.write_text(_COMMAND.sub("unitcad-check", text), "utf-8", newline="\n")
    shutil.copy(SOURCE / "LICENSE", folder)


class Modules(BuildHookInterface):
    """The hook that hatchling calls before and after it makes a wheel."""

    def initialize(self, version: str, build_data: dict) -> None:
        """Write the package, and name it as the content of the wheel. An editable install has it, too."""
        self.made = Path(tempfile.mkdtemp())
        write(self.made / NAME)
        build_data["force_include"][str(self.made / NAME)] = NAME

    def finalize(self, version: str, build_data: dict, artifact_path: str) -> None:
        """Remove the package again."""
        shutil.rmtree(self.made)
