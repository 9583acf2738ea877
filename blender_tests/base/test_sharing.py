# SPDX-License-Identifier: GPL-3.0-or-later
"""Equal faces share their file and images, and edits of one do not change another."""

import shutil
from pathlib import Path

import bpy
import numpy as np
import pytest
from support import scene
from support.faces import small_face

SIDE = 96
PICTURE = 30_000  # approximate size in bytes of a PNG of SIDE x SIDE random pixels
METADATA = 300_000  # bytes of random metadata, which are hard to compress


def _picture(path, seed):
    """Write a PNG with random pixels to `path`; the same `seed` gives the same pixels."""
    image = bpy.data.images.new("noise", SIDE, SIDE, alpha=False)
    noise = np.random.default_rng(seed).random((SIDE * SIDE, 4), np.float32)
    noise[:, 3] = 1.0
    image.pixels.foreach_set(noise.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)


@pytest.fixture
def textured(tmp_path):
    """A DNA file with metadata and images that are random, and so cannot be compressed."""
    face = small_face()
    noise = np.random.default_rng(3).integers(32, 127, METADATA, np.uint8)
    face.metadata = {
        "texture:head_lod0_mesh:color": "skin.png",
        "texture:head_lod0_mesh:map:flush": "flush.png",
        "noise": noise.tobytes().decode("ascii"),
    }
    path = tmp_path / "textured.dna"
    face.save(str(path))
    folder = tmp_path / "textured_textures"
    folder.mkdir()
    for seed, name in enumerate(("skin.png", "flush.png")):
        _picture(folder / name, seed)
        assert (folder / name).stat().st_size > PICTURE / 2
    return path


def _images(rig):
    """Label of an image texture node in the head's material -> the node's image."""
    nodes = scene.meshes(rig)[0].data.materials[0].node_tree.nodes
    return {n.label: n.image for n in nodes if n.type == "TEX_IMAGE"}


def _pixels(rig, label="Colour"):
    """The pixels of the image of the node with this label, RGBA in a row, float32[n]."""
    image = _images(rig)[label]
    flat = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(flat)
    return flat


def _save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
    return Path(path).stat().st_size


def _open(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return _rigs()


def _rigs():
    found = [o for o in bpy.data.objects if "risorius_controls" in o]
    return sorted(found, key=lambda o: (len(o.name), o.name))  # in the order of their creation


def _held_once(rigs):
    assert len({r["risorius_dna"].name for r in rigs}) == 1
    assert len([t for t in bpy.data.texts if "risorius_hash" in t]) == 1
    for label in ("Colour", "flush"):
        assert len({_images(r)[label].name for r in rigs}) == 1
    assert len([i for i in bpy.data.images if i.type == "IMAGE"]) == 2


def _exported(rig, folder):
    bpy.context.view_layer.objects.active = scene.controls(rig)
    path = folder / "exported.dna"
    bpy.ops.risorius.export_dna(filepath=str(path))
    return path.read_bytes()


def test_equal_faces_are_stored_once(textured, mode, tmp_path):
    first = scene.load(textured, mode)
    alone = _save(tmp_path / "one.blend")
    rigs = [first, *(scene.load(textured, mode) for _ in range(3))]
    _held_once(rigs)
    grown = _save(tmp_path / "four.blend") - alone
    rigs = _open(tmp_path / "four.blend")
    _held_once(rigs)
    for rig in rigs:
        assert _exported(rig, tmp_path) == textured.read_bytes()
    # Three further faces add less than three times the size of one face without its DNA file and
    # its image, because these are stored once.
    once = len(rigs[0]["risorius_dna"]["risorius_bytes"]) + PICTURE
    assert grown < 3 * (alone - once)
    scene.set_controls(rigs[1], jawOpen=0.8)
    for number, rig in enumerate(rigs):
        raw = np.zeros(len(scene.raw_of(rig, textured)), np.float32)
        raw[0] = 0.8 if number == 1 else 0.0
        assert scene.error_against_oracle(rig, textured, raw) < scene.TOLERANCE


def _paint(image, _folder):
    image.pixels[0:8] = (1.0, 0.0, 1.0, 1.0) * 2


def _paint_and_pack(image, _folder):
    _paint(image, _folder)
    image.pack()


def _shrink(image, _folder):
    image.scale(4, 4)


def _other_space(image, _folder):
    image.colorspace_settings.name = "Non-Color"


def _other_bytes(image, folder):
    """Pack another picture of random pixels into an image; its width and height are the same."""
    _picture(folder / "other.png", 99)
    content = (folder / "other.png").read_bytes()
    image.pack(data=content, data_len=len(content))
    image.buffers_free()


def _unpack(image, folder):
    _picture(folder / "outside.png", 98)
    image.unpack(method="REMOVE")
    image.filepath = str(folder / "outside.png")
    image.reload()


@pytest.mark.parametrize(
    ("edit", "noticed"),
    [
        (_paint, "at an update"),
        (_shrink, "at an update"),
        (_other_space, "at an update"),
        (_unpack, "at an update"),
        (_paint, "at the save"),
        (_paint_and_pack, "at the save"),
        (_other_bytes, "at the save"),
    ],
)
def test_an_edit_of_one_image_stays_with_the_active_face(edit, noticed, textured, tmp_path, capsys):
    rigs = [scene.load(textured) for _ in range(3)]
    before, label = _pixels(rigs[0]), "Colour"
    bpy.context.view_layer.objects.active = scene.controls(rigs[1])
    edit(_images(rigs[1])[label], tmp_path)
    edited = _pixels(rigs[1])
    assert len(edited) != len(before) or (edited != before).any() or edit is _other_space
    if noticed == "at an update":
        scene.update(scene.controls(rigs[2]))
    else:
        _save(tmp_path / "edited.blend")
    assert "keep it as it was" in capsys.readouterr().out
    np.testing.assert_array_equal(_pixels(rigs[1]), edited)
    assert _images(rigs[0])[label] == _images(rigs[2])[label] != _images(rigs[1])[label]
    own = _images(rigs[1])[label]
    if own.is_dirty:
        own.pack()
    _save(tmp_path / "edited.blend")
    rigs = _open(tmp_path / "edited.blend")
    np.testing.assert_allclose(_pixels(rigs[1]), edited, atol=1 / 255)
    for other in (rigs[0], rigs[2]):
        np.testing.assert_array_equal(_pixels(other), before)
        assert _images(other)[label].colorspace_settings.name == "sRGB"
        assert _images(other)[label].packed_file
    assert len({r.name for r in rigs if _images(r)["flush"] == _images(rigs[0])["flush"]}) == 3


@pytest.mark.parametrize("rubbish", [None, "", "words", "No Space\nNO_ALPHA\n1", 5, [1, 2]])
@pytest.mark.parametrize("key", ["risorius_state", "risorius_sha256"])
def test_a_note_that_somebody_changed_breaks_nothing(key, rubbish, textured, tmp_path, capsys):
    rigs = [scene.load(textured) for _ in range(2)]
    before = _pixels(rigs[0])
    image = _images(rigs[1])["Colour"]
    settings = image.colorspace_settings.name, image.alpha_mode
    bpy.context.view_layer.objects.active = scene.controls(rigs[1])
    del image[key]
    if rubbish is not None:
        image[key] = rubbish
    scene.update(scene.controls(rigs[0]))
    _save(tmp_path / "noted.blend")
    assert "Traceback" not in capsys.readouterr().err
    for rig in rigs:
        np.testing.assert_array_equal(_pixels(rig), before)
        shown = _images(rig)["Colour"]
        assert (shown.colorspace_settings.name, shown.alpha_mode) == settings


def test_a_face_alone_is_painted_without_a_word(textured, tmp_path, capsys):
    rig = scene.load(textured)
    image = _images(rig)["Colour"]
    _paint(image, tmp_path)
    scene.update(scene.controls(rig))
    assert _images(rig)["Colour"] == image
    assert image.is_dirty
    other = scene.load(textured)  # has the picture of the file, not the painted one
    assert _images(other)["Colour"] != image
    assert (_pixels(other) != _pixels(rig)).any()
    assert "as it was" not in capsys.readouterr().out


def test_a_duplicate_is_painted_by_itself(textured, tmp_path):
    rig = scene.load(textured)
    before = _pixels(rig)
    for item in bpy.context.scene.objects:
        item.select_set(True)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    copy = next(r for r in _rigs() if r != rig)
    bpy.context.view_layer.objects.active = scene.controls(copy)
    _paint(_images(copy)["Colour"], tmp_path)
    scene.update(scene.controls(rig))
    np.testing.assert_array_equal(_pixels(rig), before)
    assert (_pixels(copy) != before).any()


def test_another_file_for_one_leaves_the_others_theirs(textured, tmp_path):
    rigs = [scene.load(textured) for _ in range(2)]
    face = small_face()
    face.metadata = {"another": "file"}
    other = tmp_path / "other.dna"
    face.save(str(other))
    name = rigs[1]["risorius_dna"].name
    bpy.context.view_layer.objects.active = scene.controls(rigs[0])
    bpy.ops.risorius.replace_dna(filepath=str(other))
    assert rigs[1]["risorius_dna"].name == name
    bpy.context.view_layer.objects.active = scene.controls(rigs[1])
    bpy.ops.risorius.reload()  # reads the same file again
    assert _exported(rigs[0], tmp_path) == other.read_bytes()
    assert _exported(rigs[1], tmp_path) == textured.read_bytes()
    assert len([t for t in bpy.data.texts if "risorius_hash" in t]) == 2


def test_shapes_of_one_are_its_own(textured, tmp_path):
    rigs = [scene.load(textured, "KEYS") for _ in range(2)]
    still = scene.snapshot(rigs[1])
    head = scene.meshes(rigs[0])[0].data
    for block in head.shape_keys.key_blocks:
        block.points[5].co.x += 0.25
    head.vertices[5].co.x += 0.25
    scene.update(*rigs)
    np.testing.assert_array_equal(scene.snapshot(rigs[1]), still)
    assert _exported(rigs[0], tmp_path) != textured.read_bytes()
    assert _exported(rigs[1], tmp_path) == textured.read_bytes()


def test_one_that_is_removed_takes_nothing_from_the_others(textured, tmp_path):
    before = scene.counts()
    rigs = [scene.load(textured) for _ in range(3)]
    build = scene.submodule("scene.character.build")
    build.remove(rigs[0])
    _held_once(rigs[1:])
    for item in [o for o in bpy.data.objects if o.name.startswith(rigs[1].name[:9])]:
        for home in item.users_collection:  # as Blender's Delete does
            home.objects.unlink(item)
    _save(tmp_path / "left.blend")
    (rig,) = _open(tmp_path / "left.blend")
    assert _exported(rig, tmp_path) == textured.read_bytes()
    build.remove(rig)
    for text in [t for t in bpy.data.texts if "report" in t.name]:
        bpy.data.texts.remove(text)
    assert scene.counts() == {**before, "collections": 1}  # Delete leaves an empty collection


def test_undo_and_redo_of_sharing_and_editing(textured, tmp_path):
    bpy.ops.ed.undo_push(message="empty")
    scene.load(textured)
    bpy.ops.ed.undo_push(message="one")
    scene.load(textured)
    bpy.ops.ed.undo_push(message="two")
    before = _pixels(_rigs()[0])
    bpy.context.view_layer.objects.active = scene.controls(_rigs()[1])
    _other_space(_images(_rigs()[1])["Colour"], tmp_path)
    scene.update(scene.controls(_rigs()[0]))
    bpy.ops.ed.undo_push(message="edited")
    assert len(bpy.data.images) == 3
    for step, count in ((bpy.ops.ed.undo, 2), (bpy.ops.ed.undo, 1), (bpy.ops.ed.redo, 2)):
        step()
        bpy.context.view_layer.update()
        rigs = _rigs()
        assert len(rigs) == count
        np.testing.assert_array_equal(_pixels(rigs[0]), before)
        _held_once(rigs)
        scene.set_controls(rigs[0], jawOpen=0.0)
    bpy.ops.ed.redo()
    bpy.context.view_layer.update()
    first, second = _rigs()
    assert _images(first)["Colour"].colorspace_settings.name == "sRGB"
    assert _images(second)["Colour"].colorspace_settings.name == "Non-Color"
    np.testing.assert_array_equal(_pixels(first), before)
    _save(tmp_path / "redone.blend")
    for rig in _open(tmp_path / "redone.blend"):
        assert _exported(rig, tmp_path) == textured.read_bytes()


def _append(path, collection):
    bpy.ops.wm.save_as_mainfile(filepath=str(path.with_name("elsewhere.blend")))
    with bpy.data.libraries.load(str(path)) as (_, into):
        into.collections = [collection]
    bpy.context.scene.collection.children.link(into.collections[0])
    bpy.context.view_layer.update()


def test_appended_beside_an_equal_face(textured, tmp_path):
    scene.load(textured)
    _save(tmp_path / "library.blend")
    _append(tmp_path / "library.blend", "Small")
    assert len(_rigs()) == 2
    _save(tmp_path / "both.blend")
    rigs = _open(tmp_path / "both.blend")
    _held_once(rigs)
    for rig in rigs:
        assert _exported(rig, tmp_path) == textured.read_bytes()


def test_faces_of_an_older_version_share_after_a_save(textured, tmp_path):
    """Equal faces of an older version of the add-on share their file and images after a save.

    In such a .blend file, each face has its own text data-block and its own images, and the images
    have no hashes.
    """
    first, second = scene.load(textured), scene.load(textured)
    second["risorius_dna"] = first["risorius_dna"].copy()
    for node in scene.meshes(second)[0].data.materials[0].node_tree.nodes:
        if node.type == "TEX_IMAGE":
            node.image = node.image.copy()
    for image in bpy.data.images:
        for name in ("risorius_sha256", "risorius_state"):
            image.pop(name, None)
    assert len(bpy.data.images) == 4
    own = bpy.data.images.new("the user's own", 4, 4)
    own.use_fake_user = True
    _save(tmp_path / "older.blend")
    bpy.data.images.remove(own)
    _held_once([first, second])
    rigs = _open(tmp_path / "older.blend")
    bpy.data.images.remove(bpy.data.images["the user's own"])
    _held_once(rigs)


def test_what_only_says_to_be_equal_is_not_shared(textured, tmp_path):
    """A file or image whose properties state wrong contents is not shared.

    The add-on computes the hash of the contents, and does not trust a stored hash.
    """
    first = scene.load(textured)
    text = first["risorius_dna"]
    text["risorius_bytes"] = text["risorius_bytes"][:-9]
    image = _images(first)["Colour"]
    _picture(tmp_path / "other.png", 77)
    content = (tmp_path / "other.png").read_bytes()
    image.pack(data=content, data_len=len(content))
    image["risorius_state"] = f"sRGB\n{image.alpha_mode}\n{len(content)}"
    shutil.rmtree(tmp_path / "other.png", ignore_errors=True)
    second = scene.load(textured)
    assert second["risorius_dna"] != text
    assert _images(second)["Colour"] != image
    assert _exported(second, tmp_path) == textured.read_bytes()


def test_a_face_has_one_live_key_where_nothing_else_is_chosen(dna_file):
    """By default each mesh has one live shape key for the sum of all channels.

    One key per channel would take 19 MB for a mesh of 17,465 vertices with 92 channels.
    """
    rig = scene.load(dna_file)
    scene.set_controls(rig, jawOpen=0.5)
    keys = [[b.name for b in m.data.shape_keys.key_blocks] for m in scene.meshes(rig).values()]
    assert keys == [["Basis", "<channel sum>"]] * 2
