# SPDX-License-Identifier: MIT
"""Tests files of words and phonemes: written, corrected by other programs, and read."""

import json
import sys
import wave

import numpy as np
import pytest
from risorius import Clip, cli, expressions, speech
from risorius.speech import letters, sheets, spelling
from risorius.speech.audio import RATE
from risorius.speech.phones import CLASS_OF, VISEMES, Phoneme, label_of, phone_named

JAW = "CTRL_expressions.jawOpen"
PHONES = [
    Phoneme(0.0, 0.1, "SIL"), Phoneme(0.1, 0.2, "M", 0.5, "mama"), Phoneme(0.2, 0.3, "AA"),
    Phoneme(0.3, 0.4, "M"), Phoneme(0.4, 0.5, "AA"), Phoneme(0.5, 0.6, "SIL"),
    Phoneme(0.6, 0.8, "OW", 0.5, "o\"oh"),
]  # fmt: skip


@pytest.fixture(scope="module")
def voice(tmp_path_factory):
    """A WAV file with a tone of 0.9 s."""
    path = tmp_path_factory.mktemp("voice") / "hum.wav"
    tone = 9000 * np.sin(2 * np.pi * 150 * np.arange(int(0.9 * RATE)) / RATE)
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes(tone.astype("<i2").tobytes())
    return path


def _said(found):
    return [(round(p.begin, 3), round(p.end, 3), p.name, p.word) for p in found if p.name != "SIL"]


@pytest.mark.parametrize("name", ["a.tsv", "a.TextGrid"])
def test_what_was_written_is_read(name):
    assert _said(sheets.read(sheets.write(PHONES, name).encode(), name)) == _said(PHONES)


def test_files_of_praat_and_of_aligners_are_read():
    """A short TextGrid in UTF-16 is read, with stress, a point tier, other tier names and gaps."""
    short = """File type = "ooTextFile"
        "TextGrid" 0 0.8 <exists> 3
        "TextTier" "clicks" 0 0.8 1 0.4 "here" ! nobody asks
        "IntervalTier" "Ann - words" 0 0.8 1 0.1 0.5 "mama"
        "IntervalTier" "Ann - phones" 0 0.8 5
        0 0.1 "" 0.1 0.2 "m" 0.2 0.3 "AA1" 0.3 0.4 "M B P" 0.45 0.5 "aa" """
    found = sheets.read(short.encode("utf-16"), "a.TextGrid")
    assert [(p.name, p.word) for p in found][1:] == [
        ("M", "mama"),
        ("AA", ""),
        ("P", ""),
        ("AA", ""),
    ]
    assert found[-1].begin == 0.45


def test_every_mouth_is_found_by_the_names_that_animators_and_programs_have_for_it():
    for viseme in VISEMES:
        for name in (viseme, expressions.get(viseme).label, expressions.get(viseme).label.upper()):
            assert CLASS_OF[phone_named(name)] == viseme
    assert all(phone_named(f"{phone.lower()}1") == phone for phone in CLASS_OF)
    assert [label_of(phone) for phone in ("B", "V", "UW")] == ["M B P", "F V", "Oo"]
    assert phone_named("Q") is None


def test_a_corrected_file_moves_the_mouth_without_a_recogniser(
    voice, tmp_path, monkeypatch, capsys
):
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    said, out, again = tmp_path / "said.TextGrid", tmp_path / "a.rzc", tmp_path / "b.tsv"
    said.write_text(sheets.textgrid(PHONES))
    command = ["speech", str(voice), "-o", str(out), "--json", "--read"]
    assert cli.main([*command, str(said), "--phonemes", str(again)]) == 0
    assert json.loads(capsys.readouterr().out)["words"] == 2
    clip = Clip.load(out)
    words = [(e.value, round(e.duration, 3)) for e in clip.events if e.name == "word"]
    assert words == [("mama", 0.4), ('o"oh', 0.2)]
    assert _said(sheets.read(again.read_bytes(), "b.tsv")) == _said(PHONES)
    said.write_text(sheets.textgrid(PHONES).replace('"AA"', '"UW"'))
    assert cli.main([*command, str(said)]) == 0
    assert Clip.load(out).curve(JAW)[15] < 0.6 * clip.curve(JAW)[15]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "a TextGrid, or lines with tabs under a first line of begin, end"),
        ("begin\tend\tphoneme\n0\t0.1\tQ\n", "line 2: a phoneme such as AA, a mouth such as M B P"),
        ("begin\tend\tphoneme\n0.2\t0.1\tAA\n", "line 2: times that ascend from 0 s"),
        ("begin\tend\tphoneme\nnan\t1\tAA\n", "line 2: begin: seconds from 0 on"),
        ("begin\tend\tphoneme\n0\t1\tsil\n", "found none but silence"),
        ("begin\tend\tphoneme\n3\t4\tAA\n", "AA at 3 s begins after the end of the voice at 0.9"),
        ('"ooTextFile" "TextGrid" 0 1 <exists> 1 "IntervalTier" "words" 0 1 0', "tiers words"),
        ('"ooTextFile" "TextGrid" 0 1 <exists> 1 "IntervalTier" "phones" 0', "the file ends where"),
        ('"ooTextFile" "TextGrid" 0 1 <exists>\n"a"', "line 2: a number was expected"),
        ('"ooTextFile" "TextGrid" 0 1 <exists> 1e9', "a number of parts was expected"),
    ],
)
def test_files_that_cannot_be_used_are_refused_in_a_sentence(
    voice, tmp_path, capsys, text, sentence
):
    path = tmp_path / "bad.txt"
    path.write_text(text)
    out = tmp_path / "a.rzc"
    assert cli.main(["speech", str(voice), "-o", str(out), "--read", str(path)]) == 1
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1
    assert not out.exists()


def test_no_file_cut_anywhere_escapes_as_another_error():
    for text in (sheets.textgrid(PHONES), sheets.table(PHONES)):
        for cut in range(0, len(text), 7):
            try:
                assert sheets.read(text[:cut].encode(), "cut")
            except sheets.SheetError as error:
                assert str(error).startswith("cut: ")


def test_a_correctable_voice_has_all_that_its_mouth_is_made_of(voice):
    heard = speech.listening.follow(voice, PHONES)
    clip = speech.animate(heard, rate=24.0, correctable=True)
    opened = np.array([float(n) for n in clip.metadata["openness"].split()]) / 1000.0
    curves = speech.mouth(heard.phonemes, opened, clip.frame_times())
    assert len(curves) > 20
    for name, curve in curves.items():
        np.testing.assert_allclose(clip.curve(name), curve, atol=1e-7)
    assert float(clip.metadata["seconds"]) == pytest.approx(0.9)
    assert "openness" not in speech.animate(heard).metadata


def test_words_are_spelled_by_the_dictionary_and_without_one_by_rule(tmp_path):
    place = tmp_path / "pocketsphinx"
    (place / "model/en-us").mkdir(parents=True)
    (place / "__init__.py").write_text("raise ImportError")
    (place / "model/en-us/cmudict-en-us.dict").write_text("one W AH N\none(2) HH W AH N\n")
    assert spelling.spell("1, zorblax!", [str(tmp_path)]) == [
        ("one", ["W", "AH", "N"]),
        ("zorblax", "Z AO R B L AE K S".split()),
    ]
    assert spelling.spell("one", []) == [("one", letters.pronounce("one"))]
    with pytest.raises(ValueError, match="a word of the letters a to z was expected, found '!'"):
        spelling.spell("!", [])


def test_a_face_speaks_with_visemes_of_its_own(tmp_path, voice, capsys):
    own = expressions.Expression("aa", "A", "viseme", "", {"CTRL_expressions.viseme_aa": 1.0})
    library, said, out = tmp_path / "anna_expressions", tmp_path / "a.tsv", tmp_path / "a.rzc"
    library.mkdir()
    (library / "aa.toml").write_text(expressions.text_of(own))
    said.write_text(sheets.write(PHONES, "a.tsv"))
    command = ["speech", str(voice), "-o", str(out), "--read", str(said), "--expressions"]
    assert cli.main([*command, str(library)]) == 0
    mine, ours = Clip.load(out), speech.animate(speech.listening.follow(voice, PHONES))
    spoken = mine.curves[mine.names.index("CTRL_expressions.viseme_aa")]
    assert spoken.max() > 0.5
    assert 0.2 < mine.frame_times()[spoken.argmax()] < 0.5  # during the two AA
    closed = "CTRL_expressions.mouthPressUL"  # PP uses this control, but this library lacks PP
    assert np.array_equal(
        mine.curves[mine.names.index(closed)], ours.curves[ours.names.index(closed)]
    )
    capsys.readouterr()
    for wrong in (tmp_path / "nowhere", tmp_path):
        assert cli.main([*command, str(wrong)]) == 1
        error = capsys.readouterr().err
        assert error.count("\n") == 1
        assert str(wrong) in error
