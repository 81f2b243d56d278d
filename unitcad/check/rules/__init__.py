"""The rules, a family or a part of one in each file that begins with the family's letter: texts beside the code.

A file is found by its name; nothing else lists it. Its `Rule` constants are the rules. Two functions are called where a
file has them, and yield findings:

- `check_mesh(part: Inspection)` for each mesh,
- `check_print(part: Inspection, printer: Printer)` for each mesh as it stands on a printer's bed.
"""
