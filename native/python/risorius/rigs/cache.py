# SPDX-License-Identifier: MIT
"""Stores compiled rigs in a cache folder, and loads them from it."""

from __future__ import annotations

import contextlib
import hashlib
import os
import sys
from pathlib import Path

from .._native import DnaError, Rig, compile_version, rig_block_version
from ..base import version
from ..base.reading import FACE, ReadingError, read_file
from ..files.caches import cache_folder
from .load import load


def compile_cached(
    path: str | os.PathLike[str],
    cache_dir: str | os.PathLike[str] | None = None,
    *,
    precision: str = "float32",
    rotation: str = "euler",
    simd: str | None = None,
) -> Rig:
    """Compiles a DNA file, or loads its rig from the cache if it was compiled before.

    The cache file is named by a hash of the DNA's bytes, precision, rotation, this version and the
    byte order, so an edited DNA gets another file. A hash of the cached content is checked each
    time, and a damaged file is replaced. If the folder cannot be written, the face is compiled each
    time without an error. Nothing is ever deleted; users may delete files.

    Args:
        path: path of a DNA file.
        cache_dir: folder of the cache, created if missing; None: a folder in the user's caches. If
            others may write to it, its files are checked like DNA files (see Rig.load), because a
            hash detects damage but not forgery.
        precision: "float32" or "float16", number format of the joint coefficients.
        rotation: "euler" or "quaternion", form of the evaluated joint rotations.
        simd: instruction set of the evaluation; None: the best one of the processor.

    Raises:
        DnaError: a file that cannot be read or compiled.
        ValueError: an unknown option.
    """
    try:
        data = read_file(path, FACE)
    except (OSError, ReadingError):  # load below fails too, with an error that names the file
        dna = load(path)
        return Rig(dna, precision=precision, rotation=rotation, simd=simd)
    file = Path(cache_dir) if cache_dir is not None else cache_folder() / "rigs"
    file /= _key(data, precision, rotation)
    with contextlib.suppress(DnaError):
        return Rig.load(file, trusted=None, simd=simd)
    try:
        dna = load(data)
    except DnaError as error:
        if not os.path.isfile(path):  # not read again, because a pipe can be read only once
            named = DnaError(f"{os.fspath(path)}: {error}")
            named.code, named.where, named.offset = error.code, error.where, error.offset
            raise named from None
        dna = load(path)  # raises the error again, with the name of the file
    rig = Rig(dna, precision=precision, rotation=rotation, simd=simd)
    with contextlib.suppress(OSError, DnaError):
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        rig.save(file)
    return rig


def _key(data: bytes, precision: str, rotation: str) -> str:
    what = hashlib.sha256(data)  # faster than blake2b, because CPUs have instructions for SHA-256
    versions = (version.__version__, rig_block_version(), compile_version())
    about = (*versions, sys.byteorder, precision, rotation)
    what.update(repr(about).encode())
    return what.hexdigest() + ".rig"
