# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that hostile files give one error sentence, and leave scene and memory unchanged."""

import gc
import hashlib
import random
import tracemalloc
import zlib
from pathlib import Path

import bpy
import pytest
from support import hostile, scene
from support.faces import small_face
from support.layout import drawn

SEED = 20261121
QUICK = {"shape_mode": "LIVE", "use_materials": False}


def _one_sentence(text, path):
    """Check that `text` is one printable sentence with the name of the file `path`."""
    assert "Traceback" not in text, text
    assert Path(path).name in text, text
    assert text.isprintable(), text
    assert text.endswith("."), text
    assert ". " not in text, text
    assert len(text) < 500, text


def _take_out():
    """Remove the imported faces."""
    build, parts = scene.submodule("scene.character.build"), scene.submodule("scene.base.parts")
    for rig in parts.rigs():
        build.remove(rig)


def _offer(path, **options):
    """Import a file that may be refused, and check that no data-block is left afterwards.

    A face that was imported is removed. Returns whether the file was accepted.
    """
    before = scene.counts()
    try:
        bpy.ops.risorius.import_dna(filepath=str(path), **(options or QUICK))
        taken = True
    except RuntimeError as error:
        _one_sentence(str(error).removeprefix("Error: ").strip(), path)
        assert scene.counts() == before
        taken = False
    _take_out()
    assert scene.counts() == before
    assert bpy.context.mode == "OBJECT"
    return taken


def _offer_bytes(folder, name, content, **options):
    path = folder / f"{name}.dna"
    path.write_bytes(content)
    taken = _offer(path, **options)
    path.unlink()
    return taken


def _resident():
    """Resident memory of this process in bytes."""
    gc.collect()
    pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[1]
    return int(pages) * 4096


def test_what_the_fuzzers_found(capsys):
    for path in hostile.found_by_fuzzing():
        _offer(path)
    assert "Traceback" not in capsys.readouterr().err


def test_files_that_are_broken_on_purpose(tmp_path, capsys):
    refused = 0
    for name, content, must_refuse in hostile.broken_on_purpose():
        taken = _offer_bytes(tmp_path, name, content)
        assert not (taken and must_refuse), name
        refused += not taken
    assert refused > 200
    assert "Traceback" not in capsys.readouterr().err


def _golden(name):
    return (hostile.DATA / "golden" / f"{name}.dna").read_bytes()


@pytest.mark.parametrize("source", ["small face", "face with networks"])
def test_hundreds_of_mutations_leave_scene_and_memory_as_they_were(source, tmp_path, capsys):
    whole = small_face().to_bytes() if source == "small face" else _golden("ml")
    cuts = list(hostile.cut_short(whole, 60))
    files = cuts + list(hostile.with_flipped_bytes(whole, 250, SEED))
    random.Random(SEED).shuffle(files)
    taken, before = 0, 0
    for number, content in enumerate(files):
        if number == len(files) // 2:
            before = _resident()
        taken += _offer_bytes(tmp_path, f"mutation_{number}", content)
    grown = _resident() - before
    with capsys.disabled():
        print(f"\n{source}, seed {SEED}: {len(files)} files, {taken} taken, {grown // 1024} KB")
    assert 0 < taken < len(files) - len(cuts)
    assert grown < 4 << 20
    assert "Traceback" not in capsys.readouterr().err


def test_a_large_file_that_is_refused_again_and_again_costs_no_memory(tmp_path):
    content = _golden("medium")[:-3000]
    before = 0
    for number in range(80):
        if number == 40:
            before = _resident()
        assert not _offer_bytes(tmp_path, f"large_{number}", content)
    assert _resident() - before < len(content) * 8


def test_a_face_that_left_is_not_kept(tmp_path):
    content = small_face().to_bytes()
    runtime = scene.submodule("scene.character.runtime")
    for number in range(12):
        path = tmp_path / "left.dna"
        path.write_bytes(content.replace(b"Small", b"Sma%02d" % number))
        scene.load(path)
        _take_out()
        bpy.context.view_layer.update()
    assert len(runtime._cache) <= 2
    written = scene.submodule("scene.base.last_written")
    kept = (written.inputs, written.places, written.weights, written.bone_writers)
    assert all(len(entries) <= 5 for entries in kept)


def _draw_panels():
    """Draw the panels of ui.face.panel and ui.face.controls_panel. Returns their texts as one."""
    said = []
    face = "ui.face"
    for panel in (
        scene.submodule(f"{face}.panel").CLASSES + scene.submodule(f"{face}.controls_panel").CLASSES
    ):
        if getattr(panel, "poll", lambda _context: True)(bpy.context):
            said += drawn(panel).labels
    return " ".join(said)


@pytest.mark.parametrize("name", hostile.ODD)
def test_odd_but_well_formed_files(name, mode, tmp_path, capsys):
    path = tmp_path / "odd.dna"
    path.write_bytes(hostile.odd_face(name))
    before = scene.counts()
    try:
        bpy.ops.risorius.import_dna(filepath=str(path), shape_mode=mode, lods=(True,) * 8)
    except RuntimeError as error:
        _one_sentence(str(error).removeprefix("Error: ").strip(), path)
    else:
        rig = scene.submodule("scene.base.parts").rigs()[0]
        bone = scene.face(rig)
        for label in scene.submodule("scene.character.runtime").of(rig).labels:
            bone[label] = 0.7
        scene.update(scene.controls(rig))
        for frame in (2, 3):
            bpy.context.scene.frame_set(frame)
        _draw_panels()
        bpy.ops.risorius.set_shape_mode(mode="KEYS" if mode != "KEYS" else "LIVE")
        bpy.ops.risorius.key()
        bpy.ops.risorius.reset()
        for action in list(bpy.data.actions):
            bpy.data.actions.remove(action)
        _take_out()
    assert scene.counts() == before
    said = capsys.readouterr()
    assert "Traceback" not in said.err + said.out


def _tamper(text, how):
    packed = text["risorius_bytes"]
    other = small_face(name="Other")
    other.meshes = other.meshes[:1]
    other.mesh_names, other.lod_mesh_mapping = ["head"], [[0], [0]]
    other.mesh_blend_shape_channel_mapping = []
    whole = other.to_bytes()
    values = {
        "no stream at all": {"risorius_bytes": b"\0\1\2 no stream"},
        "cut short": {"risorius_bytes": packed[: len(packed) // 2]},
        "one byte flipped": {
            "risorius_bytes": packed[:900] + bytes([packed[900] ^ 1]) + packed[901:]
        },
        "another hash": {"risorius_hash": "0" * 64},
        "another file under the old hash": {"risorius_bytes": zlib.compress(whole)},
        "another file with its hash": {
            "risorius_bytes": zlib.compress(whole),
            "risorius_hash": hashlib.sha256(whole).hexdigest(),
        },
        "a number for the bytes": {"risorius_bytes": 5},
        "words for the bytes": {"risorius_bytes": "words"},
        "a number for the hash": {"risorius_hash": 5},
    }[how]
    for name, value in values.items():
        del text[name]
        text[name] = value


@pytest.mark.parametrize(
    "how", ["no stream at all", "cut short", "one byte flipped", "a number for the bytes"]
)
def test_export_of_a_face_whose_dna_was_tampered_with_since(how, dna_file, tmp_path):
    rig = scene.load(dna_file)
    target = tmp_path / "kept.dna"
    target.write_bytes(b"what was there")
    _tamper(rig["risorius_dna"], how)  # its compiled rig still exists
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.risorius.export_dna(filepath=str(target))
    text = str(caught.value).removeprefix("Error: ").strip()
    assert text.startswith("Small_rig has lost the data of its file: its bytes") or how[0] == "a"
    assert "Traceback" not in text
    assert text.isprintable()
    assert text.endswith(".")
    assert target.read_bytes() == b"what was there"


@pytest.mark.parametrize(
    "how",
    [
        "no stream at all",
        "cut short",
        "one byte flipped",
        "another hash",
        "another file under the old hash",
        "another file with its hash",
        "a number for the bytes",
        "words for the bytes",
        "a number for the hash",
        "no text",
        "words for the text",
    ],
)
def test_a_blend_whose_dna_was_tampered_with(how, dna_file, mode, tmp_path, capsys):
    rig = scene.load(dna_file, mode)
    if how == "no text":
        del rig["risorius_dna"]
    elif how == "words for the text":
        del rig["risorius_dna"]
        rig["risorius_dna"] = "words"
    else:
        _tamper(rig["risorius_dna"], how)
    blend = str(tmp_path / "tampered.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    scene.submodule("scene.character.runtime").forget_unused(())
    capsys.readouterr()  # a save that ends Direct mode may also have printed
    bpy.ops.wm.open_mainfile(filepath=blend)
    rig = bpy.data.objects["Small_rig"]
    bpy.context.view_layer.objects.active = rig
    for frame in (2, 3, 4):
        bpy.context.scene.frame_set(frame)
    scene.face(rig)["CTRL_expressions.jawOpen"] = 1.0
    scene.update(scene.controls(rig))
    shown = _draw_panels()
    said = capsys.readouterr()
    assert "Traceback" not in said.err + said.out
    if how == "another file with its hash":
        return  # another face, which is accepted
    assert "has lost its data" in shown
    if how.startswith(("no text", "words for the text", "a number for the hash")):
        return
    lines = [s for s in said.out.splitlines() if "cannot be read" in s]
    assert len(lines) == 1
    assert "Small_rig" in lines[0]
    assert lines[0].endswith(".")


# Whoever makes a hostile .blend file also writes the stored length and hash of the DNA data, so the
# add-on must trust neither.
@pytest.mark.parametrize("said", ["nothing", "the truth", "too little", "no number"])
@pytest.mark.parametrize("begins", ["as a DNA file", "as nothing known"])
def test_a_small_stream_that_unfolds_to_a_thousand_times_its_size(said, begins, dna_file, capsys):
    whole = (b"DNA" if begins == "as a DNA file" else b"") + bytes(16 << 20)
    packed = zlib.compress(whole)
    text = scene.load(dna_file)["risorius_dna"]
    for name in ("risorius_bytes", "risorius_hash", "risorius_length"):
        text.pop(name, None)
    text["risorius_bytes"] = packed
    text["risorius_hash"] = hashlib.sha256(whole).hexdigest()
    length = {"the truth": str(len(whole)), "too little": "5000", "no number": "1e99"}
    if said in length:
        text["risorius_length"] = length[said]
    del whole
    scene.submodule("scene.character.runtime").forget_unused(())
    tracemalloc.start()
    bpy.context.scene.frame_set(2)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 70 * len(packed) + (4 << 20)
    told = capsys.readouterr()
    assert "Traceback" not in told.err + told.out
    (line,) = [s for s in told.out.splitlines() if "cannot be read" in s]
    assert "Small_rig" in line
    assert line.endswith(".")


@pytest.mark.parametrize("length", [True, False])
def test_a_dna_that_packs_to_almost_nothing_is_kept_whole(length, tmp_path):
    face = small_face()
    face.metadata = {"nothing": " " * (8 << 20)}
    path = tmp_path / "empty_inside.dna"
    face.save(str(path))
    assert len(zlib.compress(path.read_bytes())) < 100 << 10
    rig = scene.load(path)
    if not length:
        del rig["risorius_dna"]["risorius_length"]
    assert scene.submodule("scene.base.storage").content(rig["risorius_dna"]) == path.read_bytes()


@pytest.mark.parametrize("name", ["two\nlines", "é\U0001f600", "x" * 200, "a. b", "%s{0}\\", " "])
def test_files_with_odd_names_of_their_own(name, tmp_path):
    bad = tmp_path / f"{name}.dna"
    bad.write_bytes(b"nothing of the kind")
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.risorius.import_dna(filepath=str(bad))
    text = str(caught.value).removeprefix("Error: ").rstrip()
    assert "Traceback" not in text
    assert text.isprintable()
    assert bad.name.replace("\n", " ") in text
    good = bad.with_name(f"{name}_good.dna")
    small_face(name="").save(str(good))
    assert scene.load(good).name.endswith("_rig")
