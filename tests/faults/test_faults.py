# SPDX-License-Identifier: MIT
"""Tests a short part of packaging/check/faults.sh, and that it detects planted faults."""

import os
import subprocess
import sys

import faults
import mutants_of_inputs
import pytest
import room
from conftest import PROJECT

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals and limits are those of POSIX")


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def none_of(rows):
    found = list(rows)
    assert found
    assert [faults.line(row) for row in found if row.faults] == []
    assert all(row.runs for row in found)


def test_bombs():
    none_of(faults.bombs(1, ["gap.csv", "laughs.xml", "graph.dna", "deep_mapping.toml"]))


def test_flips():
    none_of(faults.flips(2))


@pytest.mark.parametrize("group", [faults.kills, faults.interrupts])
def test_signals(group):
    none_of(group(1, ["clip csv"]))


def test_no_room():
    none_of(faults.disks(1, ["clip rzc"]))


def test_no_folder():
    none_of(faults.folders(1, ["edit regroup"]))


def test_several_at_once():
    none_of(faults.pairs(1, ["convert"]))


def test_mutations():
    none_of(faults.mutations(1, mutants_of_inputs.QUICK, seed=50))


def test_mutants_are_told_by_their_seed(tmp_path):
    inputs = mutants_of_inputs.make_inputs(tmp_path)
    for name in mutants_of_inputs.TRIALS:
        first, second, other = (
            mutants_of_inputs.Round(inputs, name, key) for key in ("1", "1", "2")
        )
        assert (first.files, first.words) == (second.files, second.words)
        assert (first.files, first.words) != (other.files, other.words)


@pytest.mark.parametrize(
    ("fault", "seen"),
    [
        ("raise KeyError('mine')", "a traceback: KeyError: 'mine'"),
        ("os.kill(os.getpid(), 11)", "ended by SIGSEGV"),
        ("sys.exit(3)", "exit code 3"),
        ("open('half', 'w'); raise OSError(5, 'bad', 'x')", "left ['half']"),
        ("b'x' * (400 << 20)", "were allowed"),
        ("import warnings; warnings.warn('odd', RuntimeWarning)", "a warning of Python's"),
        ("os.write(1, b''); raise MemoryError", "all memory was asked for"),
    ],
)
def test_a_planted_fault_is_seen_by_mutations(fault, seen, monkeypatch):
    def run(args):
        exec(fault, {"os": os, "sys": sys})
        return 0

    monkeypatch.setattr("risorius.cli.info.run", run)
    row = mutants_of_inputs.rounds_of("info", 1, 2)
    assert row.runs == 2
    assert seen in "; ".join(row.faults)


def planted(monkeypatch, code):
    """Let every command run this code instead."""
    text = "import os, sys; print('ready', flush=True); " + code
    monkeypatch.setattr(room, "READY", text)


# Code that leaves a temporary file, and replaces an old file by half of a new one.
WRITE = (
    "import time; p = sys.argv[-1]; old = os.path.exists(p) and open(p).read() == 'old'; "
    "open(os.path.dirname(p) + '/.risorius-x', 'w'); open(p, 'w').write('ne' if old else 'new'); "
)


def faults_of(rows):
    return "; ".join(fault for row in rows for fault in row.faults)


@pytest.mark.parametrize(
    ("group", "code", "seen"),
    [
        ("disks", "open(sys.argv[-1], 'w').write('half'); sys.exit(1)", "the old file alone"),
        ("disks", "sys.exit('risorius: no room')", "is not named"),
        ("disks", "sys.exit('risorius: ' + sys.argv[-1] + '2')", ""),
        ("disks", "raise OSError('target.csv')", "a traceback"),
        ("disks", "os.kill(os.getpid(), 11)", "exit code -11"),
        ("folders", "sys.exit('risorius: .risorius-1-2.part')", "a hidden name"),
        ("interrupts", WRITE + "time.sleep(60 * old)", "a traceback"),
        ("kills", WRITE + "time.sleep(60 * old)", "left"),
        ("pairs", "open(sys.argv[-1] + str(os.getpid()), 'w').write('new')", "left"),
    ],
)
def test_a_planted_fault_is_seen(group, code, seen, monkeypatch):
    planted(monkeypatch, code)
    found = faults_of(faults.GROUPS[group](1, ["clip csv"]))
    assert (seen in found) if seen else not found


def test_a_planted_bomb_is_seen(monkeypatch, tmp_path):
    monkeypatch.setattr(faults, "START_MEMORY", 0)
    assert "were allowed" in faults_of(faults.bombs(1, ["gap.csv"]))


def test_the_command_fails_with_a_fault_and_lists_what_did_not_run(monkeypatch, capsys):
    rows = [room.Row("a", "b", 1, ["broken"]), room.Row("c", "d", not_run="no disk")]
    monkeypatch.setattr(faults, "GROUPS", {"bombs": lambda rounds: iter(rows)})
    monkeypatch.setattr(sys, "argv", ["faults.py"])
    assert faults.main() == 1
    out = capsys.readouterr().out
    assert "broken" in out
    assert "NOT RUN: no disk" in out
    assert "1 faults" in out
    rows.pop(0)
    assert faults.main() == 0


def test_the_command_is_there():
    done = subprocess.run(
        [PROJECT / "packaging" / "check" / "faults.sh", "--help"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "bombs" in done.stdout
