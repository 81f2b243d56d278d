"""The words of casting: every sentence of the files is used, every fact is given, and none is left in the code."""

import ast
import inspect
from importlib import import_module
from string import Formatter

import pytest

from unitcad.casting import sentences as words
from unitcad.casting.sentences import sentences, written
from unitcad.casting.troubles import Trouble
from unitcad.errors import UnitcadError

FILES = {"say": "casting/procedure.toml"}
"""File of words by the name that writes them."""
MODULES = ("casting.preparation", "casting.resin", "casting.pouring", "casting.troubles")
LONGEST = 40
"""Characters of a text in the code: a title or a fact, no sentence."""


def tree(module):
    return ast.parse(inspect.getsource(import_module(f"unitcad.{module}")))


def facts_in(file, name):
    return {field for _, field, _, _ in Formatter().parse(sentences(file)[name]) if field}


def values_of(name, function):
    """The values that a function gives a variable."""
    for node in ast.walk(function):
        for target in node.targets if isinstance(node, ast.Assign) else ():
            both = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
            for each, value in zip(target.elts, node.value.elts, strict=True) if both else [(target, node.value)]:
                if any(isinstance(part, ast.Name) and part.id == name for part in ast.walk(each)):
                    yield value


def texts_of(node, function):
    """The texts that an argument may be: its own, and those of the variables in it."""
    held = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
    nodes = [node, *(value for name in held for value in values_of(name, function))]
    parts = (part for each in nodes for part in ast.walk(each))
    return {part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str)}


def used(modules, files):
    """Each sentence that modules may write, as file and name; every call must give the facts of its sentences."""
    found = set()
    for module in modules:
        for function in tree(module).body:
            for call in ast.walk(function):
                if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in files:
                    file, given = files[call.func.id], {each.arg for each in call.keywords}
                    named = set().union(*(texts_of(each, function) for each in call.args)) & sentences(file).keys()
                    assert given == set().union(*(facts_in(file, name) for name in named)), f"{module}:{call.lineno}"
                    found |= {(file, name) for name in named}
    return found


def every(files):
    return {(file, name) for file in files for name in sentences(file)}


def test_every_sentence_is_used_and_every_fact_is_given():
    known = next(each.value for each in tree("casting.troubles").body if isinstance(each, ast.AnnAssign))
    troubles = {(FILES["say"], f"{key.value}.{part}") for key in known.keys for part in Trouble.__dataclass_fields__}
    assert used(MODULES, FILES) | troubles == every(FILES.values())


def long_texts(module):
    """The texts in a module that are longer than a title or a fact, but for docstrings."""
    found = tree(module)
    docs = {id(each.value) for each in ast.walk(found) if isinstance(each, ast.Expr)}
    for node in ast.walk(found):
        if isinstance(node, ast.JoinedStr):
            text = "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            text = node.value
        else:
            continue
        if len(text) > LONGEST:
            yield text


@pytest.mark.parametrize("module", MODULES)
def test_no_sentence_is_left_in_the_code(module):
    assert list(long_texts(module)) == []


def test_a_line_break_is_a_space_and_a_fault_is_told(monkeypatch):
    text = {"step.one": "Cut {count} pieces."}
    monkeypatch.setattr(words, "sentences", lambda _: text)
    assert written("own.toml", "step.one", "", count=2) == "Cut 2 pieces."
    with pytest.raises(UnitcadError, match=r"own.toml: has no sentence step.two"):
        written("own.toml", "step.two")
    for changed in ("Cut {number} pieces.", "Cut {} pieces.", "Cut {count pieces."):
        text["step.one"] = changed
        with pytest.raises(UnitcadError, match=r"own.toml: step.one: .*facts of this step: \{count\}"):
            written("own.toml", "step.one", count=2)
    assert "\n" not in sentences("casting/procedure.toml")["filament.push"]
