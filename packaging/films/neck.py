# SPDX-License-Identifier: MIT
"""Renders one picture of a head at the limits of its turns, without and with neck poses.

neck.py -- --extension ZIP --out FOLDER FILE.dna [--size PIXELS] [--samples N]

Writes FOLDER/neck.jpg and FOLDER/poses.dna. The first row shows the given file. The second row
shows poses.dna, the same face with the poses of neck_poses.py.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import bpy  # noqa: E402
import closeups  # noqa: E402
import demo  # noqa: E402
import install_extension  # noqa: E402
import neck_poses  # noqa: E402
import scene as stage  # noqa: E402
from compare import sheet  # noqa: E402
from mathutils import Matrix, Vector  # noqa: E402

SHOWN = ("left", "right", "up", "down", "tilt left")
# Place and target of the camera in metres from the point between the eyes, and focal length in mm.
PLACE, TARGET, LENS = Vector((0.42, -0.85, 0.02)), Vector((0.0, 0.03, -0.115)), 100


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("face", type=Path)
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--size", type=int, default=320)
    parser.add_argument("--samples", type=int, default=8, help="in each pixel")
    return parser.parse_args(install_extension.arguments())


def turn(controls, bone, angles):
    """Rotate a control bone from rest by Rz(yaw) Rx(-pitch) Ry(roll) about the armature's axes.

    Args:
        controls: control armature of the face.
        bone: name of the bone.
        angles: (yaw, pitch, roll), radians.
    """
    yaw, pitch, roll = angles
    matrix = Matrix.Rotation(yaw, 3, "Z") @ Matrix.Rotation(-pitch, 3, "X")
    matrix = matrix @ Matrix.Rotation(roll, 3, "Y")
    item = controls.pose.bones[bone]
    rest = item.bone.matrix_local.to_quaternion()
    item.rotation_mode = "QUATERNION"
    item.rotation_quaternion = rest.inverted() @ matrix.to_quaternion() @ rest


def pictures(path, args):
    """Render a face in the poses of SHOWN. Returns pose -> path of the picture."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    controls = demo.import_face(path)
    collection = controls.users_collection[0]
    stage.build(collection, strands=False)
    scene = bpy.context.scene
    scene.cycles.samples = args.samples
    closeups.use_engine("cycles")
    eyes = [closeups.middle(collection, name) for name in ("eyeLeft", "eyeRight")]
    origin = sum(eyes, Vector()) / 2
    camera = scene.camera
    camera.location = origin + PLACE
    stage.aim(camera, origin + TARGET)
    camera.data.lens, camera.data.dof.use_dof = LENS, False
    out = {}
    for name in SHOWN:
        for bone, angles in neck_poses.LIMITS[name].items():
            turn(controls, bone, angles)
        controls.update_tag()
        bpy.context.view_layer.update()
        out[name] = args.out / f"{path.stem}_{name}.png"
        demo.still(out[name], 1, args.size)
    return out


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    install_extension.install(args.extension)
    posed = args.out / "poses.dna"
    neck_poses.add(args.face, posed)
    textures = args.face.with_name(f"{args.face.stem}_textures")
    if textures.is_dir():
        shutil.copytree(textures, args.out / "poses_textures", dirs_exist_ok=True)
    rows = {"as skinned": pictures(args.face, args), "with neck poses": pictures(posed, args)}
    sheet(rows, args.size).save(args.out / "neck.jpg", quality=88)


if __name__ == "__main__":
    stage.end_with(main)
