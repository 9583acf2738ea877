# SPDX-License-Identifier: MIT
"""Conform every layer of a DNA file to new vertex positions of its skin.

Names, counts and layers stay, so that a program that reads the old file also reads the new one.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ... import BlendShapeTarget, Dna, Mesh
from ...author.geometry import skeleton as sk
from ...author.geometry.skeleton import FARTHEST, Doubles
from ...base.errors import ArgumentError
from ..telling import Progress, telling
from .change import Change, Hold, similar, surface_of
from .contacts import keep_contacts
from .jaw import jaw_between, mouth_of
from .joints import Places, jaw_of, place_joints, shifts_carried
from .parts import Ball, Eye, Stiff, eyes_of, finest, kind, mouth_way, skin_of, stiff_share


class Moved(NamedTuple):
    """A mesh on both heads.

    Attributes:
        before, after: float64[V, 3], vertex positions on the source and the target head.
        linear: float64[V, 3, 3], deformation gradients.
        hold: the binding to the skin; None for the skin itself and for rigid parts.
    """

    before: Doubles
    after: Doubles
    linear: Doubles
    hold: Hold | None = None


def conform(
    dna: Dna,
    moved: Mapping[str, Doubles],
    progress: Progress | None = None,
    balls: Sequence[Ball] = (),
    teeth: Doubles | None = None,
) -> Dna:
    """Conform a face to the vertex positions of another head.

    Meshes that `moved` does not name follow the skin: lashes and coarser LODs are bound to the
    closest point, each eye keeps its shape and is fitted into the lids, and teeth and tongue move
    as one rigid part. A joint follows the skin that it carries. Blend shapes and joint translations
    are transformed by the deformation gradients. Joint rotations and the layers of solvers and
    networks stay unchanged, except that root joints are rotated with a rotated head. Controls that
    close the lids are adjusted until the lids meet again.

    Args:
        dna: the source face; it is not changed.
        moved: float64[V, 3] by mesh name, the new vertex positions in the axes and the unit of the
            file; the skin of LOD 0 is required.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.
        balls: eyeballs of the target head; each eye of the face moves to the eyeball near it.
        teeth: float64[n, 3], the lower teeth of the target head, of any topology.

    Raises:
        ArgumentError: the face has no skin mesh, or `moved` lacks the skin, names an unknown mesh,
            or has a wrong number of positions or a position that is not finite.
        Stopped: `progress` returned False.
    """
    tell = telling(progress, 0.0, 1.0)
    skin = skin_of(dna)
    given = _checked(dna, moved, skin)
    before = np.asarray(dna.meshes[skin].positions, np.float64)
    change = Change(dna.meshes[skin], before, given[dna.mesh_names[skin]])
    tell(0.2)
    world = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[:, :3, 3]
    joint = jaw_of(dna, [m for m in finest(dna) if kind(dna.mesh_names[m]) == "mouth"])
    jaw = jaw_between(dna, skin, joint, change, given, teeth)
    mouth = mouth_way(dna, change) if jaw is None else mouth_of(jaw, change.turn)
    stiff = Stiff(skin, eyes_of(dna, change, given, world, balls), mouth, joint, jaw)
    meshes: dict[int, Moved] = {}
    for m in range(min(len(dna.meshes), len(dna.mesh_names))):
        if len(dna.meshes[m].positions):
            meshes[m] = _moved(dna, m, change, stiff, given)
        tell(0.2 + 0.3 * (m + 1) / len(dna.meshes))
    places = Places(dna, {m: meshes[m][:3] for m in finest(dna)}, change, stiff)
    out = copy.copy(dna)
    out.meshes = [
        _mesh(mesh, meshes[m]) if m in meshes else mesh for m, mesh in enumerate(dna.meshes)
    ]
    tell(0.5)
    place_joints(out, places, change.turn)
    out.joint_groups = shifts_carried(dna, places, change.turn, stiff)
    tell(0.6)
    rest = telling(progress, 0.6, 1.0)
    holds = {m: own.hold for m, own in meshes.items() if own.hold is not None}
    out = keep_contacts(dna, out, skin, change, stiff.eyes, holds, rest)
    tell(1.0)
    return out


def _checked(dna: Dna, moved: Mapping[str, Doubles], skin: int) -> dict[str, Doubles]:
    if skin < 0:
        raise ArgumentError("a face with a mesh of skin at LOD 0 was expected, found none")
    if dna.mesh_names[skin] not in moved:
        raise ArgumentError(f"vertex positions of {dna.mesh_names[skin]}, the skin, were expected")
    counts = {n: len(m.positions) for n, m in zip(dna.mesh_names, dna.meshes, strict=False)}
    out = {}
    for name, points in moved.items():
        if name not in counts:
            raise ArgumentError(f"{name}: a mesh of the face was expected")
        out[name] = np.asarray(points, np.float64)
        if out[name].shape != (counts[name], 3):
            raise ArgumentError(
                f"{name}: {counts[name]:,} places were expected, found {len(out[name]):,}"
            )
        if not (np.abs(out[name]) <= FARTHEST).all():
            raise ArgumentError(
                f"{name}: a vertex lies at no place that a number can say (NaN or infinity)"
            )
    own = out[dna.mesh_names[skin]]
    if np.ptp(own, axis=0).max() <= 0:
        raise ArgumentError(f"{dna.mesh_names[skin]}: all vertices lie at one place")
    return out


def _moved(dna: Dna, m: int, change: Change, stiff: Stiff, given: Mapping[str, Doubles]) -> Moved:
    name, mesh = dna.mesh_names[m], dna.meshes[m]
    points = np.asarray(mesh.positions, np.float64)
    if m == stiff.skin:
        return Moved(points, given[name], change.linear)
    of = kind(name)
    if of == "eyes" and stiff.eyes:
        moved = _with_eyes(points, stiff.eyes)
    elif of == "mouth" and stiff.mouth is not None:
        way = similar(points, given[name], change) if name in given else stiff.mouth
        moved = Moved(points, way(points), np.tile(way.linear, (len(points), 1, 1)))
    else:
        moved = _on_skin(mesh, points, change, stiff.eyes)
    return moved._replace(after=given[name]) if name in given else moved


def _with_eyes(points: Doubles, eyes: Sequence[Eye]) -> Moved:
    """Move each vertex with the eye whose centre is closest."""
    far = np.stack([np.linalg.norm(points - eye.middle, axis=1) for eye in eyes])
    own = far.argmin(axis=0)
    after = np.stack([eye.way(points) for eye in eyes])
    linear = np.stack([eye.way.linear for eye in eyes])
    return Moved(points, after[own, np.arange(len(points))], linear[own])


def _on_skin(mesh: Mesh, points: Doubles, change: Change, eyes: Sequence[Eye]) -> Moved:
    """Move vertices with the skin, and vertices that belong to an eye (its cornea) with the eye."""
    hold = change.hold(points, mesh)
    linear = change.at(hold)
    after = change.carried(hold, linear)
    for eye in eyes:
        own = stiff_share(mesh, eye.holds)
        after[own], linear[own] = eye.way(points[own]), eye.way.linear
    return Moved(points, after, linear, hold)


def _mesh(mesh: Mesh, moved: Moved) -> Mesh:
    out = copy.copy(mesh)
    out.positions = moved.after
    out.normals = _normals(mesh, moved)
    out.blend_shape_targets = [_target(t, moved.linear) for t in mesh.blend_shape_targets]
    return out


def _target(target: BlendShapeTarget, linear: Doubles) -> BlendShapeTarget:
    at = np.asarray(target.vertex_indices, np.int64)
    deltas = np.asarray(target.deltas, np.float64)
    out = copy.copy(target)
    out.deltas = np.einsum("nij,nj->ni", linear[at], deltas)
    return out


def _normals(mesh: Mesh, moved: Moved) -> Doubles:
    """float64[N, 3]: the mesh's stored normals, rotated as its geometric vertex normals rotate."""
    own = np.asarray(mesh.normals, np.float64)
    rows = np.asarray(mesh.layout_normals, np.int64)
    vertex = np.full(len(own), -1)
    vertex[rows] = np.asarray(mesh.layout_positions, np.int64)
    used = vertex >= 0
    flat, bent = (
        surface_of(mesh, points).normals()[vertex[used]] for points in (moved.before, moved.after)
    )
    out = own.copy()
    out[used] = _turned(own[used], flat, bent)
    return out


def _turned(vectors: Doubles, start: Doubles, end: Doubles) -> Doubles:
    """float64[n, 3]: vectors after the smallest rotation from one unit vector to another."""
    axis = np.cross(start, end)
    cosine = np.einsum("ni,ni->n", start, end)[:, None]
    crossed = np.cross(axis, vectors)
    out = vectors + crossed + np.cross(axis, crossed) / np.maximum(1 + cosine, 1e-6)
    return np.where(cosine > -0.999, out, -vectors)
