# SPDX-License-Identifier: MIT
"""Risorius' expressions use only standard controls; errors in files of expressions are reported."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from risorius import expressions
from risorius.anim.reactions import load_exclusives, load_reactions
from risorius.expressions import VISEMES, Expression, Lack

EMOTIONS = {"joy", "sadness", "anger", "fear", "disgust", "surprise"}
MORE = set(
    "blink wink_left wink_right squint smile_closed smile_open smirk kiss pout sneer yawn frown "
    "contempt doubt concentration relief pain sleepy gasp cheek_puff tongue_out".split()
)


def test_all_that_were_asked_for_are_there():
    own = expressions.load()
    by_group = {}
    for expression in own.values():
        by_group.setdefault(expression.group, set()).add(expression.name)
    assert by_group["emotion"] == EMOTIONS
    assert by_group["viseme"] == set(VISEMES)
    assert len(VISEMES) == 15
    assert by_group["face"] >= MORE
    labels = [e.label for e in own.values()]
    assert len(set(labels)) == len(labels)
    assert all(e.description.endswith(".") for e in own.values())


def test_every_name_is_a_standard_control(standard_controls):
    known = set(standard_controls)
    used = {n: c for n, e in expressions.load().items() for c in e.weights}
    used |= {r.name: c for r in load_reactions().values() for p in r.parts for c in p.weights}
    assert set(used.values()) <= known
    rules = load_exclusives()
    named = {n for y in rules.yields for n in (*y.by, *y.of)}
    assert named | {n for pair in rules.opposites for n in pair} <= known
    assert expressions.check(standard_controls) == {}


def test_expressions_differ(standard_controls):
    own = expressions.load()
    vectors = np.array([expressions.pose_vector(n, standard_controls) for n in own])
    apart = np.abs(vectors[:, None] - vectors[None]).sum(axis=2)
    assert apart[~np.eye(len(own), dtype=bool)].min() > 0.3
    assert ((vectors >= 0) & (vectors <= 1)).all()


def test_no_two_are_mistaken_for_each_other(standard_controls):
    """No two expressions have nearly proportional weights.

    Proportional weights would be one expression at two strengths.
    """
    shown = [e for e in expressions.load().values() if e.weights]
    vectors = np.array([expressions.pose_vector(e, standard_controls) for e in shown])
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    alike = vectors @ vectors.T - np.eye(len(shown))
    first, second = divmod(int(alike.argmax()), len(shown))
    # The two most similar expressions are sounds of the tongue, which also look alike on people.
    assert alike.max() < 0.91, (shown[first].name, shown[second].name)


def test_labels_are_words_of_animators_and_names_those_of_files():
    found = expressions.load()
    assert {name: found[name].label for name in ("sil", "PP", "FF", "CH", "I", "U")} == {
        **{"sil": "Rest", "PP": "M B P", "FF": "F V"},
        **{"CH": "Ch Sh", "I": "Ee", "U": "Oo"},
    }
    for expression in found.values():
        assert all(word[0].isupper() for word in expression.label.split()), expression.label
    assert len({expression.label for expression in found.values()}) == len(found)


def test_what_visemes_do_to_jaw_and_lips():
    weights = {n: e.weights for n, e in expressions.load().items() if e.group == "viseme"}

    def of(name, control):
        return weights[name].get("CTRL_expressions." + control, 0.0)

    jaw = {name: of(name, "jawOpen") for name in weights}
    assert max(jaw, key=jaw.get) == "aa"
    assert jaw["aa"] > jaw["O"] > jaw["U"]
    assert jaw["E"] > jaw["I"] > jaw["SS"]
    assert weights["sil"] == {}
    assert of("PP", "mouthPressUL") > 0
    assert of("FF", "mouthLowerLipBiteL") > 0
    assert of("U", "mouthLipsPurseUL") > of("O", "mouthLipsPurseUL") > 0
    assert of("I", "mouthCornerPullL") > of("aa", "mouthCornerPullL")


def test_pose_vector_by_hand():
    rig = ["other", "CTRL_expressions.eyeBlinkR", "CTRL_expressions.browDownL"]
    found = expressions.pose_vector("blink", rig)
    assert found.dtype == np.float32
    assert found.tolist() == np.float32([0, 1, 0.05]).tolist()
    own = Expression("x", "X", "g", "", {"other": 0.5})
    assert expressions.pose_vector(own, rig).tolist() == [0.5, 0, 0]


def test_what_a_rig_lacks():
    rig = ["CTRL_expressions.eyeBlinkL", "CTRL_expressions.browDownL", "CTRL_expressions.browDownR"]
    lack = expressions.check(rig)
    assert lack["blink"].missing == ("CTRL_expressions.eyeBlinkR",)
    assert lack["blink"].share == pytest.approx(1.1 / 2.1)
    assert "sil" not in lack
    own = {"x": Expression("x", "X", "g", "", {"a": 0.2, "b": 0.6})}
    assert expressions.check(["b"], own) == {"x": Lack(("a",), pytest.approx(0.75))}


FILE = """prefix = "P."
group = "own"
[expressions.one]
label = "One"
weights = { "lip**" = 0.5, "brow*" = 0.4, "browL" = 0.6 }
"""


def test_a_file_of_ones_own(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(FILE, encoding="utf-8")
    one = expressions.load(path)["one"]
    assert (one.label, one.group, one.description) == ("One", "own", "")
    assert one.weights == {
        **{f"P.lip{q}": 0.5 for q in ("UL", "UR", "DL", "DR")},
        "P.browL": 0.6,
        "P.browR": 0.4,
    }


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("= 0.5", "= 1.5", "one: lip.*: a weight from 0 to 1 was expected, found 1.5"),
        ("= 0.5", "= true", "found True"),
        ("= 0.5", "= 'much'", "found 'much'"),
        ("weights =", "weight =", "one: a table with weights"),
        ("label =", "titel =", "found titel"),
        ("[expressions.one]", "[one]", "a table of expressions was expected"),
        ("[expressions.one]", "[expressions.one", "a TOML file was expected"),
    ],
)
def test_refuses(tmp_path, old, new, sentence):
    path = tmp_path / "own.toml"
    path.write_text(FILE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=sentence) as error:
        expressions.load(path)
    assert str(path) in str(error.value)


def test_a_name_in_two_files_is_said_and_the_later_one_counts(tmp_path, monkeypatch):
    for file, weight in (("a.toml", 0.25), ("b.toml", 0.5)):
        (tmp_path / file).write_text(
            f"[expressions.grin]\nweights = {{jawOpen = {weight}}}\n"
            f"[expressions.{file[0]}]\nweights = {{jawOpen = 1.0}}\n"
        )
    monkeypatch.setattr(expressions, "FILES", ("a.toml", "b.toml"))
    monkeypatch.setattr(expressions.resources, "files", lambda _package: tmp_path)
    with pytest.warns(UserWarning, match=r"grin is in a\.toml and in b\.toml") as said:
        found = expressions._own.__wrapped__()
    assert len(said) == 1
    assert {name: list(e.weights.values()) for name, e in found.items()} == {
        "grin": [0.5], "a": [1.0], "b": [1.0]
    }  # fmt: skip


def test_those_that_come_along_have_each_name_once(recwarn):
    assert len(expressions._own.__wrapped__()) > 30
    assert list(recwarn) == []


def test_an_unknown_name_is_said():
    with pytest.raises(ValueError, match="joi: an expression such as joy"):
        expressions.get("joi")


SAVED = Expression(
    "big_grin",
    'Big "Grin" \u00e4\t\x7f',
    "own",
    "C:\\a \u2603.",
    {"CTRL_expressions.mouthCornerPullL": 0.3, "turn.x": -0.25, "jawOpen": 1.5},
    ("mouth", "jaw"),
)


def test_what_is_written_is_read_again(tmp_path):
    text = expressions.text_of(SAVED)
    (tmp_path / "grin.toml").write_text(text, encoding="utf-8")
    assert expressions.load(tmp_path / "grin.toml") == {"big_grin": SAVED}
    assert expressions.of_text(text) == {"big_grin": SAVED}
    table = tomllib.loads(text)  # an independent reader
    assert table["format"] == expressions.FORMAT == 1
    row = table["expressions"]["big_grin"]
    assert row["weights"] == dict(SAVED.weights)
    assert (row["label"], row["regions"]) == (SAVED.label, ["mouth", "jaw"])


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("format = 1", "format = 2", "a newer Risorius: format 1 at most was expected, found 2"),
        ("format = 1", "format = 'x'", "format: a whole number was expected, found 'x'"),
        ("format = 1", "", "a weight from 0 to 1 was expected, found -0.25"),
        ("1.5", "1.6", "jawOpen: a weight from -1 to 1.5 was expected, found 1.6"),
        ("1.5", "nan", "a weight from -1 to 1.5 was expected, found nan"),
        ('["mouth", "jaw"]', '["mout"]', r"regions such as mouth were expected, found \['mout'\]"),
        ('["mouth", "jaw"]', '"mouth"', "regions such as mouth were expected, found 'mouth'"),
    ],
)
def test_refuses_saved_ones(tmp_path, old, new, sentence):
    text = expressions.text_of(SAVED)
    assert old in text
    path = tmp_path / "grin.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=sentence) as error:
        expressions.load(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("weights", "sentence"),
    [
        ({"a": 1.6}, "big_grin: a: a weight from -1 to 1.5 was expected, found 1.6"),
        ({"a": float("nan")}, "found nan"),
        ({"a*": 0.5}, r"big_grin: a\*: a name without \*"),
    ],
)
def test_what_cannot_be_read_again_is_not_written(weights, sentence):
    with pytest.raises(ValueError, match=sentence):
        expressions.text_of(replace(SAVED, weights=weights))
