# SPDX-License-Identifier: MIT
"""Checks that translation tables contain every text that the add-on shows, and no other text."""

from __future__ import annotations

import ast
import importlib.util
import string
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[3]
ADDON = ROOT / "addon" / "risorius"
PACKAGE = ROOT / "native" / "python" / "risorius"
LANGUAGES = sorted(p.stem.partition("_")[2] for p in (ADDON / "language").glob("interface_*.toml"))
STANDARD = ROOT / "tests" / "data" / "controls" / "standard_raw.txt"
CLASSES = (
    "WorkSpaceTool",
    "Operator",
    "Panel",
    "Menu",
    "AddonPreferences",
    "FileHandler",
    "PropertyGroup",
)
# function that translates a text -> index of its argument that is the text
SENTENCES = {"say": 0, "told": 0, "mark": 0, "write": 1, "prop_or": 4}
SHOWN = {"report": 1, "poll_message_set": 0}  # Blender shows these texts unchanged

Found = dict[tuple[str, str], str]  # (context, English text) -> place in the source


def read(name: str) -> dict[str, Any]:
    return tomllib.loads((ADDON / "language" / f"{name}.toml").read_text(encoding="utf-8"))


class Reader(ast.NodeVisitor):
    """Collects the texts in a source file, and places of texts that cannot be translated."""

    def __init__(self, path: Path, only: Sequence[str] = ()) -> None:
        self.path, self.only = path, only
        self.found: Found = {}
        self.hidden: list[str] = []
        self.tree = ast.parse(path.read_text(encoding="utf-8"))
        self.values: dict[str, list[ast.expr]] = {}  # name -> the expressions assigned to it
        for node in ast.walk(self.tree):
            self.note(node)
        self.visit(self.tree)

    def note(self, node: ast.AST) -> None:
        """Record expressions that a name may have, from assignments and loops over literal rows."""
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    self.values.setdefault(target.id, []).append(node.value)
        elif isinstance(node, ast.For | ast.comprehension) and isinstance(node.target, ast.Tuple):
            rows = node.iter.elts if isinstance(node.iter, ast.Tuple) else []
            for row in rows:
                if isinstance(row, ast.Tuple):
                    for target, value in zip(node.target.elts, row.elts, strict=True):
                        if isinstance(target, ast.Name):
                            self.values.setdefault(target.id, []).append(value)

    def add(self, node: ast.expr | None, context: str, only_plain: bool = True) -> None:
        """Add to `found` all texts that an expression may evaluate to.

        Args:
            node: the expression; None: no text.
            context: context of the translation, "Risorius" or "*".
            only_plain: True: the place of an f-string is added to `hidden`; False: f-strings are
                ignored.
        """
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if any(letter.isalpha() for letter in node.value):
                self.found[context, node.value] = f"{self.path.name}:{node.lineno}"
        elif isinstance(node, ast.IfExp):
            self.add(node.body, context, only_plain)
            self.add(node.orelse, context, only_plain)
        elif isinstance(node, ast.Name):
            for value in self.values.get(node.id, ()):
                if not isinstance(value, ast.Name):
                    self.add(value, context, only_plain=False)
        elif isinstance(node, ast.JoinedStr) and only_plain:
            self.hidden.append(f"{self.path.name}:{node.lineno}")

    def add_items(self, rows: Sequence[ast.expr]) -> None:
        """Add names and descriptions of an enum's items, whatever the case of their identifiers."""
        for row in rows:
            if isinstance(row, ast.Tuple) and len(row.elts) == 3:
                self.add(row.elts[1], "Risorius")
                self.add(row.elts[2], "*")

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        bases = {ast.unparse(base).rpartition(".")[2] for base in node.bases}
        if bases & set(CLASSES) and not self.only:
            given = {
                target.id: line.value
                for line in node.body
                if isinstance(line, ast.Assign)
                for target in line.targets
                if isinstance(target, ast.Name)
            }
            self.add(given.get("bl_label"), "Risorius")
            if {"Operator", "WorkSpaceTool"} & set(bases) and "bl_idname" in given:
                told = ast.Constant(ast.get_docstring(node, clean=False), lineno=node.lineno)
                self.add(given.get("bl_description", told), "*")
        self.generic_visit(node)

    def visit_Tuple(self, node: ast.Tuple) -> None:
        """A tuple (IDENTIFIER, name, description) is an item of an enum."""
        values = [e.value for e in node.elts if isinstance(e, ast.Constant)]
        if (
            not self.only
            and len(node.elts) == len(values) == 3
            and all(isinstance(v, str) for v in values)
        ):
            first = str(values[0])
            if first.isupper() and first.isidentifier():
                self.add(node.elts[1], "Risorius")
                self.add(node.elts[2], "*")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        owner, _, name = ast.unparse(node.func).rpartition(".")
        words = {k.arg: k.value for k in node.keywords}
        if self.only and name not in self.only:
            self.generic_visit(node)
            return
        if name.endswith("Property") or name == "_still":
            self.add(words.get("name"), "Risorius")
            self.add(words.get("description"), "*")
            self.add_items(getattr(words.get("items"), "elts", ()))
        elif name in ("_choice", "_allowed"):  # of the licence: a name and items
            self.add(node.args[0], "Risorius")
            self.add_items(node.args[1:])
        elif name == "pgettext_tip":
            self.add(node.args[0], "*")
        elif name in SENTENCES and owner in ("", "words"):
            self.add(node.args[SENTENCES[name]], "Risorius")
        elif name in SHOWN:
            shown = node.args[SHOWN[name]]
            if isinstance(shown, ast.Constant | ast.JoinedStr):
                self.hidden.append(f"{self.path.name}:{node.lineno}")
        elif "text" in words:
            self.add(words["text"], "Risorius")
            plain = isinstance(words["text"], ast.Constant) and bool(words["text"].value)
            if name in ("label", "menu") and plain and "text_ctxt" not in words:
                self.hidden.append(f"{self.path.name}:{node.lineno}")
        self.generic_visit(node)


def sources() -> Iterator[Path]:
    yield from sorted((ADDON / "ui").rglob("*.py"))
    yield ADDON / "registration.py"
    yield ADDON / "scene" / "animation" / "layer_properties.py"
    yield ADDON / "scene" / "animation" / "range_properties.py"
    yield ADDON / "scene" / "speech" / "spoken_properties.py"
    yield ADDON / "scene" / "gaze" / "gaze_settings.py"


def sources_of_sentences() -> Iterator[Path]:
    """Files in which the add-on calls told(): other files show these sentences."""
    yield ADDON / "native.py"
    for folder in ("scene", "logic"):
        for path in sorted((ADDON / folder).rglob("*.py")):
            if "told(" in path.read_text(encoding="utf-8"):
                yield path


def titles_of_the_package() -> Found:
    """Titles and labels in data files of the package that the add-on shows."""
    found: Found = {}
    table = tomllib.loads((PACKAGE / "controls" / "regions.toml").read_text(encoding="utf-8"))
    found |= {("Risorius", row["title"]): "regions.toml" for row in table.values()}
    for path in [*(PACKAGE / "expressions").glob("*.toml"), PACKAGE / "anim" / "reactions.toml"]:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        if table.get("group") == "viseme":
            continue  # the labels of visemes are phonetic signs
        for row in table.get("expressions", table).values():
            if isinstance(row, dict) and "label" in row:
                found["Risorius", row["label"]] = path.name
    path = PACKAGE / "anyhead" / "landmarks" / "names.toml"
    for name, row in tomllib.loads(path.read_text(encoding="utf-8")).items():
        found["Risorius", row["words"]] = path.name
        if name.endswith("_L"):
            found["Risorius", row["words"].replace(" left ", " right ")] = path.name
    table = tomllib.loads((PACKAGE / "live" / "sources.toml").read_text(encoding="utf-8"))
    found |= {("*", row["description"]): "sources.toml" for row in table.values()}
    return found


def all_words() -> tuple[Found, list[str]]:
    found, hidden = titles_of_the_package(), []
    for path in sources():
        reader = Reader(path)
        found |= reader.found
        hidden += reader.hidden
    for path in sources_of_sentences():
        reader = Reader(path, only=("told",))
        found |= reader.found
        hidden += reader.hidden
    return found, hidden


def fields(text: str) -> list[str]:
    return sorted(name for _, name, _, _ in string.Formatter().parse(text) if name)


def test_no_word_is_hidden_from_translation() -> None:
    assert all_words()[1] == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_word_is_translated_and_none_is_stale(language: str) -> None:
    found, _hidden = all_words()
    table = read(f"interface_{language}")
    there = {(context, key) for context, rows in table.items() for key in rows}
    missing = {
        f"{where}: [{c}] {text}" for (c, text), where in found.items() if (c, text) not in there
    }
    assert not missing, "\n".join(sorted(missing))
    assert not there - set(found)


@pytest.mark.parametrize("language", LANGUAGES)
def test_translations_have_the_same_values_and_say_something(language: str) -> None:
    for rows in read(f"interface_{language}").values():
        for english, local in rows.items():
            assert fields(english) == fields(local), english
            assert local.strip() == local != ""


def test_there_is_a_second_language() -> None:
    assert LANGUAGES == ["de"]


def _tables() -> Any:
    """The add-on's module that reads translation tables, imported in a package of another name."""
    name = "risorius_addon_language"
    if name not in sys.modules:
        spec = importlib.util.spec_from_loader(name, None, is_package=True)
        assert spec is not None
        package = importlib.util.module_from_spec(spec)
        package.__path__ = [str(ADDON)]
        sys.modules[name] = package
    return importlib.import_module(f"{name}.language.tables")


def standard() -> list[str]:
    return [name.rpartition(".")[2] for name in STANDARD.read_text(encoding="utf-8").split()]


@pytest.mark.parametrize("language", ["en", *LANGUAGES])
def test_every_standard_control_is_explained(language: str) -> None:
    words = _tables().controls(language)
    assert set(words.rows) == set(standard())
    for name, row in words.rows.items():
        assert row.does.endswith("."), name
        assert len(row.does) > 20, name
        assert row.words, name
        assert all(word == word.casefold() for word in row.words), name
        assert bool(row.side) == name.endswith(("L", "R")) or "Ph" in name, name


def test_no_two_controls_are_told_the_same() -> None:
    for language in ("en", *LANGUAGES):
        words = _tables().controls(language)
        told = [words.tooltip(name) for name in words.rows]
        assert len(set(told)) == len(told)


@pytest.mark.parametrize(
    ("search", "wanted"),
    [
        ("smile", "mouthCornerPullL"), ("frown", "mouthCornerDepressL"), ("frown", "browDownL"),
        ("sneer", "noseWrinkleL"), ("kiss", "mouthLipsPurseUL"), ("pucker", "mouthLipsPurseDR"),
        ("open mouth", "jawOpen"), ("wink", "eyeBlinkR"), ("surprise", "browRaiseOuterL"),
        ("angry", "browDownR"), ("duck face", "mouthFunnelUL"), ("pout", "mouthLowerLipRollOutL"),
        ("gulp", "neckSwallowPh1"), ("puff", "mouthCheekBlowL"), ("lächeln", "mouthCornerPullR"),
        ("kussmund", "mouthLipsPurseUR"), ("stirnrunzeln", "browDownL"),
    ],
)  # fmt: skip
def test_animators_words_find_controls(search: str, wanted: str) -> None:
    known = _tables().search_words()
    assert all(word in known[wanted] for word in search.split())


def test_translations_have_a_context_of_their_own() -> None:
    found = _tables().translation("de")
    assert found["Risorius", "Face"] == "Gesicht"
    assert ("*", "Face") not in found  # a polygon, which Blender translates itself
    english = _tables().controls("en").tooltip("CTRL_expressions.jawOpen")
    assert found["*", english] == "Senkt den Unterkiefer und öffnet den Mund"


def test_locales_of_blender_lead_to_languages() -> None:
    language_of = _tables().language_of
    assert [language_of(locale) for locale in ("de_DE", "de", "de@x")] == ["de"] * 3
    assert [language_of(locale) for locale in ("", "en_US", "den_X", "DEFAULT")] == [""] * 4
