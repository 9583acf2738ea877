# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares a face in Direct mode with the same face in Live mode, which Blender deforms."""

import bpy
import numpy as np

from . import scene

NEAR = 1e-5  # tolerated distance, relative to the face's size


def plan(rig):
    """The last conditions.Plan of a face, which lists the meshes in Direct mode."""
    return scene.submodule("scene.skinning.conditions").known(rig)


def is_direct(rig, *numbers):
    """Whether meshes of a face are in Direct mode and have a disabled armature modifier.

    Args:
        rig: deforming armature of the face.
        numbers: indices of the meshes in the DNA file; none: all meshes.
    """
    items = scene.meshes(rig)
    wanted = [items[n] for n in numbers or items]
    off = all(not m.modifiers[0].show_viewport for m in wanted)
    return off and all(m.session_uid in plan(rig).direct for m in wanted)


def normals(item):
    """Corner normals of an evaluated mesh, float64[C, 3], and whether to compare each, bool[C].

    A corner at which polygons have opposite normals is not compared, because its normal is
    arbitrary. The teeth of coarse levels of detail have such corners.
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
    """Matrices of the posed bones of a deforming armature in armature space, float64[B, 4, 4].

    In memory, the matrices are in Blender's order, column by column.
    """
    seen = rig.evaluated_get(bpy.context.evaluated_depsgraph_get()).pose.bones
    flat = np.empty(len(seen) * 16, np.float32)
    seen.foreach_get("matrix", flat)
    return flat.reshape(-1, 4, 4).astype(np.float64)


def settle():
    """Let Blender evaluate edits, and then evaluate the values that the add-on has written."""
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()


class Pair:
    """Two imports of a DNA file at the same place, one in Direct mode and one in Live mode.

    Attributes:
        direct, live: deforming armatures of the face in Direct mode and of the face in Live mode.
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
        """Set sliders of both faces: end of a slider's name -> value."""
        for rig in self.each():
            scene.set_controls(rig, **values)
        settle()

    def edit(self, change):
        """Make an edit of both faces. Returns the two results of `change`.

        Args:
            change: function that makes the edit; it gets the deforming armature and the head mesh.
        """
        done = [change(rig, scene.meshes(rig)[0]) for rig in self.each()]
        settle()
        return done

    def apart(self, lod=0):
        """Largest coordinate difference of the two faces' vertices, as a share of the face size.

        The vertices are compared in armature space.

        Args:
            lod: level of detail whose meshes are compared.
        """
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
        """The largest difference between elements of both faces' posed bone matrices."""
        return float(np.abs(bones(self.direct) - bones(self.live)).max())

    def check(self, near=NEAR):
        """Assert that the vertices of both faces are equal within `near` in two poses.

        Args:
            near: tolerance as a share of the face size.
        """
        for values in ((0.9, 0.2), (0.3, 0.8)):
            self.set(jawOpen=values[0], mouthCornerPullL=values[1])
            assert self.apart() < near
