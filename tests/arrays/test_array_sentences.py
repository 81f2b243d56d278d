"""The words of arrays: every sentence of the constructions' files is used, every fact given, none left in the code."""

from tests.casting import test_sentences as words

OWN = {f"say_{name}": f"arrays/constructions/{name}.toml" for name in ("back_sheet", "curved", "pockets")}
MODULE = "arrays.array_procedure"


def test_every_sentence_is_used_and_every_fact_is_given():
    found = words.used([MODULE], {**words.FILES, **OWN})
    assert found - words.every(words.FILES.values()) == words.every(OWN.values())


def test_no_sentence_is_left_in_the_code():
    assert list(words.long_texts(MODULE)) == []
