# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads each texture once, packs it into the .blend, and marks it as colours or numbers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...logic.base.sentences import told
from ...logic.material import image_size, texture_search
from ..base import sharing, storage

# Names of the sRGB texture space in common OpenColorIO configurations: Blender's own, ACES 1,
# ACES CG and studio, Filmic. The first name that the active configuration knows is used.
COLOR_SPACES = (
    "sRGB",
    "sRGB - Texture",
    "Utility - sRGB - Texture",
    "sRGB Encoded Rec.709 (sRGB)",
    "srgb_texture",
    "srgb_tx",
    "Input - Generic - sRGB - Texture",
    "Utility - Curve - sRGB",
    "sRGB OETF",
)
DATA_SPACES = ("Non-Color", "Raw", "Utility - Raw", "raw", "Generic Data", "Non-Colour Data")
PACK_LIMIT = 64 << 20  # bytes; larger files stay outside, or a .blend would grow to gigabytes
# Limits of the memory for images, in bytes. One image may take _ONE_IMAGE + _MOST_TIMES * its file
# size. All images of an import together may take _ALL_IMAGES + _MOST_TIMES * the sum of their file
# sizes. So an image of 8192 x 8192 pixels of 4 bytes is accepted even if its file is tiny because
# the picture has one colour.
_ONE_IMAGE, _ALL_IMAGES, _MOST_TIMES = 256 << 20, 1 << 30, 64
TILE = 512  # pixels, side of one tile of the mask atlas


def set_color_space(image: bpy.types.Image, data: bool) -> None:
    """Set whether an image contains colours or numbers, in any colour configuration.

    Args:
        image: a loaded image.
        data: True: numbers, such as normals or masks, without colour management.
    """
    settings: Any = image.colorspace_settings
    if not data and image.is_float:
        return  # Blender already gives float images the linear space of the configuration
    known = [item.identifier for item in settings.bl_rna.properties["name"].enum_items]
    words = ("raw", "non-col", "data") if data else ("srgb",)
    alike = [n for n in known if any(w in n.lower() for w in words)]
    for name in (*(DATA_SPACES if data else COLOR_SPACES), *alike):
        try:
            settings.name = name
        except TypeError:  # the active configuration has no space of that name
            continue
        return
    if data:
        settings.is_data = True  # falls back to the configuration's role for data


def _room_for(path: Path) -> int:
    """Bytes that an image takes in memory, from the header of its file.

    Raises:
        ValueError: the file is no picture, or the picture is too large for the size of its file.
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:

        def read(offset: int, count: int) -> bytes:
            file.seek(min(offset, 1 << 62))
            return file.read(count)

        found = image_size.size_of(read)
    if found is None:
        raise ValueError(told("The texture {file} cannot be read.", file=path.name))
    width, height, depth = found
    room, limit = width * height * depth, _ONE_IMAGE + _MOST_TIMES * path.stat().st_size
    if room > limit:
        raise ValueError(
            told(
                (
                    "The texture {file} of {width:,} x {height:,} pixels stays away: it needs "
                    "{room:,} bytes, at most {limit:,} are allowed for a file of its size."
                ),
                file=path.name,
                width=width,
                height=height,
                room=room,
                limit=limit,
            )
        )
    return room


class Images:
    """Loads each file at most once as colours and once as data, and packs it into the .blend.

    New images are added to `made`; `troubles` has a sentence for each problem.
    """

    def __init__(self, made: list[bpy.types.ID]) -> None:
        self.made = made
        self.troubles: list[str] = []
        self._loaded: dict[tuple[str, bool], bpy.types.Image | None] = {}
        self._small: dict[Path, NDArray[np.float32] | None] = {}
        self._room, self._files = 0, 0  # bytes of all loaded images, in memory and as files

    def load(self, path: Path | None, data: bool = False) -> bpy.types.Image | None:
        """The image of a file; None if it is missing, unreadable or needs too much memory.

        Args:
            path: path of the file; None gives None.
            data: whether its pixels are numbers instead of colours, as in a normal map.
        """
        if path is None:
            return None
        key = (str(path), data)
        if key not in self._loaded:
            self._loaded[key] = self._read(path, data)
        return self._loaded[key]

    def small(self, path: Path) -> NDArray[np.float32] | None:
        """float32[TILE, TILE, 4]: the pixels of a file, scaled, without colour management; None if
        the file is unreadable.

        Args:
            path: path of the file.
        """
        if path not in self._small:
            self._small[path] = _small_copy(path)
        return self._small[path]

    def _read(self, path: Path, data: bool) -> bpy.types.Image | None:
        try:
            self._make_room(path)
            content = path.read_bytes() if path.stat().st_size <= PACK_LIMIT else None
            digest = storage.hash_of(content) if content is not None else ""
            there = sharing.find(content, digest, data) if content is not None else None
            if there is not None:
                return there
            image = bpy.data.images.load(str(path), check_existing=False)
        except (RuntimeError, OSError):
            self._complain(told("The texture {file} cannot be read.", file=path.name))
            return None
        except ValueError as error:
            self._complain(error.args[0] if error.args else str(error))
            return None
        self.made.append(image)
        set_color_space(image, data)
        if not image.size[0]:  # Blender reads lazily: only now a file that is no image shows
            self._complain(told("The texture {file} cannot be read.", file=path.name))
            self.made.remove(image)
            bpy.data.images.remove(image)
            return None
        if content is not None:
            image.pack(data=content, data_len=len(content))
            sharing.mark(image, digest)
        else:
            self._complain(
                told(
                    "The texture {file} is large and stays outside the .blend file.", file=path.name
                )
            )
        return image

    def _make_room(self, path: Path) -> None:
        room, size = _room_for(path), path.stat().st_size
        limit = _ALL_IMAGES + _MOST_TIMES * (self._files + size)
        if self._room + room > limit:
            raise ValueError(
                told(
                    "The texture {file} stays away: together with the textures "
                    "before it, it needs {room:,} bytes, at most {limit:,} are "
                    "allowed for files of their size.",
                    file=path.name,
                    room=self._room + room,
                    limit=limit,
                )
            )
        self._room, self._files = self._room + room, self._files + size

    def _complain(self, sentence: str) -> None:
        if sentence not in self.troubles:
            self.troubles.append(sentence)

    def atlas(
        self, name: str, masks: Mapping[str, texture_search.Mask]
    ) -> tuple[bpy.types.Image | None, dict[str, tuple[int, int, int, int]]]:
        """Pack the masks of many regions into one image of square tiles.

        A tile has three masks, one in each colour channel. One image is used because a render
        engine limits the number of textures of a material.

        Args:
            name: name of the image.
            masks: region -> texture_search.Mask.

        Returns:
            The image or None, and region -> (column and row of the tile, colour channel, number of
            tiles in a row).
        """
        held = {r: m for r, m in masks.items() if m.path.is_file()}
        if not held:
            return None, {}
        side = int(np.ceil(np.sqrt(np.ceil(len(held) / 3))))
        pixels = np.zeros((side * TILE, side * TILE, 4), np.float32)
        pixels[..., 3] = 1.0
        places = {}
        for path in dict.fromkeys(m.path for m in held.values()):
            source = _small_copy(path)
            for region, mask in held.items():
                if source is not None and mask.path == path:
                    number, channel = divmod(len(places), 3)
                    row, column = divmod(number, side)
                    tile = pixels[row * TILE :, column * TILE :]
                    tile[:TILE, :TILE, channel] = source[..., mask.channel]
                    places[region] = (column, row, channel, side)
        if not places:
            return None, {}
        image = bpy.data.images.new(name, side * TILE, side * TILE, alpha=False)
        self.made.append(image)
        set_color_space(image, True)
        stored: Any = image.pixels
        stored.foreach_set(pixels.ravel())
        image.update()
        image.pack()
        return self._shared(image), places

    def _shared(self, image: bpy.types.Image) -> bpy.types.Image:
        """Replace a new image with an image of this .blend that has the same packed bytes, if there
        is one."""
        assert image.packed_file is not None
        content = bytes(image.packed_file.data)
        digest = storage.hash_of(content)
        there = sharing.find(content, digest, True)
        if there is None:
            sharing.mark(image, digest)
            return image
        self.made.remove(image)
        bpy.data.images.remove(image)
        return there


def _small_copy(path: Path) -> NDArray[np.float32] | None:
    """float32[TILE, TILE, 4]: the pixels of a file, scaled, without colour management; None if
    the file is unreadable."""
    try:
        _room_for(path)
        image = bpy.data.images.load(str(path), check_existing=False)
    except (RuntimeError, OSError, ValueError):
        return None
    try:
        set_color_space(image, True)
        image.alpha_mode = "CHANNEL_PACKED"  # alpha is a mask like red, green and blue
        if not image.size[0]:
            return None
        image.scale(TILE, TILE)
        flat = np.empty(TILE * TILE * 4, np.float32)
        stored: Any = image.pixels
        stored.foreach_get(flat)
        return flat.reshape(TILE, TILE, 4)
    finally:
        bpy.data.images.remove(image)


def mean_of(path: Path) -> NDArray[np.float32] | None:
    """float32[4]: mean pixel of a file without colour management; None if it is unreadable."""
    small = _small_copy(path)
    return None if small is None else small.mean(axis=(0, 1))


def offsets_in(path: Path | None) -> bool:
    """Whether a wrinkle map stores differences around 0.5 instead of colours or normals."""
    mean = mean_of(path) if path is not None else None
    return mean is not None and bool(abs(mean[:3] - 0.5).max() < 0.06)
