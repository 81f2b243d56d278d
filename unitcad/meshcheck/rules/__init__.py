"""The rules: each file has the text of a rule, or of a few, next to the code. Its name begins with the family's letter.

A file is found by its name; nothing else lists it. Its `Rule` constants are the rules. Two functions are called if a
file has them, and yield findings:

- `check_mesh(part: Inspection)` for each mesh,
- `check_print(part: Inspection, printer: Printer)` for each mesh as placed on a printer's bed.
"""
