"""Files, F001 to F013 but for F011: what the readers find before there is a mesh."""

from __future__ import annotations

from collections.abc import Iterable

from unitcad.meshcheck.findings import Finding, Location
from unitcad.meshcheck.rules.rule import Rule

F001 = Rule("""
    F001 error: empty or short file
    The file has no bytes, no facet, or fewer bytes than its header needs. An export was interrupted or nothing was
    selected.
    Example: An interrupted download left a file of 0 bytes.
    Fix: Export again and look at the size of the file.
""")

F002 = Rule(
    """
    F002 error: facet count does not match the size
    The count in a binary STL's header asks for more or fewer 50-byte records than the file holds, or a PLY or an OFF
    promises more elements than it has. A reader that trusts either number reads rubbish.
    Example: A binary STL of 12 facets was cut after 400 bytes, which have room for 6.
    Fix: Copy or export the file again; a file cut short in transfer cannot be repaired.
""",
    count_is_size=True,
)

F003 = Rule("""
    F003 error: truncated text, XML or zip
    The text ends inside a facet or before endsolid, the XML is not well formed or ends early, or the zip directory is
    missing or damaged.
    Example: The last line of a text STL is `vertex 0 0`.
    Fix: Copy or export the file again.
""")

F004 = Rule("""
    F004 error: number that cannot be parsed
    A coordinate is not a number with a point as decimal sign. A comma means that a program wrote it under a German or
    French locale.
    Example: `vertex 1,5 0 0` in place of `vertex 1.5 0 0`.
    Fix: Export with LC_NUMERIC=C, or replace the commas.
""")

F005 = Rule("""
    F005 error: content is not what the name says
    The bytes are a web page, a Git LFS pointer, a compressed file or another format than the suffix claims.
    Example: part.stl begins with `version https://git-lfs`, since the repository was cloned without git lfs.
    Fix: Fetch the real file (git lfs pull, gunzip, the download link behind the page), or rename it.
""")

F006 = Rule(
    """
    F006 warning: trailing bytes
    Bytes follow the last facet, endsolid, the last element that a PLY or OFF promises, or a zip's end record. Readers
    ignore them, or count facets from the size and disagree.
    Example: A binary STL has 16 bytes of a checksum after its last facet.
    Fix: Export again, or cut the file after its last facet.
""",
    count_is_size=True,
)

F007 = Rule("""
    F007 warning: binary header starts with solid
    Programs that look only at the first word take the file for text and refuse it.
    Example: The header of a binary STL reads `solid part1`.
    Fix: Write a header that starts with anything else.
""")

F008 = Rule("""
    F008 error: facet without three vertices
    A facet of a text STL has fewer or more vertices than three, or a face of another format has fewer. STL knows only
    triangles.
    Example: A facet of a text STL has four `vertex` lines.
    Fix: Triangulate before export.
""")

F009 = Rule("""
    F009 warning: byte order mark, CR-only line ends or odd encoding
    Text with a byte order mark, old Macintosh line ends or an encoding other than UTF-8 is misread or hangs some
    readers. In a 3MF part, which must be UTF-8, it is an error.
    Example: An editor saved a text STL as UTF-8 with a byte order mark.
    Fix: Save as UTF-8 without a byte order mark, with LF line ends.
""")

F010 = Rule("""
    F010 info: several solids in one file
    A text STL holds several solid blocks. Some readers take the first one only.
    Example: `solid lid` to `endsolid lid`, then `solid box` to `endsolid box`.
    Fix: Nothing, if the reader takes them all; else one file for each.
""")

F012 = Rule("""
    F012 error: no such file, or unreadable
    The path does not exist, is not a file, or may not be read; or it is STEP and no B-rep extra is installed (a warning
    where a folder was named). A warning if a solid of a STEP file has no closed mesh: its overlap and print are not
    judged.
    Example: `unitcad check prat.stl` where the file is part.stl.
    Fix: Check the path and its permissions; for STEP, in a clone, pip install '.[step]'.
""")

F013 = Rule("""
    F013 warning: polygon that is not flat
    A face of four or more corners has one that lies off its plane by more than a thousandth of its size. Programs fold
    it along different diagonals, so that its volume and its fit differ from one to the next.
    Example: A quad of an OBJ is 10 mm wide, and one corner lies 0.5 mm above the plane of the others.
    Fix: Triangulate before export, or move the corners into one plane.
""")


def not_a_number(word: str | bytes, places: Iterable[Location] = ()) -> Finding:
    """Make the finding F004 about a word in the place of a number."""
    text = word.decode("utf-8", "replace") if isinstance(word, bytes) else word
    why = " (a decimal comma)" if "," in text else ""
    return F004.finding(f"{text[:30]!r} is not a number{why}", places=places)
