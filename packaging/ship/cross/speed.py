# SPDX-License-Identifier: MIT
"""Compares the speed of two installed wheels.

    speed.py FACE.dna FOLDER OTHER [ROUNDS]    FOLDER, OTHER: made by `pip install --target` for
                                               this Python

Processes of both wheels run in turn. Each process times loading a file, compiling the rig, and
evaluating frames with 60 changing raw controls, like docs/measurements/evaluator.md. Prints the
quotients FOLDER / OTHER of the shortest times and of the medians; above 1, FOLDER is slower.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

ACTIVE = 60
FRAMES = 1000


def fastest(work: Callable[[], object], times: int) -> float:
    """The shortest duration of several runs in seconds, because disturbances only add time."""
    taken = []
    for _ in range(times):
        begin = time.perf_counter()
        work()
        taken.append(time.perf_counter() - begin)
    return min(taken)


def measure(face: str) -> dict[str, float]:
    import numpy as np
    import risorius

    with open(face, "rb") as file:
        data = file.read()
    dna = risorius.load(data)
    found = {"load": fastest(lambda: risorius.load(data), 5)}
    found["compile"] = fastest(lambda: risorius.Rig(dna), 5)
    random = np.random.default_rng(7)
    for rotation in ("euler", "quaternion"):
        rig = risorius.Rig(dna, rotation=rotation)
        raw = np.tile(rig.initial_raw_controls, (FRAMES, 1))
        columns = random.choice(raw.shape[1], min(ACTIVE, raw.shape[1]), replace=False)
        raw[:, columns] = random.random((FRAMES, len(columns)), np.float32)
        found[f"clip, {rotation}"] = fastest(lambda r=rig, x=raw: r.evaluate_batch(x, threads=1), 7)
        few = raw[:100]
        found[f"faces one by one, {rotation}"] = fastest(
            lambda r=rig, x=few: [r.evaluate(row) for row in x], 15
        )
    return found


def main() -> int:
    if len(sys.argv) == 2:
        print(json.dumps(measure(sys.argv[1])))
        return 0
    face, *folders = sys.argv[1:4]
    rounds = int(sys.argv[4]) if len(sys.argv) > 4 else 9
    seen: dict[str, tuple[list[float], list[float]]] = {}
    for _ in range(rounds):
        for which, folder in enumerate(folders):
            done = subprocess.run(
                [sys.executable, __file__, face],
                env={**os.environ, "PYTHONPATH": folder},
                stdout=subprocess.PIPE,
                check=True,
            )
            for name, seconds in json.loads(done.stdout).items():
                seen.setdefault(name, ([], []))[which].append(seconds)
    for name, (ours, others) in seen.items():
        a, b = min(ours), min(others)
        middle = statistics.median(ours) / statistics.median(others)
        both = f"{a * 1e3:9.3f} ms {b * 1e3:9.3f} ms"
        print(f"{name:<30} {both}   {a / b:5.3f}, of medians {middle:5.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
