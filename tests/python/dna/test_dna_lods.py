# SPDX-License-Identifier: MIT
"""Tests LOD filters: the result is a complete file with meshes and motion of the original.

The reference in comments is OpenRigLogic, which computed the values of tests/data/golden.
"""

import numpy as np
import pytest
import risorius
from conftest import GOLDEN

RIGS = ["core", "tiny_v21", "tiny_v28", "medium", "ml", "mlquat", "rbf", "twistswing", "units"]


def mapping(rows):
    return {"lods": list(range(len(rows))), "indices": rows}


def many_lods(count):
    """A face with one joint, channel, map and mesh for each LOD, and one raw control.

    LOD l lists the joints from l on, channel l, map l and mesh l.
    """
    import json

    dna = risorius.Dna()
    dna.lod_count = count
    dna.raw_control_names = ["raw"]
    dna.gui_control_names = ["gui"]
    dna.joint_names = [f"joint{i}" for i in range(count)]
    dna.joint_parents = [0] * count
    dna.neutral_joint_translations = np.arange(3 * count).reshape(count, 3)
    dna.neutral_joint_rotations = np.zeros((count, 3))
    dna.blend_shape_channel_names = [f"channel{i}" for i in range(count)]
    dna.animated_map_names = [f"map{i}" for i in range(count)]
    dna.mesh_names = [f"mesh{i}" for i in range(count)]
    dna.mesh_blend_shape_channel_mapping = [[i, i] for i in range(count)]
    dna.joint_row_count, dna.joint_column_count = 9 * count, 1
    # Rows that the coarsest LOD uses come first, because each LOD uses the first rows of a group.
    order = list(range(count))[::-1]
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[count - lod for lod in range(count)],
            input_indices=[0],
            output_indices=[9 * joint for joint in order],
            values=[[joint + 1] for joint in order],
            joint_indices=list(range(count)),
        )
    ]
    dna.meshes = [
        risorius.Mesh(
            positions=[[i, 0, 0]] * 3,
            texture_coordinates=np.zeros((3, 2)),
            normals=np.ones((3, 3)),
            layout_positions=[0, 1, 2],
            layout_texture_coordinates=[0, 1, 2],
            layout_normals=[0, 1, 2],
            face_offsets=[0, 3],
            face_layouts=[0, 1, 2],
            skin_offsets=[0, 1, 2, 3],
            skin_weights=[1, 1, 1],
            skin_joint_indices=[i] * 3,
            blend_shape_targets=[
                risorius.BlendShapeTarget(
                    deltas=[[i, 0, 0]], vertex_indices=[0], blend_shape_channel_index=i
                )
            ],
        )
        for i in range(count)
    ]
    facts = json.loads(dna.to_json())
    d = facts["defn1.1"]
    d["lodJointMapping"] = mapping([list(range(lod, count)) for lod in range(count)])
    for name in ("lodBlendShapeMapping", "lodAnimatedMapMapping", "lodMeshMapping"):
        d[name] = mapping([[lod] for lod in range(count)])
    return risorius.Dna.from_json(json.dumps(facts))


def selections(count):
    yield from ([lod] for lod in range(min(count, 4)))
    yield [count - 1]
    yield (0, count // 2)
    yield (count // 2, count - 1)
    yield list(range(0, count, 2))


@pytest.mark.parametrize("name", RIGS)
def test_filtering_while_reading_is_filtering_what_was_read(name):
    path = GOLDEN / f"{name}.dna"
    whole = risorius.load(path)
    for lods in selections(whole.lod_count):
        read = risorius.load(path, lods=lods)
        assert read.to_json() == whole.filter_lods(lods).to_json(), lods
        assert read.to_bytes() == whole.filter_lods(lods).to_bytes(), lods
        read.validate()


@pytest.mark.parametrize("name", ["core", "tiny_v21", "tiny_v28", "medium", "units"])
def test_what_is_left_moves_as_before(name):
    whole = risorius.load(GOLDEN / f"{name}.dna")
    rig = risorius.Rig(whole)
    raw = np.random.default_rng(3).random((5, len(rig.raw_control_names)), np.float32)
    for lods in selections(whole.lod_count):
        part = whole.filter_lods(lods)
        some = risorius.Rig(part)
        kept = lods if isinstance(lods, list) else range(lods[0], lods[1] + 1)
        for new, old in enumerate(lod for lod in kept if lod < whole.lod_count):
            for row in raw:
                left, before = some.evaluate(row, lod=new), rig.evaluate(row, lod=old)
                for names, all_names, values, all_values in (
                    (part.joint_names, whole.joint_names, left.joints, before.joints),
                    (
                        part.blend_shape_channel_names,
                        whole.blend_shape_channel_names,
                        left.blend_shapes,
                        before.blend_shapes,
                    ),
                    (
                        part.animated_map_names,
                        whole.animated_map_names,
                        left.animated_maps,
                        before.animated_maps,
                    ),
                ):
                    index = [all_names.index(n) for n in names]
                    np.testing.assert_allclose(values, all_values[index], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("count", [1, 9, 33])
def test_any_number_of_lods(count):
    dna = many_lods(count)
    data = dna.to_bytes()
    assert risorius.load(data).lod_count == count
    last = count - 1
    part = risorius.load(data, lods=[last])
    assert (part.lod_count, part.max_lod) == (1, last)
    # Joint 0 stays, because it is the parent of the last joint.
    assert part.joint_names == [f"joint{i}" for i in sorted({0, last})]
    assert part.joint_parents.tolist() == [0] * len(part.joint_names)
    assert part.blend_shape_channel_names == [f"channel{last}"]
    assert part.mesh_names == [f"mesh{last}"]
    assert part.mesh_blend_shape_channel_mapping.tolist() == [[0, 0]]
    (mesh,) = part.meshes
    assert mesh.positions[0, 0] == last
    assert mesh.skin_joint_indices.tolist() == [len(part.joint_names) - 1] * 3
    assert mesh.blend_shape_targets[0].blend_shape_channel_index == 0
    (group,) = part.joint_groups
    assert group.lods.tolist() == [1]
    assert group.output_indices.tolist() == [9 * (len(part.joint_names) - 1)]
    assert group.values.tolist() == [[last + 1]]
    rig = risorius.Rig(dna)
    assert rig.lod_count == count
    moved = np.flatnonzero(rig.evaluate(np.ones(1), lod=count // 2).joints[:, 0])
    assert moved.tolist() == list(range(count // 2, count))


def test_more_lods_than_the_format_has_are_refused():
    with pytest.raises(risorius.DnaError, match="34.*33") as caught:
        risorius.Dna(lod_count=34).to_bytes()
    assert caught.value.where == "descriptor.lod_count"


@pytest.mark.parametrize("lods", [[7], (5, 9), [65535]])
def test_a_selection_that_is_not_in_the_file_is_refused(lods):
    with pytest.raises(risorius.DnaError, match="has 2") as caught:
        risorius.load(GOLDEN / "core.dna", lods=lods)
    assert caught.value.code == "invalid_argument"
    assert caught.value.where == "lods"


@pytest.mark.parametrize("lods", [[], (3, 1), "0", [-1], [70000], 3])
def test_a_selection_that_makes_no_sense_is_refused(lods):
    with pytest.raises((ValueError, TypeError)):
        risorius.load(GOLDEN / "core.dna", lods=lods)


def test_lods_past_the_last_are_passed_over_and_repeats_count_once():
    """The filter ignores LODs past the last one and repeated LODs.

    The reference's filter also ignores LODs past the last one, but counts a repeated LOD several
    times.
    """
    whole = risorius.load(GOLDEN / "core.dna")
    assert whole.filter_lods((1, 65535)).to_bytes() == whole.filter_lods([1, 1]).to_bytes()
    assert whole.filter_lods([1, 0]).to_bytes() == whole.to_bytes()


# ---- facts about the reference's fixture (see the fixtures' README)


def test_extra_the_references_fixture_by_lod_1():
    from conftest import SHARED, require_extra

    path = require_extra(SHARED / "data" / "fixtures" / "raw_v28.dna", "the reference's fixtures")
    dna = risorius.load(path, lods=[1])
    assert (dna.lod_count, dna.max_lod) == (1, 1)
    assert dna.joint_names == ["JA", "JB", "JC", "JD", "JG", "JI"]
    assert dna.joint_parents.tolist() == [0, 0, 0, 1, 2, 2]
    assert dna.neutral_joint_translations[:, 0].tolist() == [1, 2, 3, 4, 7, 9]
    assert dna.blend_shape_channel_names == ["BC", "BF", "BH", "BI"]
    assert dna.animated_map_names == ["AC", "AF", "AH", "AI"]
    assert dna.mesh_names == ["MC"]
    assert dna.mesh_blend_shape_channel_mapping.tolist() == [[0, 2], [0, 3]]
    assert [g.lods.tolist() for g in dna.joint_groups] == [[3], [2], [2], [0]]
    assert [g.output_indices.tolist() for g in dna.joint_groups] == [
        [2, 3, 5],
        [18, 20],
        [37, 38],
        [],
    ]
    assert [g.joint_indices.tolist() for g in dna.joint_groups] == [[0], [2], [4], []]
    np.testing.assert_array_equal(
        dna.joint_groups[1].values.ravel(), np.float32(np.arange(1, 11) / 100)
    )
    maps = dna.animated_maps
    # Six entries drive the maps AA AB AB AC AD AD, of which only AC remains, with the new index 0.
    # The reference keeps the old indices, although they mean other maps after the filter.
    assert maps.lods.tolist() == [1]
    assert maps.conditionals.output_indices.tolist() == [0]
    (mesh,) = dna.meshes
    assert mesh.skin_joint_indices.tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_allclose(mesh.skin_weights, [0.1, 0.3, 0.6, 1, 1], rtol=1e-6)
    (target,) = mesh.blend_shape_targets
    assert len(target.vertex_indices) == 3
    assert target.blend_shape_channel_index == 0  # BC; the reference keeps the old index 2
    ml = dna.machine_learned_behavior
    assert [n.input_indices.tolist() for n in ml.neural_networks] == [[8, 0], [4, 7]]
    assert [n.output_indices.tolist() for n in ml.neural_networks] == [[13], [14]]
    assert ml.region_names == [["RE", "RF"]]
    assert [[i.tolist() for i in r] for r in ml.region_network_indices] == [[[0], [1]]]
    assert [s.name for s in dna.rbf_behavior.solvers] == ["RSB", "RSC"]
    flags = dna.joint_behavior_metadata.joint_representations[:, 1]
    assert flags.tolist() == [0, 0, 1, 1, 0, 0]
    twists = dna.twist_swing_behavior.twists
    assert [t.output_joint_indices.tolist() for t in twists] == [[0, 1], [4]]
    assert [t.blend_weights.tolist() for t in twists] == [[1, 2], [-1]]
    assert [len(s) for t in dna.machine_learned_behavior_ext.types for s in t.operations] == [
        0,
        0,
        0,
    ]
