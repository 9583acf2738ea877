# SPDX-License-Identifier: MIT
"""Transfers the expressions of a template to a head: from meshes to a face of blend shapes.

The steps: rotate and scale the head (standing), register the template's skin onto it (laying),
transfer the displacements, find or add eyes and teeth (fittings), repair lids and lips, join the
meshes (author.heads.joining), and make a Dna (author.input.shape_face).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from .. import Dna
from ..author.correctives import add_correctives
from ..author.geometry.skeleton import Doubles
from ..author.geometry.sparse import SparseShapes, subset
from ..author.heads.joining import join
from ..author.heads.parts import HeadPart, Wishes
from ..author.input.matching import Assignment
from ..author.input.shape_face import (
    ShapeSet,
    check_shapes,
    combined_rows,
    make_shape_face,
    shape_set,
    take_combined,
)
from ..author.input.spec import Read
from ..base.patience import patiently
from ..base.words import counted
from .errors import Stopped
from .fittings import Fittings, complete, head_parts, sort_parts
from .fittings.lower_teeth import jaw_by_teeth
from .landmarks.marks import Landmarks
from .laying import lay
from .repair import repair
from .standing import Standing, stand
from .surface import Surface
from .tables import copy_board
from .transfer.template import Pose, Progress, read_template
from .transfer.transfer import TransferOptions, transfer

Say = Callable[[str], None]
_READ, _CHECKED, _SHAPED = 0.1, 0.4, 0.8  # progress of shape_face
FIT_VERTICES = 12_000  # joints are fitted to a head simplified to this, see RigOptions
_JOINT = np.array([[0.0, -4.0, -6.0]])  # cm: head joint in the space of HeadForm
# Finished share of the work, 0 to 1, after finding the face, reading the template, registering the
# template onto the head, and transferring the displacements.
_FACE, _TEMPLATE, _LAID, _CARRIED = 0.2, 0.25, 0.7, 0.8
# Finished share of the work, 0 to 1, after fitting missing meshes, adding up correctives, repairing
# lids and lips, and moving lashes and brows.
_COMPLETE, _WHOLE, _MENDED, _JOINED = 0.83, 0.85, 0.97, 0.99


@dataclass(frozen=True)
class OntoOptions:
    """Options of the transfer of expressions to a head.

    Attributes:
        strength: factor of all expressions, 0 to 1.5.
        repaired: whether lids and lips are closed, and skin is taken out of eyes and teeth.
        marks: landmarks that the user placed, in the space of the head's meshes.
        wishes: properties of the head that the user gave and that are not guessed.
        threads: number of threads; 0: one for each core.
    """

    strength: float = 1.0
    repaired: bool = True
    marks: Landmarks | None = None
    wishes: Wishes = field(default_factory=Wishes)
    threads: int = 0


@dataclass
class Onto:
    """A head with expressions.

    Attributes:
        shapes: the head, y up, face towards +z. An expression has the name of the template's
            control; a corrective has the names of its controls, joined by +.
        landmarks: the landmarks in the space of the input meshes.
        joint: float64[3], position of the head joint, about which the head nods.
        notes: sentences about guesses and steps, without the notes of shape_face.
    """

    shapes: ShapeSet
    landmarks: Landmarks
    joint: Doubles
    notes: list[str] = field(default_factory=list)


def onto(
    where: str,
    parts: Sequence[HeadPart],
    unit: str,
    template: Dna,
    options: OntoOptions | None = None,
    progress: Progress | None = None,
    say: Say | None = None,
) -> Onto:
    """Transfer the expressions of a template to a head.

    Args:
        where: name of the head in error messages.
        parts: the meshes of the head in one space; their own shapes are ignored.
        unit: the unit of the head's file format, "cm" or "m".
        template: a face with expressions.
        options: options of the transfer; None: the defaults.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.
        say: receives a sentence at the beginning of each step.

    Raises:
        AnyHeadError: the meshes, the template or the options cannot be used.
        LandmarkError: no face was found in the meshes, or landmarks are missing.
        RegistrationError: no surface of the head is near the template.
        ShapeFileError: the meshes cannot be joined to a head.
        Stopped: `progress` returned False.
    """
    o, tell = options or OntoOptions(), say or _silent
    notes = _own_shapes(parts)
    tell("finding the face")
    _at(progress, 0.0)
    head = stand(where, parts, unit, o.wishes, o.marks, _part(progress, 0.0, _FACE))
    found = patiently(partial(sort_parts, head.parts), lambda: _at(progress, _FACE))
    face = found.face
    target = Surface.of_polygons(face.mesh.positions, face.mesh.faces)
    tell("reading the template")
    _at(progress, _FACE)
    source = read_template(template, _part(progress, _FACE, _TEMPLATE))
    tell(f"fitting the template ({counted(len(source.surface.points), 'vertex', 'vertices')}) to "
         f"the head ({len(target.points):,})")  # fmt: skip
    laid = lay(source, target, head.found, o.threads, _part(progress, _TEMPLATE, _LAID))
    tell(f"transferring {counted(len(source.ways), 'expression')}")
    wanted, rest = TransferOptions(o.strength, o.threads), _part(progress, _LAID, _CARRIED)
    jaw = None if laid.jaw is None else jaw_by_teeth(laid.jaw, template, found)
    carried = transfer(source, target, laid.points, laid.trust, wanted, rest, jaw)
    fitted = complete(found, template, laid.points, _part(progress, _CARRIED, _COMPLETE))
    ways = whole_ways(carried.ways, _part(progress, _COMPLETE, _WHOLE))
    del carried
    mended = _mended(target, fitted, head, ways, o, _part(progress, _WHOLE, _MENDED), tell)
    del ways
    every = head_parts(fitted, _of_length(mended, single=True), _part(progress, _MENDED, _JOINED))
    every[0].shapes.update(_of_length(mended, single=False))
    names = {name: [name] for name in source.controls}
    unchanged = Wishes(mesh=every[0].source)
    joining = partial(join, where, every, "cm", unchanged, names, stands=True)
    joined = patiently(joining, lambda: _at(progress, _JOINED))
    shapes = shape_set(template.name or "head", joined)
    _at(progress, 1.0)
    joint = head.found.pose.place(_JOINT)[0]
    return Onto(shapes, head.own, joint, [*notes, *head.notes, *fitted.notes, *joined.notes])


def _mended(
    target: Surface,
    fitted: Fittings,
    head: Standing,
    ways: SparseShapes[Pose],
    o: OntoOptions,
    progress: Progress | None,
    tell: Say,
) -> SparseShapes[Pose]:
    """The displacements of the poses, repaired unless the options forbid it or the strength is
    0."""
    if not o.repaired or not o.strength:
        return ways
    tell("repairing contacts of lids, lips, eyes and teeth")
    out = repair(
        target, fitted.face.mesh.faces, fitted, head.found.landmarks, None,
        _of_length(ways, single=True), subset(ways, [pose for pose in ways if len(pose) > 1]),
        progress,
    )  # fmt: skip
    both = SparseShapes[Pose](ways.count)
    for name in out.expressions:
        both.take((name,), out.expressions, name)
    for pose in out.combinations:
        both.take(pose, out.combinations, pose)
    return both


def _of_length(ways: SparseShapes[Pose], *, single: bool) -> SparseShapes[str]:
    """The displacements of some poses; the key of a pose is the names of its controls, joined by +.

    Args:
        ways: the displacements of all poses.
        single: True: only poses of one control; False: only poses of several controls.
    """
    out = SparseShapes[str](ways.count)
    for pose in ways:
        if (len(pose) == 1) == single:
            out.take("+".join(pose), ways, pose)
    return out


def shape_face(made: Onto, template: Dna, where: str, progress: Progress | None = None) -> Read:
    """The head with expressions as a face of blend shapes: the same type as spec.read_face()
    returns.

    Args:
        made: the head with expressions; its shapes are changed.
        template: the face whose GUI controls are copied, and the template of the result.
        where: name of the head in error messages.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        ArgumentError: no expression moves a vertex.
        Stopped: `progress` returned False.
    """
    shapes = made.shapes
    every = take_combined(shapes)
    # Correctives of controls that the head lacks are left out, such as correctives of a tongue.
    known = set(shapes.expressions)
    together = subset(every, [name for name in every if set(name.split("+")) <= known])
    notes = check_shapes(shapes, lambda: _at(progress, _READ))
    odd = [note for note in notes if "moves nothing" not in note]
    controls = {name: [name] for name in shapes.expressions}
    dna = make_shape_face(shapes, controls, lambda: _at(progress, _CHECKED))
    looks = zip(dna.mesh_names, (part.material for part in shapes.parts), strict=True)
    materials = {name: look for name, look in looks if look is not None}
    rows = combined_rows(where, shapes, together, controls, dna.raw_control_names)
    if rows:
        face = shapes.parts[0]
        _at(progress, _SHAPED)
        own = [(which, delta[face.start : face.stop]) for which, delta in rows]
        adding = partial(add_correctives, dna, 0, own)
        dna = patiently(adding, lambda: _at(progress, _SHAPED))
    copy_board(template, dna)
    _place_head(dna, made.joint)
    return Read(dna, Assignment({}, {}, {}, []), odd, materials, shapes.kept, template)


def whole_ways(ways: SparseShapes[Pose], progress: Progress | None = None) -> SparseShapes[Pose]:
    """The displacements [V, 3] by pose with all controls of the pose at 1.

    Args:
        ways: the result of `transfer`: for a control its displacements, for a corrective only its
            own addition to them.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.
    """
    out = SparseShapes[Pose](ways.count)
    for number, pose in enumerate(ways):
        _at(progress, number / len(ways))
        parts = [other for other in ways if set(other) <= set(pose)]
        if len(parts) == 1:
            out.take(pose, ways, pose)
        else:
            out[pose] = sum((ways[other] for other in parts), np.zeros(1))
    return out


def _own_shapes(parts: Sequence[HeadPart]) -> list[str]:
    count = len({name for part in parts for name in part.shapes})
    return [f"the head's own shapes are left out: {count:,}"] if count else []


def _place_head(dna: Dna, place: Doubles) -> None:
    """Move the head joint to a place; joints below it keep their positions."""
    joint = dna.joint_names.index("head")
    local = np.array(dna.neutral_joint_translations, np.float64)
    below = np.asarray(dna.joint_parents, np.int64) == joint
    below[joint] = False
    local[below] += local[joint] - place
    local[joint] = place
    dna.neutral_joint_translations = local


def _silent(_line: str) -> None:
    pass


def _at(progress: Progress | None, share: float) -> None:
    if progress is not None and progress(share) is False:
        raise Stopped


def _part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    return None if progress is None else lambda share: progress(begin + share * (end - begin))
