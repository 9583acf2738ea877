# SPDX-License-Identifier: MIT
"""Builds the stage of the films: the add-on's studio in a dark room, and the render settings."""

from __future__ import annotations

import os
import sys
import traceback

import bpy
from mathutils import Vector
from progress import Progress


def end_with(main):
    """Run `main` and end the process with exit code 0, or with 1 after a traceback.

    os._exit ends the process after every exception, because the bpy module sometimes hangs when
    Python exits normally.
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
    """Make the folder if it is missing, delete its PNG files, and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    return folder


def render_animation(progress):
    """Render the scene's frames, and call progress.step() after each."""

    def written(*_):
        progress.step()

    bpy.app.handlers.render_write.append(written)
    try:
        bpy.ops.render.render(animation=True)
    finally:
        bpy.app.handlers.render_write.remove(written)


def render_frames(folder, frames, samples):
    """Render frames as frame_0001.png, frame_0002.png and so on.

    Args:
        folder: folder of the pictures.
        frames: frames of the scene; they may have gaps.
        samples: samples of Cycles per pixel, used only if the denoiser is available.
    """
    scene = bpy.context.scene
    if scene.cycles.use_denoising:
        scene.cycles.samples = samples
    progress = Progress(len(frames), "frame")
    for number, frame in enumerate(frames, 1):
        scene.frame_set(frame)
        scene.render.filepath = str(folder / f"frame_{number:04d}.png")
        bpy.ops.render.render(write_still=True)
        progress.step()


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


def build(collection, strands=True):
    """Add the add-on's studio around a face and use its camera. Returns the studio's collection.

    Args:
        collection: collection of the face.
        strands: render the hair as strands instead of cards.
    """
    scene = bpy.context.scene
    bpy.context.view_layer.objects.active = next(
        thing for thing in collection.all_objects if thing.name.endswith("_controls")
    )
    before = set(bpy.data.collections)
    if bpy.ops.risorius.add_studio(use_scene_camera=True) != {"FINISHED"}:
        raise RuntimeError("the studio was not added")
    if strands and any("_hair_" in thing.name for thing in collection.all_objects):
        bpy.ops.risorius.set_strands()
    darken(scene)
    render_settings(scene)
    return next(made for made in bpy.data.collections if made not in before)


def meet_eyes():
    """Let the eyes of the active face follow the camera."""
    if bpy.ops.risorius.gaze_target(mode="OBJECT") != {"FINISHED"}:
        raise RuntimeError("the eyes did not follow the camera")


def darken(scene):
    """Give the scene a dark world, which adds almost no light to the face."""
    world = bpy.data.worlds.new("Stage")
    scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.012, 0.013, 0.015, 1)


def background(scene):
    """Give the scene a world with a dark vertical gradient in window coordinates."""
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
    """Set up Cycles on the CPU: 8 samples and a denoiser, or 64 samples if Blender lacks it."""
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
    cycles.transparent_max_bounces = 24  # because many cards of hair overlap
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.use_fast_gi = False
    scene.render.use_persistent_data = True
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "PNG"
    _develop(scene.view_settings)


def _denoise(cycles):
    cycles.use_denoising = True
    try:
        cycles.denoiser = "OPENIMAGEDENOISE"
    except TypeError:  # Debian's Blender is built without it
        cycles.use_denoising = False
        cycles.samples, cycles.adaptive_threshold = 64, 0.02
        return
    # FAST leaves black and white points in transparent hair, and is not faster.
    cycles.denoising_prefilter = "ACCURATE"
    if hasattr(cycles, "denoising_quality"):
        cycles.denoising_quality = "BALANCED"


def _develop(view):
    """Choose a view transform, and a look with more contrast, from those that this Blender has."""
    _choose(view, "view_transform", ("AgX", "Filmic", "Standard"))
    _choose(view, "look", ("AgX - Medium High Contrast", "Medium High Contrast", "None"))


def _choose(owner, name, wanted):
    """Set a property to the first valid choice.

    Each choice is tried, because the type of a dynamic enum does not list its items.

    Args:
        owner: the object with the property.
        name: name of the property.
        wanted: values, best first.
    """
    for choice in wanted:
        try:
            setattr(owner, name, choice)
        except TypeError:
            continue
        return
