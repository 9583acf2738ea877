# SPDX-License-Identifier: MIT
"""Tests that `risorius info --diff` describes every difference in words, and nothing else."""

import copy
import json
import re
import struct
import subprocess
import sys
import warnings

import command_line
import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from full_dna import changed, fields, full, name_of, others
from risorius.cli import main
from risorius.diff import compare

FILES = sorted(GOLDEN.glob("*.dna"))


def diff(*arguments):
    return command_line.run("info", "--diff", *arguments, text=True)


def saved(dna, path, version="2.8"):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dna.save(path, version=version)
    return path


def texts(a, b):
    return [d.text for d in compare(a, b)]


# ---- files that differ are never reported as equal

# Begin of a property's name -> pattern that the description of a change must contain. Other
# properties must be described by the last word of their name.
WORDS = {
    "archetype": "archetype",
    "metadata": r"metadata key",
    "joint_parents": r"joint \w+ has another parent: \w+ instead of",
    "neutral_joint_translations": r"joint \w+ moved ",
    "neutral_joint_rotations": r"joint \w+ turned ",
    "lod_joint_mapping": r"LOD.* lists? .*joint",
    "lod_blend_shape_mapping": r"LOD.* lists? .*channel",
    "lod_animated_map_mapping": r"LOD.* lists? .*animated map",
    "lod_mesh_mapping": r"LOD.* lists? .*mesh",
    "mesh_blend_shape_channel_mapping": "mesh and channel",
    "gui_control_names": "GUI control",
    "blend_shape_channel_names": "channel",
    "psd_count": "corrective",
    "gui_to_raw.": "GUI to raw: .*row",
    "gui_to_raw.from_values": "GUI to raw: row .*: from ",
    "gui_to_raw.to_values": "GUI to raw: row .*: to ",
    "gui_to_raw.slope_values": "GUI to raw: row .*: slope ",
    "gui_to_raw.cut_values": "GUI to raw: row .*: cut ",
    "psds.": "corrective.*(factor|another order|only in)",
    "joint_row_count": "joint row count",
    "joint_column_count": "joint column count",
    "joint_groups": "joint group",
    "joint_groups.lods": "joint group .*rows per LOD",
    "joint_groups.input_indices": "joint group .*inputs",
    "joint_groups.output_indices": "joint group .*row",
    "joint_groups.values": "joint group .*values? changed",
    "joint_groups.joint_indices": "joint group .*joints",
    "blend_shape_channels.lods": "blend shape channels.*rows per LOD",
    "blend_shape_channels.input_indices": "channel .* is driven by .* instead of",
    "blend_shape_channels.output_indices": "driven",
    "animated_maps.lods": "animated maps.*rows per LOD",
    "animated_maps.conditionals.": "animated maps.*row",
    "meshes": "mesh ",
    "meshes.positions": r"mesh \w+: \d+ (vertex|vertices) ",
    "meshes.texture_coordinates": r"mesh \w+: \d+ UV",
    "meshes.normals": r"mesh \w+: \d+ normal",
    "meshes.layout_positions": "layout.* position",
    "meshes.layout_texture_coordinates": "layout.* UV",
    "meshes.layout_normals": "layout.* normal",
    "meshes.face": "faces? ",
    "meshes.maximum_influence_per_vertex": "most influences per vertex",
    "meshes.skin": "skin weights of|joints of some vertices",
    "meshes.blend_shape_targets": "mesh .*(channel|deltas)",
    "machine_learned_behavior.ml_control_names": "network control",
    "machine_learned_behavior.lod_neural_network_mapping": "LOD.* lists? .*network",
    "machine_learned_behavior.neural_networks": "network",
    "machine_learned_behavior.neural_networks.input_indices": "network .*inputs",
    "machine_learned_behavior.neural_networks.output_indices": "network .*outputs",
    "machine_learned_behavior.neural_networks.layers.biases": "network .*layer .*bias",
    "machine_learned_behavior.neural_networks.layers.weights": "network .*layer .*weight",
    "machine_learned_behavior.neural_networks.layers.activation": "network .*layer .*activation",
    "machine_learned_behavior.region": "regions of mesh|meshes? ->",
    "machine_learned_behavior_ext.types": "graph",
    "machine_learned_behavior_ext.types.lod_operation_mappings": "graph .*LOD",
    "machine_learned_behavior_ext.types.operations": "graph .*(set|operation)",
    "machine_learned_behavior_ext.types.operations.": "graph .*set .*operation ",
    "machine_learned_behavior_ext.joints.": "joints of networks",
    "rbf_behavior.lod_solver_mapping": "LOD.* lists? .*solver",
    "rbf_behavior.solvers.name": "solver",
    "rbf_behavior.solvers.raw_control_indices": "solver .*inputs",
    "rbf_behavior.solvers.pose_indices": "solver .*poses",
    "rbf_behavior.solvers.raw_control_values": "solver .*targets",
    "rbf_behavior_ext.pose_control_names": "pose control",
    "rbf_behavior_ext.poses": "pose",
    "rbf_behavior_ext.poses.input_control_indices": "pose .*inputs",
    "rbf_behavior_ext.poses.output_control_indices": "pose .*outputs",
    "rbf_behavior_ext.poses.output_control_weights": "pose .*weight of",
    "joint_behavior_metadata.joint_representations": "joints?",
    "twist_swing_behavior.twists": "twist",
    "twist_swing_behavior.swings": "swing",
}  # fmt: skip
BLENDS = ("blend_weights", "input_control_indices", "output_joint_indices", "twist_axis")
for kind in ("twist", "swing"):
    for field, said in zip(BLENDS, ("blend weight", "inputs", "joints", "axis"), strict=True):
        WORDS[f"twist_swing_behavior.{kind}s.{field}"] = f"{kind} .*{said}"


def words_for(name):
    """The pattern that a difference of a property must match.

    WORDS maps beginnings of property names to patterns; the longest matching beginning counts.
    Without a match, the pattern is the last word of the name.
    """
    fitting = [key for key in WORDS if name == key or (name.startswith(key) and key in name)]
    if fitting:
        return WORDS[max(fitting, key=len)]
    return name.rpartition(".")[2].removesuffix("_names").replace("_", " ")


def tells(difference, name):
    """Whether a difference belongs to a property, its parent or a part of it, and names it.

    Its text must match words_for(name).

    Args:
        difference: a result of compare().
        name: dotted name of the property, without indices.
    """
    # Differences of skin joints and weights are reported as differences of skin_offsets.
    field = re.sub(r"meshes\.skin_(joint_indices|weights)", "meshes.skin_offsets", difference.field)
    name = re.sub(r"meshes\.skin_(joint_indices|weights)", "meshes.skin_offsets", name)
    related = field == name or name.startswith(field + ".") or field.startswith(name + ".")
    return related and field != "" and re.search(words_for(name), difference.text)


def every_change(dna):
    """Yields (path of a field, changed Dna) for each value of others() that changes the file."""
    base = dna.to_bytes()
    for path, value in fields(dna):
        for other in others(value):
            try:
                out = changed(dna, path, other)
                data = out.to_bytes()
            except (ValueError, TypeError):  # a wrong length, or an impossible value
                continue
            if data != base:
                yield path, risorius.load(data)


RIGS = {"full": full, "tiny": lambda: risorius.load(GOLDEN / "tiny_v28.dna")}
# Rig -> largest number of tested changes of each field. Every change of `full` is tested. The small
# golden file has the same fields, so four changes of each are enough.
MOST = {"full": sys.maxsize, "tiny": 4}


def spread_changes(dna, most):
    """Up to `most` changes of each field, spread over its values: (name, changed Dna)."""
    changes = {}
    for path, other in every_change(dna):
        changes.setdefault(name_of(path), []).append(other)
    for name, others_of in changes.items():
        places = np.linspace(0, len(others_of) - 1, min(most, len(others_of))).astype(int)
        yield from ((name, others_of[i]) for i in places)


@pytest.mark.parametrize("which", RIGS)
@pytest.mark.filterwarnings("ignore")
def test_every_change_of_every_field_is_said(which):
    dna = RIGS[which]()
    told, missed = set(), []
    for name, other in spread_changes(dna, MOST[which]):
        found = compare(dna, other)
        told |= {name for d in found if tells(d, name)}
        if not found or any("has no words" in d.text for d in found):
            missed.append(name)
    assert missed == []
    names = {name_of(path) for path, value in fields(dna)}
    # Changes of structs are described by changes of their fields.
    structs = {name for name in names if any(other.startswith(name + ".") for other in names)}
    empty = {name_of(path) for path, value in fields(dna) if hasattr(value, "__len__")
             and not len(value)}  # fmt: skip
    silent = names - told - structs - empty
    assert silent == set()
    if which == "full":
        assert not {name for name in empty if "dependency" not in name}


@pytest.mark.filterwarnings("ignore")
def test_changes_go_through_the_front_door(tmp_path, capsys):
    """The command `info --diff` reports a change of each property, in both directions."""
    dna, seen = full(), set()
    a = saved(dna, tmp_path / "a.dna")
    for path, other in every_change(dna):
        if path[0] in seen:
            continue
        seen.add(path[0])
        b = saved(other, tmp_path / "b.dna")
        assert main(["info", "--diff", str(a), str(b)]) == 1, path
        assert main(["info", "--diff", str(b), str(a)]) == 1, path
        assert "no differences" not in capsys.readouterr().out
    assert len(seen) > 30


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_equal_files_are_the_same(path, tmp_path):
    (tmp_path / "a.json").write_text(risorius.load(path).to_json())
    for other in (path, tmp_path / "a.json"):
        done = diff(path, other)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.splitlines() == ["no differences"]


def test_any_two_files_of_the_collection_differ():
    rigs = [risorius.load(path) for path in FILES]
    for i, a in enumerate(rigs):
        for j, b in enumerate(rigs):
            assert bool(compare(a, b)) == (i != j), (FILES[i], FILES[j])


# ---- matches by name


def reordered(dna, order):
    """The same Dna with its joints in another order.

    order: for each new joint, its index in the old list.
    """
    out = copy.deepcopy(dna)
    new = np.argsort(order)
    out.joint_names = [dna.joint_names[i] for i in order]
    out.joint_parents = new[dna.joint_parents[order]]
    out.neutral_joint_translations = dna.neutral_joint_translations[order]
    out.neutral_joint_rotations = dna.neutral_joint_rotations[order]
    out.lod_joint_mapping = [
        new[dna.lod_joint_mapping[lod]] for lod in range(len(dna.lod_joint_mapping))
    ]
    for group in out.joint_groups:
        joint, attribute = np.divmod(group.output_indices.astype(int), 9)
        group.output_indices = new[joint] * 9 + attribute
        group.joint_indices = new[group.joint_indices]
    for mesh in out.meshes:
        mesh.skin_joint_indices = new[mesh.skin_joint_indices]
    metadata = out.joint_behavior_metadata
    if len(metadata.joint_representations):
        metadata.joint_representations = metadata.joint_representations[order]
    twsw = out.twist_swing_behavior
    for setup in (*twsw.twists, *twsw.swings):
        setup.output_joint_indices = new[setup.output_joint_indices]
    joints = out.machine_learned_behavior_ext.joints
    if len(joints.output_indices):
        joint, attribute = np.divmod(joints.output_indices.astype(int), 9)
        joints.output_indices = new[joint] * 9 + attribute
    return out


def test_another_order_of_joints_is_one_line():
    for dna in (full(), risorius.load(GOLDEN / "medium.dna")):
        n = len(dna.joint_names)
        assert texts(dna, reordered(dna, np.arange(n))) == []
        other = reordered(dna, np.roll(np.arange(n), 1))
        assert texts(dna, other) == ["the joints stand in another order"]


def test_an_inserted_control_shifts_nothing():
    dna = risorius.load(GOLDEN / "medium.dna", layers=["behavior", "geometry"])
    dna = risorius.load(dna.to_bytes())  # without controls of other layers
    other = copy.deepcopy(dna)
    other.raw_control_names = ["CTRL_new", *dna.raw_control_names]
    other.gui_to_raw.output_indices = dna.gui_to_raw.output_indices + 1
    other.psds.rows, other.psds.columns = dna.psds.rows + 1, dna.psds.columns + 1
    other.blend_shape_channels.input_indices = dna.blend_shape_channels.input_indices + 1
    conditionals = other.animated_maps.conditionals
    conditionals.input_indices = conditionals.input_indices + 1
    for group in other.joint_groups:
        group.input_indices = group.input_indices + 1
    assert texts(dna, other) == ["1 raw control only in B: CTRL_new"]


def test_another_order_of_channels_meshes_and_groups():
    dna = full()
    other = copy.deepcopy(dna)
    other.blend_shape_channel_names = ["smile", "open"]
    other.mesh_blend_shape_channel_mapping = [[0, 1], [0, 0], [1, 1]]
    other.lod_blend_shape_mapping = [[1, 0], [1]]
    other.blend_shape_channels.output_indices = [1, 0]
    for mesh in other.meshes:
        for target in mesh.blend_shape_targets:
            target.blend_shape_channel_index = 1 - target.blend_shape_channel_index
    assert texts(dna, other) == ["the channels stand in another order"]
    other = copy.deepcopy(dna)
    other.joint_groups = dna.joint_groups[::-1]
    assert texts(dna, other) == ["the joint groups stand in another order"]


def test_rows_and_columns_of_a_group_are_known_by_name():
    dna = full()
    other = copy.deepcopy(dna)
    group = other.joint_groups[1]
    values = group.values[::-1, ::-1].copy()
    values[0, 0] += 0.5
    group.values, group.input_indices = values, group.input_indices[::-1]
    group.output_indices = group.output_indices[::-1]
    assert texts(dna, other) == [
        "joint group 1, inputs: the controls in another order",
        "joint group 1: the rows stand in another order",
        "joint group 1: 1 of 6 values changed by 5 mm (of lip)",
    ]


# ---- texts


def edited(**values):
    out = full()
    for name, value in values.items():
        setattr(out, name, value)
    return out


def test_joints_are_renamed_moved_and_given_other_parents():
    # A parent with another name counts as the same parent.
    assert texts(full(), edited(joint_names=["root", "chin", "lip"])) == [
        "joint jaw_joint renamed to chin"
    ]
    # The renamed joint is also moved in the list, but its parent and neutral pose identify it.
    swapped = reordered(edited(joint_names=["root", "chin", "lip"]), [0, 2, 1])
    assert texts(full(), swapped) == [
        "joint jaw_joint renamed to chin",
        "the joints stand in another order",
    ]
    moved = full().neutral_joint_translations.copy()
    moved[2] += [0.03, 0, 0.04]
    assert texts(full(), edited(neutral_joint_translations=moved)) == ["joint lip moved by 0.5 mm"]
    turned = np.float32([[0, 0, 0], [10, 0, 0], [0, 5.25, 0]])
    assert texts(full(), edited(neutral_joint_rotations=turned)) == [
        "joint lip turned by up to 0.25 degrees"
    ]
    assert texts(full(), edited(joint_parents=[0, 0, 0])) == [
        "joint lip has another parent: root instead of jaw_joint"
    ]


def test_lods_metadata_and_plain_fields():
    assert texts(full(), edited(lod_joint_mapping=[[0, 1, 2], [0, 2, 1]])) == [
        "LOD 1 lists 1 joint more: lip"
    ]
    assert texts(full(), edited(metadata={"a": "x", "c": "3"})) == [
        "metadata key a: '1' -> 'x'",
        "metadata key b only in A: '2'",
        "metadata key c only in B: '3'",
    ]
    assert texts(full(), edited(age=31)) == ["age: 30 -> 31"]


def mesh_edited(**values):
    out = full()
    for name, value in values.items():
        setattr(out.meshes[0], name, value)
    return out


def test_meshes_say_how_many_and_how_far():
    mesh = full().meshes[0]
    positions = mesh.positions.copy()
    positions[1:3] += np.float32([[0.3, 0, 0.4], [0, 0.01, 0]])
    assert texts(full(), mesh_edited(positions=positions)) == [
        "mesh head: 2 vertices of 4 moved by up to 5 mm"
    ]
    weights = mesh.skin_weights + np.float32([0, 0, 0, 0, 0.0625, -0.0625])
    assert texts(full(), mesh_edited(skin_weights=weights)) == [
        "mesh head: skin weights of 1 vertex changed by up to 0.0625"
    ]
    assert texts(full(), mesh_edited(skin_joint_indices=[1, 0, 0, 2, 1, 2])) == [
        "mesh head: skin weights of 1 vertex changed by up to 0.5",
        "mesh head: the joints of some vertices stand in another order",
    ]
    assert texts(full(), mesh_edited(face_layouts=[0, 1, 2, 0, 2, 3, 1])) == [
        "mesh head: 1 face of 2 with other corners"
    ]
    assert texts(full(), mesh_edited(face_offsets=[0, 4, 7])) == [
        "mesh head: 2 faces with another number of corners"
    ]


def test_deltas_are_known_by_their_vertex():
    other = full()
    target = other.meshes[0].blend_shape_targets[0]
    deltas = target.deltas.copy()
    deltas[1] += np.float32([0, 0.03, 0.04])
    deltas[0] += 1  # a different vertex: added, not changed
    target.deltas, target.vertex_indices = deltas, [2, 1, 3]
    assert texts(full(), other) == [
        "mesh head: 1 delta of channel open changed by 0.5 mm, 1 added, 1 removed"
    ]


def test_numbers_that_are_none_and_the_sign_of_zero():
    mesh = full().meshes[0]
    for value, said in (
        (np.nan, "to or from what is not a finite number"),
        (np.inf, "to or from what is not a finite number"),
        (-0.0, "only from 0 to -0 or back"),
    ):
        normals = mesh.normals.copy()
        normals[3, 0] = value
        other = mesh_edited(normals=normals)
        assert texts(full(), other) == [f"mesh head: 1 normal of 4 changed {said}"]
        assert texts(other, other) == []


def test_correctives_are_known_by_their_factors():
    other = full()
    other.psds.values = [1, 2, 1, 0.75]
    assert texts(full(), other) == [
        "corrective (jaw * q.x) * q.y: factor corrective jaw * q.x: 0.5 -> 0.75"
    ]
    other = full()
    other.psds.columns = [0, 4, 2, 5]
    assert texts(full(), other) == [
        "corrective (jaw * q.x) * q.y: factor q.y only in A",
        "corrective (jaw * q.x) * q.y: factor q.z only in B",
    ]


def test_units_and_axes_are_made_common():
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    other = dna.convert(translation_unit="m", axes=("right", "front", "up"))
    said = compare(dna, other)
    assert {d.layer for d in said} == {"descriptor", "file"}
    names = {d.field for d in said}
    assert {"translation_unit", "coordinate_system"} <= names
    positions = other.meshes[0].positions.copy()
    positions[0, 0] += 0.0125  # metres
    other.meshes[0].positions = positions
    left = [d.text for d in compare(dna, other) if d.layer == "geometry"]
    assert left == ["mesh head_lod0_mesh: 1 vertex of 12 moved by 12.5 mm"]


def test_versions_layers_and_their_order(tmp_path):
    found = compare(risorius.load(GOLDEN / "tiny_v21.dna"), risorius.load(GOLDEN / "tiny_v22.dna"))
    assert "version: 2.1 -> 2.2" in [d.text for d in found]
    found = compare(risorius.load(GOLDEN / "tiny_v23.dna"), risorius.load(GOLDEN / "tiny_v24.dna"))
    lines = [d.text for d in found if d.field == "layers"]
    assert lines == [f"layer {id_} only in B" for id_ in ("rbfb", "jbmd", "twsw")]
    facts = json.loads(full().to_json())
    facts["index"]["entries"].reverse()
    turned = risorius.Dna.from_json(json.dumps(facts))
    assert "the layers stand in another order in the file" in texts(full(), turned)


def test_lod_lists_that_are_shared_in_another_way(tmp_path):
    facts = json.loads(full().to_json())
    facts["defn1.1"]["lodJointMapping"] = {"lods": [0, 0], "indices": [[0, 1]]}
    shared = risorius.Dna.from_json(json.dumps(facts))
    alone = edited(lod_joint_mapping=[[0, 1], [0, 1]])
    assert texts(alone, shared) == ["the LODs' lists of joints are stored or shared in another way"]


def test_bytes_that_no_layer_reads_are_not_passed_over(tmp_path):
    data = (GOLDEN / "core.dna").read_bytes()
    (tmp_path / "more.dna").write_bytes(data + b"\0\1")
    done = diff(GOLDEN / "core.dna", tmp_path / "more.dna")
    assert done.returncode == 1
    assert f"other bytes from byte {len(data)} on" in done.stdout


def test_what_words_miss_is_said_all_the_same():
    """Faces that differ only in a duplicate metadata key, which no property shows, still differ."""
    facts = json.loads(full().to_json())
    facts["desc1.1"]["metadata"].insert(0, ["a", "hidden"])
    twice = risorius.Dna.from_json(json.dumps(facts))
    assert twice.metadata == full().metadata
    assert texts(full(), twice) == ["something differs that has no words here"]


# ---- the command itself


def test_lists_are_shortened_unless_all_is_asked_for(tmp_path):
    dna = risorius.load(GOLDEN / "medium.dna")
    a = saved(dna, tmp_path / "a.dna")
    dna.neutral_joint_translations = dna.neutral_joint_translations + np.float32(0.5)
    b = saved(dna, tmp_path / "b.dna")
    short, whole = diff(a, b).stdout.splitlines(), diff(a, b, "--all").stdout.splitlines()
    assert "  ... and 114 more (--all shows them)" in short
    assert sum(" moved by " in line for line in short) == 8
    assert sum(" moved by " in line for line in whole) == 122
    assert short[-1] == whole[-1] == "122 differences"
    assert short[0] == f"A: {a} (2.8, 4 LODs, 122 joints)"
    assert short[2] == "definition"


def test_programs_get_everything(tmp_path):
    a, b = saved(full(), tmp_path / "a.dna"), saved(edited(age=31), tmp_path / "b.dna")
    done = diff(a, b, "--json")
    facts = json.loads(done.stdout)
    assert (done.returncode, facts["same"]) == (1, False)
    assert facts["differences"] == [
        {"layer": "descriptor", "field": "age", "text": "age: 30 -> 31"}
    ]
    same = diff(a, a, "--json")
    assert (same.returncode, json.loads(same.stdout)["same"]) == (0, True)


def test_trouble_is_exit_code_2(tmp_path):
    good = GOLDEN / "core.dna"
    bad, other = tmp_path / "bad.dna", tmp_path / "bad.txt"
    bad.write_bytes(b"PNG")
    for arguments in ((good, bad), (bad, good), (good, tmp_path / "none.dna"), (good, other)):
        done = diff(*arguments)
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert diff(good).returncode == 2
    assert diff(good, good, good).returncode == 2
    done = subprocess.run(
        [sys.executable, "-m", "risorius", "info", "--all", good], capture_output=True, check=False
    )
    assert done.returncode == 2


def test_the_help_says_what_the_exit_codes_mean():
    done = subprocess.run(
        [sys.executable, "-m", "risorius", "info", "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "0 the same, 1 different, 2 trouble" in " ".join(done.stdout.split())


def test_random_bytes_that_can_still_be_read_are_never_the_same(tmp_path):
    """Each changed byte that changes the content is reported as a difference."""
    data = saved(full(), tmp_path / "a.dna").read_bytes()
    base = risorius.load(data)
    random = np.random.default_rng(7)
    said = 0
    for at in random.choice(len(data), 600, replace=False).tolist():
        patched = bytearray(data)
        patched[at] ^= 1 << int(random.integers(8))
        try:
            other = risorius.load(bytes(patched))
            again = other.to_bytes(version=f"2.{min(max(other.version, 1), 8)}")
        except risorius.DnaError:
            continue
        if again != data:
            assert compare(base, other), (at, struct.pack("B", patched[at]))
            said += 1
    assert said > 100
