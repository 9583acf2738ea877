# SPDX-License-Identifier: MIT
"""Joins the meshes of a head to one upright face in cm or m, with joints of eyes and jaw."""

from __future__ import annotations

import re
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...base.words import counted
from ..geometry.skeleton import Doubles, Ints
from ..geometry.sparse import SparseShapes
from ..input.matching import Assignment, assign
from ..input.obj import ObjMesh, ShapeFileError
from .directions import Direction, check_axes, find_direction, word_of
from .parts import HeadPart, Material, Wishes, in_face_names
from .sizes import UNITS, check_unit, face_height, find_unit, in_words
from .sorting import FACE, JAW, Places, choose_face, hung, is_coarse, is_other_head, moves, said_of
from .turning import Eye, Turn, eye_turn, jaw_turn, take_eyes

_OFF = 0.1  # in widths of the face; a face farther from x = 0 is moved there
_TOLD = 0.1  # in radii of an eye; larger displacements beside the rotation give a note
_CALLED = ((re.compile(r"lash|eyeline", re.IGNORECASE), "eyelashes"),
           (re.compile(r"brow", re.IGNORECASE), "eyebrows"))  # fmt: skip
_VOWELS = ("aa", "oh", "E")  # visemes that open the mouth, the widest first


@dataclass
class FacePart:
    """A mesh of the new face as a range of the joined mesh.

    Attributes:
        name: name without the suffix _lod0_mesh.
        start, stop: range of its vertices.
        faces: range of its polygons.
        joint: name of the joint that the mesh follows.
        material: the material of the mesh, or None.
        source: name of the object in the file to which the mesh belongs.
        polygons: indices of the mesh's polygons in this object; None: all.
    """

    name: str
    start: int
    stop: int
    faces: tuple[int, int]
    joint: str
    material: Material | None = None
    source: str = ""
    polygons: Ints | None = None


@dataclass
class Joined:
    """A joined head. x points to the left, y up, z to the front.

    Attributes:
        mesh: all meshes of the head.
        shapes: name -> displacements float64[V, 3] of all vertices.
        parts: the meshes as ranges of `mesh`; the face is the first.
        turns: joints of eyes and jaw.
        left: -1 if shapes named left move vertices at -x, otherwise 1.
        unit: "cm" or "m".
        notes: sentences on guesses and on the use of each mesh.
    """

    mesh: ObjMesh
    shapes: MutableMapping[str, Doubles]
    parts: list[FacePart]
    turns: list[Turn]
    left: int
    unit: str
    notes: list[str] = field(default_factory=list)


def join(
    where: str,
    parts: Sequence[HeadPart],
    unit: str,
    wishes: Wishes,
    edited: Mapping[str, str | list[str]],
    axes: Sequence[str] = ("+x", "+y", "+z"),
    *,
    stands: bool = False,
) -> Joined:
    """Join all meshes of a head.

    Args:
        where: name of the file in error messages.
        parts: the meshes in a common space.
        unit: unit of the format and of the result, "cm" or "m".
        wishes: the user's settings; a value that the user did not set is guessed.
        edited: name of a shape -> meaning that the user gave it, in the notation that the module
            `said` describes.
        axes: names of x, y and z in notes, each with a sign.
        stands: whether the meshes are already upright and in the unit, so that nothing is guessed.

    Raises:
        ShapeFileError: there is no face, there are two heads, or a setting is invalid.
    """
    wrong = check_axes(wishes) or (check_unit(wishes.unit) if wishes.unit else "")
    if wrong:
        raise ShapeFileError(f"{where}: source: {wrong}")
    able = [part for part in parts if part.mesh.faces]
    face = choose_face(where, able, wishes.mesh, wishes.rather)
    joining = _Joining(face, parts, unit, wishes, edited, axes)
    if stands:
        joining.take_standing()
    else:
        joining.turn_and_size()
    return joining.made()


class _Joining:
    def __init__(
        self,
        face: HeadPart,
        parts: Sequence[HeadPart],
        unit: str,
        wishes: Wishes,
        edited: Mapping[str, str | list[str]],
        axes: Sequence[str],
    ) -> None:
        self.unit, self.wishes, self.edited, self.axes = unit, wishes, edited, axes
        self.notes: list[str] = []
        self.away: dict[str, str] = {}  # left-out mesh, or mesh with left-out parts -> reason
        others, twins = [], []
        for part in parts:
            if part is face:
                continue
            if not part.mesh.faces:
                self.notes.append(f"{part.name} is left out: it has no polygons")
            elif part.source == face.source and moves(part):
                twins.append(part)  # a part of the face's mesh with another material
            elif moves(part) and is_other_head(face, part):
                self.notes.append(f"{part.name} is left out: it is another head")
            elif is_coarse(part) and moves(part):
                self.notes.append(f"{part.name} is left out: it is a coarser level")
            else:
                others.append(part)
        self.face, self.others = face, [*twins, *others]
        self.became = self._assigned([face])

    def _assigned(self, parts: Sequence[HeadPart]) -> Assignment:
        names = dict.fromkeys(name for part in parts for name in part.shapes)
        return assign([name for name in names if "+" not in name], self.edited)

    def turn_and_size(self) -> None:
        """Turn all meshes of the head upright, and scale them to the unit of the result."""
        self._turn()
        self._size()

    def take_standing(self) -> None:
        """Keep the meshes unchanged, because they are upright and in the unit of the result."""
        self.left = 1
        points, shapes = self.face.mesh.positions, self.face.shapes
        self.height = face_height(points, shapes, self.became.controls)

    def made(self) -> Joined:
        height = self.height
        opening = self._opening()
        mm = UNITS[self.unit]
        places = Places(self.face, height, mm, opening)
        moving, still = [self.face], list[HeadPart]()
        for part in self.others:
            self._sort(part, places, moving, still)
        taken = {part.source for part in (*moving, *still)}
        self.notes.extend(
            f"a part of {source} is left out: {why}"
            if source in taken
            else f"{source} is left out: {why}"
            for source, why in self.away.items()
        )
        self.became = self._assigned(moving)
        rest, eyes = take_eyes([*moving, *still], height, self._lids())
        turns = [self._eye(eye) for eye in eyes]
        hanging = [(piece, eye.joint) for eye in eyes for piece in eye.parts]
        for part in rest:
            if part.shapes and moves(part):
                hanging.insert(0, (part, FACE))
                if part.source != self.face.source:
                    self.notes.append(said_of(part, FACE, part.shapes))
            else:
                pieces = hung(part, places)
                hanging.extend(pieces)
                self.notes.extend(said_of(piece, joint, {}) for piece, joint in pieces)
        if any(joint == JAW for _, joint in hanging):
            hanging = self._jaw(hanging, opening, turns)
        return self._joined(hanging, turns)

    def _turn(self) -> None:
        """Rotate all meshes so that x points to the left, y up and z to the front."""
        face = self.face
        found = find_direction(face.mesh, face.shapes, self.became.controls, self.wishes)
        left = found.left
        mirrored = not found.agrees and (found.inside_out or bool(self.wishes.left))
        self.left = 1
        if not found.agrees and not mirrored:
            left, self.left = -left, -1
        turn = np.stack([left, found.up, found.front])
        self.notes.extend(self._about(found, mirrored=mirrored))
        # Mirroring turns polygons inside out. If they already were, mirroring corrects them.
        order = -1 if mirrored and not found.inside_out else 1
        self.face = _moved(face, turn, order=order)
        self.others = [_moved(part, turn, order=order) for part in self.others]

    def _about(self, found: Direction, *, mirrored: bool) -> list[str]:
        left, up, front = (word_of(x, self.axes) for x in (found.left, found.up, found.front))
        pairs = counted(found.named, "pair")
        if any((self.wishes.left, self.wishes.up, self.wishes.front)):
            by = "as the options say"
        elif found.named:
            by = (
                f"by the names of {pairs} and by positions"
                if found.sure_front
                else f"by the names of {pairs}"
            )
        else:
            by = "by the positions of shapes" if found.sure_front else "as usual in files"
        notes = [f"the face looks along {front}, its top is {up}, its left {left} ({by})"]
        if found.turned:
            notes.append(
                f"the face is rotated by {found.turned:.0f} degrees from the axes: it keeps this "
                "rotation"
            )
        if mirrored:
            notes.append("that is a mirrored file: x is turned round")
        elif not found.agrees:
            notes.append(
                f"names and places disagree: a face that looks along {front} has its left at "
                f"{word_of(-found.left, self.axes)}; controls go by the names, the mesh is not "
                "mirrored; left or front says otherwise"
            )
        return notes

    def _size(self) -> None:
        """Scale all meshes to the result's unit, and centre the face if it is far from x = 0."""
        wishes = self.wishes
        height = face_height(self.face.mesh.positions, self.face.shapes, self.became.controls)
        unit = wishes.unit or self.unit
        if wishes.height_mm:
            factor = wishes.height_mm / (height * UNITS[self.unit]) if height > 0 else 1.0
        else:
            scale = wishes.scale or 1.0
            sure = bool(wishes.unit or wishes.scale)
            found, odd = find_unit(height * scale, unit, sure=sure)
            factor = scale * UNITS[found] / UNITS[self.unit]
            self.notes.append(odd or f"the face is {in_words(height * scale * UNITS[found])} high")
        points = self.face.mesh.positions[:, 0] * factor
        middle = float(points.min() + points.max()) / 2
        shift = -middle if abs(middle) > _OFF * np.ptp(points) else 0.0
        if shift:
            self.notes.append(
                "the middle of the face was moved to x = 0, by "
                f"{in_words(abs(shift) * UNITS[self.unit])}"
            )
        self.height = height * factor
        if factor != 1.0 or shift:
            turn, move = np.eye(3) * factor, np.array([shift, 0.0, 0.0])
            self.face = _moved(self.face, turn, move)
            self.others = [_moved(part, turn, move) for part in self.others]

    def _sort(
        self, part: HeadPart, places: Places, moving: list[HeadPart], still: list[HeadPart]
    ) -> None:
        """Add a mesh to the moving or to the still meshes, or to the left-out meshes.

        Args:
            part: the mesh.
            places: places of the face.
            moving: receives a mesh with shapes that belongs to the head.
            still: receives a mesh without shapes that belongs to the head.
        """
        shapes = in_face_names(self.face, part)
        size = float(np.ptp(part.mesh.positions, axis=0).max()) or 1.0
        part.shapes = {n: d for n, d in shapes.items() if np.abs(d).max(initial=0) > 1e-6 * size}
        alike = [name for name in part.shapes if name in self.face.shapes]
        away = places.away(part)
        if part.shapes and (alike or not away):
            moving.append(part)
        elif away:
            self.away.setdefault(part.source, away)
        else:
            still.append(part)

    def _opening(self) -> Doubles | None:
        """Displacements of the shape that opens the mouth: jawOpen or a wide vowel; or None."""
        named = [n for n, controls in self.became.controls.items() if controls == ["jawOpen"]]
        meant = {expression: name for name, expression in self.became.expressions.items()}
        named += [meant[vowel] for vowel in _VOWELS if vowel in meant]
        found = (self.face.shapes[name] for name in named if name in self.face.shapes)
        return next((delta for delta in found if delta.any()), None)

    def _lids(self) -> dict[str, Doubles]:
        """Side -> float64[3], the mean position of the vertices that a blink moves, weighted by
        motion."""
        out = {}
        for name, controls in self.became.controls.items():
            delta = self.face.shapes.get(name)
            for control in controls if delta is not None else ():
                if control.startswith("eyeBlink") and len(controls) == 1:
                    weight = (delta**2).sum(axis=1)  # type: ignore[operator]
                    middle = weight @ self.face.mesh.positions / max(float(weight.sum()), 1e-300)
                    out["L" if middle[0] > 0 else "R"] = np.asarray(middle)
        return out

    def _eye(self, eye: Eye) -> Turn:
        turn, left = eye_turn(eye, self.became.controls)
        far = [name for name, off in left.items() if off > _TOLD * eye.ball.radius]
        names = ", ".join(dict.fromkeys(part.source or part.name for part in eye.parts))
        side = "left" if eye.side == "L" else "right"
        self.notes.append(f"{names}: the {side} eye turns with the look controls")
        if far:
            more = f" and {len(far) - 3} more" if len(far) > 3 else ""
            names = ", ".join(far[:3]) + more
            self.notes.append(f"{names}: only the rotation of the {side} eye is kept")
        return turn

    def _jaw(
        self,
        hanging: list[tuple[HeadPart, str]],
        opening: Doubles | None,
        turns: list[Turn],
    ) -> list[tuple[HeadPart, str]]:
        """Add the jaw's joint. If no shape opens the mouth, or if it rotates nothing, no joint is
        added, and the jaw's meshes follow the head.

        Args:
            hanging: each mesh, and the joint that it follows.
            opening: float64[V, 3], displacements of the shape that opens the mouth, or None.
            turns: list that receives the jaw's joint.
        """
        turn = None
        if opening is not None:
            points, whole = self.face.mesh.positions, list(self.became.expressions)
            turn = jaw_turn(points, self.face.shapes, self.became.controls, opening, whole)
        if turn is not None:
            turns.insert(0, turn)
            return hanging
        self.notes.append("jawOpen does not rotate the jaw: the meshes of the jaw follow the head")
        return [(part, "head" if joint == JAW else joint) for part, joint in hanging]

    def _joined(self, hanging: Sequence[tuple[HeadPart, str]], turns: list[Turn]) -> Joined:
        own = self.face.source
        ordered = sorted(  # the face first, then the other parts of the face's mesh
            hanging,
            key=lambda row: (row[1] != FACE, row[0].source != own, -len(row[0].mesh.positions)),
        )
        names = dict.fromkeys(n for part, _ in ordered for n in part.shapes)
        vertices = np.cumsum([0, *(len(part.mesh.positions) for part, _ in ordered)])
        shapes = self._empty(names, int(vertices[-1]))
        whole = ObjMesh(np.concatenate([p.mesh.positions for p, _ in ordered]), np.zeros((0, 2)))
        uvs, out, taken = list[Doubles](), list[FacePart](), set[str]()
        for (part, joint), start, stop in zip(ordered, vertices[:-1], vertices[1:], strict=True):
            first = len(whole.faces)
            _add(whole, uvs, part.mesh, int(start))
            for name, delta in part.shapes.items():
                if isinstance(shapes, SparseShapes):
                    shapes.add(name, delta, int(start))
                else:
                    shapes[name][start:stop] = delta
            label = _label(part.name, taken) if out else ""
            faces = (first, len(whole.faces))
            out.append(FacePart(label, int(start), int(stop), faces, joint or "head",
                                part.material, part.source, part.polygons))  # fmt: skip
        whole.uvs = np.concatenate(uvs)
        return Joined(whole, shapes, out, turns, self.left, self.unit, self.notes)

    def _empty(self, names: Mapping[str, None], count: int) -> MutableMapping[str, Doubles]:
        """Shapes of `count` vertices that do not move; SparseShapes if the face's shapes are,
        otherwise a dictionary."""
        ordered = self._in_order(names)
        if not isinstance(self.face.shapes, SparseShapes):
            return {name: np.zeros((count, 3)) for name in ordered}
        out = SparseShapes[str](count)
        for name in ordered:
            out.add(name, np.zeros((0, 3)), 0)
        return out

    def _in_order(self, names: Mapping[str, None]) -> list[str]:
        """The names of all shapes: first the face's shapes, then others, both in the file's
        order."""
        return list(dict.fromkeys([*self.face.shapes, *names]))


def _add(whole: ObjMesh, uvs: list[Doubles], mesh: ObjMesh, start: int) -> None:
    """Append a mesh to the joined mesh. All corners of a mesh without texture coordinates get the
    texture coordinate (0, 0).

    Args:
        whole: the joined mesh; changed.
        uvs: texture coordinates of the meshes that are already joined; changed.
        mesh: the mesh to append.
        start: index of its first vertex in the joined mesh.
    """
    base = sum(map(len, uvs))
    own, uv_faces = mesh.uvs, mesh.uv_faces
    if not len(own) or not all(uv_faces):
        own, uv_faces = np.zeros((1, 2)), [[0] * len(face) for face in mesh.faces]
    uvs.append(own)
    whole.faces.extend([v + start for v in face] for face in mesh.faces)
    whole.uv_faces.extend([v + base for v in face] for face in uv_faces)


def _moved(part: HeadPart, turn: Doubles, shift: Doubles | None = None, order: int = 1) -> HeadPart:
    """A transformed copy of a mesh with its shapes.

    Args:
        part: the part.
        turn: float64[3, 3], rotation and scale.
        shift: float64[3], shift after the rotation, or None.
        order: -1 reverses the polygons.
    """
    mesh = part.mesh
    points = mesh.positions @ turn.T + (0.0 if shift is None else shift)
    faces = [face[::order] for face in mesh.faces]
    uv_faces = [face[::order] for face in mesh.uv_faces]
    shapes = {name: delta @ turn.T for name, delta in part.shapes.items()}
    placed = ObjMesh(points, mesh.uvs, faces, uv_faces)
    return HeadPart(part.name, placed, shapes, part.material, part.source, part.polygons)


def _label(name: str, taken: set[str]) -> str:
    """A unique mesh name of letters, digits and _.

    Lashes and brows get the names that readers of DNA files know.

    Args:
        name: name in the file.
        taken: used names in lower case; the result is added.
    """
    name = next((word for found, word in _CALLED if found.search(name)), name)
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_") or "part"
    number, out = 1, plain
    while out.lower() in taken:
        number += 1
        out = f"{plain}{number}"
    taken.add(out.lower())
    return out
