# SPDX-License-Identifier: MIT
"""A face takes the form of a head: a sculpt of its own topology, or any other mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ... import Dna
from ...author.geometry.rigid import rigid_fit
from ...author.geometry.skeleton import Doubles
from ...author.heads.parts import HeadPart, Wishes
from ...author.heads.sizes import UNITS
from ...author.heads.turning import take_eyes
from ...author.input.obj import ObjMesh
from ...base.words import joined
from ...web.kinds import kind_of
from ..errors import AnyHeadError, Stopped
from ..form.standing import CHIN, TOP
from ..landmarks.find import Hints, find_form
from ..landmarks.marks import Landmarks
from ..landmarks.start import start_of
from ..registration import RegisterOptions, StoppedError, register
from ..standing import Standing, stand
from ..surface import Surface
from .change import surface_of
from .face import Progress, conform, telling
from .parts import Ball, finest, skin_of
from .same import has_polygons_of, into_own_space, sculpted, turn_back

_DIRECTIONS = {
    "right": (1, 0, 0),
    "left": (-1, 0, 0),
    "up": (0, 1, 0),
    "down": (0, -1, 0),
    "front": (0, 0, 1),
    "back": (0, 0, -1),
}
_STOOD, _LAID = 0.15, 0.75  # shares of the work at whose ends the steps are


@dataclass
class Conformed:
    """A face that took the form of a head.

    Attributes:
        dna: the face.
        moved: float64[V, 3], where its skin lies now.
        sculpted: the meshes that the head has with the face's own polygons; none where the face's
            topology was laid onto another.
        notes: what was guessed and done, a sentence each.
    """

    dna: Dna
    moved: Doubles
    sculpted: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def conform_face(
    dna: Dna,
    parts: Sequence[HeadPart],
    marks: Landmarks | None = None,
    progress: Progress | None = None,
    *,
    where: str = "the head",
    unit: str = "cm",
    wishes: Wishes | None = None,
    threads: int = 0,
) -> Conformed:
    """The face with the form of a head: the same names, counts and layers.

    A head that has the face's own polygons, cut into triangles or not, gives the places of their
    vertices; onto another one the skin of the face is laid, and its own eyes say where eyes are.
    The face stays where it is: a head of another place, unit or direction comes there.

    Args:
        dna: stays as it is.
        parts: the meshes of the head in one space.
        marks: landmarks that a person gave, in the space of the parts.
        progress: told the share that is done, 0 to 1; False stops.
        where: what errors call the head.
        unit: of the numbers as the format of the head has it, "cm" or "m".
        wishes: what is said of the head and not guessed.
        threads: 0: one for each core.

    Raises:
        AnyHeadError: no polygons, no skin to the face, or wishes that cannot be.
        LandmarkError: no face, or landmarks that are missing.
        RegistrationError: nothing of the head near the face.
        Stopped: progress said False.
    """
    wishes = wishes or Wishes()
    skin = skin_of(dna)
    if skin < 0:
        raise AnyHeadError("a face with a mesh of skin at LOD 0 was expected, found none")
    name = dna.mesh_names[skin]
    named = [part for part in parts if part.source == wishes.mesh] if wishes.mesh else parts
    moved = sculpted(dna, named)
    if name in moved:
        if wishes.height_mm:
            raise AnyHeadError(
                f"{where}: the head has the face's own polygons and is as large as its numbers "
                "say; scale multiplies them, a height was not expected"
            )
        there, note = into_own_space(dna, moved, wishes.scale or None)
        notes = [f"{joined(list(there))}: the head has the face's own polygons", note]
        made = conform(dna, there, telling(progress, 0.0, 1.0))
        return Conformed(made, there[name], list(there), [n for n in notes if n])
    standing = stand(where, parts, unit, wishes, marks)
    telling(progress, 0.0, _STOOD)(1.0)
    points, balls = _laid(dna, skin, standing, threads, progress)
    made = conform(dna, {name: points}, telling(progress, _LAID, 1.0), balls)
    return Conformed(made, points, [], standing.notes)


def parts_of(dna: Dna) -> list[HeadPart]:
    """The meshes of LOD 0 of a face, as those of a head.

    Args:
        dna: the face.
    """
    out = []
    for m in finest(dna):
        name, mesh = dna.mesh_names[m], dna.meshes[m]
        corners = np.asarray(mesh.layout_positions, np.int64)[np.asarray(mesh.face_layouts)]
        faces = [own.tolist() for own in np.split(corners, mesh.face_offsets[1:-1])]
        places = np.asarray(mesh.positions, np.float64) @ standing_axes(dna)
        out.append(HeadPart(name, ObjMesh(places, np.zeros((0, 2)), faces), source=name))
    return out


def _laid(
    dna: Dna, skin: int, standing: Standing, threads: int, progress: Progress | None
) -> tuple[Doubles, list[Ball]]:
    """Where the vertices of the face's skin lie on a head, and the head's eyeballs; in the axes,
    the unit and the place of the face."""
    axes, size = standing_axes(dna), mm_of(dna) / UNITS["cm"]
    before = np.asarray(dna.meshes[skin].positions, np.float64)
    template = _outward(surface_of(dna.meshes[skin], size * before @ axes))
    target, balls = _face_of(standing)
    own = find_form(template, Hints(dna.name or "the face", {}, np.eye(3)[1], np.eye(3)[2]))
    found = standing.found
    pairs = [
        (int(np.square(template.points - p).sum(axis=1).argmin()), found.landmarks.points[n])
        for n, p in own.landmarks.points.items()
        if n in found.landmarks.points
    ]
    try:
        laid = register(
            template,
            target,
            [(vertex, point.tolist()) for vertex, point in pairs],
            RegisterOptions(threads=threads),
            start_of(template, target, own, found),
            telling(progress, _STOOD, _LAID),
        )
    except StoppedError:
        raise Stopped from None
    turn, _ = rigid_fit(template.points, laid.points)
    back = turn_back(turn)
    sure = laid.trusted if laid.trusted.any() else np.ones(len(before), bool)
    shift = template.points[sure].mean(axis=0) - (laid.points[sure] @ back.T).mean(axis=0)

    def there(places: Doubles) -> Doubles:
        return np.asarray((places @ back.T + shift) @ axes.T / size)

    return there(laid.points), [Ball(there(b.middle[None])[0], b.radius / size) for b in balls]


def _face_of(standing: Standing) -> tuple[Surface, list[Ball]]:
    """The skin that the face of a head is on, without eyes, and the eyeballs."""
    marks = standing.found.landmarks.points
    middles = {side: (marks[f"eye_inner_{side}"] + marks[f"eye_outer_{side}"]) / 2 for side in "LR"}
    shift = np.array([(middles["L"] + middles["R"])[0] / 2, 0.0, 0.0])
    centred = [_shifted(part, -shift) for part in standing.parts]
    height = (TOP - CHIN) * standing.found.pose.scale
    rest, eyes = take_eyes(centred, height, {s: m - shift for s, m in middles.items()})
    able = [part for part in rest if kind_of(part.name) == "skin" and part.mesh.faces] or rest
    places = np.array(list(marks.values())) - shift

    def away(part: HeadPart) -> float:
        points = part.mesh.positions
        return float(np.mean([np.square(points - p).sum(axis=1).min() for p in places]))

    mesh = min(able, key=away).mesh
    surface = Surface.of_polygons(mesh.positions + shift, mesh.faces)
    return surface, [Ball(eye.ball.middle + shift, eye.ball.radius) for eye in eyes]


def _shifted(part: HeadPart, shift: Doubles) -> HeadPart:
    mesh = replace(part.mesh, positions=part.mesh.positions + shift)
    return replace(part, mesh=mesh, shapes={})


def _outward(surface: Surface) -> Surface:
    """The same with triangles that face outward; a mirrored file has them the other way."""
    middle = surface.points.mean(axis=0)
    corners = surface.points[surface.triangles[:, 0]] - middle
    if float((corners * surface.face_normals()).sum()) >= 0:
        return surface
    return Surface(surface.points, surface.triangles[:, ::-1])


def is_same_topology(dna: Dna, mesh: ObjMesh) -> bool:
    """Whether a mesh is a sculpt of a face's skin: its vertices and polygons.

    Args:
        dna: the face.
        mesh: in question.
    """
    skin = skin_of(dna)
    return skin >= 0 and has_polygons_of(dna.meshes[skin], mesh)


def standing_axes(dna: Dna) -> Doubles:
    """float64[3, 3]: rows are the file's axes in x left, y up, z front; points @ it stand.

    Args:
        dna: the face.
    """
    return np.array([_DIRECTIONS[name] for name in dna.coordinate_system], np.float64)


def mm_of(dna: Dna) -> float:
    """Millimetres of a unit of the file."""
    return UNITS.get(dna.translation_unit, UNITS["cm"])
