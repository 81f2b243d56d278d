"""docs/evidence/check-peers.md: our verdicts, computed now, beside the frozen ones. `python table.py` writes it."""

import json
from collections import Counter
from pathlib import Path

from unitcad.meshcheck import Options, check_file

HERE = Path(__file__).parent
CORPUS = HERE.parent.parent / "corpus"
PAGE = HERE.parent.parent.parent / "docs" / "evidence" / "check-peers.md"
PEERS = ("trimesh", "admesh", "lib3mf", "PrusaSlicer")
ASCII = "lib3mf reads binary STL only."
ZEROS = "admesh recomputes every normal, since the stored ones are no unit vectors; the vertices stay."
WHY = {
    "stl_ascii/Cube.stl": ASCII,
    "stl_ascii/HalfDonut.stl": f"PrusaSlicer does not know keywords in capitals, which STL allows. {ZEROS} {ASCII}",
    "stl_ascii/Moon.stl": f"{ZEROS} {ASCII}",
    "stl_ascii/Moon_Chinese.stl": f"The name is UTF-8, and no reader minds. {ZEROS} {ASCII}",
    "stl_ascii/Star.stl": f"{ZEROS} {ASCII}",
    "stl_binary/HalfDonut.stl": (
        "One byte follows the last facet: trimesh, admesh and PrusaSlicer refuse the size, lib3mf reads the count. "
        "Nothing is lost, so it is a warning."
    ),
    "stl_binary/Moon.stl": ZEROS,
    "stl_binary/Star.stl": ZEROS,
    "stl_binary/StarWithEmptyHeader.stl": ZEROS,
    "stl_binary/rear_case.stl": (
        "Faces cross in 23 places, 0.005 mm deep at most. pymeshlab selects 27 of its faces; these four do not look."
    ),
    "stl_tests/bwb.stl": f"Every stored normal is wrong by more than 15 degrees: a warning here. {ZEROS} {ASCII}",
    "stl_tests/dos.stl": f"{ZEROS} {ASCII}",
    "stl_tests/unix.stl": f"{ZEROS} {ASCII}",
}


def frozen():
    """The peers' verdicts by path inside the corpus."""
    return json.loads((HERE / "verdicts.json").read_text("utf-8"))


def ours(path):
    """Our report on a file of the corpus; the consortium's samples are held to the letter (`--3mf-strict`)."""
    return check_file(CORPUS / path, Options(strict_3mf=path.startswith("3mf-samples/")))


def disagrees(verdict, peers):
    """Whether a peer that reads the format accepts what we refuse, or the other way round."""
    accepted = verdict != "error"
    return any((said == "pass") != accepted for said in peers.values() if said != "-")


def _verdict(report):
    codes = ", ".join(finding.code for finding in report.findings)
    return report.verdict + (f" ({codes})" if codes else "")


def page():
    """The page."""
    lines = [
        "# `unitcad check` and other programs",
        "",
        "Verdicts on the files of numpy-stl (`tests/corpus`). `altered`: the program reads the file and changes it, or",
        "calls it in need of repair. A test computes the column unitcad. The other columns are stored in",
        "`tests/meshcheck/peers/verdicts.json`: trimesh 5.2, admesh 0.98.4, lib3mf 2.5.0, PrusaSlicer 2.5.0.",
        "",
        "| file | unitcad | " + " | ".join(PEERS) + " | why they differ |",
        "| --- " * (len(PEERS) + 3) + "|",
    ]
    known = frozen()
    for path, peers in known.items():
        if not path.startswith("numpy-stl/"):
            continue
        name = path.removeprefix("numpy-stl/")
        said = " | ".join(peers[peer] for peer in PEERS)
        lines.append(f"| {name} | {_verdict(ours(path))} | {said} | {WHY.get(name, '')} |")
    lines += ["", "3MF files as programs write them (`tests/corpus/programs`):", ""]
    lines += ["| file | unitcad | lib3mf | PrusaSlicer |", "| --- " * 4 + "|"]
    for path, peers in known.items():
        if path.startswith("programs/"):
            verdicts = f"{_verdict(ours(path))} | {peers['lib3mf']} | {peers['PrusaSlicer']}"
            lines.append(f"| {path.removeprefix('programs/')} | {verdicts} |")
    lines += ["", "lib3mf refuses PrusaSlicer's files for their missing thumbnail, which is a warning here (P002)."]
    lines += ["", "The 3MF consortium's samples with `--3mf-strict`, files that must fail and must pass:", ""]
    lines += ["| | must fail: refused | must pass: accepted |", "| --- | --- | --- |"]
    for peer in ("unitcad", "lib3mf", "PrusaSlicer"):
        counts = Counter()
        for path, peers in known.items():
            if path.startswith("3mf-samples/"):
                verdict = ours(path).verdict if peer == "unitcad" else peers[peer]
                refused = verdict in ("error", "fail", "hang")
                counts["fail" if "MUSTFAIL" in path else "pass"] += refused == ("MUSTFAIL" in path)
        lines.append(f"| {peer} | {counts['fail']} of 38 | {counts['pass']} of 13 |")
    lines += [
        "",
        "Two of these samples contradict each other: an unknown metadata name without prefix must pass as `MustIgnore`",
        "and fail as `Undefined`. unitcad accepts unknown names; `undefined` and `null` count as no name.",
        "",
        "unitcad deviates from the letter in three cases. Self-crossing and overlapping shells (G001, G002) are",
        "warnings in a 3MF file, since the core specification (4.1) tells consumers to accept them. A multiproperties",
        "group that names a texture is a warning, since MUSTPASS files have it. Vertices that close the mesh only by",
        "their place (T006) are a warning, as in any format.",
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
