# SPDX-License-Identifier: MIT
"""All textures of a person, by file name."""

from __future__ import annotations

import numpy as np

from ...files.png import png
from .. import wrinkles
from ..expressions import Expression
from ..part import Part
from ..people import Person
from ..polygons import Floats
from .eyes import paint_eye
from .images import shrunk
from .raster import Raster
from .skin import HEAD_SIZE, paint_head

MASK_SIZE = 512


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
        the roles are color and map:<animated map>, a mask of where that map shows.
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
        for eye_side in ("Left", "Right"):
            out[f"texture:eye{eye_side}_lod{lod}_mesh:color"] = "eye_color.png"
    return files, out
