# SPDX-License-Identifier: MIT
"""Tests that every reader names a file of another kind by its kind, whatever the file's name."""

from __future__ import annotations

import gzip
import io
import zipfile
from pathlib import Path

import pytest
import risorius
from conftest import GOLDEN
from risorius import importing
from risorius.author.input import fbx, gltf, obj
from risorius.base import signatures
from risorius.cli import main
from risorius.cli.files import from_json
from risorius.solving.performance import read_performance
from risorius.speech.audio import read_audio


def archive(*names):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        for name in names:
            file.writestr(name, "<a/>" * 50)
    return out.getvalue()


CONTENT = bytes(range(256)) * 2
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 29283848\n"
BVH = b"HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 0 0\n}\nMOTION\nFrames: 2\n"
PAGE = b"<!DOCTYPE html>\n<html><head><title>Sign in</title></head><body>1,2</body></html>"
KINDS = {
    "a sound": b"RIFF\x24\0\0\0WAVEfmt \x10\0\0\0" + CONTENT,
    "a sound: Speak from Audio in Blender": b"fLaC\0\0\0\x22" + CONTENT,
    "a sound: Speak": b"ID3\x04\0\0\0\0" + CONTENT,
    "a film": b"\0\0\0\x20ftypisom" + CONTENT,
    "a picture (PNG)": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + CONTENT,
    "a picture (JPEG)": b"\xff\xd8\xff\xe0\0\x10JFIF" + CONTENT,
    "a document (PDF)": b"%PDF-1.7\n" + CONTENT,
    "a spreadsheet (Excel): save it as CSV": archive("[Content_Types].xml", "xl/workbook.xml"),
    "a document (Word): save it as plain text": archive("_rels/.rels", "word/document.xml"),
    "a document of an office program": b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + CONTENT,
    "an archive (ZIP): unpack it first": archive("face.dna"),
    "an archive (gzip): unpack it first": gzip.compress(CONTENT),
    "an archive (7-Zip): unpack it first": b"7z\xbc\xaf\x27\x1c" + CONTENT,
    "a scene of Blender (.blend)": b"BLENDER-v405" + CONTENT,
    "packed by Zstandard": b"\x28\xb5\x2f\xfd\x04\0" + CONTENT,
    "an asset of Unreal": b"\xc1\x83\x2a\x9e" + CONTENT,
    "a face (DNA)": b"DNA\0\2\0\x08\0\0\0\x0bd" + CONTENT,
    "a clip of Risorius (.rzc)": b"RZC\x1a" + CONTENT,
    "a binary FBX": b"Kaydara FBX Binary  \0\x1a\0" + CONTENT,
    "a binary glTF (.glb)": b"glTF\2\0\0\0" + CONTENT,
    "a pointer of Git LFS": LFS,
    "motion of a body (BVH)": BVH,
    "a web page: download the file itself": PAGE,
    "a web page": b'\xef\xbb\xbf<?xml version="1.0"?>\n<html xmlns="x"></html>',
    "a document (RTF)": b"{\\rtf1\\ansi Hello.}",
    "a scene (Collada)": b'<?xml version="1.0"?>\n<COLLADA version="1.4.1"></COLLADA>',
    "data of iFacialMocap": b"eyeBlink_R-0|jawOpen-12|=head#-2.1,3.5,0.1|\n",
}


READERS = {
    # A row has the reader, the suffix of the test's file, and words that occur in names of KINDS.
    # Kinds with such a word are not tested with this reader, because it reads such files or has a
    # more detailed error for them.
    "animation": (importing.read, "csv", ("FBX", "glTF")),
    "json of animation": (lambda p: importing.read(p, kind="json"), "json", ("FBX", "glTF")),
    "clip": (risorius.Clip.load, "rzc", ("clip of",)),
    "face": (risorius.load, "dna", ("face (DNA)",)),
    "face in memory": (lambda p: risorius.load(p.read_bytes()), "dna", ("face (DNA)",)),
    "face as JSON": (lambda p: from_json(str(p)), "json", ()),
    "OBJ": (obj.read_obj, "obj", ()),
    "expression": (lambda p: obj.read_positions(p, 3), "obj", ()),
    "glTF": (gltf.read_gltf, "gltf", ("glTF",)),
    "FBX": (fbx.read_fbx, "fbx", ("FBX",)),
    "voice": (read_audio, "wav", ("sound", "film")),
    "vertices": (read_performance, "npz", ("ZIP",)),
}


@pytest.mark.parametrize("reader", READERS)
def test_every_reader_calls_a_file_of_another_kind_by_its_kind(reader, tmp_path):
    read, suffix, own = READERS[reader]
    path = tmp_path / f"file.{suffix}"
    for words, data in KINDS.items():
        if any(word in words for word in own):
            continue
        path.write_bytes(data)
        with pytest.raises(risorius.RisoriusError) as found:
            read(path)
        assert words in str(found.value)
        assert reader == "face in memory" or str(found.value).startswith(str(path))
        assert "\n" not in str(found.value)


@pytest.mark.parametrize("words", ["a pointer of Git LFS", "an archive (ZIP)", "an archive (gzip)"])
def test_a_face_that_was_not_fetched_or_unpacked_keeps_its_code(words, tmp_path, capsys):
    path = tmp_path / "face.dna"
    path.write_bytes(next(data for name, data in KINDS.items() if name.startswith(words)))
    with pytest.raises(risorius.DnaError) as found:
        risorius.load(path)
    assert (found.value.code, found.value.where, found.value.offset) == ("not_dna", "signature", 0)
    (finding,) = risorius.check(path)
    assert (finding.code, finding.offset, finding.is_error) == ("not_dna", 0, True)
    commands = (["info"], ["convert", str(tmp_path / "o.json")], ["check"], ["eval"])
    for command, *more in commands:
        assert main([command, str(path), *more]) == 1
        out = capsys.readouterr()
        assert f"it is {words}" in out.out + out.err
        assert "Traceback" not in out.err


def test_what_a_reader_takes_has_no_other_kind():
    for path in (GOLDEN / "core.dna", Path(__file__)):
        data = path.read_bytes()
        kind = signatures.kind_of(data)
        assert (kind.code if kind else "") == ("dna" if path.suffix == ".dna" else "")
    for text in ("time,a\n0,1\n", '{"fps": 30}', "PK,a\n1,2\n", "", "MohoSwitch1\n1 rest\n"):
        assert signatures.kind_of(text.encode()) is None
        assert signatures.kind_of(text.encode("utf-16")) is None
    assert signatures.kind_of(PAGE.decode().encode("utf-16")).code == "html"


def test_speech_says_what_a_transcript_is_and_takes_no_file_for_words(tmp_path, capsys):
    voice, words = tmp_path / "voice.wav", tmp_path / "words.docx"
    voice.write_bytes(b"RIFF\x24\0\0\0WAVE")
    words.write_bytes(archive("word/document.xml"))
    out = ["-o", str(tmp_path / "out.rzc")]
    assert main(["speech", str(voice), *out, "--transcript", str(words)]) == 1
    said = capsys.readouterr().err
    assert f"{words}: text was expected, this is a document (Word): save it as plain text" in said
    assert main(["speech", str(voice), *out, "--text", str(words)]) == 2
    assert "--transcript reads it" in capsys.readouterr().err


def test_a_pointer_to_a_file_that_is_not_there_stays_an_error_of_reading(tmp_path):
    assert signatures.ends_of(tmp_path / "none.dna") == b""
    with pytest.raises(risorius.DnaError) as found:
        risorius.load(tmp_path / "none.dna")
    assert found.value.code != "not_dna"
