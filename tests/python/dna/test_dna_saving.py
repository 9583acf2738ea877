# SPDX-License-Identifier: MIT
"""Tests saving: after any failure, the file is the complete old one or the complete new one."""

import os
import stat
import subprocess
import sys
import time

import pytest
import risorius
from conftest import GOLDEN

OLD = (GOLDEN / "tiny_v28.dna").read_bytes()


def python(script, *arguments, **options):
    return subprocess.run(
        [sys.executable, "-c", script, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=True,
        **options,
    )


def test_a_full_disk_leaves_the_old_file(tmp_path):
    path = tmp_path / "face.dna"
    path.write_bytes(OLD)
    # A limit of the file size simulates a full disk: writing fails in the middle of the file.
    script = (
        "import resource, signal, sys, risorius\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "dna = risorius.load(sys.argv[1]); dna.metadata = {'k': 'x' * 100000}\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50000, 50000))\n"
        "try:\n    dna.save(sys.argv[1])\nexcept risorius.DnaError as e:\n    print(e.code, e)\n"
    )
    done = python(script, path)
    assert done.stdout.startswith("io_write")
    assert "face.dna" in done.stdout
    assert path.read_bytes() == OLD
    assert os.listdir(tmp_path) == ["face.dna"]


def test_a_read_only_folder_leaves_the_old_file(tmp_path):
    path = tmp_path / "face.dna"
    path.write_bytes(OLD)
    tmp_path.chmod(0o555)
    # Root may write everywhere, so that the child process runs as the user nobody if possible.
    script = (
        "import os, sys, risorius\n"
        "dna = risorius.load(sys.argv[1]); dna.name = 'new'\n"
        "if os.getuid() == 0: os.setgid(65534); os.setuid(65534)\n"
        "try:\n    dna.save(sys.argv[1])\nexcept risorius.DnaError as e:\n    print(e.code, e)\n"
    )
    # The user nobody needs access to the folder.
    for folder in tmp_path.parents:
        if folder.stat().st_uid == os.getuid() and folder.name.startswith("pytest-"):
            folder.chmod(folder.stat().st_mode | 0o055)
    try:
        done = python(script, path)
    finally:
        tmp_path.chmod(0o755)
    assert done.stdout.startswith("io_write")
    assert "Permission denied" in done.stdout
    assert path.read_bytes() == OLD
    assert os.listdir(tmp_path) == ["face.dna"]


def test_a_kill_in_the_middle_leaves_one_whole_file(tmp_path):
    path = tmp_path / "face.dna"
    path.write_bytes(OLD)
    # The child process saves two files of 4 MB alternately under one name until it is killed.
    script = (
        "import sys, risorius\n"
        "faces = []\n"
        "for letter in 'ab':\n"
        "    dna = risorius.load(sys.argv[1]); dna.metadata = {'k': letter * 4000000}\n"
        "    faces.append(dna)\n"
        "print('ready', flush=True)\n"
        "while True:\n"
        "    for dna in faces: dna.save(sys.argv[1]); print('saved', flush=True)\n"
    )
    seen = set()
    for round_ in range(12):
        child = subprocess.Popen(
            [sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE, text=True
        )
        assert child.stdout.readline() == "ready\n"
        if round_ % 2:  # in every second round, after the first complete file
            assert child.stdout.readline() == "saved\n"
        time.sleep(0.005 + 0.011 * round_)
        child.kill()
        child.wait()
        child.stdout.close()
        dna = risorius.load(path)  # an incomplete file would raise an error
        assert len(dna.metadata.get("k", "")) in (0, 4000000)
        seen.add(dna.metadata.get("k", "-")[0])
    assert seen & {"a", "b"}


def test_an_error_in_the_value_touches_no_file(tmp_path):
    path = tmp_path / "face.dna"
    path.write_bytes(OLD)
    dna = risorius.load(path)
    dna.joint_parents = dna.joint_parents[:-1]
    with pytest.raises(risorius.DnaError):
        dna.save(path)
    with pytest.raises(risorius.DnaError):
        dna.save(tmp_path / "other.dna")
    assert path.read_bytes() == OLD
    assert os.listdir(tmp_path) == ["face.dna"]


@pytest.mark.skipif(os.name == "nt", reason="permissions are those of POSIX")
def test_permissions_and_links_stay(tmp_path):
    path, link = tmp_path / "face.dna", tmp_path / "link.dna"
    path.write_bytes(b"old")
    path.chmod(0o640)
    link.symlink_to(path)
    risorius.load(OLD).save(link)
    assert link.is_symlink()
    assert path.read_bytes() == OLD
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
