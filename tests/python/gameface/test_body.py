# SPDX-License-Identifier: MIT
"""Tests the export of a face on a user's body: position, and the body's meshes and bones.

Damaged body files are refused.

packaging/ship/gameface.sh tries three-vrm and the VRM reader of Blender."""

import numpy as np
import pytest
import risorius
from body_maker import PIXEL, TURN, BodyFile
from gltf_oracle import GlbFile
from risorius.cli import main
from risorius.gameface.avatar.humanoid import NEEDED
from test_avatar import FLIP, face, sentence  # noqa: F401  # a fixture


def hung(face, tmp_path, body, *more, version="1.0"):  # noqa: F811
    path, out = tmp_path / "body.glb", tmp_path / "anna.vrm"
    path.write_bytes(body if isinstance(body, bytes) else body.data())
    licence = face.with_name("licence.toml")
    arguments = ["export", str(face), "-o", str(out), "--body", str(path), "--lod", "2", *more]
    if version:
        arguments += ["--vrm", version, "--licence", str(licence)]
    else:
        arguments[3] = str(out := out.with_suffix(".glb"))
    assert main(arguments) == 0
    return GlbFile(out.read_bytes())


def places(found, names):
    return {name: found.positions(name) for name in names}


def node(found, name):
    return next(i for i, row in enumerate(found.json["nodes"]) if row["name"] == name)


def own_head(face):  # noqa: F811
    dna = risorius.load(face)
    [head] = [i for i, name in enumerate(dna.joint_names) if name == "head"]
    from risorius.author.geometry.skeleton import world_matrices

    count = len(dna.joint_names)
    return world_matrices(dna, np.zeros((count, 9)))[head][:3, 3] / 100


@pytest.mark.parametrize("version", ["1.0", "0.x"])
def test_a_body_keeps_its_places_and_takes_the_face(face, tmp_path, version):  # noqa: F811
    body = BodyFile(back=version == "0.x")
    found = hung(face, tmp_path, body, version=version)
    for name, at in body.shown.items():  # each version looks the way the body already looks
        assert np.abs(found.positions(name) - at).max() < 1e-6
    plain = tmp_path / "plain.glb"
    assert main(["export", str(face), "--lod", "2", "--no-skeleton", "-o", str(plain)]) == 0
    plain, head = GlbFile(plain.read_bytes()), own_head(face)
    goal = np.array([0, 1.6, 0.02])
    for name in plain.meshes():
        moved = plain.positions(name) - head + goal
        moved = moved * FLIP if version == "0.x" else moved
        assert np.abs(found.positions(name) - moved).max() < 1e-6
        assert len(found.names(name)) > 0 or not plain.names(name)
    nodes, world = found.json["nodes"], found._world()
    above = {child: i for i, row in enumerate(nodes) for child in row.get("children", [])}
    bone = node(found, "mixamorig:Head")
    assert above[node(found, "Head")] == bone
    assert np.abs(world[node(found, "Head")] - world[bone])[:3, 3].max() < 1e-6
    assert ("rotation" in nodes[0]) == (version == "1.0")
    key = "VRMC_vrm" if version == "1.0" else "VRM"
    rows = found.json["extensions"][key]["humanoid"]["humanBones"]
    said = {r["bone"]: r["node"] for r in rows} if isinstance(rows, list) else {
        name: row["node"] for name, row in rows.items()}  # fmt: skip
    assert set(NEEDED) <= said.keys()
    assert nodes[said["head"]]["name"] == "mixamorig:Head"
    assert nodes[said["leftLowerArm"]]["name"] == "mixamorig:LeftForeArm"


def test_a_head_bone_turns_the_face_and_all_that_hangs_on_it(face, tmp_path):  # noqa: F811
    found = hung(face, tmp_path, BodyFile())
    world, head = found._world(), node(found, "mixamorig:Head")
    turn = np.eye(4)
    turn[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    pivot = np.eye(4)
    pivot[:3, 3] = world[head][:3, 3]
    move = pivot @ turn @ np.linalg.inv(pivot)
    waiting, moved = [head], dict(world)
    while waiting:
        number = waiting.pop()
        moved[number] = move @ world[number]
        waiting += found.json["nodes"][number].get("children", [])
    rest = found.positions("Hat")
    expected = rest @ move[:3, :3].T + move[:3, 3]
    assert np.abs(found.positions("Hat", world=moved) - expected).max() < 1e-6
    [teeth] = [name for name in found.meshes() if name.startswith("teeth")]
    rest = found.positions(teeth)
    at = found.positions(teeth, world=moved)
    assert np.abs(at - rest).max() > 0.01
    assert np.abs(found.positions("Torso", world=moved) - found.positions("Torso")).max() == 0


def test_targets_of_a_body_are_turned_with_its_mesh(face, tmp_path):  # noqa: F811
    for version, turn in (("1.0", np.ones(3)), ("0.x", FLIP)):
        found = hung(face, tmp_path, BodyFile(), version=version)
        moved = found.positions("BodyHead", {"jawOpen": 1.0}) - found.positions("BodyHead")
        assert np.abs(moved - (2 * TURN.T @ [0, 0.01, 0]) * turn).max() < 1e-6


def test_a_mirrored_body_shows_its_outside(face, tmp_path):  # noqa: F811
    body = BodyFile()
    hat = next(row for row in body.json["nodes"] if row["name"] == "Hat")
    ways = []
    for hat["scale"] in ([1, 1, 1], [-1, 1, 1]):
        found = hung(face, tmp_path, body)
        [primitive] = found.meshes()["Hat"][1]["primitives"]
        corners = found.positions("Hat")
        if "indices" in primitive:
            corners = corners[found.numbers(primitive["indices"])[:, 0].astype(int)]
        ways.append(np.cross(corners[1] - corners[0], corners[2] - corners[0])[1:])
    assert np.abs(ways[0] - ways[1]).max() < 1e-6  # mirrored in x, and turned over


def test_a_body_keeps_its_materials_and_pictures(face, tmp_path):  # noqa: F811
    found = hung(face, tmp_path, BodyFile())
    names = [row["name"] for row in found.json["materials"]]
    assert "unused" not in names
    cloth = found.json["materials"][names.index("Cloth")]
    number = cloth["pbrMetallicRoughness"]["baseColorTexture"]["index"]
    assert cloth["extensions"]["VRMC_materials_mtoon"]["shadeMultiplyTexture"]["index"] == number
    texture = found.json["textures"][number]
    assert found.json["samplers"][texture["sampler"]] == {"wrapS": 33071}
    image = found.json["images"][texture["source"]]
    assert bytes(found.view(image["bufferView"])) == PIXEL
    assert "VRMC_materials_mtoon" in found.json["extensionsUsed"]
    old = hung(face, tmp_path, BodyFile(), version="0.x").json
    assert "VRMC_materials_mtoon" not in str(old)
    rows = old["extensions"]["VRM"]["materialProperties"]
    assert [row["name"] for row in rows] == [row["name"] for row in old["materials"]]


def test_a_body_in_centimetres_and_one_with_a_scale(face, tmp_path):  # noqa: F811
    for unit, more in ((0.01, ()), (0.5, ("--body-scale", "0.5"))):
        body = BodyFile(unit=unit)
        found = hung(face, tmp_path, body, *more)
        for name, at in body.shown.items():
            assert np.abs(found.positions(name) - at).max() < 1e-5


def test_a_body_that_looks_back_is_turned(face, tmp_path):  # noqa: F811
    body = BodyFile(back=True)
    found = hung(face, tmp_path, body)
    for name, at in body.shown.items():
        assert np.abs(found.positions(name) - at * FLIP).max() < 1e-6


def test_bones_are_those_of_the_bodys_vrm(face, tmp_path):  # noqa: F811
    body = BodyFile(prefix="bone_")
    rows = {"Hips": "hips", "Spine": "spine", "Head": "head", "Spine1": "neck"}
    for side in ("Left", "Right"):
        parts = {"Arm": "UpperArm", "ForeArm": "LowerArm", "Hand": "Hand", "UpLeg": "UpperLeg",
                 "Leg": "LowerLeg", "Foot": "Foot"}  # fmt: skip
        rows.update({side + old: side.lower() + new for old, new in parts.items()})
    bones = {bone: {"node": body.number[name]} for name, bone in rows.items()}
    body.json["extensions"] = {"VRMC_vrm": {"humanoid": {"humanBones": bones}}}
    found = hung(face, tmp_path, body)
    said = found.json["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    names = {bone: found.json["nodes"][row["node"]]["name"] for bone, row in said.items()}
    assert names == {bone: f"bone_{name}" for name, bone in rows.items()}


def test_a_mesh_is_left_out_and_a_face_of_the_bodys_own_is_named(face, tmp_path, capsys):  # noqa: F811
    found = hung(face, tmp_path, BodyFile())
    [line] = [row for row in capsys.readouterr().out.splitlines() if "--without" in row]
    assert "BodyHead, with up to 3 targets such as jawOpen: --without BodyHead leaves it" in line
    table = found.json["extensions"]["VRMC_vrm"]["expressions"]["custom"]["jawOpen"]
    bound = {row["node"] for row in table["morphTargetBinds"]}
    assert node(found, "BodyHead") in bound  # its own jaw opens too
    for name in ("BodyHead", "BodyHeadMesh"):
        found = hung(face, tmp_path, BodyFile(), "--without", name, "--without", "teeth")
        left = found.meshes().keys()
        assert {"Torso", "Hat"} <= left
        assert "BodyHead" not in left
        assert not [mesh for mesh in left if mesh.startswith("teeth")]
        assert "--without" not in capsys.readouterr().out


def test_eyes_meet_the_bodys_eye_bones(face, tmp_path):  # noqa: F811
    dna = risorius.load(face)
    dna.joint_names = [*dna.joint_names[:3], "FACIAL_L_Eye", "FACIAL_R_Eye", *dna.joint_names[5:]]
    dna.save(tmp_path / "eyes.dna")
    (tmp_path / "licence.toml").write_text(face.with_name("licence.toml").read_text())
    found = hung(tmp_path / "eyes.dna", tmp_path, BodyFile(eyes=True))
    world = found._world()
    bones = found.json["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    mine = [world[bones[f"{side}Eye"]["node"]][:3, 3] for side in ("left", "right")]
    assert found.json["nodes"][bones["leftEye"]["node"]]["name"] == "LeftEye"
    middle, head = np.mean(mine, axis=0), world[node(found, "Head")][:3, 3]
    assert np.abs(middle[:2] - [0, 1.68]).max() < 1e-6
    is_deep = abs(middle[2] - head[2] - (0.1 - 0.02)) > 0.03
    assert abs((head[2] - 0.02) if is_deep else (middle[2] - 0.1)) < 1e-6
    old = hung(tmp_path / "eyes.dna", tmp_path, BodyFile(eyes=True), version="0.x")
    offset = old.json["extensions"]["VRM"]["firstPerson"]["firstPersonBoneOffset"]
    assert abs(offset["z"] - (middle[2] - 0.02)) < 1e-6  # to the front, as Unity has it


def test_a_packed_body_is_unpacked(face, tmp_path):  # noqa: F811
    path = tmp_path / "packed.glb"
    asked = ["--humanoid", "mixamo", "--shapes", "visemes", "--lod", "3", "--meshopt", "--quantize"]
    assert main(["export", str(face), "-o", str(path), *asked]) == 0
    packed = GlbFile(path.read_bytes())
    found = hung(face, tmp_path, path.read_bytes(), version="")
    for name in packed.meshes():
        assert np.abs(found.positions(name) - packed.positions(name)).max() < 1e-5
        assert found.names(name) == packed.names(name)
    assert "extensions" not in found.json


def edited(change):
    def data():
        body = BodyFile()
        change(body.json)
        return body.data()

    return data


def hang(nodes, parent, child):
    nodes[parent].setdefault("children", []).append(child)


BAD = {
    "cut short": (lambda: BodyFile().data()[:-40], "cut short"),
    "empty": (lambda: b"", "body.glb"),
    "another kind": (lambda: b"Kaydara FBX Binary  \x00\x1a\x00" + bytes(99), "body.glb"),
    "no node": (edited(lambda j: j.pop("nodes")), "found no node"),
    "no skeleton": (
        edited(lambda j: [row.pop("skin", 0) for row in j["nodes"]]),
        "a body with a skeleton was expected, no mesh has a skin",
    ),
    "no hands": (
        edited(lambda j: [r.update(name=r["name"].replace("Hand", "Fin")) for r in j["nodes"]]),
        "the body has no bone leftHand and rightHand",
    ),
    "a circle": (edited(lambda j: hang(j["nodes"], 5, 1)), "nodes[1]: a node with one parent"),
    "two parents": (edited(lambda j: hang(j["nodes"], 0, 5)), "nodes[5]: a node with one parent"),
    "no such child": (edited(lambda j: hang(j["nodes"], 5, 999)), "nodes[999] was expected"),
    "places that are no numbers": (
        edited(lambda j: j["nodes"][3].update(translation=["a", 0, 0])),
        "nodes[3].translation: 3 finite numbers were expected",
    ),
    "a huge list": (
        edited(lambda j: j["accessors"][1].update(count=10**12)), "bytes more than"
    ),
    "a list beyond the buffer": (
        edited(lambda j: j["accessors"][1].update(count=10**5)), "accessors[1]"
    ),
    "no such joint": (
        edited(lambda j: j["skins"][0].update(joints=[400])), "nodes[400] was expected"
    ),
    "too few joints": (edited(lambda j: j["skins"][0]["joints"].pop()), "joints below 1"),
    "no such texture": (
        edited(lambda j: j["textures"].clear()),
        "materials[1].pbrMetallicRoughness.baseColorTexture: textures[0] was expected",
    ),
    "damaged Draco": (
        edited(lambda j: j["meshes"][0]["primitives"][0].update(
            extensions={"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}})),
        "KHR_draco_mesh_compression",
    ),
    "a spring of no node": (
        edited(lambda j: j.update(extensions={"VRMC_springBone": {
            "springs": [{"joints": [{"node": 400}]}]}})),
        "VRMC_springBone.springs[0]: nodes[400] was expected",
    ),
    "a head below": (
        edited(lambda j: j["nodes"][0].update(rotation=[1, 0, 0, 0], scale=[1, 1, 1])),
        "stands upright along y",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_damaged_body_is_refused_in_one_sentence(face, tmp_path, capsys, name):  # noqa: F811
    make, said = BAD[name]
    path, out = tmp_path / "body.glb", tmp_path / "f.vrm"
    path.write_bytes(make())
    licence = face.with_name("licence.toml")
    more = ("--lod", 3, "--vrm", "1.0", "--licence", licence, "--body", path)
    code, line = sentence(capsys, face, "-o", out, *more)
    assert code == 1
    assert said in line
    assert "body.glb" in line
    assert not out.exists()


def test_options_of_a_body_that_do_not_go_together(face, tmp_path, capsys):  # noqa: F811
    path = tmp_path / "body.glb"
    path.write_bytes(BodyFile().data())
    out = ("-o", tmp_path / "f.glb")
    for more, said in (
        (("--without", "Hat"), "add --body"),
        (("--body-scale", "2"), "add --body"),
        (("--body", path, "--humanoid", "minimal"), "leave it or --body out"),
        (("--body", path, "--no-skeleton"), "--no-skeleton"),
        (("--body", tmp_path / "body.fbx"), "--body"),
        (("--body", path, "--body-scale", "0"), "--body-scale"),
    ):
        try:
            code, line = sentence(capsys, face, *out, *more)
        except SystemExit as end:
            code, line = end.code, capsys.readouterr().err
        assert (code, said in line) == (2, True), line
    code, line = sentence(capsys, face, *out, "--body", path, "--without", "Nose")
    assert (code, "--without Nose: a mesh of the body was expected: BodyHead" in line) == (1, True)


def test_a_body_that_draco_packed(face, tmp_path):  # noqa: F811
    package = pytest.importorskip("DracoPy", reason="NOT RUN: DracoPy is not installed")
    body = BodyFile()
    primitive = body.json["meshes"][0]["primitives"][0]
    number = primitive["attributes"]["POSITION"]
    own = GlbFile(body.data()).numbers(number).astype(np.float32)
    packed = package.encode(
        own, np.array([[0, 1, 2], [0, 2, 3]]), quantization_bits=20, preserve_order=True
    )
    del body.json["accessors"][number]["bufferView"]
    primitive["extensions"] = {"KHR_draco_mesh_compression": {
        "bufferView": body.view(packed), "attributes": {"POSITION": 0}}}  # fmt: skip
    found = hung(face, tmp_path, body)
    for name, at in body.shown.items():
        assert np.abs(found.positions(name) - at).max() < 1e-5
    assert "KHR_draco_mesh_compression" not in str(found.json)


def test_a_vrm_0_keeps_what_its_body_says_of_materials(face, tmp_path):  # noqa: F811
    body = BodyFile(back=True)
    own = {"hips": "Hips", "spine": "Spine", "head": "Head", "leftThumbProximal": "LeftHand"}
    bones = {bone: body.number[name] for bone, name in own.items()}
    for side in ("Left", "Right"):
        parts = {"Arm": "UpperArm", "ForeArm": "LowerArm", "Hand": "Hand", "UpLeg": "UpperLeg",
                 "Leg": "LowerLeg", "Foot": "Foot"}  # fmt: skip
        bones.update({side.lower() + new: body.number[side + old] for old, new in parts.items()})
    rows = [{"name": n, "shader": "VRM/MToon", "textureProperties": {"_MainTex": 0}} for n in "ab"]
    body.json["extensions"] = {"VRM": {
        "humanoid": {"humanBones": [{"bone": b, "node": n} for b, n in bones.items()]},
        "materialProperties": rows}}  # fmt: skip
    found = hung(face, tmp_path, body, version="0.x")
    table = found.json["extensions"]["VRM"]
    [row] = [r for r in table["materialProperties"] if r["shader"] == "VRM/MToon"]
    names = [material["name"] for material in found.json["materials"]]
    material = found.json["materials"][names.index("Cloth")]
    assert row["name"] == "Cloth"
    number = material["pbrMetallicRoughness"]["baseColorTexture"]["index"]
    assert row["textureProperties"] == {"_MainTex": number}
    assert "leftThumbProximal" in {r["bone"] for r in table["humanoid"]["humanBones"]}
