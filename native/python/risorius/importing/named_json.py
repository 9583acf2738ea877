# SPDX-License-Identifier: MIT
"""Reads JSON of named curves in the layouts of various software: by frame, curve or keyframe."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..anim.clip import Event
from ..base.budget import Budget
from .clock.units import FRAMES, Asked, time_name
from .errors import AnimationFileError
from .json_reader import Doubles, Reader, first_key
from .keys import VALUE_BYTES, Keys, on_one_clock
from .source import Take
from .tables import LIVE_LINK_FACE

NAME_KEYS = (
    "facsNames", "names", "blendShapeNames", "blendshapeNames", "blendshape_names", "shapeNames",
    "curveNames", "controls", "channels",
)  # fmt: skip
MATRIX_KEYS = ("weightMat", "frames", "weights", "values", "data", "blendshapes", "blendShapes")
WEIGHT_KEYS = ("weights", "values", "blendShapes", "blendshapes", "curves", "shapes")
# Names of the last seven columns in a NeuroSync row of 68 values; the 61 columns before them are
# the curves of Live Link Face.
NEUROSYNC_EMOTIONS = ("Angry", "Disgusted", "Fearful", "Happy", "Neutral", "Sad", "Surprised")
NEUROSYNC_RATE = 60.0
KEYS_KEYS = ("Keys", "keys")
CURVE_NAME_KEYS = ("CurveName", "Name", "name", "curveName")
INNER_CURVE_KEYS = ("FloatCurve", "Curve", "curve", "floatCurve")
DEEPEST = 64


def parse(text: str, name: str) -> object:
    """Parses a JSON text.

    Args:
        text: content of the file.
        name: the file's name in errors.

    Raises:
        AnimationFileError: not JSON, with line and column; nested too deeply.
    """
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise AnimationFileError(
            name, f"not JSON: {error.msg}", line=error.lineno, column=error.colno
        ) from error
    except RecursionError as error:
        raise AnimationFileError(name, "not JSON that can be read: nested too deeply") from error
    except ValueError as error:  # such as a number with thousands of digits
        raise AnimationFileError(name, f"not JSON that can be read: {error}") from error


def read(
    document: object, name: str, asked: Asked | None = None, budget: Budget | None = None
) -> Take:
    """Reads the curves of a document by the first layout that fits.

    Args:
        document: parsed JSON.
        name: the file's name in errors.
        asked: the caller's options on time, which override the file. None: no options.
        budget: limits memory and work; None: the budget of a small file.

    Raises:
        AnimationFileError: no known layout, or an inconsistent one.
        BudgetError: far more curves and frames than a file of this size may have.
    """
    reader = Reader(name, asked or Asked(), budget or Budget.of(0))
    for shape in (
        own_clip,
        matrix,
        neurosync,
        frame_tables,
        curve_table,
        keyed_curves,
        lists_by_name,
    ):
        take = shape(reader, document)
        if take is not None:
            return take
    raise reader.fail(
        "named curves were expected, found none: {names, frames}, {name: [values]}, a list of "
        "frames with a time, or curves with keys"
    )


def own_clip(reader: Reader, document: object) -> Take | None:
    """Reads the clip JSON that Risorius itself writes; None if the document has another layout.

    Args:
        reader: reader of the file.
        document: parsed JSON.

    Raises:
        AnimationFileError: this layout, but inconsistent.
    """
    if not isinstance(document, dict) or "risorius_clip" not in document:
        return None
    curves = document.get("curves")
    if not isinstance(curves, dict):
        raise reader.fail("a table was expected", "curves")
    count = document.get("frames")
    if not isinstance(count, int) or count < 0:
        raise reader.fail("a number of frames was expected", "frames")
    rows = [reader.numbers(values, f"curves.{name}") for name, values in curves.items()]
    for curve, row in zip(curves, rows, strict=True):
        if len(row) != count:
            raise reader.fail(f"{count} values were expected, found {len(row)}", f"curves.{curve}")
    rate = reader.frames_a_second(document.get("rate"), "rate")
    start = reader.number(document.get("start", 0.0), "start")
    given = document.get("times")
    times = start + np.arange(count) / rate
    if given is not None:
        times = np.array(reader.numbers(given, "times"))
        if times.size != count:
            raise reader.fail(f"{count} times were expected, found {times.size}", "times")
    take = reader.take(list(curves), rows, times, rate)
    take.clip = take.clip.replaced(
        events=_own_events(reader, document.get("events", [])),
        metadata={str(k): str(v) for k, v in dict(document.get("metadata", {})).items()},
    )
    return take


def _own_events(reader: Reader, rows: object) -> list[Event]:
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise reader.fail("a list of tables was expected", "events")
    return [
        Event(
            reader.number(row.get("time"), f"events[{i}].time"),
            str(row.get("name", "")),
            reader.number(row.get("duration", 0.0), f"events[{i}].duration"),
            str(row.get("value", "")),
        )
        for i, row in enumerate(rows)
    ]


def matrix(reader: Reader, document: object) -> Take | None:
    """Reads {names: [...], frames: [[...], ...]}; Audio2Face calls these facsNames, weightMat.

    A frame may be a table with the values under "weights" and a time. Returns None if the document
    has another layout.

    Args:
        reader: reader of the file.
        document: parsed JSON.

    Raises:
        AnimationFileError: this layout, but inconsistent.
    """
    if not isinstance(document, dict):
        return None
    inner = document.get("metadata")
    names_in = next(
        (t for t in (document, inner) if isinstance(t, dict) and first_key(t, NAME_KEYS)), None
    )
    key = next((k for k in MATRIX_KEYS if _is_rows(document.get(k))), None)
    if names_in is None or key is None:
        return None
    names_key = first_key(names_in, NAME_KEYS) or ""
    names = reader.strings(names_in[names_key], names_key)
    frames = document[key]
    values, times = [], []
    clock = _time_key(frames[0]) if isinstance(frames[0], dict) else None
    for i, frame in enumerate(frames):
        place = f"{key}[{i}]"
        if isinstance(frame, dict):
            times.append(frame.get(clock))
            at = first_key(frame, WEIGHT_KEYS)
            if at is None:
                raise reader.fail(f"one of {', '.join(WEIGHT_KEYS)} was expected", place)
            row = reader.numbers(frame[at], f"{place}.{at}", has_holes=True)
        else:
            row = reader.numbers(frame, place, has_holes=True)
        if len(row) != len(names):
            raise reader.fail(
                f"{len(names)} values as in {names_key} were expected, found {len(row)}", place
            )
        values.append(row)
    rate = reader.rate_of(document, inner)
    at = _time_key({k: v for k, v in document.items() if k != key}, of_lists=True)
    given = document[at] if at else None
    if given is None and times and None not in times:
        at, given = clock, times
    seconds = reader.times(given, len(values), rate, at or "time")
    by_time = given is not None and not reader.asked.counts_rows
    return reader.take(
        names, np.array(values).reshape(-1, len(names)).T, seconds, None if by_time else rate
    )


def neurosync(reader: Reader, document: object) -> Take | None:
    """Reads {"blendshapes": [[61 or 68 values], ...]}, which the NeuroSync service returns.

    Returns None if the document has another layout.

    Args:
        reader: reader of the file.
        document: parsed JSON.

    Raises:
        AnimationFileError: this layout, but inconsistent.
    """
    rows = document.get("blendshapes") if isinstance(document, dict) else None
    if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
        return None
    columns = (*LIVE_LINK_FACE, *NEUROSYNC_EMOTIONS)
    count = len(rows[0])
    if count not in (len(LIVE_LINK_FACE), len(columns)):
        return None
    values = [
        reader.numbers(row, f"blendshapes[{i}]", has_holes=True) for i, row in enumerate(rows)
    ]
    for i, row in enumerate(values):
        if len(row) != count:
            raise reader.fail(
                f"{count} values as in the first frame were expected, found {len(row)}",
                f"blendshapes[{i}]",
            )
    rate = reader.rate_of(document)
    if rate is None:
        rate = NEUROSYNC_RATE
        reader.notes.append(f"{rate:g} frames a second were assumed, as NeuroSync writes")
    return reader.take(columns[:count], np.array(values).T, np.arange(len(values)) / rate, rate)


def frame_tables(reader: Reader, document: object) -> Take | None:
    """Reads a list of frames {time, name: value, ...}; "weights" may be a table of the values.

    Returns None if the document has another layout.

    Args:
        reader: reader of the file.
        document: parsed JSON.

    Raises:
        AnimationFileError: this layout, but inconsistent.
        BudgetError: far more curves and frames than a file of this size may have.
    """
    frames: object = document
    outer: dict[str, Any] = {}
    if isinstance(document, dict):
        outer = document
        key = next((k for k in MATRIX_KEYS if _is_tables(document.get(k))), None)
        frames = document[key] if key else None
    if not _is_tables(frames) or not isinstance(frames, list):
        return None
    tables = [_weights(frame) for frame in frames]
    names = list(dict.fromkeys(name for table in tables for name in table))
    # Tables with the name of a curve are no frames: they are keyed curves or rows of a curve table,
    # which keyed_curves() and curve_table() read.
    if not names or any(first_key(frame, CURVE_NAME_KEYS) for frame in frames):
        return None
    rate = reader.rate_of(outer, outer.get("metadata"))
    key = _time_key(frames[0])
    times = [frame.get(key) for frame in frames]
    given = None if key is None or None in times else times
    clock = reader.times(given, len(frames), rate, key or "time")
    if given is not None and not reader.asked.counts_rows:
        rate = None
    place = f"{len(names)} curves of {len(frames)} frames"
    reader.budget.hold(len(names) * len(frames) * VALUE_BYTES, place)
    reader.budget.work(len(names) * len(frames), place)
    columns = [_frame_column(reader, tables, curve, clock) for curve in names]
    return reader.take(names, columns, clock, rate)


def _weights(frame: Mapping[str, Any]) -> dict[str, Any]:
    """Name of a curve -> its value in a frame, for all numbers but times and frame numbers."""
    at = next((k for k in WEIGHT_KEYS if isinstance(frame.get(k), dict)), None)
    table = frame[at] if at else frame
    return {
        key: value
        for key, value in table.items()
        if time_name(key) is None and isinstance(value, int | float) and not isinstance(value, bool)
    }


def _frame_column(
    reader: Reader, tables: Sequence[Mapping[str, Any]], curve: str, clock: Doubles
) -> Doubles:
    known = [i for i, table in enumerate(tables) if curve in table]
    values = [reader.number(tables[i][curve], f"frame {i}, {curve}") for i in known]
    if len(known) < len(tables):
        reader.notes.append(f"{curve}: missing in {len(tables) - len(known)} frame(s), filled")
    at = np.maximum.accumulate(clock)  # frames whose time goes back are dropped later
    return np.interp(at, at[known], values)


def _time_key(table: Mapping[str, Any], *, of_lists: bool = False) -> str | None:
    """The key of the time in a table, or else the key of the frame number; None if both are absent.

    Args:
        table: table of the JSON.
        of_lists: whether to find a list of times or frame numbers instead of a single one.
    """
    found = [
        (name.unit == FRAMES, key)
        for key, value in table.items()
        if (name := time_name(key)) is not None
        and (_is_list(value) if of_lists else not isinstance(value, dict | list))
    ]
    return min(found, key=lambda row: row[0])[1] if found else None


def curve_table(reader: Reader, document: object) -> Take | None:
    """Reads Unreal's curve table: [{"Name": curve, "0": value, "0.033": value}, ...].

    Returns None if the document has another layout.

    Args:
        reader: reader of the file.
        document: parsed JSON; the keys other than "Name" are seconds.

    Raises:
        AnimationFileError: a value that is not a finite number, or times that do not ascend.
    """
    if not _is_tables(document) or not isinstance(document, list):
        return None
    curves = {}
    for row in document:
        name = row.get("Name")
        others = {key: value for key, value in row.items() if key != "Name"}
        if not isinstance(name, str) or not others or not all(map(_is_number, others)):
            return None
        times = np.array([float(key) for key in others])
        values = [reader.number(value, f"{name}.{key}") for key, value in others.items()]
        curves[name] = Keys(times, np.array(values))
    return _keyed(reader, curves)


def keyed_curves(reader: Reader, document: object) -> Take | None:
    """Reads curves with keyframes {Time, Value}, anywhere in the document.

    An Unreal animation's FloatCurves have this layout: [{CurveName, FloatCurve: {Keys: [...]}}].
    Returns None if there are no such curves.

    Args:
        reader: reader of the file.
        document: parsed JSON; times are seconds.

    Raises:
        AnimationFileError: a keyframe without a time or a value, or times that do not ascend.
    """
    found: dict[str, Keys] = {}
    is_cubic = False
    for curve, keys in _find_curves(document, DEEPEST):
        if curve in found:
            reader.notes.append(f"{curve}: found twice, the first one is taken")
            continue
        place = f"{curve}.Keys"
        times, values = [], []
        for i, key in enumerate(keys):
            row = {str(k).lower(): v for k, v in key.items()} if isinstance(key, dict) else {}
            times.append(_key_number(reader, row, "time", f"{place}[{i}]"))
            values.append(_key_number(reader, row, "value", f"{place}[{i}]"))
            is_cubic |= "cubic" in str(row.get("interpmode", "")).lower()
        found[curve] = Keys(np.array(times), np.array(values))
    if not found:
        return None
    if is_cubic:
        reader.notes.append("cubic keys are joined by straight lines")
    return _keyed(reader, found)


def _key_number(reader: Reader, row: Mapping[str, object], key: str, place: str) -> float:
    if key not in row:
        raise reader.fail(f"a key with {key} was expected", place)
    return reader.number(row[key], f"{place}.{key}")


def _find_curves(value: object, depth: int) -> list[tuple[str, list[Any]]]:
    """(name, keyframes) of all curves that are nested in a JSON value, `depth` levels at most."""
    if depth == 0:
        return []
    if isinstance(value, list):
        return [curve for item in value for curve in _find_curves(item, depth - 1)]
    if not isinstance(value, dict):
        return []
    name = next((value[k] for k in CURVE_NAME_KEYS if isinstance(value.get(k), str)), None)
    inner = next((value[k] for k in INNER_CURVE_KEYS if isinstance(value.get(k), dict)), value)
    keys = next((inner[k] for k in KEYS_KEYS if isinstance(inner.get(k), list)), None)
    if name is not None and keys:
        return [(name, keys)]
    return [curve for item in value.values() for curve in _find_curves(item, depth - 1)]


def _keyed(reader: Reader, curves: dict[str, Keys]) -> Take:
    for name, keys in curves.items():
        if (np.diff(keys.times) <= 0.0).any():
            raise reader.fail("key times that ascend were expected", name)
    times, rows = on_one_clock(list(curves.values()), None, reader.budget)
    return reader.take(list(curves), rows, times)


def lists_by_name(reader: Reader, document: object) -> Take | None:
    """Reads {name: [values], ...} with a rate or a list of times.

    The table may also be the value of a key in an outer table; WEIGHT_KEYS lists the possible keys,
    such as "curves".

    Returns None if the document has another layout.

    Args:
        reader: reader of the file.
        document: parsed JSON.

    Raises:
        AnimationFileError: lists of different lengths, a value that is not a number, no times.
    """
    if not isinstance(document, dict):
        return None
    inner = next((document[k] for k in WEIGHT_KEYS if isinstance(document.get(k), dict)), None)
    table = inner or document
    lists = {k: v for k, v in table.items() if time_name(k) is None and _is_list(v)}
    if not lists:
        return None
    count = len(next(iter(lists.values())))
    rows = [reader.numbers(values, name, has_holes=True) for name, values in lists.items()]
    for name, row in zip(lists, rows, strict=True):
        if len(row) != count:
            raise reader.fail(
                f"{count} values as in the first curve were expected, found {len(row)}", name
            )
    at_table = next((t for t in (table, document) if _time_key(t, of_lists=True)), {})
    at = _time_key(at_table, of_lists=True)
    rate = reader.rate_of(document, document.get("metadata"))
    times = reader.times(at_table[at] if at else None, count, rate, at or "times")
    by_time = at is not None and not reader.asked.counts_rows
    return reader.take(list(lists), rows, times, None if by_time else rate)


def _is_rows(value: object) -> bool:
    """Whether a value is a list whose rows are lists, or tables with a list of weights."""
    if not isinstance(value, list) or not value:
        return False
    return all(
        isinstance(row, list)
        or (isinstance(row, dict) and any(isinstance(row.get(k), list) for k in WEIGHT_KEYS))
        for row in value
    )


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)


def _is_list(value: object) -> bool:
    return isinstance(value, list) and bool(value) and not isinstance(value[0], dict | list)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
