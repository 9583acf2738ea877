# SPDX-License-Identifier: MIT
"""Mappings from a file's curves to controls, as TOML that users can edit and share."""

from __future__ import annotations

import fnmatch
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from collections.abc import Mapping as Table
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import expressions
from ..anim.clip import Clip
from ..base import toml
from ..base.budget import Budget
from ..base.given import GivenError, finite, flag, shown
from ..base.reading import ReadingError
from ..controls import arkit, vocabulary
from ..controls.regions import expand_sides
from ..controls.shares import share_of
from ..controls.vocabulary import ARKIT, Meaning, loose_name, parts_of
from .errors import AnimationFileError

Doubles = npt.NDArray[np.float64]
Row = dict[str, float]

# Curves with angles of the head and neck in radians; ANGLES also has the eyes' angles. These curves
# rotate bones and are not controls of the rig.
HEAD_ANGLES = ("head.yaw", "head.pitch", "head.roll", "neck.yaw", "neck.pitch", "neck.roll")
ANGLES = (*HEAD_ANGLES, "eyeL.yaw", "eyeL.pitch", "eyeR.yaw", "eyeR.pitch")
_KEYS = {
    "name", "description", "base", "prefix", "strip", "matching", "gui", "ignore", "rows",
    "shares", "controls", "metadata",
}  # fmt: skip
VOWELS = "AIUEO"
_WITH_UNITS = (ARKIT, "vrm")
_OLD_BASES = {"arkit units": "vocabulary arkit", "vrm expressions": "vocabulary vrm"}
_PATTERN_STEPS = 50  # budget steps per comparison of a pattern with a name
# A clip is taken as keyframed, not captured, if the median time between its frames is above _KEYED
# seconds. Then frames are added between its keyframes, every _STEP seconds, at most _MOST_STEPS per
# gap.
_KEYED, _STEP, _MOST_STEPS = 0.1, 1 / 24, 64


class MappingError(AnimationFileError):
    """A mapping that cannot be read, or is inconsistent."""


@dataclass(frozen=True)
class Adjustment:
    """Changes the curve of a control to offset + gain * curve(value).

    Attributes:
        points: points (value, result) of `curve` by ascending value; linear between them, constant
            outside. Empty: curve(value) is the value itself.
    """

    gain: float = 1.0
    offset: float = 0.0
    points: tuple[tuple[float, float], ...] = ()

    def apply(self, values: Doubles) -> Doubles:
        if self.points:
            x, y = np.array(self.points).T
            values = np.interp(values, x, y)
        return self.offset + self.gain * values


@dataclass(frozen=True)
class Mapping:
    """A mapping from curve names to controls, in which all names are written in full.

    Attributes:
        name: name of the file, without suffix.
        description: a sentence.
        rows: curve of the source -> {control: weight}. * in a name matches any text; * in its
            controls is replaced by that text. An empty row ignores the curve.
        shares: control A -> control B of which A takes back a share: the value that the rows give A
            is divided by the value of B (controls.shares.share_of). A is left unchanged if no curve
            moves B.
        controls: pattern of control names -> adjustment; the last match counts.
        strip: prefixes that are removed from curve names.
        vocabulary: name in controls.vocabulary; its other spellings are accepted too.
        is_loose: whether names match regardless of letter case, "_" and Left or L at the end.
        is_gui: whether the controls are GUI controls, which the rig's table converts to raw ones.
        metadata: any text; copied to the clip.
    """

    name: str
    description: str = ""
    rows: Table[str, Row] = field(default_factory=dict)
    shares: Table[str, str] = field(default_factory=dict)
    controls: Table[str, Adjustment] = field(default_factory=dict)
    strip: tuple[str, ...] = ()
    vocabulary: str = ""
    is_loose: bool = True
    is_gui: bool = False
    metadata: Table[str, str] = field(default_factory=dict)

    def targets(self) -> tuple[str, ...]:
        """All controls of the rows, in order; patterns with * are not expanded."""
        return tuple(dict.fromkeys(control for row in self.rows.values() for control in row))

    def finder(self) -> Callable[[str], tuple[str, Row] | None]:
        """A function from a curve's name to (key, {control: weight}), or None.

        The key is the name of the row or, if the row's name is a pattern, the spelling of the
        curve's name that the pattern matches.
        """
        exact = {loose_name(key) if self.is_loose else key: key for key in self.rows}
        exact.pop("", None)  # names without letters are all equal here
        patterns = [key for key in self.rows if "*" in key]

        def find(name: str) -> tuple[str, Row] | None:
            for candidate in self._spellings(name):
                if candidate in self.rows and "*" not in candidate:
                    return candidate, self.rows[candidate]
                key = exact.get(loose_name(candidate) if self.is_loose else candidate)
                if key is not None and "*" not in key:
                    return key, self.rows[key]
                for pattern in patterns:
                    part = _star(pattern, candidate)
                    if part is not None:
                        row = self.rows[pattern]
                        return candidate, {k.replace("*", part): w for k, w in row.items()}
            return None

        return find

    def _spellings(self, name: str) -> Iterator[str]:
        """The spellings under which a name is searched.

        The spellings are the name itself, the name without known prefixes, the name without a
        mesh's name before it (if names match loosely), and the vocabulary's spelling.
        """
        yield name
        for start in self.strip:
            if name.lower().startswith(start.lower()) and len(name) > len(start):
                yield name[len(start) :]
        if self.is_loose:
            yield from parts_of(name)
        if self.vocabulary:
            spelled = vocabulary.vocabulary(self.vocabulary).spelled(name)
            if spelled is not None:
                yield spelled

    def adjustment(self, control: str) -> Adjustment | None:
        """The last adjustment whose pattern matches a control, or None."""
        last = None
        for pattern, what in self.controls.items():
            if fits(control, pattern):
                last = what
        return last


@dataclass
class Mapped:
    """A mapped clip, the controls that each source curve moves, and the curves not used.

    Attributes:
        clip: curves of controls.
        mapped: curve of the source -> controls that it moves.
        unmapped: curves of the source that the mapping does not know.
        ignored: curves of the source with an empty row, or whose row another curve has used.
        absent: names of rows, other than patterns and empty rows, without a curve in the source.
        notes: sentences for the user about curves that are left out.
    """

    clip: Clip
    mapped: dict[str, tuple[str, ...]]
    unmapped: list[str]
    ignored: list[str]
    absent: list[str]
    notes: list[str]


def apply_rows(mapping: Mapping, clip: Clip) -> Mapped:
    """Applies a mapping to a clip of a file's curves; the result has curves of controls.

    Weighted curves for the same control are summed. If several curves match one row, only the first
    is used, and the others are listed as ignored. A control that is a share of another control is
    divided by the other control, then adjusted. Values stay bitwise equal if one curve moves a
    control with weight 1, without share or adjustment.

    Args:
        mapping: the mapping.
        clip: curves with the file's own names.

    Raises:
        BudgetError: too many controls or patterns for the size of the clip.
    """
    budget, place = Budget.of(clip.curves.nbytes), f"mapping {mapping.name}"
    patterns = sum("*" in key for key in mapping.rows) * (1 + len(mapping.strip))
    budget.work(len(clip.names) * patterns * _PATTERN_STEPS, f"{place}: {patterns} patterns")
    find = mapping.finder()
    sums: dict[str, Doubles] = {}
    out = Mapped(clip, {}, [], [], [], [])
    used: dict[str, str] = {}
    for name, curve in zip(clip.names, clip.curves, strict=True):
        found = find(name)
        if found is None:
            out.unmapped.append(name)
            continue
        key, row = found
        if key in used:
            out.notes.append(f"{name} is {used[key]} again, left out")
            out.ignored.append(name)
            continue
        used[key] = name
        if not row:
            out.ignored.append(name)
            continue
        out.mapped[name] = tuple(row)
        for control, weight in row.items():
            if control not in sums:
                budget.hold(12 * clip.frame_count, f"{place}: {len(sums) + 1} controls")
            budget.work(clip.frame_count + 1, f"{place}: {len(sums) + 1} controls")
            part = weight * curve.astype(np.float64)
            sums[control] = sums[control] + part if control in sums else part
    out.absent = [
        key for key, row in mapping.rows.items() if key not in used and row and "*" not in key
    ]
    adjustments = len(sums) * len(mapping.controls)
    budget.work(adjustments * _PATTERN_STEPS, f"{place}: {len(mapping.controls)} in controls")
    clip, sums = _divided(mapping, clip, sums, budget)
    curves = np.zeros((len(sums), clip.frame_count), np.float32)
    for i, (control, values) in enumerate(sums.items()):
        what = mapping.adjustment(control)
        curves[i] = values if what is None else what.apply(values)
    out.clip = clip.replaced(
        names=tuple(sums), curves=curves, metadata={**clip.metadata, **mapping.metadata}
    )
    return out


def _divided(
    mapping: Mapping, clip: Clip, sums: dict[str, Doubles], budget: Budget
) -> tuple[Clip, dict[str, Doubles]]:
    """Divides each control of `mapping.shares` by the control of which it takes back a share.

    The clip gets more frames if its keyframes are far apart, because a quotient of linear curves is
    not linear between keyframes.

    Args:
        mapping: the mapping with the shares.
        clip: the clip, of which frame times are used and may be replaced.
        sums: control -> float64[frames], its curve before the division.
        budget: budget of the clip.
    """
    place = f"mapping {mapping.name}"
    shares = [(c, w) for c, w in mapping.shares.items() if c in sums and w in sums]
    times = _between(clip.frame_times()) if any(sums[c].any() for c, _ in shares) else None
    if times is not None:
        budget.hold(16 * len(sums) * len(times), f"{place}: frames between keys")
        sums = {c: np.interp(times, clip.frame_times(), values) for c, values in sums.items()}
        clip = clip.replaced(curves=np.zeros((len(clip.names), len(times))), times=times)
    for control, whole in shares:
        budget.work(clip.frame_count, f"{place}: {len(shares)} shares")
        sums[control] = share_of(sums[control], sums[whole])
    return clip, sums


def _between(times: Doubles) -> Doubles | None:
    """The times of a clip with keyframes that are far apart, and additional times between them.

    A quotient of linear curves is not linear between keyframes. Without more frames, lips that are
    shut at two keyframes would part between them.

    Args:
        times: float64[frames], seconds.

    Returns:
        float64[more frames], seconds; None if the frames are close enough, as in a capture.
    """
    steps = np.diff(times)
    if len(steps) == 0 or np.median(steps) <= _KEYED:
        return None
    parts = np.clip(np.ceil(steps / _STEP), 1, _MOST_STEPS).astype(int)
    rows = [np.linspace(at, at + step, n, endpoint=False)
            for at, step, n in zip(times, steps, parts, strict=False)]  # fmt: skip
    return np.concatenate([*rows, times[-1:]])


def fits(control: str, pattern: str) -> bool:
    """Whether a pattern with * and ? matches a control's name; case counts.

    The name may be written without "CTRL_expressions." at its beginning.
    """
    short = control.partition(".")[2] if control.startswith("CTRL_expressions.") else control
    return fnmatch.fnmatchcase(control, pattern) or fnmatch.fnmatchcase(short, pattern)


def _star(pattern: str, name: str) -> str | None:
    """The text that the * of a pattern matches in a name, or None if the pattern does not match."""
    before, _, after = pattern.partition("*")
    if len(name) < len(before) + len(after) or not (
        name.startswith(before) and name.endswith(after)
    ):
        return None
    return name[len(before) : len(name) - len(after)]


def _folder() -> Traversable:
    return resources.files(__package__).joinpath("mappings")


def mapping_names() -> list[str]:
    """Names of the built-in mappings: TOML files of this package, and one per vocabulary."""
    return sorted({*_files(), *vocabulary.names()})


@cache
def _files() -> frozenset[str]:
    found = (entry.name for entry in _folder().iterdir())
    return frozenset(name.removesuffix(".toml") for name in found if name.endswith(".toml"))


def mapping_title(name: str) -> str:
    """The displayed title of a built-in mapping."""
    if name in vocabulary.names():
        return vocabulary.vocabulary(name).title
    return name.replace("_", " ").title()


def mapping_text(name: str) -> str:
    """The TOML text of a built-in mapping, which users may save and edit.

    Raises:
        MappingError: unknown name.
    """
    if name not in mapping_names():
        raise MappingError(name, f"one of {', '.join(mapping_names())} was expected")
    if name in _files():
        return _folder().joinpath(name + ".toml").read_text(encoding="utf-8")
    of = vocabulary.vocabulary(name)
    matching = "loose" if of.is_loose else "exact"
    return (
        f'# SPDX-License-Identifier: MIT\nname = "{name}"\ndescription = "{of.description}"\n'
        f'base = "vocabulary {name}"\nmatching = "{matching}"\n'
    )


def load_mapping(source: str | os.PathLike[str] | Mapping) -> Mapping:
    """Loads a built-in mapping by name, or a TOML file; a Mapping is returned unchanged.

    Raises:
        MappingError: missing, not TOML, or inconsistent rows; the message names the place.
    """
    if isinstance(source, Mapping):
        return source
    name = os.fspath(source)
    if name in mapping_names():
        return _built_in(name)
    try:
        text = toml.text_of(name)
    except OSError as error:
        known = ", ".join(mapping_names())
        raise MappingError(name, f"cannot read it: {error.strerror} (built in: {known})") from error
    except ReadingError as error:
        raise MappingError(name, error.what) from error
    except toml.TomlError as error:
        raise MappingError(name, str(error)) from error
    return parse_mapping(text, name, Path(name).stem)


@cache
def _built_in(name: str) -> Mapping:
    return parse_mapping(mapping_text(name), f"mapping {name}", name)


def parse_mapping(text: str, where: str, name: str = "") -> Mapping:
    """Parses a mapping from TOML.

    Args:
        text: TOML.
        where: name of the text in messages.
        name: the mapping's name, unless the text has one.

    Raises:
        MappingError: not TOML, an unknown key, or inconsistent rows; the message names the place.
    """
    try:
        table = toml.parse(text)
    except toml.TomlError as error:
        raise MappingError(where, f"no TOML: {error}") from error
    unknown = sorted(set(table) - _KEYS)
    if unknown:
        raise MappingError(where, f"{unknown[0]}: one of {', '.join(sorted(_KEYS))} was expected")
    mapping = _base(table, where)
    prefix = _text(table, "prefix", where)
    rows = {key: _row(key, row, prefix, where) for key, row in _table(table, "rows", where).items()}
    rows |= {key: {} for key in _texts(table, "ignore", where)}
    for key in mapping.rows:  # a row of the base is replaced only by exactly its name
        if key not in rows and loose_name(key) in {loose_name(own) for own in rows}:
            raise MappingError(
                where,
                (
                    f"rows: {key} is in the base with another spelling: use the spelling of the "
                    "base mapping"
                ),
            )
    shares = _shares(_table(table, "shares", where), prefix, where)
    controls = {
        key: _adjustment(key, value, where)
        for key, value in _table(table, "controls", where).items()
    }
    metadata = {
        key: shown(value) if isinstance(value, int) else str(value)
        for key, value in _table(table, "metadata", where).items()
    }
    return replace(
        mapping,
        name=_text(table, "name", where) or name,
        description=_text(table, "description", where) or mapping.description,
        rows={**mapping.rows, **rows},
        shares={c: whole for c, whole in {**mapping.shares, **shares}.items() if whole},
        controls={**mapping.controls, **controls},
        strip=(*mapping.strip, *_texts(table, "strip", where)),
        is_loose=_matching(table, mapping.is_loose, where),
        is_gui=_flag(table, "gui", mapping.is_gui, where),
        metadata={**mapping.metadata, **metadata},
    )


def _base(table: Table[str, Any], where: str) -> Mapping:
    """The mapping that the key `base` of a TOML table names, or an empty one without this key.

    "vocabulary NAME" means the names of a vocabulary of controls.vocabulary. For ARKit and VRM the
    ARKit units are included.

    Args:
        table: the mapping as TOML.
        where: name of the mapping in errors.
    """
    base = _text(table, "base", where)
    if not base:
        return Mapping("")
    kind, _, of = _OLD_BASES.get(base, base).partition(" ")
    if kind == "vocabulary" and of in vocabulary.names():
        meant = vocabulary.vocabulary(of).meanings.values()
        rows = {m.name: row_of(m) for m in meant}
        if of in _WITH_UNITS:
            rows = {unit: dict(row) for unit, row in arkit.mapping().items()} | rows
        return Mapping("", rows=rows, shares=arkit.shares(), vocabulary=of)
    if base not in mapping_names():
        raise MappingError(
            where, f"base: one of {', '.join(mapping_names())} was expected, found {base}"
        )
    return _built_in(base)


def row_of(said: Meaning) -> Row:
    """Control -> weight for a name of a vocabulary; an expression is replaced by its controls."""
    if said.controls or not said.expression:
        return dict(said.controls)
    return dict(expressions.get(said.expression).weights)


def _matching(table: Table[str, Any], default: bool, where: str) -> bool:
    value = table.get("matching", "loose" if default else "exact")
    if value not in ("loose", "exact"):
        raise MappingError(where, f"matching: loose or exact was expected, found {shown(value)}")
    return bool(value == "loose")


def _flag(table: Table[str, Any], key: str, default: bool, where: str) -> bool:
    try:
        return flag(table.get(key, default))
    except GivenError as error:
        raise MappingError(where, f"{key}: {error}") from None


def _text(table: Table[str, Any], key: str, where: str) -> str:
    value = table.get(key, "")
    if not isinstance(value, str):
        raise MappingError(where, f"{key}: text was expected, found {shown(value)}")
    return value


def _texts(table: Table[str, Any], key: str, where: str) -> list[str]:
    value = table.get(key, [])
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise MappingError(where, f"{key}: a list of names was expected, found {shown(value)}")
    return value


def _table(table: Table[str, Any], key: str, where: str) -> dict[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise MappingError(where, f"{key}: a table was expected, found {shown(value)}")
    return value


def _row(key: str, value: object, prefix: str, where: str) -> Row:
    """Control -> weight of a row, with names of controls in full.

    "@PP" means the controls of the expression PP. A control ending in * means the controls of both
    sides, one ending in ** the controls of the four lip quarters, unless the row's key contains a
    *. A name without a dot gets the prefix.

    Args:
        key: name of the curve in the source.
        value: value of the row in the TOML: {control: weight}, or the name of an expression.
        prefix: text before names of controls without a dot.
        where: name of the mapping in errors.
    """
    if isinstance(value, str):
        value = {"@" + value: 1.0}
    if not isinstance(value, dict):
        raise MappingError(
            where,
            f"rows.{key}: {{ control = weight }} or an expression was expected, found "
            f"{shown(value)}",
        )
    if key.count("*") > 1:
        raise MappingError(where, f"rows.{key}: one * at most was expected")
    out: Row = {}
    for control, given in value.items():
        at = f"rows.{key}.{control}"
        weight = _number(given, at, where)
        if control.startswith("@"):
            parts = _expression(control[1:], at, where)
        else:
            full = control if "." in control else prefix + control
            parts = dict.fromkeys([full] if "*" in key else expand_sides(full), 1.0)
        for name, part in parts.items():
            out[name] = out.get(name, 0.0) + weight * part
    if "*" not in key and any("*" in control for control in out):
        raise MappingError(
            where,
            (
                f"rows.{key}: a * was expected at the end of a control, or in both the curve and "
                "the control"
            ),
        )
    return out


def _expression(name: str, at: str, where: str) -> Table[str, float]:
    """Control -> weight of an expression.

    Args:
        name: name of the expression.
        at: place in the TOML, for errors.
        where: name of the mapping in errors.
    """
    try:
        return expressions.get(name).weights
    except ValueError as error:
        raise MappingError(where, f"{at}: {error}") from error


def _shares(table: Table[str, Any], prefix: str, where: str) -> dict[str, str]:
    """Control -> the control of which it takes back a share, with names in full.

    "" instead of a control removes an entry of the base mapping. A share of a share is an error,
    because the result would depend on the order of the divisions.

    Args:
        table: the table `shares` of the TOML.
        prefix: text before names of controls without a dot.
        where: name of the mapping in errors.
    """
    out: dict[str, str] = {}
    for key, value in table.items():
        if not isinstance(value, str):
            raise MappingError(where, f"shares.{key}: a control was expected, found {value!r}")
        names = [name if "." in name or not name else prefix + name for name in (key, value)]
        out |= dict.fromkeys(expand_sides(names[0]), names[1])
    chained = next((control for control, whole in out.items() if whole in out), None)
    if chained is not None:
        raise MappingError(
            where, f"shares.{chained}: a control that is no share itself was expected, "
            f"found {out[chained]}"
        )  # fmt: skip
    return out


def _adjustment(key: str, value: object, where: str) -> Adjustment:
    at = f"controls.{key}"
    if not isinstance(value, dict) or set(value) - {"gain", "offset", "curve"}:
        raise MappingError(where, f"{at}: gain, offset, curve were expected, found {shown(value)}")
    points = value.get("curve", [])
    good = isinstance(points, list) and all(isinstance(p, list) and len(p) == 2 for p in points)
    if not good:
        raise MappingError(where, f"{at}.curve: a list of [value, result] was expected")
    pairs = tuple((_number(x, at, where), _number(y, at, where)) for x, y in points)
    if len(pairs) == 1 or any(b[0] <= a[0] for a, b in pairwise(pairs)):
        raise MappingError(where, f"{at}.curve: two or more ascending values were expected")
    return Adjustment(
        _number(value.get("gain", 1.0), f"{at}.gain", where),
        _number(value.get("offset", 0.0), f"{at}.offset", where),
        pairs,
    )


def _number(value: object, at: str, where: str) -> float:
    try:
        return finite(value)
    except GivenError as error:
        raise MappingError(where, f"{at}: {error}") from None


def check(mapping: Mapping, rig_names: Iterable[str]) -> list[str]:
    """Compares a mapping with a rig.

    Args:
        mapping: the mapping.
        rig_names: raw controls of the rig, or its GUI controls if mapping.is_gui.

    Returns:
        One sentence per control that the rig lacks, and per pattern in `mapping.controls` that
        matches no control of the rig; empty if there are none.
    """
    known = set(rig_names)
    out = []
    for key, row in mapping.rows.items():
        missing = [c for c in row if "*" not in c and c not in known and c not in ANGLES]
        out += [f"rows.{key}: the rig has no control {control}" for control in missing]
    for pattern in mapping.controls:
        if not any(fits(control, pattern) for control in (*known, *ANGLES)):
            out.append(f"controls.{pattern}: fits no control of the rig")
    return out


def best_mapping(names: Sequence[str], columns: Sequence[str] | None = None) -> str | None:
    """The name of the built-in mapping that knows the most curves in `names`, or None.

    Ties go to the mapping that knows more names in `columns`, then to the one with fewer rows,
    which is more specific. A mapping that knows only single letters is not chosen, because several
    vocabularies use them as mouth shapes; but the vowels A, I, U, E, O together mean VRM. A file
    with nearly all ARKit units is not VRM.

    Args:
        names: curves that are not constantly 0.
        columns: names of all curves; None: the same as `names`.
    """
    columns = names if columns is None else columns
    letters = {name.upper() for name in columns if len(name) == 1}
    has_vowels = letters >= set(VOWELS)
    known: dict[str, set[str]] = {}
    scores = []
    for mapping, find in _finders():
        known[mapping.name] = hits = {curve for curve in columns if find(curve) is not None}
        if has_vowels and mapping.name != "vrm":
            hits -= {curve for curve in hits if curve.upper() in VOWELS}
        is_vowels = has_vowels and mapping.name == "vrm"
        is_sure = is_vowels or not all(map(_is_letter, hits))
        if is_sure and (found := hits.intersection(names)):
            scores.append((-len(found), -len(hits), len(mapping.rows), mapping.name))
    if len(known[ARKIT]) >= arkit.FULL_SET:  # the expressions of VRM include the ARKit units
        scores = [score for score in scores if score[-1] != "vrm"]
    return min(scores)[-1] if scores else None


def _is_letter(curve: str) -> bool:
    """Whether a name is a single ASCII letter; a single kana is a name of MikuMikuDance."""
    return len(curve) == 1 and curve.isascii()


def single_letters(names: Iterable[str]) -> list[str]:
    """Names of the mappings that know any of `names`; empty unless all are one character long."""
    names = list(names)
    if not names or any(len(name) > 1 for name in names):
        return []
    return [mapping.name for mapping, find in _finders() if any(map(find, names))]


@cache
def _finders() -> list[tuple[Mapping, Callable[[str], tuple[str, Row] | None]]]:
    mappings = [_built_in(name) for name in mapping_names()]
    return [(mapping, mapping.finder()) for mapping in mappings]
