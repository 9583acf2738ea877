# SPDX-License-Identifier: GPL-3.0-or-later
"""A render engine that draws nothing, and records the vertices that Blender gives it."""

from contextlib import contextmanager

import bpy
import numpy as np


class Probe(bpy.types.RenderEngine):
    """A render engine that records the vertices of faces at each rendered frame.

    It can also record them between frames, as motion blur does.
    """

    bl_idname = "RISORIUS_TEST_PROBE"
    bl_label = "Probe"
    bl_use_preview = False

    # Frame -> {index of a mesh in the DNA file: vertices float64[V, 3] in world space}. If
    # `between` is not empty, the frame is recorded again after the offsets, as frame + 1e-9.
    seen = {}
    between = ()  # offsets from the frame, in frames, at which the engine also records

    def render(self, depsgraph):
        frame = depsgraph.scene_eval.frame_current
        self._look(depsgraph, float(frame))
        for offset in self.between:
            time = frame + offset
            self.frame_set(int(np.floor(time)), subframe=time - np.floor(time))
            self._look(depsgraph, time)
        if self.between:
            self.frame_set(frame, subframe=0.0)
            self._look(depsgraph, frame + 1e-9)

    def _look(self, depsgraph, time):
        found = type(self).seen.setdefault(time, {})
        for item in depsgraph.objects:
            if item.type == "MESH" and "dna_mesh" in item:
                found[item["dna_mesh"]] = _vertices(item)


def _vertices(item):
    mesh = item.to_mesh()
    flat = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", flat)
    item.to_mesh_clear()
    world = np.array(item.matrix_world)
    return flat.reshape(-1, 3).astype(np.float64) @ world[:3, :3].T + world[:3, 3]


@contextmanager
def rendering(setup, between=()):
    """Context manager in which renders of a scene use the probe. Yields the dict that it fills.

    Args:
        setup: the scene.
        between: offsets from each rendered frame, in frames, at which vertices are recorded too.
    """
    bpy.utils.register_class(Probe)
    before = setup.render.engine
    Probe.seen = {}
    Probe.between = tuple(between)
    setup.render.engine = Probe.bl_idname
    setup.render.resolution_x = setup.render.resolution_y = 8
    if setup.camera is None:
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        setup.collection.objects.link(camera)
        setup.camera = camera
    try:
        yield Probe.seen
    finally:
        setup.render.engine = before
        bpy.utils.unregister_class(Probe)
