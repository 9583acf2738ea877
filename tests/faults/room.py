# SPDX-License-Identifier: MIT
"""Runs commands of `risorius` in temporary folders, and checks how they end."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import wave
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import risorius
from bombs import MiB
from conftest import GOLDEN
from risorius import importing
from risorius.files import fileio

CORE = GOLDEN / "core.dna"
# Code that runs the command line, and prints a line when it can be interrupted; before that, Python
# would handle signals itself. Like the program, it ignores interrupts after the work is done.
READY = """
import signal, sys, risorius.cli as c
print("ready", flush=True)
code = c.main(sys.argv[1:])
signal.signal(signal.SIGINT, signal.SIG_IGN)
sys.exit(code)
"""
CPU_SECONDS = 60
MOST_LINES = 12


@dataclass
class Done:
    """How a command ended: exit code, output, and largest memory use in bytes."""

    code: int
    out: str
    err: str
    peak: int = 0  # bytes


@dataclass
class Row:
    """The results of a trial.

    Attributes:
        runs: number of runs.
        faults: a sentence for each failure.
        not_run: why the trial did not run; "" if it ran.
    """

    group: str
    name: str
    runs: int = 0
    faults: list[str] = field(default_factory=list)
    not_run: str = ""

    def check(self, holds: bool, text: str) -> None:
        if not holds:
            self.faults.append(text)


def take(path: Path, frames: int = 60) -> Path:
    """Write a CSV with curves of core.dna's controls, made by a formula."""
    names = risorius.load(CORE).raw_control_names
    t = np.arange(frames) / 30.0
    curves = 0.5 + 0.5 * np.sin(np.outer(1 + np.arange(len(names)) % 5, t))
    clip = risorius.Clip(names, curves.astype(np.float32), 30.0)
    fileio.write_text(path, importing.csv_text(clip))
    return path


def voice(path: Path) -> Path:
    """Write a WAV file with a tone of one second."""
    t = np.arange(16000) / 16000.0
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, 16000, 0, "NONE", ""))
        file.writeframes((3000 * np.sin(800 * t)).astype("<i2").tobytes())
    return path


def jobs(folder: Path) -> Path:
    """Write a jobs.toml of two jobs, LOD 0 and 1 of the take; outputs are in folder / "out"."""
    path = folder / "jobs.toml"
    path.write_text(
        'output = "out"\n[[jobs]]\nclips = "*.csv"\n'
        f'characters = "{CORE}"\nlods = [0, 1]\nwrite = ["npz", "csv"]\n'
    )
    return path


# Name -> (suffix of the target, arguments). CORE, OUT, IN and VOICE are replaced by paths: a DNA
# file, the target, curves, a sound.
COMMANDS: dict[str, tuple[str, list[str]]] = {
    "convert": (".dna", ["convert", "CORE", "OUT"]),
    "convert json": (".json", ["convert", "CORE", "OUT"]),
    "edit regroup": (".dna", ["edit", "regroup", "CORE", "OUT", "--combinations", "0"]),
    "clip csv": (".csv", ["clip", "convert", "IN", "-o", "OUT"]),
    "clip json": (".json", ["clip", "convert", "IN", "-o", "OUT"]),
    "clip rzc": (".rzc", ["clip", "convert", "IN", "-o", "OUT"]),
    "eval npz": (".npz", ["eval", "IN", "CORE", "-o", "OUT"]),
    "eval csv": (".csv", ["eval", "IN", "CORE", "-o", "OUT"]),
    "export": (".glb", ["export", "CORE", "-o", "OUT", "--shapes", "all"]),
    "plot": (".html", ["plot", "CORE", "-o", "OUT", "--dpi", "40"]),
    "speech": (".rzc", ["speech", "VOICE", "-o", "OUT", "--text", "hum"]),
}
QUICK = ("convert", "clip csv", "eval npz")


@dataclass
class Room:
    """A folder with the inputs of commands, and a folder for their outputs."""

    inputs: Path
    outputs: Path

    @classmethod
    def make(cls, folder: Path) -> Room:
        room = cls(folder / "in", folder / "out")
        room.inputs.mkdir(parents=True)
        room.outputs.mkdir()
        take(room.inputs / "take.csv")
        voice(room.inputs / "voice.wav")
        return room

    def arguments(self, name: str) -> tuple[Path, list[str]]:
        suffix, words = COMMANDS[name]
        target = self.outputs / f"target{suffix}"
        known = {
            "CORE": CORE, "OUT": target, "IN": self.inputs / "take.csv",
            "VOICE": self.inputs / "voice.wav",
        }  # fmt: skip
        return target, [str(known.get(word, word)) for word in words]

    def contents(self) -> dict[str, bytes]:
        found = sorted(p for p in self.outputs.rglob("*") if p.is_file())
        return {str(p.relative_to(self.outputs)): p.read_bytes() for p in found}


def begin(
    arguments: Sequence[str], limit: Callable[[], None] | None = None
) -> subprocess.Popen[str]:
    """Start a command, and wait until it can be interrupted.

    limit: called in the child process before the command starts; None: nothing is called.
    """
    process = subprocess.Popen(
        [sys.executable, "-c", READY, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, start_new_session=True,
        preexec_fn=limit,  # noqa: PLW1509  no threads here
    )  # fmt: skip
    assert process.stdout is not None
    if process.stdout.readline() != "ready\n":
        raise RuntimeError(process.communicate()[1])
    return process


def finish(process: subprocess.Popen[str]) -> Done:
    out, err = process.communicate(timeout=10 * CPU_SECONDS)
    return Done(process.returncode, out, err)


def measured(arguments: Sequence[str], folder: Path) -> Done:
    """Run a command to its end, and measure its largest memory use; large limits stop it."""

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS))
        resource.setrlimit(resource.RLIMIT_AS, (6144 * MiB, 6144 * MiB))

    with open(folder / "out.log", "w+") as out, open(folder / "err.log", "w+") as err:
        process = subprocess.Popen(
            [sys.executable, "-m", "risorius", *arguments], stdout=out, stderr=err,
            preexec_fn=bounded,  # noqa: PLW1509  no threads here
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read())
    return Done(process.returncode, texts[0], texts[1], usage.ru_maxrss * 1024)


def complaints(done: Done, codes: Sequence[int]) -> list[str]:
    """Sentences about a wrong end of a command: exit code, traceback, no or too much text."""
    lines = done.err.strip().splitlines()
    out = []
    if done.code not in codes:
        last = lines[-1][:200] if lines else "no word"
        out.append(f"exit code {done.code}, one of {list(codes)} was expected: {last}")
    if "Traceback" in done.err or "Traceback" in done.out:
        out.append(f"a traceback: {lines[-1][:200]}")
    if len(lines) > MOST_LINES:
        out.append(f"{len(lines)} lines of errors")
    if done.code in (1, 2, 130) and "risorius" not in done.err and not done.out:
        out.append(f"exit code {done.code} without a sentence")
    return out
