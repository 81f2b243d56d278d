"""Words that read badly are counted, by folder: a count may fall, and then the table falls with it; it may not rise.

`python tests/test_words.py` writes the table anew.
"""

import ast
import re
import tomllib
from collections import defaultdict
from pathlib import Path

import tomli_w

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_name("words.toml")
PATTERNS = {
    "what": r"\bwhat\b",
    "where": r"\bwhere\b",
    "beside": r"\bbeside\b",
    "stand, lie, hold": r"\b(?:stands?|lies|lie|holds?)\b",
    "sentence that begins with Of": r"(?:^|(?<=[.!?] ))Of\b",
}
LONG = 25
"""Words of a sentence, at most."""
LIMIT = 25_000
"""Words of the pages that people write, without code, at most."""


def _strings(source):
    """Return all strings of three words or more in a module, docstrings included."""
    nodes = ast.walk(ast.parse(source))
    found = (node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return "\n\n".join(text for text in found if len(text.split()) >= 3)


def _prose(markdown):
    """Return a page's text without code and tables."""
    return re.sub(r"(?m)^\|.*$", "", re.sub(r"(?s)```.*?```", "", markdown))


def _folders():
    """Return the text of each file by folder and name."""
    texts = defaultdict(dict)
    for path in sorted((ROOT / "unitcad").rglob("*.py")):
        parts = path.relative_to(ROOT / "unitcad").parts
        texts[f"unitcad/{parts[0]}" if len(parts) > 1 else "unitcad"]["/".join(parts)] = _strings(
            path.read_text("utf-8")
        )
    for path in sorted((ROOT / "docs").rglob("*.md")):
        if path.parent.name != "accuracy":  # written by the studies
            texts["docs"][str(path.relative_to(ROOT / "docs"))] = _prose(path.read_text("utf-8"))
    return texts


def _found():
    """Return the sentences of each pattern, and the long ones, after their file's name, by folder."""
    table = {}
    for folder, texts in _folders().items():
        row = table[folder] = {pattern: [] for pattern in (*PATTERNS, "long sentences")}
        for name, text in texts.items():
            for sentence in re.split(r"(?<=[.!?])\s+|\n\n", text):
                place = f"{name}: {' '.join(sentence.split())}"
                for pattern, regex in PATTERNS.items():
                    row[pattern] += [place] * len(re.findall(regex, sentence))
                row["long sentences"] += [place] * (len(sentence.split()) > LONG)
    return table


def counts():
    """Return the count of each pattern, and of long sentences, by folder."""
    return {folder: {pattern: len(places) for pattern, places in row.items()} for folder, row in _found().items()}


def test_bad_words_do_not_increase():
    limits = tomllib.loads(TABLE.read_text("utf-8"))
    more = {
        f"{folder}: {pattern}: {len(places)}, at most {limits.get(folder, {}).get(pattern, 0)}": places
        for folder, row in _found().items()
        for pattern, places in row.items()
        if len(places) > limits.get(folder, {}).get(pattern, 0)
    }
    assert more == {}


def test_the_docs_stay_short():
    pages = [path.read_text("utf-8") for path in (ROOT / "docs").rglob("*.md") if "evidence" not in path.parts]
    assert sum(len(re.sub(r"(?s)```.*?```", "", page).split()) for page in pages) <= LIMIT


if __name__ == "__main__":
    TABLE.write_text(tomli_w.dumps(counts()), "utf-8")
