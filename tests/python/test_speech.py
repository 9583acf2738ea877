# SPDX-License-Identifier: MIT
"""Speech to animation: sound files, transcripts, phonemes against espeak-ng's, and the mouth."""

import json
import shutil
import struct
import subprocess
import sys
import wave
from pathlib import Path

import conftest
import espeak_truth
import numpy as np
import pytest
from risorius import Clip, cli
from risorius.speech import CancelledError, Heard, animate, listen, phonemes, speak
from risorius.speech import articulation, gestures, letters, prosody, text, voting
from risorius.speech.audio import RATE, AudioError, parse_wav, read_audio, resample
from risorius.speech.listening import pieces, with_silences
from risorius.speech.phones import CLASS_OF, VISEMES, Phoneme
from risorius.speech.recogniser import MissingError

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "bench"))

import speech_accuracy

P = "CTRL_expressions."
BEGIN, END = 0.3, 0.9


@pytest.fixture
def voice(tmp_path):
    """Says a text into a file; without espeak-ng the test is an extra that is not run."""
    if not espeak_truth.is_installed():
        conftest.require_extra(Path("espeak-ng"), "speech of espeak-ng (apt install espeak-ng)")
    pytest.importorskip("pocketsphinx")

    def say(said, *how):
        spoken = espeak_truth.say(said, *how)
        spoken.save(tmp_path / "voice.wav")
        return tmp_path / "voice.wav", spoken

    return say


def wav(kind, bits, channels, rate, body, *, block=None, size=None, extra=b""):
    """A WAV file, as the specification has it."""
    block = channels * bits // 8 if block is None else block
    form = struct.pack("<HHIIHH", kind, channels, rate, rate * block, block, bits) + extra
    chunks = b"fmt " + struct.pack("<I", len(form)) + form
    chunks += b"data" + struct.pack("<I", len(body) if size is None else size) + body
    return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks


def sine(frequency, rate, seconds=0.5):
    return np.sin(2 * np.pi * frequency * np.arange(int(rate * seconds)) / rate)


def encoded(kind, bits, values):
    if kind == 3:
        return values.astype(f"<f{bits // 8}").tobytes()
    if bits == 8:
        return np.round(values * 127 + 128).astype(np.uint8).tobytes()
    whole = np.round(values * (2 ** (bits - 1) - 1)).astype("<i4")
    return b"".join(int(v).to_bytes(bits // 8, "little", signed=True) for v in whole)


# ---- sound files ----


@pytest.mark.parametrize(("kind", "bits"), [(1, 8), (1, 16), (1, 24), (1, 32), (3, 32), (3, 64)])
def test_every_common_kind_of_wav_gives_the_same_sound(kind, bits):
    values = 0.8 * sine(440, 22050, 0.05)
    samples, rate = parse_wav(wav(kind, bits, 1, 22050, encoded(kind, bits, values)))
    assert rate == 22050
    assert np.abs(samples - values).max() < (0.008 if bits == 8 else 1e-4)


def test_extensible_header_stereo_and_streamed_length():
    left, right = 0.5 * sine(300, 8000, 0.05), 0.25 * sine(300, 8000, 0.05)
    body = encoded(1, 16, np.stack([left, right], axis=1).ravel())
    guid = struct.pack("<HHIH", 22, 16, 3, 1) + bytes(14)
    data = wav(0xFFFE, 16, 2, 8000, body, extra=guid, size=0xFFFFFFFF)
    samples, _ = parse_wav(data)
    assert np.abs(samples - 0.5 * (left + right)).max() < 1e-4


def test_a_pair_wired_against_each_other_is_not_silence():
    one = 0.5 * sine(300, 8000, 0.05)
    body = encoded(3, 32, np.stack([one, -one], axis=1).ravel())
    assert np.abs(np.abs(parse_wav(wav(3, 32, 2, 8000, body))[0]) - np.abs(one)).max() < 1e-6


BODY = bytes(200)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (wav(1, 16, 0, 16000, BODY, block=2), "channels"),
        (wav(1, 16, 1, 0, BODY), "samples a second"),
        (wav(1, 16, 1, 2**31, BODY), "samples a second"),
        (wav(1, 16, 2, 16000, BODY, block=3), "bytes a sample"),
        (wav(1, 16, 1, 16000, BODY, size=4000), "cut short"),
        (wav(1, 16, 1, 16000, b""), "without samples"),
        (wav(3, 32, 1, 16000, struct.pack("<2f", 0.0, float("nan"))), "sample 1 is no finite"),
        (b"RIFF\x10\0\0\0WAVEdata\4\0\0\0\0\0\0\0", "before the fmt"),
        (b"RIFF\x10\0\0\0WAVEfmt \xff\xff\xff\x7f", "announced"),
        (b"RIFF\x10\0\0\0WAVEfmt \2\0\0\0\1\0", "16 bytes was expected"),
        (b"RIFF\4\0\0\0WAVE", "no data chunk"),
    ],
)
def test_damaged_wav_files_are_refused_with_a_sentence(tmp_path, data, words):
    path = tmp_path / "bad.wav"
    path.write_bytes(data)
    with pytest.raises(AudioError, match=words) as caught:
        read_audio(path)
    assert str(caught.value).startswith(str(path))


def test_no_wav_file_cut_anywhere_escapes_as_another_error():
    whole = wav(1, 24, 2, 16000, bytes(range(60)))
    random = np.random.default_rng(0)
    for cut in range(len(whole)):
        patched = bytearray(whole[: cut + 1])
        patched[random.integers(len(patched))] ^= 1 << random.integers(8)
        for data in (whole[:cut], bytes(patched)):
            try:
                samples, rate = parse_wav(data)
            except AudioError:
                continue
            assert np.isfinite(samples).all()
            assert rate > 0


def test_other_formats_go_through_ffmpeg(tmp_path, monkeypatch):
    source, packed = tmp_path / "a.wav", tmp_path / "a.flac"
    source.write_bytes(wav(1, 16, 1, RATE, encoded(1, 16, 0.5 * sine(440, RATE))))
    if shutil.which("ffmpeg") is None:
        conftest.require_extra(Path("ffmpeg"), "sound formats of ffmpeg")
    subprocess.run(["ffmpeg", "-v", "error", "-i", source, packed], check=True)
    samples, rate = read_audio(packed)
    assert np.abs(samples[: RATE // 2] - 0.5 * sine(440, RATE)).max() < 1e-3
    packed.write_bytes(b"fLaC" + bytes(50))
    with pytest.raises(AudioError, match="ffmpeg finds no sound"):
        read_audio(packed)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(AudioError, match="not on PATH"):
        read_audio(packed)


@pytest.mark.parametrize("rate", [8000, 11025, 22050, 44100, 48000, 96000, 44101])
def test_resampling_keeps_the_band_and_nothing_else(rate):
    kept = min(rate, RATE) * 0.43
    for frequency in (200.0, kept):
        found = resample(sine(frequency, rate).astype(np.float32), rate)
        wanted = sine(frequency, RATE, len(found) / RATE)[: len(found)]
        inner = slice(400, -400)
        assert np.abs(found[inner] - wanted[inner]).max() < 1e-3
    if rate > 2.2 * RATE:
        folded = resample(sine(RATE * 0.53, rate).astype(np.float32), rate)
        assert np.abs(folded[400:-400]).max() < 1e-3


# ---- text ----


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("Hello, World! (laughs) [music]", "hello world"),
        ("It\u2019s O'Neil's caf\u00e9", "it's o'neil's cafe"),
        ("in 1984, 2007 and 1900", "in nineteen eighty four two thousand seven and nineteen hundred"),
        ("$3.50 or £1", "three dollars and fifty cents or one pound"),
        ("1,234,567", "one million two hundred thirty four thousand five hundred sixty seven"),
        ("the 21st, 3rd; 90s", "the twenty first third nineties"),
        ("4.25 at 5%", "four point two five at five percent"),
        ("Dr. Who, U.S.A. & B2B", "doctor who u s a and b two b"),
        ("007", "zero zero seven"),
    ],
)  # fmt: skip
def test_transcripts_become_the_words_that_are_said(written, said):
    assert text.words(written) == said.split()


def test_no_number_is_too_long_to_be_said():
    assert text.words("9" * 5000) == ["nine"] * 5000


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("zorblax", "Z AO R B L AE K S"),
        ("gnome", "N OW M"),
        ("nvq", "EH N V IY K Y UW"),
        ("shipthing", "SH IH P TH IH NG"),
    ],
)
def test_words_without_a_dictionary_are_pronounced_by_rule(word, said):
    assert letters.pronounce(word) == said.split()


def test_any_letters_have_a_pronunciation_of_known_phonemes():
    random = np.random.default_rng(3)
    for _ in range(2000):
        word = "".join(random.choice(list("abcdefghijklmnopqrstuvwxyz'"), random.integers(1, 12)))
        if word.strip("'"):
            said = letters.pronounce(word)
            assert said
            assert set(said) <= set(CLASS_OF)
