# SPDX-License-Identifier: MIT
"""Tests that each entry of words.toml is defined in only one file, and that the check can fail."""

from functools import lru_cache
from pathlib import Path

import pytest
from words import WORDS, product_files, second_definitions

ROOT = Path(__file__).resolve().parents[2]


@lru_cache
def files():
    return product_files(ROOT)


@pytest.mark.parametrize("name", WORDS)
def test_it_is_defined_once(name):
    assert second_definitions(WORDS[name], files()) == []


@pytest.mark.parametrize("name", WORDS)
def test_a_second_definition_is_found(name):
    word = WORDS[name]
    planted = "addon/risorius/logic/planted" + Path(word["home"]).suffix
    assert second_definitions(word, {**files(), planted: word["plant"]}) == [planted]
