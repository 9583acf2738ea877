# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a moving face with cloth or simulation nodes, and records its vertices."""

import bpy
import numpy as np

from . import scene
from .animation import animate

FRAMES = range(1, 11)
NEAR = 1e-5  # tolerance relative to the mesh's size if every vertex is pinned
FREE = 2e-3  # tolerance relative to the mesh's size if some cloth is free


def film(item, frames=FRAMES):
    """Record a mesh object: frame -> vertices at this frame in world space, float64[V, 3].

    Such a record is called a film here.
    """
    found = {}
    for frame in frames:
        bpy.context.scene.frame_set(int(np.floor(frame)), subframe=float(frame % 1))
        found[frame] = scene.evaluated(item)
    return found


def apart(film, wanted):
    """The largest coordinate difference between two films, as a share of the mesh's size."""
    size = np.ptp(wanted[min(wanted)], axis=0).max()
    return max(float(np.abs(film[f] - wanted[f]).max()) for f in wanted) / size


def moving(dna_file, mode, far=0.2):
    """Import a face, and set keys of sliders, of the head bone and of the control armature's place.

    Returns the deforming armature, and the object of mesh 0.

    Args:
        dna_file: path of the DNA file.
        mode: shape mode of the import.
        far: distance along x by which the control armature moves, in Blender units.
    """
    rig = scene.load(dna_file, mode)
    controls = animate(rig)
    for frame, x in ((1, 0.0), (6, far), (10, far / 2)):
        controls.location.x, controls.rotation_euler.z = x, 2.0 * x
        controls.keyframe_insert("location", frame=frame)
        controls.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = FRAMES[0], FRAMES[-1]
    return rig, scene.meshes(rig)[0]


def cloth(item, pinned=1.0):
    """Add a cloth modifier to a mesh, and return the modifier.

    Args:
        item: the mesh object.
        pinned: share of the vertices that are pinned, from the top downwards.
    """
    group = item.vertex_groups.new(name="pins")
    height = np.array([v.co.z for v in item.data.vertices])
    held = np.flatnonzero(height >= np.quantile(height, 1.0 - pinned))
    group.add(held.tolist(), 1.0, "REPLACE")
    modifier = item.modifiers.new("Cloth", "CLOTH")
    modifier.settings.vertex_group_mass = group.name
    modifier.settings.quality, modifier.settings.air_damping = 3, 10.0
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = FRAMES[0], FRAMES[-1]
    bpy.context.scene.frame_set(FRAMES[0])
    return modifier


def mean_places(places):
    """The film of a mesh that `trail` moves.

    Args:
        places: film of the same mesh without `trail`.
    """
    found, state = {}, None
    for frame in sorted(places):
        state = places[frame] if state is None else (state + places[frame]) / 2
        found[frame] = state
    return found


def trail(item):
    """Add simulation nodes that lag behind a mesh.

    At each frame, each vertex moves half of the way from its last place to its place without the
    nodes.
    """
    tree = bpy.data.node_groups.new("Trail", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    comes, goes = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    begin = tree.nodes.new("GeometryNodeSimulationInput")
    end = tree.nodes.new("GeometryNodeSimulationOutput")
    begin.pair_with_output(end)
    state, result = (next(s for s in sockets if s.name == "Geometry")
                     for sockets in (begin.outputs, end.inputs))  # fmt: skip
    place, index, taken, half, put = (
        tree.nodes.new(kind)
        for kind in ("GeometryNodeInputPosition", "GeometryNodeInputIndex",
                     "GeometryNodeSampleIndex", "ShaderNodeMix", "GeometryNodeSetPosition")
    )  # fmt: skip
    taken.data_type, half.data_type = "FLOAT_VECTOR", "VECTOR"
    half.inputs[0].default_value = 0.5
    first, second = (next(s for s in half.inputs if s.name == n and s.enabled) for n in "AB")
    for source, target in (
        (comes.outputs[0], begin.inputs[0]),
        (comes.outputs[0], taken.inputs["Geometry"]),
        (place.outputs[0], next(s for s in taken.inputs if s.name == "Value" and s.enabled)),
        (index.outputs[0], taken.inputs["Index"]),
        (place.outputs[0], first),
        (next(s for s in taken.outputs if s.enabled), second),
        (state, put.inputs["Geometry"]),
        (next(s for s in half.outputs if s.enabled), put.inputs["Position"]),
        (put.outputs[0], result),
        (next(s for s in end.outputs if s.name == "Geometry"), goes.inputs[0]),
    ):
        tree.links.new(source, target)
    item.modifiers.new("Nodes", "NODES").node_group = tree
    bpy.context.scene.frame_set(FRAMES[0])


def scarf(item, kind):
    """Add a sheet in front of a mesh that follows the mesh by a modifier.

    Args:
        item: object of the mesh.
        kind: type of the modifier, "SURFACE_DEFORM" or "SHRINKWRAP".
    """
    points = np.array([v.co for v in item.data.vertices]) @ np.array(item.matrix_world)[:3, :3].T
    points += np.array(item.matrix_world)[:3, 3]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = (low + high) / 2, (high - low).max()
    place = (middle[0], low[1], middle[2])
    bpy.ops.mesh.primitive_grid_add(
        x_subdivisions=5, y_subdivisions=4, size=0.3 * size, location=place,
        rotation=(np.pi / 2, 0, 0),
    )  # fmt: skip
    sheet = bpy.context.object
    modifier = sheet.modifiers.new("Follow", kind)
    modifier.target = item
    if kind == "SURFACE_DEFORM":
        assert bpy.ops.object.surfacedeform_bind(modifier=modifier.name) == {"FINISHED"}
        assert modifier.is_bound
    return sheet
