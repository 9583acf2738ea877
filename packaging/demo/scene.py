# SPDX-License-Identifier: MIT
"""The stage of the demo: a portrait lens, soft lights, a quiet background, render settings."""

from __future__ import annotations

import os
import sys
import traceback

import bpy
from mathutils import Vector


def end_with(main):
    """Run `main` and end the process: exit code 0, or 1 after a traceback.

    Whatever is raised, Blender must end, and the bpy module sometimes hangs when it exits.
    """
    code = 1
    try:
        main()
        code = 0
    except BaseException:  # noqa: BLE001
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def empty_folder(folder):
    """A folder without pictures of an earlier run; itself."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    return folder


def render_animation(progress):
    """Render the scene's frames; progress.step() is called after each."""

    def written(*_):
        progress.step()

    bpy.app.handlers.render_write.append(written)
    try:
        bpy.ops.render.render(animation=True)
    finally:
        bpy.app.handlers.render_write.remove(written)


def aim(thing, target):
    thing.rotation_euler = (Vector(target) - thing.location).to_track_quat("-Z", "Y").to_euler()


def add_light(name, location, target, energy, size, colour):
    data = bpy.data.lights.new(name, "AREA")
    data.energy, data.size, data.color = energy, size, colour
    light = bpy.data.objects.new(name, data)
    light.location = location
    aim(light, target)
    bpy.context.scene.collection.objects.link(light)


def bounds(collection):
    """Lower and upper corner of the collection's meshes, in world space."""
    corners = [
        thing.matrix_world @ Vector(corner)
        for thing in collection.all_objects
        if thing.type == "MESH"
        for corner in thing.bound_box
    ]
    return (
        Vector([min(c[i] for c in corners) for i in range(3)]),
        Vector([max(c[i] for c in corners) for i in range(3)]),
    )


def build(collection):
    """Light and frame the character; everything scales with the head's height."""
    scene = bpy.context.scene
    low, high = bounds(collection)
    unit = high.z - low.z
    middle = Vector(((low.x + high.x) / 2, (low.y + high.y) / 2, low.z + 0.55 * unit))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 85
    camera.location = middle + Vector((0.36, -2.62, 0.05)) * unit
    aim(camera, middle)
    scene.collection.objects.link(camera)
    scene.camera = camera
    power = unit * unit * 100
    add_light(
        "Key",
        middle + Vector((-1.9, -2.2, 1.4)) * unit,
        middle,
        1.15 * power,
        1.6 * unit,
        (1.0, 0.93, 0.86),
    )
    add_light(
        "Fill",
        middle + Vector((2.4, -1.8, 0.1)) * unit,
        middle,
        0.42 * power,
        2.4 * unit,
        (0.85, 0.92, 1.0),
    )
    add_light(
        "Rim",
        middle + Vector((1.5, 2.0, 1.4)) * unit,
        middle,
        0.5 * power,
        0.9 * unit,
        (0.9, 0.95, 1.0),
    )
    background(scene)
    render_settings(scene)


def background(scene):
    """A soft vertical gradient, seen by the camera only as far as it lights gently."""
    world = bpy.data.worlds.new("Stage")
    scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    ramp = nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.035, 0.04, 0.05, 1)
    ramp.color_ramp.elements[1].color = (0.16, 0.18, 0.21, 1)
    place = nodes.new("ShaderNodeTexCoord")
    split = nodes.new("ShaderNodeSeparateXYZ")
    links.new(place.outputs["Window"], split.inputs[0])
    links.new(split.outputs["Y"], ramp.inputs[0])
    links.new(ramp.outputs[0], nodes["Background"].inputs[0])


def render_settings(scene):
    """Cycles on a CPU: few samples, denoised, no noise that a person would see."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = 8
    cycles.use_adaptive_sampling = True
    cycles.adaptive_threshold = 0.06
    _denoise(cycles)
    cycles.max_bounces = 3
    cycles.diffuse_bounces = 2
    cycles.glossy_bounces = 2
    cycles.transparent_max_bounces = 24  # cards of hair lie over each other
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.use_fast_gi = False
    scene.render.use_persistent_data = True
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform = "Filmic" if "Filmic" in _transforms(scene) else "Standard"


def _denoise(cycles):
    cycles.use_denoising = True
    try:
        cycles.denoiser = "OPENIMAGEDENOISE"
    except TypeError:  # Debian's Blender is built without it
        cycles.use_denoising = False
        cycles.samples, cycles.adaptive_threshold = 64, 0.02
        return
    cycles.denoising_prefilter = "FAST"
    if hasattr(cycles, "denoising_quality"):
        cycles.denoising_quality = "BALANCED"


def _transforms(scene):
    prop = scene.view_settings.bl_rna.properties["view_transform"]
    return {item.identifier for item in prop.enum_items}
