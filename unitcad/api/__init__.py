"""The functions of `import unitcad`, one for each command, for Python and notebooks."""
