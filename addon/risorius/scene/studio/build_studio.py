# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a camera, three lights and a backdrop around a face, in a new collection.

The user may change or delete these objects, because no part of the face refers to them.
"""

from __future__ import annotations

from itertools import pairwise

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...logic.character import studio_plan
from ..base import parts
from ..base.blender_types import ArmatureObject, Context, MeshObject, NodeTree
from ..character import runtime
from ..character.meshes import basis_of

_MIDDLE = (0.115, 0.121, 0.130, 1.0)  # linear colour of the backdrop behind the head
_EDGE = (0.010, 0.011, 0.014, 1.0)


def add(context: Context, rig: ArmatureObject, scene_camera: bool) -> bpy.types.Collection:
    """Build the studio around a face at its current position, scaled to the size of the head.

    Args:
        context: Blender context; the studio is added to its scene.
        rig: deforming armature of the face.
        scene_camera: True makes the studio's camera the camera of the scene; a scene without a
            camera always gets it.

    Returns:
        The collection with camera, lights and backdrop.
    """
    place, apart, low, high = _head(rig)
    plan = studio_plan.plan(apart, low, high)
    name = rig.name.removesuffix("_rig") + "_studio"
    collection = bpy.data.collections.new(name)
    context.scene.collection.children.link(collection)
    camera = _camera(f"{name}_camera", plan, place)
    things = [camera, _backdrop(f"{name}_backdrop", plan, place)]
    things += [_lamp(f"{name}_{lamp.name.lower()}", lamp, place) for lamp in plan.lamps]
    for thing in things:
        collection.objects.link(thing)
    if scene_camera or context.scene.camera is None:
        context.scene.camera = camera
    context.view_layer.update()
    return collection


def _head(rig: ArmatureObject) -> tuple[Matrix, float, list[float], list[float]]:
    """World matrix, without scale, of the midpoint between the eyes; distance between the eyes; low
    and high corner of the face's bounding box in the space of this matrix. If the meshes include a
    neck, the low corner is raised to the height from `_hem`."""
    meshes = parts.meshes_of(rig)
    world = np.array(rig.matrix_world, np.float64)
    eyes = _eyes(rig)
    corners = np.array([item.matrix_world @ Vector(c) for item in meshes for c in item.bound_box])
    turn = rig.matrix_world.to_quaternion().to_matrix()
    axes = np.array(turn, np.float64)
    if len(eyes) == 2:
        seen = eyes @ world[:3, :3].T + world[:3, 3]
        middle, apart = seen.mean(axis=0), float(np.linalg.norm(seen[0] - seen[1]))
    else:
        middle, apart = _guess(corners, axes)
    inside = (corners - middle) @ axes
    place = Matrix.Translation(Vector(middle.tolist())) @ turn.to_4x4()
    low, high = inside.min(axis=0), inside.max(axis=0)
    if studio_plan.has_neck(apart, low[2]):
        low[2] = max(low[2], _hem([(_places(item) - middle) @ axes for item in meshes], apart))
    return place, apart, low.tolist(), high.tolist()


def _places(item: MeshObject) -> np.ndarray:
    """float64[V, 3]: the neutral vertices of a mesh in world space."""
    world = np.array(item.matrix_world, np.float64)
    return np.asarray(basis_of(item) @ world[:3, :3].T + world[:3, 3])


def _hem(places: list[np.ndarray], apart: float) -> float:
    """The height of the lower edge of the body's front.

    The lowest point in each of 8 vertical strips is found, and the highest of these points counts.
    A hem may hang lower at the sides, and a picture that reaches down to the lowest point of all
    would show a gap in the middle.

    Args:
        places: float64[V, 3] of each mesh, in the head's axes.
        apart: distance between the eyes.
    """
    x, y, z = np.concatenate([*places, np.empty((0, 3))]).T
    edges = np.linspace(-0.8, 0.8, 9) * apart
    ends = []
    for left, right in pairwise(edges):
        here = (x >= left) & (x < right)
        if here.any():
            front = here & (y <= (y[here].min() + y[here].max()) / 2)
            ends.append(float(z[front].min()))
    return max(ends, default=-np.inf)


def _eyes(rig: ArmatureObject) -> np.ndarray:
    """float64[2, 3]: positions of the eye joints at rest in the rig's space.

    float64[0, 3] unless the face has two eye joints at different positions.
    """
    live = runtime.of(rig)
    if live is None:
        return np.zeros((0, 3))
    found = np.array([live.rest[joint][:3, 3] for joint in live.anchors.eyes.values()])
    apart = len(found) == 2 and np.linalg.norm(found[0] - found[1]) > 0.0
    return found if apart else np.zeros((0, 3))


def _guess(corners: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, float]:
    """Guess the midpoint between the eyes, and the distance between the eyes.

    Args:
        corners: float64[n, 3], corners of the bounding boxes of the face's meshes.
        axes: float64[3, 3], the columns are the axes of the head in the space of the corners.
    """
    inside = corners @ axes
    low, high = inside.min(axis=0), inside.max(axis=0)
    tall = max(float(high[2] - low[2]), 1e-6)
    middle = np.array([(low[0] + high[0]) / 2, low[1] + 0.1 * tall, low[2] + 0.6 * tall])
    return axes @ middle, 0.21 * tall


def _camera(name: str, plan: studio_plan.Studio, place: Matrix) -> bpy.types.Object:
    data = bpy.data.cameras.new(name)
    data.lens = plan.lens
    data.sensor_fit = "VERTICAL"  # a wider picture shows more of the backdrop, not less of the head
    data.sensor_height = data.sensor_width = studio_plan.SENSOR
    far = (Vector(plan.camera) - Vector(plan.target)).length
    data.clip_start, data.clip_end = far / 100.0, far * 100.0
    thing = bpy.data.objects.new(name, data)
    thing.matrix_world = place @ _looking(plan.camera, plan.target)
    return thing


def _lamp(name: str, lamp: studio_plan.Lamp, place: Matrix) -> bpy.types.Object:
    data = bpy.data.lights.new(name, "AREA")
    assert isinstance(data, bpy.types.AreaLight)
    data.shape = "RECTANGLE"
    data.size, data.size_y = lamp.size
    data.energy, data.color = lamp.watts, lamp.colour
    thing = bpy.data.objects.new(name, data)
    thing.matrix_world = place @ _looking(lamp.place, (0.0, 0.0, 0.0))
    return thing


def _looking(place: studio_plan.Triple, target: studio_plan.Triple) -> Matrix:
    """The matrix of a camera or lamp at the position `place` that points at the position `target`.

    The two positions and the matrix are in the same space.
    """
    way = Vector(target) - Vector(place)
    return Matrix.Translation(Vector(place)) @ way.to_track_quat("-Z", "Y").to_matrix().to_4x4()


def _backdrop(name: str, plan: studio_plan.Studio, place: Matrix) -> bpy.types.Object:
    width, height = plan.wall_size
    mesh = bpy.data.meshes.new(name)
    x, z = width / 2, height / 2
    mesh.from_pydata([(-x, 0, -z), (x, 0, -z), (x, 0, z), (-x, 0, z)], [], [(0, 1, 2, 3)])
    mesh.materials.append(_paper(name, plan.glow))
    thing = bpy.data.objects.new(name, mesh)
    turn = Matrix.Rotation(plan.wall_turn, 4, "Z")
    thing.matrix_world = place @ Matrix.Translation(Vector(plan.wall)) @ turn
    return thing


def _paper(name: str, glow: float) -> bpy.types.Material:
    """An emissive dark material with a lighter middle that falls off smoothly.

    Args:
        name: name of the material.
        glow: distance from the middle in Blender units at which the brightness has fallen to 1/e.
    """
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    assert tree is not None
    tree.nodes.clear()
    shader, output = (
        tree.nodes.new("ShaderNodeEmission"),
        tree.nodes.new("ShaderNodeOutputMaterial"),
    )
    tree.links.new(_falloff(tree, glow), shader.inputs["Color"])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    material.diffuse_color = _MIDDLE
    return material


def _falloff(tree: NodeTree, glow: float) -> bpy.types.NodeSocket:
    """Add nodes for the colour of the backdrop, and return the output socket of the colour.

    At the distance r from the middle of the backdrop, the factor exp(-(r / glow)^2) mixes the
    colour of the edge (factor 0) and the colour of the middle (factor 1).
    """
    nodes, links = tree.nodes, tree.links
    where = nodes.new("ShaderNodeTexCoord")
    length = nodes.new("ShaderNodeVectorMath")
    length.operation = "DOT_PRODUCT"
    links.new(where.outputs["Object"], length.inputs[0])
    links.new(where.outputs["Object"], length.inputs[1])
    power = nodes.new("ShaderNodeMath")
    power.operation = "MULTIPLY"
    power.inputs[1].default_value = -1.0 / (glow * glow)
    links.new(length.outputs["Value"], power.inputs[0])
    bell = nodes.new("ShaderNodeMath")
    bell.operation = "EXPONENT"
    links.new(power.outputs[0], bell.inputs[0])
    mix = nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    links.new(bell.outputs[0], mix.inputs[0])
    colours = [s for s in mix.inputs if s.type == "RGBA"]
    colours[0].default_value, colours[1].default_value = _EDGE, _MIDDLE
    return next(s for s in mix.outputs if s.type == "RGBA")
