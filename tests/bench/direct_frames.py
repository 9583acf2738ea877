# SPDX-License-Identifier: MIT
"""Measures frames of faces, from raw controls to vertices, by numbers of threads and faces.

    python tests/bench/direct_frames.py FILE.dna [--faces 1 2 4 8] [--threads 1 2] [--rounds 60]

Every frame has other values of 60 controls; all meshes of LOD 0 are written. Prints medians in ms;
rounds of the compared cases alternate. Run by a Python with `risorius`.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

import numpy as np
import risorius


def worlds(dna: risorius.Dna) -> np.ndarray:
    """float64[J, 4, 4]: neutral world matrices of the joints; rotations about x, then y, then z."""
    out = np.tile(np.eye(4), (len(dna.joint_names), 1, 1))
    for joint, parent in enumerate(dna.joint_parents):
        (cx, cy, cz), (sx, sy, sz) = (
            f(np.radians(dna.neutral_joint_rotations[joint])) for f in (np.cos, np.sin)
        )
        turn = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
        turn = turn @ [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
        out[joint, :3, :3] = turn @ [[1, 0, 0], [0, cx, -sx], [0, sx, cx]]
        out[joint, :3, 3] = dna.neutral_joint_translations[joint]
        if parent != joint:
            out[joint] = out[parent] @ out[joint]
    return out


class Maker:
    """Makes faces of one DNA file. All these faces share the rig, the bone space and the meshes."""

    def __init__(self, dna: risorius.Dna) -> None:
        self.rig = risorius.Rig(dna)
        joints = len(dna.joint_names)
        self.space = risorius.BoneSpace(
            dna.neutral_joint_rotations, range(joints), axes=np.eye(3), radians=np.pi / 180
        )
        own = np.arange(joints)
        parents = np.where(dna.joint_parents == own, -1, dna.joint_parents.astype(int))
        self.chain = risorius.JointChain(parents, worlds(dna))
        self.rows = own
        chosen = dna.lod_mesh_mapping[0]
        self.meshes = []
        for number in chosen:
            mesh = dna.meshes[number]
            skin = risorius.Skin(
                len(mesh.positions),
                mesh.skin_offsets,
                mesh.skin_joint_indices,
                mesh.skin_weights,
                joints,
            )
            self.meshes.append((risorius.Morph(dna, number), mesh.positions, skin))

    def face(self) -> tuple[risorius.DirectFace, dict[int, np.ndarray]]:
        """A face, and index of a mesh -> array to which the mesh's vertices are written."""
        face = risorius.DirectFace(self.rig, self.space, self.chain, self.rows, self.meshes)
        return face, {i: np.empty(m[1].shape, np.float32) for i, m in enumerate(self.meshes)}


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--faces", type=int, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2, 0])
    parser.add_argument("--rounds", type=int, default=60)
    given = parser.parse_args()
    maker = Maker(risorius.load(given.file))
    made = [maker.face() for _ in range(max(given.faces))]
    random = np.random.default_rng(5)
    frames = np.zeros((64, len(maker.rig.raw_control_names)), np.float32)
    for frame in frames:
        some = random.choice(len(frame), min(60, len(frame)), replace=False)
        frame[some] = random.uniform(0.05, 1.0, len(some))
    vertices = sum(len(base) for _, base, _ in maker.meshes)
    print(f"{len(maker.meshes)} meshes, {vertices} vertices, {maker.rig.simd}")
    times: dict[tuple[str, int], list[float]] = {}

    def timed(key: tuple[str, int], call) -> None:
        begin = time.perf_counter()
        call()
        times.setdefault(key, []).append(1e3 * (time.perf_counter() - begin))

    for turn in range(given.rounds):
        for count in given.faces:
            faces, targets = zip(*made[:count], strict=True)
            for threads in given.threads:
                raw = [frames[(turn + 7 * f + threads) % 64] for f in range(count)]
                timed(
                    (f"all, {threads or 'usual'} threads", count),
                    lambda f=faces, r=raw, t=targets, n=threads: risorius.evaluate_faces(
                        f, r, [0] * len(f), t, threads=n
                    ),
                )
            raw = [frames[(turn + 7 * f) % 64] for f in range(count)]
            none = [{}] * count
            timed(
                ("rig, bones and chain, 1 thread", count),
                lambda f=faces, r=raw, n=none: risorius.evaluate_faces(
                    f, r, [0] * len(f), n, threads=1
                ),
            )
            timed(("rig alone", count), lambda r=raw: [maker.rig.evaluate(x) for x in r])
    for (what, count), all_times in sorted(times.items(), key=lambda t: (t[0][1], t[0][0])):
        print(
            f"{count} faces, {what:32} {statistics.median(all_times):8.3f} ms"
            f"   least {min(all_times):8.3f}"
        )


if __name__ == "__main__":
    main()
