"""The command and the kind of files of the design search."""

from unitcad.rooms import FileKind

COMMANDS = {"design": "unitcad.search.design_command:design"}
FILE_KINDS = (
    FileKind(
        "target",
        "targets",
        "unitcad.search.target_file:shipped",
        "unitcad.search.target_file:TargetFile",
        command="unitcad design",
    ),
)
