# SPDX-License-Identifier: MIT
"""in_blender.py MODULES FILES.vrm: imports exported VRM files into Blender (bpy-vrm-format).

MODULES is the folder into which pip installed bpy-vrm-format. Checks that Blender's bones,
expressions, licence and look-at equal those of the file, and that each shape key moves the vertices
as the morph target in the file does.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path[:0] = [sys.argv[1], str(HERE.parents[2] / "tests" / "python" / "support")]

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from gltf_oracle import GlbFile  # noqa: E402

CLIENT_MM = 0.05


def try_file(path: Path) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="io_scene_vrm")
    if bpy.ops.import_scene.vrm(filepath=str(path)) != {"FINISHED"}:
        raise RuntimeError(f"{path}: the reader refuses it")
    found = GlbFile(path.read_bytes())
    [armature] = [one for one in bpy.data.objects if one.type == "ARMATURE"]
    read: Any = armature.data
    read = read.vrm_addon_extension
    own = found.json["extensions"]
    if read.is_vrm1():
        bones, expressions, name = try_new(read.vrm1, own["VRMC_vrm"])
    else:
        bones, expressions, name = try_old(read.vrm0, own["VRM"])
    chains = [
        len(one.get("joints", ())) for one in own.get("VRMC_springBone", {}).get("springs", ())
    ]
    if chains:
        assert [len(one.joints) for one in read.spring_bone1.springs] == chains
    chains += [0] * len(own.get("VRM", {}).get("secondaryAnimation", {}).get("boneGroups", ()))
    worst = max(moved(found, mesh) for mesh in found.meshes())
    print(f"{path.name}: {name}, {bones} bones, {expressions} expressions, "
          f"{len(chains)} springs, {worst:.4f} mm")  # fmt: skip
    if worst > CLIENT_MM:
        raise RuntimeError(f"{path}: at most {CLIENT_MM} mm were expected")


def try_new(read: Any, own: Any) -> tuple[int, int, str]:
    """Check a VRM 1.0 file. Returns its numbers of bones and expressions, and its name."""
    bones = {
        str(name.value if hasattr(name, "value") else name): bone.node.bone_name
        for name, bone in read.humanoid.human_bones.human_bone_name_to_human_bone().items()
        if bone.node.bone_name
    }
    assert bones.keys() == own["humanoid"]["humanBones"].keys(), bones
    expressions = read.expressions.all_name_to_expression_dict()
    for kind in ("preset", "custom"):
        for name, said in own["expressions"][kind].items():
            one = expressions[name]
            assert len(one.morph_target_binds) == len(said.get("morphTargetBinds", [])), name
            assert one.override_blink == said["overrideBlink"], name
    assert read.look_at.type == "expression"
    assert [one.value for one in read.meta.authors] == own["meta"]["authors"]
    return len(bones), len(expressions), read.meta.vrm_name


def try_old(read: Any, own: Any) -> tuple[int, int, str]:
    """Check a VRM 0.x file. Returns its numbers of bones and expressions, and its title."""
    bones = {one.bone for one in read.humanoid.human_bones if one.node.bone_name}
    assert bones == {row["bone"] for row in own["humanoid"]["humanBones"]}, bones
    groups = read.blend_shape_master.blend_shape_groups
    wanted = own["blendShapeMaster"]["blendShapeGroups"]
    assert [(g.name, len(g.binds)) for g in groups] == [
        (g["name"], len(g["binds"])) for g in wanted
    ]
    assert read.meta.author == own["meta"]["author"]
    return len(bones), len(groups), read.meta.title


def moved(found: GlbFile, mesh: str) -> float:
    """The largest difference in mm between a mesh's shape keys and the targets of the file.

    The x, y and z of each vertex's displacement are compared.
    """
    data: Any = bpy.data.objects[mesh].data
    if data.shape_keys is None:
        assert not found.names(mesh)
        return 0.0
    keys, count, worst = data.shape_keys.key_blocks, len(data.vertices), 0.0
    rest = np.empty(3 * count, np.float32)
    keys[0].data.foreach_get("co", rest)
    for name in found.names(mesh):
        at = np.empty(3 * count, np.float32)
        keys[name].data.foreach_get("co", at)
        delta = (at - rest).reshape(-1, 3).astype(np.float64)
        own = found.positions(mesh, {name: 1.0}) - found.positions(mesh)
        worst = max(worst, 1000 * float(np.abs(delta - own[:, [0, 2, 1]] * [1, -1, 1]).max()))
    return worst


code = 1
try:
    for text in sys.argv[2:]:
        try_file(Path(text))
    code = 0
except Exception as error:  # noqa: BLE001 - said here, since bpy does not end by itself
    print(f"{type(error).__name__}: {error}")
sys.stdout.flush()
os._exit(code)
