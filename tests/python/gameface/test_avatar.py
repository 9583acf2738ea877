# SPDX-License-Identifier: MIT
"""Tests VRM files and generated bodies: the tables that programs read, and refused options.

packaging/ship/gameface.sh tests such files in three-vrm, TalkingHead and Blender's VRM reader.
"""

import re

import dna_bytes
import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from gltf_oracle import GlbFile
from risorius.cli import main
from risorius.controls import arkit
from risorius.gameface.avatar.humanoid import NEEDED, bone_of

LICENCE = {
    "name": "Anna",
    "authors": ["Somebody", "Somebody else"],
    "avatarPermission": "everyone",
    "allowExcessivelyViolentUsage": False,
    "allowExcessivelySexualUsage": False,
    "commercialUsage": "personalProfit",
    "allowPoliticalOrReligiousUsage": False,
    "allowAntisocialOrHateUsage": False,
    "creditNotation": "required",
    "allowRedistribution": True,
    "modification": "allowModification",
    "licenseName": "CC_BY",
    "contactInformation": "somebody@example.org",
}
BODY = (
    "pelvis spine_01 neck_01 thigh_l calf_l foot_l thigh_r calf_r foot_r upperarm_l lowerarm_l "
    "hand_l upperarm_r lowerarm_r hand_r"
).split()
FLIP = [-1, 1, -1]


def toml_of(table):
    out = []
    for key, value in table.items():
        said = str(value).lower() if isinstance(value, bool) else repr(value).replace("'", '"')
        out.append(f"{key} = {said}")
    return "\n".join(out)


@pytest.fixture(scope="module")
def face(tmp_path_factory):
    """The path of a face with a head joint, and with raw controls that ARKit's shapes use."""
    dna = risorius.load(GOLDEN / "medium.dna")
    names = [c for row in arkit.mapping().values() for c in row]
    dna.raw_control_names = list(dict.fromkeys(names))[: len(dna.raw_control_names)]
    dna.joint_names = [*dna.joint_names[:2], "head", *dna.joint_names[3:]]
    dna.mesh_names = [n.replace("saliva", "eyeLeft") for n in dna.mesh_names]
    path = tmp_path_factory.mktemp("face") / "anna.dna"
    dna.save(path)
    path.with_name("licence.toml").write_text(toml_of(LICENCE))
    return path


def made(face, tmp_path, *more, version="1.0", kind="minimal"):
    out = tmp_path / "anna.vrm"
    licence = face.with_name("licence.toml")
    arguments = ["--vrm", version, "--licence", str(licence), "-o", str(out), *more]
    if kind:
        arguments += ["--humanoid", kind]
    assert main(["export", str(face), *arguments]) == 0
    return GlbFile(out.read_bytes())


def test_a_vrm_1_has_its_bones_expressions_and_licence(face, tmp_path):
    found = made(face, tmp_path)
    assert found.json["extensionsUsed"] == ["VRMC_vrm"]
    table = found.json["extensions"]["VRMC_vrm"]
    bones = {name: row["node"] for name, row in table["humanoid"]["humanBones"].items()}
    assert set(NEEDED) <= bones.keys()
    nodes = found.json["nodes"]
    above = {child: i for i, node in enumerate(nodes) for child in node.get("children", [])}
    assert above[bones["leftHand"]] == bones["leftLowerArm"]
    assert above[bones["spine"]] == bones["hips"]
    preset, custom = table["expressions"]["preset"], table["expressions"]["custom"]
    assert {"happy", "aa", "blink", "blinkLeft", "lookUp", "neutral"} <= preset.keys()
    assert custom.keys() & arkit.mapping().keys() == custom.keys()
    for name, row in [*preset.items(), *custom.items()]:
        for bind in row.get("morphTargetBinds", []):
            mesh = found.json["meshes"][nodes[bind["node"]]["mesh"]]
            assert mesh["extras"]["targetNames"][bind["index"]] == name
    heard = {key: value for key, value in LICENCE.items() if key != "licenseName"}
    assert table["meta"] == {**heard, "licenseUrl": "https://vrm.dev/licenses/1.0/"}
    meshes = [i for i, node in enumerate(nodes) if "mesh" in node]
    assert [row["node"] for row in table["firstPerson"]["meshAnnotations"]] == meshes


def test_an_expression_holds_back_what_it_does_not_go_with(face, tmp_path):
    preset = made(face, tmp_path).json["extensions"]["VRMC_vrm"]["expressions"]["preset"]
    oracle = dna_bytes.Face(face.read_bytes())
    there = set(risorius.load(face).raw_control_names)
    poses = {name: pose for name, pose in _poses() if pose.keys() & there}
    rest, tried = oracle.vertices({}), set()
    for feeling in ("happy", "sad", "surprised"):
        a, b = ({c: v for c, v in poses[n].items() if c in there} for n in (feeling, "blink"))
        both = {c: min(1.0, a.get(c, 0) + b.get(c, 0)) for c in {*a, *b}}
        summed = oracle.vertices(a) + oracle.vertices(b) - rest
        away = 10 * np.linalg.norm(oracle.vertices(both) - summed, axis=1).max()
        if abs(away - 2) > 0.5:  # the file has only the meshes of LOD 0
            tried.add(away > 2)
            assert preset[feeling]["overrideBlink"] == ("blend" if away > 2 else "none")
    assert preset["neutral"]["overrideBlink"] == "none"
    assert tried


def _poses():
    from risorius import expressions

    library = expressions.load()
    yield "blink", {f"CTRL_expressions.eyeBlink{s}": 1.0 for s in "LR"}
    for name, own in (("happy", "joy"), ("sad", "sadness"), ("surprised", "surprise")):
        yield name, dict(library[own].weights)


def test_a_vrm_0_looks_back_and_calls_things_by_its_names(face, tmp_path):
    new = made(face, tmp_path)
    old = made(face, tmp_path, version="0.x")
    for mesh in new.meshes():
        weights = {"jawOpen": 1.0, "happy": 0.5}
        assert (
            np.abs(old.positions(mesh, weights) - new.positions(mesh, weights) * FLIP).max() < 1e-6
        )
    table = old.json["extensions"]["VRM"]
    assert not any("rotation" in node for node in old.json["nodes"])
    groups = {row["presetName"]: row for row in table["blendShapeMaster"]["blendShapeGroups"]}
    for name, title in (("joy", "happy"), ("a", "aa"), ("blink_l", "blinkLeft")):
        for bind in groups[name]["binds"]:
            names = old.json["meshes"][bind["mesh"]]["extras"]["targetNames"]
            assert (names[bind["index"]], bind["weight"]) == (title, 100)
    assert {row["bone"] for row in table["humanoid"]["humanBones"]} >= set(NEEDED)
    assert table["meta"]["commercialUssageName"] == "Allow"
    assert table["meta"]["allowedUserName"] == "Everyone"
    assert table["meta"]["author"] == "Somebody, Somebody else"
    assert table["firstPerson"]["lookAtTypeName"] == "BlendShape"
    materials = [row["name"] for row in table["materialProperties"]]
    assert materials == [row["name"] for row in old.json["materials"]]


def test_a_made_up_body_leaves_the_face_where_it_is(face, tmp_path):
    plain, tall = tmp_path / "plain.glb", tmp_path / "tall.glb"
    own = ["export", str(face), "--shapes", "arkit"]
    assert main([*own, "--no-skeleton", "-o", str(plain)]) == 0
    assert main([*own, "--humanoid", "mixamo", "-o", str(tall)]) == 0
    plain, tall = GlbFile(plain.read_bytes()), GlbFile(tall.read_bytes())
    for mesh in plain.meshes():
        assert np.abs(tall.positions(mesh) - plain.positions(mesh)).max() < 1e-6
    skin, world = tall.json["skins"][0], tall._world()
    inverse = tall.numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    turned = [world[joint] for joint in skin["joints"]]
    assert np.abs(np.array(turned) @ inverse - np.eye(4)).max() < 1e-6
    assert max(np.abs(matrix[:3, :3] - np.eye(3)).max() for matrix in turned) > 0.9
    nodes = tall.json["nodes"]
    assert nodes[0]["name"] == "Armature"
    names = {node["name"] for node in nodes}
    assert {"Hips", "Spine2", "LeftForeArm", "RightHandPinky3", "LeftToeBase", "LeftEye"} <= names
    below = {nodes[i]["name"] for i in nodes[0]["children"]}
    assert below == {*plain.meshes(), "Hips"} | ({"Soles"} & below)
    lowest = min(plain.positions(mesh)[:, 1].min() for mesh in plain.meshes())
    assert ("Soles" in below) == (lowest > 0.3)  # otherwise a mesh touches the ground


def test_a_body_of_the_faces_own_needs_none_made_up(face, tmp_path, capsys):
    dna = risorius.load(face)
    dna.joint_names = [*dna.joint_names[:3], *BODY, *dna.joint_names[3 + len(BODY) :]]
    path = tmp_path / "whole.dna"
    dna.save(path)
    path.with_name("licence.toml").write_text(toml_of(LICENCE))
    found = made(path, tmp_path, kind="")
    bones = found.json["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    assert bones.keys() == {*NEEDED, "neck"}
    capsys.readouterr()
    licence = str(path.with_name("licence.toml"))
    code, line = sentence(capsys, face, "--vrm", "1.0", "--licence", licence)
    assert code == 1
    assert f"{face}: a humanoid has 15 bones, the face has no hips, spine, leftUpperArm" in line
    assert line.endswith("--humanoid minimal makes them up")


@pytest.mark.parametrize(
    ("joint", "bone"),
    [
        ("upperarm_l", "leftUpperArm"),
        ("mixamorig:RightForeArm", "rightLowerArm"),
        ("J_Bip_L_UpperLeg", "leftUpperLeg"),
        ("J_Bip_C_Hips", "hips"),
        ("spine_01", "spine"),
        ("Spine1", "chest"),
        ("foot.R", "rightFoot"),
        ("index_02_l", "leftIndexIntermediate"),
        ("LeftHandPinky3", "leftLittleDistal"),
        ("upperarm_twist_01_l", ""),
        ("FACIAL_L_Brow1", ""),
    ],
)
def test_joints_of_known_bodies_are_bones(joint, bone):
    assert bone_of(joint) == bone


def sentence(capsys, *arguments):
    code = main(["export", *map(str, arguments)])
    [line] = capsys.readouterr().err.splitlines()
    return code, line


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (None, "VRM 1.0 asks for name, authors, avatarPermission"),
        ({"name": ""}, "name: a text was expected, found ''"),
        ({"authors": []}, "authors: a list of texts was expected, found []"),
        ({"authors": [" "]}, "authors: a list of texts was expected, found [' ']"),
        ({"allowRedistribution": "yes"}, "true or false was expected, found 'yes'"),
        ({"commercialUsage": "all"}, "personalProfit or corporation was expected, found 'all'"),
        ({"colour": "red"}, "colour: a field of name, authors,"),
    ],
)
def test_a_licence_is_said_and_never_assumed(face, tmp_path, capsys, change, said):
    path, out = tmp_path / "licence.toml", tmp_path / "f.vrm"
    path.write_text("" if change is None else toml_of({**LICENCE, **change}))
    code, line = sentence(
        capsys, face, "-o", out, "--vrm", "1.0", "--humanoid", "minimal", "--licence", path
    )
    assert code == 1
    assert said in line
    assert not out.exists()


def test_wishes_that_do_not_go_together(face, tmp_path, capsys):
    code, line = sentence(capsys, face, "-o", tmp_path / "f.vrm", "--vrm", "1.0")
    assert (code, "f.vrm: VRM 1.0 asks for name" in line) == (1, True)
    code, line = sentence(capsys, face, "-o", tmp_path / "f.glb", "--vrm", "1.0")
    assert (code, ".vrm" in line) == (2, True)
    code, line = sentence(capsys, face, "--licence", tmp_path / "l.toml")
    assert (code, "--licence is of a VRM" in line) == (2, True)
    code, line = sentence(capsys, face, "--humanoid", "minimal", "--no-skeleton")
    assert (code, "--no-skeleton" in line) == (2, True)
    code, line = sentence(
        capsys, GOLDEN / "tiny_v28.dna", "--shapes", "all", "--humanoid", "mixamo"
    )
    assert (code, "a joint called head was expected" in line) == (1, True)


# Engine -> (characters in names of nodes and targets that it refuses or treats as part of a path;
# whether it ignores case). The engines are not run here.
ENGINES = {
    "Godot": (r'[.:@/"%]', False),
    "Unity": (r"[/\x00-\x1f]", False),
    "Unreal": (r"""[\s"',./:|&!~@#(){}\[\]=;^%$`]""", True),
}


@pytest.mark.parametrize("engine", ENGINES)
def test_names_are_such_as_engines_take(face, tmp_path, engine):
    dna = risorius.load(face)
    dna.mesh_names = [f"a b/{name}" for name in dna.mesh_names]
    dna.raw_control_names = [*dna.raw_control_names[:-2], "CTRL_expressions.a b$", "own.JawOpen"]
    path, out = tmp_path / "named.dna", tmp_path / "named.glb"
    dna.save(path)
    groups = "arkit,visemes,vrm,expressions,all"
    wished = ["--shapes", groups, "--humanoid", "mixamo", "--lod", "3"]
    assert main(["export", str(path), "-o", str(out), *wished]) == 0
    found = GlbFile(out.read_bytes()).json
    refused, is_loose = ENGINES[engine]
    lists = [[node["name"] for node in found["nodes"]]]
    lists += [mesh["extras"]["targetNames"] for mesh in found["meshes"] if "extras" in mesh]
    for names in lists:
        assert not [name for name in names if re.search(refused, name) or len(name) > 1023]
        assert len({name.lower() if is_loose else name for name in names}) == len(names)
    assert len(lists[1]) > 150
