# SPDX-License-Identifier: MIT
"""Stores the landmarks of a head (found, moved by the user or missing) in a JSON file."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...author.geometry.skeleton import Doubles
from ...base.errors import RisoriusError
from ...base.given import GivenError, finite, shown
from ...base.reading import read_file
from ...base.words import joined
from .names import landmark_words, needed_landmarks

FOUND, MOVED, MISSING = "found", "moved by hand", "missing"
_FORMAT, _VERSION = "risorius landmarks", 1
_MOST_BYTES = 1 << 20


class LandmarkError(RisoriusError):
    """The landmarks of a head cannot be found, or a landmark file is invalid."""

    code = "landmarks"


@dataclass
class Landmarks:
    """Landmarks of a face by name, in the space of the surface in which they were found.

    Attributes:
        points: float64[3] by landmark name, positions.
        how: landmark name -> FOUND (the program found the point) or MOVED (the user moved it).
        notes: sentences for the user.
    """

    points: dict[str, Doubles] = field(default_factory=dict)
    how: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def missing(self) -> list[str]:
        """Names of landmarks without a position, in the order of names.toml."""
        return [name for name in landmark_words() if name not in self.points]

    def moved(self, name: str, point: Doubles) -> None:
        """Set the position of a landmark that the user moved.

        Args:
            name: a name in names.toml.
            point: float64[3], the position.
        """
        self.points[name] = np.asarray(point, np.float64)
        self.how[name] = MOVED

    def require(self, where: str) -> None:
        """Refuse a head without all landmarks that a registration needs.

        Args:
            where: name of the head in error messages.

        Raises:
            LandmarkError: needed landmarks are missing; the message names all of them.
        """
        lost = [landmark_words()[n] for n in self.missing if n in needed_landmarks()]
        if lost:
            one = len(lost) == 1
            raise LandmarkError(
                f"{where}: {joined(lost)} {'was' if one else 'were'} not found: give "
                f"{'it' if one else 'them'} with --landmarks FILE or move "
                f"{'it' if one else 'them'} in Blender"
            )


def landmarks_path(head: Path) -> Path:
    """The path of the landmark file of a head's file, in the same folder."""
    return head.with_name(f"{head.stem}.landmarks.json")


def landmarks_text(landmarks: Landmarks) -> str:
    """Landmarks as JSON; a missing landmark has no position."""
    rows: dict[str, Any] = {}
    for name in landmark_words():
        if name in landmarks.points:
            point = [round(float(x), 6) for x in landmarks.points[name]]
            rows[name] = {"how": landmarks.how[name], "point": point}
        else:
            rows[name] = {"how": MISSING}
    table = {"format": _FORMAT, "version": _VERSION, "landmarks": rows}
    return json.dumps(table, indent=1) + "\n"


def read_landmarks(path: str | os.PathLike[str]) -> Landmarks:
    """Read a landmark file.

    Args:
        path: a JSON file with the text of `landmarks_text`; landmarks that it lacks are missing.

    Raises:
        LandmarkError: the file is invalid; the message says why.
        OSError: the file cannot be read.
    """
    try:
        table = json.loads(read_file(path, _MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise LandmarkError(f"{path}: JSON was expected: {error}") from None
    if not isinstance(table, dict) or table.get("format") != _FORMAT:
        raise LandmarkError(f'{path}: format: "{_FORMAT}" was expected')
    if table.get("version") != _VERSION:
        found = shown(table.get("version"))
        raise LandmarkError(f"{path}: version: {_VERSION} was expected, found {found}")
    rows = table.get("landmarks")
    if not isinstance(rows, dict):
        raise LandmarkError(
            f"{path}: landmarks: a table was expected (a JSON object), found {shown(rows)}"
        )
    out = Landmarks()
    for name, row in rows.items():
        _take(out, f"{path}: landmarks.{name}", name, row)
    return out


def _take(out: Landmarks, where: str, name: str, row: object) -> None:
    if name not in landmark_words():
        raise LandmarkError(f"{where}: there is no landmark of this name")
    how = row.get("how", MOVED) if isinstance(row, dict) else None
    if not isinstance(row, dict) or how not in (FOUND, MOVED, MISSING):
        raise LandmarkError(f'{where}: how: "{FOUND}", "{MOVED}" or "{MISSING}" was expected')
    if how == MISSING:
        return
    point = row.get("point")
    if not isinstance(point, list) or len(point) != 3:
        raise LandmarkError(f"{where}: point: three numbers were expected, found {shown(point)}")
    try:
        out.points[name] = np.array([finite(value) for value in point])
    except GivenError as error:
        raise LandmarkError(f"{where}: point: {error}") from None
    out.how[name] = str(how)
