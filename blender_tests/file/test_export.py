# SPDX-License-Identifier: GPL-3.0-or-later
"""An unedited face is exported byte for byte; edits are exported as the scene shows them."""

import os
from pathlib import Path

import bpy
import numpy as np
import pytest
import risorius
from support import oracle, scene
from support.faces import EYE, JAW, small_face

GOLDEN = Path(__file__).resolve().parents[2] / "tests" / "data" / "golden"
VERSIONS = [f"2.{minor}" for minor in range(1, 9)]
CONVENTIONS = [
    {},
    {"axes": ("right", "front", "up")},
    {"axes": ("left", "up", "front"), "rotation_signs": (1, -1, 1)},
    {"axes": ("front", "left", "up"), "rotation_sequence": "zyx"},
    {"axes": ("right", "up", "back"), "rotation_sequence": "yzx", "rotation_unit": "radians"},
    {"translation_unit": "m"},
]


def _export(folder, **options):
    path = folder / "out.dna"
    assert bpy.ops.risorius.export_dna(filepath=str(path), **options) == {"FINISHED"}
    assert sorted(p.name for p in folder.iterdir() if p.name.startswith(".")) == []
    return path


def _report(name="Small"):
    return bpy.data.texts[f"{name} export report"].as_string()


def _move(rig, mesh, vertex, by):
    """Move a neutral vertex by `by` as edit mode does: the vertex moves in every shape key."""
    for block in scene.meshes(rig)[mesh].data.shape_keys.key_blocks:
        co = np.array(block.points[vertex].co) + by
        block.points[vertex].co = co


def test_untouched_files_of_every_version(mode, tmp_path):
    for version in VERSIONS:
        dna = small_face(name=f"V{version[-1]}")
        content = dna.to_bytes(version=version, unknown_layers="ignore")
        source = tmp_path / f"v{version}.dna"
        source.write_bytes(content)
        rig = scene.load(source, mode)
        scene.set_controls(rig, jawOpen=0.6)
        assert _export(tmp_path).read_bytes() == content
        assert "byte for byte" in _report(rig.name.removesuffix("_rig"))


def test_untouched_golden_files(tmp_path):
    """The DNA files of tests/data/golden are exported byte for byte if they are not edited.

    Files that the import refuses are skipped: files without a face, and files of a generation that
    the package cannot read.
    """
    seen = 0
    for source in sorted(GOLDEN.glob("*.dna")):
        try:
            rig = scene.load(source, "KEYS")
        except RuntimeError as error:
            assert "there is no face" in str(error) or "generation" in str(error), source.name
            continue
        seen += 1
        bpy.context.view_layer.objects.active = rig
        assert _export(tmp_path).read_bytes() == source.read_bytes(), source.name
        scene.submodule("scene.character.build").remove(rig)
    assert seen >= 3


@pytest.mark.parametrize("conventions", CONVENTIONS)
def test_edits_come_back_in_every_convention(tmp_path, conventions):
    source = tmp_path / "small.dna"
    small_face(**conventions).save(str(source))
    unit = 0.01 if conventions == {} else 1.0
    bpy.context.scene.unit_settings.scale_length = unit
    rig = scene.load(source, "KEYS")
    keys = scene.meshes(rig)[0].data.shape_keys.key_blocks
    size = max(scene.meshes(rig)[0].dimensions)
    step = size / 50
    _move(rig, 0, 40, (0.0, step, 0.0))
    keys["jaw"].points[5].co.x += step
    keys["pull_l"].points[6].co.z -= 2 * step
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.4)
    shown = scene.snapshot(rig)
    out = _export(tmp_path)
    again = scene.load(out, "KEYS")
    scene.controls(again).location.x = 0.0  # it was placed beside the other face
    scene.set_controls(again, jawOpen=0.7, mouthCornerPullL=0.4)
    np.testing.assert_allclose(scene.snapshot(again), shown, atol=size * 1e-6)
    raw = scene.raw_of(again, out)
    assert scene.error_against_oracle(again, out, raw, unit_scale=unit) < scene.TOLERANCE
    _only_these_changed(source, out, step * unit)


def _only_these_changed(source, out, step):
    """Check that an exported DNA file differs from its source by three edits only.

    The edits moved one neutral position, and one vertex in each of two shapes, by multiples of
    `step`.
    """
    old, new = risorius.load(str(source)), risorius.load(str(out))
    one, two = old.meshes[0], new.meshes[0]
    moved = oracle.to_blender(new, (two.positions.astype(float) - one.positions))
    assert list(np.flatnonzero((two.positions != one.positions).any(axis=1))) == [40]
    np.testing.assert_allclose(moved[40], (0.0, step, 0.0), atol=step * 1e-3)
    assert np.count_nonzero(two.positions[40] != one.positions[40]) == 1
    for name, vertex, by in (("jaw", 5, (step, 0, 0)), ("pull_l", 6, (0, 0, -2 * step))):
        delta = []
        for mesh in (one, two):
            target = next(t for t in mesh.blend_shape_targets if _name(old, t) == name)
            dense = np.zeros((len(mesh.positions), 3))
            np.add.at(dense, target.vertex_indices, target.deltas.reshape(-1, 3))
            delta.append(dense)
        changed = np.flatnonzero((delta[0] != delta[1]).any(axis=1))
        assert list(changed) == [vertex]
        by_now = oracle.to_blender(new, delta[1] - delta[0])[vertex]
        np.testing.assert_allclose(by_now, by, atol=step * 1e-3)
    # With the source's positions and shapes, the exported file equals the source.
    two.positions = one.positions
    two.blend_shape_targets = one.blend_shape_targets
    assert new.to_bytes(version=f"2.{old.version}") == old.to_bytes(version=f"2.{old.version}")


def _name(dna, target):
    return dna.blend_shape_channel_names[target.blend_shape_channel_index]


@pytest.mark.parametrize("version", VERSIONS)
def test_the_version_stays(tmp_path, version):
    source = tmp_path / "small.dna"
    source.write_bytes(small_face().to_bytes(version=version, unknown_layers="ignore"))
    rig = scene.load(source, "KEYS")
    scene.meshes(rig)[0].data.shape_keys.key_blocks["jaw"].points[5].co.x += 0.01
    out = _export(tmp_path)
    assert risorius.load(str(out)).version == int(version[-1])
    assert out.read_bytes() != source.read_bytes()


def test_an_edited_key_is_written_from_live_mode_too(dna_file, tmp_path):
    rig = scene.load(dna_file, "KEYS")
    keys = scene.meshes(rig)[0].data.shape_keys.key_blocks
    keys["jaw"].name = "renamed"
    keys["renamed"].points[5].co.x += 0.01
    from_keys = _export(tmp_path).read_bytes()
    bpy.ops.risorius.set_shape_mode(mode="LIVE")
    assert _export(tmp_path).read_bytes() == from_keys
    assert from_keys != dna_file.read_bytes()


def test_the_report_says_how_much(dna_file, tmp_path):
    rig = scene.load(dna_file, "KEYS")
    head = scene.meshes(rig)[0]
    keys = head.data.shape_keys.key_blocks
    keys["jaw"].points[5].co.x += 0.01
    keys["jaw"].points[7].co.x += 0.02
    _move(rig, 0, 40, (0.0, 0.004, 0.0))
    head.shape_key_add(name="own", from_mix=False)
    _export(tmp_path)
    report = _report()
    assert (
        "head_lod0_mesh, shape jaw: 2 vertices, at most 20.000 mm, 15.000 mm in the mean." in report
    )
    assert "head_lod0_mesh, neutral: 1 vertices, at most 4.000 mm, 4.000 mm in the mean." in report
    assert "head_lod0_mesh: keys of your own are not written: own." in report


def test_what_is_not_asked_for_is_not_written(dna_file, tmp_path):
    rig = scene.load(dna_file, "KEYS")
    keys = scene.meshes(rig)[0].data.shape_keys.key_blocks
    keys["jaw"].points[5].co.x += 0.01
    _move(rig, 0, 40, (0.0, 0.004, 0.0))
    scene.meshes(rig)[0].vertex_groups["head"].add([3], 0.9, "REPLACE")
    out = _export(tmp_path, use_shapes=False, use_neutral=False, use_weights=False)
    assert out.read_bytes() == dna_file.read_bytes()


def test_a_basis_edit_by_edit_mode_is_no_edit_of_keys(dna_file, tmp_path):
    """An edit of the basis in edit mode is exported as an edit of neutral positions only.

    Edit mode also moves the vertices of all shape keys, and rounds them.
    """
    import bmesh

    rig = scene.load(dna_file, "KEYS")
    head = scene.meshes(rig)[0]
    bpy.context.view_layer.objects.active = head
    head.active_shape_key_index = 0
    bpy.ops.object.mode_set(mode="EDIT")
    edit = bmesh.from_edit_mesh(head.data)
    for vertex in edit.verts:
        vertex.co.x += 0.00123
    bmesh.update_edit_mesh(head.data)
    bpy.ops.object.mode_set(mode="OBJECT")
    new = risorius.load(str(_export(tmp_path)))
    old = risorius.load(str(dna_file))
    new.meshes[0].positions = old.meshes[0].positions
    assert new.to_bytes() == old.to_bytes()
    assert "neutral: 168 vertices" in _report()


def test_edited_joints(tmp_path):
    for number, conventions in enumerate(CONVENTIONS):
        bpy.ops.wm.read_homefile(use_empty=True)
        source = tmp_path / f"{number}.dna"
        small_face(**conventions).save(str(source))
        rig = scene.load(source)
        armatures = scene.submodule("scene.character.armatures")
        bone = rig.data.bones[EYE]
        size = 100.0 if "translation_unit" in conventions else 1.0
        with armatures.edit_armature(bpy.context, rig.data) as bones:
            eye, jaw = bones[bone.name], bones["FACIAL_C_Jaw"]
            eye.head.x += 0.01 * size
            eye.tail.x += 0.01 * size
            jaw.tail.z += jaw.length * 0.5
        wanted = {b.name: np.array(b.matrix_local) for b in rig.data.bones}
        out = _export(tmp_path)
        old, new = risorius.load(str(source)), risorius.load(str(out))
        moved = (old.neutral_joint_translations != new.neutral_joint_translations).any(axis=1)
        turned = (old.neutral_joint_rotations != new.neutral_joint_rotations).any(axis=1)
        assert (list(np.flatnonzero(moved)), list(np.flatnonzero(turned))) == ([EYE], [JAW])
        distance = np.linalg.norm(
            new.neutral_joint_translations[EYE] - old.neutral_joint_translations[EYE]
        )
        metres = 1.0 if "translation_unit" in conventions else 0.01
        assert distance * metres == pytest.approx(0.01 * size, rel=1e-4)
        again = scene.load(out)
        for name, matrix in wanted.items():
            got = np.array(again.data.bones[name].matrix_local)
            # The axes of a bone are inexact, because Blender stores the two ends of a bone as
            # float32. Here the ends are 4 cm apart at a height of 1.7 m.
            np.testing.assert_allclose(got[:3, :3], matrix[:3, :3], atol=3e-5)
            np.testing.assert_allclose(got[:3, 3], matrix[:3, 3], atol=1e-6 * size)
        said = next(x for x in _report().splitlines() if x.startswith("Joint FACIAL_L_Eye: "))
        assert float(said.split()[2]) == pytest.approx(10 * size, rel=1e-5)


def test_painted_weights(dna_file, tmp_path):
    rig = scene.load(dna_file)
    head = scene.meshes(rig)[0]
    head.vertex_groups["FACIAL_C_Jaw"].add([6], 0.9, "REPLACE")
    head.vertex_groups["head"].remove([6])
    out = _export(tmp_path)
    old, new = risorius.load(str(dna_file)), risorius.load(str(out))
    one, two = old.meshes[0], new.meshes[0]
    begin, end = two.skin_offsets[6], two.skin_offsets[7]
    assert end - begin == 4
    joints = list(two.skin_joint_indices[begin:end])
    assert 2 not in joints
    weights = two.skin_weights[begin:end]
    assert weights.sum() == pytest.approx(1.0, abs=1e-6)
    assert weights[0] == weights.max()
    assert joints[0] == JAW
    np.testing.assert_array_equal(two.skin_weights[:begin], one.skin_weights[:begin])
    np.testing.assert_array_equal(two.skin_weights[end:], one.skin_weights[one.skin_offsets[7] :])
    again = scene.load(out)
    scene.controls(again).location.x = 0.0  # it was placed beside the other face
    for of in (rig, again):
        scene.set_controls(of, jawOpen=1.0)
    np.testing.assert_allclose(scene.snapshot(again), scene.snapshot(rig), atol=1e-6)
    assert "head_lod0_mesh: weights of 1 vertices." in _report()


def test_a_vertex_that_no_target_had_joins_it(dna_file, tmp_path):
    rig = scene.load(dna_file, "KEYS")
    old = risorius.load(str(dna_file))
    target = old.meshes[0].blend_shape_targets[0]
    missing = next(v for v in range(168) if v not in set(target.vertex_indices.tolist()))
    block = scene.meshes(rig)[0].data.shape_keys.key_blocks["jaw"]
    block.points[missing].co.z += 0.01
    new = risorius.load(str(_export(tmp_path))).meshes[0].blend_shape_targets[0]
    assert len(new.vertex_indices) == len(target.vertex_indices) + 1
    assert np.all(np.diff(new.vertex_indices.astype(int)) > 0)


def test_other_topology_is_one_sentence(dna_file, tmp_path):
    rig = scene.load(dna_file)
    head = scene.meshes(rig)[0]
    bpy.context.view_layer.objects.active = head
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    out = tmp_path / "out.dna"
    out.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="Small_head_lod0_mesh has other vertices or faces"):
        bpy.ops.risorius.export_dna(filepath=str(out))
    assert out.read_bytes() == b"old"


def test_edit_mode_is_refused(dna_file, tmp_path):
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.meshes(rig)[0]
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="is in edit mode: leave that first"):
        bpy.ops.risorius.export_dna(filepath=str(tmp_path / "out.dna"))
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_folder_that_cannot_be_written(dna_file, tmp_path):
    scene.load(dna_file)
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.risorius.export_dna(filepath=str(tmp_path / "missing" / "out.dna"))
    assert str(caught.value) == "Error: out.dna: its folder is not there.\n"
    folder = tmp_path / "folder.dna"
    folder.mkdir()
    with pytest.raises(RuntimeError, match=r"^Error: folder.dna: Is a directory\.$"):
        bpy.ops.risorius.export_dna(filepath=str(folder))
    assert sorted(tmp_path.rglob("*")) == sorted([dna_file, folder])


@pytest.mark.skipif(os.name == "nt", reason="links, rights and limits are those of POSIX")
def test_an_export_follows_links_keeps_rights_and_is_whole_or_not_there(dna_file, tmp_path):
    import resource
    import signal

    scene.load(dna_file)
    folder = tmp_path / "out"
    folder.mkdir()
    path, link = folder / "out.dna", folder / "link.dna"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to("out.dna")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # Blender 4.3 does not ignore it
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))  # simulates a full disk
    try:
        with pytest.raises(RuntimeError, match=r"^Error: link.dna: File too large\.$"):
            bpy.ops.risorius.export_dna(filepath=str(link))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert path.read_text() == "old"
    bpy.ops.risorius.export_dna(filepath=str(link))
    assert link.is_symlink()
    assert path.read_bytes() == dna_file.read_bytes()
    assert path.stat().st_mode & 0o777 == 0o640
    assert sorted(p.name for p in folder.iterdir()) == ["link.dna", "out.dna"]


def test_exporting_changes_nothing_in_the_scene(mode, dna_file, tmp_path):
    rig = scene.load(dna_file, mode)
    bpy.ops.object.mode_set(mode="POSE")
    scene.set_controls(rig, jawOpen=0.5)
    _export(tmp_path)
    counts, shown = scene.counts(), scene.snapshot(rig)
    scene.meshes(rig)[0].data.shape_keys.key_blocks[0].points[3].co.x += 0.0
    _export(tmp_path)
    assert scene.counts() == counts
    np.testing.assert_array_equal(scene.snapshot(rig), shown)
    assert bpy.context.mode == "POSE"
    assert bpy.context.view_layer.objects.active == scene.controls(rig)
