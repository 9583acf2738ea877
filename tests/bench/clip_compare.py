# SPDX-License-Identifier: MIT
"""clip_compare.py [--out FOLDER]: compares `.rzc` with other lossless packers of float32, on the
three kinds of curves of clip_curves.py. Values are the size of the curves divided by the packed
size, and the unpacking speed in GB/s. The size of `.rzc` includes its header, names and index.

Each other packer counts with the smaller of two sizes: all curves in one array, or each curve alone
with constant curves at no cost. Packages: pcodec, zstandard, blosc2, fpzip; a missing package is
listed as not installed. --out writes the clips, for clip_bench.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from clip_curves import KINDS, RATE, Curves
from risorius import Clip

Pack = Callable[[Curves], bytes]
Unpack = Callable[[bytes, Curves], Curves]  # the second argument has the shape of the result
RUNS = 5  # times that unpacking is measured; the shortest time counts


def rzc(_: object) -> tuple[Pack, Unpack]:
    def pack(curves: Curves) -> bytes:
        return Clip([f"CTRL_expressions.c{i}" for i in range(len(curves))], curves, RATE).to_bytes()

    return pack, lambda data, _: Clip.load(data).curves


def pcodec(level: int) -> tuple[Pack, Unpack]:
    standalone = importlib.import_module("pcodec.standalone")
    config = importlib.import_module("pcodec").ChunkConfig(compression_level=level)
    return (
        lambda curves: standalone.simple_compress(curves.ravel(), config),
        lambda data, like: standalone.simple_decompress(data).reshape(like.shape),
    )


def zstd(shuffled: bool) -> tuple[Pack, Unpack]:
    """zstd at level 19. With `shuffled`, it packs uint32 differences between frames: all first
    bytes, then all second bytes, and so on."""
    package = importlib.import_module("zstandard")
    compressor, decompressor = package.ZstdCompressor(level=19), package.ZstdDecompressor()

    def pack(curves: Curves) -> bytes:
        if not shuffled:
            return compressor.compress(curves.tobytes())
        steps = np.diff(curves.view(np.uint32), axis=1, prepend=np.uint32(0))
        planes = np.ascontiguousarray(steps.reshape(-1, 1).view(np.uint8).T)
        return compressor.compress(planes.tobytes())

    def unpack(data: bytes, like: Curves) -> Curves:
        raw = np.frombuffer(decompressor.decompress(data), np.uint8)
        if not shuffled:
            return raw.view(np.float32).reshape(like.shape)
        steps = np.ascontiguousarray(raw.reshape(4, -1).T).view(np.uint32).reshape(like.shape)
        return np.cumsum(steps, axis=1, dtype=np.uint32).view(np.float32)

    return pack, unpack


def blosc2(_: object) -> tuple[Pack, Unpack]:
    """blosc2 with a byte shuffle and zstd at level 9, as one chunk on one thread."""
    package = importlib.import_module("blosc2")
    package.set_nthreads(1)
    codec, filters = package.Codec.ZSTD, package.Filter.SHUFFLE
    return (
        lambda curves: package.compress(curves.tobytes(), 4, 9, filters, codec),
        lambda data, like: np.frombuffer(package.decompress(data), np.float32).reshape(like.shape),
    )


def fpzip(_: object) -> tuple[Pack, Unpack]:
    package = importlib.import_module("fpzip")
    return (
        lambda curves: package.compress(curves, precision=0, order="C"),
        lambda data, like: package.decompress(data, order="C").reshape(like.shape),
    )


PACKERS = {
    "rzc": (rzc, None),
    "pcodec level 8": (pcodec, 8),
    "pcodec level 12": (pcodec, 12),
    "zstd 19, shuffled differences": (zstd, True),
    "zstd 19": (zstd, False),
    "blosc2, zstd 9, shuffle": (blosc2, None),
    "fpzip": (fpzip, None),
}


def fastest(run: Callable[[], object]) -> float:
    times = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


def measure(name: str, curves: Curves) -> tuple[int, float, float] | None:
    """The packed size in bytes, and the speeds of packing and unpacking in GB/s.

    None if the packer's package is not installed.

    Args:
        name: key of PACKERS.
        curves: the curves to pack.
    """
    make, option = PACKERS[name]
    try:
        pack, unpack = make(option)
    except ImportError:
        return None
    begin = time.perf_counter()
    data = pack(curves)
    packing = time.perf_counter() - begin
    back = unpack(data, curves)
    assert back.tobytes() == curves.tobytes(), f"{name} loses bits"
    size = len(data)
    if name != "rzc":
        alone = [row for row in curves if (row.view(np.uint32) != row.view(np.uint32)[0]).any()]
        size = min(size, sum(len(pack(row[None])) for row in alone))
    speed = curves.nbytes / 1e9
    return size, speed / packing, speed / fastest(lambda: unpack(data, curves))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    folder = parser.parse_args().out
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    sizes: dict[str, list[float]] = {}
    print("| | " + " | ".join(f"{kind}, unpacked at GB/s" for kind in KINDS) + " |")
    print("|---|" + "---:|" * len(KINDS))
    made = {kind: make() for kind, make in KINDS.items()}
    for name in PACKERS:
        row = []
        for kind, curves in made.items():
            found = measure(name, curves)
            if found is None:
                row.append("not installed")
                continue
            sizes.setdefault(name, []).append(found[0])
            row.append(f"{curves.nbytes / found[0]:.2f}, {found[2]:.2f}")
            if folder and name == "rzc":
                Clip([f"c{i}" for i in range(len(curves))], curves, RATE).save(
                    folder / f"{kind}.rzc"
                )
        print(f"| {name} | " + " | ".join(row) + " |")
    if "pcodec level 8" in sizes:
        parts = np.array(sizes["rzc"]) / sizes["pcodec level 8"]
        print(f"\nrzc / pcodec level 8: {', '.join(f'{p:.3f}' for p in parts)}; ", end="")
        print(f"in the mean {parts.mean():.3f}")
    rng = np.random.default_rng(1)
    noise = rng.integers(0, 2**32, (260, 3600), np.uint64).astype(np.uint32).view(np.float32)
    print(f"random bits: {len(rzc(None)[0](noise)) / noise.nbytes:.5f} of their size")


if __name__ == "__main__":
    main()
