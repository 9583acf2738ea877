# SPDX-License-Identifier: MIT
"""Tests that labels of the add-on use title case, and that each thing has one German name."""

import re
from pathlib import Path

import pytest

ADDON = Path(__file__).resolve().parents[2] / "addon" / "risorius"
SMALL = {*"a an and as at but by for from in into nor of on or over per the to with".split()}
LABEL = re.compile(
    r"(?:Mode\(words\.say|words\.show\([^\"]{1,40}say|text=words\.say|bl_label = |heading=|"
    r'[( ]text=|status\.\w+, words\.say)\(?"([^"]+)"'
)
# Correct German term -> term that the translation table must not contain.
NAMES = {"Tafel": "Brett", "Regler": "Schieberegler"}


def lower_words(text):
    """(word, label) of each word in a label that begins with a small letter but must not.

    The first word of a label, words in brackets and the words in SMALL may begin with a small
    letter.
    """
    for label in LABEL.findall(text):
        bare = re.sub(r"\([^)]*\)", "", label)
        if "{" in label or label.endswith((".", "?", ":", "…")):
            continue  # a sentence or a text with a number is no label
        for word in re.findall(r"[A-Za-z][A-Za-z'-]*", bare)[1:]:
            if word[0].islower() and word not in SMALL:
                yield word, label


def test_labels_are_in_title_case():
    found = {
        f"{path.name}: {label}"
        for path in (ADDON / "ui").rglob("*.py")
        for _word, label in lower_words(path.read_text("utf-8"))
    }
    assert found == set()
    assert [*lower_words('words.show(row, words.say("First steps"), "LIGHT")')]


@pytest.mark.parametrize(("name", "other"), NAMES.items())
def test_one_thing_has_one_name_in_german(name, other):
    text = (ADDON / "language" / "interface_de.toml").read_text("utf-8")
    assert name in text
    assert other not in text
