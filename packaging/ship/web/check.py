# SPDX-License-Identifier: MIT
"""Checks the web page in a real browser.

    check.py BUILT [FACE.dna]

Compares the page's numbers with the scalar path of the package, checks the error message for a
truncated face, and takes pictures of the page in desktop and phone sizes for visual inspection.
BUILT/page.html is the empty page; the pictures are in BUILT/pictures. If no face is given, a sample
person is built. Exit code 1 if a number differs or the page reports an error.
"""

from __future__ import annotations

import asyncio
import base64
import gzip
import importlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import plays
import risorius
from browser import Browser, browser
from risorius import web
from risorius.baking.face import load_face, prepared
from risorius.web import page as pages

ROOT = Path(__file__).resolve().parents[3]
GOLDEN = ROOT / "tests" / "data" / "golden"
POSES = 12
# Largest allowed distance between a vertex on the page and the same vertex computed with NumPy,
# while a clip turns the head; a fraction of the head's size. It is not 0, because a page rounds
# weights to 1/1024, and shapes to 1/16384 of the head's size.
TURNED = 2e-4
MOST_BYTES = 4_000_000  # largest size of the sample person's page
EVALUATE = """(rows => {
  const floats = [];
  for (const [lod, raw] of rows) {
    const pose = risorius.evaluate(raw, lod);
    floats.push(...pose.joints, ...pose.shapes, ...pose.maps);
  }
  const bytes = new Uint8Array(Float32Array.from(floats).buffer);
  let text = "";
  for (let i = 0; i < bytes.length; i += 4096) {
    text += String.fromCharCode(...bytes.subarray(i, i + 4096));
  }
  return btoa(text);
})(%s)"""


# JavaScript whose value is the posed vertices of the page's first mesh in scene space,
# float32[vertices, 4]: x, y and z, and a fourth number without meaning.
PLACED = (
    "risorius.library.numbers(Float32Array, risorius.parts.get(0).skin.placed,"
    " 4 * risorius.parts.get(0).skin.count)"
)
# JavaScript that draws five poses in which a third of the controls is active. Its value is the
# milliseconds of the median pose: [evaluation, moving the vertices, upload, drawing].
COST = """(async () => {
  const gl = risorius.canvas.getContext("webgl2");
  const own = gl.bufferSubData.bind(gl);
  let upload = 0;
  gl.bufferSubData = (...all) => {
    const begin = performance.now();
    own(...all);
    upload += performance.now() - begin;
  };
  const rows = [];
  for (let turn = 0; turn < 5; ++turn) {
    risorius.raw.forEach((_, i) => (risorius.raw[i] = i % 3 ? 0 : 0.1 + 0.02 * turn));
    risorius.pose();
    upload = 0;
    const begin = performance.now();
    risorius.stage.draw();
    gl.finish();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    const drawn = performance.now() - begin;
    rows.push([risorius.cost.evaluated, risorius.cost.moved, upload, drawn]);
    await new Promise((done) => requestAnimationFrame(done));
  }
  delete gl.bufferSubData;
  risorius.reset();
  const sum = (row) => row[0] + row[1] + row[2];
  return rows.sort((a, b) => sum(a) - sum(b))[2];
})()"""


def written(built: Path, name: str, page: bytes) -> Path:
    path = built / "pages" / f"{name}.html"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(page)
    return path


def poses(rig: risorius.Rig) -> list[tuple[int, list[float]]]:
    """(LOD, random raw controls) of POSES poses; a third of the controls is 0."""
    random = np.random.default_rng(7)
    out = []
    for turn in range(POSES):
        raw = random.uniform(0, 1, len(rig.raw_control_names)).astype(np.float32)
        raw[random.uniform(size=len(raw)) < 0.33] = 0
        out.append((turn % rig.lod_count, [float(v) for v in raw]))
    return out


async def same_numbers(one: Browser, path: Path, page: Path, places: int = 0) -> str:
    """Check that the page computes the same bits as the Python package without SIMD.

    Args:
        one: the browser.
        path: the DNA file.
        page: the page with this face.
        places: largest allowed difference in units of the last place. Sines and exponentials
            (swing, RBF solvers, networks) come from the system's library, so the last bit may
            differ.

    Returns: a sentence.

    Raises:
        RuntimeError: the numbers differ.
    """
    state = await one.open(page, 1440, 900)
    if state != "ready":
        said = await one.evaluate("document.getElementById('error-text').textContent")
        raise RuntimeError(f"{path.name}: {said}")
    rig = risorius.Rig(risorius.load(path), simd="scalar")
    rows = poses(rig)
    wanted = []
    for lod, raw in rows:
        pose = rig.evaluate(np.array(raw, np.float32), lod=lod)
        wanted += [pose.joints.ravel(), pose.blend_shapes, pose.animated_maps]
    expected = np.concatenate(wanted)
    text = await one.evaluate(EVALUATE % json.dumps(rows))
    found = np.frombuffer(base64.b64decode(text), "<f4")
    if found.shape != expected.shape:
        raise RuntimeError(f"{path.name}: {found.shape} numbers, {expected.shape} were expected")
    apart = np.abs(found.view(np.int32).astype(np.int64) - expected.view(np.int32))
    if apart.max() > places or not np.any(expected):
        differ, worst = np.count_nonzero(apart > places), np.abs(found - expected).max()
        raise RuntimeError(f"{path.name}: {differ} of {len(found)} numbers differ, by {worst:g}")
    words = f"{path.name}: {len(found)} numbers of {POSES} poses are the bits of the scalar path"
    if differ := np.count_nonzero(apart):
        words += f", but for the last place of {differ}"
    return words


async def says_error(one: Browser, built: Path, face: Path) -> None:
    """Check that the page names the byte of the fault if its face is truncated."""
    text = pages.render(risorius.load(face), "cut").decode()
    begin = text.index('id="face">') + len('id="face">')
    end = text.index("</script>", begin)
    data = gzip.decompress(base64.b64decode(text[begin:end]))
    cut = base64.b64encode(gzip.compress(data[: len(data) // 2])).decode()
    page = written(built, "cut", (text[:begin] + cut + text[end:]).encode())
    state = await one.open(page, 1440, 900)
    said = await one.evaluate("document.getElementById('error-text').textContent")
    if state != "error" or "byte" not in said:
        raise RuntimeError(f"a cut face: {state}, {said!r}")
    print(f"a face cut short: {said}")


def about(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """float64[3, 3]: rotation about a unit axis by the right-hand rule, radians."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


async def same_turned_head(one: Browser, built: Path) -> str:
    """Compare the page's vertices with a NumPy implementation, in a clip that turns neck and head.

    The face has RBF poses of the neck.

    Returns: a sentence.

    Raises:
        RuntimeError: the vertices differ by TURNED or more.
    """
    sys.path.append(str(ROOT / "blender_tests"))
    faces, oracle = (importlib.import_module(f"support.{name}") for name in ("faces", "oracle"))
    dna = faces.neck_face()
    path = built / "neck.dna"
    dna.save(str(path))
    angles = {"neck": (0.2, -0.3, 0.1), "head": (-0.4, 0.3, 0.2)}
    names = [f"{bone}.{way}" for bone in angles for way in ("yaw", "pitch", "roll")]
    curves = [[0.0, value] for value in (*angles["neck"], *angles["head"])]
    clip = prepared(
        risorius.Clip([*names, dna.raw_control_names[0]], [*curves, [0.0, 0.7]], 2.0),
        load_face(path),
    )
    state = await one.open(written(built, "neck", pages.render(dna, "neck", clip=clip)), 1440, 900)
    if state != "ready":
        raise RuntimeError(await one.evaluate("document.getElementById('error-text').textContent"))
    found = await one.evaluate(f"risorius.player.seek(0.5), risorius.pose(), [...{PLACED}]")
    shown = np.array(found).reshape(-1, 4)[:, :3] @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    rig = risorius.Rig(dna)
    raw, turns = rig.initial_raw_controls.copy(), {}
    for name, value in zip(clip.names, clip.curves[:, 1], strict=True):
        if name in rig.raw_control_names:
            raw[rig.raw_control_names.index(name)] = value
    rest = oracle._world(dna, np.zeros((len(dna.joint_names), 9)))
    basis = np.array([oracle._AXES[word] for word in dna.coordinate_system], float).T
    for joint, bone in ((1, "neck"), (2, "head")):
        yaw, pitch, roll = angles[bone]
        turn = about((0, 0, 1), yaw) @ about((-1, 0, 0), pitch) @ about((0, 1, 0), roll)
        axes = basis @ rest[joint][:3, :3]
        turns[joint] = axes.T @ turn @ axes
    wanted = oracle.vertices(dna, 0, rig.evaluate(raw), turns=turns)
    apart = np.abs(shown - wanted).max() / np.ptp(wanted, axis=0).max()
    if not apart < TURNED:
        raise RuntimeError(f"a turned head is {apart:g} of its size off")
    return f"a head that a clip turns, with its neck poses: {apart:.1e} of its size off"


def smile(names: list[str]) -> risorius.Clip:
    """A clip of two seconds with a smile and an open mouth.

    Args:
        names: the face's raw controls.
    """
    t = np.linspace(0, 2, 61)
    wave = (0.5 - 0.5 * np.cos(np.pi * t)).astype(np.float32)
    strong = {
        "mouthCornerPull": 0.8,
        "jawOpen": 0.32,
        "cheekRaise": 0.6,
        "browRaise": 0.5,
        "eyeCheekRaise": 0.5,
        "mouthUpperLipRaise": 0.25,
    }
    curves = {
        name: weight * wave
        for name in names
        for part, weight in strong.items()
        if name.rpartition(".")[2].startswith(part)
    }
    return risorius.Clip(list(curves), np.array(list(curves.values())), 30.0)


async def pictures(one: Browser, built: Path, face: Path) -> None:
    dna = risorius.load(face)
    folder = built / "pictures"
    folder.mkdir(exist_ok=True)
    clip = smile(dna.raw_control_names)
    looks = web.find_looks(dna, face)
    page = written(built, "face", pages.render(dna, dna.name or face.stem, looks=looks, clip=clip))
    size = page.stat().st_size
    if size > MOST_BYTES:
        raise RuntimeError(
            f"the page of {face.name} has {size:,} bytes, at most {MOST_BYTES:,} were expected"
        )
    for name, width, height, phone in (("wide", 1440, 900, False), ("phone", 390, 844, True)):
        state = await one.open(page, width, height, phone)
        if state != "ready":
            raise RuntimeError(
                await one.evaluate("document.getElementById('error-text').textContent")
            )
        await one.picture(folder / f"{name}-rest.png")
        await one.evaluate("risorius.player.seek(1)")
        await one.picture(folder / f"{name}-smile.png")
        evaluated, moved, upload, drawn = await one.evaluate(COST)
        print(
            f"{name}: evaluated {evaluated:.2f} ms, moved {moved:.2f} ms, "
            f"uploaded {upload:.2f} ms; "
            f"drawn {drawn:.0f} ms by SwiftShader; page {size:,} bytes"
        )
    await one.open(page, 1440, 900)
    await one.evaluate(
        "(() => { const s = document.getElementById('search'); s.value = 'jaw open';"
        " s.dispatchEvent(new Event('input')); })()"
    )
    await one.picture(folder / "wide-search.png")


async def main(built: Path, face: Path) -> None:
    text = (built / "page.html").read_text(encoding="utf-8")
    pages.empty_page = lambda: text
    async with browser() as one:
        for name, places in (("medium", 0), ("units", 1)):
            path = GOLDEN / f"{name}.dna"
            page = written(built, name, pages.render(risorius.load(path), name))
            print(await same_numbers(one, path, page, places))
        page = written(built, "sample", pages.render(risorius.load(face), "sample"))
        print(await same_numbers(one, face, page))
        print(await same_turned_head(one, built))
        await says_error(one, built, GOLDEN / "medium.dna")
        await pictures(one, built, face)
        async for line in plays.all_of(one, built, face):
            print(line)
        if one.said:
            raise RuntimeError(f"the page said: {one.said}")


def sample(built: Path) -> Path:
    path = built / "sample.dna"
    if not path.exists():
        program = Path(sys.executable).with_name("risorius")
        subprocess.run([program, "sample", "build", path], check=True)
    return path


place = Path(sys.argv[1])
asyncio.run(main(place, Path(sys.argv[2]) if len(sys.argv) > 2 else sample(place)))
