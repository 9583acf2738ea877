# SPDX-License-Identifier: MIT
"""Tests that commands print names from files without control sequences of the terminal."""

import io
import json
import sys

import command_line
import pytest
import risorius
from conftest import GOLDEN
from risorius.cli import main, terminal

EVIL = "\x1b[2J\x1b]0;title\x07\x9b31m\u202egnp.exe\r"
SPELLED = "\\x1b[2J\\x1b]0;title\\x07\\x9b31m\\u202egnp.exe\\x0d"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a face, a clip, a table and a mapping whose names contain escape sequences."""
    folder = tmp_path_factory.mktemp("evil")
    facts = json.loads(risorius.load(GOLDEN / "core.dna").to_json())

    def renamed(value):
        if isinstance(value, dict):
            return {key: renamed(inner) for key, inner in value.items()}
        if isinstance(value, list):
            texts = all(isinstance(item, str) for item in value)
            if texts:
                return [f"{item}{EVIL}{number}" for number, item in enumerate(value)]
            return [renamed(inner) for inner in value]
        return value

    facts = renamed(facts)
    facts["desc1.1"]["name"] = EVIL
    dna = risorius.Dna.from_json(json.dumps(facts))
    dna.metadata = {EVIL: EVIL}
    dna.save(folder / "face.dna")
    risorius.Clip([EVIL], [[0, 1]], 30.0, metadata={EVIL: EVIL}).save(folder / "clip.rzc")
    (folder / "take.json").write_text(json.dumps({EVIL: [0, 1], "fps": 30}))
    (folder / "map.toml").write_text(f"[rows]\n{json.dumps(EVIL)} = {{ {json.dumps(EVIL)} = 1 }}")
    (folder / "bad.toml").write_text(f"{json.dumps(EVIL)} = 1")
    return folder


COMMANDS = [
    "info face.dna",
    "info --diff {core} face.dna",
    "check face.dna {core} --mix",
    "eval face.dna --explain",
    "clip info clip.rzc",
    "clip info take.json",
    "clip convert take.json -o out.csv --mapping map.toml --report",
    "clip check map.toml --rig {core}",
    "clip check bad.toml --rig {core}",
    "author bad.toml -o out.dna",
    "sample build out.dna --person bad.toml",
    "batch bad.toml",
    f"info {EVIL}",
    f"info face.dna {EVIL}",
    f"eval face.dna --lod {EVIL}",
]


@pytest.mark.parametrize("words", COMMANDS)
def test_a_name_gives_a_terminal_no_orders(words, folder, monkeypatch):
    monkeypatch.chdir(folder)
    done = command_line.run(*words.format(core=GOLDEN / "core.dna").split(" "), text=True)
    said = done.stdout + done.stderr
    assert "\\x" in said
    assert not [letter for letter in said if ord(letter) < 32 and letter not in "\n\t"]
    assert not {"\x9b", "\u202e"} & set(said)


def test_everything_else_is_printed_as_it_is():
    assert terminal.spelled(EVIL) == SPELLED
    same = "name\t\u00e4\u4e2d\U0001f600 \u0301\n"
    assert terminal.spelled(same) == same


def test_progress_may_return_to_the_line_s_beginning(monkeypatch):
    out, error = io.StringIO(), io.StringIO()
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", error)
    with terminal.obeyed_by_nobody():
        print("\rname")
        print("\r50 % \rname", end="", file=sys.stderr)
    print("\r after")
    assert out.getvalue() == "\\x0dname\n\r after\n"
    assert error.getvalue() == "\r50 % \\x0dname"


def test_bytes_to_the_standard_output_stay_bytes(capfdbinary):
    core = GOLDEN / "core.dna"
    assert main(["convert", str(core), "-", "--to", "dna"]) == 0
    assert capfdbinary.readouterr().out == core.read_bytes()
