# SPDX-License-Identifier: MIT
"""Textures of mixed faces: those of the parents laid over each other, where all have them.

Skin has one tone: its pictures are mixed by the shares of the whole, also where a region has
others; those of eyes by the shares of their region. Only pictures that this package wrote are
mixed; of others the leading parent's file is taken as it is.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from .. import Dna
from ..author.geometry.skeleton import Doubles
from ..base.errors import ArgumentError
from ..base.reading import ReadingError, read_file
from ..files.names import folded, is_file_name
from ..files.png import png, read_png
from .hair import without_hair
from .mix import Mix
from .regions import Masks

_KEY = "texture:"
_MOST_BYTES = 1 << 28  # of a picture
_MASKS = "*_msk.png"  # of wrinkles, which are known by their names alone


def texture_folder(path: Path) -> Path:
    """Where the textures of a DNA file lie.

    Args:
        path: of the file.
    """
    return path.with_name(path.stem + "_textures")


def mix_textures(
    parents: Sequence[Dna], paths: Sequence[Path], mix: Mix, masks: Masks
) -> tuple[dict[str, bytes], list[str]]:
    """The textures that the leading parent's metadata name.

    Args:
        parents: compatible ones.
        paths: of their files.
        mix: their shares.
        masks: of the first one's regions.

    Returns:
        File name -> bytes, and the names of those that could not be mixed and are the leading
        parent's own.
    """
    whole = mix.whole()
    most = int(whole.argmax())
    meshes = list(without_hair(parents[0]).mesh_names)
    files: dict[str, bytes] = {}
    own: list[str] = []
    taken: set[str] = set()
    for key, name in parents[most].metadata.items():
        mesh = key.split(":")[1] if key.startswith(_KEY) and key.count(":") >= 2 else ""
        # A second name for one file of some system is left out as one that leads elsewhere is.
        if mesh not in meshes or not is_file_name(name) or folded(name) in taken:
            continue
        data = [_data(p, path, key) for p, path in zip(parents, paths, strict=True)]
        leading = data[most]
        if leading is None:
            continue
        part = masks.meshes[meshes.index(mesh)]
        rigid = len(part) > 0 and (part == part[0]).all() and part[0].max() == 1
        shares = mix.table()[int(part[0].argmax())] if rigid else whole
        mixed = _mixed(data, shares)
        files[name] = leading if mixed is None else mixed
        taken.add(folded(name))
        if mixed is None:
            own.append(name)
    for mask in sorted(texture_folder(paths[most]).glob(_MASKS)):
        data = [_bytes(path, mask.name) for path in paths]
        files[mask.name] = _mixed(data, whole) or read_file(mask, _MOST_BYTES, found=True)
    return files, own


def check_room(path: Path, pictures: Iterable[str]) -> None:
    """Refuse to write over pictures that belong to no face of this name.

    Args:
        path: of the new DNA file; where it is there, its pictures may be replaced with it.
        pictures: file names, which the parents' metadata have chosen.

    Raises:
        ArgumentError: the file is new, and a picture is there; names it.
    """
    for name in () if path.exists() else pictures:
        there = texture_folder(path) / name
        if there.exists():
            raise ArgumentError(
                f"{there}: a picture of this name is there, and no {path.name} that it belongs to: "
                "another name for the new face was expected"
            )


def _data(parent: Dna, path: Path, key: str) -> bytes | None:
    name = parent.metadata.get(key, "")
    return _bytes(path, name) if is_file_name(name) else None


def _bytes(path: Path, name: str) -> bytes | None:
    """A file beside a DNA file or in its folder of textures, if it is there."""
    for folder in (texture_folder(path), path.parent):
        with contextlib.suppress(OSError, ReadingError):
            return read_file(folder / name, _MOST_BYTES, found=True)
    return None


def _mixed(data: Sequence[bytes | None], shares: Doubles) -> bytes | None:
    """A picture of the parents' pictures, or None where they do not go together."""
    counted = [i for i, share in enumerate(shares) if share > 0]
    images = {i: read_png(data[i] or b"") for i in counted}
    shapes = {None if image is None else image.shape for image in images.values()}
    if len(shapes) != 1 or None in shapes:
        return None
    if len(counted) == 1:
        return data[counted[0]]
    return png(sum(shares[i] * image for i, image in images.items() if image is not None))
