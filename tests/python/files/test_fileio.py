# SPDX-License-Identifier: MIT
"""Tests atomic writing: the state of files after each kind of failure."""

import contextlib
import errno
import os
import signal
import stat
import subprocess
import sys
import textwrap

import limits
import pytest
from conftest import no_room
from risorius.files import fileio

posix = pytest.mark.skipif(os.name == "nt", reason="of POSIX")


def run(code, *arguments, **options):
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)]
    return limits.run(command, 60, **options)


def test_nothing_is_seen_before_it_is_whole(tmp_path):
    path = tmp_path / "a"
    path.write_text("old")
    with fileio.replacing(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert os.listdir(tmp_path) == ["a"]


def test_after_an_exception_the_old_file_stays_and_nothing_else(tmp_path):
    path = tmp_path / "a"
    path.write_text("old")
    with contextlib.suppress(KeyboardInterrupt), fileio.replacing(path) as file:
        file.write(b"new")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a"]


def test_a_users_files_of_like_names_stay(tmp_path):
    names = ["a.part", ".a.01234567.part", "a.tmp", ".risorius-1-2.part"]
    for name in names:
        (tmp_path / name).write_text(name)
    fileio.write_text(tmp_path / "a", "new")
    assert sorted(os.listdir(tmp_path)) == sorted([*names, "a"])
    assert all((tmp_path / name).read_text() == name for name in names)


@posix
@pytest.mark.parametrize("size", [10, 100_000], ids=["at the end", "in the middle"])
def test_without_room_the_old_file_stays_and_the_error_names_it(size, tmp_path):
    path = tmp_path / "a"
    path.write_text("old")
    with no_room(5), pytest.raises(OSError, match=os.strerror(errno.EFBIG)) as caught:
        fileio.write_bytes(path, b"x" * size)
    assert caught.value.filename == str(path)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a"]


@posix
def test_files_that_belong_together_are_written_all_or_none(tmp_path):
    files = {
        tmp_path / "a": b"a" * 10,
        tmp_path / "new" / "er" / "b": b"b" * 100,
        tmp_path / "c": b"c",
    }
    (tmp_path / "c").write_text("old")
    with no_room(50), pytest.raises(OSError, match="new/er/b"):
        fileio.write_all(files)
    assert os.listdir(tmp_path) == ["c"]
    assert (tmp_path / "c").read_text() == "old"
    fileio.write_all(files)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == files


@posix
def test_a_full_device_is_an_error_of_that_name():
    with pytest.raises(OSError, match="/dev/full") as caught:
        fileio.write_bytes("/dev/full", b"x")
    assert caught.value.errno == errno.ENOSPC
    fileio.check_writable("/dev/full")
    assert stat.S_ISCHR(os.stat("/dev/full").st_mode)


@posix
def test_what_a_killed_writer_left_goes_with_the_next_one_and_a_live_ones_stays(tmp_path):
    code = """
        import os, signal, sys
        from risorius.files import fileio
        with fileio.replacing(sys.argv[1]) as file:
            file.write(b"half")
            file.flush()
            os.kill(os.getpid(), signal.SIGKILL)
        """
    with fileio.replacing(tmp_path / "live") as file:
        (mine,) = os.listdir(tmp_path)
        assert run(code, tmp_path / "a").returncode == -signal.SIGKILL
        assert len(os.listdir(tmp_path)) == 2
        fileio.write_bytes(tmp_path / "b", b"b")
        assert sorted(os.listdir(tmp_path)) == [mine, "b"]
        file.write(b"live")
    assert (tmp_path / "live").read_bytes() == b"live"


def _staged(target, files):
    """Write files beside a target with `staging`, as an external program would.

    Args:
        target: path of the file that `staging` puts into its place.
        files: path relative to the staging folder -> text. Without the target's name, the program
            fails with RuntimeError.
    """
    with fileio.staging(target) as made:
        for name, data in files.items():
            path = made.with_name(name) if "/" not in name else made.parent / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(data)
        if target.name not in files:
            raise RuntimeError("no room")


def test_what_another_writer_makes_takes_its_place_when_it_is_whole(tmp_path):
    target = tmp_path / "a.abc"
    old = {"a.abc": "old", "textures/skin": "old", "textures/mine": "mine"}
    (tmp_path / "textures").mkdir()
    for name, data in old.items():
        (tmp_path / name).write_text(data)

    def found():
        return {
            p.relative_to(tmp_path).as_posix(): p.read_text()
            for p in tmp_path.rglob("*")
            if p.is_file()
        }

    with pytest.raises(RuntimeError, match="no room"):
        _staged(target, {"textures/skin": "half"})
    with pytest.raises(FileNotFoundError, match="nothing was written"), fileio.staging(target):
        pass
    assert found() == old
    _staged(target, {"a.abc": "new", "textures/skin": "new", "more/b": "b"})
    assert found() == {**old, "a.abc": "new", "textures/skin": "new", "more/b": "b"}
    with pytest.raises(FileNotFoundError, match="its folder is not there"):
        _staged(tmp_path / "none" / "a", {})
    assert sorted(os.listdir(tmp_path)) == ["a.abc", "more", "textures"]


@posix
def test_what_a_killed_process_staged_goes_also_where_nobody_waits_for_its_end(tmp_path):
    code = """
        import os, signal, sys
        from risorius.files import fileio
        with fileio.staging(sys.argv[1]) as made:
            made.write_text("half")
            made.with_name("textures").mkdir()
            os.kill(os.getpid(), signal.SIGKILL)
        """
    program = [sys.executable, "-c", textwrap.dedent(code), str(tmp_path / "a")]
    with subprocess.Popen(program) as process:  # dead, but not waited for
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert len(os.listdir(tmp_path)) == 1
        fileio.write_bytes(tmp_path / "b", b"b")
        left = os.listdir(tmp_path)
        assert process.wait() == -signal.SIGKILL
    assert left == ["b"] or sys.platform != "linux"
    fileio.write_bytes(tmp_path / "b", b"b")
    assert os.listdir(tmp_path) == ["b"]


@posix
def test_rights_and_links_stay_and_the_mask_is_the_systems(tmp_path):
    path, link = tmp_path / "a", tmp_path / "link"
    done = run(
        "import os, sys; os.umask(0o027)\n"
        "from risorius.files import fileio; fileio.write_text(sys.argv[1], 'new')",
        path,
    )
    assert done.returncode == 0, done.stderr
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    path.chmod(0o604)
    link.symlink_to("a")
    _staged(path, {"a": "staged"})
    assert stat.S_IMODE(path.stat().st_mode) == 0o604
    _staged(link, {"link": "staged"})
    assert (link.is_symlink(), path.read_text()) == (True, "staged")
    fileio.write_text(link, "newer\n")
    assert link.is_symlink()
    assert path.read_bytes() == b"newer\n"
    assert stat.S_IMODE(path.stat().st_mode) == 0o604


@posix
def test_names_as_long_as_the_system_takes_them(tmp_path):
    for name in ("n" * 245, "n" * 250, "n" * 255, "\N{LATIN SMALL LETTER E WITH ACUTE}" * 125):
        fileio.write_text(tmp_path / name, name)
        assert (tmp_path / name).read_text(encoding="utf-8") == name


@pytest.mark.parametrize("do", [lambda p: fileio.write_text(p, ""), fileio.check_writable])
def test_a_place_that_is_none_is_named_as_the_user_named_it(do, tmp_path):
    path = tmp_path / "none" / "a"
    with pytest.raises(FileNotFoundError) as caught:
        do(path)
    assert (caught.value.filename, caught.value.strerror) == (
        str(path),
        "its folder is not there",
    )
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="a file stands where its folder should be"):
        do(tmp_path / "file" / "a")
    with pytest.raises(IsADirectoryError):
        do(tmp_path)
    assert os.listdir(tmp_path) == ["file"]


def test_folders_that_will_be_made_are_looked_for_where_they_will_be(tmp_path):
    fileio.check_writable(tmp_path / "x" / "y" / "a", parents=True)
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError) as caught:
        fileio.check_writable(tmp_path / "file" / "y" / "a", parents=True)
    assert caught.value.filename == str(tmp_path / "file" / "y" / "a")
    assert os.listdir(tmp_path) == ["file"]


@posix
def test_a_folder_that_may_not_be_written_is_known_before(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "a").write_text("old")
    # Root may write everywhere, so that the child process runs as the user nobody if possible.
    for above in tmp_path.parents:
        if above.stat().st_uid == os.getuid() and above.name.startswith("pytest-"):
            above.chmod(above.stat().st_mode | 0o055)
    tmp_path.chmod(0o755)
    folder.chmod(0o555)
    done = run(
        """
        import os, sys
        from risorius.files import fileio
        if os.getuid() == 0: os.setgid(65534); os.setuid(65534)
        for name in ("a", "b/c"):
            try:
                fileio.check_writable(os.path.join(sys.argv[1], name), parents=True)
            except PermissionError as error:
                print(error.filename)
        """,
        folder,
    )
    assert done.stdout.split() == [f"{folder}/a", f"{folder}/b/c"], done.stderr
    assert os.listdir(folder) == ["a"]
