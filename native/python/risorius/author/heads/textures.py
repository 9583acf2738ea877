# SPDX-License-Identifier: MIT
"""Makes texture files in a folder next to a DNA file, and metadata that assigns them to meshes."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...base.words import joined
from ...files.png import png
from .parts import Material

_KINDS = ((b"\x89PNG\r\n\x1a\n", ".png"), (b"\xff\xd8\xff", ".jpg"), (b"BM", ".bmp"))
_LARGE = 8192  # pixels per side above which a note is added
_WHITE = 0.999
_LOD = re.compile(r"_lod\d+_")


@dataclass
class Textures:
    """Texture files in a folder next to a DNA file.

    Attributes:
        files: path -> bytes.
        names: (id() of a Material, role) -> file name.
        notes: sentences on left-out parts of materials, and on the folder of the files.
    """

    files: dict[Path, bytes] = field(default_factory=dict)
    names: dict[tuple[int, str], str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def texture_folder(dna: Path) -> Path:
    """The folder in which readers search for the textures of a DNA file."""
    return dna.with_name(f"{dna.stem}_textures")


def textures_of(materials: Mapping[str, Material], folder: Path) -> Textures:
    """The texture files of a face's materials. A colour other than white without a picture becomes
    a picture of 4 x 4 pixels.

    Args:
        materials: name of a mesh of LOD 0 -> its material.
        folder: folder of the files.
    """
    out, written = Textures(), dict[tuple[bool, bytes], str]()
    for material in {id(m): m for m in materials.values()}.values():
        out.notes.extend(material.notes)
        pictures = dict(material.pictures)
        tint = material.color
        if "color" not in pictures and tint is not None and min(tint) < _WHITE:
            values = tint if tint[3] < _WHITE else tint[:3]
            pictures["color"] = png(np.broadcast_to(np.array(values), (4, 4, len(values))))
        for role, data in pictures.items():
            kind = _kind_of(data)
            if not kind:
                out.notes.append(
                    f"{material.name}: its {role} texture is left out: PNG, JPEG, WebP or BMP was "
                    "expected"
                )
                continue
            key = (role == "orm", data)  # file names of orm textures say that channels are packed
            if key not in written:
                written[key] = _free(f"{_plain(material.name)}_{role}", kind, out.files)
                out.files[folder / written[key]] = data
                size = _size_of(data)
                if max(size) > _LARGE:
                    out.notes.append(_too_large(material.name, role, size))
            out.names[id(material), role] = written[key]
    if out.files:
        shown = {number for number, _ in out.names}
        meshes = [_LOD.split(name)[0] for name, m in materials.items() if id(m) in shown]
        out.notes.append(f"{folder}: textures of {joined(dict.fromkeys(meshes))}")
    return out


def metadata_of(
    meshes: Iterable[str], materials: Mapping[str, Material], textures: Textures
) -> dict[str, str]:
    """The metadata of a DNA file that assigns textures to meshes.

    Args:
        meshes: names of the meshes of all LODs.
        materials: name of a mesh of LOD 0 -> its material.
        textures: result of textures_of().
    """
    out = {}
    for name in meshes:
        material = materials.get(_LOD.sub("_lod0_", name))
        for (number, role), file in textures.names.items():
            if number == id(material):
                use = "roughness" if role == "orm" else role  # the file's name says orm
                out[f"texture:{name}:{use}"] = file
    return out


def _too_large(name: str, role: str, size: tuple[int, int]) -> str:
    width, height = size
    return (
        f"{name}: its {role} texture has {width:,} x {height:,} pixels, "
        f"{width * height * 4 / 1e9:.1f} GB in memory: make it smaller than {_LARGE:,} pixels"
    )


def _plain(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_") or "material"


def _free(stem: str, kind: str, taken: Iterable[Path]) -> str:
    number, used = 1, {path.name.lower() for path in taken}
    first, _, role = stem.rpartition("_")
    while f"{stem}{kind}".lower() in used:
        number += 1
        stem = f"{first}{number}_{role}"
    return stem + kind


def _kind_of(data: bytes) -> str:
    """The file ending for a picture's format; "" for formats that Blender does not read."""
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return ".webp"
    return next((kind for start, kind in _KINDS if data.startswith(start)), "")


def _size_of(data: bytes) -> tuple[int, int]:
    """Width and height of a PNG or JPEG in pixels; (0, 0) for other formats."""
    if data.startswith(_KINDS[0][0]) and len(data) >= 24:
        width, height = struct.unpack(">II", data[16:24])
        return width, height
    at = 2
    while data.startswith(_KINDS[1][0]) and at + 9 < len(data) and data[at] == 0xFF:
        if 0xC0 <= data[at + 1] <= 0xCF and data[at + 1] not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            return width, height
        at += 2 + struct.unpack(">H", data[at + 2 : at + 4])[0]
    return 0, 0
