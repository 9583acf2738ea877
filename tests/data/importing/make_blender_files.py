# SPDX-License-Identifier: MIT
"""Writes blender.glb and blender.fbx into this folder: a triangle with three animated shape keys.

python tests/data/importing/make_blender_files.py    (with bpy; the files are of bpy 4.5)
"""

from pathlib import Path

import bpy

KEYS = {
    "jawOpen": {1: 0.0, 11: 1.0, 31: 0.25},
    "eyeBlinkLeft": {1: 1.0, 31: 0.0},
    "mouthSmile_R": {},
}
FPS = 30


def make_face():
    mesh = bpy.data.meshes.new("Face")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    face = bpy.data.objects.new("Face", mesh)
    bpy.context.scene.collection.objects.link(face)
    face.shape_key_add(name="Basis")
    for name, keys in KEYS.items():
        block = face.shape_key_add(name=name)
        block.data[0].co = (0, 0, 0.1)
        for frame, value in keys.items():
            block.value = value
            block.keyframe_insert("value", frame=frame)
    for curve in mesh.shape_keys.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = FPS, 1, 31
    make_face()
    here = Path(__file__).parent
    bpy.ops.export_scene.gltf(filepath=str(here / "blender.glb"))
    bpy.ops.export_scene.fbx(
        filepath=str(here / "blender.fbx"),
        bake_anim_use_nla_strips=False,
        bake_anim_use_all_actions=False,
        bake_anim_simplify_factor=0.0,
    )


if __name__ == "__main__":
    main()
