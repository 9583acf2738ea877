# SPDX-License-Identifier: MIT
"""clip_stands_for.py FILE.dna ...: compares the size of a clip of controls with the size of the
evaluated animation of the face.

The evaluated animation has the rig's float32 outputs at LOD 0: nine values per joint (translation,
rotation, scale), a weight per blend shape, and a value per animated map. `all` counts all of them;
`moving` counts only values that change in the clip, as an exporter that drops constant channels
would. The curves of clip_curves.py are spread evenly over the raw controls of the rig. If the rig
has fewer controls than curves, moving curves are used first.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import risorius
from clip_curves import KINDS, RATE, Curves


def values_of(rig: risorius.Rig, raw: Curves) -> tuple[int, int]:
    """The number of the face's values per frame, and the number of them that change in the clip."""
    poses = rig.evaluate_batch(raw)
    moving = count = 0
    for part in (poses.joints, poses.blend_shapes, poses.animated_maps):
        bits = np.ascontiguousarray(part).reshape(len(raw), -1).view(np.uint32)
        count += bits.shape[1]
        moving += int((bits != bits[:1]).any(axis=0).sum())
    return count, moving


def clip_for(names: list[str], curves: Curves) -> risorius.Clip:
    if len(names) < len(curves):
        order = np.argsort(~(curves != curves[:, :1]).any(axis=1), kind="stable")
        return risorius.Clip(names, curves[order][: len(names)], RATE)
    places = np.linspace(0, len(names) - 1, len(curves)).astype(int)
    return risorius.Clip([names[i] for i in places], curves, RATE)


def row(path: str, kind: str, rig: risorius.Rig, clip: risorius.Clip) -> str:
    raw, _ = clip.raw_controls(rig.raw_control_names)
    count, moving = values_of(rig, raw)
    size, curves = len(clip.to_bytes()), len(clip.names)
    frame = 4 * clip.frame_count
    ratios = (frame * count / size, frame * moving / size, count / curves, moving / curves)
    cells = [Path(path).name, f"{kind}, {curves} curves", f"{count} ({moving})", str(size)]
    return "| " + " | ".join(cells + [f"{ratio:.1f}" for ratio in ratios]) + " |"


def main() -> None:
    heads = ["rig", "clip", "values a frame, all (moving)", "bytes of .rzc", "all : .rzc"]
    heads += ["moving : .rzc", "all : float32 curves", "moving : float32 curves"]
    print("| " + " | ".join(heads) + " |")
    print("|---|---|" + "---:|" * (len(heads) - 2))
    for path in sys.argv[1:]:
        rig = risorius.Rig(risorius.load(path))
        for kind, make in KINDS.items():
            print(row(path, kind, rig, clip_for(rig.raw_control_names, make())))


if __name__ == "__main__":
    main()
