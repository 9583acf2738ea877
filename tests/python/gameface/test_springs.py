# SPDX-License-Identifier: MIT
"""Tests long hair that swings: its joints, their weights, and the tables of VRM.

packaging/ship/gameface.sh tests such files in three-vrm and Blender's VRM reader.
"""

import numpy as np
import pytest
import risorius
from body_maker import BodyFile
from gltf_oracle import GlbFile
from risorius.cli import main
from risorius.gameface.avatar.springs import Collider, Spring, Springs, table_0
from test_avatar import LICENCE, face, toml_of  # noqa: F401  # a fixture

LENGTH = 0.18  # metres


@pytest.fixture(scope="module")
def haired(face, tmp_path_factory):  # noqa: F811
    """The path of a face with hair that hangs 18 cm behind the head."""
    dna = risorius.load(face)
    path = tmp_path_factory.mktemp("haired") / "anna.dna"
    dna.mesh_names = [name.replace("eyeLeft", "hair") for name in dna.mesh_names]
    for name, mesh in zip(dna.mesh_names, dna.meshes, strict=True):
        if name.startswith("hair"):
            mesh.positions = curtain(mesh.positions, LENGTH)
    dna.save(path)
    path.with_name("licence.toml").write_text(toml_of(LICENCE))
    return path


def curtain(positions, length):
    """Positions in cm of a narrow strip of hair that hangs down behind the head."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    share = (positions - low) / np.maximum(high - low, 1e-9)
    return ((share - [0.5, 1, 0.5]) * [5, 100 * length, 1] + [0, 165, -12]).astype(np.float32)


def made(haired, tmp_path, *more, version="1.0", body=("--humanoid", "minimal")):
    out = tmp_path / "anna.vrm"
    licence = haired.with_name("licence.toml")
    arguments = ["--vrm", version, "--licence", str(licence), "-o", str(out), *body, *more]
    assert main(["export", str(haired), *arguments]) == 0
    return GlbFile(out.read_bytes())


def hair_of(found):
    [name] = [name for name in found.meshes() if name.startswith("hair")]
    return name


def chains_of(found):
    names = [row["name"] for row in found.json["nodes"]]
    rows = found.json["extensions"]["VRMC_springBone"]["springs"]
    return [[names[joint["node"]] for joint in row["joints"]] for row in rows]


@pytest.mark.parametrize("version", ["1.0", "0.x"])
def test_long_hair_gets_chains_and_stays_where_it_is_at_rest(haired, tmp_path, version):
    found = made(haired, tmp_path, version=version)
    stiff = made(haired, tmp_path, "--no-springs", version=version)
    for name in found.meshes():
        assert np.abs(found.positions(name) - stiff.positions(name)).max() < 1e-6
    assert "VRMC_springBone" not in stiff.json["extensionsUsed"]
    assert not [row for row in stiff.json["nodes"] if row["name"].startswith("Hair")]
    assert [row["name"] for row in found.json["nodes"] if row["name"].startswith("Hair1")] == [
        "Hair1_1", "Hair1_2", "Hair1_3", "Hair1_4",
    ]  # fmt: skip


def test_a_chain_moves_the_tips_and_not_the_roots(haired, tmp_path):
    found = made(haired, tmp_path)
    name, nodes, world = hair_of(found), found.json["nodes"], found._world()
    rest = found.positions(name)
    first = next(i for i, row in enumerate(nodes) if row["name"] == "Hair1_1")
    moved, waiting = dict(world), [first]
    while waiting:  # all of the chain goes to the side, which weights alone decide
        number = waiting.pop()
        moved[number] = world[number] + 0.1 * np.eye(4)[:, :1] * np.eye(4)[3]
        waiting += nodes[number].get("children", [])
    share = (found.positions(name, world=moved) - rest)[:, 0] / 0.1
    down = (rest[:, 1].max() - rest[:, 1]) / LENGTH
    assert share[down < 0.02].max() < 0.02
    assert share[down > 0.5].min() > 0.99
    order = np.argsort(down)
    assert (np.diff(share[order]) > -0.02).all()
    others = [other for other in found.meshes() if other != name]
    for other in others:
        assert np.abs(found.positions(other, world=moved) - found.positions(other)).max() == 0


def test_vrm_1_lists_chains_and_a_sphere_in_the_head(haired, tmp_path):
    found = made(haired, tmp_path)
    table = found.json["extensions"]["VRMC_springBone"]
    assert 1 <= len(chains_of(found)) <= 12
    assert all(2 <= len(chain) <= 4 for chain in chains_of(found))
    [ball] = table["colliders"]
    bones = found.json["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
    assert ball["node"] == bones["head"]["node"]
    world = found._world()
    centre = world[ball["node"]][:3, 3] + ball["shape"]["sphere"]["offset"]
    for spring in table["springs"]:
        assert spring["colliderGroups"] == [0]
        for joint in spring["joints"][1:]:  # none begins inside, where the sphere would push it
            away = np.linalg.norm(world[joint["node"]][:3, 3] - centre)
            assert away > ball["shape"]["sphere"]["radius"] + joint["hitRadius"] - 1e-6
            assert 0 < joint["stiffness"] <= 4
            assert 0 <= joint["dragForce"] <= 1


def test_vrm_0_lists_the_first_bones_of_chains(haired, tmp_path):
    found, new = (made(haired, tmp_path, version=v) for v in ("0.x", "1.0"))
    table = found.json["extensions"]["VRM"]["secondaryAnimation"]
    names = [row["name"] for row in found.json["nodes"]]
    [group] = table["boneGroups"]
    assert sorted(names[bone] for bone in group["bones"]) == sorted(
        chain[0] for chain in chains_of(new)
    )
    assert group["colliderGroups"] == [0]
    [ball] = table["colliderGroups"][0]["colliders"]
    [sphere] = new.json["extensions"]["VRMC_springBone"]["colliders"]
    x, y, z = sphere["shape"]["sphere"]["offset"]
    # VRM 0.x faces back, which reverses x and z, and Unity's z axis is opposite to glTF's.
    assert np.abs([ball["offset"][k] for k in "xyz"] - np.array([-x, y, z])).max() < 1e-6


def test_vrm_0_has_unitys_z_and_no_capsules():
    ball = Collider(3, [1.0, 2.0, 3.0], 0.1, [1.0, 2.0, 5.0])
    [group] = table_0(Springs([Spring("a", [1, 2], [0])], [ball]))["colliderGroups"]
    assert [row["offset"]["z"] for row in group["colliders"]] == [-3, -4, -5]


def test_short_hair_and_lashes_stay_rigid(haired, tmp_path):
    dna = risorius.load(haired)
    for name, length in (("hair", 0.03), ("eyelashes", LENGTH)):
        names = list(dna.mesh_names)
        for i, own in enumerate(names):
            if own.startswith(("hair", "eyelashes")):
                names[i] = own.replace("hair", name)
                dna.meshes[i].positions = curtain(dna.meshes[i].positions, length)
        dna.mesh_names = names
        path = tmp_path / f"{name}.dna"
        dna.save(path)
        (tmp_path / "licence.toml").write_text(toml_of(LICENCE))
        found = made(path, tmp_path, "--shapes", "vrm", "--lod", "1")
        assert "VRMC_springBone" not in found.json["extensions"]


def test_hair_on_a_body_hangs_below_its_head_bone(haired, tmp_path):
    path = tmp_path / "body.glb"
    path.write_bytes(BodyFile().data())
    found = made(haired, tmp_path, body=("--body", str(path)))
    nodes = found.json["nodes"]
    above = {child: i for i, row in enumerate(nodes) for child in row.get("children", [])}
    at = next(i for i, row in enumerate(nodes) if row["name"] == "Hair1_1")
    assert nodes[above[at]]["name"] == "Head"
    assert nodes[above[above[at]]]["name"] == "mixamorig:Head"
    stiff = made(haired, tmp_path, "--no-springs", body=("--body", str(path)))
    name = hair_of(found)
    assert np.abs(found.positions(name) - stiff.positions(name)).max() < 1e-6


def balls_of(found):
    """Places of colliders in the scene, first nodes of chains, and directions of gravity."""
    tables, world, nodes = found.json["extensions"], found._world(), found.json["nodes"]
    if "VRMC_springBone" in tables:
        table = tables["VRMC_springBone"]
        balls = [(row["node"], row["shape"]["sphere"]["offset"]) for row in table["colliders"]]
        first = {nodes[row["joints"][0]["node"]]["name"] for row in table["springs"]}
        down = [row["joints"][0]["gravityDir"] for row in table["springs"]]
    else:
        table = tables["VRM"]["secondaryAnimation"]
        balls = [
            (row["node"], [ball["offset"]["x"], ball["offset"]["y"], -ball["offset"]["z"]])
            for row in table["colliderGroups"] for ball in row["colliders"]
        ]  # fmt: skip
        first = {nodes[bone]["name"] for row in table["boneGroups"] for bone in row["bones"]}
        down = [[row["gravityDir"][axis] for axis in "xyz"] for row in table["boneGroups"]]
    return np.array([world[n] @ [*at, 1] for n, at in balls])[:, :3], first, down


@pytest.mark.parametrize("before", ["1.0", "0.x"])
@pytest.mark.parametrize("after", ["1.0", "0.x"])
def test_springs_of_a_body_swing_in_both_versions(haired, face, tmp_path, before, after):  # noqa: F811
    own = made(haired, tmp_path, version=before)
    path = tmp_path / "body.vrm"
    (tmp_path / "anna.vrm").rename(path)
    found = made(face, tmp_path, version=after, body=("--body", str(path)))
    turn = np.array([-1, 1, -1]) if before != after else np.ones(3)
    (at, first, down), (goal, wanted, _) = balls_of(found), balls_of(own)
    assert np.abs(at - goal * turn).max() < 1e-6
    assert first == wanted
    assert np.abs(np.array(down) - [0, -1, 0]).max() == 0
    for name in own.meshes():
        [same] = [n for n in found.meshes() if n in (name, f"{name}_2")][-1:]
        assert np.abs(found.positions(same) - own.positions(name) * turn).max() < 1e-5
