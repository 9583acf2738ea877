# SPDX-License-Identifier: MIT
"""Tests files that other programs have open, and unusual names and folders, on every system."""

import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius.files import fileio

OLD = (GOLDEN / "tiny_v28.dna").read_bytes()
WINDOWS = os.name == "nt"
on_windows = pytest.mark.skipif(not WINDOWS, reason="only Windows keeps others from an open file")
NAMES = ["Лицо.dna", "顔.dna", "é ñ ß.dna", "😀.dna", "a b&(c)'s %TEMP%.dna", "x" * 180 + ".dna"]


@pytest.fixture
def face(tmp_path):
    path = tmp_path / "face.dna"
    path.write_bytes(OLD)
    return path


def changed():
    dna = risorius.load(OLD)
    dna.name = "changed"
    return dna


def native(path):
    changed().save(path)


def python(path):
    fileio.write_bytes(path, b"new")


@pytest.mark.parametrize("save", [native, python])
def test_a_file_that_is_read_is_replaced_or_stays_and_its_reader_goes_on(save, face):
    with face.open("rb") as reader:
        begin = reader.read(100)
        if WINDOWS:  # on Windows, Python opens files so that they cannot be replaced
            with pytest.raises((OSError, risorius.DnaError), match=r"face\.dna") as caught:
                save(face)
            assert "\n" not in str(caught.value)
            assert face.read_bytes() == OLD
        else:
            save(face)
            assert face.read_bytes() != OLD
        assert begin + reader.read() == OLD
    assert os.listdir(face.parent) == [face.name]
    save(face)
    assert face.read_bytes() != OLD
    assert os.listdir(face.parent) == [face.name]


@on_windows
@pytest.mark.parametrize("save", [native, python])
def test_a_file_that_nobody_else_may_open_stays(save, face):
    handle = opened_alone(face)
    try:
        with pytest.raises((OSError, risorius.DnaError), match=r"face\.dna"):
            save(face)
        with pytest.raises(risorius.DnaError, match=r"cannot open .*face\.dna") as caught:
            risorius.load(face)
        assert "\n" not in str(caught.value)
    finally:
        handle.close()
    assert face.read_bytes() == OLD
    assert os.listdir(face.parent) == [face.name]


def opened_alone(path):
    """A file object that excludes all others on Windows, as virus scanners or editors open it."""
    import ctypes
    import msvcrt

    create = ctypes.windll.kernel32.CreateFileW
    create.restype = ctypes.c_void_p
    read, existing = 0x80000000, 3
    handle = create(str(path), read, 0, None, existing, 0, None)
    assert handle not in (None, ctypes.c_void_p(-1).value)
    return os.fdopen(msvcrt.open_osfhandle(handle, os.O_RDONLY), "rb")


@pytest.mark.parametrize("save", [native, python])
def test_a_file_that_may_not_be_written(save, face):
    face.chmod(0o444)
    try:
        if WINDOWS:  # Windows refuses the file, POSIX the folder
            with pytest.raises((OSError, risorius.DnaError), match=r"face\.dna"):
                save(face)
            assert face.read_bytes() == OLD
        else:
            save(face)
            assert face.read_bytes() != OLD
        assert os.listdir(face.parent) == [face.name]
    finally:
        face.chmod(0o644)


@pytest.mark.parametrize("name", NAMES)
def test_names_in_every_writing(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(OLD)
    dna = risorius.load(path)
    dna.save(path)
    fileio.write_bytes(path.with_suffix(".txt"), b"whole")
    assert path.with_suffix(".txt").read_bytes() == b"whole"
    rig = risorius.Rig(dna)
    rig.save(path.with_suffix(".rig"))
    again = risorius.Rig.load(path.with_suffix(".rig"))
    raw = rig.initial_raw_controls
    np.testing.assert_array_equal(again.evaluate(raw).joints, rig.evaluate(raw).joints)
    assert len(os.listdir(tmp_path)) == 3
    path.write_bytes(OLD[:100])
    with pytest.raises(risorius.DnaError) as caught:
        risorius.load(path)
    assert name in str(caught.value)


@pytest.mark.parametrize("name", NAMES[:4])
def test_the_command_line_takes_them_and_names_them(name, tmp_path):
    good, bad = tmp_path / name, tmp_path / ("not " + name)
    good.write_bytes(OLD)
    bad.write_bytes(b"no")
    command = [sys.executable, "-m", "risorius", "check"]
    utf8 = {**os.environ, "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run([*command, str(good)], capture_output=True, env=utf8, check=False)
    assert done.returncode == 0, done.stderr
    done = subprocess.run([*command, str(bad)], capture_output=True, env=utf8, check=False)
    assert done.returncode != 0
    assert bad.name in (done.stdout + done.stderr).decode()
    # Pipes of Windows have their own code page, which may lack letters of the name; the command
    # must end in the same way.
    old = {**os.environ, "PYTHONIOENCODING": "cp1252"}
    again = subprocess.run([*command, str(bad)], capture_output=True, env=old, check=False)
    assert again.returncode == done.returncode
    assert b"Traceback" not in again.stderr


def test_folders_deeper_than_260_letters(tmp_path):
    folder = tmp_path
    while len(str(folder)) < 300:
        folder /= "a folder of forty letters, one of many.."[:38]
    folder.mkdir(parents=True)
    path = folder / "face.dna"
    native(path)
    assert risorius.load(path).name == "changed"
    python(path)
    assert path.read_bytes() == b"new"
    assert os.listdir(folder) == ["face.dna"]
    shutil.rmtree(tmp_path / folder.relative_to(tmp_path).parts[0])


def test_a_user_whose_name_is_not_of_this_code_page(tmp_path):
    home = tmp_path / "Users" / "Жанна 田中" / "AppData" / "Local"
    home.mkdir(parents=True)
    variable = "LOCALAPPDATA" if WINDOWS else "XDG_CACHE_HOME"
    code = "import sys, risorius; risorius.compile_cached(sys.argv[1])"
    command = [sys.executable, "-c", code, str(GOLDEN / "tiny_v28.dna")]
    for _ in range(2):
        subprocess.run(command, env={**os.environ, variable: str(home)}, check=True)
    (rig,) = (home / "risorius" / "rigs").iterdir()
    assert rig.suffix == ".rig"
