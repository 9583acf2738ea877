# SPDX-License-Identifier: MIT
"""Tests speech to animation: sound files, transcripts, phonemes (with espeak-ng), the mouth."""

import json
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import conftest
import espeak_truth
import numpy as np
import pytest
from conftest import no_room
from risorius import Clip, cli, expressions
from risorius.cli import speech as command
from risorius.speech import (
    CancelledError,
    Heard,
    animate,
    articulation,
    gestures,
    letters,
    listen,
    phonemes,
    prosody,
    speak,
    text,
    voting,
)
from risorius.speech.audio import RATE, AudioError, parse_wav, read_audio, resample
from risorius.speech.listening import _shifted, pieces, with_silences
from risorius.speech.phones import CLASS_OF, VISEMES, Phoneme
from risorius.speech.recogniser import MissingError, Segment

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))

import itertools

import speech_accuracy

P = "CTRL_expressions."


@pytest.fixture
def voice(tmp_path):
    """A function that speaks a text into a file; the test is skipped if espeak-ng is missing."""
    if not espeak_truth.is_installed():
        conftest.require_extra(Path("espeak-ng"), "speech of espeak-ng (apt install espeak-ng)")
    pytest.importorskip("pocketsphinx")

    def say(said, *how):
        spoken = espeak_truth.say(said, *how)
        spoken.save(tmp_path / "voice.wav")
        return tmp_path / "voice.wav", spoken

    return say


def wav(kind, bits, channels, rate, body, *, block=None, size=None, extra=b""):
    """Bytes of a WAV file.

    Args:
        kind: format code of the header: 1 for integers, 3 for floats.
        bits: bits per sample.
        channels: number of channels.
        rate: samples per second.
        body: the encoded samples.
        block: bytes per frame in the header; None: the correct number.
        size: bytes of the samples in the header; None: the correct number.
        extra: further bytes of the format chunk.
    """
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


# ---- reading of sound files ----


@pytest.mark.parametrize(("kind", "bits"), [(1, 8), (1, 16), (1, 24), (1, 32), (3, 32), (3, 64)])
def test_every_common_kind_of_wav_gives_the_same_sound(kind, bits):
    values = 0.8 * sine(440, 22050, 0.05)
    samples, rate = parse_wav(wav(kind, bits, 1, 22050, encoded(kind, bits, values)))
    assert rate == 22050
    assert np.abs(samples - values).max() < (0.5 / 127 + 0.8 / 128 if bits == 8 else 1e-4)


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
        (wav(1, 16, 1, 10**9, BODY), "samples a second"),
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
    samples, _ = read_audio(packed)
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


# ---- words and numbers in transcripts ----


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("Hello, World! (laughs) [music]", "hello world"),
        ("It\u2019s O'Neil's caf\u00e9", "it's o'neil's cafe"),
        ("1984, 2007", "nineteen eighty four two thousand seven"),
        ("1900", "nineteen hundred"),
        ("$3.50 or £1", "three dollars and fifty cents or one pound"),
        ("1,234,567", "one million two hundred thirty four thousand five hundred sixty seven"),
        ("the 21st, 3rd; 90s", "the twenty first third nineties"),
        ("4.25 at 5%", "four point two five at five percent"),
        ("Dr. Who, U.S.A. & B2B", "doctor who u s a and b two b"),
        ("007", "zero zero seven"),
    ],
)
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


# ---- phonemes compared with espeak-ng's ----


def test_frames_with_a_transcript_are_right_and_without_better_than_a_guess(tmp_path, voice):
    sentences = [speech_accuracy.corpus("held-out")[i] for i in (1, 5, 11)]
    for with_text, goal in ((True, 0.70), (False, None)):
        table = speech_accuracy.measure(sentences, tmp_path, with_text)
        least = speech_accuracy.commonest(table)[1] + 0.15 if goal is None else goal
        assert speech_accuracy.accuracy(table) >= least


def test_lips_are_closed_at_the_true_times_of_bilabials(voice):
    said = "Bob packed my map. Perhaps we may remember the summer home."
    path, spoken = voice(said, "en-us+m7", 165, 45)
    clip = speak(path, said)
    times = clip.frame_times()
    jaw = clip.curve(P + "jawOpen")
    pressed = clip.curve(P + "mouthPressUL") / expressions.get("PP").weights[P + "mouthPressUL"]
    closed = []
    for name, begin, end in zip(spoken.names, spoken.times, spoken.times[1:], strict=False):
        if espeak_truth.CLASS_OF[name] == "PP":
            frames = (times >= begin - 0.03) & (times <= end + 0.03)
            closed.append(jaw[frames].min() < 0.05 and pressed[frames].max() > 0.95)
    assert len(closed) >= 12
    assert np.mean(closed) >= 0.9  # a missed reduced vowel hides a closure
    vowels = [
        jaw[(times >= begin) & (times <= end)].max()
        for name, begin, end in zip(spoken.names, spoken.times, spoken.times[1:], strict=False)
        if name in ("a", "0")
    ]
    assert min(vowels) > 0.15


def test_the_phonemes_cover_the_sound_and_words_are_events(voice):
    path, spoken = voice("Very very good. Seven moons!")
    clip = speak(path, "Very very good. Seven moons!", rate=48.0, seed=3)
    words = [event for event in clip.events if event.name == "word"]
    assert [event.value for event in words] == "very very good seven moons".split()
    assert all(a.time + a.duration <= b.time + 1e-6 for a, b in itertools.pairwise(words))
    sounds = [event for event in clip.events if event.name == "phoneme"]
    ends = [event.time + event.duration for event in sounds]
    assert sounds[0].time == 0.0
    assert np.allclose([event.time for event in sounds[1:]], ends[:-1])
    assert ends[-1] == pytest.approx(len(spoken.samples) / spoken.rate, abs=1e-3)
    assert clip.rate == 48.0
    assert clip.metadata["speech"] == "aligned"
    assert clip.metadata["source"] == "voice.wav"
    again = speak(path, "Very very good. Seven moons!", rate=48.0, seed=3)
    assert np.array_equal(clip.curves, again.curves)


def test_a_transcript_of_another_recording_is_doubted(voice):
    path, _ = voice("Think about the other path, this weather bothers them.")
    right = listen(path, "Think about the other path; this weather bothers them.")
    assert right.aligned
    assert right.notes == []
    short = listen(path, "Think about the other path")
    wrong = listen(path, "She sells sea shells and he chose cheese and cherry juice for lunch")
    assert short.notes
    assert wrong.notes


def test_words_that_no_dictionary_has_are_aligned_by_rule(voice):
    path, _ = voice("The zorblax of Nvidiana paid three dollars in 1984.")
    heard = phonemes(path, "The zorblax of Nvidiana paid 3 dollars in 1984")
    words = [phone.word for phone in heard if phone.word]
    assert words == "the zorblax of nvidiana paid three dollars in nineteen eighty four".split()


def test_a_transcript_that_is_not_to_the_letter_is_used_where_it_fits(voice):
    path, _ = voice("The cat paid dollar three point five zero at home.")
    heard = listen(path, "The cat paid $3.50 at home.")  # three dollars and fifty cents
    assert heard.aligned
    assert any("words were not heard" in note for note in heard.notes)
    assert {"cat", "three", "home"} <= {phone.word for phone in heard.phonemes}


@pytest.mark.parametrize("said", [None, "Hello there"])
@pytest.mark.parametrize("count", [3, 16000])
def test_in_a_silent_recording_no_speech_is_heard(tmp_path, said, count):
    pytest.importorskip("pocketsphinx")
    path = tmp_path / "silent.wav"
    path.write_bytes(wav(1, 16, 1, RATE, bytes(2 * count)))
    heard = listen(path, said)
    assert [p.name for p in heard.phonemes] == ["SIL"]
    assert heard.notes == ["no speech was heard"]
    clip = animate(heard, blinks=False)
    assert np.abs(clip.curves).max() == 0.0


def test_listening_tells_how_far_it_is_and_can_be_cancelled(voice):
    path, _ = voice("A short sentence.")
    parts = []
    listen(path, "A short sentence.", progress=parts.append)
    assert parts == sorted(parts)
    assert parts[-1] == 1.0
    with pytest.raises(CancelledError):
        listen(path, cancel=lambda: True)


def test_phonemes_of_a_piece_lie_on_the_clock_of_the_whole_and_end_with_it():
    heard = [Phoneme(0.0, 0.5, "AA"), Phoneme(0.5, 1.1, "P")]  # the last one is too long
    found = _shifted(heard, 2.0, 3.0)
    assert found == [Phoneme(2.0, 2.5, "AA"), Phoneme(2.5, 3.0, "P")]


def test_a_recording_is_cut_in_pauses_and_covered_as_a_whole():
    levels = np.full(6000, -20.0)
    levels[1400:1450] = -90.0
    levels[3000:3100] = -90.0
    found = pieces(levels)
    assert found[0] == (0.0, 14.25)
    assert found[-1][1] == 60.0
    assert all(a[1] == b[0] for a, b in itertools.pairwise(found))
    assert max(end - begin for begin, end in found) <= 30.0


def test_silence_is_taken_from_a_phoneme_but_not_from_a_stop_within_a_word():
    levels = np.full(100, -10.0)
    levels[40:60] = -90.0
    phones = [
        Phoneme(0.0, 0.4, "AA", word="ah"), Phoneme(0.4, 0.7, "P"), Phoneme(0.7, 1.0, "AA"),
    ]  # fmt: skip
    assert with_silences(phones, levels) == phones
    phones[1] = phones[1]._replace(word="pa")
    assert [p.begin for p in with_silences(phones, levels)] == [0.0, 0.6, 0.7]


class Fake:
    """A recogniser that finds the same phonemes and words in every sound."""

    def __init__(self, phones, words):
        self.phones = [Segment(*phone, "") for phone in phones]
        self.words = [Segment(*word) for word in words]

    def hear_phonemes(self, samples):
        return self.phones

    def hear_words(self, samples):
        return self.words


def test_votes_elect_the_viseme_first_and_words_outvote_phonemes():
    half_second = np.zeros(RATE // 2, np.float32)
    words = [(0.0, 0.2, "P", "pat"), (0.2, 0.5, "B", "")]
    found = voting.hear(Fake([(0.0, 0.5, "M")], words), half_second, lambda part: None)
    assert [(p.name, p.word) for p in found] == [("M", "pat")]
    assert found[0].confidence > 0.9
    other = voting.hear(Fake([(0.0, 0.5, "T")], words), half_second, lambda part: None)
    assert {CLASS_OF[p.name] for p in other if p.begin < 0.4} == {"PP"}
    assert other[0].confidence == pytest.approx(3.6 / 6.6, abs=0.01)


# ---- the mouth ----


def spell(*sounds, length=0.1):
    """A Heard with these sounds, each `length` seconds long, and a tone of 150 Hz as its audio."""
    phones = [Phoneme(i * length, (i + 1) * length, name) for i, name in enumerate(sounds)]
    samples = sine(150, RATE, len(sounds) * length).astype(np.float32)
    return Heard(phones, samples, True, [])


@pytest.mark.parametrize("rate", [24.0, 25.0, 30.0, 60.0, 120.0])
def test_closures_are_seen_at_any_rate(rate):
    phones = [Phoneme(0.0, 0.31, "AA"), Phoneme(0.31, 0.325, "P"), Phoneme(0.325, 0.7, "AA")]
    heard = Heard(phones, sine(150, RATE, 0.7).astype(np.float32), True, [])
    jaw = animate(heard, rate=rate).curve(P + "jawOpen")
    assert jaw.max() > 0.4
    assert jaw[int(0.25 * rate) : int(0.4 * rate) + 1].min() < 0.05
    for phase in np.linspace(0.0, 1.0, 7):
        times = (np.arange(100) + phase) / rate
        assert articulation.gate(phones, "PP", times).max() == 1.0


def test_weights_are_parts_of_a_whole_and_rounding_is_anticipated():
    heard = spell("SIL", "SIL", "SIL", "T", "UW", "SIL", "SIL", "SIL")
    times = np.arange(48) / 60
    weights = articulation.viseme_weights(heard.phonemes, times)
    assert np.allclose(weights.sum(axis=1), 1.0)
    assert weights.min() >= 0.0
    rounding = weights[:, VISEMES.index("U")]
    assert rounding[int(0.3 * 60)] > 0.2  # 100 ms before the sound
    assert rounding.argmax() / 60 == pytest.approx(0.45, abs=0.05)


def test_vowels_change_what_a_consonant_looks_like():
    def rounding(*sounds):
        return animate(spell(*sounds)).curve(P + "mouthLipsPurseUL")[15]  # inside the consonant

    assert rounding("UW", "UW", "T", "UW", "UW") > 0.2
    assert rounding("IY", "IY", "T", "IY", "IY") < 0.02


def test_the_mouth_rests_in_silence_and_after_the_end():
    clip = animate(spell("AA", "B", "IY", *["SIL"] * 12, "OW"), blinks=False, accents=False)
    rest = clip.curves[:, int(0.9 * 60) : int(1.1 * 60)]
    assert np.abs(rest).max() < 0.02
    assert np.abs(clip.curves[:, -1]).max() < 0.05


def test_curves_are_smooth_and_in_range():
    sounds = "HH AH L OW SIL HH AW AA R Y UW T AH D EY SIL".split()
    heard = spell(*sounds, length=0.08)
    clip = animate(heard, rate=240.0, intensity=2.0, blinks=False)
    for name, curve in zip(clip.names, clip.curves, strict=True):
        if name != "head.pitch":
            assert curve.min() >= 0.0
            assert curve.max() <= 1.0
        turns = np.abs(np.diff(curve, 2)).max()
        assert turns < 0.006, name  # without rounding, twice as much


def test_intensity_scales_shapes_but_not_closures():
    low, high = (animate(spell("AA", "AA", "M", "AA"), intensity=x) for x in (0.5, 1.0))
    assert np.allclose(2 * low.curve(P + "jawOpen")[:5], high.curve(P + "jawOpen")[:5], atol=1e-5)
    closed = [c.curve(P + "mouthPressUL").max() for c in (low, high)]
    assert closed[0] == closed[1] > 0.1


def test_a_louder_vowel_opens_wider():
    quiet, loud = 0.1 * sine(150, RATE, 1.0), 0.5 * sine(150, RATE, 1.0)
    phones = [Phoneme(0.0, 1.0, "AA"), Phoneme(1.0, 2.0, "AA")]
    heard = Heard(phones, np.concatenate([quiet, loud]).astype(np.float32), True, [])
    jaw = animate(heard, accents=False).curve(P + "jawOpen")
    assert jaw[90] > 1.2 * jaw[30]


# ---- gestures ----


def test_blinks_come_at_a_natural_rate_near_pauses_and_from_the_seed():
    pauses = [Phoneme(t, t + 0.4, "SIL") for t in np.arange(3.0, 297.0, 6.0)]
    begins = gestures.blink_times(pauses, 300.0, 7)
    assert 12 <= len(begins) / 5.0 <= 30  # blinks per minute
    assert np.diff(begins).min() >= 0.9
    near = [min(abs(b - p.begin) for p in pauses) < 0.07 for b in begins]
    assert np.mean(near) > 0.3
    assert begins == gestures.blink_times(pauses, 300.0, 7)
    assert begins != gestures.blink_times(pauses, 300.0, 8)
    lids = gestures.blinks(np.arange(0, 1, 1 / 60), [0.2])[P + "eyeBlinkL"]
    assert lids.max() == 1.0
    assert 0.2 < (lids > 0.01).sum() / 60 < 0.35
    assert lids[0] == lids[-1] == 0.0


def test_pitch_of_tones_and_none_of_noise():
    for frequency in (80.0, 120.0, 220.0, 350.0):
        found = prosody.pitch(sine(frequency, RATE).astype(np.float32))
        assert np.nanmedian(found) == pytest.approx(12 * np.log2(frequency / 100), abs=0.6)
    noise = np.random.default_rng(0).normal(0, 0.1, RATE).astype(np.float32)
    assert np.isnan(prosody.pitch(noise)).mean() > 0.7


def test_the_loudest_and_highest_vowel_is_accented():
    sounds = [sine(120, RATE, 0.2) * 0.2 for _ in range(9)]
    sounds[4] = sine(170, RATE, 0.2) * 0.6
    phones = [Phoneme(i * 0.2, (i + 1) * 0.2, "AA") for i in range(9)]
    samples = np.concatenate(sounds).astype(np.float32)
    found = prosody.accents(phones, samples)
    assert [round(accent.time, 3) for accent in found] == [0.9]
    clip = animate(Heard(phones, samples, True, []))
    highest = clip.frame_times()[clip.curve(P + "browRaiseInL").argmax()]
    assert highest == pytest.approx(0.94, abs=0.1)
    assert clip.curve("head.pitch").min() < -0.01


# ---- the command, and errors ----


def test_command_writes_clips_and_phonemes(tmp_path, voice, capsys):
    path, _ = voice("My map.")
    out, table = tmp_path / "clip.json", tmp_path / "p.tsv"
    words = tmp_path / "words.txt"
    words.write_text("\ufeffMy map.", encoding="utf-8")
    command = ["speech", str(path), "-o", str(out), "--transcript", str(words), "--json"]
    assert cli.main([*command, "--phonemes", str(table)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["speech"] == "aligned"
    assert report["words"] == 2
    document = json.loads(out.read_text())
    assert document["metadata"]["transcript"] == "My map."
    assert P + "jawOpen" in document["curves"]
    rows = [line.split("\t") for line in table.read_text().splitlines()]
    assert rows[0] == ["begin", "end", "phoneme", "confidence", "word"]
    assert [row[2] for row in rows[1:] if row[2] != "SIL"] == "M AY M AE P".split()
    binary = tmp_path / "clip.rzc"
    assert cli.main([*command[:3], str(binary), "--text", "My map.", "--no-blinks"]) == 0
    assert P + "eyeBlinkL" not in Clip.load(binary)


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
def test_a_clip_and_its_phonemes_are_written_both_or_none(tmp_path, monkeypatch, capsys):
    out, table = tmp_path / "a.csv", tmp_path / "a.tsv"
    out.write_text("old")
    heard = Heard([Phoneme(0.0, 0.1, "AA")] * 20_000, np.zeros(0, np.float32), False, [])
    monkeypatch.setattr(command, "_spoken", lambda _args: (heard, Clip(["a"], [[0.0]], 30.0)))
    options = ["speech", "hum.wav", "-o", str(out), "--phonemes"]
    with no_room(200_000):
        assert cli.main([*options, str(table)]) == 1
    assert str(table) in capsys.readouterr().err
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a.csv", "old")]
    assert cli.main([*options, str(out)]) == 2
    assert "another file than that of -o" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "code", "sentence"),
    [
        (["-o", "clip.txt"], 2, "-o: a name ending in .rzc, .csv or .json"),
        (["-o", "clip.csv", "--rate", "0"], 2, "--rate: 1 to 1000"),
        (["-o", "clip.csv", "--intensity", "nan"], 2, "--intensity: 0 to 4"),
        (["-o", "clip.csv", "--seed", "-1"], 2, "--seed: 0 or more"),
        (["-o", "clip.csv"], 1, "nowhere.wav: cannot read it: No such file"),
        (["-o", "clip.csv", "--text", "..."], 1, "no English word"),
        (["-o", "clip.csv", "--transcript", "nowhere.txt"], 1, "nowhere.txt: cannot read it"),
    ],
)
def test_command_says_what_is_wrong(capsys, options, code, sentence):
    pytest.importorskip("pocketsphinx")
    assert cli.main(["speech", "nowhere.wav", *options]) == code
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1


def test_without_pocketsphinx_a_sentence_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    with pytest.raises(MissingError, match=r"pip install risorius\[speech\]"):
        listen(tmp_path / "any.wav")
