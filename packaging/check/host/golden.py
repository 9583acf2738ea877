# SPDX-License-Identifier: MIT
"""Compares the installed C library with the golden values of an independent evaluator, by ctypes.

golden.py LIBRARY FOLDER: prints the number of records and files that agree. The exit code is 1 if a
record differs, or if fewer than five files were compared. Files with networks, solvers, swings or
twists are left out, because their angles may describe the same rotation differently.
tests/python/rigs/test_rig_behavior.py and tests/api compare them.
"""

from __future__ import annotations

import ctypes
import gzip
import json
import sys
from pathlib import Path

import numpy as np

RAW, JOINTS, SHAPES, MAPS = 0, 2, 3, 4
BEYOND = ("rbfSolvers", "twists", "swings", "mlControls", "mlTypes")
LATENT = 1  # option of risorius_create with which the reference evaluates
# Largest difference that counts as equal, as a fraction of the largest value of the same kind of
# output. A sum of some hundred products may differ by this if its products are added in another
# order.
TOLERANCE = 64 * np.finfo(np.float32).eps


class Library:
    def __init__(self, path: str) -> None:
        self.c = ctypes.CDLL(path)
        self.c.risorius_values.restype = ctypes.POINTER(ctypes.c_float)

    def check(self, status: int) -> None:
        if status != 0:
            raise SystemExit(f"status {status}")

    def open(self, path: Path) -> ctypes.c_void_p:
        face = ctypes.c_void_p()
        self.check(self.c.risorius_open_file(str(path).encode(), None, ctypes.byref(face)))
        return face

    def instance(self, face: ctypes.c_void_p) -> ctypes.c_void_p:
        made = ctypes.c_void_p()
        self.check(self.c.risorius_create(face, LATENT, ctypes.byref(made)))
        return made

    def evaluate(self, instance: ctypes.c_void_p, raw: np.ndarray, lod: int) -> None:
        raw = np.ascontiguousarray(raw, np.float32)
        at = raw.ctypes.data_as(ctypes.c_void_p)
        self.check(self.c.risorius_set(instance, RAW, 0, len(raw), at))
        self.check(self.c.risorius_set_lod(instance, lod))
        self.check(self.c.risorius_evaluate(instance))

    def values(self, instance: ctypes.c_void_p, kind: int) -> np.ndarray:
        count = ctypes.c_uint32()
        first = self.c.risorius_values(instance, kind, ctypes.byref(count))
        return np.array(first[: count.value], np.float32)


def is_plain(path: Path) -> bool:
    counts = json.loads(path.read_text())["counts"]
    return not any(counts[part] for part in BEYOND)


def records(path: Path) -> int:
    """Compare all records of a golden file. Returns their number. A difference raises an error."""
    about = json.loads(path.read_text())
    packed = path.with_name(path.name.removesuffix(".json") + ".bin.gz").read_bytes()
    values = np.frombuffer(gzip.decompress(packed), "<f4")
    largest = about["maxAbsOutput"]
    face = library.open(path.with_name(about["dna"]))
    count = 0
    raw_count = about["counts"]["rawControls"]
    for case in about["cases"]:
        for lod, offset in enumerate(case["lodRecordOffsets"]):
            # A record begins with the raw controls.
            instance = library.instance(face)
            library.evaluate(instance, values[offset : offset + raw_count], lod)
            at = offset
            for name, length in about["record"]:
                kind = {"joints": JOINTS, "blendShapes": SHAPES, "animatedMaps": MAPS}.get(name)
                if kind is not None:
                    bound = TOLERANCE * max(largest[name], 1.0)
                    found = library.values(instance, kind)
                    wanted = values[at : at + length]
                    np.testing.assert_allclose(found, wanted, rtol=0, atol=bound, err_msg=name)
                at += length
            library.c.risorius_destroy(instance)
            count += 1
    library.c.risorius_close(face)
    return count


library = Library(sys.argv[1])
counts = {p.name: records(p) for p in sorted(Path(sys.argv[2]).glob("*.eval.json")) if is_plain(p)}
print(f"{sum(counts.values())} records of {len(counts)} files agree")
sys.exit(len(counts) < 5 or not all(counts.values()))
