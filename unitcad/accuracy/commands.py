"""The command of the accuracy suites."""

COMMANDS = {"accuracy": "unitcad.accuracy.accuracy_command:accuracy"}
FILE_KINDS = ()
