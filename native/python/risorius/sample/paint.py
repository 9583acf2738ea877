# SPDX-License-Identifier: MIT
"""Textures of the sample, painted from anatomy: every texel knows where on the head it lies.

Colours are sRGB in [0, 1]; lengths are decimetres.
"""

from __future__ import annotations

import numpy as np

from ..base.easing import smooth_step
from ..files.png import png
from . import wrinkles
from .expressions import Expression
from .part import Part
from .people import Person
from .polygons import Floats, Polygons

HEAD_SIZE = 2048
EYE_SIZE = 1024
MASK_SIZE = 512
LASH_SIZE = (4096, 256, 330)  # width, height, hairs over the strips' whole length


def shrunk(image: Floats, side: int) -> Floats:
    """An image of at most as many texels as a square of this side: the mean of 2 x 2, repeatedly.

    Args:
        image: float64[h, w, ...]; h and w are powers of two.
        side: of the square.
    """
    while image.shape[0] * image.shape[1] > side * side:
        blocks = image.reshape(image.shape[0] // 2, 2, image.shape[1] // 2, 2, *image.shape[2:])
        image = blocks.mean(axis=(1, 3))
    return image


def smooth(low: float, high: float, x: Floats) -> Floats:
    """0 where x is at low, 1 where it is at high, and smoothly in between; held beyond both."""
    return smooth_step((x - low) / (high - low))


def noise(size: int, cells: int, random: np.random.Generator) -> Floats:
    """Smooth noise [size, size] in [-1, 1]: a random grid, interpolated with smooth steps.

    Args:
        size: texels of a side.
        cells: of the grid along a side; more of them make the noise finer.
        random: gives the grid.
    """
    grid = random.uniform(-1, 1, (cells + 1, cells + 1))
    at = np.linspace(0, cells, size, endpoint=False)
    low = at.astype(int)
    t = smooth_step(at - low)
    rows = grid[low] * (1 - t)[:, None] + grid[low + 1] * t[:, None]
    return rows[:, low] * (1 - t) + rows[:, low + 1] * t


class Raster:
    """Which corners each texel lies between, and where: found once, for any values of vertices.

    Attributes:
        covered: bool[size, size]: which texels a face covers.
    """

    def __init__(self, polygons: Polygons, uvs: Floats, size: int) -> None:
        """Finds the texels of all faces; of two on the same texel the later one has it.

        Args:
            polygons: the mesh.
            uvs: float64[T, 2] in [0, 1].
            size: texels of a side.
        """
        self._corners = np.zeros((size, size, 3), np.int32)
        self._shares = np.zeros((size, size, 3), np.float32)
        self.covered = np.zeros((size, size), bool)
        for face, uv_face in zip(polygons.faces, polygons.uv_faces, strict=True):
            for k in range(1, len(face) - 1):
                corners = [0, k, k + 1]
                uv = uvs[[uv_face[c] for c in corners]] * size - 0.5
                self._triangle([face[c] for c in corners], uv)

    def _triangle(self, vertices: list[int], uv: Floats) -> None:
        low = np.maximum(np.floor(uv.min(axis=0)).astype(int) - 1, 0)
        high = np.minimum(np.ceil(uv.max(axis=0)).astype(int) + 2, len(self.covered))
        (ax, ay), (bx, by), (cx, cy) = uv
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if (high <= low).any() or abs(area) < 1e-9:
            return
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        b = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area
        c = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
        a = 1 - b - c
        inside = (a >= -1e-3) & (b >= -1e-3) & (c >= -1e-3)
        rows, columns = y[inside], x[inside]
        self._shares[rows, columns] = np.stack([a[inside], b[inside], c[inside]], axis=1)
        self._corners[rows, columns] = vertices
        self.covered[rows, columns] = True

    def image(self, values: Floats) -> Floats:
        """float64[size, size, k]: values of vertices; 0 where no face is.

        Args:
            values: float64[V, k].
        """
        out = np.zeros((*self.covered.shape, values.shape[1]))
        corners, shares = self._corners[self.covered], self._shares[self.covered]
        out[self.covered] = sum(shares[:, k, None] * values[corners[:, k]] for k in range(3))
        return out


def bleed(image: Floats, covered: Floats, steps: int = 8) -> Floats:
    """Grow the painted islands, so that filtering finds no foreign colour at their rims.

    Args:
        image: float64[h, w, 3].
        covered: bool[h, w]: what is painted.
        steps: by how many texels; what is left then gets the mean colour.
    """
    image, covered = image.copy(), covered.copy()
    for _ in range(steps):
        for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
            near = np.roll(covered, shift, axis) & ~covered
            image[near] = np.roll(image, shift, axis)[near]
            covered |= near
    image[~covered] = image[covered].mean(axis=0)
    return image


def blend(image: Floats, colour: tuple[float, float, float], mask: Floats) -> Floats:
    """An image [h, w, 3] with a colour laid over it where a mask [h, w] says, from 0 to 1."""
    mask = np.clip(mask, 0, 1)[:, :, None]
    return image * (1 - mask) + np.array(colour) * mask


def brow_mask(texels: Floats, eye: Floats, random: np.random.Generator) -> Floats:
    """Strands along an arched line above each eye, float64[h, w] from 0 to 1.

    Args:
        texels: float64[h, w, 3], each texel's place on the head, decimetres.
        eye: float64[3], the left eye's middle.
        random: gives the strands.
    """
    x, y = np.abs(texels[:, :, 0]), texels[:, :, 1] - eye[1]
    along = (x - (eye[0] - 0.19)) / 0.44  # 0 at the nose, 1 at the temple
    ridge = (
        0.165
        + 0.055 * np.sin(np.clip(along, 0, 1.1) * 2.2)
        - 0.045 * np.clip(along - 0.55, 0, 1) / 0.5
    )
    half = 0.05 * (1 - 0.62 * np.clip(along, 0, 1)) * smooth(-0.04, 0.1, along) + 0.002
    across = (y - ridge) / half
    body = (1 - smooth(0.45, 1.05, np.abs(across))) * smooth(-0.03, 0.1, along)
    body *= 1 - smooth(0.9, 1.02, along)
    front = smooth(0.05, 0.2, texels[:, :, 2] - eye[2] + 0.1)
    # Strands lean outward: lines of equal (t * lean - y) are one strand.
    phase = (x * (1.0 + 0.8 * np.clip(along, 0, 1)) - y * (1.2 - 0.9 * np.clip(along, 0, 1))) * 620
    jitter = 2.5 * noise(len(texels), 300, random)
    strands = 0.5 + 0.5 * np.sin(phase + jitter)
    return np.asarray(body * front * (0.55 + 0.45 * strands))


def hair_mask(texels: Floats, eye: Floats, random: np.random.Generator) -> Floats:
    """A shaved head's shadow, with a soft natural hairline, float64[h, w] from 0 to 1.

    Args:
        texels: float64[h, w, 3], each texel's place on the head, decimetres.
        eye: float64[3], the left eye's middle.
        random: makes the hairline uneven.
    """
    back = texels[:, :, 2] - eye[2]
    line = np.interp(
        back,
        [-1.9, -1.35, -1.05, -0.85, -0.62, -0.45, 0.1],
        [-0.62, -0.5, -0.2, 0.1, 0.22, 0.5, 0.76],
    )
    height = texels[:, :, 1] - eye[1] - line
    wobble = 0.03 * noise(len(texels), 60, random)
    ear = smooth(0.8, 0.86, np.abs(texels[:, :, 0])) * (
        1 - smooth(0.35, 0.45, texels[:, :, 1] - eye[1])
    )
    return np.asarray(smooth(-0.06, 0.12, height + wobble) * (1 - ear))


def lip_mask(part: Part, positions: Floats, place: Floats, units: dict[str, Expression]) -> Floats:
    """The vermilion, from the line where the lips meet, float64[h, w] from 0 to 1.

    That line is where vertices that the jaw takes along touch vertices that it leaves.

    Args:
        part: the head.
        positions: float64[v, 3], positions of its vertices, decimetres.
        place: float64[h, w, 3], each texel's place on the head, decimetres.
        units: what each raw control does, by its name.
    """
    travel = np.linalg.norm(part.carry(units["jawOpen"].displacement), axis=1)
    mouth = np.flatnonzero(
        np.linalg.norm(part.carry(units["mouthUpperLipRollInL"].displacement), axis=1) > 0.004
    )
    mouth = np.union1d(
        mouth,
        np.flatnonzero(
            np.linalg.norm(part.carry(units["mouthUpperLipRollInR"].displacement), axis=1) > 0.004
        ),
    )
    low_lip = np.flatnonzero(travel > 0.6 * travel[np.abs(positions[:, 0]) < 0.2].max())
    gap = np.linalg.norm(positions[mouth][:, None, :] - positions[low_lip][None, :, :], axis=2).min(
        axis=1
    )
    seam = positions[mouth[gap < 0.03]]
    seam = seam[seam[:, 2] > seam[:, 2].max() - 0.25]
    width = float(np.abs(seam[:, 0]).max())
    line = np.polyfit(np.abs(seam[:, 0]), seam[:, 1], 2)
    depth = np.polyfit(np.abs(seam[:, 0]), seam[:, 2], 2)
    x = np.abs(place[:, :, 0])
    t = np.clip(x / (1.04 * width), 0, 1)
    y = place[:, :, 1] - np.polyval(line, np.minimum(x, width))
    z = place[:, :, 2] - np.polyval(depth, np.minimum(x, width))
    bow = 1 + 0.10 * np.exp(-(((x - 0.07) / 0.05) ** 2)) - 0.12 * np.exp(-((x / 0.035) ** 2))
    upper = 0.078 * np.sqrt(1 - t**2) * bow
    lower = 0.098 * np.sqrt(1 - t**2)
    high = np.where(y > 0, upper, lower)
    inside = 1 - smooth(0.8, 1.12, np.abs(y) / np.maximum(high, 1e-3))
    return np.asarray(inside * (z > -0.2) * (t < 1))


def paint_head(
    person: Person,
    part: Part,
    raster: Raster,
    positions: Floats,
    eye: Floats,
    units: dict[str, Expression],
) -> tuple[Floats, Floats]:
    """Skin colour [h, w, 3] and each texel's place [h, w, 3].

    Args:
        person: has the colours.
        part: the head.
        raster: of its texture, HEAD_SIZE texels a side.
        positions: float64[v, 3], positions of its vertices, decimetres.
        eye: float64[3], the left eye's middle.
        units: what each raw control does, by its name.
    """
    random = np.random.default_rng(7)
    blink = sum(
        np.linalg.norm(part.carry(units[n].displacement), axis=1)
        for n in ("eyeBlinkL", "eyeBlinkR")
    )
    lids = smooth(0.1, 0.8, blink / blink.max())
    image, covered = raster.image(np.column_stack([positions, lids])), raster.covered
    place = image[:, :, :3]
    lips = lip_mask(part, positions, place, units)
    colour = np.ones((HEAD_SIZE, HEAD_SIZE, 3)) * np.array(person.skin)
    mottle = 0.5 * noise(HEAD_SIZE, 40, random) + 0.3 * noise(HEAD_SIZE, 150, random)
    colour += 0.018 * mottle[:, :, None] * np.array([0.6, 1.0, 1.0])
    pores = random.normal(0, 0.008, (HEAD_SIZE, HEAD_SIZE))
    colour += pores[:, :, None]
    x, y = np.abs(place[:, :, 0]), place[:, :, 1] - eye[1]
    z = place[:, :, 2] - eye[2]
    cheeks = np.exp(-(((x - 0.42) / 0.22) ** 2) - ((y + 0.4) / 0.2) ** 2) * (z > -0.35)
    nose = np.exp(-((x / 0.16) ** 2) - ((y + 0.42) / 0.16) ** 2) * (z > 0.1)
    ears = smooth(0.8, 0.9, x) * (np.abs(y + 0.15) < 0.5)
    colour = blend(colour, person.flush, 0.4 * cheeks + 0.4 * nose + 0.35 * ears)
    colour = blend(colour, person.lids, 0.35 * image[:, :, 3])
    beard = smooth(-0.62, -0.78, y) * smooth(-0.85, -0.55, z) * (1 - lips)
    beard *= smooth(-1.45, -1.2, y)
    speckle = 0.6 + 0.8 * random.random((HEAD_SIZE, HEAD_SIZE))
    colour = blend(colour, (0.42, 0.33, 0.30), person.beard * beard * speckle)
    colour = blend(colour, person.lips, 0.8 * lips)
    colour = blend(colour, person.hair, 0.62 * hair_mask(place, eye, random) * speckle)
    colour = blend(colour, person.brows, 0.92 * brow_mask(place, eye, random))
    return bleed(np.clip(colour, 0, 1), covered), place


def paint_eye(person: Person) -> Floats:
    """Pupil, iris with fibres and a dark rim, sclera that is not white; the gaze in the middle."""
    random = np.random.default_rng(11)
    at = (np.arange(EYE_SIZE) + 0.5) / EYE_SIZE - 0.5
    x, y = np.meshgrid(at, at)
    angle = 2 * np.pi * np.hypot(x, y)  # from the gaze, in radians
    around = np.arctan2(y, x)
    iris, pupil = 0.44, 0.165
    colour = np.ones((EYE_SIZE, EYE_SIZE, 3)) * np.array([0.90, 0.88, 0.85])
    blush = 0.5 + 0.5 * noise(EYE_SIZE, 9, random)
    colour = blend(colour, (0.86, 0.66, 0.60), 0.4 * blush * smooth(0.6, 1.6, angle))
    colour = blend(colour, (0.72, 0.30, 0.26), 0.5 * vessels(random, 0.13))
    fibres = np.zeros_like(angle)
    for count in (37, 61, 97, 149):
        fibres += np.sin(count * around + random.uniform(0, 6) + 3 * noise(EYE_SIZE, 24, random))
    shade = 0.5 + 0.14 * fibres
    depth = smooth(pupil, iris, angle)
    base = np.array(person.iris[0]) * (1 - depth)[:, :, None]
    base = base + np.array(person.iris[1]) * depth[:, :, None]
    inside = (1 - smooth(iris - 0.02, iris + 0.025, angle))[:, :, None]
    colour = colour * (1 - inside) + base * (0.7 + 0.6 * shade[:, :, None]) * inside
    rim = np.exp(-(((angle - iris) / 0.045) ** 2))
    colour = blend(colour, (0.07, 0.07, 0.07), 0.75 * rim)
    colour = blend(colour, (0.01, 0.01, 0.01), 1 - smooth(pupil - 0.02, pupil + 0.02, angle))
    return np.clip(colour, 0, 1)


def paint_lashes() -> Floats:
    """Opacity of the lashes' strips: curved hairs that taper from the lid (v = 0) to the tip."""
    random = np.random.default_rng(5)
    width, height, count = LASH_SIZE
    image = np.zeros((height, width))
    v = (np.arange(height) + 0.5) / height
    for number in range(count):
        root = (number + random.uniform(0.1, 0.9)) / count * width
        lean, bend = random.normal(0, 5), random.normal(0, 9)
        length, thick = random.uniform(0.55, 1.0), random.uniform(2.0, 3.2)
        middle = root + lean * v + bend * v**2
        half = thick * np.sqrt(np.clip(1 - v / length, 0, 1))
        low = int(max(0, middle.min() - 6))
        x = np.arange(low, min(width, int(middle.max()) + 7)) + 0.5
        hair = np.clip(half[:, None] - np.abs(x[None, :] - middle[:, None]) + 0.5, 0, 1)
        part = image[:, low : low + len(x)]
        np.maximum(part, hair, out=part)
    return image


def vessels(random: np.random.Generator, angle_limit: float) -> Floats:
    """Fine blood vessels [EYE_SIZE, EYE_SIZE], 0 to 1: they wander in from behind and thin out.

    Args:
        random: gives their ways.
        angle_limit: how near they come to the pupil at most, as a distance in texture space; the
            back of the eyeball is at 0.5.
    """
    image = np.zeros((EYE_SIZE, EYE_SIZE))
    for _ in range(90):
        around, step = random.uniform(0, 2 * np.pi), 0.0
        away, end = 0.5, random.uniform(angle_limit, 0.42)
        while away > end:
            step = 0.85 * step + random.normal(0, 0.004)
            around += step / away
            away -= 0.0012
            x, y = ((0.5 + away * f(around)) * EYE_SIZE for f in (np.cos, np.sin))
            i, j = int(y), int(x)
            strength = min(1.0, (away - end) / 0.15) * 0.8
            if 0 < i < EYE_SIZE - 1 and 0 < j < EYE_SIZE - 1:
                for di, dj, share in ((0, 0, 1.0), (0, 1, x % 1), (1, 0, y % 1)):
                    here = image[i + di, j + dj]
                    image[i + di, j + dj] = max(here, strength * share)
    return image


def fold_strength(person: Person, place: Floats, eye: Floats) -> Floats:
    """float64[h, w]: how deep folds are, less on the fat of the cheeks, which bulges instead.

    Args:
        person: has the age.
        place: float64[h, w, 3], each texel's place on the head, decimetres.
        eye: float64[3], the left eye's middle.
    """
    # Of a face of eight they are a third as deep as at thirty, at eighty nearly twice.
    age = float(np.interp(person.age, (8, 30, 80), (0.35, 1.0, 1.9)))
    x, y = np.abs(place[:, :, 0]), place[:, :, 1] - eye[1]
    cheek = np.exp(-(((x - 0.44) / 0.19) ** 2) - ((y + 0.42) / 0.24) ** 2)
    jowl = np.exp(-(((x - 0.5) / 0.22) ** 2) - ((y + 0.85) / 0.25) ** 2)
    return np.asarray(age * (1 - 0.9 * np.clip(cheek + jowl, 0, 1)))


def head_wrinkles(
    person: Person,
    head: Part,
    uvs: Floats,
    raster: Raster,
    positions: Floats,
    place: Floats,
    eye: Floats,
    units: dict[str, Expression],
) -> tuple[dict[str, Floats], dict[int, str]]:
    """Pictures of masks and of the sets' normals by file name, and the file of each set.

    Args:
        person: has the age.
        head: the mesh, not subdivided.
        uvs: float64[T, 2] in [0, 1].
        raster: of its texture, HEAD_SIZE texels a side.
        positions: float64[v, 3] of its vertices, decimetres.
        place: float64[HEAD_SIZE, HEAD_SIZE, 3], each texel's place on the head, decimetres.
        eye: float64[3], the left eye's middle.
        units: what each raw control does, by its name.
    """
    folds = wrinkles.vertex_folds(head, uvs, positions, units)
    strength = fold_strength(person, place, eye)
    files: dict[str, Floats] = {}
    sets: dict[int, str] = {}
    for number in wrinkles.SETS:
        names = wrinkles.masks_of(number)
        depths = np.column_stack([folds[name][:, 0] for name in names])
        masks = np.clip(shrunk(raster.image(depths), MASK_SIZE), 0, 1)
        files |= {f"{name}_msk.png": masks[..., k] for k, name in enumerate(names)}
        whole = raster.image(np.asarray(sum(folds[name] for name in names)))
        sets[number] = f"head_normal_wm{number}.png"
        files[sets[number]] = wrinkles.relief_normals(whole, place, strength)
    return files, sets


def paint_textures(
    person: Person,
    positions: Floats,
    units: dict[str, Expression],
    parts: list[Part],
    largest: int = HEAD_SIZE,
) -> tuple[dict[str, bytes], dict[str, str]]:
    """The textures.

    Args:
        person: has the colours.
        positions: float64[V, 3], all vertices of the base mesh, decimetres.
        units: what each raw control does, by its name.
        parts: the meshes.
        largest: no texture has more texels than a square of this side.

    Returns:
        File name -> bytes of a PNG; and metadata for the DNA: texture:<mesh>:<role> -> file name;
        the roles are color, alpha, and map:<animated map>, a mask of where that map shows.
    """
    head = next(part for part in parts if part.name.startswith("head") and not part.operators[1:])
    uvs = head.polygons.uvs
    uvs = (uvs - uvs.min(axis=0)) / (uvs.max(axis=0) - uvs.min(axis=0))
    p = head.carry(positions)
    eye_parts = [part for part in parts if part.name.startswith("eyeLeft")]
    eye = eye_parts[0].carry(positions).mean(axis=0)
    raster = Raster(head.polygons, uvs, HEAD_SIZE)
    colour, place = paint_head(person, head, raster, p, eye, units)
    files = {
        "head_color.png": png(shrunk(colour, largest)),
        "eye_color.png": png(shrunk(paint_eye(person), largest)),
        "lash_alpha.png": png(shrunk(paint_lashes(), largest)),
    }
    step = HEAD_SIZE // MASK_SIZE
    small = place[::step, ::step]
    out = {}
    for side, sign in (("L", 1), ("R", -1)):
        x, y = sign * small[:, :, 0], small[:, :, 1] - eye[1]
        mask = 0.75 * np.exp(-(((x - 0.42) / 0.25) ** 2) - ((y + 0.36) / 0.2) ** 2)
        mask *= small[:, :, 2] > eye[2] - 0.4
        files[f"head_flush_{side}.png"] = png(mask)
        for lod in (0, 1):
            out[f"texture:head_lod{lod}_mesh:map:head_flush_{side}"] = f"head_flush_{side}.png"
    wrinkled, sets = head_wrinkles(person, head, uvs, raster, p, place, eye, units)
    files |= {name: png(shrunk(image, largest)) for name, image in wrinkled.items()}
    for number, name in sets.items():
        for lod in (0, 1):
            out[f"texture:head_lod{lod}_mesh:normal:{number}"] = name
    for lod in (0, 1):
        out[f"texture:head_lod{lod}_mesh:color"] = "head_color.png"
        out[f"texture:eyelashes_lod{lod}_mesh:alpha"] = "lash_alpha.png"
        for eye_side in ("Left", "Right"):
            out[f"texture:eye{eye_side}_lod{lod}_mesh:color"] = "eye_color.png"
    return files, out
