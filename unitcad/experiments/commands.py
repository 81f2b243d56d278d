"""The command and the kind of files of the ranking of experiments."""

from unitcad.rooms import FileKind

COMMANDS = {"experiments": "unitcad.experiments.experiments_command:experiments"}
FILE_KINDS = (FileKind("experiment", "experiments"),)
