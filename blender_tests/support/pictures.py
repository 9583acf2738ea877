# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders small pictures and reads their pixels."""

import bpy
import numpy as np


def small_render(camera, size=32):
    """Set up a small Cycles render with one sample, no denoising and a sun. Returns the scene."""
    setup = bpy.context.scene
    setup.render.engine = "CYCLES"
    setup.cycles.samples, setup.cycles.device = 1, "CPU"
    setup.cycles.use_denoising = False
    setup.render.resolution_x = setup.render.resolution_y = size
    setup.render.image_settings.file_format = "PNG"
    setup.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.rotation_euler = (0.9, 0, 0.4)
    setup.collection.objects.link(sun)
    return setup


def pixels(path):
    """The RGBA values of all pixels of an image file in a flat array, float64[4 * pixels]."""
    image = bpy.data.images.load(str(path))
    values = np.array(image.pixels[:])
    bpy.data.images.remove(image)
    return values


def render(path):
    """Render the current frame to a file, and return its pixels."""
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return pixels(path)
