"""Files, F001 to F013: the readers' findings before there is a mesh, and limits of a check: bytes, faces, seconds.

Reaching a limit is finding F011, never a pass.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from unitcad.geometry.boxes import TooMany
from unitcad.meshcheck.findings import Facts, Finding, Location, Unreadable, counted
from unitcad.meshcheck.rules.registry import Rule

F001 = Rule("""
    F001 error: empty or short file
    The file has no bytes, no facet, or fewer bytes than its header needs. An export was interrupted or nothing was
    selected.
    Example: An interrupted download left a file of 0 bytes.
    Fix: Export again and look at the size of the file.
""")

F002 = Rule("""
    F002 error: facet count does not match the size
    The count in a binary STL's header asks for more or fewer 50-byte records than the file holds, bytes of attributes
    follow each facet, or a PLY or an OFF promises more elements than it has. A reader that trusts either number reads
    rubbish.
    Example: A binary STL of 12 facets was cut after 400 bytes, which have room for 6.
    Fix: Copy or export the file again; a file cut short in transfer cannot be repaired.
""")

F003 = Rule("""
    F003 error: truncated text, XML or zip
    The text ends inside a facet or before endsolid, the XML is not well formed or ends early, or the zip directory is
    missing, damaged or another one than its end record says.
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
    F005 error: content and name disagree
    The bytes are a web page, a Git LFS pointer, a compressed file or another format than the suffix claims.
    Example: part.stl begins with `version https://git-lfs`, since the repository was cloned without git lfs.
    Fix: Fetch the real file (git lfs pull, gunzip, the download link behind the page), rename it, or export a mesh.
""")

F006 = Rule("""
    F006 warning: trailing bytes
    Bytes follow the last facet, endsolid, the zip of a 3MF, or the last element that a PLY or OFF promises. Readers
    ignore them, or count facets from the size and disagree.
    Example: A binary STL has 16 bytes of a checksum after its last facet.
    Fix: Export again, or cut the file after its last facet.
""")

F007 = Rule("""
    F007 info: binary header starts with solid
    Programs that look only at the first word take the file for text. Slicers compare the size with the facet count.
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
    if a folder was named). A warning if a solid of a STEP file has no closed mesh: its overlap and print are not
    judged.
    Example: `unitcad check lid.stl prat.stl` for the file part.stl.
    Fix: Check the path and its permissions. If the message says that STEP needs an extra, install it.
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


F011 = Rule("""
    F011 error: resource limit reached
    The file asks for more bytes, faces, time or memory than the limits allow, or has too many pairs of faces that lie
    at each other, so it was not checked to its end. It never passes. Findings up to then are reported.
    Example: A mesh has 12 million faces, and --max-faces is 10 million.
    Fix: If the file is meant to be so large, raise the limit that the message names: --timeout, --max-faces or
    --memory. Limits without an option, such as 4 GB a file and 100,000 instances of a 3MF, are fixed.
""")


@dataclass(frozen=True)
class Limits:
    """Bounds on one file.

    `seconds` is wall time. `ratio` is inflated over packed size of a zip entry. `max_instances`: the most that a 3MF
    may place, counted before it is expanded.
    """

    max_faces: int = 10_000_000
    max_bytes: int = 4_000_000_000
    max_package_bytes: int = 2_000_000_000
    max_entries: int = 10_000
    max_instances: int = 100_000
    max_depth: int = 64
    ratio: float = 1000.0
    seconds: float = 600.0

    def check_faces(self, n: int) -> None:
        """Raise `Unreadable` (F011) for more faces than `max_faces`."""
        if n > self.max_faces:
            raise F011.unreadable(f"{counted(n, 'face')}, more than --max-faces {self.max_faces}")


class OutOfTime(Unreadable):
    """The time is up: no fault of the part that was being read, so nothing is concluded from it."""

    def __init__(self, seconds: float) -> None:
        super().__init__(F011.finding(f"not finished within --timeout {seconds:g} s"))
        self.seconds = seconds

    def __reduce__(self) -> tuple[type[OutOfTime], tuple[float]]:
        return OutOfTime, (self.seconds,)


class Deadline:
    """A clock that ends a check."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._end = time.monotonic() + seconds

    def tick(self) -> None:
        """Raise `OutOfTime` (F011) after the last second."""
        if time.monotonic() > self._end:
            raise OutOfTime(self.seconds)


@contextlib.contextmanager
def keeping(
    findings: Sequence[Finding] = (),
    facts: Facts | None = None,
    change: Callable[[Iterable[Finding]], Iterable[Finding]] = iter,
) -> Iterator[None]:
    """Add the earlier findings and the facts to the error that ends the check inside; `change` all of them.

    Raises `Unreadable`, with F011 if memory runs out, pairs are too many or calls nest too deeply.
    """
    try:
        yield
    except (Unreadable, TooMany, MemoryError, RecursionError) as error:
        if isinstance(error, Unreadable):
            stop = error
        elif isinstance(error, TooMany):
            stop = F011.unreadable(str(error))
        else:
            why = "out of memory (--memory)" if isinstance(error, MemoryError) else "nested too deeply"
            stop = F011.unreadable(why)
        stop.findings = tuple(change((*findings, *stop.findings)))
        if facts is not None and stop.facts == Facts():
            stop.facts = facts
        raise stop from None
