# SPDX-License-Identifier: MIT
"""check_talk.py FOLDER FACE.dna [TAKE.csv [VOICE.wav]]: tests a face with a body in TalkingHead.

TalkingHead plays frames of a real take as face tracking, and speaks a voice with its transcript,
while the body moves. At each sampled moment, the vertices in TalkingHead must equal the positions
computed from the file's numbers with TalkingHead's joints and weights.
"""

from __future__ import annotations

import asyncio
import shutil
import sys
from pathlib import Path

import risorius
from clients import CLIENT_MM, LOD, QUANTIZED_MM, Browser, GlbFile, from_the_file, page, say
from gameface_take import units_of
from risorius.gameface import Wishes, export

SHAPES = ("arkit", "visemes")
FILES = {
    "talk": Wishes(SHAPES, LOD, sparse=True, humanoid="mixamo"),
    "talk_packed": Wishes(SHAPES, LOD, quantize=True, humanoid="mixamo"),
}
ALLOWED_MM = {"talk": CLIENT_MM, "talk_packed": QUANTIZED_MM}
FRAMES = 8
MOMENTS = 40
# TalkingHead controls the lids and the gaze itself, so these units of a take are left out.
OWN = ("eyeBlink", "eyeLook")


async def try_file(
    one: Browser, folder: Path, face: Path, kind: str, take: Path | None, voice: Path | None
) -> None:
    dna, rig = risorius.load(face), risorius.compile_cached(face)
    data = export(dna, rig, face, f"{kind}.glb", FILES[kind]).files[f"{kind}.glb"]
    (folder / f"{kind}.glb").write_bytes(data)
    found, worst = GlbFile(data), 0.0
    shown = dict(await one.evaluate(f"load('{kind}.glb')"))
    mixes = await one.evaluate("mixes()")
    for mesh in found.meshes():
        assert shown[mesh][: len(found.names(mesh))] == found.names(mesh)
    print(f"{kind}.glb: {len(data):,} bytes")
    if take is None:
        print("  NOT RUN: no real take")
    else:
        units = units_of(take)
        for frame in range(0, len(units), max(1, len(units) // FRAMES)):
            wanted = {u: v for u, v in units[frame].items() if not u.startswith(OWN)}
            state = await one.evaluate(f"frame({say(wanted)})")
            worst = max(worst, from_the_file(found, state, mixes))
            on = state["weights"]["head_lod2_mesh"]
            off = max((abs(on[u] - min(1.0, max(0.0, v))), u) for u, v in wanted.items())
            if off[0] > 0.01:
                raise RuntimeError(f"frame {frame}: weights of the take were expected: {off}")
        print(f"  a take: {FRAMES} frames and more, from the file's numbers {worst:.4f} mm")
        await one.evaluate(f"frame({say(dict.fromkeys(units[0], None))})")
    if voice is None:
        print("  NOT RUN: no voice")
    else:
        worst = max(worst, await try_voice(one, folder, found, kind, voice))
    if worst > ALLOWED_MM[kind]:
        raise RuntimeError(f"{kind}: at most {ALLOWED_MM[kind]} mm were expected")


async def try_voice(one: Browser, folder: Path, found: GlbFile, kind: str, voice: Path) -> float:
    """Let the avatar speak.

    Returns the largest distance in mm between a vertex in TalkingHead and its position computed
    from the file.

    Args:
        one: the browser.
        folder: folder of the page; a picture of the avatar is written into it.
        found: the exported file.
        kind: key of FILES.
        voice: the sound; its transcript is the file with the ending .txt.
    """
    shutil.copy(voice, folder / "voice.wav")
    words = voice.with_suffix(".txt").read_text().split()
    mixes, heard, worst = await one.evaluate("mixes()"), set[str](), 0.0
    seconds = await one.evaluate(f"say('voice.wav', {say(words)})")
    for moment in range(MOMENTS):
        await asyncio.sleep(seconds / MOMENTS)
        state = await one.evaluate("now()")
        on = state["weights"]["head_lod2_mesh"]
        heard |= {name for name, weight in on.items() if "viseme" in name and weight > 0.2}
        if moment % 8 == 3:
            worst = max(worst, from_the_file(found, state, mixes))
        if moment == MOMENTS // 3:
            await one.picture(folder / f"{kind}.png")
    print(
        f"  a voice of {seconds:.1f} s: {len(heard)} visemes, from the file's numbers "
        f"{worst:.4f} mm"
    )
    if len(heard) < 5:
        raise RuntimeError(f"{kind}: visemes were expected, found {sorted(heard)}")
    return worst


async def main(folder: Path, face: Path, take: Path | None, voice: Path | None) -> None:
    for kind in FILES:
        async with page(folder, "talk.html", 245, 280) as one:
            await try_file(one, folder, face, kind, take, voice)


given = [Path(text) for text in sys.argv[1:]] + [None, None]
asyncio.run(main(given[0], given[1], given[2], given[3]))
