# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures: their unpacked size is limited by their file size and checked before loading."""

import random
import struct
import zlib
from pathlib import Path

import bpy
import numpy as np
import pytest
from support import scene
from support.faces import small_face

WIDTH, HEIGHT = 37, 21
FORMATS = ("PNG", "JPEG", "BMP", "TARGA", "TARGA_RAW", "TIFF", "OPEN_EXR", "WEBP")


def _size(content):
    return scene.submodule("logic.material.image_size").size_of(
        lambda at, count: content[at : at + count]
    )


def _picture(path, file_format, width=WIDTH, height=HEIGHT):
    image = bpy.data.images.new("picture", width, height, float_buffer=file_format == "OPEN_EXR")
    flat = np.random.default_rng(1).random(width * height * 4, np.float32)
    image.pixels.foreach_set(flat)
    image.filepath_raw, image.file_format = str(path), file_format
    image.save()
    bpy.data.images.remove(image)
    return path.read_bytes()


@pytest.mark.parametrize("file_format", FORMATS)
def test_sizes_of_what_blender_writes(file_format, tmp_path):
    content = _picture(tmp_path / "picture", file_format)
    assert _size(content)[:2] == (WIDTH, HEIGHT)


@pytest.mark.parametrize("file_format", FORMATS)
def test_damaged_heads_have_a_size_or_none(file_format, tmp_path):
    content = _picture(tmp_path / "picture", file_format)
    chance = random.Random(7)
    for _ in range(300):
        damaged = bytearray(content[: chance.randrange(4, len(content))])
        for _ in range(chance.randrange(4)):
            damaged[chance.randrange(min(len(damaged), 400))] = chance.randrange(256)
        found = _size(bytes(damaged))
        assert found is None or all(isinstance(number, int) for number in found)


def _bomb(width, height, rows=40):
    """The bytes of a PNG whose header states a larger size than its pixel data have.

    Args:
        width, height: size in pixels in the header.
        rows: number of rows of pixel data, at most 64.
    """

    def chunk(kind, content):
        crc = zlib.crc32(kind + content)
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", crc)

    data = zlib.compress(bytes((1 + width * 4) * min(rows, height, 64)))
    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    parts = (chunk(b"IHDR", head), chunk(b"IDAT", data), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _face(tmp_path, names):
    face = small_face()
    face.metadata = {f"texture:head_lod0_mesh:{role}": name for role, name in names.items()}
    path = tmp_path / "face.dna"
    face.save(str(path))
    folder = tmp_path / "face_textures"
    folder.mkdir()
    return path, folder


def _import(path):
    build = scene.submodule("scene.character.build")
    return build.import_file(bpy.context, path, build.BuildOptions())[1]


def test_a_small_file_of_a_huge_picture_is_a_sentence(tmp_path):
    path, folder = _face(tmp_path, {"color": "skin.png", "normal": "normal.png"})
    (folder / "skin.png").write_bytes(_bomb(50_000, 50_000))
    _picture(folder / "normal.png", "PNG")
    warnings = _import(path)
    (said,) = [w for w in warnings if "skin.png" in w]
    assert "50,000 x 50,000 pixels" in said
    assert "10,000,000,000 bytes" in said
    assert said.endswith(".")
    assert [i.name for i in bpy.data.images if i.type == "IMAGE"] == ["normal.png"]


def _most_memory():
    """The largest virtual memory (VmPeak) that this process has had, in bytes."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return int(next(line for line in lines if line.startswith("VmPeak")).split()[1]) * 1024


@pytest.mark.parametrize("side", [60_000, 64])
def test_a_mask_of_a_huge_picture_is_left_out_too(side, tmp_path):
    face = small_face()
    face.animated_map_names = ["head_wm1_blink_L", "head_wm1_blink_R"]
    path = tmp_path / "face.dna"
    face.save(str(path))
    folder = tmp_path / "Masks"
    folder.mkdir()
    (folder / "head_wm1_msk_01.png").write_bytes(_bomb(side, side, side))
    before = _most_memory()
    _import(path)
    assert len([i for i in bpy.data.images if i.type == "IMAGE"]) == (side == 64)
    assert _most_memory() - before < 1 << 30


def test_many_pictures_have_a_bound_together(tmp_path, monkeypatch):
    names = {"color": "a.png", "normal": "b.png", "roughness": "c.png", "cavity": "d.png"}
    path, folder = _face(tmp_path, names)
    for name in names.values():
        _picture(folder / name, "PNG")
    one = WIDTH * HEIGHT * 4
    textures = scene.submodule("scene.material.image_loading")
    monkeypatch.setattr(textures, "_ALL_IMAGES", 2 * one)
    monkeypatch.setattr(textures, "_MOST_TIMES", 0)
    warnings = _import(path)
    said = [w for w in warnings if "stays away" in w]
    assert len(said) == 2
    assert f"{3 * one:,} bytes, at most {2 * one:,}" in said[0]
    assert len([i for i in bpy.data.images if i.type == "IMAGE"]) == 2


def test_a_large_flat_picture_is_taken(tmp_path):
    """A picture of 8192 x 8192 pixels is accepted, although its file is a thousand times smaller.

    A mask with few colours, for example, has such a file. A larger picture is refused.
    """
    textures = scene.submodule("scene.material.image_loading")
    path = tmp_path / "flat.png"
    path.write_bytes(_bomb(8192, 8192))
    assert textures._room_for(path) == 8192 * 8192 * 4
    path.write_bytes(_bomb(8193, 8192, 1))
    with pytest.raises(ValueError, match="8,193 x 8,192 pixels stays away"):
        textures._room_for(path)


def test_what_is_no_picture_is_said_and_left(tmp_path):
    path, folder = _face(tmp_path, {"color": "skin.png"})
    (folder / "skin.png").write_text("no picture at all, but some words that are long enough")
    assert "The texture skin.png cannot be read." in _import(path)
    assert not [i for i in bpy.data.images if i.type == "IMAGE"]
