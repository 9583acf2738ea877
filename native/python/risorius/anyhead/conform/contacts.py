# SPDX-License-Identifier: MIT
"""Adjust controls that close the lids, so that the lids meet on the target head.

The deformation gradient of a lid does not contain the height of the eye opening. For each control
that brings two lids into contact on the source head, its joint motions are therefore scaled until
the same points meet on the target head. Joints act at all LODs. The blend shapes of the control
store the remaining difference.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import Dna, Mesh, Rig, _native
from ...author.geometry import skeleton as sk
from ...author.geometry.skeleton import Doubles, Ints
from ...solving.surface import Surface as Skins
from ..surface import Surface
from .change import Change, Hold
from .parts import Eye

# Fractions of the smoothing radius (2 cm on a head of 24 cm): least motion of a vertex that comes
# into contact, largest distance in contact, least distance in the neutral pose, and largest gap
# that is not corrected.
_FAR, _NEAR, _APART, _LEAST = 0.1, 0.05, 0.12, 0.004
_FACING = 0.2  # least cosine between one normal and the opposite of the other normal
# Standard deviations of the correction around a contact, for joints and for shapes, as fractions of
# the smoothing radius of 2 cm.
_BY_JOINTS, _BY_SHAPES = 0.25, 0.05
_SEEN = 0.001  # smoothing radii: shorter deltas are not added to a blend shape
# _MOST: largest fraction of a joint motion that is added to it or removed from it. _FEW: a control
# with fewer contacts is not corrected.
_MOST, _FEW = 0.8, 8
# _LARGEST: largest displacement that one step adds to a blend shape, in smoothing radii. _FADES:
# standard deviation, in smoothing radii, of the Gaussian by which these displacements fade out with
# the distance from the closest contact.
_LARGEST, _FADES = 0.15, 0.5
_OVERLAP = 1.5  # standard deviations of the gaps: overlap of the lids that the joints aim at
_LIDS = 1.7  # radii of an eye: skin within this distance of the eye's centre is a lid


class Touch(NamedTuple):
    """Contacts of the skin with itself at a control value of 1.

    Attributes:
        vertex: int64[n], the vertices in contact.
        corners: int64[n, 3], the triangle that each vertex touches.
        shares: float64[n, 3], barycentric coordinates of the contact point.
        away: float64[n, 3], from the contact point to the vertex.
    """

    vertex: Ints
    corners: Ints
    shares: Doubles
    away: Doubles


class _Posed:
    """Vertex positions of the skin of a face, in the rest pose or with one control at 1."""

    def __init__(self, dna: Dna, skin: int) -> None:
        self.dna, self.skin = dna, skin
        self.rig = Rig(dna)
        count = len(dna.meshes[skin].positions)
        points = np.stack([np.full(count, skin), np.arange(count)], axis=1)
        self._probe = Skins(dna, self.rig, 0).probe(points)
        self.rest = np.asarray(self._probe.positions(self.raw()), np.float64)

    def raw(self, control: int = -1) -> npt.NDArray[np.float32]:
        """float32[R]: the raw controls of the rest pose. The control of index `control` is at 1 if
        the index is 0 or more."""
        out = np.array(self.rig.initial_raw_controls, np.float32)
        if control >= 0:
            out[control] = 1
        return out

    def at(self, control: int) -> Doubles:
        """float64[V, 3]: vertex positions of the skin with one control at 1.

        Args:
            control: index of the raw control; the others have their values of the rest pose.
        """
        return np.asarray(self._probe.positions(self.raw(control)), np.float64)


def keep_contacts(
    dna: Dna,
    out: Dna,
    skin: int,
    change: Change,
    eyes: Sequence[Eye],
    holds: Mapping[int, Hold],
    tell: Callable[[float], object],
) -> Dna:
    """Correct the lid controls of a conformed face.

    Args:
        dna: the source face.
        out: the conformed face; it is not changed.
        skin: the index of the skin mesh.
        change: the deformation of the skin.
        eyes: the eyeballs.
        holds: bindings of the meshes that follow the skin, by mesh index.
        tell: receives the finished share of the work, 0 to 1.
    """
    if not eyes or not len(dna.raw_control_names):
        return out
    before = _Posed(dna, skin)
    lids = np.zeros(len(before.rest), bool)
    for eye in eyes:
        lids |= np.linalg.norm(before.rest - eye.middle, axis=1) < _LIDS * eye.radius
    if not lids.any():
        return out
    after = _Posed(out, skin)
    count = len(dna.raw_control_names)
    touches: dict[int, Touch] = {}
    for control in range(count):
        touch = _touch(before, control, change, lids)
        if touch is not None:
            touches[control] = touch
        tell(0.5 * (control + 1) / count)
    for number, (control, touch) in enumerate(touches.items()):
        for missing, mended, rounds in _STEPS:
            for _ in range(rounds):
                more = missing(after, control, touch, change)
                grown = None if more is None else mended(after, control, more, holds, change)
                if grown is None:
                    break
                after = _Posed(grown, skin)
        tell(0.5 + 0.5 * (number + 1) / len(touches))
    return after.dna


def _touch(face: _Posed, control: int, change: Change, lids: npt.NDArray[np.bool_]) -> Touch | None:
    """The contacts of the lids at the value 1 of a control; None if there are fewer than _FEW
    (8)."""
    posed = face.at(control)
    far = np.linalg.norm(posed - face.rest, axis=1)
    moving = np.flatnonzero(lids & (far > _FAR * change.reach))
    if not len(moving):
        return None
    around = Surface(posed, change.before.triangles[lids[change.before.triangles].any(axis=1)])
    normals = around.normals()[moving]
    found, shares, _ = _native.ClosestPoints(posed, around.triangles.astype(np.int32)).nearest(
        posed[moving], -normals, _FACING, _NEAR * change.reach
    )
    hit = np.flatnonzero(found >= 0)
    of, shares = around.triangles[found[hit].astype(np.int64)], np.asarray(shares)[hit]
    vertex = moving[hit]
    place = np.einsum("nk,nkd->nd", shares, posed[of])
    away = posed[vertex] - place
    rest = face.rest[vertex] - np.einsum("nk,nkd->nd", shares, face.rest[of])
    before = np.einsum("nd,nd->n", -away, normals[hit]) > -0.5 * _NEAR * change.reach
    apart = np.linalg.norm(rest, axis=1) > np.maximum(
        _APART * change.reach, 2 * np.linalg.norm(away, axis=1)
    )
    kept = before & apart
    if kept.sum() < _FEW:
        return None
    return Touch(vertex[kept], of[kept], shares[kept], away[kept])


def _gaps(face: _Posed, posed: Doubles, touch: Touch, change: Change) -> Doubles:
    """float64[n, 3]: from each vertex to the position at which the contact is restored."""
    other = np.einsum("nk,nkd->nd", touch.shares, posed[touch.corners])
    wanted = np.einsum("nij,nj->ni", change.linear[touch.vertex], touch.away)
    return np.asarray(other + wanted - posed[touch.vertex])


def _farther(face: _Posed, control: int, touch: Touch, change: Change) -> Doubles | None:
    """float64[V]: fraction by which the motion of each vertex must grow; None if there is no
    gap."""
    posed = face.at(control)
    ways = posed - face.rest
    way = ways[touch.vertex] - np.einsum("nk,nkd->nd", touch.shares, ways[touch.corners])
    gaps = _gaps(face, posed, touch, change)
    square = np.einsum("nd,nd->n", way, way)
    share = np.einsum("nd,nd->n", gaps, way) / np.maximum(square, 1e-12 * change.reach**2)
    length = np.sqrt(square)
    # At LODs without blend shapes only joints close the lids, and overlapping lids are better
    # than a gap. So the joints aim at an overlap.
    share += _OVERLAP * np.std(share * length) / np.maximum(length, 1e-6 * change.reach)
    if np.median(np.abs(share) * length) < _LEAST * change.reach:
        return None
    out = np.zeros(len(posed))
    moving = _moving(ways, change)
    for own in np.array_split(moving, len(moving) // 1024 + 1):
        weight, near = _around(face.rest[own], face.rest[touch.vertex], _BY_JOINTS * change.reach)
        out[own] = weight @ share.clip(-_MOST, _MOST) / weight.sum(axis=1)
        out[own] *= np.exp(-near / (2 * change.reach**2))
    return out


def _nearer(face: _Posed, control: int, touch: Touch, change: Change) -> Doubles | None:
    """float64[V, 3]: displacement to add to each vertex so that the lids meet; None if there is no
    gap.

    The gap is divided between both lids in proportion to their motion by the control. The
    displacements fade out with the distance from the closest contact.
    """
    posed = face.at(control)
    ways = posed - face.rest
    own_way = ways[touch.vertex]
    other_way = np.einsum("nk,nkd->nd", touch.shares, ways[touch.corners])
    length, beside = (np.linalg.norm(way, axis=1) for way in (own_way, other_way))
    gaps = _gaps(face, posed, touch, change)
    if np.quantile(np.linalg.norm(gaps, axis=1), 0.9) < _LEAST * change.reach:
        return None
    gaps *= (length / np.maximum(length + beside, 1e-12))[:, None]
    most = _LARGEST * change.reach
    gaps *= np.minimum(1, most / np.maximum(np.linalg.norm(gaps, axis=1), 1e-12))[:, None]
    out = np.zeros_like(posed)
    moving = _moving(ways, change)
    for own in np.array_split(moving, len(moving) // 1024 + 1):
        weight, near = _around(face.rest[own], face.rest[touch.vertex], _BY_SHAPES * change.reach)
        alike = ways[own] @ own_way.T
        far = np.linalg.norm(ways[own], axis=1)
        weight = weight * np.maximum(alike, 0)  # excludes the opposite lid
        total = weight.sum(axis=1)
        total, none = np.where(total > 0, total, 1), total <= 0
        goes = np.clip(far / np.maximum(weight @ length / total, 1e-12), 0, 1)
        goes[none] = 0
        fades = goes * np.exp(-near / (2 * (_FADES * change.reach) ** 2))
        out[own] = fades[:, None] * (weight @ gaps) / total[:, None]
    return out


def _moving(ways: Doubles, change: Change) -> Ints:
    return np.flatnonzero(np.linalg.norm(ways, axis=1) > 1e-3 * change.reach)


def _around(points: Doubles, places: Doubles, reach: float) -> tuple[Doubles, Doubles]:
    """float64[n, m]: Gaussian weights of the m contacts at each of n points; float64[n]: the
    squared distance of each point from its closest contact.

    Args:
        points: float64[n, 3].
        places: float64[m, 3], positions of the contacts.
        reach: standard deviation of the Gaussian.
    """
    apart = ((points[:, None] - places) ** 2).sum(axis=2)
    near = apart.min(axis=1)
    return np.exp(-(apart - near[:, None]) / (2 * reach**2)), near


def _joints_go_on(face: _Posed, control: int, more: Doubles, *_: object) -> Dna | None:
    """The face with scaled joint motions of a control; None if the control moves no joint.

    Args:
        face: the face.
        control: index of the raw control.
        more: float64[V], fraction by which the motion of each vertex must grow. Each joint grows
            by the mean fraction of its vertices, weighted by their skin weights.
    """
    dna = face.dna
    vertex, joint, weight = sk.skin_entries(dna.meshes[face.skin])
    held = np.bincount(joint, weights=weight, minlength=len(dna.joint_names))
    share = np.bincount(joint, weights=weight * more[vertex], minlength=len(held))
    share = share / np.maximum(held, 1e-12)
    groups, changed = [], False
    for group in dna.joint_groups:
        columns = np.flatnonzero(np.asarray(group.input_indices) == control)
        rows = np.asarray(group.output_indices, np.int64)
        if not len(columns) or not len(rows):
            groups.append(group)
            continue
        values = np.asarray(group.values, np.float64).copy()
        values[:, columns] *= (1 + share[rows // 9])[:, None]
        changed = changed or bool(values[:, columns].any())
        own = copy.copy(group)
        own.values = values
        groups.append(own)
    if not changed:
        return None
    out = copy.copy(dna)
    out.joint_groups = groups
    return out


def _shapes_go_on(
    face: _Posed, control: int, ways: Doubles, holds: Mapping[int, Hold], change: Change
) -> Dna | None:
    """The face with displacements added to the blend shapes of a control, on the skin and on the
    meshes that follow it; None if none of them has a blend shape of the control.

    Args:
        face: the face.
        control: index of the raw control.
        ways: float64[V, 3], displacements of the skin as it is posed with the control at 1. They
            are converted to displacements before skinning.
        holds: bindings of the meshes that follow the skin, by mesh index.
        change: the deformation from the source head to the target head.
    """
    dna = face.dna
    channels = dna.blend_shape_channels
    driven = np.asarray(channels.output_indices)[np.asarray(channels.input_indices) == control]
    motions = _motions(dna, face, control)
    changed, meshes = False, list(dna.meshes)
    for m, mesh in enumerate(meshes):
        if m != face.skin and m not in holds:
            continue
        theirs = [t.blend_shape_channel_index in driven for t in mesh.blend_shape_targets]
        if not any(theirs):
            continue
        out = copy.copy(mesh)
        out.blend_shape_targets = [
            _longer(mesh, target, ways, holds.get(m), change, motions) if own else target
            for target, own in zip(mesh.blend_shape_targets, theirs, strict=True)
        ]
        meshes[m], changed = out, True
    if not changed:
        return None
    result = copy.copy(dna)
    result.meshes = meshes
    return result


def _motions(dna: Dna, face: _Posed, control: int) -> Doubles:
    """float64[J, 3, 3]: the linear part of each joint's skinning matrix with a control at 1."""
    deltas = np.asarray(face.rig.evaluate(face.raw(control)).joints, np.float64)
    rest = sk.world_matrices(dna, np.zeros_like(deltas))[:, :3, :3]
    return sk.world_matrices(dna, deltas)[:, :3, :3] @ np.linalg.inv(rest)


def _longer(
    mesh: Mesh,
    target: _native.BlendShapeTarget,
    ways: Doubles,
    hold: Hold | None,
    change: Change,
    motions: Doubles,
) -> _native.BlendShapeTarget:
    """The blend shape target with displacements added, so that the posed mesh moves by `ways`.

    Args:
        mesh: the mesh of the target.
        target: the blend shape target; it is not changed.
        ways: float64[V, 3], displacements of the vertices of the posed skin.
        hold: the binding of the mesh to the skin; None: the mesh is the skin.
        change: the deformation of the skin.
        motions: float64[J, 3, 3], the result of _motions.
    """
    if hold is None:
        way = ways
    else:
        corners = change.before.triangles[hold.triangle]
        way = np.einsum("nk,nkd->nd", hold.shares, ways[corners])
    own = np.asarray(target.vertex_indices, np.int64)
    moving = np.flatnonzero(np.linalg.norm(way, axis=1) > _SEEN * change.reach)
    at = np.union1d(own, moving)
    vertex, joint, weight = sk.skin_entries(mesh)
    turns = np.zeros((len(mesh.positions), 9))
    rows = weight[:, None] * motions[joint].reshape(-1, 9)
    for k in range(9):
        turns[:, k] = np.bincount(vertex, weights=rows[:, k], minlength=len(turns))
    deltas = np.zeros((len(at), 3))
    deltas[np.searchsorted(at, own)] = target.deltas
    linear = turns[at].reshape(-1, 3, 3) + 1e-9 * np.eye(3)
    deltas += np.linalg.solve(linear, way[at][:, :, None])[:, :, 0]
    out = copy.copy(target)
    out.vertex_indices, out.deltas = at, deltas
    return out


_STEPS = ((_farther, _joints_go_on, 2), (_nearer, _shapes_go_on, 4))
