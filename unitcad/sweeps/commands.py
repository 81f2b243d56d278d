"""The commands and kinds of files of sweeps."""

from unitcad.rooms import FileKind

COMMANDS = {
    "batch": "unitcad.sweeps.batch_command:batch",
    "export": "unitcad.sweeps.export_command:export",
}
FILE_KINDS = (FileKind("sweep", "sweeps", "unitcad.sweeps.sweep:shipped", "unitcad.sweeps.sweep:SweepFile"),)
