# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile files through the front door: a sentence, and the scene and the memory as before."""

import gc
import random
from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
import risorius
from support import hostile, scene
from support.faces import small_face

SEED = 20261121
QUICK = {"shape_mode": "LIVE", "use_materials": False}


def _one_sentence(text, path):
    """What is said names the file, in one printable sentence."""
    assert "Traceback" not in text, text
    assert Path(path).name in text, text
    assert text.isprintable(), text
    assert text.endswith("."), text
    assert ". " not in text, text
    assert len(text) < 500, text


def _take_out():
    """Remove what was imported."""
    build, parts = scene.submodule("scene.build"), scene.submodule("scene.parts")
    for rig in parts.rigs():
        build.remove(rig)


def _offer(path, **options):
    """Import a file that may be refused; returns whether it was taken, and nothing is left."""
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
    """Memory that this process holds, in bytes."""
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
    files = cuts + list(hostile.with_flipped_bytes(whole, 100, SEED))
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
    runtime = scene.submodule("scene.runtime")
    for number in range(12):
        path = tmp_path / "left.dna"
        path.write_bytes(content.replace(b"Small", b"Sma%02d" % number))
        scene.load(path)
        _take_out()
        bpy.context.view_layer.update()
    assert len(runtime._cache) <= 2
    assert len(runtime.outputs) <= 20
