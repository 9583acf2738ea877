# SPDX-License-Identifier: MIT
"""Guesses from a shape's name which raw controls or which expression it is."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

from ...base import toml
from ...base.words import counted
from ...controls import arkit, vocabulary
from . import said as sayings

PREFIX = vocabulary.PREFIX
WORDS, PERSON = "words", "person"  # values of Assignment.by beside names of vocabularies
_SIDES = {"l": "L", "left": "L", "lf": "L", "lt": "L", "r": "R", "right": "R", "rt": "R"}


@dataclass(frozen=True)
class Assignment:
    """The controls and expressions of a face's shapes.

    Attributes:
        controls: shape -> raw controls without prefix. A shape with an unknown name, or whose
            controls belong to another shape, gets a new control with the shape's name. A shape
            without controls is left out.
        expressions: shape -> name of an expression, for visemes and shapes of the whole face. Such
            a shape has its own control, which only the expression moves.
        known: vocabulary -> number of names that it knows; "" for words and the user's meanings.
        notes: sentences on unusual names.
        by: shape -> the source of its meaning: the name of a vocabulary, WORDS (a plain word in the
            name, such as "open"), PERSON (the user), or "" if the meaning is unknown.
    """

    controls: dict[str, list[str]]
    expressions: dict[str, str]
    known: dict[str, int]
    notes: list[str]
    by: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Guess:
    """The meaning of a name: raw controls without prefix, an expression, and a rank.

    The rank shows the source of the meaning: 0 the user, 1 ARKit or the head's main vocabulary,
    2 another vocabulary, 3 a plain word in the name such as "open", 4 none.
    """

    controls: tuple[str, ...] = ()
    expression: str = ""
    rank: int = 4
    vocabulary: str = ""

    @property
    def by(self) -> str:
        """The source of the meaning: the name of a vocabulary, WORDS (a plain word in the name,
        such as "open"), PERSON (the user), or "" if the meaning is unknown."""
        return {0: PERSON, 3: WORDS}.get(self.rank, self.vocabulary)

    @property
    def is_left_out(self) -> bool:
        """Whether the user chose to leave the shape out."""
        return self.rank == 0 and not self.controls and not self.expression


@cache
def _table() -> dict[str, list[str]]:
    """Plain word -> raw controls without prefix; "*" in a control is replaced by the side."""
    text = resources.files(__package__).joinpath("matching.toml").read_text(encoding="utf-8")
    out: dict[str, list[str]] = {}
    for rows in toml.parse(text).values():
        out |= rows
    for unit, weights in arkit.mapping().items():  # for other orders, such as Left_MouthSmile
        out.setdefault(_plain(unit), [name.removeprefix(PREFIX) for name in weights])
    return out


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _parts(name: str) -> tuple[str, str]:
    """The plain name without its side, and "L", "R" or ""."""
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+", name)
    side = ""
    for at in (len(words) - 1, 0):
        if words and words[at].lower() in _SIDES and not side:
            side = _SIDES[words.pop(at).lower()]
    return _plain("".join(words)), side


def guess(name: str) -> list[str]:
    """The raw controls, without prefix, that a name means; [] for an unknown name.

    Several controls mean that the expression is their sum, for example both sides of a brow.
    """
    return list(_guess(name, None).controls)


def _guess(name: str, order: Sequence[str] | None) -> _Guess:
    """The meaning of a name. Args: order: names of vocabularies, see vocabulary.find()."""
    said = vocabulary.find(name, order)
    words = tuple(_by_words(vocabulary.parts_of(name)[-1]))
    if said is None:
        return _Guess(words, "", 3) if words else _Guess()
    meant = tuple(control.removeprefix(PREFIX) for control in said.controls)
    is_theirs = said.vocabulary in (vocabulary.ARKIT, *(order or ())[:1])
    if words and not is_theirs:  # for example, mouthOpen means jawOpen outside its vocabulary
        return _Guess(words, said.expression if words == meant else "", 3)
    rank = 1 if is_theirs else 2
    return _Guess(() if said.is_whole else meant, said.expression, rank, said.vocabulary)


def _by_words(name: str) -> list[str]:
    table = _table()
    whole = table.get(_plain(name))
    if whole and not any("*" in control for control in whole):
        return list(whole)
    plain, side = _parts(name)
    found = table.get(plain) or whole or []
    sides = [side] if side else ["L", "R"]
    if side and found and not any("*" in control for control in found):
        sided = [control for control in found if control.endswith(side)]
        return sided if len(found) > 1 else []
    return list(dict.fromkeys(c.replace("*", s) for c in found for s in sides))


def assign(names: Iterable[str], edited: Mapping[str, sayings.Said]) -> Assignment:
    """Assign raw controls to shapes. Each control belongs to one shape only.

    The user's meanings come first, then names of a vocabulary, then words (mouthOpen for jawOpen).
    Within each of these three groups, shapes with a single control come before sums of controls.

    Args:
        names: names of the shapes.
        edited: shape -> the user's meaning, in the notation that the module `said` describes.

    Raises:
        GivenError: a meaning of the user is invalid.
    """
    names = list(names)
    order = vocabulary.leading(names)
    guesses = {name: _said(edited[name]) if name in edited else _guess(name, order)
               for name in names}  # fmt: skip
    holders: dict[str, str] = {}
    out = Assignment({name: [] for name in names}, {}, {}, [])
    for name in sorted(names, key=lambda n: (guesses[n].rank, len(guesses[n].controls))):
        found = guesses[name]
        if found.is_left_out:
            continue
        holder = next((holders[c] for c in found.controls if c in holders), None)
        controls = list(found.controls)
        if not controls or holder is not None:
            controls = [_own(name, found.expression, holders)]
            if found.expression:
                out.expressions[name] = _free(found.expression, name, out.expressions)
            elif holder is not None:
                out.notes.append(_twice(name, holder, found.controls, controls[0]))
        out.controls[name] = controls
        holders |= dict.fromkeys(controls, name)
    for name, found in guesses.items():
        out.by[name] = found.by
        if found.rank < _Guess.rank:
            out.known[found.vocabulary] = out.known.get(found.vocabulary, 0) + 1
    out.notes.extend(_about(names, guesses))
    return out


def _said(value: sayings.Said) -> _Guess:
    return _Guess(*sayings.meaning_of(value), 0)


def _twice(name: str, holder: str, controls: Sequence[str], own: str) -> str:
    meant = " and ".join(controls[:2]) + (" and more" if len(controls) > 2 else "")
    own = f"{name} becomes a control of its own, {own}; [controls] may say otherwise"
    return (
        f"{holder} and {name} both mean {meant} (their letters are the same): {own}"
        if name.lower() == holder.lower()
        else f"{holder} and {name} both mean {meant}: {own}"
    )


def _about(names: Sequence[str], guesses: Mapping[str, _Guess]) -> list[str]:
    """A note if no name is known, or if only names of expressions and visemes are known."""
    if not names:
        return []
    ranks = [guesses[name].rank for name in names]
    if min(ranks) == _Guess.rank:
        some = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
        return [
            f"no name is known of {counted(len(names), 'shape')} ({some}): each becomes a control "
            "of its own name, which no capture moves; [controls] may say which they are"
        ]
    meant = [guesses[name] for name in names if guesses[name].rank < _Guess.rank]
    if all(found.expression for found in meant):
        return [
            f"the {counted(len(meant), 'name')} known are of expressions and visemes: speech and "
            "expressions move this face, a capture of ARKit's units does not"
        ]
    return []


def own_control(name: str) -> str:
    """Name of the new control that a shape of unknown meaning gets, if this name is free."""
    return _own(name, "", ())


def _own(name: str, expression: str, taken: Container[str]) -> str:
    """An unused control name of ASCII letters, digits and _, made from a shape's name.

    Args:
        name: name of the shape.
        expression: name that is used if the shape's name has no letter or digit; "": shape.
        taken: names in use.
    """
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return _numbered(plain if plain.strip("_") else expression or "shape", taken)


def _free(expression: str, name: str, taken: Mapping[str, str]) -> str:
    """The expression's name, or a name from the shape if another shape has the expression.

    Upper and lower case count as equal, because names become files.

    Args:
        expression: name of the expression.
        name: name of the shape.
        taken: shape -> its expression, for the shapes that have one already.
    """
    used = {found.casefold() for found in taken.values()}
    if expression.casefold() not in used:
        return expression
    return _numbered(re.sub(r"\W", "_", name), used, str.casefold)


def _numbered(plain: str, taken: Container[str], as_taken: Callable[[str], str] = str) -> str:
    number, out = 1, plain
    while as_taken(out) in taken:
        number += 1
        out = f"{plain}{number}"
    return out
