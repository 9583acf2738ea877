# SPDX-License-Identifier: MIT
"""Tests the command line under faults. packaging/check/faults.sh runs this file.

The faults are bombs, flipped bits, kills, interrupts, full disks, read-only folders, parallel
processes, and mutated inputs of all commands. Each trial prints a row with its group, its name, the
number of runs and the failures.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "python"), str(HERE.parent / "python" / "support")]

from bombs import BOMBS, MiB  # noqa: E402
from mutants_of_inputs import trials  # noqa: E402
from risorius import importing  # noqa: E402
from room import (  # noqa: E402
    COMMANDS,
    CORE,
    Done,
    Room,
    Row,
    begin,
    complaints,
    finish,
    jobs,
    measured,
    take,
)  # fmt: skip

START_MEMORY = 200 * MiB  # memory of Python, NumPy and the package with a small file
MEMORY_PER_BYTE = 40


def bombs(_rounds: int, names: Sequence[str] = ()) -> Iterator[Row]:
    """Small files that demand much give a result or one error sentence within limits."""
    for name, make, words in BOMBS:
        if names and name not in names:
            continue
        with tempfile.TemporaryDirectory() as text:
            folder = Path(text)
            make(folder / name)
            known = {"FILE": str(folder / name), "CORE": str(CORE)}
            arguments = [
                str(folder / word) if word.startswith("OUT") else known.get(word, word)
                for word in words
            ]
            done = measured(arguments, folder)
            size = (folder / name).stat().st_size
            row = Row("bomb", name, 1, complaints(done, (0, 1)))
            allowed = START_MEMORY + MEMORY_PER_BYTE * size
            row.check(
                done.peak <= allowed,
                f"{done.peak / MiB:.0f} MiB for {size / MiB:.2f}, {allowed / MiB:.0f} were allowed",
            )
            yield row


FLIPS = """
import pathlib, random, sys
import numpy as np
import risorius
kind, source, folder, seed, count = sys.argv[1:]
folder, draw, rounds = pathlib.Path(folder), random.Random(int(seed)), int(count)
good = pathlib.Path(source).read_bytes()

def evaluated(rig):
    raw = np.linspace(0, 1, len(rig.raw_control_names), dtype=np.float32)
    pose = rig.evaluate(raw)
    return pose.joints.tobytes() + pose.blend_shapes.tobytes() + pose.animated_maps.tobytes()

def flipped(data):
    data = bytearray(data)
    for _ in range(draw.choice((1, 1, 1, 4))):
        data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    return bytes(data)

if kind == "cache":
    want = evaluated(risorius.compile_cached(source, folder))
    (file,) = folder.glob("*.rig")
    block = file.read_bytes()
for i in range(rounds):
    try:
        if kind == "dna":
            evaluated(risorius.Rig(risorius.load(flipped(good))))
        elif kind == "clip":
            clip = risorius.ClipReader(flipped(good))
            clip.read()
        else:
            file.write_bytes(flipped(block))
            if evaluated(risorius.compile_cached(source, folder)) != want:
                print("other poses after flip", i)
            if file.read_bytes() != block:
                print("not rebuilt after flip", i)
    except (risorius.DnaError, risorius.ClipError):
        pass
print("done")
"""


def flips(rounds: int) -> Iterator[Row]:
    """DNA files and clips with changed bits must be read, or give an error of Risorius.

    A cached rig with changed bits must give the right poses, and must be built again.
    """
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        clip = folder / "take.rzc"
        importing.import_file(take(folder / "take.csv"))[0].save(clip)
        for kind, source in (("dna", CORE), ("clip", clip), ("cache", CORE)):
            (folder / kind).mkdir()
            arguments = [kind, str(source), str(folder / kind), "3", str(20 * rounds)]
            done = subprocess.run(
                [sys.executable, "-c", FLIPS, *arguments], capture_output=True, text=True,
                check=False,
            )  # fmt: skip
            row = Row("flip", kind, 20 * rounds)
            row.check(done.returncode == 0, f"exit code {done.returncode}: {done.stderr[-200:]}")
            row.check(done.stdout in ("done\n", ""), done.stdout[:200])
            yield row


def _wait(process: subprocess.Popen[str], room: Room, draw: random.Random, longest: float) -> None:
    """Wait for a random time, or until a temporary file shows that the command is writing.

    Args:
        process: the running command.
        room: its folders.
        draw: random numbers.
        longest: upper bound of the random time in seconds.
    """
    end = time.monotonic() + draw.uniform(0.0, longest)
    if draw.random() < 0.5:
        end = time.monotonic() + 60.0
    while time.monotonic() < end and process.poll() is None:
        if end - time.monotonic() > longest and any(
            name.startswith(".risorius") for name in os.listdir(room.outputs)
        ):
            return
        time.sleep(0.0005)


def _signalled(
    group: str, what: signal.Signals, rounds: int, names: Sequence[str]
) -> Iterator[Row]:
    """Send a signal at random moments; the output file must then be the complete old or new one.

    Args:
        group: name of the group of rows.
        what: the signal.
        rounds: runs of each command.
        names: keys of COMMANDS; empty: all.
    """
    draw = random.Random(20)
    for name in names or COMMANDS:
        with tempfile.TemporaryDirectory() as text:
            room = Room.make(Path(text))
            target, words = room.arguments(name)
            row = Row(group, name)
            began = time.monotonic()
            clean = finish(begin(words))
            longest = time.monotonic() - began
            if clean.code != 0:
                row.not_run = clean.err.strip().splitlines()[-1][:80]
                yield row
                continue
            new = room.contents()[target.name]
            for _ in range(rounds):
                target.write_bytes(b"old")
                process = begin(words)
                _wait(process, room, draw, longest)
                with contextlib.suppress(ProcessLookupError):  # it has ended by itself
                    os.killpg(process.pid, what)
                done = finish(process)
                row.runs += 1
                row.check(target.read_bytes() in (b"old", new), "half a file")
                if what == signal.SIGINT:
                    row.faults += _interrupted(done)
                    row.check(list(room.contents()) == [target.name], "something is left")
            row.check(finish(begin(words)).code == 0, "the same command fails afterwards")
            row.check(room.contents() == {target.name: new}, f"left: {list(room.contents())}")
            yield row


def _interrupted(done: Done) -> list[str]:
    """Sentences about faults in the way in which an interrupted command ended.

    A command that has already printed its result may end by the signal, because Python ignores its
    handler while it exits.
    """
    leaving = done.code == -signal.SIGINT and done.out and not done.err
    return [] if leaving else complaints(done, (0, 130))


def kills(rounds: int, names: Sequence[str] = ()) -> Iterator[Row]:
    """After kill -9, no output file is incomplete, and the next run removes temporary files."""
    yield from _signalled("kill", signal.SIGKILL, rounds, names)


def interrupts(rounds: int, names: Sequence[str] = ()) -> Iterator[Row]:
    """Ctrl-C gives a sentence and exit code 130, and leaves only the old or the new file."""
    yield from _signalled("interrupt", signal.SIGINT, rounds, names)
    if not names:
        yield from _printing(rounds)


def _printing(rounds: int) -> Iterator[Row]:
    """Interrupt commands that write no file at random moments."""
    draw = random.Random(5)
    for words in (["bench", str(CORE)], ["info", str(CORE)], ["live", "--seconds", "5"]):
        row = Row("interrupt", words[0])
        for _ in range(rounds):
            process = begin(words)
            time.sleep(draw.uniform(0.0, 0.3))
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGINT)
            row.runs += 1
            row.faults += _interrupted(finish(process))
        yield row


def _refused(row: Row, room: Room, target: Path, done: Done, named: str) -> None:
    """Check that a command failed with a sentence that names the target, and changed no file."""
    row.runs += 1
    row.faults += complaints(done, (1,))
    # Matplotlib prints an additional line if it cannot write its font cache.
    lines = [line for line in done.err.splitlines() if "font_manager" not in line]
    said = "\n".join(lines)[-150:]
    row.check(named in said, f"{named} is not named: {said}")
    row.check(".risorius-" not in said, f"a hidden name: {said}")
    row.check("[Errno" not in said, f"a number of the system's: {said}")
    found = {name: len(data) for name, data in room.contents().items() if name != "filler"}
    row.check(found == {target.name: 3}, f"the old file alone was expected, found {found}")


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))


@contextlib.contextmanager
def small_disk(folder: Path, size: str) -> Iterator[bool]:
    """Mount a small disk at a folder, with a size such as 64k. Yields whether this succeeded."""
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    try:
        made = subprocess.run(command, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        made = False
    try:
        yield made
    finally:
        if made:
            subprocess.run(["umount", "-l", str(folder)], check=False)


def _fill(disk: Path) -> bool:
    with contextlib.suppress(OSError), open(disk / "filler", "wb") as file:
        file.write(bytes(64 * 1024))
    return True


def _forbid(disk: Path) -> bool:
    again = ["mount", "-o", "remount,ro", str(disk)]
    return subprocess.run(again, check=False).returncode == 0


def _on_a_disk(kind: str, name: str, spoil: Callable[[Path], bool]) -> Row:
    """Run a command whose target is on a small separate disk that refuses writing.

    Args:
        kind: group of the trial in its row.
        name: name of the command, key of COMMANDS.
        spoil: makes the disk refuse writing; gets its folder; returns False if it cannot.

    Returns:
        The trial's row; NOT RUN if no disk can be mounted.
    """
    row = Row(kind, name)
    with tempfile.TemporaryDirectory() as text:
        room = Room.make(Path(text))
        target, words = room.arguments(name)
        with small_disk(room.outputs, "64k") as made:
            target.write_bytes(b"old")
            if made and spoil(room.outputs):
                _refused(row, room, target, finish(begin(words)), target.name)
            else:
                row.not_run = "no disk can be mounted here"
    return row


def disks(_rounds: int, names: Sequence[str] = ()) -> Iterator[Row]:
    """A full disk gives a sentence that names the file, and leaves only the complete old file."""
    for name in names or COMMANDS:
        with tempfile.TemporaryDirectory() as text:
            room = Room.make(Path(text))
            target, words = room.arguments(name)
            row = Row("full disk", name)
            target.write_bytes(b"old")
            _refused(row, room, target, finish(begin(words, _limited)), target.name)
            yield row
    if names:
        return
    for name in COMMANDS:
        yield _on_a_disk("full tmpfs", name, _fill)
    for words in (["info", str(CORE)], ["check", str(CORE)], ["eval", str(CORE)],
                  ["convert", str(CORE), "-", "--to", "dna"]):  # fmt: skip
        row = Row("full /dev/full", words[0], 1)
        with open("/dev/full", "w") as full:
            done = subprocess.run(
                [sys.executable, "-m", "risorius", *words], stdout=full, stderr=subprocess.PIPE,
                text=True, check=False,
            )  # fmt: skip
        row.faults += complaints(Done(done.returncode, "", done.stderr), (1,))
        yield row


def folders(_rounds: int, names: Sequence[str] = ()) -> Iterator[Row]:
    """If a folder is missing or read-only, a sentence says so before the input is read."""
    for name in names or COMMANDS:
        with tempfile.TemporaryDirectory() as text:
            room = Room.make(Path(text))
            target, words = room.arguments(name)
            row = Row("missing folder", name)
            if name.startswith("eval"):
                (room.outputs / "none").write_text("")  # eval makes folders, so a file blocks it
            words = [
                str(room.outputs / "none" / target.name) if word == str(target) else word
                for word in words
            ]
            for i, word in enumerate(words):
                if word in (str(CORE), str(room.inputs / "voice.wav")):
                    words[i] = str(room.inputs / f"bad{Path(word).suffix}")
                    Path(words[i]).write_bytes(b"nothing of the kind")
            target.write_bytes(b"old")
            done = finish(begin(words))
            (room.outputs / "none").unlink(missing_ok=True)
            _refused(row, room, target, done, f"none/{target.name}")
            yield row
    if names:
        return
    for name in COMMANDS:
        yield _on_a_disk("read-only folder", name, _forbid)


def pairs(rounds: int, names: Sequence[str] = ()) -> Iterator[Row]:
    """Processes that run at once and write the same files must all succeed, with equal results."""
    for name in names or COMMANDS:
        with tempfile.TemporaryDirectory() as text:
            room = Room.make(Path(text))
            words = room.arguments(name)[1]
            row = Row("at once", name)
            clean = finish(begin(words))
            if clean.code != 0:
                row.not_run = clean.err.strip().splitlines()[-1][:80]
                yield row
                continue
            want = room.contents()
            for _ in range(max(1, rounds // 5)):
                for done in [finish(p) for p in [begin(words) for _ in range(3)]]:
                    row.runs += 1
                    row.faults += complaints(done, (0,))
                row.check(room.contents() == want, f"left: {list(room.contents())}")
            yield row
    if not names or "batch" in names:
        yield _batches(max(1, rounds // 5))


def _batches(rounds: int) -> Row:
    """Two batches in one folder: one works; the other reports that the first runs, or waits."""
    row = Row("at once", "batch")
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as text:
            room = Room.make(Path(text))
            words = ["batch", str(jobs(room.inputs)), "--workers", "1"]
            ended = [finish(p) for p in [begin(words) for _ in range(2)]]
            row.runs += 2
            for done in ended:
                row.faults += complaints(done, (0, 1))
                row.check(done.code == 0 or "works in this folder" in done.err, done.err[-200:])
            row.check(any(done.code == 0 for done in ended), "none of them did it")
            found = sorted(p.name for p in (room.inputs / "out").rglob("*") if p.is_file())
            row.check(
                found == [".jobs.journal", "summary.csv", "summary.json"] + ["take.csv"] * 2
                + ["take.npz"] * 2, f"left: {found}",
            )  # fmt: skip
    return row


def mutations(rounds: int, names: Sequence[str] = (), seed: int | None = None) -> Iterator[Row]:
    """Mutated inputs, new in each run, give a result or an error sentence within all limits."""
    drawn = random.SystemRandom().randrange(1 << 32) if seed is None else seed
    print(f"mutations: --seed {drawn} repeats them", flush=True)
    yield from trials(5 * rounds, drawn, tuple(names))


Group = Callable[[int], Iterator[Row]]
GROUPS: dict[str, Group] = {
    "bombs": bombs, "flips": flips, "kills": kills, "interrupts": interrupts, "disks": disks,
    "folders": folders, "pairs": pairs, "mutations": mutations,
}  # fmt: skip


def line(row: Row) -> str:
    """A trial's results as a line: "kill       convert       30 runs  0 faults"."""
    what = f"{row.runs:5} runs {len(row.faults):4} faults"
    if row.not_run:
        what = f"NOT RUN: {row.not_run}"
    first = f"  {row.faults[0]}" if row.faults else ""
    return f"{row.group:<17} {row.name:<20} {what}{first}"


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("groups", nargs="*", choices=[*GROUPS, []], help="default: all")
    parser.add_argument("--rounds", type=int, default=20, help="of each kill and interrupt (20)")
    parser.add_argument("--seed", type=int, help="of the mutations (default: another each time)")
    args = parser.parse_args()
    groups = {**GROUPS, "mutations": partial(mutations, seed=args.seed)}
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        count = 0
        for name in args.groups or GROUPS:
            for row in groups[name](args.rounds):
                print(line(row), flush=True)
                count += len(row.faults)
    print(f"{count} faults")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main())
