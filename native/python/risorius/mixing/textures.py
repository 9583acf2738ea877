# SPDX-License-Identifier: MIT
"""Makes textures of mixed faces: blends a texture if all parents have it.

Skin textures are mixed by the shares of the whole face, because skin has one tone; textures of
rigid meshes, such as eyes and teeth, use the shares of their region. Only images written by this
package are mixed, and no hair textures,
because hair comes from one parent. For other images the file of the parent with the largest share
is used.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from .. import Dna
from ..author.geometry.skeleton import Doubles
from ..base.budget import Budget
from ..base.errors import ArgumentError
from ..base.reading import ReadingError, read_file
from ..files.names import folded, is_file_name
from ..files.png import Pixels, has_opacity, pixels_of, pixels_to_png, read_pixels
from .hair import without_hair
from .mix import Mix
from .regions import Masks

WHY = {
    "missing": "not every face has them",
    "opacity": "they have opacity, as hair has",
    "format": "Risorius mixes its own kind of PNG alone",
    "size": "the faces have them in different sizes",
}
"""Why an image comes from the leading parent alone: key -> reason."""
_KEY = "texture:"
_MOST_BYTES = 1 << 28  # bytes: larger images count as missing
_MASKS = "*_msk.png"  # wrinkle masks, which have no metadata entry and are recognised by name


def texture_folder(path: Path) -> Path:
    """The folder of a DNA file's textures: <name>_textures beside the file.

    Args:
        path: path of the DNA file.
    """
    return path.with_name(path.stem + "_textures")


def mix_textures(
    parents: Sequence[Dna], paths: Sequence[Path], mix: Mix, masks: Masks
) -> tuple[dict[str, bytes], dict[str, str]]:
    """Mixes the textures in the metadata of the leading parent, which has the largest share, and
    the wrinkle masks (*_msk.png) in its texture folder.

    Args:
        parents: compatible faces.
        paths: paths of their DNA files.
        mix: shares of the parents.
        masks: masks of the first parent's regions.

    Returns:
        File name -> bytes; and file name -> key in WHY of the reason, for textures in the metadata
        that come from the leading parent alone. A texture that the leading parent lacks is left
        out.

    Raises:
        BudgetError: small files that declare huge images.
        OSError: a wrinkle mask of the leading parent cannot be read.
        ReadingError: a wrinkle mask of the leading parent is larger than 256 MB.
    """
    whole = mix.whole()
    most = int(whole.argmax())
    meshes = list(without_hair(parents[0]).mesh_names)
    files: dict[str, bytes] = {}
    own: dict[str, str] = {}
    taken: set[str] = set()
    for key, name in parents[most].metadata.items():
        mesh = key.split(":")[1] if key.startswith(_KEY) and key.count(":") >= 2 else ""
        # Skips a name that differs from an earlier name only in a way that some file systems
        # ignore, such as letter case, and names that lead to other folders.
        if mesh not in meshes or not is_file_name(name) or folded(name) in taken:
            continue
        data = [_data(p, path, key) for p, path in zip(parents, paths, strict=True)]
        leading = data[most]
        if leading is None:
            continue
        shares = _shares(mix, masks, meshes.index(mesh))
        why = _why_not(data, shares)
        mixed = b"" if why else _mixed(data, shares)
        files[name] = mixed or leading
        taken.add(folded(name))
        if not mixed:
            own[name] = why or "format"
    for mask in sorted(texture_folder(paths[most]).glob(_MASKS)):
        data = [_bytes(path, mask.name) for path in paths]
        mixed = b"" if _why_not(data, whole) else _mixed(data, whole)
        files[mask.name] = mixed or read_file(mask, _MOST_BYTES, found=True)
    return files, own


def check_room(path: Path, pictures: Iterable[str]) -> None:
    """Refuses to overwrite images in the texture folder if the DNA file does not exist yet.

    Args:
        path: path of the new DNA file; if it exists, its images may be replaced.
        pictures: file names from the parents' metadata.

    Raises:
        ArgumentError: the DNA file is new but an image exists; the error names the image.
    """
    for name in () if path.exists() else pictures:
        there = texture_folder(path) / name
        if there.exists():
            raise ArgumentError(
                f"{there}: a picture of this name is there, and no {path.name} that uses it: "
                "choose another name for the new face"
            )


def _shares(mix: Mix, masks: Masks, mesh: int) -> Doubles:
    """float64[P]: the parents' shares in a mesh's textures: for a rigid mesh the shares of its
    region, for any other mesh the shares of the whole face."""
    part = masks.meshes[mesh] if mix.regions else np.zeros((0, 1))
    rigid = len(part) > 0 and (part == part[0]).all() and part[0].max() == 1
    return np.asarray(mix.table()[int(part[0].argmax())] if rigid else mix.whole())


def _data(parent: Dna, path: Path, key: str) -> bytes | None:
    name = parent.metadata.get(key, "")
    return _bytes(path, name) if is_file_name(name) else None


def _bytes(path: Path, name: str) -> bytes | None:
    """The bytes of a file in the texture folder or beside the DNA file; None if there is none.

    Args:
        path: path of the DNA file.
        name: name of the file to read.
    """
    for folder in (texture_folder(path), path.parent):
        with contextlib.suppress(OSError, ReadingError):
            return read_file(folder / name, _MOST_BYTES, found=True)
    return None


def _why_not(data: Sequence[bytes | None], shares: Doubles) -> str:
    """The dictionary key in WHY of the reason why images cannot be mixed; "" if they can.

    Args:
        data: bytes of the image of each parent, or None.
        shares: float64[P]; parents with the share 0 do not count.
    """
    counted = [found for found, share in zip(data, shares, strict=True) if share > 0]
    if None in counted:
        return "missing"
    files = [found or b"" for found in counted]
    if any(has_opacity(file) for file in files):
        return "opacity"
    shapes = {pixels_of(file) for file in files}
    if None in shapes:
        return "format"
    return "" if len(shapes) == 1 else "size"


def _mixed(data: Sequence[bytes | None], shares: Doubles) -> bytes:
    """The weighted mean of images with equal sizes; empty if one is damaged.

    Args:
        data: bytes of the image of each parent.
        shares: float64[P]; parents with the share 0 do not count.
    """
    counted = {i: data[i] or b"" for i, share in enumerate(shares) if share > 0}
    if len(counted) == 1:
        return next(iter(counted.values()))
    sizes = [math.prod(pixels_of(file) or (0,)) for file in counted.values()]
    Budget.of(sum(map(len, counted.values()))).hold(sum(sizes), "pictures of the faces")
    images: dict[int, Pixels] = {}
    for i, file in counted.items():
        image = read_pixels(file)
        if image is None:
            return b""
        images[i] = image
    out = np.empty_like(next(iter(images.values())))
    for row in range(len(out)):
        out[row] = np.rint(sum(shares[i] * image[row] for i, image in images.items()))
    return pixels_to_png(out)
