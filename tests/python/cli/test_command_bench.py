# SPDX-License-Identifier: MIT
"""Tests the command `risorius bench`, except for the times that it measures."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
import risorius
from risorius import cli
from risorius.cli import bench

MEDIUM = Path(__file__).parents[2] / "data" / "golden" / "medium.dna"


@pytest.fixture
def quick() -> None:
    if bench.program() is None:
        pytest.fail("rig_bench was not built with the wheel under test")


def number_of(text: str, name: str) -> float:
    line = next(line for line in text.splitlines() if line.startswith(name))
    return float(line[len(name) :].split()[0])


@pytest.mark.usefixtures("quick")
def test_the_table_has_every_row_that_was_asked_for(capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["bench", str(MEDIUM), "--quick"]) == 0
    text, errors = capfd.readouterr()
    assert "\r" not in text + errors  # progress is only shown on a terminal
    for word in ("us", "csr", "times csr", "active", "cold"):
        assert f"\n{word:<9}  " in text.partition("two cores:")[2], word  # its meaning
    for row in (
        "one face, 20 active",
        "one face, 60 active",
        "one face, all active",
        "float16, all active",
        "quaternions, 60 active",
        "LOD 4, 60 active",
        "cold, 60 active",
        "crowd of 64, 60 active",
        "clip of 1000, 60 active",
        "clip, two cores, 60 active",
        "streaming store of a pose",
        "no change",
        "compile",
    ):
        assert number_of(text, row.ljust(30)) > 0, row
    assert "commit " in text
    assert "in tight reads of the active columns" in text


@pytest.mark.usefixtures("quick")
def test_a_sweep_is_csv(capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["bench", str(MEDIUM), "--quick", "--sweep"]) == 0
    comment, header, *rows = capfd.readouterr().out.splitlines()
    assert comment.startswith("# ")
    assert header == "what,x,us,csr,read"
    whats = {row.split(",")[0] for row in rows}
    assert whats == {"active controls", "LOD", "joints", "faces", "cores"}
    assert all(float(row.split(",")[2]) > 0 for row in rows)


@pytest.mark.usefixtures("quick")
def test_frames_of_ones_own(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    raw = len(risorius.load(MEDIUM).raw_control_names)
    good = {name: np.ones((4, raw), np.float32) for name in bench.FRAMES}
    np.savez(tmp_path / "good.npz", **good)
    arguments = ["bench", str(MEDIUM), "--quick", "--frames"]
    assert cli.main([*arguments, str(tmp_path / "good.npz")]) == 0
    np.savez(tmp_path / "narrow.npz", **{**good, "active_60": np.ones((4, raw - 1), np.float32)})
    (tmp_path / "none.npz").write_bytes(b"nothing")
    for name, expected in (("narrow.npz", "active_60"), ("none.npz", ""), ("absent.npz", "absent")):
        capfd.readouterr()
        assert cli.main([*arguments, str(tmp_path / name)]) == 1
        captured = capfd.readouterr()
        assert captured.out == ""
        assert captured.err.startswith("risorius: ")
        assert expected in captured.err


@pytest.mark.usefixtures("quick")
def test_bad_files_are_sentences(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.dna").write_bytes(b"DNA?")
    assert cli.main(["bench", str(tmp_path / "bad.dna")]) == 1
    assert "bad.dna" in capfd.readouterr().err


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("layers", "part"),
    [("descriptor", "raw controls"), ("definition", "joint groups"), ("geometry", "joint groups")],
)
def test_a_face_that_does_nothing_is_a_sentence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], layers: str, part: str
) -> None:
    risorius.load(MEDIUM, layers=layers).save(tmp_path / "face.dna")
    assert cli.main(["bench", str(tmp_path / "face.dna"), "--quick"]) == 1
    out, error = capfd.readouterr()
    assert out == ""
    assert error == (
        f"rig_bench: {tmp_path / 'face.dna'}: a face with {part} was expected, found none\n"
    )


def test_without_the_program_it_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(bench.sysconfig, "get_path", lambda _: str(tmp_path))
    assert cli.main(["bench", str(MEDIUM)]) == 1
    assert "rig_bench" in capsys.readouterr().err


def test_no_wheel_holds_it() -> None:
    files = metadata.files("risorius")
    assert files
    assert [str(file) for file in files if file.stem == "rig_bench"] == []
