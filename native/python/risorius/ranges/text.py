# SPDX-License-Identifier: MIT
"""Reads and writes ranges as an editable text file NAME.range.toml.

format = "risorius range 1"
source = "rom.csv"
[controls]
"CTRL_expressions.eyeBlinkL" = { neutral = 0.06, extreme = 0.67 }
"CTRL_expressions.jawLeft" = { neutral = 0.0, extreme = 0.06, off = "hardly moves" }
"""

from __future__ import annotations

import json
import os
from typing import Any

from ..base import toml
from ..base.reading import ReadingError
from ..importing.errors import AnimationFileError
from .remap import Learned, Range, Ranges

_FORMAT = "risorius range 1"
_PREFIX = "CTRL_expressions."
_LARGEST = 100.0  # no captured value is larger; larger numbers are errors
_KEYS = {"format", "source", "controls"}
_HEAD = """\
# How far the controls of a person's face go in captures. The value "neutral" becomes 0, "extreme"
# becomes 1; below and above they are held. A control with "off" keeps its captured values:
# remove the "off" to use its numbers.
"""


def ranges_text(ranges: Ranges) -> str:
    """Ranges as the text of a file; lines end in LF."""
    lines = [f"{_HEAD}format = {json.dumps(_FORMAT)}", f"source = {_quoted(ranges.source)}"]
    lines += ["", "[controls]"]
    for name, (range_, reason) in ranges.controls.items():
        off = f", off = {_quoted(reason)}" if reason else ""
        numbers = f"neutral = {range_.neutral:.4g}, extreme = {range_.extreme:.4g}"
        gain = "" if reason else f"  # gain {range_.gain:.2f}"
        lines.append(f"{_quoted(name)} = {{ {numbers}{off} }}{gain}")
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return json.dumps("".join(c for c in text if c.isprintable()), ensure_ascii=False)


def load_ranges(path: str | os.PathLike[str]) -> Ranges:
    """Reads a file of ranges.

    Raises:
        AnimationFileError: missing, not TOML, or an invalid field; the message names file, field
            and value.
    """
    name = os.fspath(path)
    try:
        text = toml.text_of(path)
    except ReadingError as error:
        raise AnimationFileError(name, error.what) from error
    except OSError as error:
        raise AnimationFileError(name, f"cannot read it: {error.strerror}") from error
    except toml.TomlError as error:
        raise AnimationFileError(name, str(error)) from error
    return parse_ranges(text, name)


def parse_ranges(text: str, where: str) -> Ranges:
    """Parses a file of ranges.

    Args:
        text: content of the file.
        where: name of the file in errors.

    Raises:
        AnimationFileError: not TOML, or an invalid field.
    """
    try:
        table = toml.parse(text)
    except toml.TomlError as error:
        raise AnimationFileError(where, f"a TOML file of ranges was expected: {error}") from error
    found = table.get("format")
    if found != _FORMAT:
        raise AnimationFileError(
            where, f"format: {_FORMAT!r} was expected, found {_short(found)} (see clip learn)"
        )
    if unknown := sorted(set(table) - _KEYS):
        raise AnimationFileError(
            where, f"{unknown[0]}: one of {', '.join(sorted(_KEYS))} was expected"
        )
    rows, source = table.get("controls", {}), table.get("source", "")
    if not isinstance(rows, dict):
        raise AnimationFileError(where, f"controls: a table was expected, found {_short(rows)}")
    if not isinstance(source, str):
        raise AnimationFileError(where, f"source: text was expected, found {_short(source)}")
    controls: dict[str, Learned] = {}
    for key, value in rows.items():
        name = key if "." in key else _PREFIX + key
        if name in controls:
            raise AnimationFileError(where, f"controls: {key} is there twice")
        controls[name] = _row(key, value, where)
    return Ranges(controls, source)


def _row(key: str, value: object, where: str) -> Learned:
    at = f"controls.{key}"
    if not isinstance(value, dict) or not {"neutral", "extreme"} <= set(value):
        raise AnimationFileError(
            where, f"{at}: {{ neutral = N, extreme = N }} was expected, found {_short(value)}"
        )
    if unknown := sorted(set(value) - {"neutral", "extreme", "off"}):
        raise AnimationFileError(
            where, f"{at}.{unknown[0]}: one of neutral, extreme, off was expected"
        )
    range_ = Range(*(_number(value[part], f"{at}.{part}", where) for part in Range._fields))
    off = value.get("off", "")
    if not isinstance(off, str | bool):
        raise AnimationFileError(
            where, f"{at}.off: a reason or true was expected, found {_short(off)}"
        )
    reason = off if isinstance(off, str) else "off" if off else ""
    if not reason and (trouble := range_.trouble()):
        raise AnimationFileError(where, f"{at}.{trouble[0]}: {trouble[1]}")
    return Learned(range_, reason)


def _number(value: Any, at: str, where: str) -> float:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not abs(value) <= _LARGEST:  # also false for NaN
        raise AnimationFileError(
            where, f"{at}: a number up to {_LARGEST:g} was expected, found {_short(value)}"
        )
    return float(value)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else text[:40] + "..."
