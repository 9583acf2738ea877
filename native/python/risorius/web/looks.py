# SPDX-License-Identifier: MIT
"""Makes the materials of a web page: textures named in the DNA file's metadata, scaled down, and
the masks of wrinkles."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._native import Dna
from ..files.jpeg import jpeg
from ..files.png import has_opacity, read_pixels
from .kinds import kind_of
from .textures import Textures, base_name, halved, media_type

Pixels = npt.NDArray[np.uint8]

_JPEG = "image/jpeg"
# Role of a picture -> (pixels of the longest side, JPEG quality). Wrinkles and hair are stored
# small, because wrinkles are soft and hair has few colours.
_SIZES = {
    "color": (1024, 82),
    "hair": (512, 75),
    "alpha": (1024, 72),
    "normal": (1024, 87),
    "roughness": (512, 75),
    "wrinkles": (512, 84),
    "masks": (1024, 80),
}
_ROLES = ("color", "alpha", "normal", "roughness")
_REGION = re.compile(r"head_wm([123])_(?!normal)[A-Za-z]+(?:_[A-Za-z]{1,2})?$")
# Pixels per side of a wrinkle mask. Masks are small, because they are soft and the page stores all
# of them in one picture.
_TILE = 128
_FLUSH = 3  # channel number after the three sets of wrinkle normals
# Newer exports store wrinkle normals as differences from the skin's normals, with 0.5 for no
# difference. Their mean blue is about 0.5, in complete normals about 1.
_OFFSET_BLUE = 0.75  # mean blue below which normals are differences


@dataclass
class Looks:
    """Materials and pictures of the page.

    Attributes:
        materials: table of each material: its kind, and role of a picture -> number of the picture.
        of_mesh: name of a mesh -> number of its material.
        pictures: (media type, bytes) of each picture.
    """

    materials: list[dict[str, Any]] = field(default_factory=list)
    of_mesh: dict[str, int] = field(default_factory=dict)
    pictures: list[tuple[str, bytes]] = field(default_factory=list)


def find_looks(dna: Dna, file: Path | None = None) -> Looks:
    """Makes a material for each mesh; the meshes of all LODs with the same base name share it.

    Args:
        dna: the face; its metadata `texture:<mesh>:<role>` names a file.
        file: path of the DNA file; pictures are in its folder or in <stem>_textures. None: no
            pictures.

    Returns:
        The materials, with the pictures that exist and that a browser can show.
    """
    return _Finder(dna, file).looks()


class _Finder:
    def __init__(self, dna: Dna, file: Path | None) -> None:
        self.dna = dna
        self.out = Looks()
        self.numbers: dict[tuple[str, str], dict[str, int]] = {}
        self.textures = Textures(dna, file)
        self.named = self.textures.named

    def looks(self) -> Looks:
        bases: dict[str, int] = {}
        for mesh in self.dna.mesh_names:
            base = base_name(mesh)
            if base not in bases:
                bases[base] = len(self.out.materials)
                self.out.materials.append(self._material(base, kind_of(mesh)))
            self.out.of_mesh[mesh] = bases[base]
        return self.out

    def _material(self, base: str, kind: str) -> dict[str, Any]:
        material: dict[str, Any] = {"kind": kind}
        named = self.named.get(base, {})
        for role in _ROLES:
            if role in named and (role in ("color", "alpha") or kind == "skin"):
                material.update(self._picture(named[role], role, kind))
        if kind == "skin":
            wrinkles = self._wrinkles(named)
            if wrinkles["maps"]:
                material["wrinkles"] = wrinkles
        return material

    def _picture(self, name: str, role: str, kind: str = "") -> dict[str, int]:
        """Role -> number of a picture; a colour picture with opacity is split into two pictures.

        Args:
            name: file name of the picture.
            role: role of the picture, such as color.
            kind: kind of the mesh, such as hair.
        """
        if (name, role) in self.numbers:
            return self.numbers[name, role]
        data = self.textures.read(name)
        found: dict[str, int] = {}
        if data:
            pixels = read_pixels(data, opacity=True)
            if pixels is None:
                found[role] = self._add(media_type(data), data)
                if has_opacity(data) and kind in ("hair", "lashes"):
                    found["cut"] = 1  # hair is cut by the opacity of the colour picture
            elif pixels.ndim == 3 and pixels.shape[2] == 4:
                found["color"] = self._compress(pixels[..., :3], "hair")
                found["alpha"] = self._compress(pixels[..., 3], "alpha")
            else:
                found[role] = self._compress(pixels, role.partition(":")[0])
        self.numbers[name, role] = found
        return found

    def _wrinkles(self, named: dict[str, str]) -> dict[str, Any]:
        """The table of a material's wrinkles: numbers of the pictures with normal maps, and the
        number of one picture with all masks.

        The list `maps` in the table contains [index of an animated map, tile in the picture of
        masks, index of the normal map or _FLUSH].

        Args:
            named: role of a picture of this material -> file name.
        """
        sets, offsets, maps = dict[int, int](), list[int](), list[list[int]]()
        tiles = list[Pixels]()
        for number in (1, 2, 3):
            pixels = self._pixels(named.get(f"normal:{number}", ""))
            if pixels is not None and pixels.ndim == 3:
                if pixels[..., 2].mean() < 255 * _OFFSET_BLUE:
                    offsets.append(number)
                sets[number] = self._compress(pixels, "wrinkles")
        for index, label in enumerate(self.dna.animated_map_names):
            region = _REGION.search(label)
            own = named.get(f"map:{label}", "")
            channel = int(region[1]) - 1 if region else _FLUSH
            if not own and (region is None or channel + 1 not in sets):
                continue
            mask = self._pixels(own or f"{region[0] if region else ''}_msk.png")
            if mask is not None and mask.ndim == 2:
                maps.append([index, len(tiles), _FLUSH if own else channel])
                tiles.append(_squared(mask))
        if not tiles:
            return {"maps": []}
        side = int(np.ceil(np.sqrt(len(tiles))))
        atlas = np.zeros((side * _TILE, side * _TILE), np.uint8)
        for i, tile in enumerate(tiles):
            row, column = i // side * _TILE, i % side * _TILE
            atlas[row : row + _TILE, column : column + _TILE] = tile
        masks = self._compress(atlas, "masks")
        return {"sets": sets, "offsets": offsets, "masks": masks, "side": side, "maps": maps}

    def _compress(self, pixels: Pixels, role: str) -> int:
        longest, quality = _SIZES.get(role, _SIZES["color"])
        fine = role in ("normal", "wrinkles")
        return self._add(_JPEG, jpeg(halved(pixels, longest), quality, fine_color=fine))

    def _add(self, media: str, data: bytes) -> int:
        self.out.pictures.append((media, data))
        return len(self.out.pictures) - 1

    def _pixels(self, name: str) -> Pixels | None:
        data = self.textures.read(name)
        return read_pixels(data) if data else None


def _squared(mask: Pixels) -> Pixels:
    """uint8[_TILE, _TILE]: a mask, halved while it is larger and then sampled at the nearest
    pixels."""
    small = halved(mask, _TILE)
    row, column = ((np.arange(_TILE) * size // _TILE).astype(np.int64) for size in small.shape)
    return small[row[:, None], column[None, :]]
