"""What `import unitcad` offers beside the rooms' own classes: a function a command, for Python and notebooks."""
