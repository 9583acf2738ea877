# SPDX-License-Identifier: MIT
"""Tests the translation of the package's error messages by rows with {names} of values."""

from __future__ import annotations

import importlib.util
import string
import sys
from pathlib import Path
from typing import Any

import pytest

ADDON = Path(__file__).resolve().parents[3] / "addon" / "risorius"


def language(module: str) -> Any:
    """A module of the add-on's folder language, loaded under another name."""
    name = "risorius_addon_errors"
    if name not in sys.modules:
        spec = importlib.util.spec_from_loader(name, None, is_package=True)
        assert spec is not None
        package = importlib.util.module_from_spec(spec)
        package.__path__ = [str(ADDON)]
        sys.modules[name] = package
    return importlib.import_module(f"{name}.language.{module}")


def german(message: str) -> str:
    text: str = language("errors").local(message, "de")
    return text


def test_values_go_into_the_translation() -> None:
    assert german("frame 7: a time after 2 s was expected, found 1 s") == (
        "Bild 7: eine Zeit nach 2 s wurde erwartet, gefunden: 1 s"
    )


@pytest.mark.parametrize(
    ("place", "there"),
    [
        ("take.csv", "take.csv"), ("/a b/my take.csv, line 3", "/a b/my take.csv, Zeile 3"),
        ("take.csv, row 3", "take.csv, Zeile 3"), ("C:\\x.csv: column 2", "C:\\x.csv: column 2"),
    ],
)  # fmt: skip
def test_a_place_stays_before_the_message(place: str, there: str) -> None:
    assert german(f"{place}: a timecode as 12:21:59:06.595 was expected, found x") == (
        f"{there}: ein Timecode wie 12:21:59:06.595 wurde erwartet, gefunden: x"
    )


def test_a_value_is_translated_too() -> None:
    assert german(
        "take.zip: animation was expected, this is an archive (ZIP): unpack it first"
    ) == ("take.zip: Animation wurde erwartet, dies ist ein Archiv (ZIP): packe es zuerst aus")


@pytest.mark.parametrize(
    ("note", "there"),
    [
        ("Body, skin: the left eye turns with the look controls",
         "Body, skin: das linke Auge dreht sich mit den Blickreglern"),
        ("a part of Head is left out: it lies 20 cm from the face",
         "ein Teil von Head wird weggelassen: es ist 20 cm vom Gesicht entfernt"),
        ("/a b/anna_textures: textures of Head, Teeth and Tongue",
         "/a b/anna_textures: Texturen von Head, Teeth und Tongue"),
        ("combinations: with 3 targets, 0.7 mm of jawOpen and mouthClose remain: more than 0.5 mm",
         "Kombinationen: mit 3 Morph-Targets bleiben 0.7 mm von jawOpen und mouthClose: mehr als "
         "0.5 mm"),
        ("for 5 MB: sparse targets, textures of 512 pixels, LOD 1; the file has 4.90 MB",
         "für 5 MB: dünn besetzte Morph-Targets, Texturen mit 512 Pixeln, LOD 1; die Datei hat "
         "4.90 MB"),
        ("man and woman: 1 empty cell(s) filled", "man and woman: 1 leere Zelle(n) aufgefüllt"),
    ],
)  # fmt: skip
def test_a_note_is_translated_with_its_lists_but_not_its_names(note: str, there: str) -> None:
    assert german(note) == there


def test_places_of_the_native_module_stay_behind_the_message() -> None:
    assert german(
        "a.dna: not a DNA file: it does not begin with the letters DNA; it is a picture (PNG) "
        "[signature] (byte 0)"
    ) == (
        "a.dna: keine DNA-Datei: sie beginnt nicht mit den Buchstaben DNA; es ist ein Bild (PNG) "
        "[signature] (Byte 0)"
    )


def test_of_two_rows_the_one_that_says_more_is_taken() -> None:
    known = language("tables").error_rows("de")
    assert "{range} was expected, found {found}" in known
    assert german("a.toml: x: a whole number was expected, found 'y'") == (
        "a.toml: x: eine ganze Zahl wurde erwartet, gefunden: 'y'"
    )


@pytest.mark.parametrize("message", ["", "KeyError", "such a thing: was never said", "a b: " * 300])
def test_an_unknown_message_stays(message: str) -> None:
    assert german(message) == message


def test_english_stays() -> None:
    message = "a start in seconds was expected, found x"
    assert language("errors").local(message, "") == message


@pytest.mark.parametrize("locale", language("tables").languages())
def test_each_row_translates_itself(locale: str) -> None:
    """Each {name} is replaced by NAME; the translation must contain all these values.

    So braces that are not of a value must be doubled in a row.
    """
    for english, translation in language("tables").error_rows(locale).items():
        names = [name for _, name, _, _ in string.Formatter().parse(translation) if name]
        values = {name: name.upper() for name in names}
        message = english
        for name, value in values.items():
            message = message.replace(f"{{{name}}}", value)
        found = language("errors").local(message, locale)
        assert all(value in found for value in values.values()), english
        assert found != message or translation == english, english
