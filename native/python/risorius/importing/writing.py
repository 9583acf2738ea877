# SPDX-License-Identifier: MIT
"""Writes clips as text (CSV, JSON, Unreal curve tables), and mappings with additional rows."""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..anim.clip import Clip
from ..base import toml
from ..base.errors import ArgumentError
from ..files import fileio
from .mapping import load_mapping, mapping_names

# characters that Unreal Engine does not allow in names
_UNREAL = re.compile(r"""[\s"',./:|&!~@#(){}\[\]=;^%$`]""")


def csv_text(clip: Clip) -> str:
    """A CSV table: time in seconds, then a column per control; lines end in LF.

    Every number has enough digits to restore its float32 (the time: float64).

    Raises:
        ValueError: a value that is not finite, which other software may not accept.
    """
    _check_finite(clip, "CSV")
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["time", *clip.names])
    for time, frame in zip(clip.frame_times().tolist(), clip.curves.T, strict=True):
        writer.writerow([repr(time), *map(_shortest, frame)])
    return out.getvalue()


def json_text(clip: Clip) -> str:
    """A JSON text of the complete clip: rate, times, curves by name, events, metadata.

    Raises:
        ValueError: a value that is not finite.
    """
    _check_finite(clip, "JSON")
    head = {
        "risorius_clip": 1,
        "rate": clip.rate,
        "start": clip.start,
        "frames": clip.frame_count,
        "times": None if clip.times is None else clip.times.tolist(),
        "events": [event._asdict() for event in clip.events],
        "metadata": clip.metadata,
    }
    # The json module would write all digits of a float64; a float32 needs fewer.
    rows = [
        f"{json.dumps(name)}: [{', '.join(map(_shortest, curve))}]"
        for name, curve in zip(clip.names, clip.curves, strict=True)
    ]
    body = ",\n    ".join(rows)
    return json.dumps(head, indent=2)[:-2] + f',\n  "curves": {{\n    {body}\n  }}\n}}\n'


def curve_table_text(clip: Clip, *, is_json: bool) -> str:
    """A curve table for Unreal Engine's import: a row per curve, a column per time.

    Names are spelled as the curves of MetaHuman animations: CTRL_expressions_jawOpen.

    Args:
        clip: clip of raw controls.
        is_json: True: JSON; False: CSV, whose first cell Unreal ignores.

    Raises:
        ValueError: a value that is not finite, or two controls whose names become equal.
    """
    _check_finite(clip, "a curve table")
    names = [_UNREAL.sub("_", name) for name in clip.names]
    if twice := [name for name in names if names.count(name) > 1]:
        raise ArgumentError(
            f"{twice[0]}: each curve needs a name of its own, but several curves get this name"
        )
    times = [f"{time:.6f}".rstrip("0").rstrip(".") for time in clip.frame_times().tolist()]
    rows = [list(map(_shortest, curve)) for curve in clip.curves]
    if is_json:
        lines = (
            ", ".join(f'"{time}": {value}' for time, value in zip(times, row, strict=True))
            for row in rows
        )
        pairs = zip(names, lines, strict=True)
        body = ",\n".join(f'  {{"Name": {json.dumps(name)}, {line}}}' for name, line in pairs)
        return f"[\n{body}\n]\n"
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["---", *times])
    writer.writerows([name, *row] for name, row in zip(names, rows, strict=True))
    return out.getvalue()


def write_text(text: str, path: str | os.PathLike[str]) -> None:
    """Writes a text file atomically.

    Args:
        text: the new content, written as UTF-8.
        path: path of the file; links are followed.

    Raises:
        OSError: the file cannot be written; the old content stays.
    """
    fileio.write_text(path, text)


def _shortest(value: np.float32) -> str:
    return str(value)  # NumPy writes the fewest digits that restore the float32


def _check_finite(clip: Clip, kind: str) -> None:
    bad = np.argwhere(~np.isfinite(clip.curves))
    if bad.size:
        name, frame = clip.names[bad[0, 0]], int(bad[0, 1])
        raise ArgumentError(f"{name}, frame {frame}: {kind} holds finite numbers only")


def mapping_with(base: str, rows: Mapping[str, Mapping[str, float]]) -> str:
    """A mapping as TOML, with additional rows; load_mapping reads it.

    Args:
        base: name of a built-in mapping, path of a mapping file, or "" for none. Comments of the
            file are lost.
        rows: curve -> {control, or @expression: weight}; an empty row ignores the curve.

    Raises:
        MappingError: a base that cannot be read. TomlError: a name or value that TOML cannot store.
    """
    if base:
        load_mapping(base)  # raises the error if it is invalid
    table: dict[str, Any] = {"base": base} if base in ("", *mapping_names()) else toml.read(base)
    ignored = [*table.get("ignore", ()), *(name for name, row in rows.items() if not row)]
    table["ignore"] = [name for name in dict.fromkeys(ignored) if not rows.get(name)]
    table["rows"] = {**table.get("rows", {}), **{n: dict(row) for n, row in rows.items() if row}}
    plain = [f"{key} = {_toml(v)}" for key, v in table.items() if v and not isinstance(v, dict)]
    for key, value in table.items():
        if value and isinstance(value, dict):
            plain += ["", f"[{key}]", *(f"{_toml(k)} = {_toml(v)}" for k, v in value.items())]
    return "\n".join([*plain, ""])


def _toml(value: object) -> str:
    if isinstance(value, str):
        plain = value.encode("utf-8", "replace").decode()
        return json.dumps(plain, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_toml(k)} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return str(value).lower()
