# SPDX-License-Identifier: MIT
"""Checks the uses of a page: dropping takes and sounds on it, touch, embedding in other pages.

Also checks that no page requests an address of the network.
"""

from __future__ import annotations

import base64
import io
import json
import wave
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import risorius
from browser import Browser
from risorius import web
from risorius.baking.clips import load_performance
from risorius.baking.face import load_face
from risorius.importing.tables import LIVE_LINK_FACE
from risorius.web import page as pages

_ALIKE = 2e-3  # largest difference of a control, because the page interpolates between frames
_OWN = ("file:", "data:", "blob:", "about:")
DROP = """(async () => {
  const [name, text] = %s;
  const data = new DataTransfer();
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  data.items.add(new File([bytes], name));
  const ended = new Promise((done) => {
    const load = risorius.player.load.bind(risorius.player);
    const listen = risorius.player.listen.bind(risorius.player);
    risorius.player.load = (...all) => (done("played"), load(...all));
    risorius.player.listen = (...all) => (listen(...all), all[0] && done("heard"));
    setTimeout(() => done(document.getElementById("error-text").textContent), 4000);
  });
  dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
  const said = await ended;
  delete risorius.player.load;
  delete risorius.player.listen;
  risorius.player.pause();
  return said;
})()"""
EYE = """(async () => {
  const { stage } = risorius;
  const part = risorius.shown.find(({ skin }) => skin.mesh.kind === "eyes");
  const points = part.skin.view();
  const middle = [0, 0, 0];
  const share = 6 / points.length;
  for (let i = 0; i < points.length; ++i) if (i % 6 < 3) middle[i % 6] += share * points[i];
  stage.orbit.minDistance = 0;
  stage.orbit.target.set(...middle);
  stage.camera.position.set(middle[0], middle[1], middle[2] + 0.12);
  stage.camera.near = 0.01;
  stage.camera.updateProjectionMatrix();
  stage.orbit.update();
  stage.dirty = true;
  stage.draw();
  const gl = risorius.canvas.getContext("webgl2");
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const side = Math.round(height * 0.28);
  const pixels = new Uint8Array(4 * side * side);
  const at = [(width - side) / 2, (height - side) / 2];
  gl.readPixels(...at, side, side, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const colors = new Set();
  let dark = 0;
  for (let i = 0; i < pixels.length; i += 4) {
    colors.add((pixels[i] >> 4) * 256 + (pixels[i + 1] >> 4) * 16 + (pixels[i + 2] >> 4));
    if (pixels[i] + pixels[i + 1] + pixels[i + 2] < 90) dark += 1;
  }
  stage.home();
  return [colors.size, dark / (side * side)];
})()"""
TOUCH = """JSON.stringify([risorius.stage.camera.position.toArray(),
  risorius.stage.camera.position.distanceTo(risorius.stage.orbit.target)])"""


async def all_of(one: Browser, built: Path, face: Path) -> AsyncIterator[str]:
    """Run all checks. Yields a sentence for each one that passes.

    Args:
        one: the browser.
        built: folder of the built page.
        face: the DNA file.

    Raises:
        RuntimeError: a check fails.
    """
    dna = risorius.load(face)
    looks = web.find_looks(dna, face)
    page = built / "pages" / "plain.html"
    page.write_bytes(pages.render(dna, "Plain", looks=looks))
    yield await _eye(one, page, "with its pictures")
    bare = built / "pages" / "bare.html"
    bare.write_bytes(pages.render(dna, "Bare"))
    yield await _eye(one, bare, "without a picture")
    for line in await _drops(one, built, page, face):
        yield line
    yield await _touch(one, page)
    yield await _embedded(one, built, dna, looks)
    foreign = [url for url in one.asked if not url.startswith(_OWN)]
    if foreign:
        raise RuntimeError(f"a page asked for {foreign[0]}")
    yield f"no page asked for an address outside, of {len(one.asked)}"


async def _open(one: Browser, page: Path, width: int, height: int, phone: bool = False) -> None:
    """Open a page at a low resolution, because drawing without a GPU is slow."""
    await one.open(page, width, height, phone)
    await one.evaluate("risorius.stage.renderer.setPixelRatio(0.2), risorius.stage.resize()")


async def _eye(one: Browser, page: Path, how: str) -> str:
    """Check that an eye has an iris: many colours, and a dark part in the middle of the picture.

    Args:
        one: the browser.
        page: path of the page.
        how: words after "an eye" in the sentences, such as "without a picture".

    Returns: a sentence for the report.

    Raises:
        RuntimeError: the eye has no iris.
    """
    await one.open(page, 400 + 350, 400)
    colors, dark = await one.evaluate(EYE)
    if colors < 40 or not 0.01 < dark < 0.2:
        raise RuntimeError(f"an eye {how}: {colors} colours, {dark:.0%} of it dark: no iris")
    return f"an eye {how}: {colors} colours, {dark:.0%} of its middle dark"


async def _drops(one: Browser, built: Path, page: Path, face: Path) -> list[str]:
    await _open(one, page, 700, 300)
    said = []
    names = ["Timecode", "BlendShapeCount", *LIVE_LINK_FACE]
    rows = []
    for f in range(90):
        wave_ = 0.5 - 0.5 * np.cos(f / 15)
        values = [
            round(float(wave_ * (0.2 + 0.6 * (i % 3 == 0))), 6) for i in range(len(LIVE_LINK_FACE))
        ]
        rows.append([f"10:00:{f // 60:02d}:{f % 60:02d}.000", "61", *map(str, values)])
    take = built / "pages" / "take.csv"
    take.write_text("\n".join(",".join(row) for row in [names, *rows]) + "\n", encoding="utf-8")
    clip = load_performance(take, load_face(face)).clip
    clip.save(built / "pages" / "take.rzc")
    for name in ("take.csv", "take.rzc"):
        said.append(await _dropped(one, built / "pages" / name, clip, face))
    sound = io.BytesIO()
    with wave.open(sound, "wb") as file:
        file.setparams((1, 2, 16000, 0, "NONE", ""))
        time = np.arange(16000) / 16000
        loud = np.sin(2 * np.pi * 220 * time) * (np.sin(2 * np.pi * 2 * time) > 0) * 20000
        file.writeframes(loud.astype("<i2").tobytes())
    heard = await _drop(one, "voice.wav", sound.getvalue())
    if heard != "heard":
        raise RuntimeError(f"voice.wav beside a take: {heard}")
    await _open(one, page, 700, 300)
    heard = await _drop(one, "voice.wav", sound.getvalue())
    jaw = await one.evaluate(
        "(() => { const out = [];"
        " const jaw = risorius.controls.findIndex((n) => /jawOpen$/.test(n));"
        " for (const t of [0.12, 0.4]) { risorius.player.seek(t); out.push(risorius.raw[jaw]); }"
        " return out; })()"
    )
    if heard != "played" or jaw[0] < 0.15 or jaw[1] > 0.05:
        raise RuntimeError(f"voice.wav alone: {heard}, the jaw opens by {jaw}")
    refused = await _drop(one, "notes.txt", b"hello")
    if "notes.txt: a name ending in .csv, .rzc or .wav was expected" not in refused:
        raise RuntimeError(f"notes.txt: {refused}")
    return [*said, "voice.wav goes with a take, and alone it opens the mouth", refused]


async def _drop(one: Browser, name: str, data: bytes) -> str:
    return str(await one.evaluate(DROP % json.dumps([name, base64.b64encode(data).decode()])))


async def _dropped(one: Browser, file: Path, clip: risorius.Clip, face: Path) -> str:
    """Compare the controls of a take dropped on the page with the clip that Python makes of it."""
    played = await _drop(one, file.name, file.read_bytes())
    if played != "played":
        raise RuntimeError(f"{file.name}: {played}")
    names = risorius.load(face, layers="definition").raw_control_names
    worst, compared = 0.0, 0
    for frame in (20, 47):
        found = await one.evaluate(f"risorius.player.seek({frame / 60}), [...risorius.raw]")
        for name, curve in zip(clip.names, clip.curves, strict=True):
            if name in names:
                compared += 1
                worst = max(worst, abs(found[names.index(name)] - float(curve[frame])))
    if worst > _ALIKE or compared < 100:
        raise RuntimeError(f"{file.name}: of {compared} values the worst is {worst:.4f} off")
    return f"{file.name} plays: {compared} values of controls as Python has them to {worst:.1e}"


async def _touch(one: Browser, page: Path) -> str:
    """Check touch in an emulated phone: one finger turns the face or drags a slider, two zoom."""
    await _open(one, page, 390, 844, phone=True)

    async def strokes(*fingers: tuple[tuple[int, int], tuple[int, int]]) -> None:
        async def send(kind: str, share: float) -> None:
            points = [
                {"x": a[0] + share * (b[0] - a[0]), "y": a[1] + share * (b[1] - a[1]), "id": i}
                for i, (a, b) in enumerate(fingers)
            ]
            shown = [] if kind == "touchEnd" else points
            await one.call("Input.dispatchTouchEvent", type=kind, touchPoints=shown)

        await send("touchStart", 0)
        for step in range(1, 6):
            await send("touchMove", step / 5)
        await send("touchEnd", 1)
        await one.evaluate("new Promise((f) => setTimeout(f, 400))")

    rest, far = json.loads(await one.evaluate(TOUCH))
    await strokes(((120, 200), (260, 200)))
    turned, _ = json.loads(await one.evaluate(TOUCH))
    await strokes(((180, 200), (80, 200)), ((210, 200), (310, 200)))
    _, near = json.loads(await one.evaluate(TOUCH))
    place = await one.evaluate(
        "(() => { const s = document.querySelector('.row input');"
        " s.scrollIntoView({block: 'center'}); const b = s.getBoundingClientRect();"
        " return [b.left + 11, b.top + b.height / 2, b.width]; })()"
    )
    thumb, at = int(place[0]), int(place[1])
    await strokes(((thumb, at), (thumb + int(0.6 * place[2]), at)))
    value = await one.evaluate("document.querySelector('.row input').valueAsNumber")
    if np.allclose(rest, turned, atol=1e-3) or not near < 0.9 * far or not 0.2 < value < 0.95:
        raise RuntimeError(
            f"touch: from {rest} to {turned}, {far} to {near} away, a slider at {value}"
        )
    nearer = f"comes {far / near:.1f} times nearer"
    return f"touch in an emulated phone turns the face, {nearer}, moves a slider"


async def _embedded(one: Browser, built: Path, dna: risorius.Dna, looks: web.looks.Looks) -> str:
    """Check the element <risorius-face> on a page of another author."""
    script = built / "pages" / "sample.js"
    script.write_bytes(pages.render_script(dna, "sample", looks=looks))
    page = built / "pages" / "embedded.html"
    page.write_text(
        '<!DOCTYPE html><meta charset="utf-8"><body data-state="loading"><h1>My page</h1>\n'
        '<script src="sample.js"></script>\n'
        "<risorius-face></risorius-face>\n"
        "<script>document.querySelector('risorius-face').addEventListener('ready', (event) => {"
        " event.target.set({ jawOpen: 0.4 }); document.body.dataset.state = 'ready'; });\n"
        "</script>\n",
        encoding="utf-8",
    )
    state = await one.open(page, 800, 700)
    jaw = await one.evaluate(
        "(() => { const v = document.querySelector('risorius-face').viewer;"
        " return v.raw[v.controls.findIndex((n) => /jawOpen$/.test(n))]; })()"
    )
    await one.picture(built / "pictures" / "embedded.png")
    if state != "ready" or abs(jaw - 0.4) > 1e-6:
        raise RuntimeError(f"<risorius-face>: {state}, jawOpen is {jaw}")
    return f"<risorius-face> of {script.stat().st_size:,} bytes, from three lines"
