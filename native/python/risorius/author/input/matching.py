# SPDX-License-Identifier: MIT
"""Which raw control an expression of any naming is, guessed from its name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources

from ...base import toml
from ...controls import arkit

PREFIX = "CTRL_expressions."
_SIDES = {"l": "L", "left": "L", "lf": "L", "lt": "L", "r": "R", "right": "R", "rt": "R"}


@cache
def _table() -> dict[str, list[str]]:
    """Plain name -> raw controls without prefix; a "*" in them stands for the side."""
    text = resources.files(__package__).joinpath("matching.toml").read_text(encoding="utf-8")
    out: dict[str, list[str]] = {}
    for rows in toml.parse(text).values():
        out |= rows
    for unit, weights in arkit.mapping().items():
        controls = [name.removeprefix(PREFIX) for name in weights]
        out[_plain(unit)] = controls
        for name in controls:
            out.setdefault(_plain(name), [name])
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
    """The raw controls that an expression's name stands for, without prefix; [] if none is known.

    Several mean that the expression is the sum of theirs: both sides of a brow.
    """
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


def assign(names: Iterable[str], edited: Mapping[str, str | list[str]]) -> dict[str, list[str]]:
    """The raw controls of each expression; each control belongs to one expression alone.

    Args:
        names: of the expressions.
        edited: what a person says of some of them: a control's name, or several.

    Returns:
        Names of raw controls, without prefix, by expression. What nothing knows, or what another
        expression has taken, is a control of the expression's own name.
    """
    taken: set[str] = set()
    out: dict[str, list[str]] = {}
    wanted = {}
    for name in names:
        said = edited.get(name)
        wanted[name] = [said] if isinstance(said, str) else list(said) if said else guess(name)
    # What a person said comes first, then what is one control, then sums.
    for name in sorted(wanted, key=lambda n: (n not in edited, len(wanted[n]))):
        controls = [c.removeprefix(PREFIX) for c in wanted[name]]
        if not controls or taken & set(controls):
            controls = [_own(name, taken)]
        taken |= set(controls)
        out[name] = controls
    return {name: out[name] for name in wanted}


def _own(name: str, taken: set[str]) -> str:
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name) or "expression"
    number, out = 1, plain
    while out in taken:
        number += 1
        out = f"{plain}{number}"
    return out
