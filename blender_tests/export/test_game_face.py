# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that Export Game Face writes the active face as glTF, or an error of one sentence."""

import json
import struct

import bpy
import pytest
from support import scene


def _table(path):
    data = path.read_bytes()
    [size] = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size])


def test_the_face_becomes_targets_by_name_with_their_driver(dna_file, tmp_path):
    scene.load(dna_file)
    path = tmp_path / "face.glb"
    done = bpy.ops.risorius.export_game_face(
        filepath=str(path), shapes={"arkit"}, use_quantize=True, use_combinations=True
    )
    assert done == {"FINISHED"}
    table = _table(path)
    assert table["extensionsRequired"] == ["KHR_mesh_quantization"]
    names = [mesh["extras"]["targetNames"] for mesh in table["meshes"] if "extras" in mesh]
    assert "jawOpen" in names[0]
    assert {"face.combinations.json", "combinations.js"} < {p.name for p in tmp_path.iterdir()}


def test_a_level_that_is_not_there_is_one_sentence(dna_file, tmp_path):
    scene.load(dna_file)
    path = tmp_path / "face.glb"
    with pytest.raises(RuntimeError, match="a LOD from 0 to .* was expected, found 15"):
        bpy.ops.risorius.export_game_face(filepath=str(path), lod=15)
    assert not path.exists()


def test_a_vrm_asks_for_its_licence_and_for_a_body(dna_file, tmp_path):
    scene.load(dna_file)
    path = tmp_path / "face.vrm"
    wished = {"filepath": str(path), "shapes": {"arkit"}, "vrm": "1.0", "body": "minimal"}
    with pytest.raises(RuntimeError, match="VRM 1.0 asks for name, .* modification"):
        bpy.ops.risorius.export_game_face(**wished)
    said = {
        "title": "Anna", "authors": "A, B", "avatar": "everyone", "violence": "FORBIDDEN",
        "sexuality": "FORBIDDEN", "commerce": "corporation", "politics": "FORBIDDEN",
        "hate": "FORBIDDEN", "credit": "required", "redistribution": "ALLOWED",
        "modification": "allowModification",
    }  # fmt: skip
    with pytest.raises(RuntimeError, match="VRM 1.0 asks for creditNotation: say"):
        bpy.ops.risorius.export_game_face(**{**wished, **said, "credit": "UNSAID"})
    assert not path.exists()
    assert bpy.ops.risorius.export_game_face(**wished, **said) == {"FINISHED"}
    table = _table(path)["extensions"]["VRMC_vrm"]
    assert table["meta"]["authors"] == ["A", "B"]
    assert table["meta"]["allowRedistribution"] is True
    assert "hips" in table["humanoid"]["humanBones"]


def test_a_face_is_hung_on_a_body_of_a_file(dna_file, tmp_path):
    scene.load(dna_file)
    body, path = tmp_path / "body.glb", tmp_path / "face.glb"
    wished = {"shapes": {"arkit"}, "lod": 1}
    made = {"filepath": str(body), "body": "mixamo", **wished}
    assert bpy.ops.risorius.export_game_face(**made) == {"FINISHED"}
    own = [mesh["name"] for mesh in _table(body)["meshes"]]
    hung = {"filepath": str(path), "body_file": str(body), **wished}
    with pytest.raises(RuntimeError, match="--without Nose: a mesh of the body was expected"):
        bpy.ops.risorius.export_game_face(**hung, without="Nose")
    assert not path.exists()
    assert bpy.ops.risorius.export_game_face(**hung, without=f"{own[0]}, Soles, ") == {"FINISHED"}
    names = [node["name"] for node in _table(path)["nodes"]]
    assert "LeftForeArm" in names
    assert len(_table(path)["meshes"]) == len(own) - 1
