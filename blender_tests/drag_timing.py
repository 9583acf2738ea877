# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the time of a drag, from the mouse event to the evaluated mesh; checks nothing.

python drag_timing.py FACE.dna      in an environment with bpy and the risorius wheel
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp()
import bpy
import numpy as np

PROJECT = Path(__file__).resolve().parents[1]
DRAGS = 100


def main(file: str) -> None:
    """Install the add-on from the source folder, load the face `file`, and drag 100 vertices."""
    user = Path(os.environ["BLENDER_USER_RESOURCES"]) / "extensions" / "user_default"
    user.mkdir(parents=True)
    (user / "risorius").symlink_to(PROJECT / "addon" / "risorius")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.risorius")
    bpy.ops.risorius.import_dna(filepath=file)
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    stroke = sys.modules["bl_ext.user_default.risorius.scene.drag.stroke"]
    skin = sys.modules["bl_ext.user_default.risorius.scene.drag.skin"]
    live = sys.modules["bl_ext.user_default.risorius.scene.character.runtime"].of(rig)
    surface = skin.Skin.of(bpy.context, rig, live).surface
    head = max(surface.mesh_indices, key=lambda m: surface.vertex_counts[m])
    vertices = [int(v) for v in surface_vertices(surface, live, head)]
    begins, events, apart = [], [], []
    for number in range(DRAGS):
        before = time.perf_counter()
        held = stroke.begin(bpy.context, rig, (head, vertices[number]), stroke.Options())
        middle = time.perf_counter()
        reach = np.linalg.norm(held.reach, axis=0)
        raw = held.state.seen.copy()
        raw[np.argsort(-reach)[1:5]] = 0.3
        target = held.start + held._of().maps[0] @ (
            surface.positions(raw, head, [vertices[number]])[0] - held._of().rest[0]
        )
        start = time.perf_counter()
        at = held.to(bpy.context, target, np.array((0.0, 1.0, 0.0)))
        end = time.perf_counter()
        held.restore(bpy.context)
        begins.append(1e3 * (middle - before))
        events.append(1e3 * (end - start))
        far = (at - target)[[0, 2]]
        apart.append(float(np.linalg.norm(far) / max(1e-9, np.linalg.norm(target - held.start))))
    for name, values in (("press", begins), ("event to evaluated mesh", events)):
        least, middle, most = min(values), statistics.median(values), max(values)
        print(f"{name}: {least:.1f} / {middle:.1f} / {most:.1f} ms (min / median / max)")
    print(f"left of the way: median {statistics.median(apart):.2%}, worst {max(apart):.2%}")


def surface_vertices(surface, live, mesh):
    """Indices of 100 vertices of a mesh: every fourth of the 400 that the controls move most.

    The 400 vertices are chosen among 2000 that are spread over the mesh.
    """
    raw = np.array(live.rests, np.float32)
    some = np.linspace(0, surface.vertex_counts[mesh] - 1, 2000).astype(int)
    reach = np.linalg.norm(surface.jacobian(raw, mesh, some), axis=(1, 2))
    return some[np.argsort(-reach)[: 4 * DRAGS : 4]]


main(sys.argv[-1])
sys.stdout.flush()
os._exit(0)
