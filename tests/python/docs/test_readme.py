# SPDX-License-Identifier: MIT
"""Tests the commands in README.md: all are parsed, and the quick ones are run."""

import re
import shlex
import shutil
import subprocess

import numpy as np
import pytest
import risorius
from conftest import GOLDEN, PROJECT
from risorius import Clip, cli
from risorius.controls import arkit

SLOW = (
    "plot",
    "web",
    "edit",
    "speech",
    "live",
    "sample",
    "bench",
    "mix",
)  # only parsed here, because they are slow; other tests run them
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```", (PROJECT / "README.md").read_text(), re.M | re.S)


def lines():
    """Command lines in the README's shell blocks; lines of a here-document are one command."""
    out = []
    for kind, text in BLOCKS:
        if kind == "bash":
            whole = re.sub(r"(<< 'END'\n.*?^END)$", lambda m: m[1].replace("\n", "\0"), text,
                           flags=re.M | re.S)  # fmt: skip
            out += [line.replace("\0", "\n") for line in whole.splitlines() if line.strip()]
    return out


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder build/demo with the files that the demo makes."""
    place = tmp_path / "build" / "demo"
    place.mkdir(parents=True)
    dna = risorius.load(GOLDEN / "core.dna")
    smile = list(arkit.mapping()["mouthSmileLeft"])
    own = ["CTRL_expressions.jawOpen", *smile]
    dna.raw_control_names = [*own, *dna.raw_control_names[len(own) :]]
    dna.save(place / "sample.dna")
    shutil.copy(place / "sample.dna", place / "dense.dna")
    Clip(["CTRL_expressions.jawOpen"], [np.linspace(0, 1, 30)], 30.0).save(place / "speech.rzc")
    monkeypatch.chdir(place)
    monkeypatch.setenv("RISORIUS_CACHE", str(tmp_path / "cache"))
    return place


def command(line):
    """The arguments of a command line without its comment; None if it does not call risorius."""
    words = shlex.split(line.partition("<<")[0], comments=True)
    words = words[: words.index("||")] if "||" in words else words
    return words[1:] if words[0] == "risorius" else None


def test_every_kind_of_block_is_known():
    assert {kind for kind, _ in BLOCKS} == {"", "bash", "python"}
    used = {(command(line) or ["-"])[0] for line in lines()}
    every = {"info", "check", "convert", "eval", "sample", "plot", "bench", "edit", "mix", "clip",
             "speech", "live", "batch", "web", "export"}  # fmt: skip
    assert used - {"-"} == every


def test_every_command_parses_and_the_quick_ones_run(folder, capsys):
    for line in lines():
        words = command(line)
        if words is None:
            continue
        words = [w for word in words for w in (sorted(map(str, folder.glob(word)))
                 if "*" in word else [word])]  # fmt: skip
        cli.parse(words)
        if words[0] in SLOW:
            continue
        if words[0] == "batch":
            subprocess.run(["bash", "-e", "-c", jobs()], check=True)
        assert cli.main(words) == 0, line
    capsys.readouterr()
    assert {p.suffix for p in (folder / "baked").rglob("*.npz")} == {".npz"}
    assert len(list((folder / "baked").rglob("*.npz"))) == 2
    assert (folder / "take.npz").exists()


def jobs():
    return next(line for line in lines() if line.startswith("cat > jobs.toml"))


def test_what_else_is_typed_is_there(folder):
    others = [line for line in lines() if command(line) is None and "jobs.toml" not in line]
    assert [shlex.split(line)[0] for line in others] == ["source", "cd", "espeak-ng", "python"]
    assert shlex.split(others[1])[1] == str(folder.relative_to(folder.parents[1]))
    script = shlex.split(others[3], comments=True)[1]
    assert (PROJECT / "build" / "demo" / script).resolve().is_file()
    for kind, text in BLOCKS:
        if kind == "":
            for line in text.splitlines():
                assert (PROJECT / shlex.split(line, comments=True)[0]).is_file(), line


def test_the_python_block_runs(folder):
    (text,) = [text for kind, text in BLOCKS if kind == "python"]
    names = {}
    exec(compile(text, "README.md", "exec"), names)
    assert names["pose"].joints.shape[1] == 9
    assert names["clip"].joints.shape[0] == 100


def test_what_the_package_needs_is_not_asked_of_an_index():
    text = (PROJECT / "README.md").read_text()
    assert re.findall(r"pip install '?([^'`\s]+)", text) == [".[plot,speech,live,cluster]"]
