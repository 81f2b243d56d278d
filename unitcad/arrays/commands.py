"""The kind of files of arrays, which the core's commands take."""

from unitcad.rooms import FileKind

COMMANDS = {}
FILE_KINDS = (
    FileKind(
        "array",
        "arrays",
        "unitcad.arrays.array_names:array_templates",
        "unitcad.arrays.array_tables:AskedArray",
        "unitcad.arrays.array_schema:schema",
        "unitcad build",
    ),
)
