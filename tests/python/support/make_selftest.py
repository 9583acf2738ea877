# SPDX-License-Identifier: MIT
"""Choose reference values from tests/data/golden for the wheel's self-test.

    python tests/python/support/make_selftest.py

The reference is OpenRigLogic, which computed the values of tests/data/golden. For each face of
COMES_FROM, stores the reference's values for some of its cases at every LOD. Cases that the
reference is known to evaluate differently (test_rig_behavior.py explains them) are omitted, and
their number is printed. If a later run omits more cases, Risorius has a new fault.
"""

import hashlib
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "rigs"))

import risorius
from risorius.selftest import checks
from test_rig_golden import Golden, raw_of_case

PROJECT = Path(__file__).resolve().parents[3]
SOURCE = PROJECT / "tests" / "data" / "golden"
TARGET = PROJECT / "native" / "python" / "risorius" / "selftest" / "golden"
COMES_FROM = {"core": "core", "units": "units", "solvers": "tiny_v28"}
CASES = 12  # per face, at least; evenly spread over its golden cases


def rows_of(name):
    """Golden cases as float32 rows (lod, raw, joints, shapes, maps); and the number omitted."""
    dna = risorius.load(SOURCE / f"{name}.dna")
    rig = risorius.Rig(dna, simd="scalar")
    golden = Golden(SOURCE, name)
    cases = [c for c in golden.about["cases"] if c["kind"] != "gui"]
    out, left = [], 0
    for case in cases[:: max(1, len(cases) // CASES)]:
        raw = raw_of_case(golden, rig, case)
        for lod, offset in enumerate(case["lodRecordOffsets"]):
            found = golden.record(offset)
            values = [found["joints"], found["blendShapes"], found["animatedMaps"]]
            row = checks._Case(lod, raw, *values)
            if checks._error(row, rig) > checks.TOLERANCE / 4:
                left += 1
                continue
            out.append(np.concatenate([[lod], raw, *values]).astype("<f4"))
    return np.array(out), left


def main():
    TARGET.mkdir(exist_ok=True)
    checks.content = lambda name: (TARGET / name).read_bytes()  # not from the wheel
    for name, source in COMES_FROM.items():
        rows, left = rows_of(source)
        (TARGET / f"{name}.dna").write_bytes((SOURCE / f"{source}.dna").read_bytes())
        (TARGET / f"{name}.f32").write_bytes(rows.tobytes())
        print(f"{name}: {len(rows)} poses, {left} left out, {rows.nbytes} bytes")
    (TARGET / "scalar.sha256").write_text(checks.scalar_hash() + "\n")
    size = sum(p.stat().st_size for p in TARGET.iterdir())
    whole = hashlib.sha256(b"".join(p.read_bytes() for p in sorted(TARGET.iterdir())))
    print(f"{size} bytes in all, {whole.hexdigest()[:16]}")


if __name__ == "__main__":
    main()
