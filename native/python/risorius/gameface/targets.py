# SPDX-License-Identifier: MIT
"""The morph targets that apps for glTF faces expect by name, and the rig's pose for each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import expressions
from .._native import Rig
from ..base.words import counted, joined
from ..controls import arkit, vocabulary
from .avatar.vrm import PRESETS
from .errors import GameFaceError
from .naming import safe, unlike

Floats = npt.NDArray[np.float32]

GROUPS = ("arkit", "visemes", "vrm", "expressions", "all")
_LISTED = 6


@dataclass(frozen=True)
class Target:
    """A morph target, and the pose of the rig that it shows.

    Attributes:
        name: name of the target, spelled as the app for glTF faces expects.
        group: "arkit", "visemes", "vrm", "expressions" or "all".
        raw: float32[R], raw controls of the pose.
        base: float32[R], raw controls of the pose from which displacements are measured.
        needs: name of the target that this one acts on top of, "" for none.
    """

    name: str
    group: str
    raw: Floats
    base: Floats
    needs: str = ""


def find_targets(rig: Rig, groups: Sequence[str], face: str) -> tuple[list[Target], list[str]]:
    """The targets of the requested groups, and notes on targets that are left out or approximated
    because the rig lacks controls, or renamed.

    Args:
        rig: the compiled face.
        groups: names of groups such as "arkit", in the order in which the file gets them.
        face: name of the face in errors.

    Raises:
        GameFaceError: the rig has no controls for a group.
    """
    finder = _Finder(rig)
    out, notes = list[Target](), list[str]()
    taken: set[str] = set()
    for group in groups:
        found = finder.group(group, notes, face)
        for one in found:
            name = _free(one.name, group, taken, notes)
            out.append(Target(name, group, one.raw, one.base, one.needs))
    return out, notes


def _free(name: str, group: str, taken: set[str], notes: list[str]) -> str:
    """A name that every glTF viewer accepts and that differs from all others, even in lower case.

    Unreal does not distinguish upper and lower case.
    """
    free = safe(name)
    if free != name:
        notes.append(f"{name}: no client reads such a name: the target is {free}")
    if free.lower() in taken:
        free = f"{group}_{free}"
    return unlike(free, taken)


class _Finder:
    def __init__(self, rig: Rig) -> None:
        self.names = rig.raw_control_names
        self.rest = np.asarray(rig.initial_raw_controls, np.float32)
        self.index = {name: i for i, name in enumerate(self.names)}
        for i, name in enumerate(self.names):  # faces from other programs lack the prefix
            self.index.setdefault(vocabulary.PREFIX + name.rpartition(".")[2], i)

    def group(self, group: str, notes: list[str], face: str) -> list[Target]:
        if group == "all":
            return list(self._all())
        rows = dict(_rows(group))
        absent, partly, out = list[str](), list[str](), list[Target]()
        for name, weights in rows.items():
            missing = [control for control in weights if control not in self.index]
            if weights and len(missing) == len(weights):
                absent.append(f"{name} ({_short(missing)})")
                continue
            if missing:
                partly.append(f"{name} ({_short(missing)})")
            out.append(self._target(name, group, weights))
        if not any(rows[t.name] for t in out):
            raise GameFaceError(
                f"{face}: controls for {group} were expected, such as {vocabulary.PREFIX}jawOpen; "
                f"the rig has {_some(self.names)}: --shapes all takes them as they are"
            )
        if absent:
            many = counted(len(absent), "shape")
            notes.append(f"{group}: {many} of {len(rows)} left out, the rig lacks {_some(absent)}")
        if partly:
            notes.append(f"{group}: approximated, the rig lacks controls: {_some(partly)}")
        return out

    def _target(self, name: str, group: str, weights: Mapping[str, float]) -> Target:
        raw, base, needs = self._pose(weights), self.rest, ""
        whole = _whole_of(name) if group == "arkit" else ""
        if whole:  # ARKit measures mouthClose from the open jaw
            base = self._pose(arkit.mapping()[whole])
            raw = np.maximum(raw, base)
            needs = whole
        return Target(name, group, raw, base, needs)

    def _pose(self, weights: Mapping[str, float]) -> Floats:
        raw = self.rest.copy()
        for control, weight in weights.items():
            if control in self.index:
                raw[self.index[control]] += weight
        return raw

    def _all(self) -> Iterator[Target]:
        for i, name in enumerate(self.names):
            if self.rest[i] == 0 and not name.endswith((".qx", ".qy", ".qz", ".qw")):
                raw = self.rest.copy()
                raw[i] = 1.0
                yield Target(name.removeprefix(vocabulary.PREFIX), "all", raw, self.rest)


def _whole_of(unit: str) -> str:
    """The ARKit unit that `unit` partly undoes, as mouthClose undoes jawOpen; "" for none."""
    shares = arkit.shares()
    whole = {shares[control] for control in arkit.mapping()[unit] if control in shares}
    return next((u for u, row in arkit.mapping().items() if whole & row.keys()), "")


def _rows(group: str) -> Iterator[tuple[str, Mapping[str, float]]]:
    """For each target of a group, its name, and full name of a control -> weight."""
    if group == "arkit":
        yield from arkit.mapping().items()
        return
    library = expressions.load()
    if group == "vrm":
        presets = vocabulary.vocabulary("vrm").meanings
        for name in PRESETS:
            said = presets["Neutral" if name == "neutral" else _spelled(name)]
            own = library.get(said.expression)
            yield name, own.weights if own else said.controls
        return
    for name, expression in library.items():
        if (expression.group == "viseme") == (group == "visemes"):
            yield ("viseme_" + name if group == "visemes" else name), expression.weights


def _spelled(preset: str) -> str:
    return vocabulary.vocabulary("vrm").spelled(preset) or preset


def _short(controls: Sequence[str]) -> str:
    return joined(control.removeprefix(vocabulary.PREFIX) for control in controls)


def _some(names: Sequence[str]) -> str:
    if not names:
        return "none"
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")
