# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives existing mesh objects and datablocks the meshes and shape keys of a new DNA file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from ...logic.base.sentences import told
from ...logic.character import plans, user_edits
from ..base import parts, saved
from ..base.blender_types import Attribute, MeshObject, Values
from ..character import build, meshes, runtime, skin_weights
from ..lod import lods
from . import transfer
from .file_change import Change

_BOUND = {
    "HOOK",
    "SURFACE_DEFORM",
    "MESH_DEFORM",
    "LAPLACIANDEFORM",
    "CORRECTIVE_SMOOTH",
    "MULTIRES",
}


@dataclass
class Shape:
    """Positions of a mesh object with the user's edits.

    Attributes:
        points: float32[V, 3], the basis.
        moved: float64[V, 3], offsets of the basis by the user's edit.
        keys: name of a shape key -> float32[V, 3] positions. A shape key of Risorius is left out
            if it is known to be unedited, has no vertex group, and no shape key is relative to it.
        relative: name of a shape key -> name of the shape key to which it is relative.
        channels: name of a shape key of Risorius -> index of its blend shape channel in the old
            file.
        edits: name of an edited shape key of Risorius -> float64[V, 3] offsets by the edit.
        own: names of the user's own shape keys.
    """

    points: NDArray[np.float32]
    moved: NDArray[np.float64]
    keys: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    relative: dict[str, str] = field(default_factory=dict)
    channels: dict[str, int] = field(default_factory=dict)
    edits: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    own: list[str] = field(default_factory=list)


def replace_meshes(change: Change, fresh_meshes: Mapping[int, MeshObject]) -> set[int]:
    """Move the new file's meshes into the existing objects.

    Args:
        change: the replacement.
        fresh_meshes: mesh index in the new file -> newly built object.

    Returns:
        The mesh indices of the new file that an existing object shows.
    """
    moved = change.mesh_map()
    old_plans = {m.index: m for m in change.old.meshes}
    new_plans = {m.index: m for m in change.new.meshes}
    kept, done = set(), []
    for item in [m for m in parts.meshes_pointing_at(change.rig) if parts.MESH in m]:
        index = item[parts.MESH]
        old = old_plans.get(index)
        there = moved[index] if index < len(moved) else -1
        if there not in fresh_meshes or old is None:
            _leave(change, item, old)
            continue
        new = new_plans[there]
        if item.data not in done:
            _refit(change, item, old, new, fresh_meshes[there])
            done.append(item.data)
        _relabel(item, new)
        kept.add(there)
    return kept


def _relabel(item: MeshObject, new: plans.MeshPlan) -> None:
    item[parts.MESH] = new.index
    if lods.levels_of(item) != list(new.lods):
        item[parts.LODS] = list(new.lods)


def _faces_of(mesh: bpy.types.Mesh) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    corners, starts = np.empty(len(mesh.loops), np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    return corners, starts


def has_faces_of(mesh: bpy.types.Mesh, plan: plans.MeshPlan) -> bool:
    """Whether a mesh has the number of vertices and the polygons of a plan.

    Args:
        mesh: the mesh to check.
        plan: the mesh in the DNA file.
    """
    corners, starts = _faces_of(mesh)
    return (
        len(mesh.vertices) == len(plan.positions)
        and np.array_equal(corners, plan.corners)
        and np.array_equal(starts, plan.face_starts)
    )


def _refit(
    change: Change, item: MeshObject, old: plans.MeshPlan, new: plans.MeshPlan, fresh: MeshObject
) -> None:
    """Give one mesh object the polygons, skin weights, UVs, normals and shape keys of the new file.

    The user's edits and attributes are transferred.

    Args:
        change: the replacement.
        item: the existing mesh object.
        old, new: the mesh in the old and in the new file.
        fresh: the newly built object of the new mesh.
    """
    mesh = item.data
    known = len(mesh.vertices) == len(old.positions)
    same = has_faces_of(mesh, old) and has_faces_of(mesh, new)
    counted = known and len(old.positions) == len(new.positions)
    shape = read_shape(change.before, item, old, known)
    if same:
        bearer = transfer.SameVertices()
        _refit_weights(change, item, old, new)
        _refit_corners(change, item, old, new, fresh)
    else:
        _back_up(change, item, old, shape, known)
        base = old.positions if known else shape.points
        surface = transfer.OldSurface(mesh, base)
        if counted or not surface.usable:
            bearer = transfer.SameVertices() if counted else _Nothing(len(new.positions))
        else:
            where = np.asarray(new.positions, np.float64)
            bearer = transfer.Nearest(surface.points, surface.triangles, where)
        _rebuild(change, item, new, fresh, surface, bearer)
    _refit_shape(change, item, shape, new, bearer)
    mesh.update()


class _Nothing:
    """Transfer from a mesh without polygons: values become 0; vertex indices stay if they exist."""

    def __init__(self, count: int) -> None:
        self._count = count

    def vertices(self, values: Values) -> Values:
        """Zeros for each new vertex."""
        return np.zeros((self._count, *np.shape(values)[1:]))

    def nearest_vertices(self, indices: list[int]) -> list[int]:
        """The given indices; an index beyond the last new vertex becomes the last new vertex."""
        return [min(i, self._count - 1) for i in indices]


def read_shape(live: runtime.Runtime, item: MeshObject, old: plans.MeshPlan, known: bool) -> Shape:
    """Read the positions of a mesh and the user's edits relative to the old file.

    Args:
        live: Runtime of the old file.
        item: mesh object.
        old: the mesh in the old file.
        known: whether the object has as many vertices as the mesh in the old file.
    """
    points = meshes.basis_of(item)
    shape = Shape(points, np.zeros(points.shape))
    if known:
        mask = user_edits.changed(points, old.positions)
        shape.moved[mask] = points.astype(np.float64)[mask] - old.positions[mask]
    key = item.data.shape_keys
    if key is None:
        return shape
    dna_mesh = live.dna.meshes[old.index]
    deltas = meshes.deltas_by_channel(dna_mesh, live.space.delta_matrix)
    shape.channels = meshes.real_channels(item)
    summed = meshes.live_block(item)
    bases = {block.relative_key.name for block in key.key_blocks}
    for block in key.key_blocks:
        shape.relative[block.name] = block.relative_key.name
        channel = shape.channels.get(block.name)
        if channel is None:
            if block not in (summed, key.reference_key):
                shape.own.append(block.name)
        elif known:
            nothing = (np.zeros(0, np.int64), np.zeros((0, 3), np.float32))
            mask, difference = meshes.edits_of(block, old.positions, deltas.get(channel, nothing))
            if mask.any():
                shape.edits[block.name] = difference
        edited = block.name in shape.edits or block.vertex_group
        if channel is None or edited or block.name in bases or not known:
            shape.keys[block.name] = meshes.points_of(block)
    return shape


def _own_groups(change: Change, item: MeshObject) -> list[str]:
    ours = set(change.old_bones) | set(change.new_bones)
    return [g.name for g in item.vertex_groups if g.name not in ours]


def _things(
    change: Change, item: MeshObject, old: plans.MeshPlan | None, shape: Shape, known: bool
) -> list[str]:
    """Descriptions of the user's edits of a mesh and of the user's additions, for a report.

    Args:
        change: the replacement.
        item: the mesh object.
        old: the mesh in the old file; None if the file lacks it.
        shape: positions of the mesh with the user's edits.
        known: whether the object has as many vertices as the mesh in the old file.
    """
    layers, lost = transfer.own_attributes(item.data)
    things = {
        "its own faces": not known or (old is not None and not has_faces_of(item.data, old)),
        "an edited neutral": bool(shape.moved.any()),
        "edited shape keys": bool(shape.edits),
        "own shape keys": bool(shape.own),
        "own layers": bool(layers or lost),
        "own vertex groups": bool(_own_groups(change, item)),
    }
    if old is not None and known:
        wanted = skin_weights.file_pairs(old, change.old_bones)
        things["edited weights"] = bool(
            skin_weights.edited_vertices(skin_weights.read(item), wanted)
        )
    return [words for words, there in things.items() if there]


def _back_up(
    change: Change, item: MeshObject, old: plans.MeshPlan, shape: Shape, known: bool
) -> None:
    """Keep a copy of a mesh with edits or additions by the user, before its polygons change.

    Args:
        change: the replacement.
        item: the mesh object.
        old: the mesh in the old file.
        shape: positions of the mesh with the user's edits.
        known: whether the object has as many vertices as the mesh in the old file.
    """
    things = _things(change, item, old, shape, known)
    bound = [m.name for m in item.modifiers if m.type in _BOUND]
    if bound:
        change.report.append(
            told(
                "{name} has new polygons: bind these modifiers again: {bound}.",
                name=item.name,
                bound=", ".join(bound),
            )
        )
    if not things:
        return
    copy = item.data.copy()
    copy.name = f"{item.data.name} before replace"
    copy.use_fake_user = True
    change.report.append(
        told(
            (
                "{name} has new polygons: {things} were transferred from the nearest "
                "points where possible; the mesh {copy} keeps the originals."
            ),
            name=item.name,
            things=", ".join(things),
            copy=copy.name,
        )
    )


def _leave(change: Change, item: MeshObject, old: plans.MeshPlan | None) -> None:
    """Remove a mesh that the new file lacks, or hide it if the user edited or extended it.

    Args:
        change: the replacement.
        item: the mesh object.
        old: the mesh in the old file; None if the file lacks it.
    """
    label = item.name
    known = old is not None and len(item.data.vertices) == len(old.positions)
    things = ["its unknown origin"]
    if old is not None:
        shape = read_shape(change.before, item, old, known)
        things = _things(change, item, old, shape, known)
    things += [m.name for m in item.modifiers if m.type != "ARMATURE"]
    things += [c.name for c in (*item.constraints, *item.children)]
    if item.animation_data is not None:
        things.append("its animation")
    if not things:
        data = item.data
        bpy.data.objects.remove(item)
        if data.users == 0:
            bpy.data.meshes.remove(data)
        change.report.append(told("The mesh {label} is gone.", label=label))
        return
    live = meshes.live_block(item)
    if live is not None:
        live.value = 0.0
    for key in (parts.RIG, parts.MESH, parts.LODS, parts.MODE):
        item.pop(key, None)
    item.hide_viewport = item.hide_render = True
    change.report.append(
        told(
            (
                "The mesh {label} is not in the new DNA file; in the scene this mesh stays, "
                "hidden, for {things}, which would be lost otherwise."
            ),
            label=label,
            things=", ".join(things),
        )
    )


def _refit_weights(
    change: Change, item: MeshObject, old: plans.MeshPlan, new: plans.MeshPlan
) -> None:
    """Write the new file's skin weights, except at vertices that the user painted.

    Vertex groups that modifiers or shape keys use do not change.
    """
    before = skin_weights.file_pairs(old, change.old_bones)
    after = skin_weights.file_pairs(new, change.new_bones)
    if before == after:
        return
    present = skin_weights.read(item)
    painted = skin_weights.edited_vertices(present, before)
    masks = _masks(item)
    groups = {}
    for name in {*before, *after} - masks:
        groups[name] = {v: w for v, w in after.get(name, {}).items() if v not in painted}
        groups[name].update({v: w for v, w in present.get(name, {}).items() if v in painted})
    skin_weights.write(item, groups)
    for name in [n for n in groups if not groups[n] and n not in after]:
        item.vertex_groups.remove(item.vertex_groups[name])
    if painted:
        change.report.append(
            told(
                "{name} keeps your weights at {count} vertices.",
                name=item.name,
                count=len(painted),
            )
        )


def _masks(item: MeshObject) -> set[str]:
    """Names of the vertex groups that modifiers and shape keys use."""
    used = {group for m in item.modifiers if (group := getattr(m, "vertex_group", ""))}
    key = item.data.shape_keys
    used.update(b.vertex_group for b in key.key_blocks if b.vertex_group) if key else None
    return used


def _refit_corners(
    change: Change, item: MeshObject, old: plans.MeshPlan, new: plans.MeshPlan, fresh: MeshObject
) -> None:
    """Update UVs, normals and the materials' attributes if the old and the new file differ.

    A UV map that the user edited stays.

    Args:
        change: the replacement.
        item: the existing mesh object.
        old, new: the mesh in the old and in the new file.
        fresh: the newly built object of the new mesh.
    """
    mesh = item.data
    layer = mesh.uv_layers.get("UVMap")
    if new.uvs is not None and not _equal(old.uvs, new.uvs):
        flat = np.empty(len(mesh.loops) * 2, np.float32)
        if layer is not None:
            layer.uv.foreach_get("vector", flat)
        if layer is None or _equal(flat.reshape(-1, 2), old.uvs):
            layer = layer or mesh.uv_layers.new(name="UVMap", do_init=False)
            layer.uv.foreach_set("vector", new.uvs.ravel())
        else:
            change.report.append(
                told(
                    "{name} keeps your UV map; the UV map in the DNA file is different.",
                    name=item.name,
                )
            )
    if not _equal(old.positions, new.positions):
        _copy_attributes(mesh, fresh.data)
    if _equal(old.normals, new.normals) and _equal(old.positions, new.positions):
        return
    if mesh.has_custom_normals and new.normals is not None:
        mesh.normals_split_custom_set(new.normals)


def _equal(a: NDArray[np.float32] | None, b: NDArray[np.float32] | None) -> bool:
    return (a is None and b is None) or (a is not None and b is not None and np.array_equal(a, b))


def _copy_attributes(mesh: bpy.types.Mesh, source: bpy.types.Mesh) -> None:
    """Copy the attributes that the add-on's materials read."""
    attributes: list[Attribute] = list(source.attributes)
    for theirs in [a for a in attributes if a.name.startswith(transfer.OUR_PREFIX)]:
        kind = (theirs.name, theirs.data_type, theirs.domain)
        ours: Attribute = mesh.attributes.get(theirs.name) or mesh.attributes.new(*kind)
        single = theirs.data_type == "FLOAT"
        flat = np.empty(len(theirs.data) * (1 if single else 3), np.float32)
        theirs.data.foreach_get("value" if single else "vector", flat)
        ours.data.foreach_set("value" if single else "vector", flat)


def _rebuild(
    change: Change,
    item: MeshObject,
    new: plans.MeshPlan,
    fresh: MeshObject,
    surface: transfer.OldSurface,
    bearer: transfer.Carry,
) -> None:
    """Replace the polygons inside the mesh datablock.

    So the shape keys, the drivers and the pointers to the datablock stay.

    Args:
        change: the replacement.
        item: the existing mesh object.
        new: the mesh in the new file.
        fresh: the newly built object of the new mesh.
        surface: data of the old polygons.
        bearer: converts values of old vertices to values of new vertices.
    """
    mesh = item.data
    own = {n: v for n, v in skin_weights.read(item).items() if n in _own_groups(change, item)}
    count = len(mesh.vertices)
    parents = [o for o in item.children if o.parent_type in {"VERTEX", "VERTEX_3"}]
    edit = bmesh.new()
    try:
        edit.from_mesh(fresh.data, use_shape_key=False)
        deform = edit.verts.layers.deform.active
        if deform is not None:
            edit.verts.layers.deform.remove(deform)  # its indices refer to groups of another object
        edit.to_mesh(mesh)
    finally:
        edit.free()
    if fresh.data.has_custom_normals and new.normals is not None:
        mesh.normals_split_custom_set(new.normals)
    after = skin_weights.file_pairs(new, change.new_bones)
    for name, values in own.items():
        dense = np.zeros(count)
        dense[list(values)] = list(values.values())
        given = bearer.vertices(dense)
        after[name] = {int(v): float(given[v]) for v in np.flatnonzero(given > 1e-6)}
    skin_weights.write(item, after)
    for name in set(change.old_bones) - set(after) - _masks(item):
        group = item.vertex_groups.get(name)
        if group is not None:
            item.vertex_groups.remove(group)
    surface.give(mesh, new.positions, bearer)
    for child in parents:
        child.parent_vertices = bearer.nearest_vertices(list(child.parent_vertices))


def _refit_shape(
    change: Change, item: MeshObject, shape: Shape, new: plans.MeshPlan, bearer: transfer.Carry
) -> None:
    """Set the new neutral mesh with the user's edits, and all shape keys relative to it.

    Args:
        change: the replacement.
        item: the existing mesh object.
        new: the mesh in the new file.
        shape: positions of the mesh with the user's edits.
        bearer: converts values of old vertices to values of new vertices.
    """
    channel_map = change.channel_map()
    dna_mesh = change.after.dna.meshes[new.index]
    deltas = meshes.deltas_by_channel(dna_mesh, change.after.space.delta_matrix)
    basis = _added(new.positions, bearer.vertices(shape.moved))
    item.data.vertices.foreach_set("co", basis.ravel())
    key = item.data.shape_keys
    if key is None:
        return
    _drop_gone_keys(change, item, shape, channel_map, deltas)
    done: dict[str, NDArray[np.float32] | None] = {key.reference_key.name: basis}
    bases = set(shape.relative.values())
    for block in key.key_blocks:
        points = _points(block.name, shape, done, deltas, channel_map, bearer)
        assert points is not None
        block.points.foreach_set("co", points.ravel())
        if block.name not in bases:
            del done[block.name]  # hundreds of keys would fill the memory
    _renumber(key, channel_map)


def _added(points: NDArray[np.float32], moves: NDArray[np.float64]) -> NDArray[np.float32]:
    """float32[V, 3]: positions plus moves; positions with a move of 0 stay bit-identical."""
    result = points.copy()
    rows = np.any(moves != 0, axis=1)
    result[rows] = (points[rows].astype(np.float64) + moves[rows]).astype(np.float32)
    return result


def _points(
    name: str,
    shape: Shape,
    done: dict[str, NDArray[np.float32] | None],
    deltas: Mapping[int, meshes.Deltas],
    channel_map: Sequence[int],
    bearer: transfer.Carry,
) -> NDArray[np.float32] | None:
    """New coordinates of the shape key `name`.

    The shape key to which it is relative is computed first. Both results are stored in `done`.

    Args:
        name: name of the shape key.
        shape: positions of the mesh with the user's edits.
        done: name of a shape key -> new coordinates; None while they are computed.
        deltas: index of a channel in the new file -> its deltas.
        channel_map: new index of each old channel, -1 if the new file lacks it.
        bearer: converts values of old vertices to values of new vertices.
    """
    if name in done:
        return done[name]
    above = shape.relative[name]
    done[name] = None  # stops the recursion if relative keys form a circle
    base = _points(above, shape, done, deltas, channel_map, bearer)
    if base is None:
        base = next(p for p in done.values() if p is not None)
    channel = shape.channels.get(name)
    there = channel_map[channel] if channel is not None and channel < len(channel_map) else -1
    if there >= 0 and there in deltas:
        points = user_edits.shaped(base, *deltas[there])
        if name in shape.edits:
            points = _added(points, bearer.vertices(shape.edits[name]))
    else:
        delta = shape.keys[name].astype(np.float64) - shape.keys[above]
        points = _added(base, bearer.vertices(delta))
    done[name] = points
    return points


def _drop_gone_keys(
    change: Change,
    item: MeshObject,
    shape: Shape,
    channel_map: Sequence[int],
    deltas: Mapping[int, meshes.Deltas],
) -> None:
    """Remove shape keys of Risorius whose blend shape channel is missing in the new file.

    A shape key stays, without its driver, if the user edited it, if it has a vertex group, or if a
    shape key of the user is relative to it.

    Args:
        change: the replacement.
        item: the mesh object.
        shape: positions of the mesh with the user's edits.
        channel_map: new index of each old channel, -1 if the new file lacks it.
        deltas: index of a channel in the new file -> its deltas.
    """
    key = parts.keys_there(item)
    needed = {above for name, above in shape.relative.items() if name in shape.own}
    for name, channel in shape.channels.items():
        if channel < len(channel_map) and channel_map[channel] in deltas:
            continue
        block = key.key_blocks[name]
        if name in shape.edits or name in needed or block.vertex_group:
            path = f'key_blocks["{bpy.utils.escape_identifier(name)}"].value'
            key.driver_remove(path)
            block.value = 0.0
            shape.edits.pop(name, None)
            change.report.append(
                told(
                    (
                        "The DNA file has no shape for the shape key {shape} of {name}; "
                        "your edited key stays."
                    ),
                    shape=name,
                    name=item.name,
                )
            )
        else:
            meshes.remove_channel_key(item, block)


def _renumber(key: bpy.types.Key, channel_map: Sequence[int]) -> None:
    """Convert the channel indices in the custom properties of a Key to the new file."""

    def there(channel: int) -> int:
        return channel_map[channel] if channel < len(channel_map) else -1

    for name in (parts.REAL, parts.KEY_ORDER):
        if name in key:
            moved = [there(c) for c in saved.wholes(key, name, 0) if there(c) >= 0]
            if moved:
                key[name] = moved
            else:
                del key[name]
    if parts.KEY_NAMES in key:
        given = saved.table(key, parts.KEY_NAMES) or {}
        numbers = {name: int(name) for name in given if name.isdecimal() and len(name) < 6}
        key[parts.KEY_NAMES] = {
            str(there(c)): given[name] for name, c in numbers.items() if there(c) >= 0
        }


def finish_shapes(change: Change) -> None:
    """Set the shape key mode of all meshes, which adds shape keys for new channels.

    The drivers must already read the new channel indices.
    """
    live = runtime.there(change.rig)
    labels = build.channel_labels(live.dna)
    there = parts.meshes_of(change.rig)
    built = {m[parts.MESH] for m in there}
    known = {i for i in change.mesh_map() if i >= 0}
    modes = [saved.text(m, parts.MODE, "LIVE") for m in there if m[parts.MESH] in known & built]
    usual = max(set(modes), key=modes.count) if modes else "LIVE"
    for item in there:
        mode = saved.text(item, parts.MODE, usual) if item[parts.MESH] in known else usual
        dna_mesh = runtime.dna_mesh(live, item)
        if dna_mesh is not None:
            meshes.set_mode(item, change.rig, dna_mesh, live.space, labels, mode)
