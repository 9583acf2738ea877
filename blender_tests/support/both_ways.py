# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares a face in Direct mode with the same face in Live mode, which Blender deforms."""

import bpy
import numpy as np

from . import scene

NEAR = 1e-5  # tolerance as a share of the face's size


def plan(rig):
    """The conditions.Plan with which a face was last shown."""
    return scene.submodule("scene.skinning.conditions").known(rig)


def is_direct(rig, *numbers):
    """Whether these meshes of a face (or all) are in Direct mode, with disabled modifiers."""
    items = scene.meshes(rig)
    wanted = [items[n] for n in numbers or items]
    off = all(not m.modifiers[0].show_viewport for m in wanted)
    return off and all(m.session_uid in plan(rig).direct for m in wanted)


def normals(item):
    """Normals of the corners of the evaluated mesh, float64[C, 3], and which to compare, bool[C].

    A corner between polygons with opposite normals, as in teeth of coarse levels, has no normal.
    """
    seen = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = seen.to_mesh()
    corners, faces = len(mesh.loops), len(mesh.polygons)
    flat, sides = np.empty(corners * 3, np.float32), np.empty(faces * 3, np.float32)
    points, sizes = np.empty(corners, np.int32), np.empty(faces, np.int32)
    mesh.corner_normals.foreach_get("vector", flat)
    mesh.polygons.foreach_get("normal", sides)
    mesh.polygons.foreach_get("loop_total", sizes)
    mesh.loops.foreach_get("vertex_index", points)
    mean = np.zeros((len(mesh.vertices), 3))
    np.add.at(mean, points, np.repeat(sides.reshape(-1, 3), sizes, axis=0))
    mean /= np.maximum(np.bincount(points, minlength=len(mean)), 1)[:, None]
    seen.to_mesh_clear()
    there = np.linalg.norm(mean, axis=1)[points] > 0.1
    return flat.reshape(-1, 3).astype(np.float64), there


def bones(rig):
    """The posed matrices of the deforming armature's bones, float64[B, 4, 4]."""
    seen = rig.evaluated_get(bpy.context.evaluated_depsgraph_get()).pose.bones
    flat = np.empty(len(seen) * 16, np.float32)
    seen.foreach_get("matrix", flat)
    return flat.reshape(-1, 4, 4).astype(np.float64)


def settle():
    """Update twice, so that Blender also evaluates the add-on's writes after an edit."""
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()


class Pair:
    """The same face twice, in Direct mode and in Live mode.

    Attributes:
        direct, live: deforming armature of the face in Direct mode and in Live mode.
    """

    def __init__(self, path, **options):
        self.direct = scene.load(path, **options)
        self.live = scene.load(path, "LIVE", **options)
        scene.controls(self.live).location = scene.controls(self.direct).location
        bpy.ops.object.select_all(action="DESELECT")
        settle()

    def each(self):
        return self.direct, self.live

    def set(self, **values):
        """Set sliders of both faces."""
        for rig in self.each():
            scene.set_controls(rig, **values)
        settle()

    def edit(self, change):
        """Make one edit on both faces. Args: change  function of a rig and its head mesh."""
        done = [change(rig, scene.meshes(rig)[0]) for rig in self.each()]
        settle()
        return done

    def apart(self, lod=0):
        """The largest distance between the meshes, relative to their rigs, as a share of size."""
        found = []
        for rig in self.each():
            place = np.linalg.inv(np.array(rig.matrix_world))
            items = [m for _, m in sorted(scene.meshes(rig).items()) if lod in list(m["dna_lods"])]
            found.append([scene.evaluated(m) @ place[:3, :3].T + place[:3, 3] for m in items])
        size = max(np.ptp(points, axis=0).max() for points in found[1])
        pairs = list(zip(*found, strict=True))
        assert all(len(a) == len(b) for a, b in pairs), [(len(a), len(b)) for a, b in pairs]
        return max(float(np.abs(a - b).max()) for a, b in pairs) / size

    def bones_apart(self):
        """The largest difference between elements of posed bone matrices."""
        return float(np.abs(bones(self.direct) - bones(self.live)).max())

    def check(self, near=NEAR):
        """Check that both faces show the same for two poses."""
        for values in ((0.9, 0.2), (0.3, 0.8)):
            self.set(jawOpen=values[0], mouthCornerPullL=values[1])
            assert self.apart() < near
