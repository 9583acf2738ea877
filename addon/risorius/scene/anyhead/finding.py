# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds landmarks of heads with the Python package risorius, and converts them for Blender.

In this file, "the package" is risorius. Its coordinates are in cm, with x to the left of the head,
y up and z to the front.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import native
from ..base.blender_types import Context, MeshObject
from ..base.task import Task, telling
from ..file import shape_key_head
from . import points

Doubles = NDArray[np.float64]


class Finding(NamedTuple):
    """The result of a search: landmarks in the coordinates of the head's object.

    Attributes:
        places: name -> float64[3], the position.
        missing: names of needed landmarks that were not found.
        notes: sentences about the head.
    """

    places: Mapping[str, Doubles]
    missing: Sequence[str]
    notes: Sequence[str]


class Head(NamedTuple):
    """A head as the package risorius reads it, without objects of Blender.

    Attributes:
        parts: the meshes, the face first, in the coordinates of the package.
        turn: float64[3, 3], matrix from the coordinates of the head's object to the coordinates of
            the package: rotation, scale and conversion to cm; both origins are the same.
        fixed: landmarks that the user moved or placed, in the coordinates of the package.
        named: name of the object that is the face; "": the package chooses one of the meshes.
    """

    parts: Sequence[native.HeadPart]
    turn: Doubles
    fixed: Mapping[str, Doubles]
    named: str


def read(context: Context, head: MeshObject, others: Sequence[MeshObject]) -> Head:
    """Read a head and its other meshes.

    Args:
        context: its scene defines the length of a unit.
        head: the mesh that is the face.
        others: meshes that belong to the head: eyes, teeth, hair.
    """
    rows = [shape_key_head.part_at_rest(context, item, head) for item in (head, *others)]
    turn = shape_key_head.turn_of(context, head)
    there = points.of(head)
    fixed = {name: turn @ place for name, place in points.by_hand(there).items()}
    return Head(rows, turn, fixed, head.name if there or not others else "")


def words() -> Mapping[str, str]:
    """Name of each landmark -> its description for the user, in the order of the package's list."""
    found: Mapping[str, str] = native.part("anyhead.landmarks.names").landmark_words()
    return found


def needed() -> frozenset[str]:
    """Names of the landmarks that are needed to make a face from a head."""
    found: frozenset[str] = native.part("anyhead.landmarks.names").needed_landmarks()
    return found


def _search(head: Head, progress: Callable[[float], bool]) -> native.Landmarks:
    """Find the landmarks of a head; landmarks that the user placed are kept."""
    module = native.part("anyhead.landmarks.find")
    box = native.part("anyhead.standing").named_box(head.parts)
    hints = module.Hints(where=head.parts[0].name, marks=dict(head.fixed), box=box)
    found: native.Landmarks = module.find_landmarks(surface_of(head.parts[0]), hints, progress)
    return found


def on_object(head: Head, found: native.Landmarks) -> Finding:
    """Convert landmarks of the package to the coordinates of the head's object.

    Args:
        head: the result of `read`.
        found: landmarks in the space of `head.parts`.
    """
    back = np.linalg.inv(head.turn)
    places = {name: back @ np.asarray(point) for name, point in found.points.items()}
    missing = [name for name in words() if name in needed() and name not in places]
    return Finding(places, missing, list(found.notes))


def marks_of(head: Head) -> native.Landmarks | None:
    """The landmarks that the user moved or placed, or None if there are none.

    Args:
        head: the result of `read`.
    """
    if not head.fixed:
        return None
    out: native.Landmarks = native.part("anyhead.landmarks.marks").Landmarks()
    for name, place in head.fixed.items():
        out.moved(name, place)
    return out


def surface_of(part: native.HeadPart) -> native.HeadSurface:
    """The triangulated polygons of a mesh as risorius.anyhead.surface.Surface."""
    surface: native.HeadSurface = native.part("anyhead.surface").Surface.of_polygons(
        part.mesh.positions, part.mesh.faces
    )
    return surface


def find_task(head: Head) -> Task[Finding]:
    """A background task that finds the landmarks of a head.

    Args:
        head: the result of `read`.
    """

    def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> Finding:
        return on_object(head, _search(head, telling(progress, cancelled)))

    return Task(work)


def text_of(head: Head, places: Mapping[str, Doubles]) -> str:
    """Landmarks as the text of a JSON file.

    Args:
        head: the result of `read`.
        places: landmarks by name, in the coordinates of the head's object.
    """
    module = native.part("anyhead.landmarks.marks")
    out = module.Landmarks()
    for name, place in places.items():
        out.moved(name, head.turn @ place)
    text: str = module.landmarks_text(out)
    return text


def read_file(head: Head, path: str) -> dict[str, Doubles]:
    """Read the landmarks of a JSON file, in the coordinates of the head's object.

    Args:
        head: the result of `read`.
        path: the JSON file.

    Raises:
        LandmarkError: the file is not a valid landmark file; the message says why.
        OSError: the file cannot be read.
    """
    found = native.part("anyhead.landmarks.marks").read_landmarks(path)
    return dict(on_object(head, found).places)
