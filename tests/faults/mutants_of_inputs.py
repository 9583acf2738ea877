# SPDX-License-Identifier: MIT
"""Runs all commands with small random faults in their input files or arguments.

In JSON, TOML and tables, a value is replaced, or a part is removed or duplicated. In binary files,
bytes change. Sometimes a word of the command line is replaced instead. Each command must end with a
result or an error sentence within limits of time and memory. A failed command must leave no file.
"""

from __future__ import annotations

import contextlib
import faulthandler
import io
import json
import math
import os
import random
import resource
import shutil
import signal
import struct
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any
from unittest import mock

import command_line
import numpy as np
import risorius
from bombs import MiB
from risorius.cli.pages import web as web_command
from risorius.web import page as web_page
from room import Done, Row, complaints
from valid_inputs import make_inputs

CPU_SECONDS = 20  # limit of CPU time of a round
MEMORY = 300 * MiB  # limit for small files, in bytes
MEMORY_PER_BYTE = 40
_PAGE = "<html><!--FACE--></html>"

HUGE = 10**400
ODD: tuple[Any, ...] = (
    math.nan, math.inf, -math.inf, -1, 0, 1, -0.0, 0.5, 1e38, -1e38, 1e39, 1e-300, 1e308, HUGE,
    -HUGE, 2**31, 2**32, 2**53, 2**63, 2**64, 65535, 65536, "", "x", "\u00b2", "\x1b[31m", "\0",
    "/dev/zero", "../x", "a" * 300, None, True, False, [], {}, [[]], [0], {"": 0}, {"x": [1, {}]},
)  # fmt: skip
ODD_WORDS = (
    "", "nan", "inf", "-1", "0", "1e400", "9" * 400, "\u00b2", "1_0", "0x10", "x", "a=b", "=", ":",
    "1:", "2:1", "\x1b[31m", ".", "..", "nowhere/x", "/dev/zero", "--", "-", "{", "*", "a" * 300,
)  # fmt: skip


# ---- faults


def in_json(data: bytes, draw: random.Random) -> bytes:
    """JSON with a value replaced, a key removed, an item duplicated, or deep lists inserted."""
    document = json.loads(data)
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        places = list(_places(document))
        if not places:
            break
        holder, key = draw.choice(places)
        what = draw.random()
        if what < 0.7:
            holder[key] = _odd(draw)
        elif what < 0.85:
            del holder[key]
        elif isinstance(holder, list):
            holder.insert(key, holder[key])
        else:
            holder[f"{key}2" if draw.random() < 0.5 else key.upper()] = holder[key]
    return json.dumps(document).encode("utf-8", "surrogatepass")


def _odd(draw: random.Random) -> Any:
    if draw.random() < 0.05:
        deep: Any = 0
        for _ in range(draw.choice((70, 500, 900))):
            deep = [deep]
        return deep
    return json.loads(json.dumps(draw.choice(ODD)))  # a copy, because lists are mutable


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    rows = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in list(rows):
        yield value, key
        if isinstance(inner, dict | list):
            yield from _places(inner)


def in_text(data: bytes, draw: random.Random) -> bytes:
    """Text with one, two or four random faults.

    A fault replaces a word, removes, duplicates or swaps a line, cuts the text off at a line, or
    changes bytes.
    """
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        what = draw.random()
        if what < 0.6:
            data = _another_word(data, draw)
        elif what < 0.9:
            data = _another_line(data, draw)
        else:
            data = in_bytes(data, draw)
    return data


_BETWEEN = b' \t\n,;=:"[](){}'


def _another_word(data: bytes, draw: random.Random) -> bytes:
    at = draw.randrange(len(data) + 1)
    begin = at
    while begin and data[begin - 1] not in _BETWEEN:
        begin -= 1
    while at < len(data) and data[at] not in _BETWEEN:
        at += 1
    odd = draw.choice(ODD)
    text = odd if isinstance(odd, str) else repr(odd).replace("True", "true").replace("'", '"')
    return data[:begin] + text.encode("utf-8", "surrogatepass") + data[at:]


def _another_line(data: bytes, draw: random.Random) -> bytes:
    lines = data.split(b"\n")
    at = draw.randrange(len(lines))
    what = draw.randrange(4)
    if what == 0:
        del lines[at]
    elif what == 1:
        lines.insert(at, lines[at])
    elif what == 2:
        other = draw.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    else:
        del lines[at:]
    return b"\n".join(lines)


_NUMBERS = (b"\xff" * 4, b"\0" * 4, b"\0\0\x80\x7f", b"\0\0\xc0\x7f", b"\xff\xff\xff\x7f", b"\0\1")


def in_bytes(data: bytes, draw: random.Random) -> bytes:
    """Bytes with bits changed, special numbers inserted, or a part removed or duplicated."""
    out = bytearray(data)
    for _ in range(draw.choice((1, 1, 2, 8))):
        at = draw.randrange(len(out) + 1)
        what = draw.randrange(5)
        if what == 0 and at < len(out):
            out[at] ^= 1 << draw.randrange(8)
        elif what == 1:
            odd = draw.choice(_NUMBERS)
            out[at : at + len(odd)] = odd
        elif what == 2:
            out[at : at + 4] = out[at : at + 4][::-1] if draw.random() < 0.5 else _NUMBERS[2][::-1]
        elif what == 3:
            del out[at : at + draw.choice((1, 4, 100, len(out)))]
        else:
            end = at + draw.choice((1, 4, 100))
            out[at:at] = out[at:end]
    return bytes(out)


def in_dna(data: bytes, draw: random.Random) -> bytes:
    """A DNA file with changed bytes, or with other values of fields that the format can store."""
    if draw.random() < 0.4:
        return in_bytes(data, draw)
    for _ in range(8):
        text = in_json(_as_json(data), draw)
        with contextlib.suppress(risorius.DnaError):
            return risorius.Dna.from_json(text.decode("utf-8", "replace")).to_bytes()
    return in_bytes(data, draw)


@cache
def _as_json(data: bytes) -> bytes:
    return risorius.load(data).to_json().encode()


def in_glb(data: bytes, draw: random.Random) -> bytes:
    """A GLB with changed bytes, or with other values in its JSON chunk."""
    if draw.random() < 0.3:
        return in_bytes(data, draw)
    (size,) = struct.unpack_from("<I", data, 12)
    text = in_json(data[20 : 20 + size], draw)
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    return head + struct.pack("<I4s", len(text), b"JSON") + text + rest


def in_npz(data: bytes, draw: random.Random) -> bytes:
    """An NPZ with changed bytes, or with an array of other type, shape or values."""
    if draw.random() < 0.3:
        return in_bytes(data, draw)
    arrays = dict(np.load(io.BytesIO(data)))
    name = draw.choice(list(arrays))
    array = arrays[name]
    what = draw.randrange(5)
    if what == 0:
        array = array.astype(draw.choice(("<f8", "<i2", "?", "<U8", "<c16", "<M8[s]")))
    elif what == 1:
        array = array.ravel() if array.ndim else np.zeros((2, 2))
    elif what == 2:
        array = array[:0] if array.ndim else array.reshape(1)
    elif array.size:
        array = array.astype("<f8")
        odd = (math.nan, math.inf, 1e38, -1e308, 0.0, -1.0)
        with np.errstate(all="ignore"):
            array[...] = draw.choice(odd) if what == 3 else array * draw.choice(odd[2:])
    arrays[name] = array
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


IN: dict[str, Callable[[bytes, random.Random], bytes]] = {
    ".json": in_json, ".gltf": in_json, ".dna": in_dna, ".glb": in_glb, ".npz": in_npz,
    ".toml": in_text, ".csv": in_text, ".tsv": in_text, ".obj": in_text, ".dat": in_text,
    ".pgo": in_text, ".xml": in_text, ".txt": in_text,
}  # fmt: skip


def mutant(name: str, data: bytes, draw: random.Random) -> bytes:
    """A file with faults for its format, or, in a tenth of all cases, with changed bytes."""
    kind = in_bytes if draw.random() < 0.1 else IN.get(Path(name).suffix, in_bytes)
    try:
        return kind(data, draw)
    except (RecursionError, UnicodeError):  # nested too deeply, or invalid characters
        return in_bytes(data, draw)


# Name of a trial -> (files that get faults, command line). OUT.x is an output; FILE is replaced by
# one of the files.
TRIALS: dict[str, tuple[list[str], str]] = {
    "info": (["core.dna", "face.dna"], "info FILE"),
    "info json": (["core.dna", "face.dna"], "info FILE --json"),
    "info diff": (["core.dna", "core.json"], "info --diff core.dna FILE --all"),
    "info mix": (["face.dna"], "info face.dna --mix-with FILE"),
    "check": (["core.dna", "face.dna", "core.json"], "check FILE --mix"),
    "convert": (["core.dna", "face.dna"], "convert FILE OUT.json --indent 2"),
    "convert json": (["core.json"], "convert FILE OUT.dna"),
    "convert turned": (["core.dna", "face.dna"], "convert FILE OUT.dna --axes right up front "
                       "--translation-unit m --lods 0"),
    "eval": (["core.dna", "face.dna"], "eval FILE --lod 0"),
    "eval explain": (["core.dna", "face.dna"], "eval FILE --explain --top 3"),
    "eval clip": (["take.csv", "core.dna"], "eval take.csv core.dna -o OUT.npz --rate 30"),
    "eval rzc": (["clip.rzc"], "eval FILE core.dna -o OUT.csv --frames 0:4 --what joints,controls"),
    "clip convert": (["take.csv", "take.json", "a2f.csv", "a2f.json", "mouth.tsv", "take.glb",
                      "take.fbx", "clip.rzc"], "clip convert FILE -o OUT.rzc --report"),
    "clip mapped": (["map.toml", "take.csv"], "clip convert take.csv -o OUT.csv --mapping map.toml "
                    "--rig core.dna"),
    "clip steps": (["take.csv", "clip.rzc"], "clip convert FILE -o OUT.json --neutral 0:2 --gain "
                   "*=1.5 --smooth 0.1 --cut 0:0.1 --rate 60 --shift 1 --fill-gaps --mirror"),
    "clip info": (["curves.json", "table.json", "mouth.xml", "mouth.json", "mouth.pgo", "pgo.json",
                   "mouth.dat", "take.glb", "take.fbx", "a2f.json"], "clip info FILE"),
    "clip check": (["map.toml", "core.dna"], "clip check map.toml --rig core.dna"),
    "clip mappings": ([], "clip mappings --write arkit -o OUT.toml"),
    "author": (["spec.toml", "neutral.obj", "shapes/jawOpen.obj"], "author spec.toml -o OUT.dna"),
    "author names": (["spec.toml", "neutral.obj"], "author spec.toml --names"),
    "author glb": (["spec_glb.toml", "head.glb"], "author spec_glb.toml -o OUT.dna --joints-only"),
    "author dna": (["spec_dna.toml", "face.dna"], "author spec_dna.toml -o OUT.dna --exact --json"),
    "sample": (["person.toml", "rig.toml"], "sample build OUT.dna --person person.toml --spec "
               "rig.toml --offline"),
    "mix": (["face.dna"], "mix FILE=0.5 face.dna=0.5 -o OUT.dna --nose FILE=1"),
    "edit": (["core.dna", "regions.json"], "edit regroup core.dna OUT.dna --regions "
             "regions.json --combinations 2 --threshold 0.1 --seed 3"),
    "edit face": (["face.dna"], "edit regroup FILE OUT.dna --combinations 2 --json"),
    "solve": (["frames.npz", "face.dna"], "solve face.dna frames.npz -o OUT.rzc --report"),
    "batch": (["jobs.toml", "map.toml"], "batch jobs.toml --dry-run"),
    "speech": (["voice.wav", "said.txt"], "speech voice.wav -o OUT.rzc --transcript said.txt "
               "--rate 30 --phonemes OUT.tsv"),
    "live": (["map.toml"], "live --port 0 --seconds 0.01 --record OUT.csv --mapping map.toml"),
    "web": (["face.dna", "take.csv", "voice.wav"], "web face.dna -o OUT.html --clip take.csv "
            "--sound voice.wav --lods 0:1"),
    "export": (["face.dna"], "export face.dna -o OUT.glb --shapes all --quantize --within 1"),
    "export vrm": (["licence.toml", "face.dna"], "export face.dna -o OUT.vrm --shapes all --vrm "
                   "1.0 --humanoid minimal --licence licence.toml"),
    "export takes": (["take.csv"], "export face.dna -o OUT.glb --shapes all --within 1 --takes "
                     "FILE"),
    "plot": (["core.dna", "face.dna"], "plot FILE -o OUT.png --dpi 40"),
    "bench": (["frames.npz"], "bench core.dna --frames frames.npz --quick"),
}  # fmt: skip
SLOW = {"plot": 10, "speech": 4, "bench": 4}  # command -> divisor of its rounds
KEPT = ("--dry-run", "--offline", "--seconds")  # without them a round takes minutes
QUICK = ("info", "convert json", "clip info", "clip check", "author names", "sample", "batch")


class Round:
    """A run of a command with faults in its inputs, drawn by a seed."""

    def __init__(self, inputs: dict[str, bytes], name: str, key: str) -> None:
        self.draw = random.Random(key)
        files, words = TRIALS[name]
        self.files = dict(inputs)
        file = self.draw.choice(files) if files else ""
        self.words = words.replace("FILE", file).split()
        odd_word = not files or self.draw.random() < 0.15
        if odd_word:
            at = self.draw.randrange(1, len(self.words))
            if "OUT" not in self.words[at] and self.words[at] not in KEPT:
                self.words[at] = self.draw.choice(ODD_WORDS)
        else:
            target = self.draw.choice(files) if "FILE" not in words else file
            self.files[target] = mutant(target, inputs[target], self.draw)

    def write(self, folder: Path) -> None:
        """Write the inputs into an empty folder, and in half of the cases old output files."""
        for name, data in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        if self.draw.random() < 0.5:
            for word in self.words:
                if word.startswith("OUT"):
                    (folder / word).write_text("old")

    def faults(self, folder: Path) -> list[str]:
        """Run the command in the current folder. Returns a sentence for each broken rule."""
        before = _contents(folder)
        memory, began = _begin_peak(), time.process_time()
        signal.setitimer(signal.ITIMER_PROF, 3 * CPU_SECONDS)  # ends the process
        done = _run(self.words)
        signal.setitimer(signal.ITIMER_PROF, 0)
        took = time.process_time() - began
        out = complaints(done, (0, 1, 2))
        if done.code and _contents(folder) != before:
            changed = sorted(set(_contents(folder)) ^ set(before)) or "an old file"
            out.append(f"exit code {done.code} left {changed}")
        if took > CPU_SECONDS:
            out.append(f"{took:.0f} s of CPU")
        allowed = MEMORY + MEMORY_PER_BYTE * max(map(len, self.files.values()))
        if (peak := _peak() - memory) > allowed:
            out.append(f"{peak / MiB:.0f} MiB, {allowed / MiB:.0f} were allowed")
        if "not enough memory" in done.err:
            out.append("all memory was asked for")
        if "Warning:" in done.err:
            out.append(f"a warning of Python's: {done.err.strip().splitlines()[0][-160:]}")
        odd = {c for c in done.out + done.err if c not in "\n\t" and ord(c) < 32}
        if odd:
            out.append(f"control characters to the terminal: {sorted(odd)}")
        return out


def _contents(folder: Path) -> dict[str, int]:
    return {
        str(path.relative_to(folder)): hash(path.read_bytes())
        for path in folder.rglob("*")
        if path.is_file()
    }


def _run(words: list[str]) -> Done:
    """Run a command in this process. Returns its end; exit code -1 if it raises an exception."""
    try:
        done = command_line.run(*words)
    except BaseException:  # noqa: BLE001  a command must not raise any exception
        return Done(-1, "", traceback.format_exc())
    out, err = (text.decode("utf-8", "replace") for text in (done.stdout, done.stderr))
    return Done(done.returncode, out, err.splitlines()[-1] if err.startswith("usage:") else err)


def _begin_peak() -> int:
    """Reset this process's record of its largest memory use, if the system allows this.

    Returns the memory in use at present, in bytes.
    """
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return _peak()


def _peak() -> int:
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def rounds_of(name: str, seed: int, rounds: int, only: int | None = None) -> Row:
    """Run rounds of a command in a separate process, and in a new one after each crash.

    Args:
        name: one of TRIALS.
        seed: seed of all rounds.
        rounds: number of rounds; slow commands run fewer, divided by SLOW.
        only: number of the only round to run; None: all rounds.
    """
    row = Row("mutants of inputs", name)
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        inputs = make_inputs(folder)
        log = folder / "log"
        left = [only] if only is not None else list(range(max(1, rounds // SLOW.get(name, 1))))
        while left:
            log.write_text("")
            status = _in_a_process(partial(_work, inputs, name, seed, left, folder, log))
            lines = [json.loads(line) for line in log.read_text().splitlines()]
            begun = [line for line in lines if isinstance(line, int)]
            row.runs += len(begun)
            for number, faults in (line for line in lines if not isinstance(line, int)):
                row.faults += [f"seed {seed}, round {number}: {fault}" for fault in faults]
            if isinstance(lines[-1], int) and status < 0:
                signal_name = signal.Signals(-status).name
                row.faults.append(f"seed {seed}, round {begun[-1]}: ended by {signal_name}")
            elif status:
                raise RuntimeError(f"{name}, seed {seed}: the trial itself failed, see above")
            left = left[len(begun) :]
    return row


def _in_a_process(work: Callable[[], None]) -> int:
    child = os.fork()
    if child == 0:
        faulthandler.disable()
        code = 1
        try:
            work()
            code = 0
        except BaseException:  # noqa: BLE001  shown, and told by the exit code
            traceback.print_exc()
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _work(
    inputs: dict[str, bytes], name: str, seed: int, numbers: list[int], folder: Path, log: Path
) -> None:
    """Run rounds. Each round logs its number when it begins, and [number, faults] when it ends."""
    limit = 8192 * MiB
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if not _has_page():
        web_command.empty_page = web_page.empty_page = lambda: _PAGE
    for number in numbers:
        place = folder / "room"
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()
        os.chdir(place)
        trial = Round(inputs, name, f"{seed} {name} {number}")
        trial.write(place)
        with log.open("a") as file:
            file.write(f"{number}\n")
            file.flush()
            file.write(json.dumps([number, trial.faults(place)]) + "\n")


def _has_page() -> bool:
    with contextlib.suppress(web_page.WebError):
        return bool(web_page.empty_page())
    return False


def trials(rounds: int, seed: int, names: tuple[str, ...] = ()) -> Iterator[Row]:
    """Yield the results of commands, a row for each.

    Args:
        rounds: number of rounds of each command.
        seed: seed of all rounds.
        names: keys of TRIALS; empty: all.
    """
    with (
        tempfile.TemporaryDirectory() as cache,
        mock.patch.dict(os.environ, RISORIUS_CACHE=cache, XDG_CACHE_HOME=cache),
    ):
        for name in names or TRIALS:
            yield rounds_of(name, seed, rounds)
