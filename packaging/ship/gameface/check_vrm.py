# SPDX-License-Identifier: MIT
"""check_vrm.py FOLDER FACE.dna [TAKE.csv [VOICE.wav]]: tests exported VRM files in three-vrm.

With each expression alone, the vertices must equal both the vertices computed from the file (base
positions plus weighted targets) and the rig's vertices. A real take is played by the 52 ARKit
units, a voice by visemes. Also checks that emotions override blinks as the file says, that the head
turns, and that the eyes look at a target by expressions.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import risorius
from clients import (
    CLIENT_MM,
    LOD,
    QUANTIZED_MM,
    Browser,
    GlbFile,
    apart,
    from_the_file,
    listed,
    page,
    places,
    say,
)
from gameface_take import Posed, units_of
from risorius import speech
from risorius.controls import arkit
from risorius.gameface import Wishes, export
from risorius.gameface.avatar.humanoid import NEEDED
from risorius.gameface.avatar.vrm import PRESETS
from risorius.speech.articulation import viseme_weights
from risorius.speech.phones import VISEMES

LICENCE = {
    "name": "Sample person", "authors": ["Risorius"], "avatarPermission": "everyone",
    "allowExcessivelyViolentUsage": False, "allowExcessivelySexualUsage": False,
    "commercialUsage": "corporation", "allowPoliticalOrReligiousUsage": False,
    "allowAntisocialOrHateUsage": False, "creditNotation": "unnecessary",
    "allowRedistribution": True, "modification": "allowModificationRedistribution",
    "licenseName": "CC0",
}  # fmt: skip
SHAPES = ("vrm", "arkit", "visemes")
FILES = {
    "new": Wishes(SHAPES, LOD, sparse=True, humanoid="minimal", vrm="1.0", licence=LICENCE),
    "packed": Wishes(SHAPES, LOD, quantize=True, humanoid="minimal", vrm="1.0", licence=LICENCE),
    "old": Wishes(SHAPES, LOD, humanoid="minimal", vrm="0.x", licence=LICENCE),
}
ALLOWED_MM = {"new": CLIENT_MM, "packed": QUANTIZED_MM, "old": CLIENT_MM}
FRAMES = 12
LOOKED_AT = ((0.5, 0.2, 2.0), (-0.8, 0.1, 2.0), (0.3, -0.6, 2.0))  # targets, metres from the eyes
GAZE_DEGREES = 1.5


class Shown:
    """A file shown in three-vrm.

    Attributes:
        worst: largest distance in mm so far between a vertex in three-vrm and its position computed
            from the file.
    """

    def __init__(self, one: Browser, found: GlbFile) -> None:
        self.one, self.found, self.worst = one, found, 0.0

    async def at(
        self, expressions: Mapping[str, float], turns: Mapping[str, float] | None = None,
        look: Any = None,
    ) -> dict[str, Any]:  # fmt: skip
        asked = f"at({say(dict(expressions))}, {say(turns or {})}, {say(look)})"
        state: dict[str, Any] = await self.one.evaluate(asked)
        self.worst = max(self.worst, from_the_file(self.found, state, {}))
        return state


def weights_of(state: Mapping[str, Any]) -> dict[str, float]:
    """Morph target -> its weight. Asserts that all meshes have the same weights."""
    out: dict[str, float] = {}
    for weights in state["weights"].values():
        for name, weight in weights.items():
            assert abs(out.setdefault(name, weight) - weight) < 1e-6, name
    return out


def expect(weights: Mapping[str, float], wanted: Mapping[str, float]) -> None:
    """Check the weights of all morph targets.

    Args:
        weights: morph target -> weight found in three-vrm.
        wanted: morph target -> expected weight, clamped to 0..1; 0 for targets that are missing.
    """
    for name, weight in weights.items():
        asked = min(1.0, max(0.0, wanted.get(name, 0.0)))
        if abs(weight - asked) > 1e-3:
            raise RuntimeError(f"{name}: a weight of {asked:.3f} was expected, found {weight:.3f}")


async def try_file(
    one: Browser, folder: Path, face: Path, kind: str, take: Path | None, voice: Path | None
) -> None:
    dna, rig = risorius.load(face), risorius.compile_cached(face)
    data = export(dna, rig, face, f"{kind}.vrm", FILES[kind]).files[f"{kind}.vrm"]
    (folder / f"{kind}.vrm").write_bytes(data)
    found = GlbFile(data)
    shown = Shown(one, found)
    about = await one.evaluate(f"load('{kind}.vrm')")
    print(f"{kind}.vrm: {len(data):,} bytes, VRM {about['version']}: {about['name']}, "
          f"{len(about['bones'])} bones, {len(about['expressions'])} expressions")  # fmt: skip
    assert set(NEEDED) <= set(about["bones"]), about["bones"]
    assert about["look"] == "VRMLookAtExpressionApplier", about["look"]
    named = {name.lower() for name in about["expressions"]}
    assert {*map(str.lower, PRESETS), *map(str.lower, arkit.mapping())} <= named
    await try_expressions(shown, folder, dna, rig, kind)
    await try_clips(shown, take, voice)
    await try_gaze(shown, found)
    for angle in (0.4, -0.3, 0.0):
        await shown.at({"happy": 1.0}, {"head": angle, "neck": angle / 2})
    print(f"  all of it from the file's numbers: {shown.worst:.4f} mm")
    if shown.worst > ALLOWED_MM[kind]:
        raise RuntimeError(f"{kind}.vrm: at most {ALLOWED_MM[kind]} mm were expected")
    await shown.at({"happy": 0.8, "aa": 0.2}, {"head": 0.25}, [0.6, 1.6, 2.0])
    if not await one.evaluate("draw()"):
        raise RuntimeError(f"{kind}.vrm: three-vrm draws no triangle")
    await one.picture(folder / f"{kind}_vrm.png")


async def try_expressions(shown: Shown, folder: Path, dna: Any, rig: Any, kind: str) -> None:
    posed, worst = Posed(dna, rig, shown.found, LOD, facing_back=kind == "old"), 0.0
    for target in posed.targets(SHAPES):
        name = target.name if kind != "old" else old_name(target.name)
        asked = {name: 1.0, **({target.needs: 1.0} if target.needs else {})}
        state = await shown.at(asked)
        on = weights_of(state)
        expect(on, {target.name: 1.0, target.needs: 1.0})
        at_rig = posed.rig_at(target.raw)
        if kind == "old":  # three-vrm turns VRM 0.x files by 180 degrees, so that they face +z
            at_rig = {mesh: at * [-1, 1, -1] for mesh, at in at_rig.items()}
        away = apart(places(state["places"]), at_rig)
        listed(folder, f"three-vrm {kind}", target.name, away)
        worst = max(worst, away)
    print(f"  single expressions from the rig: {worst:.4f} mm")
    if worst > ALLOWED_MM[kind]:
        raise RuntimeError(f"{kind}.vrm: at most {ALLOWED_MM[kind]} mm were expected")


def old_name(name: str) -> str:
    """The name of a morph target's expression in three-vrm for VRM 0.x.

    Only "surprised" has another name there, "Surprised".
    """
    return "Surprised" if name == "surprised" else name


async def try_clips(shown: Shown, take: Path | None, voice: Path | None) -> None:
    if take is None:
        print("  NOT RUN: no real take")
    else:
        units = units_of(take)
        every = range(0, len(units), max(1, len(units) // FRAMES))
        for frame in every:
            expect(weights_of(await shown.at(units[frame])), units[frame])
        print(f"  a take of {len(units):,} frames: {len(every)} frames as asked for")
    if voice is None:
        print("  NOT RUN: no voice")
        return
    text = voice.with_suffix(".txt").read_text()
    sounds = speech.phonemes(voice, text)
    times = np.arange(0, sounds[-1].end, 0.1)
    curves, heard = viseme_weights(sounds, times), set()
    for row in curves:
        said = {f"viseme_{n}": round(float(w), 4) for n, w in zip(VISEMES, row, strict=True)}
        on = weights_of(await shown.at(said))
        expect(on, said)
        heard |= {name for name, weight in on.items() if weight > 0.3}
    print(f"  a voice of {times[-1]:.1f} s: {len(heard)} visemes")
    assert len(heard) >= 8, heard


async def try_gaze(shown: Shown, found: GlbFile) -> None:
    """Check that the eyes look at a target, and that emotions reduce blinks as the file says."""
    eyes = np.array(await shown.one.evaluate("eyes()"))
    sides = np.array([-1, 1, -1] if "VRM" in found.json["extensions"] else [1, 1, 1])
    front, worst = np.array([0.0, 0.0, 1.0]) * sides, 0.0
    for offset in LOOKED_AT:
        state = await shown.at({}, look=(eyes + offset).tolist())
        on = weights_of(state)
        for side in ("Left", "Right"):
            [mesh] = [name for name in found.meshes() if name.startswith(f"eye{side}")]
            gaze = turned(found.positions(mesh), found.positions(mesh, on)) @ front * sides
            aim = np.array(offset) / np.linalg.norm(offset)
            worst = max(worst, float(np.degrees(np.arccos(np.clip(gaze @ aim, -1, 1)))))
    print(f"  the gaze from where it shall go: {worst:.2f} degrees")
    if worst > GAZE_DEGREES:
        raise RuntimeError(f"a gaze within {GAZE_DEGREES} degrees was expected")
    if "VRMC_vrm" in found.json["extensions"]:
        preset = found.json["extensions"]["VRMC_vrm"]["expressions"]["preset"]
        for name in ("happy", "sad", "surprised"):
            on = weights_of(await shown.at({name: 0.75, "blink": 1.0}))
            held = preset[name]["overrideBlink"] == "blend"
            expect(on, {name: 0.75, "blink": 0.25 if held else 1.0})


def turned(rest: Any, at: Any) -> Any:
    """float64[3, 3]: the rotation that best moves an eye's neutral vertices onto its posed
    vertices.

    Args:
        rest: neutral vertices [V, 3].
        at: posed vertices [V, 3].
    """
    rest, at = rest - rest.mean(axis=0), at - at.mean(axis=0)
    left, _, right = np.linalg.svd(rest.T @ at)
    return (left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right).T


async def main(folder: Path, face: Path, take: Path | None, voice: Path | None) -> None:
    async with page(folder, "vrm.html") as one:
        for kind in FILES:
            await try_file(one, folder, face, kind, take, voice)


given = [Path(text) for text in sys.argv[1:]] + [None, None]
asyncio.run(main(given[0], given[1], given[2], given[3]))
