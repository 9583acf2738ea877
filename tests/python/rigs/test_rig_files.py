# SPDX-License-Identifier: MIT
"""Tests compiled rigs in files and in the cache, and the optional check of controls."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
import risorius
import xxhash
from conftest import GOLDEN
from risorius.files import caches
from risorius.rigs import cache

FILE = GOLDEN / "core.dna"
JAW = "CTRL_expressions.jawOpen"


@pytest.fixture
def rig():
    return risorius.Rig(risorius.load(FILE))


HASH = slice(24, 32)  # place of the hash in a block; the bytes after it are hashed
# ---- files


@pytest.mark.parametrize("trusted", [None, True, False])
@pytest.mark.parametrize("mapped", [False, True])
def test_a_saved_rig_is_the_same_rig(tmp_path, rig, trusted, mapped):
    rig.save(tmp_path / "face.rig")
    again = risorius.Rig.load(tmp_path / "face.rig", trusted, mapped=mapped)
    assert again.to_bytes() == rig.to_bytes()
    raw = np.full(4, 0.5, np.float32)
    np.testing.assert_array_equal(again.evaluate(raw).joints, rig.evaluate(raw).joints)
    assert risorius.Rig.load(tmp_path / "face.rig", simd="scalar").simd == "scalar"


def test_what_is_refused_names_the_file_and_the_field(tmp_path, rig):
    file = tmp_path / "face.rig"
    data = bytearray(rig.to_bytes())
    data[-1] ^= 1
    file.write_bytes(data)
    with pytest.raises(risorius.DnaError, match="face.rig") as caught:
        risorius.Rig.load(file)  # files are checked by default
    assert (caught.value.code, caught.value.where) == ("invalid_value", "rig.hash")
    file.write_bytes(b"short")
    with pytest.raises(risorius.DnaError, match="face.rig.*5 bytes"):
        risorius.Rig.load(file)
    with pytest.raises(risorius.DnaError, match="folder"):
        risorius.Rig.load(tmp_path)
    with pytest.raises(risorius.DnaError, match="absent") as caught:
        risorius.Rig.load(tmp_path / "absent")
    assert caught.value.code == "io_open"
    with pytest.raises(risorius.DnaError) as caught:
        rig.save(tmp_path / "absent" / "face.rig")
    assert caught.value.code == "io_write"
    with pytest.raises(ValueError, match="simd"):
        risorius.Rig.load(file, simd="abacus")


def forged(rig):
    """Bytes of a rig with an axis out of range in the rotation order, and with a correct hash."""
    data = bytearray(rig.to_bytes())
    data[data.index(b"\x00\x01\x02\x00", HASH.stop)] = 9  # an axis in the rotation order
    data[HASH] = xxhash.xxh64_digest(data[HASH.stop :])[::-1]
    return data


@pytest.mark.skipif(sys.platform == "win32", reason="files have no modes there")
def test_a_file_that_others_may_write_is_checked(tmp_path, rig):
    file = tmp_path / "face.rig"
    data = forged(rig)
    file.write_bytes(data)
    file.chmod(0o644)
    risorius.Rig.load(file, trusted=None)
    file.chmod(0o666)
    with pytest.raises(risorius.DnaError, match="points outside"):
        risorius.Rig.load(file, trusted=None)
    risorius.Rig.load(file, trusted=True)


def test_only_the_caller_answers_for_a_wrong_hash(tmp_path, rig):
    file = tmp_path / "face.rig"
    data = bytearray(rig.to_bytes())
    data[-1] ^= 1  # after the last array, where nothing reads
    file.write_bytes(data)
    for trusted in (False, None):
        with pytest.raises(risorius.DnaError, match="changed or cut"):
            risorius.Rig.load(file, trusted=trusted)
    risorius.Rig.load(file, trusted=True)


# ---- the cache


class CompiledError(Exception):
    """Raised if the cache was not used."""


@pytest.fixture
def no_compiling(monkeypatch):
    """A function; after it is called, each compilation raises CompiledError."""

    def arm():
        def load(_):
            raise CompiledError

        monkeypatch.setattr(cache, "load", load)

    return arm


def test_the_second_time_nothing_is_compiled(tmp_path, rig, no_compiling):
    first = risorius.compile_cached(FILE, tmp_path / "deep" / "cache")
    assert first.to_bytes() == rig.to_bytes()
    no_compiling()
    second = risorius.compile_cached(str(FILE), tmp_path / "deep" / "cache")
    assert second.to_bytes() == rig.to_bytes()


def test_another_file_option_or_version_is_another_face(tmp_path, monkeypatch, no_compiling):
    risorius.compile_cached(FILE, tmp_path)
    half = risorius.compile_cached(FILE, tmp_path, precision="float16", rotation="quaternion")
    assert half.rotation == "quaternion"
    assert len(list(tmp_path.glob("*.rig"))) == 2
    no_compiling()
    for options in ({"precision": "float16"}, {"rotation": "quaternion"}):
        with pytest.raises(CompiledError):
            risorius.compile_cached(FILE, tmp_path, **options)
    with pytest.raises(CompiledError):
        risorius.compile_cached(GOLDEN / "units.dna", tmp_path)
    for module, name, value in (
        (cache, "rig_block_version", lambda: 0),
        (cache, "compile_version", lambda: 1),  # another version of the compiler
        (cache.version, "__version__", "0.0.0"),
        (sys, "byteorder", "middle"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(module, name, value)
            with pytest.raises(CompiledError):
                risorius.compile_cached(FILE, tmp_path)
    risorius.compile_cached(FILE, tmp_path)


def test_a_damaged_cache_is_made_anew(tmp_path, rig, no_compiling):
    risorius.compile_cached(FILE, tmp_path)
    (file,) = tmp_path.glob("*.rig")
    for damaged in (b"", b"no rig", rig.to_bytes()[:-1], bytes(len(rig.to_bytes()))):
        file.write_bytes(damaged)
        assert risorius.compile_cached(FILE, tmp_path).to_bytes() == rig.to_bytes()
        assert file.read_bytes() == rig.to_bytes()
    no_compiling()
    risorius.compile_cached(FILE, tmp_path)


def test_a_flipped_bit_in_the_cache_is_a_face_made_anew(tmp_path, rig):
    """A bit in every 61 bytes is flipped: in the header, in every array, and between arrays."""
    risorius.compile_cached(FILE, tmp_path)
    (file,) = tmp_path.glob("*.rig")
    good = rig.to_bytes()
    raw = np.full(len(rig.raw_control_names), 0.5, np.float32)
    pose = rig.evaluate(raw)
    for at in range(0, len(good), 61):  # arrays begin at multiples of 64
        data = bytearray(good)
        data[at] ^= 1 << at % 8
        file.write_bytes(data)
        again = risorius.compile_cached(FILE, tmp_path)
        assert file.read_bytes() == good
        np.testing.assert_array_equal(again.evaluate(raw).joints, pose.joints)


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path, rig):
    (tmp_path / "file").write_bytes(b"")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        assert risorius.compile_cached(FILE, folder).to_bytes() == rig.to_bytes()


def test_errors_of_the_dna_are_those_of_load(tmp_path):
    (tmp_path / "bad.dna").write_bytes(b"not a face")
    for name in ("bad.dna", "absent.dna", ""):
        with pytest.raises(risorius.DnaError) as expected:
            risorius.load(tmp_path / name)
        with pytest.raises(risorius.DnaError) as caught:
            risorius.compile_cached(tmp_path / name, tmp_path / "cache")
        assert str(caught.value) == str(expected.value)
    with pytest.raises(ValueError, match="precision"):
        risorius.compile_cached(FILE, tmp_path / "cache", precision="float8")
    assert not (tmp_path / "cache").exists()


def test_the_folder_follows_the_platform(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    expected = {
        "linux": tmp_path / ".cache",
        "darwin": tmp_path / "Library" / "Caches",
        "win32": tmp_path / "local",
    }
    for platform, base in expected.items():
        monkeypatch.setattr(caches.sys, "platform", platform)
        assert caches.cache_folder() == base / "risorius"
    monkeypatch.setattr(caches.sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert caches.cache_folder() == tmp_path / ".cache" / "risorius"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert caches.cache_folder() == tmp_path / "xdg" / "risorius"
    risorius.compile_cached(FILE)
    (file,) = (caches.cache_folder() / "rigs").iterdir()
    if os.name == "posix":
        assert file.parent.stat().st_mode & 0o077 == 0
    assert file.suffix == ".rig"


# ---- controls that are not finite


def test_a_control_that_is_not_finite_is_named_when_asked(rig):
    jaw = rig.raw_control_names.index(JAW)
    raw = np.zeros((3, 4), np.float32)
    raw[1, jaw] = np.nan
    rig.evaluate_batch(raw)
    rig.evaluate_batch(raw[[0, 2]], check=True)
    with pytest.raises(risorius.DnaError, match=f"{JAW} is NaN in frame 1") as caught:
        rig.evaluate_batch(raw, check=True)
    assert caught.value.code == "invalid_value"
    assert caught.value.where == f"raw[1, {jaw}]"
    with pytest.raises(risorius.DnaError, match=f"{JAW} is NaN,"):
        rig.evaluate(raw[1], check=True)
    rig.evaluate(raw[0] + 5, check=True)
    raw[1, jaw] = -np.inf
    with pytest.raises(risorius.DnaError, match=f"{JAW} is minus infinite"):
        rig.evaluate(raw[1], check=True)
    # Values above the range of float32 become infinite when they are converted.
    with pytest.raises(risorius.DnaError, match="is infinite"), np.errstate(over="ignore"):
        rig.evaluate(np.full(4, 1e39), check=True)


def test_find_non_finite_lists_frame_name_and_value(rig):
    names = rig.raw_control_names
    raw = np.zeros((3, 4))
    raw[0, 3], raw[2, 1] = np.inf, np.nan
    (first, second) = rig.find_non_finite(raw)
    assert first == (0, names[3], np.inf)
    assert second[:2] == (2, names[1])
    assert np.isnan(second[2])
    assert [f[:2] for f in rig.find_non_finite(raw[2])] == [(0, names[1])]
    assert rig.find_non_finite(np.zeros((0, 4))) == []
    for shape in ((3,), (2, 3), (1, 1, 4)):
        with pytest.raises(ValueError, match=r"\(4,\) or \(n, 4\)"):
            rig.find_non_finite(np.zeros(shape))


def test_a_refused_frame_leaves_an_instance_as_it_was(rig):
    face, other = rig.instance(), rig.instance()
    raw = np.full(4, 0.5, np.float32)
    face.evaluate(raw)
    other.evaluate(raw)
    with pytest.raises(risorius.DnaError):
        face.evaluate(raw * np.nan, check=True)
    np.testing.assert_array_equal(
        face.evaluate(raw / 2, check=True).joints, other.evaluate(raw / 2).joints
    )


def test_nan_spoils_what_its_control_drives_and_nothing_else(rig):
    """Outputs that depend on the NaN control by the lists of the DNA file may be NaN.

    All other outputs stay equal.
    """
    dna = risorius.load(GOLDEN / "medium.dna")
    rig = risorius.Rig(dna)
    raw = np.full(len(rig.raw_control_names), 0.25, np.float32)
    clean = rig.evaluate(raw)
    raw[5] = np.nan
    pose = rig.evaluate(raw)
    rows, columns = np.asarray(dna.psds.rows), np.asarray(dna.psds.columns)
    spoiled, before = {5}, set()
    while spoiled != before:
        before = set(spoiled)
        spoiled |= set(rows[np.isin(columns, list(spoiled))].tolist())
    expected = set()
    for group in dna.joint_groups:
        count = int(group.lods[0])
        if spoiled & set(group.input_indices.tolist()):
            expected |= set(group.output_indices[:count].tolist())
        else:
            expected -= set(group.output_indices[:count].tolist())
    flat, other = pose.joints.ravel(), clean.joints.ravel()
    assert set(np.flatnonzero(np.isnan(flat)).tolist()) <= expected
    kept = [i for i in range(len(flat)) if i not in expected]
    assert kept
    assert len(kept) < len(flat)
    np.testing.assert_array_equal(flat[kept], other[kept])
    np.testing.assert_array_equal(rig.evaluate(np.nan_to_num(raw, nan=0.25)).joints, clean.joints)


def test_solver_poses_refuses_what_is_not_there(rig):
    with pytest.raises(IndexError, match="a solver below 0"):
        rig.solver_poses(0, np.zeros(rig.control_count))
    rbf = risorius.Rig(risorius.load(GOLDEN / "rbf.dna"))
    with pytest.raises(ValueError, match="controls"):
        rbf.solver_poses(0, [0.0])
