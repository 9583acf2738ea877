# SPDX-License-Identifier: MIT
"""Remeshes the sample man's head, and makes a rig from it by the steps for any head.

    python tests/bench/author_remeshed.py --out remeshed.dna [--voxel 4.0] [--joints 120]

Blender (the bpy module) remeshes the head by voxels; each expression is carried over from the
nearest place on the old surface. The new head goes through the same steps as OBJ files do. Prints
what `risorius author` prints.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from risorius.author import FitOptions, RigOptions, make_joint_rig
from risorius.author.input.matching import assign
from risorius.author.input.obj import ObjMesh
from risorius.author.input.shape_face import ShapeSet, check_shapes, make_shape_face
from risorius.cli.author import as_lines
from risorius.controls.arkit import mapping
from risorius_people import blend_shape_face
from risorius_people.people import MAN
from risorius_people.source import Source, fetch


def old_head(source):
    """The man's head at LOD 1: positions [V, 3], polygons, ARKit shape -> displacements, in cm."""
    _, parts, body = blend_shape_face.assemble(source, print, MAN)
    part = next(p for p in parts if p.name == "head_lod1_mesh")
    count = len(body.positions)
    units = {
        name: part.carry(source.face_unit(name, count)) * blend_shape_face.CM for name in mapping()
    }
    return part.carry(body.positions) * blend_shape_face.CM, part.polygons.faces, units


def remeshed(positions, faces, voxel):
    """Positions in cm and polygons of Blender's voxel remesh of a head.

    Args:
        positions: float64[V, 3], cm.
        faces: vertex indices of each polygon.
        voxel: size of a voxel, mm.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("head")
    mesh.from_pydata(positions.tolist(), [], [list(map(int, face)) for face in faces])
    item = bpy.data.objects.new("head", mesh)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    solid = item.modifiers.new("solid", "SOLIDIFY")  # the voxel remesh needs a volume
    solid.thickness = voxel / 10
    remesh = item.modifiers.new("remesh", "REMESH")
    remesh.mode, remesh.voxel_size = "VOXEL", voxel / 10
    made = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    points = np.array([v.co for v in made.vertices], float)
    polygons = [list(p.vertices) for p in made.polygons]
    return points, polygons


def carried(points, positions, faces, units):
    """Name -> displacements, copied for each point from the nearest place on the old surface."""
    triangles = np.array([[f[0], f[i], f[i + 1]] for f in faces for i in range(1, len(f) - 1)])
    tree = BVHTree.FromPolygons(positions.tolist(), triangles.tolist())
    corners, shares, apart = [], [], []
    for point in points:
        place, _, number, distance = tree.find_nearest(Vector(point))
        a, b, c = (positions[i] for i in triangles[number])
        rows = np.column_stack([b - a, c - a])
        uv, *_ = np.linalg.lstsq(rows, np.array(place) - a, rcond=None)
        corners.append(triangles[number])
        shares.append([1 - uv.sum(), *uv])
        apart.append(distance)
    corners, shares = np.array(corners), np.array(shares)
    print(f"new vertices lie at most {10 * max(apart):.2f} mm off the old surface")
    return {n: np.einsum("vk,vkx->vx", shares, d[corners]) for n, d in units.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--voxel", type=float, default=4.0, help="mm (default: %(default)s)")
    parser.add_argument("--joints", type=int, default=120)
    args = parser.parse_args()
    positions, faces, units = old_head(Source(fetch()))
    points, polygons = remeshed(positions, faces, args.voxel)
    print(f"{len(positions):,} vertices before, {len(points):,} after")
    moved = carried(points, positions, faces, units)
    shapes = ShapeSet("remeshed", ObjMesh(points, np.zeros((0, 2)), polygons), moved)
    for sentence in check_shapes(shapes):
        print("note:", sentence)
    dna = make_shape_face(shapes, assign(shapes.expressions, {}))
    rig = make_joint_rig(dna, RigOptions(FitOptions(joints=args.joints)))
    rig.dna.save(args.out)
    print("\n".join(as_lines(rig, args.out)))


if __name__ == "__main__":
    main()
