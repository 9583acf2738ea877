# SPDX-License-Identifier: MIT
"""The textures that a DNA file names in its metadata, as a page can hold them."""

from __future__ import annotations

import base64
from pathlib import Path

from .._native import Dna
from ..files.names import is_file_name

_KINDS = {
    b"\x89PNG\r\n\x1a\n": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
}
_ROLES = ("color", "alpha")
_MOST = 16 << 20  # bytes of one picture

Pictures = dict[str, dict[str, str]]
"""Mesh -> role -> a data URL."""


def find_pictures(dna: Dna, file: Path) -> Pictures:
    """The pictures of `texture:<mesh>:<role>` that lie beside a DNA file or in <stem>_textures.

    Args:
        dna: has the metadata.
        file: the DNA file.

    Returns:
        Those that are there, with the roles "color" and "alpha"; what a browser cannot show is
        left out.
    """
    folders = (file.with_name(f"{file.stem}_textures"), file.parent)
    urls: dict[str, str] = {}
    found: Pictures = {}
    for key, name in dna.metadata.items():
        words = key.split(":", 2)
        if len(words) != 3 or words[0] != "texture" or words[2] not in _ROLES:
            continue
        if name not in urls:
            urls[name] = _url(name, folders)
        if urls[name]:
            found.setdefault(words[1], {})[words[2]] = urls[name]
    return found


def _url(name: str, folders: tuple[Path, ...]) -> str:
    """A data URL, "" where no such picture is there. Metadata may name no file elsewhere."""
    if not is_file_name(name):
        return ""
    for folder in folders:
        path = folder / name
        if path.is_file() and path.stat().st_size <= _MOST:
            data = path.read_bytes()
            kind = next((kind for start, kind in _KINDS.items() if data.startswith(start)), "")
            return f"data:{kind};base64,{base64.b64encode(data).decode()}" if kind else ""
    return ""
