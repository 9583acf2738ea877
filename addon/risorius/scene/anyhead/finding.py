# SPDX-License-Identifier: GPL-3.0-or-later
"""The way to the package that finds landmarks: a head as it wants one, its answer on the head."""

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
    """Landmarks in the head's own coordinates.

    Attributes:
        places: name -> float64[3].
        missing: names that are to be placed by hand.
        notes: a sentence each on what was guessed.
    """

    places: Mapping[str, Doubles]
    missing: Sequence[str]
    notes: Sequence[str]


class Head(NamedTuple):
    """A head as the package takes it; nothing of Blender's is in it.

    Attributes:
        parts: the face first, in centimetres with y up, as shape_key_head.part_of gives them.
        turn: float64[3, 3], from the head's own coordinates to these.
        fixed: landmarks that a person moved or placed, in these.
        named: the object that is the face, where a person says so; "": of several it is guessed.
    """

    parts: Sequence[native.HeadPart]
    turn: Doubles
    fixed: Mapping[str, Doubles]
    named: str


def read(context: Context, head: MeshObject, others: Sequence[MeshObject]) -> Head:
    """What the package is to know of a head.

    Args:
        context: the scene says what a unit is.
        head: the mesh that is the face.
        others: meshes that belong to it: eyes, teeth, hair.
    """
    rows = [shape_key_head.part_at_rest(context, item, head) for item in (head, *others)]
    turn = shape_key_head.turn_of(context, head)
    there = points.of(head)
    fixed = {name: turn @ place for name, place in points.by_hand(there).items()}
    return Head(rows, turn, fixed, head.name if there or not others else "")


def words() -> Mapping[str, str]:
    """What sentences call each landmark, by its name, in the package's order."""
    found: Mapping[str, str] = native.part("anyhead.landmarks.names").landmark_words()
    return found


def needed() -> frozenset[str]:
    """The landmarks without which a head becomes no face."""
    found: frozenset[str] = native.part("anyhead.landmarks.names").needed_landmarks()
    return found


def _search(head: Head, progress: Callable[[float], bool]) -> native.Landmarks:
    """The landmarks of a head, beside those that a person placed."""
    module = native.part("anyhead.landmarks.find")
    hints = module.Hints(where=head.parts[0].name, marks=dict(head.fixed))
    found: native.Landmarks = module.find_landmarks(surface_of(head.parts[0]), hints)
    progress(1.0)
    return found


def on_object(head: Head, found: native.Landmarks) -> Finding:
    """Landmarks of the package in the coordinates of the head's object.

    Args:
        head: of `read`.
        found: in the head's centimetres.
    """
    back = np.linalg.inv(head.turn)
    places = {name: back @ np.asarray(point) for name, point in found.points.items()}
    missing = [name for name in words() if name in needed() and name not in places]
    return Finding(places, missing, list(found.notes))


def marks_of(head: Head) -> native.Landmarks | None:
    """What a person said of landmarks, as the package takes it; None: nothing.

    Args:
        head: of `read`.
    """
    if not head.fixed:
        return None
    out: native.Landmarks = native.part("anyhead.landmarks.marks").Landmarks()
    for name, place in head.fixed.items():
        out.moved(name, place)
    return out


def surface_of(part: native.HeadPart) -> native.HeadSurface:
    """A mesh as risorius.anyhead.surface.Surface. Args: part  its polygons become triangles."""
    surface: native.HeadSurface = native.part("anyhead.surface").Surface.of_polygons(
        part.mesh.positions, part.mesh.faces
    )
    return surface


def find_task(head: Head) -> Task[Finding]:
    """The finding of landmarks beside Blender. Args: head  of `read`."""

    def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> Finding:
        return on_object(head, _search(head, telling(progress, cancelled)))

    return Task(work)


def text_of(head: Head, places: Mapping[str, Doubles]) -> str:
    """Landmarks as a JSON file has them. Args: head  of `read`; places  in its object's space."""
    module = native.part("anyhead.landmarks.marks")
    out = module.Landmarks()
    for name, place in places.items():
        out.moved(name, head.turn @ place)
    text: str = module.landmarks_text(out)
    return text


def read_file(head: Head, path: str) -> dict[str, Doubles]:
    """The landmarks of a JSON file, in the head's own coordinates.

    Args:
        head: of `read`.
        path: of the file.

    Raises:
        LandmarkError: the file has something else; the sentence names it.
        OSError: it cannot be read.
    """
    found = native.part("anyhead.landmarks.marks").read_landmarks(path)
    return dict(on_object(head, found).places)
