"""The command of the live page."""

COMMANDS = {"serve": "unitcad.serve.serve_command:serve"}
FILE_KINDS = ()
