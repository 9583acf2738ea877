# SPDX-License-Identifier: MIT
"""Tests the add-on's session registry: events, and the entries that each event removes."""

from __future__ import annotations

import importlib.util
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from weakref import WeakKeyDictionary

import pytest

ADDON = Path(__file__).resolve().parents[3] / "addon" / "risorius"


@pytest.fixture
def session():
    """A newly loaded session module with an empty registry."""
    spec = importlib.util.spec_from_file_location(
        "session", ADDON / "scene" / "base" / "session.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@dataclass
class Record:
    count: int = 0
    name: str = ""


class Key:
    pass


def test_a_table_ends_with_its_words_and_stays_the_same(session):
    table = session.table("faces", ("undo", "load"))
    for word, left in (("frame", 1), ("free", 1), ("undo", 0), ("load", 0), ("unregister", 0)):
        table[7] = "face"
        session.end(word)
        assert len(table) == left, word
    assert session.keep("faces", dict, ("load",)) is not table
    assert session.ends_of("faces") == ("load", "unregister")


@pytest.mark.parametrize(
    ("make", "change", "start"),
    [
        (dict, lambda kept: kept.update(a=1), {}),
        (set, lambda kept: kept.add(1), set()),
        (list, lambda kept: kept.append(1), []),
        (lambda: {"a": 0, "b": 1}, lambda kept: kept.update(a=2, c=3), {"a": 0, "b": 1}),
        (lambda: {1, 2}, lambda kept: kept.add(3), {1, 2}),
        (lambda: deque([0], maxlen=3), lambda kept: kept.extend((1, 2, 3)), deque([0])),
        (Record, lambda kept: vars(kept).update(count=3, other=4), Record()),
    ],
)
def test_every_kind_begins_anew_in_place(session, make, change, start):
    kept = session.keep("kind", make, ("load",))
    assert kept == start
    assert session.held() == []
    change(kept)
    assert kept != start
    assert session.held() == ["kind"]
    session.end("load")
    assert kept == start
    assert session.held() == []


def test_weak_keys_are_kept_and_let_go(session):
    kept, key = session.keep("weak", WeakKeyDictionary, ("unregister",)), Key()
    kept[key] = 1
    assert session.held() == ["weak"]
    session.end("unregister")
    assert session.held() == []
    assert list(kept) == []


def test_a_value_is_as_at_the_beginning(session):
    slot = session.value("edited", True, ("undo",))
    slot.now = False
    assert session.held() == ["edited"]
    session.end("undo")
    assert slot.now is True
    assert session.held() == []


def test_results_of_a_function_are_let_go(session):
    calls = []

    @session.cached(("load",), most=2)
    def double(number):
        calls.append(number)
        return 2 * number

    assert [double(n) for n in (1, 1, 2, 3, 1)] == [2, 2, 4, 6, 2]
    assert calls == [1, 2, 3, 1]
    assert len(session.held()) == 1
    session.end("load")
    assert session.held() == []
    assert double(1) == 2
    assert len(calls) == 5


def test_what_is_given_back_is_given_back_at_its_words(session):
    given = []
    session.at("free", "load")(lambda: given.append(1))
    for word in ("free", "undo", "load", "unregister"):
        session.end(word)
    assert len(given) == 3


def test_only_work_of_the_user_outlives_the_registration(session):
    kept = session.keep("recordings", list, ("quit",))
    kept.append("take")
    session.end("unregister")
    assert kept == ["take"]


@pytest.mark.parametrize("ends", [(), ("undo", "sometimes")])
def test_an_entry_says_when_it_ends(session, ends):
    with pytest.raises(ValueError, match="ends"):
        session.table("faces", ends)
