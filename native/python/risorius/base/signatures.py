# SPDX-License-Identifier: MIT
"""Recognises the kind of a file by its bytes, independent of its name."""

from __future__ import annotations

import os
import re
from collections.abc import Container
from typing import NamedTuple

from .errors import RisoriusError

_PART = 1 << 16  # number of bytes at the start and at the end that are examined
_TEXT = 512


class Kind(NamedTuple):
    """A kind of file."""

    code: str
    words: str
    mend: str = ""
    """Advice to the user."""

    def __str__(self) -> str:
        return f"{self.words}: {self.mend}" if self.mend else self.words


SOUND = Kind(
    "sound", "a sound", "Speak from Audio in Blender, or `risorius speech` on the command line, "
    "moves a face to it",
)  # fmt: skip
FILM = Kind("film", "a film", "its sound goes through Speak from Audio or `risorius speech`")
FBX = Kind("fbx", "a binary FBX")
GLB = Kind("glb", "a binary glTF (.glb)")
_EXCEL = Kind("excel", "a spreadsheet (Excel)", "save it as CSV")
_WORD = Kind("word", "a document (Word)", "save it as plain text")
_OFFICE = Kind("office", "a document of an office program", "save it as CSV or as plain text")
_ZIP = Kind("zip", "an archive (ZIP)", "unpack it first")
_UNREAL = Kind("unreal", "an asset of Unreal", "export it there, as FBX, JSON or DNA")
# Bytes that identify a file, their offset in the file, and the kind of the file. Text files that
# people write hardly ever have such bytes there.
_BYTES = (
    (b"WAVE", 8, SOUND),
    (b"AIFF", 8, SOUND),
    (b"fLaC", 0, SOUND),
    (b"OggS", 0, SOUND),
    (b"ID3", 0, SOUND),
    (b"\xff\xfb", 0, SOUND),
    (b"ftyp", 4, FILM),
    (b"\x1a\x45\xdf\xa3", 0, FILM),
    (b"AVI ", 8, FILM),
    (b"Kaydara FBX Binary", 0, FBX),
    (b"glTF", 0, GLB),
    (b"\x89PNG", 0, Kind("picture", "a picture (PNG)")),
    (b"\xff\xd8\xff", 0, Kind("picture", "a picture (JPEG)")),
    (b"GIF8", 0, Kind("picture", "a picture (GIF)")),
    (b"WEBP", 8, Kind("picture", "a picture (WebP)")),
    (b"\x76\x2f\x31\x01", 0, Kind("picture", "a picture (EXR)")),
    (b"%PDF-", 0, Kind("pdf", "a document (PDF)")),
    (b"\xd0\xcf\x11\xe0", 0, _OFFICE),
    (b"\x1f\x8b", 0, Kind("gzip", "an archive (gzip)", "unpack it first")),
    (b"7z\xbc\xaf", 0, Kind("archive", "an archive (7-Zip)", "unpack it first")),
    (b"Rar!\x1a", 0, Kind("archive", "an archive (RAR)", "unpack it first")),
    (b"\xfd7zXZ", 0, Kind("archive", "an archive (xz)", "unpack it first")),
    (b"1AY&SY", 4, Kind("archive", "an archive (bzip2)", "unpack it first")),
    (b"ustar", 257, Kind("archive", "an archive (tar)", "unpack it first")),
    (b"BLENDER", 0, Kind("blend", "a scene of Blender (.blend)", "open it there")),
    (b"\x28\xb5\x2f\xfd", 0,
     Kind("zstd", "packed by Zstandard, as Blender packs its scenes (.blend)")),
    (b"\xc1\x83\x2a\x9e", 0, _UNREAL),
    (b"Ogawa", 0, Kind("alembic", "a scene (Alembic)")),
    (b"PXR-USDC", 0, Kind("usd", "a scene (USD)")),
    (b"DNA\0", 0,
     Kind("dna", "a face (DNA)", "Import DNA in Blender takes it, or give it as --rig")),
    (b"RZC\x1a", 0,
     Kind("rzc", "a clip of Risorius (.rzc)", "if its name ends otherwise, rename it")),
)  # fmt: skip
# Names of files inside a ZIP archive that show the kind of the document.
_INSIDE = (
    (b"xl/workbook", _EXCEL),
    (b"word/document", _WORD),
    (b"ppt/presentation", _OFFICE),
    (b"application/vnd.oasis.opendocument.spreadsheet",
     Kind("calc", "a spreadsheet (OpenDocument)", "save it as CSV")),
    (b"application/vnd.oasis.opendocument.text",
     Kind("writer", "a document (OpenDocument)", "save it as plain text")),
    (b".npy", Kind("npz", "arrays of NumPy (.npz)")),
)  # fmt: skip
_LFS = Kind(
    "git_lfs", "a pointer of Git LFS that stands for the file", "fetch the file by `git lfs pull`"
)
_PAGE = Kind("html", "a web page", "download the file itself")
_TEXTS = (
    (r"version https://git-lfs\.github\.com/spec/", _LFS),
    (r"<!doctype html|<html|<head\b|<\?xml[^>]*>\s*<(!doctype html|html)", _PAGE),
    (r"hierarchy\s+root\b",
     Kind("bvh", "motion of a body (BVH)", "export the curves of the face, as CSV or FBX")),
    (r"\{\\rtf", Kind("rtf", "a document (RTF)", "save it as plain text")),
    (r"#usda ", Kind("usd", "a scene (USD)")),
    (r"(<\?xml[^>]*>\s*)?<collada\b", Kind("collada", "a scene (Collada)")),
    (r"//maya ascii ", Kind("maya", "a scene of Maya", "export it there, as FBX")),
    (r"[a-z_]+-\d+\|[a-z_]+-\d+\|",
     Kind("ifacialmocap", "data of iFacialMocap as it sends them", "export the take as FBX")),
)  # fmt: skip


def kind_of(data: bytes) -> Kind | None:
    """The kind of a file by its bytes, or None if they do not identify it.

    Args:
        data: bytes of the file, or the result of `ends_of`.
    """
    for start, at, kind in _BYTES:
        if data[at : at + len(start)] == start:
            return kind
    if data[:4] in (b"PK\x03\x04", b"PK\x05\x06"):
        ends = data[:_PART] + data[-_PART:]
        return next((kind for name, kind in _INSIDE if name in ends), _ZIP)
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    text = data[: _TEXT - _TEXT % 2].decode(encoding, "ignore").lstrip().lower()
    return next((kind for pattern, kind in _TEXTS if re.match(pattern, text)), None)


def other_kind(data: bytes, own: Container[str] = ()) -> Kind | None:
    """The kind of a file, unless the reader accepts that kind.

    Args:
        data: bytes of the file, or the result of `ends_of`.
        own: codes of the kinds that the reader accepts.
    """
    kind = kind_of(data)
    return None if kind is None or kind.code in own else kind


def ends_of(source: str | os.PathLike[str] | bytes) -> bytes:
    """The start and the end of a file, enough for `kind_of`; empty if the path is no regular file
    or cannot be read.

    Pipes are not opened: they can be read only once, and opening one might wait for ever.
    """
    if isinstance(source, bytes | bytearray | memoryview):
        return bytes(source[:_PART]) + bytes(source[-_PART:])
    try:
        if not os.path.isfile(source):
            return b""
        with open(source, "rb") as file:
            begin = file.read(_PART)
            file.seek(max(file.seek(0, os.SEEK_END) - _PART, 0))
            return begin + file.read(_PART)
    except (OSError, ValueError):
        return b""


def named(error: RisoriusError, source: str | os.PathLike[str] | bytes) -> RisoriusError:
    """Add to a parse error the kind of file that was given, e.g. "it is a web page", if known.

    Args:
        error: error of the native module; its text may end with the faulty field in brackets.
        source: path or bytes of the file.
    """
    kind = kind_of(ends_of(source))
    if kind is None:
        return error
    text, place = str(error), f" [{error.where}]"
    before, mark, after = text.rpartition(place if error.where else "\n")
    told = type(error)(f"{before}; it is {kind}{mark}{after}" if mark else f"{text}; it is {kind}")
    told.code, told.where, told.offset = error.code, error.where, error.offset
    return told
