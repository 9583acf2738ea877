# SPDX-License-Identifier: MIT
"""Tests that speech recognition in a separate process does not depend on this process."""

import os
import shutil
import sys
import textwrap

import conftest
import espeak_truth
import limits
import numpy as np
import pytest
from risorius.expressions import Expression
from risorius.speech import AudioError, CancelledError, apart, speak
from risorius.speech.recogniser import MissingError

WORDS = "Hello, my name is Bob."


@pytest.fixture
def voice(tmp_path):
    """A spoken sentence as a file; the test is skipped without espeak-ng."""
    if not espeak_truth.is_installed():
        conftest.require_extra(tmp_path / "espeak-ng", "speech of espeak-ng")
    espeak_truth.say(WORDS).save(tmp_path / "voice.wav")
    return tmp_path / "voice.wav"


@pytest.fixture
def endless(tmp_path):
    """The path of a sound file that never ends: a named pipe into which nobody writes."""
    if not hasattr(os, "mkfifo"):
        pytest.skip("pipes with names")
    os.mkfifo(tmp_path / "endless.wav")
    return tmp_path / "endless.wav"


@pytest.fixture
def processes(monkeypatch):
    """The list of the recogniser's processes that the test starts."""
    found, begin = [], apart._started

    def spy(said):
        found.append(begin(said))
        return found[-1]

    monkeypatch.setattr(apart, "_started", spy)
    return found


def test_it_is_the_same_speech(voice, monkeypatch):
    own = Expression("aa", "Aa", "viseme", "", {"CTRL_expressions.open_A": 0.9})
    options = {"seed": 3, "rate": 30.0, "library": {"aa": own}}
    wanted = speak(voice, WORDS, **options)
    assert "CTRL_expressions.open_A" in wanted.names
    # The process of the recogniser does not depend on this process: it works even if this process
    # cannot import the recogniser.
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    with pytest.raises(MissingError):
        speak(voice, WORDS)
    shares = []
    clip = apart.speak_apart(voice, WORDS, progress=shares.append, **options)
    assert clip.names == wanted.names
    assert np.array_equal(clip.curves, wanted.curves)
    assert (clip.rate, clip.events, clip.metadata) == (30.0, wanted.events, wanted.metadata)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


CLASH = "void *ps_init(void *config) { return 0; }  // another version of it: nothing fits\n"
PROGRAM = """
    import ctypes, os, sys
    ctypes.CDLL(sys.argv[1], ctypes.RTLD_GLOBAL)
    from risorius.speech import apart, speak
    try:
        speak(sys.argv[2], sys.argv[3])
    except Exception as error:
        print("in one process:", type(error).__name__)
    print("apart:", apart.speak_apart(sys.argv[2], sys.argv[3]).metadata["speech"])
"""


def test_another_libpocketsphinx_in_this_process_does_not_matter(voice, tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc")
    assert compiler, "the tests need a C compiler"
    (tmp_path / "clash.c").write_text(CLASH)
    library = tmp_path / "libclash.so"
    build = [compiler, "-shared", "-fPIC", "-o", str(library), str(tmp_path / "clash.c")]
    limits.run(build, 60).check_returncode()
    command = [sys.executable, "-c", textwrap.dedent(PROGRAM), str(library), str(voice), WORDS]
    done = limits.run(command, 120)
    said = done.stdout.splitlines()
    assert said[-1:] == ["apart: aligned"], done.stderr
    # The two libraries cannot be used together: in a process that loads both, recognition fails.
    assert said[:1] == ["in one process: RuntimeError"]


def test_errors_are_the_same_sentences(tmp_path):
    pytest.importorskip("pocketsphinx")
    with pytest.raises(AudioError, match=r"absent\.wav: cannot read it: No such file"):
        apart.speak_apart(tmp_path / "absent.wav")
    with pytest.raises(ValueError, match="no English word"):
        apart.speak_apart(tmp_path / "absent.wav", "... ?!")
    with pytest.raises(ValueError, match="rate: 1 to 1000"):
        apart.speak_apart(tmp_path / "absent.wav", rate=0.0)


def test_cancelling_ends_the_process_at_once(endless, processes):
    with pytest.raises(CancelledError):
        apart.speak_apart(endless, cancel=lambda: True)
    assert processes[0].returncode is not None


def test_a_process_that_says_nothing_is_ended(endless, processes, monkeypatch):
    monkeypatch.setattr(apart, "_PATIENCE", 0.2)
    with pytest.raises(apart.RecogniserError, match=r"said nothing for 0\.2 s"):
        apart.speak_apart(endless)
    assert processes[0].returncode is not None


def test_it_ends_with_the_process_that_began_it(endless, tmp_path):
    with (tmp_path / "said").open("w+b") as said:
        process = apart._started(said)
        task = {"paths": sys.path, "path": str(endless), "transcript": None, "options": {}}
        apart._write(process, task)
        # This process keeps the pipe open, so that the other process waits for sound.
        with endless.open("wb"):
            assert process.poll() is None
            process.stdin.close()  # the system does this when a process dies
            assert process.wait(60) == 1
        process.stdout.close()


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ("import os; os.abort()", r"ended by itself \(signal 6\)$"),
        ("raise SystemError('no memory')", r"ended by itself \(exit code 1\): .*no memory$"),
        ("import sys; print('a line\\nanother', file=sys.stderr); sys.exit(3)", "3.: another$"),
    ],
)
def test_a_crash_is_a_sentence(tmp_path, monkeypatch, ends, words):
    monkeypatch.setattr(apart, "_BEGIN", ends)
    with pytest.raises(apart.RecogniserError, match=words):
        apart.speak_apart(tmp_path / "any.wav")


def test_the_program_of_python_is_found_from_one_that_carries_python(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/usr/bin/blender")
    monkeypatch.setattr(sys, "_base_executable", "/usr/bin/blender", raising=False)
    (tmp_path / "bin").mkdir()
    monkeypatch.setattr(sys, "exec_prefix", str(tmp_path))
    with pytest.raises(apart.RecogniserError, match="none was found"):
        apart.speak_apart(tmp_path / "any.wav")
    own = tmp_path / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}"
    own.touch()
    assert apart.python_program() == str(own)
    with pytest.raises(apart.RecogniserError, match="could not be started: .*Permission denied"):
        apart.speak_apart(tmp_path / "any.wav")
