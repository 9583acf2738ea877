# SPDX-License-Identifier: MIT
"""Tests DNA files: reading, checking and writing."""

import copy
import json
import pickle
import struct

import command_line
import numpy as np
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra

VERSIONS = [f"tiny_v2{minor}" for minor in range(1, 9)]
FIXTURES = SHARED / "data" / "fixtures"
MALFORMED = SHARED / "data" / "golden" / "malformed"


def small():
    """A face of 2 joints, 2 raw controls, a corrective and a mesh, made by the public classes."""
    dna = risorius.Dna(name="small", lod_count=1, gender="female", age=30)
    dna.coordinate_system = ("right", "up", "front")
    dna.metadata = {"licence": "CC0-1.0"}
    dna.gui_control_names, dna.raw_control_names = ["g"], ["a", "b"]
    dna.joint_names, dna.joint_parents = ["root", "leaf"], [0, 0]
    dna.neutral_joint_translations = [[0, 0, 0], [1, 2, 3]]
    dna.neutral_joint_rotations = np.zeros((2, 3))
    dna.blend_shape_channel_names, dna.mesh_names = ["s"], ["m"]
    dna.lod_joint_mapping, dna.lod_mesh_mapping = [[0, 1]], [[0]]
    dna.gui_to_raw = risorius.Conditionals(
        input_indices=[0],
        output_indices=[1],
        from_values=[0.0],
        to_values=[1.0],
        slope_values=[1.0],
        cut_values=[0.0],
    )
    dna.psd_count = 1
    dna.psds = risorius.Psds(rows=[2, 2], columns=[0, 1], values=[1.0, 1.0])
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[1],
            input_indices=[0, 1],
            output_indices=[9],
            values=[[2.0, 3.0]],
            joint_indices=[1],
        )
    ]
    dna.meshes = [
        risorius.Mesh(
            positions=[[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            normals=[[0, 0, 1]],
            texture_coordinates=[[0, 0]],
            layout_positions=[0, 1, 2],
            layout_texture_coordinates=[0, 0, 0],
            layout_normals=[0, 0, 0],
            face_offsets=[0, 3],
            face_layouts=[0, 1, 2],
            skin_offsets=[0, 1, 2, 4],
            skin_weights=[1.0, 1.0, 0.5, 0.5],
            skin_joint_indices=[0, 1, 0, 1],
            blend_shape_targets=[risorius.BlendShapeTarget(deltas=[[0, 0, 1]], vertex_indices=[2])],
        )
    ]
    return dna


@pytest.mark.parametrize("name", VERSIONS)
def test_rewriting_for_its_own_version_gives_the_same_bytes(name):
    data = (GOLDEN / f"{name}.dna").read_bytes()
    assert risorius.load(data).to_bytes(version=f"2.{name[-1]}") == data


@pytest.mark.parametrize("version", [f"2.{minor}" for minor in range(1, 9)])
def test_every_version_holds_the_classic_layers(version):
    dna = small()
    again = risorius.load(dna.to_bytes(version=version))
    assert again.version == int(version[-1])
    assert again.metadata == dna.metadata
    assert again.gender == "female"
    np.testing.assert_array_equal(again.neutral_joint_translations, dna.neutral_joint_translations)
    np.testing.assert_array_equal(again.joint_groups[0].values, [[2, 3]])
    np.testing.assert_array_equal(again.meshes[0].skin_offsets, [0, 1, 2, 4])
    np.testing.assert_array_equal(again.meshes[0].blend_shape_targets[0].deltas, [[0, 0, 1]])


def test_an_old_file_written_new_gets_the_missing_layers_empty():
    dna = risorius.load((GOLDEN / "tiny_v21.dna").read_bytes())
    again = risorius.load(dna.to_bytes(version="2.8"))
    assert again.layers == "desc defn bhvr geom mlbh rbfb rbfe jbmd twsw mlbe dsce".split()
    assert len(again.to_bytes()) == len(dna.to_bytes())
    assert again.machine_learned_behavior.neural_networks == ()
    assert again.rbf_behavior.solvers == ()
    assert again.twist_swing_behavior.twists == ()


def test_writing_2_1_warns_of_what_it_cannot_hold():
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    with pytest.warns(UserWarning, match="rbfb"):
        dna.to_bytes(version="2.1")


def test_only_the_layers_asked_for_are_there():
    path = GOLDEN / "medium.dna"
    dna = risorius.load(path, layers="behavior")
    assert len(dna.joint_groups) > 0
    assert dna.meshes == ()
    dna = risorius.load(path, layers="geometry_without_blend_shapes")
    assert len(dna.meshes) > 0
    assert all(not mesh.blend_shape_targets for mesh in dna.meshes)
    assert dna.joint_groups == ()
    assert risorius.load(path, layers="descriptor").raw_control_names == []
    with pytest.raises(ValueError, match="layers"):
        risorius.load(path, layers="legs")


def test_arrays_are_read_only_and_outlive_their_dna():
    dna = small()
    positions = dna.meshes[0].positions
    with pytest.raises(ValueError, match="read-only"):
        positions[0, 0] = 5
    mesh = dna.meshes[0]
    dna.meshes = []
    del dna
    mesh.positions = positions + 1
    assert positions[1].tolist() == [1, 0, 0]
    assert mesh.positions[1].tolist() == [2, 1, 1]


def test_an_element_changed_in_place_changes_the_dna_and_copies_do_not_share():
    dna = small()
    other = copy.deepcopy(dna)
    dna.meshes[0].positions = [[9, 9, 9]] * 3
    assert dna.meshes[0].positions[0, 0] == 9
    assert other.meshes[0].positions[0, 0] == 0
    assert pickle.loads(pickle.dumps(dna)).to_bytes() == dna.to_bytes()


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda d: setattr(d, "joint_parents", [0, 2]), "joint_parents"),
        (lambda d: setattr(d, "joint_parents", [1, 0]), "joint_parents"),
        (lambda d: setattr(d, "joint_parents", [0]), "joint_parents"),
        (lambda d: setattr(d.joint_groups[0], "output_indices", [18]), "output_indices"),
        (lambda d: setattr(d.joint_groups[0], "lods", [2]), "lods"),
        (lambda d: setattr(d.joint_groups[0], "values", [1.0]), "values"),
        (lambda d: setattr(d.meshes[0], "face_layouts", [0, 1, 3]), "face_layouts"),
        (lambda d: setattr(d.meshes[0], "skin_joint_indices", [0, 1, 0, 7]), "skin_joint_indices"),
        (lambda d: setattr(d.meshes[0].blend_shape_targets[0], "vertex_indices", [3]), "vertex"),
        (lambda d: setattr(d.psds, "rows", [3, 3]), "psds.rows"),
    ],
)
def test_what_does_not_fit_together_is_an_error_with_its_field(change, field):
    dna = small()
    change(dna)
    for use in (dna.validate, dna.to_bytes):
        with pytest.raises(risorius.DnaError) as caught:
            use()
        assert field in caught.value.where


def test_wrong_shapes_and_ranges_name_the_field():
    mesh = risorius.Mesh()
    with pytest.raises(ValueError, match=r"positions.*\(n, 3\).*\(2, 2\)"):
        mesh.positions = [[0, 0], [1, 1]]
    with pytest.raises(ValueError, match="skin_joint_indices.*70000"):
        mesh.skin_joint_indices = [70000]
    with pytest.raises(ValueError, match="gender"):
        risorius.Dna(gender="robot")


def test_every_prefix_is_an_error_with_an_offset():
    for minor in (1, 8):
        data = small().to_bytes(version=f"2.{minor}")
        whole = len(data) - (3 if minor == 1 else 0)  # a missing end mark gives only a warning
        for length in range(whole):
            with pytest.raises(risorius.DnaError) as caught:
                risorius.load(data[:length])
            assert caught.value.code in ("not_dna", "truncated", "invalid_count")
            assert caught.value.offset is not None


def test_every_patched_byte_is_read_or_refused():
    """No changed byte causes a crash; every file that is accepted can be written and evaluated."""
    data = small().to_bytes()
    refused = 0
    for at in range(len(data)):
        for value in (0x00, 0xFF, data[at] ^ 1):
            patched = data[:at] + bytes([value]) + data[at + 1 :]
            try:
                dna = risorius.load(patched)
                rig = risorius.Rig(dna)
                rig.evaluate(np.ones(len(rig.raw_control_names)))
                dna.to_bytes()
            except risorius.DnaError as error:
                assert error.code
                refused += 1
    assert refused > len(data) // 4


@pytest.mark.parametrize(
    ("data", "code", "words"),
    [
        (b"", "not_dna", "empty"),
        (b"PNG", "not_dna", "not a DNA file"),
        (b"DNA\0\3\0\1", "unsupported_generation", "generation 3"),
        (b"DNA\0\2\0\10", "truncated", "left"),
        (b"DNA\0\2\0\10\xff\xff\xff\xff", "invalid_count", "4294967295"),
    ],
)
def test_bad_input_says_what_is_wrong(data, code, words, tmp_path):
    for source in (data, tmp_path / "bad.dna"):
        if source is not data:
            source.write_bytes(data)
        with pytest.raises(risorius.DnaError, match=words) as caught:
            risorius.load(source)
        assert caught.value.code == code
        assert source is data or "bad.dna" in str(caught.value)


def test_a_huge_count_allocates_nothing():
    data = bytearray(small().to_bytes())
    name = data.index(b"small") - 4
    data[name : name + 4] = struct.pack(">I", 0x7FFFFFFF)
    with pytest.raises(risorius.DnaError) as caught:
        risorius.load(bytes(data))
    assert caught.value.code == "invalid_count"
    assert caught.value.where == "descriptor.name"
    assert caught.value.offset == name


def test_a_folder_or_missing_file_is_one_sentence(tmp_path):
    for path in (tmp_path, tmp_path / "none.dna"):
        with pytest.raises(risorius.DnaError) as caught:
            risorius.load(path)
        assert caught.value.code == "io_open"
        assert path.name in str(caught.value)
    with pytest.raises(risorius.DnaError):
        small().save(tmp_path / "no" / "folder.dna")


def run(*arguments):
    return command_line.run(*arguments, text=True)


def test_info_prints_for_people_and_programs(tmp_path):
    page = run("info", GOLDEN / "medium.dna")
    assert page.returncode == 0
    assert "levels of detail" in page.stdout
    facts = json.loads(run("info", "--json", GOLDEN / "medium.dna").stdout)
    dna = risorius.load(GOLDEN / "medium.dna")
    assert facts["counts"]["raw_controls"] == len(dna.raw_control_names)
    assert [m["vertices"] for m in facts["meshes"]] == [len(m.positions) for m in dna.meshes]
    assert [m["faces"] for m in facts["meshes"]] == [
        np.diff(m.face_offsets).size for m in dna.meshes
    ]
    cut = tmp_path / "cut.dna"
    cut.write_bytes(dna.to_bytes(version="2.1", unknown_layers="ignore")[:-1])  # end mark cut
    facts = json.loads(run("info", "--json", cut).stdout)
    assert facts["warnings"] == risorius.load(cut).warnings != []
    bad = tmp_path / "bad.dna"
    bad.write_bytes(b"not one")
    done = run("info", bad)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.count("\n") == 1
    assert "not a DNA file" in done.stderr
    assert run("info").returncode == 2


# ---- the reference's fixtures, if they are present

FIELDS = {  # field of raw_v28.decoded.json -> attribute of Dna
    "desc1.1": {"name": "name", "age": "age", "lodCount": "lod_count", "dbName": "db_name"},
    "defn1.1": {
        "guiControlNames": "gui_control_names",
        "rawControlNames": "raw_control_names",
        "jointNames": "joint_names",
        "blendShapeChannelNames": "blend_shape_channel_names",
        "animatedMapNames": "animated_map_names",
        "meshNames": "mesh_names",
        "jointHierarchy": "joint_parents",
    },
}


def decoded_table(table):
    names = "inputIndices outputIndices fromValues toValues slopeValues cutValues".split()
    return [table[name] for name in names]


def our_table(table):
    names = "input_indices output_indices from_values to_values slope_values cut_values".split()
    return [getattr(table, name).tolist() for name in names]


def xyz(values):
    return np.array([values["xs"], values["ys"], values["zs"]], np.float32).T


@pytest.mark.parametrize("minor", range(1, 9))
def test_extra_fixtures_decode_to_what_an_independent_parser_read(minor):
    path = require_extra(FIXTURES / f"raw_v2{minor}.dna", "the reference's fixtures")
    facts = json.loads((FIXTURES / f"raw_v2{minor}.decoded.json").read_text())
    facts = {
        key.split("1.")[0] if key[-4:] in ("1.1", "1.0") else key: v for key, v in facts.items()
    }
    find = {key[:4]: value for key, value in facts.items()}
    dna = risorius.load(path)
    desc, defn = find["desc"], find.get("defn", find.get("defi"))
    for theirs, ours in FIELDS["desc1.1"].items():
        assert getattr(dna, ours) == desc[theirs]
    assert dna.metadata == dict(map(tuple, desc["metadata"]))
    for theirs, ours in FIELDS["defn1.1"].items():
        assert list(getattr(dna, ours)) == defn[theirs]
    for kind in ("Joint", "BlendShape", "AnimatedMap", "Mesh"):
        theirs = defn[f"lod{kind}Mapping"]
        snake = {"BlendShape": "blend_shape", "AnimatedMap": "animated_map"}.get(kind, kind.lower())
        ours = getattr(dna, f"lod_{snake}_mapping")
        assert ours.lods.tolist() == theirs["lods"]
        assert [row.tolist() for row in ours.rows] == theirs["indices"]
    np.testing.assert_array_equal(
        dna.neutral_joint_translations, xyz(defn["neutralJointTranslations"])
    )
    behavior = find.get("bhvr", find.get("beha"))
    controls = behavior["controls"]
    assert dna.psd_count == controls["psdCount"]
    np.testing.assert_array_equal(
        np.float32(our_table(dna.gui_to_raw)), np.float32(decoded_table(controls["conditionals"]))
    )
    for group, theirs in zip(dna.joint_groups, behavior["joints"]["jointGroups"], strict=True):
        np.testing.assert_array_equal(group.values.ravel(), np.float32(theirs["values"]))
        assert group.output_indices.tolist() == theirs["outputIndices"]
        assert group.lods.tolist() == theirs["lods"]
    for mesh, theirs in zip(dna.meshes, find["geom"]["meshes"], strict=True):
        np.testing.assert_array_equal(mesh.positions, xyz(theirs["positions"]))
        weights = [w for skin in theirs["skinWeights"] for w in skin["weights"]]
        np.testing.assert_array_equal(mesh.skin_weights, np.float32(weights))
        for ours, target in zip(mesh.blend_shape_targets, theirs["blendShapeTargets"], strict=True):
            np.testing.assert_array_equal(ours.deltas, xyz(target["deltas"]))
            assert ours.blend_shape_channel_index == target["blendShapeChannelIndex"]
    assert dna.rotation_sequence == ("yzx" if minor >= 7 else "xyz")
    assert dna.face_winding_order == ("cw" if minor >= 8 else "ccw")


def test_extra_fixtures_are_rewritten_byte_for_byte():
    require_extra(FIXTURES / "raw_v28.dna", "the reference's fixtures")
    files = [p for p in sorted(FIXTURES.glob("*.dna")) if "V2x" not in p.name]
    assert len(files) >= 17
    for path in files:
        dna = risorius.load(path)
        assert dna.to_bytes(version=f"2.{dna.version}") == path.read_bytes(), path.name
    newer = risorius.load(FIXTURES / "RawV2xNewer.dna")
    expected = FIXTURES / "RawV2xNewerWithUnknownDataPreservedAndDNARewritten.dna"
    assert newer.to_bytes()[7:] == expected.read_bytes()[7:]


def test_extra_malformed_files_are_refused_or_safe_to_use():
    require_extra(MALFORMED / "manifest.json", "malformed golden files")
    files = json.loads((MALFORMED / "manifest.json").read_text())["files"]
    refused = 0
    for entry in files:
        path = MALFORMED / entry["file"]
        try:
            dna = risorius.load(path)
            rig = risorius.Rig(dna)
            for lod in range(rig.lod_count):
                rig.evaluate(np.ones(len(rig.raw_control_names)), lod=lod)
            rig.gui_to_raw(np.ones(len(rig.gui_control_names)))
            for index in range(len(dna.meshes)):
                risorius.Morph(dna, index)
            dna.to_bytes()
        except risorius.DnaError as error:
            assert error.code
            assert str(error)
            refused += 1
        else:
            assert entry["class"] != "signature"
            assert entry["class"] != "truncated" or dna.warnings  # only the end mark is missing
    assert refused >= 200
