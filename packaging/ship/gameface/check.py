# SPDX-License-Identifier: MIT
"""check.py FOLDER FACE.dna [TAKE.csv]: compares three.js in chromium with the file and the rig.

FOLDER has node_modules, page.html and combinations.js. The face is exported as glTF. With each
morph target alone, the vertices in three.js must equal both the vertices computed from the exported
file (base positions plus weighted targets) and the rig's vertices. For frames of a take, they must
equal the vertices computed from the file. The distance from the rig is printed with and without
combinations.js, which sets the weights of the targets for combinations; with it, the distance must
be at most DRIVEN_MM, 0.5 mm.
"""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import risorius
from clients import CLIENT_MM, LOD, QUANTIZED_MM, Browser, GlbFile, apart, listed, page, places
from gameface_take import Posed, driven, units_of
from risorius.gameface import Wishes, export

KINDS = {
    "plain": Wishes(lod=LOD, within=0.5),
    "sparse": Wishes(lod=LOD, within=0.5, sparse=True, skeleton=False),
    "packed": Wishes(lod=LOD, within=0.5, quantize=True, meshopt=True),
}
FITTED = "fitted"  # as packed, with combinations fitted to the first half of the take
ALLOWED_MM = {
    "plain": CLIENT_MM, "sparse": CLIENT_MM, "packed": QUANTIZED_MM, FITTED: QUANTIZED_MM
}  # fmt: skip
DRIVEN_MM = 0.5
FRAMES = 12


async def client(one: Browser, weights: Mapping[str, float], *, table: bool) -> dict[str, Any]:
    """Mesh name -> vertex positions in three.js, float64[V, 3], metres.

    Args:
        one: the browser.
        weights: morph target -> weight.
        table: whether combinations.js also sets the weights of the targets for combinations.
    """
    found = await one.evaluate(f"at({json.dumps(dict(weights))}, {json.dumps(table)})")
    return places(found)


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
        away = apart(at, posed.rig_at(target.raw))
        listed(folder, f"three.js {kind}", target.name, away)
        worst_rig = max(worst_rig, away)
    print(
        f"  single poses: three.js from the file {worst_file:.4f} mm, "
        f"from the rig {worst_rig:.4f} mm"
    )
    if max(worst_file, worst_rig) > ALLOWED_MM[kind]:
        raise RuntimeError(f"{kind}: at most {ALLOWED_MM[kind]} mm were expected")
    if take is None:
        print("  NOT RUN: no real take")
    else:
        await try_take(one, posed, take, table, kind)
    await client(one, {"mouthSmileLeft": 0.8, "mouthSmileRight": 0.8, "jawOpen": 0.3}, table=True)
    if not await one.evaluate("draw()"):
        raise RuntimeError(f"{kind}: three.js draws no triangle")
    await one.picture(folder / f"{kind}.png")


async def try_take(one: Browser, posed: Any, take: Path, table: Any, kind: str) -> None:
    """Compare frames of a take in three.js with vertices computed from the file and with the rig.

    Args:
        one: the browser.
        posed: computes vertices from the file and from the rig.
        take: the take, a Live Link Face CSV.
        table: the combination table of the file.
        kind: name of the file's kind, key of KINDS.
    """
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
    if max(row[4] for row in rows) > DRIVEN_MM:
        raise RuntimeError(f"{kind}: frames within {DRIVEN_MM} mm of the rig were expected")
    if max(max(row[1:3]) for row in rows) > ALLOWED_MM[kind]:
        raise RuntimeError(
            f"{kind}: the client's sums: at most {ALLOWED_MM[kind]} mm were expected"
        )


async def main(folder: Path, face: Path, take: Path | None) -> None:
    if take is not None:
        units = units_of(take)
        KINDS[FITTED] = replace(KINDS["packed"], frames=units[: len(units) // 2 : 8])
    async with page(folder, "page.html") as one:
        for kind in KINDS:
            await try_kind(one, folder, face, kind, take)


where = Path(sys.argv[1])
its_take = Path(sys.argv[3]) if len(sys.argv) > 3 else None
asyncio.run(main(where, Path(sys.argv[2]), its_take))
