# SPDX-License-Identifier: MIT
"""Tests that Ctrl-C, a full disk or a closed pipe end a command with a sentence and leave no file.

Each command reads a named pipe instead of an input file. When the pipe's other end can be opened,
the command has started its work, even on a busy machine.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import GOLDEN, PROJECT

CORE = str(GOLDEN / "core.dna")
COMMANDS = {
    "convert": ["convert", "in.json", "out.dna"],
    "regroup": ["edit", "regroup", CORE, "out.dna", "--regions", "in.json"],
    "clip": ["clip", "convert", "in.csv", "-o", "out.rzc"],
    "eval": ["eval", "in.csv", CORE, "-o", "out.npz"],
    "plot": ["plot", "in.dna", "-o", "out.png"],
    "speech": ["speech", "in.wav", "-o", "out.rzc"],
    "sample": ["sample", "build", "out.dna", "--data", "in.whl"],
    "bench": ["bench", CORE, "--frames", "in.npz"],
}
# Words before a command that let it ignore SIGINT. They replace a preexec_fn, which could wait for
# ever for a lock of another thread.
IGNORING = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]
needs_pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names")


def started(arguments, folder):
    """Start a command that reads a pipe. Returns its process, the pipe's write end, its path."""
    name = next(a for a in arguments if a.startswith("in."))
    os.mkfifo(folder / name)
    process = subprocess.Popen(
        [sys.executable, "-m", "risorius", *arguments],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while True:
        assert process.poll() is None, process.communicate()[1]
        with contextlib.suppress(OSError):  # the command has not opened the pipe
            pipe = os.open(folder / name, os.O_WRONLY | os.O_NONBLOCK)
            return process, open(pipe, "wb", buffering=0), folder / name
        time.sleep(0.01)


@needs_pipes
def test_an_interrupt_is_a_sentence_and_leaves_the_old_file(tmp_path):
    running = {}
    with contextlib.ExitStack() as stack:
        for name, arguments in COMMANDS.items():
            folder = tmp_path / name
            folder.mkdir()
            out = next((a for a in arguments if a.startswith("out.")), None)
            if out:
                (folder / out).write_text("old")
            process, pipe, place = started(arguments, folder)
            stack.callback(process.kill)
            stack.enter_context(pipe)
            running[name] = process, folder, place, out
        for process, *_ in running.values():
            process.send_signal(signal.SIGINT)
        for name, (process, folder, place, out) in running.items():
            said = process.communicate()[1]
            assert (name, process.returncode, said) == (name, 130, "risorius: interrupted\n")
            assert sorted(os.listdir(folder)) == sorted([place.name, *([out] if out else [])])
            assert out is None or (folder / out).read_text() == "old"


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("heard", [True, False])
def test_an_interrupt_is_a_sentence_while_the_package_is_imported(tmp_path, heard):
    (tmp_path / "risorius").mkdir()
    (tmp_path / "risorius" / "__init__.py").write_text(
        "print('importing', flush=True)\ntry:\n    input()\nexcept BaseException:\n    pass\n"
    )
    (tmp_path / "risorius" / "cli.py").write_text("def main():\n    print('run')\n    return 3\n")
    program = "import sys; from risorius_command import main; sys.exit(main())"
    paths = os.pathsep.join([str(tmp_path), str(PROJECT / "native" / "python")])
    process = subprocess.Popen(
        [*([] if heard else IGNORING), sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": paths},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "importing\n"
    process.send_signal(signal.SIGINT)
    if heard:
        assert (process.wait(), process.stderr.read()) == (130, "risorius: interrupted\n")
    out, error = process.communicate("\n")
    assert heard or (process.returncode, out, error) == (3, "run\n", "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device that is full")
def test_what_is_printed_to_a_full_disk_is_a_sentence():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "risorius", "info", CORE],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert done.stderr == "risorius: <stdout>: No space left on device\n"
    assert done.returncode == 1


@needs_pipes
def test_a_reader_that_leaves_is_no_error(tmp_path):
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "risorius", "info", CORE],
        stdout=write, stderr=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")
