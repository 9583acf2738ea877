# SPDX-License-Identifier: MIT
"""Finds controls by typed names, and makes names for controls without one."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from .._native import Dna
from ..base.errors import RisoriusError
from . import arkit, vocabulary


class UnknownControlError(RisoriusError):
    """No control, or more than one, matches the typed text."""

    code = "unknown_control"


@dataclass(frozen=True)
class Meaning:
    """The controls that a typed name means: control -> factor of the typed value. `is_exact` is
    True if the typed name is the full name of a control."""

    controls: dict[str, float]
    is_exact: bool


def last_part(name: str) -> str:
    """The last part of a name: jawOpen of CTRL_expressions.jawOpen; a suffix in brackets stays."""
    own, bracket, rest = name.partition(" (")
    return own.rpartition(".")[2] + bracket + rest


def find_controls(text: str, names: Sequence[str]) -> Meaning:
    """Find the controls that a typed name, or a part of a name, means.

    The text is compared with, in this order: full names; the parts of names after the last dot;
    ARKit units whose controls the file has; any part of a name, then of an ARKit unit; names in
    other programs. Letter case counts for full names only; among parts after the last dot, equal
    letter case comes first. If the text is a part of two names that differ only in their side (..L
    and ..R, ..Left and ..Right), both are one meaning. The first comparison with a match decides,
    and must give exactly one meaning.

    Args:
        text: text that a user typed.
        names: names of all controls.

    Raises:
        UnknownControlError: no meaning, or several; the message lists similar or matching names.
    """
    if text in names:
        return Meaning({text: 1.0}, True)
    for candidates in _by_rank(text, names):
        if len(candidates) == 1:
            return Meaning(next(iter(candidates.values())), False)
        if candidates:
            listed = ", ".join(list(candidates)[:12])
            more = f" and {len(candidates) - 12} more" if len(candidates) > 12 else ""
            raise UnknownControlError(f"{text!r} may be any of: {listed}{more}")
    by_part = {last_part(n).lower(): n for n in names}
    near = difflib.get_close_matches(text.lower(), list(by_part), 3, 0.5)
    hint = f"; near it: {', '.join(by_part[n] for n in near)}" if near else ""
    raise UnknownControlError(f"there is no control {text!r}{hint}")


def _by_rank(text: str, names: Sequence[str]) -> Iterator[dict[str, dict[str, float]]]:
    """Yields, for each kind of match, the meanings that match the text; the best kind is first."""
    known = set(names)
    units = {u: row for u, row in arkit.mapping().items() if known.issuperset(row)}
    wanted = text.lower()
    yield {n: {n: 1.0} for n in names if last_part(n) == text}
    yield {n: {n: 1.0} for n in names if last_part(n).lower() == wanted}
    yield {u: row for u, row in units.items() if u.lower() == wanted}
    ours = {n: {n: 1.0} for n in names if wanted in n.lower()}
    yield _sides_as_one(ours, lambda n: re.sub(r"[LR]$", "?", n))
    theirs = {u: row for u, row in units.items() if wanted in u.lower()}
    yield _sides_as_one(theirs, lambda u: re.sub(r"(Left|Right)$", "?", u))
    said = vocabulary.find(text)
    if said is not None and not said.is_whole and known.issuperset(said.controls):
        yield {said.name: dict(said.controls)} if said.controls else {}


def _sides_as_one(
    meanings: dict[str, dict[str, float]], without_side: Callable[[str], str]
) -> dict[str, dict[str, float]]:
    out: dict[str, dict[str, float]] = {}
    for name, controls in meanings.items():
        out.setdefault(without_side(name), {}).update(controls)
    return out


def named(names: Sequence[str], index: int, kind: str) -> str:
    """The name of an element, or for example "joint 7" if the file has no name.

    Args:
        names: names in the file.
        index: index of the element; it may exceed the number of names.
        kind: kind of the element, e.g. "joint".
    """
    return (names[index] if index < len(names) else "") or f"{kind} {index}"


def _shapes_of_controls(dna: Dna) -> dict[int, str]:
    """Control -> name of the first blend shape channel that it drives, in brackets, with "..." if
    it drives several."""
    table, names = dna.blend_shape_channels, dna.blend_shape_channel_names
    driven: dict[int, list[int]] = {}
    for control, channel in zip(
        table.input_indices.tolist(), table.output_indices.tolist(), strict=True
    ):
        driven.setdefault(control, []).append(channel)
    return {
        control: f" ({named(names, channels[0], 'shape')}{', ...' if len(channels) > 1 else ''})"
        for control, channels in driven.items()
    }


class ControlNames:
    """Names of a file's controls, in the order: raw, correctives, networks' outputs, RBF poses.

    Attributes:
        names: the names; a corrective is called by its index and its first blend shape channel.
        psd_begin: index of the first corrective.
        psd_end: index after the last corrective, which is the first output of a network.
        ml_end: index after the last output of a network, which is the first control of a pose.
    """

    def __init__(self, dna: Dna) -> None:
        raw = dna.raw_control_names
        self.psd_begin = len(raw)
        self.psd_end = self.psd_begin + dna.psd_count
        ml = dna.machine_learned_behavior.ml_control_names
        poses = dna.rbf_behavior_ext.pose_control_names
        if (
            not poses and not dna.rbf_behavior_ext.poses
        ):  # 2.4: a pose writes the control of the same name
            poses = [p.name for p in dna.rbf_behavior.poses]
        shapes = _shapes_of_controls(dna)
        correctives = [
            f"corrective {i}{shapes.get(i, '')}" for i in range(self.psd_begin, self.psd_end)
        ]
        self.names = [*raw, *correctives, *ml, *poses]
        self.ml_end = self.psd_end + len(ml)
        parts = [last_part(n) for n in self.names]
        seen: dict[str, int] = {}
        for part in parts:
            seen[part] = seen.get(part, 0) + 1
        self._short = [
            p if p and seen[p] == 1 else n for p, n in zip(parts, self.names, strict=True)
        ]

    def name(self, index: int) -> str:
        return named(self.names, index, "control")

    def short(self, index: int) -> str:
        """The part of a control's name after the last dot if unique, otherwise the full name."""
        return named(self._short, index, "control")

    def kind(self, index: int) -> str:
        if index < self.psd_begin:
            return "raw"
        if index < self.psd_end:
            return "corrective"
        return "network" if index < self.ml_end else "pose"
