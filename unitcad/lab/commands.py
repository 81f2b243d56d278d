"""The commands and the kind of files of the lab."""

from unitcad.rooms import FileKind

COMMANDS = {name: f"unitcad.lab.{name}_command:{name}" for name in ("measure", "material", "fit", "phantom")}
FILE_KINDS = (FileKind("phantom", "phantoms", "unitcad.lab.phantom.recipe:phantoms"),)
