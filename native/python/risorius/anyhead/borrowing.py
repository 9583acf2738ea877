# SPDX-License-Identifier: MIT
"""Gives eyes, teeth and lashes that come from a template the textures of the template."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from .. import Dna
from ..author.heads.joining import FacePart
from ..author.heads.parts import Material
from ..author.heads.textures import texture_folder
from ..base.reading import read_file
from ..files.names import is_file_name

_ROLES = ("color", "normal", "roughness")
_MOST_BYTES = 1 << 28  # largest size of a texture file


def lend_materials(
    parts: Sequence[FacePart], template: Dna, path: Path, own: Collection[str]
) -> None:
    """Give the parts that come from a template the materials of the template's meshes.

    Args:
        parts: parts of the face; `source` of a part that comes from the template is the name of
            a mesh of the template.
        template: the face that the parts come from.
        path: the file of the template. Textures are read from its folder and from its texture
            folder; a missing texture is left out.
        own: sources of the head's own meshes; these parts are skipped, even if a mesh of the
            template has the same name.

    Raises:
        OSError: a texture exists but cannot be read.
    """
    lent = _materials(template, path)
    for part in parts:
        if part.material is None and part.source not in own:
            part.material = lent.get(part.source)


def _materials(template: Dna, path: Path) -> dict[str, Material]:
    """The materials of the template by mesh name."""
    out: dict[str, Material] = {}
    read: dict[str, bytes | None] = {}
    for key, name in template.metadata.items():
        kind, _, rest = key.partition(":")
        mesh, _, role = rest.partition(":")
        if kind != "texture" or role not in _ROLES or not is_file_name(name):
            continue
        if name not in read:
            read[name] = _bytes(path, name)
        data = read[name]
        if data is not None:
            base = mesh.partition("_lod")[0]
            out.setdefault(mesh, Material(base)).pictures[role] = data
    return out


def _bytes(path: Path, name: str) -> bytes | None:
    for folder in (texture_folder(path), path.parent):
        if (folder / name).is_file():
            return read_file(folder / name, _MOST_BYTES, found=True)
    return None
