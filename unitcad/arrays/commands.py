"""The kind of files of arrays, which the core's commands take."""

from unitcad.rooms import FileKind

COMMANDS = {}
FILE_KINDS = (
    FileKind(
        "array",
        "arrays",
        model="unitcad.arrays.array_tables:AskedArray",
        schema="unitcad.arrays.array_schema:schema",
        command="unitcad build",
        keys=("array",),
        subject="unitcad.arrays.arrayed:Arrayed",
        page="unitcad.arrays.live_answers",
    ),
)
