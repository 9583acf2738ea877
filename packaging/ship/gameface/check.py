# SPDX-License-Identifier: MIT
"""check.py FOLDER FACE.dna [TAKE.csv]: three.js in headless chromium against the file and the rig.

FOLDER has node_modules, page.html and combinations.js. Each target alone is where the file's own
numbers say and where the rig has it; on frames of a take three.js has the sum of the file's
numbers, and what it deviates from the rig is listed, with the combination driver and without.
"""

from __future__ import annotations

import asyncio
import base64
import functools
import http.server
import json
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import risorius
from risorius.gameface import Wishes, export

HERE = Path(__file__).resolve().parent
PROJECT = HERE.parents[2]
sys.path[:0] = [str(HERE.parent / "web"), str(PROJECT / "tests" / "python" / "support")]

from browser import Browser, browser  # noqa: E402
from gameface_take import Posed, driven, units_of  # noqa: E402
from gltf_oracle import GlbFile  # noqa: E402

LOD = 2
KINDS = {
    "plain": Wishes(lod=LOD, within=0.5),
    "sparse": Wishes(lod=LOD, within=0.5, sparse=True, skeleton=False),
    "packed": Wishes(lod=LOD, within=0.5, quantize=True, meshopt=True),
}
CLIENT_MM = {"plain": 0.05, "sparse": 0.05, "packed": 0.2}
FRAMES = 12


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        del format, args


async def client(one: Browser, weights: Mapping[str, float], *, table: bool) -> dict[str, Any]:
    """float64[V, 3] of each mesh, as three.js has it."""
    found = await one.evaluate(f"at({json.dumps(dict(weights))}, {json.dumps(table)})")
    return {
        name: np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, 3).astype(np.float64)
        for name, text in found.items()
    }


def apart(a: Mapping[str, Any], b: Mapping[str, Any]) -> float:
    """Millimetres of the vertex that is farthest away."""
    assert a.keys() == b.keys(), (sorted(a), sorted(b))
    return max(1000 * float(np.linalg.norm(a[n] - b[n], axis=1).max()) for n in a)


async def try_kind(one: Browser, folder: Path, face: Path, kind: str, take: Path | None) -> None:
    dna, rig = risorius.load(face), risorius.compile_cached(face)
    made = export(dna, rig, face, f"{kind}.glb", KINDS[kind])
    for name, data in made.files.items():
        (folder / name).write_bytes(data)
    print(f"{kind}.glb: {len(made.files[f'{kind}.glb']):,} bytes")
    for line in made.groups:
        print(f"  {line}")
    found = GlbFile(made.files[f"{kind}.glb"])
    table = json.loads(made.files[f"{kind}.combinations.json"])
    posed = Posed(dna, rig, found, LOD)
    shown = await one.evaluate(f"load('{kind}.glb', '{kind}.combinations.json')")
    assert dict(shown) == {name: found.names(name) for name in found.meshes()}
    worst_file = worst_rig = 0.0
    for target in posed.targets(KINDS[kind].shapes):
        weights = {target.name: 1.0, **({target.needs: 1.0} if target.needs else {})}
        at = await client(one, weights, table=False)
        worst_file = max(worst_file, apart(at, posed.sum(weights)))
        worst_rig = max(worst_rig, apart(at, posed.rig_at(target.raw)))
    print(
        f"  single poses: three.js from the file {worst_file:.4f} mm, "
        f"from the rig {worst_rig:.4f} mm"
    )
    if max(worst_file, worst_rig) > CLIENT_MM[kind]:
        raise RuntimeError(f"{kind}: at most {CLIENT_MM[kind]} mm were expected")
    if take is None:
        print("  NOT RUN: no real take")
    else:
        await try_take(one, posed, take, table, kind)
    await client(one, {"mouthSmileLeft": 0.8, "mouthSmileRight": 0.8, "jawOpen": 0.3}, table=True)
    if not await one.evaluate("draw()"):
        raise RuntimeError(f"{kind}: three.js draws no triangle")
    await one.picture(folder / f"{kind}.png")


async def try_take(one: Browser, posed: Any, take: Path, table: Any, kind: str) -> None:
    """Frames of a take: the sum in three.js, and how far it is from the rig."""
    units, raws = units_of(take), posed.raws_of(take)
    rows = []
    for frame in range(0, len(units), max(1, len(units) // FRAMES)):
        at_rig = posed.rig_at(raws[frame])
        plain = await client(one, units[frame], table=False)
        full = await client(one, units[frame], table=True)
        rows.append(
            (
                frame, apart(plain, posed.sum(units[frame])),
                apart(full, posed.sum(driven(units[frame], table))), apart(plain, at_rig),
                apart(full, at_rig),
            )
        )  # fmt: skip
        _, sums, full_sums, away, full_away = rows[-1]
        print(
            f"  frame {frame:5d}: three.js from the sum {sums:.4f}, driven {full_sums:.4f}; "
            f"from the rig {away:.2f}, driven {full_away:.2f} mm"
        )
    if max(max(row[1:3]) for row in rows) > CLIENT_MM[kind]:
        raise RuntimeError(f"{kind}: the client's sums: at most {CLIENT_MM[kind]} mm were expected")


async def main(folder: Path, face: Path, take: Path | None) -> None:
    handler = functools.partial(_Quiet, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        async with browser() as one:
            address = f"http://127.0.0.1:{server.server_port}/page.html"
            state = await one.open_address(address, 700, 800)
            if state != "ready":
                raise RuntimeError(f"the page is {state}: {one.said}")
            for kind in KINDS:
                await try_kind(one, folder, face, kind, take)
            if one.said:
                raise RuntimeError(f"the page said: {one.said}")
    finally:
        server.shutdown()


where = Path(sys.argv[1])
its_take = Path(sys.argv[3]) if len(sys.argv) > 3 else None
asyncio.run(main(where, Path(sys.argv[2]), its_take))
