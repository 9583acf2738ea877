# SPDX-License-Identifier: MIT
"""Materials of a game face, with the textures from the DNA file's folder scaled down."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._native import Dna
from ..files.jpeg import jpeg
from ..files.png import pixels_of, pixels_to_png, read_pixels
from ..web.kinds import kind_of
from ..web.textures import Textures, base_name, halved, media_type
from .glb import Glb
from .naming import safe

Pixels = npt.NDArray[np.uint8]

LARGEST = 8192
# media types of pictures that are stored unchanged if their pixels cannot be read
_AS_THEY_ARE = ("image/png", "image/jpeg")
_QUALITY = {"color": 85, "normal": 88, "roughness": 75}
# Kind of a mesh -> colour and roughness of its material if the mesh has no texture.
_PLAIN = {
    "skin": ((0.72, 0.50, 0.41), 0.55), "eyes": ((0.85, 0.83, 0.80), 0.25),
    "teeth": ((0.86, 0.80, 0.70), 0.3), "tongue": ((0.60, 0.28, 0.27), 0.45),
    "gum": ((0.66, 0.33, 0.32), 0.4), "hair": ((0.10, 0.06, 0.04), 0.6),
    "lashes": ((0.04, 0.03, 0.02), 0.7), "cloth": ((0.35, 0.36, 0.40), 0.9),
    "wet": ((1.0, 1.0, 1.0), 0.05),
}  # fmt: skip
_WET = 0.06  # opacity of tears and corneas
_SMOOTH = {"magFilter": 9729, "minFilter": 9987}  # glTF's codes of a linear filter with mipmaps
_CUT = 0.35  # opacity below which hair is cut away


class Materials:
    """Makes the materials of meshes; a picture is read once, and compressed once per size."""

    def __init__(self, dna: Dna, file: Path) -> None:
        """Args: dna: its metadata names the textures; file: path of the DNA file."""
        self._textures = Textures(dna, file)
        self._pixels: dict[str, Pixels | None] = {}
        self._packed: dict[tuple[str, str, int], tuple[str, bytes] | None] = {}
        self._whole: dict[str, tuple[str, bytes]] = {}
        self.notes: list[str] = []

    def add(self, mesh: str, glb: Glb, known: dict[str, int], longest: int) -> int:
        """Adds the material of a mesh to the file, and returns its number.

        Args:
            mesh: name of the mesh in the DNA file.
            glb: the file that receives the material.
            known: material name -> number in `glb`; a known material is not added again.
            longest: largest number of pixels of a picture's longer side; half of it for hair,
                lashes and roughness.
        """
        base, kind = base_name(mesh), kind_of(mesh)
        name = safe(base)
        if name in known:
            return known[name]
        colour, rough = _PLAIN[kind]
        surface: dict[str, Any] = {"metallicFactor": 0, "roughnessFactor": rough}
        material: dict[str, Any] = {"name": name, "pbrMetallicRoughness": surface}
        named = self._textures.named.get(base, {})
        cut = kind in ("hair", "lashes")
        size = longest // 2 if cut else longest
        picture = self._picture(named.get("color", ""), "color", size, glb, named.get("alpha", ""))
        if picture is not None:
            surface["baseColorTexture"] = {"index": picture}
        else:
            surface["baseColorFactor"] = [*colour, _WET if kind == "wet" else 1.0]
        if cut:
            material.update(doubleSided=True)
            if picture is not None:
                material.update(alphaMode="MASK", alphaCutoff=_CUT)
        if kind == "wet":
            material["alphaMode"] = "BLEND"
        if kind == "skin":
            normal = self._picture(named.get("normal", ""), "normal", longest, glb)
            if normal is not None:
                material["normalTexture"] = {"index": normal}
            roughness = self._picture(named.get("roughness", ""), "roughness", longest // 2, glb)
            # glTF reads roughness from the green channel; metalness, in blue, is multiplied by 0
            if roughness is not None:
                surface["metallicRoughnessTexture"] = {"index": roughness}
                surface["roughnessFactor"] = 1.0
        materials = glb.table.setdefault("materials", [])
        materials.append(material)
        known[name] = len(materials) - 1
        return known[name]

    @staticmethod
    def is_painted(glb: Glb, number: int) -> bool:
        """Whether a material has a texture, so that its meshes need texture coordinates.

        Args:
            glb: the file with the material.
            number: number from `add`.
        """
        material = glb.table["materials"][number]
        return any(
            key.endswith("Texture") for key in {**material, **material["pbrMetallicRoughness"]}
        )

    def _picture(self, name: str, role: str, longest: int, glb: Glb, alpha: str = "") -> int | None:
        """The number of the texture made from a picture file; None if the file is unusable.

        Args:
            name: name of the file; "" for none.
            role: "color", "normal" or "roughness".
            longest: largest number of pixels of the picture's longer side.
            glb: the file that receives the texture.
            alpha: name of the file of the opacity; "" for none.
        """
        if not name:
            return None
        key = (name, role, longest)
        if key not in self._packed:
            self._packed[key] = self._made(name, role, longest, alpha)
        found = self._packed[key]
        if found is None:
            return None
        media, data = found
        label = f"{Path(name).stem}_{role}"
        images, textures = glb.table.setdefault("images", []), glb.table.setdefault("textures", [])
        if label not in glb.pictures:
            images.append({"name": label, "mimeType": media, "bufferView": glb.view(data)})
            samplers = glb.table.setdefault("samplers", [])
            if _SMOOTH not in samplers:  # the list may have samplers from the file of a body
                samplers.append(_SMOOTH)
            number = samplers.index(_SMOOTH)
            textures.append({"source": len(images) - 1, "sampler": number})
            glb.pictures[label] = len(textures) - 1
        return glb.pictures[label]

    def _made(self, name: str, role: str, longest: int, alpha: str) -> tuple[str, bytes] | None:
        """Media type and bytes of a picture file, scaled and recompressed. A PNG or JPEG whose
        pixels cannot be read stays unchanged; None for other unusable files."""
        pixels = self._read(name)
        if pixels is None:
            return self._whole.get(name)
        small = halved(pixels, longest)
        opacity = self._read(alpha) if alpha else None
        if opacity is not None and small.ndim == 3 and small.shape[2] == 3:
            small = np.dstack([small, _like(halved(opacity, longest), small)])
        if small.ndim == 3 and small.shape[2] == 4:
            return "image/png", pixels_to_png(small)
        return "image/jpeg", jpeg(small, _QUALITY[role], fine_color=role == "normal")

    def _read(self, name: str) -> Pixels | None:
        if name not in self._pixels:
            data = self._textures.read(name)
            self._pixels[name] = self._pixels_of(name, data)
        return self._pixels[name]

    def _pixels_of(self, name: str, data: bytes) -> Pixels | None:
        if not data:
            self.notes.append(
                f"{name}: the texture is not in the folder of the DNA file: a plain colour is used"
            )
            return None
        shape = pixels_of(data, opacity=True)
        wide, high = _sides(data)
        if max(wide, high) > LARGEST:
            self.notes.append(
                f"{name}: at most {LARGEST:,} pixels a side were expected, found {wide:,} x "
                f"{high:,}: a plain colour is used"
            )
            return None
        pixels = read_pixels(data, opacity=True) if shape else None
        media = media_type(data)
        if pixels is None and media in _AS_THEY_ARE:
            self._whole[name] = (media, data)
            self.notes.append(
                f"{name}: another program's picture: it comes as it is, {len(data):,} bytes"
            )
        elif pixels is None:
            self.notes.append(
                f"{name}: a PNG or JPEG file was expected, this is {media}: a plain colour is used"
            )
        return pixels


def _sides(data: bytes) -> tuple[int, int]:
    """Width and height in pixels from a PNG's header; zeros for other files."""
    if media_type(data) != "image/png" or len(data) < 24:
        return 0, 0
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def _like(mask: Pixels, picture: Pixels) -> Pixels:
    """A mask resampled (nearest pixel) to the width and height of a picture."""
    grey = mask if mask.ndim == 2 else mask[..., 0]
    rows, columns = (
        np.arange(n) * m // n for n, m in zip(picture.shape[:2], grey.shape, strict=True)
    )
    return grey[rows[:, None], columns[None, :]]
