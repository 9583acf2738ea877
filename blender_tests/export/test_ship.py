# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported animation is imported again as the same vertices; the scene stays unchanged."""

import contextlib
import csv
import json
import os
import struct

import bpy
import numpy as np
import pytest
import risorius
from mathutils import Vector
from mathutils.kdtree import KDTree
from support import scene
from support.animation import animate

FRAMES = (1, 3, 5, 8, 10)
ENDINGS = {"GLTF": "glb", "FBX": "fbx", "USD": "usdc", "ALEMBIC": "abc"}
# Format -> allowed error of the imported vertices, as a share of the head's size.
NEAR = {
    "ALEMBIC": 5e-6,  # stores vertices: float32 at 1.6 m rounds by 6e-7 of the head's width
    "GLTF": 2e-5,  # float32 joints per frame, weights normalised again, axes rotated
    "FBX": 2e-5,  # the same, with rotations as Euler angles in degrees
    # The format stores scales of joints as half floats. Each of two joints in a chain then adds
    # an error of up to 2**-11.
    "USD": 1e-3,
}


def _film(items, frames=FRAMES):
    film = []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        film.append([scene.evaluated(i) for i in items])
    return film


def _is_built(kind):
    """Whether this Blender has an exporter for the format.

    If not, check that the operator reports this.
    """
    switch = {"USD": "usd", "ALEMBIC": "alembic"}.get(kind)
    if switch is None or getattr(bpy.app.build_options, switch):
        return True
    with pytest.raises(RuntimeError, match="This Blender has no .* exporter"):
        bpy.ops.risorius.export_animation(filepath="no file", format=kind)
    return False


def _export(kind, tmp_path, **options):
    path = tmp_path / f"out.{ENDINGS.get(kind, kind.lower())}"
    settings = {"range": "CUSTOM", "start": 1, "end": 10, "format": kind}
    settings |= {"bake_materials": False, **options}  # see test_ship_looks
    done = bpy.ops.risorius.export_animation(filepath=str(path), **settings)
    assert done == {"FINISHED"}
    return path


def _import(kind, path):
    """Import a file of the format. Returns the imported mesh objects."""
    before = set(bpy.data.objects)
    if kind == "GLTF":
        bpy.ops.import_scene.gltf(filepath=str(path), disable_bone_shape=True)
    elif kind == "FBX":
        bpy.ops.import_scene.fbx(filepath=str(path), anim_offset=0.0, ignore_leaf_bones=False)
    elif kind == "USD":
        bpy.ops.wm.usd_import(filepath=str(path))
    else:
        bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
    return [o for o in bpy.data.objects if o not in before and o.type == "MESH"]


def _partner(points, wanted):
    """For each expected vertex, the index of the nearest imported vertex, int[V].

    Some formats change the order of vertices.
    """
    tree = KDTree(len(points))
    for i, point in enumerate(points):
        tree.insert(Vector(point), i)
    tree.balance()
    return np.array([tree.find(Vector(p))[1] for p in wanted])


def _error(film, wanted):
    """The largest coordinate difference of vertices in all frames, as a share of the head's size.

    Each expected vertex is compared with the imported vertex that is nearest at the first frame.

    Args:
        film: for each frame, the imported vertices of each mesh.
        wanted: for each frame, the expected vertices of each mesh.
    """
    size = max(np.ptp(p, axis=0).max() for p in wanted[0])
    points = [np.concatenate(meshes) for meshes in film]
    target = [np.concatenate(meshes) for meshes in wanted]
    rows = _partner(points[0], target[0])
    return max(np.abs(p[rows] - t).max() / size for p, t in zip(points, target, strict=True))


@pytest.mark.parametrize("kind", ENDINGS)
def test_the_file_gives_the_same_vertices(kind, dna_file, tmp_path):
    rig = scene.load(dna_file)
    if not _is_built(kind):
        return
    animate(rig)
    shown = [m for m in scene.meshes(rig).values() if 0 in list(m["dna_lods"])]
    wanted = _film(shown)
    assert max(np.abs(a - b).max() for a, b in zip(wanted[0], wanted[2], strict=True)) > 0.01
    counts = scene.counts()
    path = _export(kind, tmp_path)
    assert scene.counts() == counts
    found = _import(kind, path)
    assert len(found) == len(shown)
    assert _error(_film(found), wanted) < NEAR[kind]


def _everywhere(rig):
    """The state of the .blend file, which an export must not change."""
    layer = bpy.context.view_layer
    return (
        scene.counts(),
        bpy.context.scene.name,
        bpy.context.scene.frame_current,
        [o.name for o in layer.objects if o.select_get()],
        layer.objects.active.name,
        sorted(o.name for o in bpy.data.objects),
        sorted(rig.keys()),
        dict(scene.face(rig).items()),
        [(m.hide_viewport, m.data.name) for m in scene.meshes(rig).values()],
        rig.animation_data.action,
        list(rig["maps"]),
        scene.snapshot(rig).tobytes(),
    )


def _json_of(path):
    """The content of the JSON chunk of a .glb file."""
    content = path.read_bytes()
    length, _kind = struct.unpack_from("<II", content, 12)
    return json.loads(content[20 : 20 + length])


@pytest.mark.parametrize("kind", ["GLTF", "FBX", "USD", "ALEMBIC", "CSV"])
def test_the_scene_stays_untouched_also_after_an_error(kind, dna_file, tmp_path):
    rig = scene.load(dna_file, "KEYS" if kind == "FBX" else "LIVE")
    if not _is_built(kind):
        return
    animate(rig)
    bpy.context.scene.frame_set(4)
    before = _everywhere(rig)
    _export(kind, tmp_path)
    assert _everywhere(rig) == before
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(RuntimeError, match=r"^Error: [^\n]+\n?$"):
        _export(kind, tmp_path / "file")
    assert _everywhere(rig) == before
    scene.set_controls(rig, browDownL=0.5)
    raw = scene.raw_of(rig, dna_file)
    rig_head = scene.controls(rig).pose.bones["head"]
    rig_head.rotation_euler = (0, 0, 0)
    scene.controls(rig).animation_data_clear()
    scene.update(scene.controls(rig))
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


@pytest.mark.parametrize("kind", ["FBX", "USD"])
def test_bones_alone(kind, dna_file, tmp_path):
    rig = scene.load(dna_file)
    if not _is_built(kind):
        return
    animate(rig)
    path = _export(kind, tmp_path, wanted={"BONES"})
    scene.pose_bones(rig)  # the joints deform the skin, even without shapes
    shown = [scene.meshes(rig)[0], scene.meshes(rig)[1]]
    for item in shown:
        for block in item.data.shape_keys.key_blocks[1:]:
            block.mute = True
    wanted = _film(shown)
    found = _import(kind, path)
    assert all(len(o.data.shape_keys.key_blocks) < 2 for o in found if o.data.shape_keys)
    assert _error(_film(found), wanted) < NEAR[kind]


@pytest.mark.parametrize(
    ("kind", "options"),
    [("GLTF", {}), ("FBX", {}), ("FBX", {"fbx_units": "FBX_SCALE_ALL"}), ("USD", {})],
)
def test_a_face_that_walks_and_a_part_of_the_range(kind, options, dna_file, tmp_path):
    rig = scene.load(dna_file)
    if not _is_built(kind):
        return
    controls = animate(rig)
    for frame, x in ((1, 0.0), (10, 0.4)):
        controls.location.x = x
        controls.rotation_euler.z = 3 * x
        controls.keyframe_insert("location", frame=frame)
        controls.keyframe_insert("rotation_euler", frame=frame)
    frames = (3, 5, 8)
    wanted = _film([scene.meshes(rig)[0], scene.meshes(rig)[1]], frames)
    path = _export(kind, tmp_path, start=3, end=8, **options)
    assert _error(_film(_import(kind, path), frames), wanted) < NEAR[kind]


def _fbx_tree(path):
    """Object -> parent object, and object -> kind of its node attribute, read from an FBX file.

    Objects are given by name. A kind of attribute is, for example, "Mesh" or "LodGroup".
    """
    from io_scene_fbx import parse_fbx

    root, _version = parse_fbx.parse(str(path))
    parts = {part.id: part.elems for part in root.elems}
    called, attributes, above, kinds = {}, {}, {}, {}
    for item in parts[b"Objects"]:
        if item.id == b"Model":
            called[item.props[0]] = item.props[1].split(b"\0")[0].decode()
        elif item.id == b"NodeAttribute":
            attributes[item.props[0]] = item.props[2].decode()
    for _kind, child, parent, *_ in (link.props for link in parts[b"Connections"]):
        if child in called and parent in called:
            above[called[child]] = called[parent]
        elif child in attributes and parent in called:
            kinds[called[parent]] = attributes[child]
    return above, kinds


def test_an_fbx_holds_coarser_levels_in_groups(dna_file, tmp_path):
    rig = scene.load(dna_file, lods=(True, True, *[False] * 6))
    animate(rig)
    path = _export("FBX", tmp_path, lod_groups=True, lod=0)
    assert b"LodGroup" in path.read_bytes()
    shown = [m for m in scene.meshes(rig).values() if 0 in list(m["dna_lods"])]
    every = [m for m in scene.meshes(rig).values() if {0, 1} & set(m["dna_lods"])]
    assert len(every) > len(shown)
    wanted = _film(shown)
    found = _import("FBX", path)
    assert len(found) == len(every)
    above, kinds = _fbx_tree(path)
    for name in risorius.load(dna_file).mesh_names[: len(every)]:
        assert above[name] == f"{name.split('_lod')[0]}_LODGroup"
        assert kinds[above[name]] == "LodGroup"
    fine = [item for item in found if "_lod0" in item.name]
    assert _error(_film(fine), wanted) < NEAR["FBX"]
    assert b"LodGroup" not in _export("FBX", tmp_path).read_bytes()


def test_options_of_gltf_reach_the_file(dna_file, tmp_path):
    rig = scene.load(dna_file, lods=(True, True, *[False] * 6))
    animate(rig)

    def parts(**options):
        found = _json_of(_export("GLTF", tmp_path, **options))
        first = found["meshes"][0]
        attributes = first["primitives"][0]["attributes"]
        keys = first.get("extras", {}).get("targetNames", [])
        paths = {c["target"]["path"] for a in found.get("animations", ()) for c in a["channels"]}
        return found, attributes, keys, paths

    counts = scene.counts()
    found, attributes, keys, paths = parts()
    assert [a["name"] for a in found["animations"]] == ["Small"]
    assert {n["name"] for n in found["nodes"]} >= {"Small", "head_lod0_mesh", "FACIAL_C_Jaw"}
    assert "JOINTS_1" in attributes  # five joints per vertex
    assert keys == ["jaw", "pull_l", "y" * 63]  # also a corrective's shape; the others are at rest
    assert paths == {"translation", "rotation", "scale", "weights"}
    assert "JOINTS_1" not in parts(influences=4)[1]
    assert len(parts(all_shapes=True)[2]) == 6
    assert parts(wanted={"BONES"})[3] == {"translation", "rotation", "scale"}
    assert parts(wanted={"SHAPES"})[3] == {"weights"}
    assert {m["name"] for m in parts(lod=1)[0]["meshes"]} == {"head_lod1_mesh"}
    assert scene.counts() == counts


def test_all_selected_faces_go_into_one_file(dna_file, tmp_path):
    rigs = [scene.load(dna_file), scene.load(dna_file)]
    for rig in rigs:
        animate(rig)
        scene.controls(rig).select_set(True)
    scene.controls(rigs[1]).location.x = 1.0
    wanted = _film([scene.meshes(rig)[0] for rig in rigs])
    path = _export("GLTF", tmp_path)
    names = {n["name"] for n in _json_of(path)["nodes"]}
    assert {"Small", "Small.001"} <= names
    with pytest.raises(RuntimeError, match="the controls of one face: select one"):
        _export("CSV", tmp_path)
    found = [o for o in _import("GLTF", path) if "head" in o.name]
    assert _error(_film(found), wanted) < NEAR["GLTF"]


def test_controls_as_csv_and_clip(dna_file, tmp_path):
    rig = scene.load(dna_file)
    animate(rig)
    path = _export("CSV", tmp_path, start=2, end=4, step=0.5)
    header, *rows = list(csv.reader(path.open(encoding="utf-8")))
    table = np.array(rows, np.float64)
    assert header[:2] == ["time", "CTRL_expressions.jawOpen"]
    assert header[-3:] == ["head.yaw", "head.pitch", "head.roll"]
    assert len(set(header)) == len(header) == 1 + 11 + 3
    rate = bpy.context.scene.render.fps
    # Time 0 s of the file is the scene's first frame, as for a sound that starts there.
    first = bpy.context.scene.frame_start
    np.testing.assert_allclose(table[:, 0], (np.arange(2, 4.1, 0.5) - first) / rate)
    for row, frame in zip(table, np.arange(2, 4.1, 0.5), strict=True):
        bpy.context.scene.frame_set(int(frame), subframe=frame % 1)
        raw = scene.raw_of(rig, dna_file)
        assert np.float32(row[1]) == raw[0]
        assert np.float32(row[header.index("CTRL_expressions.eyeLookUpL")]) == raw[6]
        # The head bone is upright: its x axis is the armature's x axis, its y axis the armature's z
        # axis. So the rotation is converted to the armature's axes.
        turn = scene.controls(rig).pose.bones["head"].rotation_euler.to_quaternion()
        rest = scene.controls(rig).data.bones["head"].matrix_local.to_quaternion()
        ahead = (rest @ turn @ rest.inverted()) @ Vector((0, -1, 0))
        assert row[-3] == pytest.approx(np.arctan2(ahead.x, -ahead.y), abs=1e-5)
        assert row[-2] == pytest.approx(np.arcsin(ahead.z), abs=1e-5)


@pytest.mark.parametrize("first", [1, 0, 5])
def test_a_clip_comes_back_to_the_frames_that_it_left(dna_file, tmp_path, first):
    bpy.context.scene.frame_start = first
    rig = scene.load(dna_file)
    animate(rig)
    scene.controls(rig).select_set(True)
    path = _export("RZC", tmp_path)
    other = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.controls(other)
    done = bpy.ops.risorius.import_animation(filepath=str(path), start=float(first))
    assert done == {"FINISHED"}
    for frame in (1, 4, 9):
        bpy.context.scene.frame_set(frame)
        wanted, found = scene.raw_of(rig, dna_file), scene.raw_of(other, dna_file)
        np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_a_clip_file_holds_the_same_and_maps_where_wanted(dna_file, tmp_path):
    rig = scene.load(dna_file)
    animate(rig)
    clip = risorius.Clip.load(_export("RZC", tmp_path, maps=True))
    assert (clip.rate, clip.frame_count) == (bpy.context.scene.render.fps, 10)
    assert clip.names[-5:] == ("head.yaw", "head.pitch", "head.roll", "flush", "wrinkle")
    for frame in (1, 4, 10):
        bpy.context.scene.frame_set(frame)
        shown = clip.sample([(frame - 1) / clip.rate])[0]  # the scene begins at frame 1
        assert shown[0] == scene.raw_of(rig, dna_file)[0]
        assert shown[-2:] == pytest.approx(list(rig["maps"]), abs=1e-7)
    assert np.ptp(clip.curve("flush")) > 0.5


@pytest.mark.parametrize("shapes", ["DRIVEN", "LOCAL"])
def test_a_linked_face_bakes_its_controls_and_is_exported(shapes, dna_file, tmp_path):
    scene.load(dna_file, "LIVE")
    blend = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.link(directory=f"{blend}/Collection/", filename="Small")
    bpy.context.view_layer.objects.active = bpy.context.scene.objects[0]
    assert bpy.ops.risorius.make_override(shapes=shapes) == {"FINISHED"}
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o and not o.library)
    animate(rig)
    shown = [scene.meshes(rig)[0], scene.meshes(rig)[1]]
    wanted, counts = _film(shown), scene.counts()
    with pytest.raises(RuntimeError, match="is linked: bake its controls"):
        bpy.ops.risorius.bake(range="CUSTOM", end=10)
    path = _export("GLTF", tmp_path)
    assert scene.counts() == counts
    before = [p.tobytes() for p in wanted[-1]]
    assert [p.tobytes() for p in _film(shown)[-1]] == before
    assert bpy.ops.risorius.bake(kind="CONTROLS", range="CUSTOM", end=10) == {"FINISHED"}
    again = _film(shown)
    for points, target in zip(again, wanted, strict=True):
        for one, other in zip(points, target, strict=True):
            np.testing.assert_allclose(one, other, atol=2e-6)
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    assert [p.tobytes() for p in _film(shown)[-1]] == before
    assert _error(_film(_import("GLTF", path)), wanted) < NEAR["GLTF"]


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
@pytest.mark.parametrize("kind", ENDINGS)
def test_without_room_the_old_file_stays(kind, dna_file, tmp_path, monkeypatch):
    rig = scene.load(dna_file)
    if not _is_built(kind):
        return
    animate(rig)
    path = tmp_path / "out" / f"a.{ENDINGS[kind]}"
    path.parent.mkdir()
    path.write_text("old")
    settings = {"range": "CUSTOM", "start": 1, "end": 3, "format": kind, "bake_materials": False}
    said = rf"^Error: {path.name}: .*\.$"
    with _no_room(kind, monkeypatch), pytest.raises(RuntimeError, match=said) as error:
        bpy.ops.risorius.export_animation(filepath=str(path), **settings)
    assert "risorius-" not in str(error.value)
    assert os.listdir(path.parent) == [path.name]
    assert path.read_text() == "old"
    link = path.with_name(f"link.{ENDINGS[kind]}")
    link.symlink_to(path.name)
    assert bpy.ops.risorius.export_animation(filepath=str(link), **settings) == {"FINISHED"}
    assert link.is_symlink()
    content = path.read_bytes()
    assert len(content) > 4000
    assert b"risorius-" not in content
    assert sorted(os.listdir(path.parent)) == [path.name, link.name]


@contextlib.contextmanager
def _no_room(kind, monkeypatch):
    """Limit every file to 4000 bytes, which simulates a full disk.

    The Alembic exporter would end the process, so for Alembic the export function is replaced by
    one that writes a few bytes and raises an error.
    """
    import resource
    import signal

    if kind == "ALEMBIC":  # Blender's own Alembic exporter would end this process

        def export(_operator, _override, path):
            path.write_bytes(b"half")
            raise scene.submodule("logic.base.errors").FaceError("no room")

        with monkeypatch.context() as planted:
            planted.setattr(scene.submodule("ui.export.operators"), "export", export)
            yield
        return

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # Blender 4.3 does not ignore it
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)


def test_a_missing_exporter_is_one_sentence(dna_file, tmp_path):
    import addon_utils

    scene.load(dna_file)
    addon_utils.disable("io_scene_fbx")
    try:
        with pytest.raises(RuntimeError, match=r"This Blender has no FBX exporter: enable its add"):
            _export("FBX", tmp_path)
    finally:
        addon_utils.enable("io_scene_fbx")


def test_without_a_name_nothing_is_written(dna_file, tmp_path, monkeypatch):
    animate(scene.load(dna_file))
    monkeypatch.chdir(tmp_path)
    before = set(tmp_path.iterdir())
    with pytest.raises(RuntimeError, match="no name"):
        bpy.ops.risorius.export_animation(filepath="", format="GLTF")
    assert set(tmp_path.iterdir()) == before


def test_actions_that_the_face_does_not_play_stay_out(dna_file, tmp_path):
    rig = scene.load(dna_file)
    controls = animate(rig)
    wanted = _film([scene.meshes(rig)[0], scene.meshes(rig)[1]])
    played = controls.animation_data.action
    other = controls.animation_data.action = bpy.data.actions.new("A take of yesterday")
    other.use_fake_user = True
    bone = controls.pose.bones["head"]
    for frame, x in ((1, 0.0), (10, 0.3)):
        bone.location.x = x
        bone.keyframe_insert("location", frame=frame)
    slots = getattr(played, "slots", ())
    controls.animation_data.action = played
    if len(slots):
        controls.animation_data.action_slot = slots[0]
    bone.location.x = 0.0
    found = _import("GLTF", _export("GLTF", tmp_path))
    assert _error(_film(found), wanted) < NEAR["GLTF"]


def test_a_baked_face_is_not_exported(dna_file, tmp_path):
    scene.load(dna_file)
    assert bpy.ops.risorius.bake(range="CUSTOM", start=1, end=2) == {"FINISHED"}
    with pytest.raises(RuntimeError, match="is baked: choose Back to Live first"):
        bpy.ops.risorius.export_animation(filepath=str(tmp_path / "face.glb"), format="GLTF")
    assert not list(tmp_path.glob("*.glb"))


def test_blenders_own_gltf_says_that_live_faces_rest(dna_file, tmp_path, capsys):
    if bpy.context.preferences.addons.get(scene.MODULE) is None:  # read by the exporter
        bpy.context.preferences.addons.new().module = scene.MODULE
    path = str(tmp_path / "a.glb")
    rig = scene.load(dna_file)
    animate(rig)

    def said(**options):
        capsys.readouterr()
        assert bpy.ops.export_scene.gltf(filepath=path, **options) == {"FINISHED"}
        return capsys.readouterr()

    warned = "".join(said())
    assert f"{rig.name.removesuffix('_rig')}: Blender's own export knows no live faces" in warned
    bpy.ops.object.select_all(action="DESELECT")
    assert "no live faces" not in "".join(said(use_selection=True))
    capsys.readouterr()
    _export("GLTF", tmp_path)
    assert "no live faces" not in "".join(capsys.readouterr())
    rig["risorius_baked"] = True
    assert "no live faces" not in "".join(said())
