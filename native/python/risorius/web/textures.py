# SPDX-License-Identifier: MIT
"""Reads the textures that a DNA file names in its metadata, and scales them down."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .._native import Dna
from ..files.names import is_file_name

Pixels = npt.NDArray[np.uint8]

_KINDS = {
    b"\x89PNG\r\n\x1a\n": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
}
_MOST = 16 << 20  # bytes: larger pictures are not read
_LOD = re.compile(r"_lod\d+.*", re.IGNORECASE)


class Textures:
    """The textures of a face.

    Attributes:
        named: name of a mesh without its LOD -> role of a picture -> file name.
    """

    def __init__(self, dna: Dna, file: Path | None) -> None:
        """Read the names of the textures.

        Args:
            dna: the face, whose metadata names the textures.
            file: path of the DNA file; pictures are in its folder or in <stem>_textures. None: no
                pictures.
        """
        self._folders = (
            () if file is None else (file.with_name(f"{file.stem}_textures"), file.parent)
        )
        self.named: dict[str, dict[str, str]] = {}
        for key, name in dna.metadata.items():
            words = key.split(":", 2)
            if len(words) == 3 and words[0] == "texture":
                self.named.setdefault(base_name(words[1]), {}).setdefault(words[2], name)

    def read(self, name: str) -> bytes:
        """The bytes of a picture; b"" if it is missing or too large, no
        browser shows it, or its name leads to another folder."""
        if not is_file_name(name):
            return b""
        for folder in self._folders:
            path = folder / name
            if path.is_file() and path.stat().st_size <= _MOST:
                data = path.read_bytes()
                return data if media_type(data) else b""
        return b""


def base_name(mesh: str) -> str:
    """A mesh's name without its LOD, e.g. head for head_lod0_mesh."""
    return _LOD.sub("", mesh)


def media_type(data: bytes) -> str:
    """The media type of a picture's bytes, "" for formats that no browser shows."""
    return next((kind for start, kind in _KINDS.items() if data.startswith(start)), "")


def halved(pixels: Pixels, longest: int) -> Pixels:
    """Halves a picture repeatedly, by the mean of 2 x 2 pixels, until no side is longer than
    `longest`, or until one side has a single pixel.

    Args:
        pixels: uint8[h, w] or [h, w, k].
        longest: largest number of pixels of a side.
    """
    while max(pixels.shape[:2]) > longest and min(pixels.shape[:2]) > 1:
        rows, columns = pixels.shape[0] // 2 * 2, pixels.shape[1] // 2 * 2
        four = [pixels[i:rows:2, j:columns:2].astype(np.uint16) for i in (0, 1) for j in (0, 1)]
        pixels = ((sum(four[1:], four[0]) + 2) // 4).astype(np.uint8)
    return pixels
