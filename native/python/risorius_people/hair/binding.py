# SPDX-License-Identifier: MIT
"""Binds hair cards to a face: each vertex gets the weights and blend shapes of the skin below it.

Cards are bound to the finished face, so the hair moves with the skin of any rig, and the fits of
the rig need not handle hair.
"""

from __future__ import annotations

import re

import numpy as np
from risorius import BlendShapeTarget, Dna, Mesh
from risorius.author.geometry import skeleton as sk
from risorius.author.geometry.polygon_mesh import polygon_mesh

from ..polygons import Floats, Ints
from .strips import Strips, card_faces, card_vertices
from .strips import unit as unit_vectors
from .surface import Roots, about, nearest_places, nearest_rows

_LEAST_WEIGHT = 0.01  # smaller skin weights are dropped
ARM = 0.8  # centimetres: a hair turns with the skin as if it were at most this long
_MOST_INFLUENCES = 8  # joints per vertex
# Controls that move upper and lower lip, or upper and lower lid, differently.
_PARTING = tuple(f"CTRL_expressions.{name}" for name in ("jawOpen", "eyeBlinkL", "eyeBlinkR"))


def head_of(dna: Dna, lod: int) -> Mesh | None:
    """The head mesh of a LOD, or None if the LOD has none.

    Args:
        dna: a sample face.
        lod: number of the LOD.
    """
    for m in (int(i) for i in dna.lod_mesh_mapping[lod]):
        if re.match(r"head_lod\d+_mesh$", dna.mesh_names[m]):
            return dna.meshes[m]
    return None


def corners_of(mesh: Mesh) -> tuple[Ints, Ints]:
    """int64[T, 3], vertices of the triangles into which a mesh's polygons are split; int64[V, n],
    indices of the triangles at each vertex. The row of a vertex with fewer than n triangles
    repeats its last index."""
    offsets = np.asarray(mesh.face_offsets, np.int64)
    layouts = np.asarray(mesh.layout_positions, np.int64)[np.asarray(mesh.face_layouts, np.int64)]
    sizes = np.diff(offsets)
    parts = []
    for size in np.unique(sizes).tolist():
        rows = layouts[offsets[:-1][sizes == size][:, None] + np.arange(size)]
        parts += [rows[:, [0, k, k + 1]] for k in range(1, size - 1)]
    triangles = np.concatenate(parts)
    return triangles, about(triangles, len(mesh.positions))


def whereabouts(dna: Dna, head: Mesh) -> Floats:
    """float64[V, 12]: positions when neutral, with an open jaw, and with either eye closed.

    The poses move upper and lower lips and lids differently. Therefore the point of another head
    with the nearest 12 numbers is on the same lip or lid, although neutral lips touch.

    Args:
        dna: face with the controls.
        head: a head mesh of any LOD.
    """
    count = len(dna.raw_control_names)
    motions = sk.column_motions(dna, sk.column_count(dna))[:count]
    weights = sk.dense_weights(head, len(dna.joint_names))
    positions = np.asarray(head.positions, np.float64)
    shapes = sk.column_shapes(dna, head, count)
    out = [positions]
    for name in _PARTING:
        column = list(dna.raw_control_names).index(name)
        out.append(sk.skinned(positions + shapes.get(column, 0.0), weights, motions[column]))
    return np.concatenate(out, axis=1)


def holds(head: Mesh, strips: Strips, unit: float, own: Floats | None, there: Floats) -> Roots:
    """The places on the skin that the vertices of the cards follow.

    Args:
        head: the head mesh of the LOD.
        strips: the hair of the LOD.
        unit: length of the strips' unit in the unit of the mesh.
        own: float64[n, 12], `whereabouts` of the roots on the head of LOD 0; each root gets the
            place on this head with the nearest 12 numbers. None: this head is LOD 0.
        there: float64[V, 12], `whereabouts` of the head's vertices.
    """
    positions = np.asarray(head.positions, np.float64) / unit
    triangles, around = corners_of(head)
    rooted = strips.roots
    if own is not None:
        vertex = nearest_rows(own, there)
        rooted = nearest_places(positions, triangles, around, strips.points[:, 0], vertex)
    corners = np.repeat(rooted.corners[:, None], strips.rows, axis=1)
    shares = np.repeat(rooted.shares[:, None], strips.rows, axis=1)
    with_skin = strips.held > 0
    if with_skin.any():
        later = strips.points[with_skin, 1:]
        rows = nearest_places(positions, triangles, around, later.reshape(-1, 3))
        corners[with_skin, 1:] = rows.corners.reshape(*later.shape[:2], 3)
        shares[with_skin, 1:] = rows.shares.reshape(*later.shape[:2], 3)
    return Roots(
        np.repeat(corners.reshape(-1, 3), 2, axis=0), np.repeat(shares.reshape(-1, 3), 2, axis=0)
    )


def card_mesh(strips: Strips, unit: float) -> Mesh:
    """The cards as a mesh without skin weights and blend shapes.

    Args:
        strips: the hair, in decimetres.
        unit: length of the strips' unit in the unit of the mesh.
    """
    positions, normals = card_vertices(strips)
    faces, uvs = card_faces(strips)
    return polygon_mesh(positions * unit, normals, faces, uvs, faces)


class Turning:
    """Rotates cards where a blend shape tilts the skin.

    A joint rotates the cards by itself, but a blend shape only shifts their roots: without this
    rotation the beard on a lip that rolls in would be inside the skin.

    Args:
        head: the mesh of the skin.
        places: place on the skin for each vertex of the cards.
        mesh: the cards.
    """

    def __init__(self, head: Mesh, places: Roots, mesh: Mesh) -> None:
        triangles, _ = corners_of(head)
        used, rows = np.unique(places.corners, return_inverse=True)
        row = np.full(len(head.positions), len(used))
        row[used] = np.arange(len(used))
        self._triangles = triangles[(row[triangles] < len(used)).any(axis=1)]
        self._rows = row[self._triangles].ravel()
        self._count = len(used)
        self._places = Roots(rows.reshape(places.corners.shape), places.shares)
        self._skin = np.asarray(head.positions, np.float64)
        off = np.asarray(mesh.positions, np.float64) - places.of(self._skin)
        far = np.linalg.norm(off, axis=1, keepdims=True)
        self._off = off * np.minimum(1.0, ARM / far.clip(1e-12))
        self._normals = self._normals_at(self._skin)

    def _normals_at(self, skin: Floats) -> Floats:
        """float64[n, 3]: for each vertex of the cards, the unit normal at its place on the skin.

        Args:
            skin: float64[V, 3], positions of the skin's vertices.
        """
        a, b, c = (skin[self._triangles[:, k]] for k in range(3))
        faces = np.repeat(np.cross(b - a, c - a), 3, axis=0)
        sums = [np.bincount(self._rows, faces[:, k], self._count + 1) for k in range(3)]
        return unit_vectors(self._places.of(unit_vectors(np.stack(sums, axis=1)[:-1])))

    def of(self, delta: Floats) -> Floats:
        """float64[n, 3]: displacement of the cards by their rotation, to add to the shift of the
        skin.

        Args:
            delta: float64[V, 3], the shape's displacement of the skin.
        """
        return turned(self._off, self._normals, self._normals_at(self._skin + delta))


def turned(off: Floats, was: Floats, now: Floats) -> Floats:
    """float64[..., 3]: displacement of the ends of hairs if the skin's normal rotates.

    Args:
        off: float64[..., 3], vector from the point on the skin to the hair's end.
        was, now: float64[..., 3], unit normals before and after the rotation.
    """
    axis = np.cross(was, now)
    # limits the angle to 120 degrees, because at 180 degrees the axis is undefined
    cosine = (was * now).sum(axis=-1, keepdims=True).clip(-0.5)
    across = np.cross(axis, off)
    return np.asarray(across + np.cross(axis, across) / (1 + cosine))


def bind(
    dna: Dna,
    mesh: Mesh,
    head: Mesh,
    places: Roots,
    least: float,
    rigid: bool,
    turns_itself: bool = False,
) -> None:
    """Gives cards the skin weights and blend shapes of their places on the skin.

    Args:
        dna: face with the joints.
        mesh: the cards; changed.
        head: the mesh of the skin.
        places: place on the skin for each vertex of the cards.
        least: length in the unit of the mesh; a shape whose largest displacement is smaller is left
            out.
        rigid: whether places that move less than `least` follow the head joint alone.
        turns_itself: whether to leave out the rotation of cards by blend shapes, because the caller
            adds shapes with its own rotation.
    """
    weights = places.of(sk.dense_weights(head, len(dna.joint_names)))
    if rigid:
        still = _still(dna, head, places, least)
        weights[still] = np.eye(weights.shape[1])[list(dna.joint_names).index("head")]
    most = min(_MOST_INFLUENCES, weights.shape[1])
    few = np.partition(weights, -most, axis=1)[:, [-most]]
    weights = np.where((weights >= few) & (weights > _LEAST_WEIGHT), weights, 0)
    weights /= weights.sum(axis=1, keepdims=True)
    vertex, joint = np.nonzero(weights)
    counts = (weights > 0).sum(axis=1)
    mesh.skin_offsets = np.concatenate([[0], np.cumsum(counts)])
    mesh.skin_weights, mesh.skin_joint_indices = weights[vertex, joint], joint
    mesh.maximum_influence_per_vertex = int(counts.max())
    turning = None if turns_itself else Turning(head, places, mesh)
    targets = []
    for target in head.blend_shape_targets:
        delta = np.zeros((len(head.positions), 3))
        delta[np.asarray(target.vertex_indices, np.int64)] = np.asarray(target.deltas)
        own = places.of(delta)
        if turning is not None and own.any():
            own += turning.of(delta)
        far = np.abs(own).max(axis=1)
        if far.max(initial=0) < least:
            continue
        moved = np.flatnonzero(far > least / 4)
        channel = int(target.blend_shape_channel_index)
        targets.append(
            BlendShapeTarget(
                deltas=own[moved], vertex_indices=moved, blend_shape_channel_index=channel
            )
        )
    mesh.blend_shape_targets = targets


def _still(dna: Dna, head: Mesh, places: Roots, least: float) -> Floats:
    """bool[n]: whether a place stays still relative to the head joint.

    A place stays still if each control, except the controls of head and neck, moves it by less than
    `least`, and if its weights of joints other than the head joint and its descendants are
    negligible.

    Args:
        dna: the face.
        head: the mesh of the skin.
        places: the places on the skin.
        least: length in the unit of the mesh.
    """
    used, rows = np.unique(places.corners, return_inverse=True)
    count = len(dna.raw_control_names)
    motions = sk.column_motions(dna, sk.column_count(dna))[:count]
    weights = sk.dense_weights(head, len(dna.joint_names))[used]
    positions = np.asarray(head.positions, np.float64)[used]
    shapes = sk.column_shapes(dna, head, count)
    below = _apart_from_head(dna)
    far = np.where(weights[:, below].sum(axis=1) > _LEAST_WEIGHT, np.inf, 0.0)
    for column, name in enumerate(dna.raw_control_names):
        if re.search(r"\.(head|neck)", name):
            continue
        shape = shapes[column][used] if column in shapes else 0.0
        moved = sk.skinned(positions + shape, weights, motions[column])
        far = np.maximum(far, np.linalg.norm(moved - positions, axis=1))
    return np.asarray(far[rows.reshape(places.corners.shape)].max(axis=1) < least)


def _apart_from_head(dna: Dna) -> list[int]:
    """Indices of the joints that are neither the head joint nor its descendants."""
    head, parents = list(dna.joint_names).index("head"), np.asarray(dna.joint_parents, np.int64)
    on_head = np.arange(len(parents)) == head
    for _ in range(len(parents)):
        on_head |= on_head[parents]
    return np.flatnonzero(~on_head).tolist()


def append_mesh(dna: Dna, name: str, mesh: Mesh, lods: list[int]) -> None:
    """Appends a mesh to a Dna, with its LODs and blend shape channels.

    Args:
        dna: the face; changed.
        name: name of the mesh.
        mesh: the finished mesh.
        lods: numbers of the LODs that show the mesh.
    """
    number = len(dna.mesh_names)
    dna.mesh_names = [*dna.mesh_names, name]
    dna.meshes = [*dna.meshes, mesh]
    mapping = dna.lod_mesh_mapping
    rows = [[int(i) for i in mapping[lod]] for lod in range(dna.lod_count)]
    dna.lod_mesh_mapping = [r + [number] * (lod in lods) for lod, r in enumerate(rows)]
    pairs = [(number, int(t.blend_shape_channel_index)) for t in mesh.blend_shape_targets]
    before = np.asarray(dna.mesh_blend_shape_channel_mapping, np.int64).reshape(-1, 2)
    after = np.array(pairs, np.int64).reshape(-1, 2)
    dna.mesh_blend_shape_channel_mapping = np.concatenate([before, after])
