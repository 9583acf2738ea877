# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that bad files and a missing wheel give an error sentence, and leave no data behind."""

import builtins
import io
from collections import Counter
from types import SimpleNamespace

import addon_utils
import bpy
import numpy as np
import pytest
import risorius
from support import scene
from support.faces import small_face


def _bad_files(tmp_path):
    whole = small_face().to_bytes()
    newer = bytearray(whole)
    newer[4] = 3
    empty = risorius.Dna()
    empty.name = "nothing"
    flat = small_face()
    flat.coordinate_system = ("right", "right", "up")
    content = {
        "not_a_dna": b"PK\x03\x04 this is something else entirely" * 9,
        "cut_short": whole[: len(whole) // 2],
        "cut_in_the_header": whole[:9],
        "newer": bytes(newer),
        "empty": b"",
        "no_geometry": empty.to_bytes(),
        "flat_axes": flat.to_bytes(),
    }
    for name, data in content.items():
        path = tmp_path / f"{name}.dna"
        path.write_bytes(data)
        yield path
    yield tmp_path / "missing.dna"
    yield tmp_path


def test_bad_files_leave_nothing_behind(tmp_path, mode):
    before = scene.counts()
    said = {}
    for path in _bad_files(tmp_path):
        with pytest.raises(RuntimeError) as caught:
            bpy.ops.risorius.import_dna(filepath=str(path), shape_mode=mode)
        text = str(caught.value).removeprefix("Error: ").strip()
        assert "Traceback" not in text
        assert "\n" not in text
        assert text.endswith(".")
        said[path.stem] = text
        assert scene.counts() == before, path.name
    assert "geometry" in said["no_geometry"]
    assert "generation" in said["newer"]
    assert "plane" in said["flat_axes"]


def test_a_failure_half_way_leaves_nothing_behind(dna_file, mode, monkeypatch, tracebacks):
    before = scene.counts()
    meshes = scene.submodule("scene.character.meshes")

    def fail(*_arguments):
        raise MemoryError("planted")

    monkeypatch.setattr(meshes, "set_mode", fail)
    with pytest.raises(RuntimeError, match="planted"):
        bpy.ops.risorius.import_dna(filepath=str(dna_file), shape_mode=mode)
    assert [text.splitlines()[-1] for text in tracebacks] == ["MemoryError: planted"]
    tracebacks.clear()
    assert scene.counts() == before
    assert bpy.context.mode == "OBJECT"


def test_missing_wheel_is_said_in_words(monkeypatch):
    native = scene.submodule("native")
    monkeypatch.setattr(native, "_risorius", None)
    monkeypatch.setattr(native, "_reason", "No module named 'risorius'")
    assert "wheels for" in native.problem()
    assert "Python 3." in native.problem()
    with pytest.raises(RuntimeError, match="native module"):
        bpy.ops.risorius.import_dna(filepath="anything.dna")
    addon_utils.disable(scene.MODULE)
    addon_utils.enable(scene.MODULE)


def test_wheel_of_another_version_is_said_in_words(monkeypatch):
    native = scene.submodule("native")
    monkeypatch.setattr(native._risorius, "__version__", "9.9.9")
    assert "9.9.9" in native.problem()
    bpy.context.scene.frame_set(2)


def test_with_the_wrong_wheel_edits_of_a_face_are_not_looked_at(dna_file, monkeypatch):
    rig, looked = scene.load(dna_file), []
    handlers = scene.submodule("scene.events.handlers")
    monkeypatch.setattr(handlers, "_notice_copies", looked.append)
    scene.set_controls(rig, jawOpen=0.5)
    assert looked
    looked.clear()
    monkeypatch.setattr(scene.submodule("native")._risorius, "__version__", "9.9.9")
    scene.set_controls(rig, jawOpen=1.0)
    assert not looked


def test_no_permission_gets_a_sentence(dna_file, monkeypatch):
    build = scene.submodule("scene.character.build")

    class Refusing(type(build.Path())):
        def read_bytes(self):
            raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(build, "Path", Refusing)
    before = scene.counts()
    with pytest.raises(RuntimeError, match=r"small\.dna: Permission denied\.$"):
        bpy.ops.risorius.import_dna(filepath=str(dna_file))
    assert scene.counts() == before


@pytest.fixture
def work(dna_file, monkeypatch):
    """Count how often the DNA file is read, hashed, unpacked, parsed and compiled."""
    whole, counts = dna_file.read_bytes(), Counter()
    storage = scene.submodule("scene.base.storage")

    def counted(owner, name, what, concerns):
        real = getattr(owner, name)

        def count(*arguments, **options):
            counts[what] += concerns(arguments[0] if arguments else None)
            return real(*arguments, **options)

        monkeypatch.setattr(owner, name, count)

    for module in (io, builtins):
        counted(module, "open", "read", lambda path: str(path) == str(dna_file))
    counted(storage, "hash_of", "hash", lambda content: content == whole)
    counted(storage.zlib, "decompressobj", "unpack", lambda _none: 1)
    counted(risorius, "load", "load", lambda _source: 1)
    counted(risorius, "Rig", "Rig", lambda _dna: 1)
    return counts


def test_an_import_reads_the_file_once_and_compiles_it_once(dna_file, mode, work):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.5)
    bpy.context.scene.frame_set(7)
    once = {"read": 1, "hash": 1, "load": 1, "Rig": 1}
    assert +work == once
    work.clear()
    again = scene.load(dna_file, mode)  # the .blend's hash may be wrong
    scene.set_controls(again, jawOpen=0.5)
    assert +work == {**once, "hash": 2, "unpack": 1}


def test_a_file_that_changes_while_it_is_read_is_one_file(dna_file, monkeypatch):
    whole, calls = dna_file.read_bytes(), []
    real_load, real_rig = risorius.load, risorius.Rig

    def load(source):
        calls.append("load")
        dna = real_load(source)
        small_face(name="Other", head_grid=(5, 6)).save(str(dna_file))
        return dna

    def compiled(*arguments):
        calls.append("Rig")
        return real_rig(*arguments)

    monkeypatch.setattr(risorius, "load", load)
    monkeypatch.setattr(risorius, "Rig", compiled)
    rig = scene.load(dna_file)
    scene.set_controls(rig, jawOpen=0.5)
    assert calls == ["load", "Rig"]
    monkeypatch.undo()
    assert scene.submodule("scene.base.storage").content(rig["risorius_dna"]) == whole
    dna_file.write_bytes(whole)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


@pytest.mark.parametrize("handler", ["frame", "edit", "save", "load"])
def test_an_exception_in_a_handler_does_not_pass_unseen(
    handler, dna_file, tmp_path, monkeypatch, tracebacks
):
    rig = scene.load(dna_file)
    blend = str(tmp_path / "face.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)

    def fail(*_arguments, **_options):
        raise LookupError("planted")

    monkeypatch.setattr(scene.submodule("scene.frame.evaluate"), "evaluate_all", fail)
    monkeypatch.setattr(scene.submodule("scene.frame.evaluate"), "evaluate", fail)
    monkeypatch.setattr(scene.submodule("scene.upkeep.repair"), "remove_dead", fail)
    assert not tracebacks
    if handler == "frame":
        bpy.context.scene.frame_set(3)
    elif handler == "edit":
        scene.set_controls(rig, jawOpen=0.5)
    elif handler == "save":
        bpy.ops.wm.save_as_mainfile(filepath=blend)
    else:
        bpy.ops.wm.open_mainfile(filepath=blend)
    monkeypatch.undo()
    assert any("planted" in text for text in tracebacks)
    tracebacks.clear()


def test_parts_that_were_deleted_do_no_harm(dna_file, mode):
    rig = scene.load(dna_file, mode)
    bpy.data.objects.remove(scene.meshes(rig)[1])
    scene.set_controls(rig, jawOpen=0.4)
    bpy.data.objects.remove(scene.controls(rig))
    bpy.context.scene.frame_set(3)
    bpy.data.objects.remove(rig)
    bpy.context.scene.frame_set(4)


def test_a_face_that_lost_its_data_is_left_alone(dna_file, mode):
    rig = scene.load(dna_file, mode)
    bpy.data.texts.remove(rig["risorius_dna"])
    still = scene.snapshot(rig)
    scene.face(rig)["CTRL_expressions.jawOpen"] = 1.0
    scene.update(scene.controls(rig))
    np.testing.assert_array_equal(scene.snapshot(rig), still)


def test_damaged_data_in_the_blend_is_said_once(dna_file, mode, capsys):
    rig = scene.load(dna_file, mode)
    text = rig["risorius_dna"]
    text["risorius_bytes"] = b"damaged"
    scene.submodule("scene.character.runtime").forget_unused(())
    for frame in (2, 3, 4):
        bpy.context.scene.frame_set(frame)
    assert capsys.readouterr().out.count("cannot be read") == 1


def _plant_sample(monkeypatch, tmp_path, dna_file, error=None):
    """Set up a user folder of the extension, and a builder of samples that copies a small face.

    If `error` is given, the builder raises it instead. Returns a list that receives the options of
    each call of the builder.
    """
    import shutil

    import risorius_people as sample

    calls = []

    def build_sample(path, **options):
        calls.append(options)
        if error is not None:
            raise error
        shutil.copy(dna_file, path)

    monkeypatch.setattr(sample, "build_sample", build_sample)
    monkeypatch.setattr(sample, "is_fetched", lambda: True)
    monkeypatch.setattr(bpy.utils, "extension_path_user", lambda *_a, **_k: str(tmp_path))
    return calls


def test_add_face_builds_the_sample_once(monkeypatch, tmp_path, dna_file, mode):
    calls = _plant_sample(monkeypatch, tmp_path, dna_file)
    for _ in range(2):
        made = bpy.ops.risorius.add_character(person="woman", shape_mode=mode)
        assert made == {"FINISHED"}
    assert [c["offline"] for c in calls] == [not bpy.app.online_access]
    assert len([o for o in bpy.data.objects if "risorius_controls" in o]) == 2


def test_building_a_sample_ends_where_that_is_asked_for(monkeypatch, tmp_path):
    """Esc ends the building of a sample face, and the status bar shows the progress before.

    The test runs the operator's task without a window.
    """
    import risorius_people as sample

    operator = scene.submodule("ui.file.import_operators").RISORIUS_OT_add_character
    task, said = None, []

    def say(share):
        said.append(operator.shown(SimpleNamespace(_task=task), share))

    def build_sample(path, progress, fetched, **_options):
        assert fetched(sample.DATA_SIZE // 4)
        say(0)
        assert progress(0.25)
        say(25)
        task._cancelled.set()
        assert not fetched(sample.DATA_SIZE)
        if not progress(0.5):
            raise sample.SourceError("stopped")
        path.write_bytes(b"")

    monkeypatch.setattr(sample, "build_sample", build_sample)
    sample_face = scene.submodule("scene.file.sample_face")
    path = tmp_path / "new" / "woman.dna"
    task = sample_face.sample_task(path, "woman", offline=True)
    task.run()
    assert task.share == 0.5
    assert str(task.error) == "stopped"
    assert not path.exists()
    assert "data of 48 MB, once: 25 %" in said[0]
    assert "Building the face: 25 %" in said[1]


def test_add_face_without_data_says_why(monkeypatch, tmp_path, dna_file):
    import risorius_people as sample

    _plant_sample(monkeypatch, tmp_path, dna_file, sample.SourceError("No data is there."))
    before = scene.counts()
    with pytest.raises(RuntimeError, match="could not be built: No data is there"):
        bpy.ops.risorius.add_character(person="woman")
    assert scene.counts() == before


def test_add_face_offline_says_what_to_do_and_no_path(monkeypatch, tmp_path, dna_file):
    import risorius_people as sample

    calls = _plant_sample(monkeypatch, tmp_path, dna_file)
    monkeypatch.setattr(sample, "is_fetched", lambda: False)
    assert not bpy.app.online_access
    with pytest.raises(RuntimeError, match="allow online access first") as said:
        bpy.ops.risorius.add_character(person="woman")
    assert str(tmp_path) not in str(said.value)
    assert "/" not in str(said.value).partition(":")[2].partition("Location")[0]
    assert calls == []


def test_a_folder_that_cannot_be_written_is_one_sentence(monkeypatch, tmp_path, dna_file):
    calls = _plant_sample(monkeypatch, tmp_path, dna_file)
    blocked = tmp_path / "a file"
    blocked.write_bytes(b"")  # root may write everywhere, but not below a file
    monkeypatch.setattr(bpy.utils, "extension_path_user", lambda *_a, **_k: str(blocked / "in it"))
    with pytest.raises(RuntimeError, match="See that you may write there") as said:
        bpy.ops.risorius.add_character(person="woman")
    assert str(tmp_path) not in str(said.value)
    assert calls == []


def test_a_texture_that_is_missing_is_a_warning(tmp_path):
    face = small_face()
    face.metadata = {"texture:head_lod0_mesh:color": "gone.png", "licence": "CC0"}
    path = tmp_path / "textured.dna"
    face.save(str(path))
    rig, warnings = scene.submodule("scene.character.build").import_file(
        bpy.context, path, scene.submodule("scene.character.build").BuildOptions()
    )
    assert "The texture gone.png was not found beside the file." in warnings
    assert scene.controls(rig).data["dna_licence"] == "CC0"


def test_textures_are_packed_and_masks_tint_by_their_map(tmp_path):
    face = small_face()
    face.metadata = {
        "texture:head_lod0_mesh:color": "skin.png",
        "texture:head_lod0_mesh:map:flush": "flush.png",
    }
    path = tmp_path / "textured.dna"
    face.save(str(path))
    folder = tmp_path / "textured_textures"
    folder.mkdir()
    for name in ("skin.png", "flush.png"):
        image = bpy.data.images.new(name, 4, 4)
        image.filepath_raw, image.file_format = str(folder / name), "PNG"
        image.save()
        bpy.data.images.remove(image)
    rig = scene.load(path)
    images = {i.name: i for i in bpy.data.images}
    assert {"skin.png", "flush.png"} <= set(images)
    assert all(images[n].packed_file for n in ("skin.png", "flush.png"))
    tree = scene.meshes(rig)[0].data.materials[0].node_tree
    value = tree.nodes["risorius_map_000"]
    assert value.label == "flush"
    assert value.outputs[0].links[0].to_node.type == "MATH"
