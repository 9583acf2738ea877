# SPDX-License-Identifier: MIT
"""Tests JPEG files of risorius.files.jpeg by reading them with Pillow."""

import io

import numpy as np
import pytest
from risorius.files.jpeg import jpeg


def read(data):
    """Pixels of a JPEG as uint8, read by Pillow; row 0 is the bottom row."""
    image = pytest.importorskip("PIL.Image", reason="NOT RUN: no Pillow, which reads the files")
    return np.array(image.open(io.BytesIO(data)))[::-1]


def test_soft_pictures_come_back_nearly_the_same_and_small():
    y, x = np.mgrid[0:53, 0:77] / 77
    soft = np.stack([x, y * x, 1 - y], axis=2)
    pixels = np.rint(255 * soft).astype(np.uint8)
    for image, fine in ((pixels, False), (pixels, True), (pixels[..., 0], False)):
        data = jpeg(image, 90, fine_color=fine)
        found = read(data)
        assert found.shape == image.shape
        assert np.abs(found.astype(int) - image).mean() < 1.5
        assert len(data) < image.size / 2


@pytest.mark.parametrize("quality", [1, 50, 100])
def test_noise_single_pixels_and_one_colour_are_files_too(quality):
    noise = np.random.default_rng(quality).integers(0, 256, (40, 24, 3), dtype=np.uint8)
    for image in (noise, noise[:1, :1], np.zeros((16, 16), np.uint8), noise[..., 0]):
        found = read(jpeg(image, quality))
        assert found.shape == image.shape
    if quality == 100:
        assert np.abs(read(jpeg(noise, 100, fine_color=True)).astype(int) - noise).max() <= 4


def test_a_code_longer_than_files_allow_is_shortened():
    # Frequencies that are Fibonacci numbers give a Huffman tree of the greatest depth.
    counts = [1, 1]
    while len(counts) < 22:
        counts.append(counts[-1] + counts[-2])
    from risorius.files.jpeg import _code

    lengths, codes, text = _code(np.array(counts + [0] * (256 - len(counts))))
    used = lengths[: len(counts)]
    assert used.min() >= 1
    assert used.max() <= 16
    assert sum(2.0**-n for n in used.tolist()) < 1
    assert len(text) == 16 + len(counts)
    words = {format(codes[s], f"0{lengths[s]}b") for s in range(len(counts))}
    assert not any(a != b and b.startswith(a) for a in words for b in words)
