# SPDX-License-Identifier: MIT
"""check_body.py FOLDER FACE.dna [BODY.glb]: tests a face with long hair on a body in three-vrm.

Without BODY a small body is made. The hair of the face is made five times as long, so that it
hangs. Writes body_new.vrm and body_old.vrm.
"""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Any

import numpy as np
import risorius
from clients import CLIENT_MM, LOD, Browser, GlbFile, apart, from_the_file, page, places
from risorius.author.geometry.simplify import fan_triangles
from risorius.controls import arkit
from risorius.gameface import Wishes, export
from risorius.gameface.avatar.humanoid import NEEDED
from risorius.gameface.joints.hair import find_cards

LICENCE = {
    "name": "Sample person", "authors": ["Risorius"], "avatarPermission": "everyone",
    "allowExcessivelyViolentUsage": False, "allowExcessivelySexualUsage": False,
    "commercialUsage": "corporation", "allowPoliticalOrReligiousUsage": False,
    "allowAntisocialOrHateUsage": False, "creditNotation": "unnecessary",
    "allowRedistribution": True, "modification": "allowModificationRedistribution",
    "licenseName": "CC0",
}  # fmt: skip
VERSIONS = {"body_new": "1.0", "body_old": "0.x"}
LONGER = 5
SWINGS_MM = 1.0  # least distance that a hair vertex must swing after the head has turned


def long_haired(face: Path) -> Any:
    """A face whose hair cards are LONGER (5) times as long, measured down from their roots."""
    dna = risorius.load(face)
    for name, mesh in zip(dna.mesh_names, dna.meshes, strict=True):
        if name.startswith("hair"):
            points = np.array(mesh.positions, np.float64)
            triangles = mesh.layout_positions.astype(np.int64)[fan_triangles(mesh)]
            cards = find_cards(points, np.arange(len(points)), triangles)
            top = cards.root[cards.of_vertex]
            points[:, 1] = top - LONGER * (top - points[:, 1])
            mesh.positions = points.astype(np.float32)
    return dna


def wishes(version: str, body: Path) -> Wishes:
    return Wishes(
        ("vrm", "arkit"), LOD, sparse=True, vrm=version, licence=LICENCE, body=body,
        without=("shirt",),
    )  # fmt: skip


async def try_file(one: Browser, folder: Path, name: str) -> None:
    found = GlbFile((folder / f"{name}.vrm").read_bytes())
    about = await one.evaluate(f"load('{name}.vrm')")
    assert set(NEEDED) <= set(about["bones"]), about["bones"]
    assert {n.lower() for n in arkit.mapping()} <= {n.lower() for n in about["expressions"]}
    assert about["springs"] > 0, "three-vrm knows no spring"
    sides = [-1, 1, -1] if name == "body_old" else [1, 1, 1]
    rest = places((await one.evaluate("rest()"))["places"])
    at_file = {mesh: found.positions(mesh) * sides for mesh in found.meshes()}
    worst = apart(rest, at_file)
    [hair] = [mesh for mesh in rest if mesh.startswith("hair")]
    # The head turns immediately, and the hair follows later.
    turned = await one.evaluate("at({jawOpen: 1.0}, {head: 0.6}, null)")
    later = await one.evaluate("wait()")
    for state in (turned, later):
        worst = max(worst, from_the_file(found, state, {}))
    before, after = (places(state["places"])[hair] for state in (turned, later))
    swung = 1000 * float(np.linalg.norm(after - before, axis=1).max())
    print(f"{name}.vrm: {about['springs']} springs, {worst:.4f} mm from the file's numbers, hair "
          f"swings {swung:.0f} mm")  # fmt: skip
    if worst > CLIENT_MM or not swung > SWINGS_MM:
        raise RuntimeError(f"{name}.vrm: at most {CLIENT_MM} mm, and {SWINGS_MM} mm of hair")
    if not await one.evaluate("draw()"):
        raise RuntimeError(f"{name}.vrm: three-vrm draws no triangle")
    await one.picture(folder / f"{name}_vrm.png")


async def main(folder: Path, face: Path, body: Path | None) -> None:
    if body is None:
        from body_maker import BodyFile

        body = folder / "bodies" / "body.glb"  # not one of the files that the validator reads
        body.parent.mkdir(exist_ok=True)
        body.write_bytes(BodyFile(prefix="mixamorig").data())
    dna = long_haired(face)
    rig = risorius.Rig(dna)
    for name, version in VERSIONS.items():
        made = export(dna, rig, face, f"{name}.vrm", wishes(version, body))
        (folder / f"{name}.vrm").write_bytes(made.files[f"{name}.vrm"])
    async with page(folder, "vrm.html") as one:
        for name in VERSIONS:
            await try_file(one, folder, name)


given = [Path(text) for text in sys.argv[1:]] + [None]
asyncio.run(main(given[0], given[1], given[2]))
