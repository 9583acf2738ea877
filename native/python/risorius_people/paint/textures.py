# SPDX-License-Identifier: MIT
"""Paints all textures of a person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from risorius.files.png import png

from .. import wrinkles
from ..expressions import Expression
from ..part import Part
from ..people import Person
from ..polygons import Floats
from .cloth import paint_cloth
from .eyes import paint_eye
from .form import form, hollows, share_at
from .images import enlarged, shrunk, smooth
from .raster import Raster, filled
from .regions import DIVIDED, find_face
from .relief import heights, normals, roughness
from .skin import HEAD_SIZE, Skin, Texels

MASK_SIZE = 512
WRINKLE_SHARE = 2  # width of a texel of the wrinkle sets, in texels of the colour
# (ages in years), (fraction of each fold's depth that is left in the neutral face).
STAYS = ((25, 40, 58, 75), (0.0, 0.06, 0.2, 0.38))
# Decimetres above the eyes over which the frown's lines fade out, because further up they would
# cross the lines of the forehead.
_FROWN_ENDS = (0.17, 0.27)


def fold_strength(person: Person, place: Floats, eye: Floats) -> Floats:
    """float64[h, w]: factor on the depth of folds; small on the fat of the cheeks, which bulges
    instead.

    Args:
        person: the person, with the age.
        place: float64[h, w, 3], position of each texel on the head in decimetres.
        eye: float64[3], middle of the left eye.
    """
    # At 8 years folds are a third as deep as at 30, at 80 years nearly twice as deep.
    age = float(np.interp(person.age, (8, 30, 80), (0.35, 1.0, 1.9)))
    x, y = np.abs(place[:, :, 0]), place[:, :, 1] - eye[1]
    cheek = np.exp(-(((x - 0.44) / 0.19) ** 2) - ((y + 0.42) / 0.24) ** 2)
    inner = np.exp(-(((x - 0.28) / 0.13) ** 2) - ((y + 0.38) / 0.2) ** 2)
    jowl = np.exp(-(((x - 0.5) / 0.22) ** 2) - ((y + 0.85) / 0.25) ** 2)
    return np.asarray(age * (1 - 0.9 * np.clip(cheek + inner + jowl, 0, 1)))


def lasting(place: Floats, eye: Floats) -> Floats:
    """float64[h, w], 0 to 1: fraction of an expression's folds that can remain in an old face at
    rest; largest at brow and eyes.

    Args:
        place: float64[h, w, 3], position of each texel on the head in decimetres.
        eye: float64[3], middle of the left eye.
    """
    x, y = np.abs(place[:, :, 0]), place[:, :, 1] - eye[1]
    brow = smooth(0.15, 0.3, y)
    feet = np.exp(-(((x - 0.5) / 0.14) ** 2) - ((y + 0.04) / 0.2) ** 2)
    between = np.exp(-((x / 0.12) ** 2) - ((y - 0.14) / 0.14) ** 2)
    fold = np.clip(-wrinkles.laugh_fold(place, eye)[0] / wrinkles.DEPTH, 0, 1)
    return np.asarray(0.22 + 0.78 * np.clip(brow + feet + between + fold, 0, 1))


def between_brows(place: Floats, eye: Floats) -> Floats:
    """float64[h, w], 0 to 1: mask of the area between the brows, where the lines of a frown are.

    Lines of other expressions would cross these lines and form a grid.

    Args:
        place: float64[h, w, 3], position of each texel on the head in decimetres.
        eye: float64[3], middle of the left eye.
    """
    x, y = np.abs(place[:, :, 0]), place[:, :, 1] - eye[1]
    return np.asarray(smooth(0.17, 0.10, x) * smooth(_FROWN_ENDS[1], _FROWN_ENDS[0], y))


@dataclass
class Wrinkles:
    """The textures of the folds of expressions.

    Attributes:
        pictures: file name -> image: a mask for each expression, and a normal map for each texture
            set, which several expressions share.
        sets: number of a texture set -> file name of its normal map.
        still: float32[h, w], 0 to 1, depth of each texel in a fold of the neutral face.
    """

    pictures: dict[str, Floats]
    sets: dict[int, str]
    still: Floats


def head_wrinkles(
    person: Person,
    head: Part,
    positions: Floats,
    eye: Floats,
    units: dict[str, Expression],
    size: int,
) -> Wrinkles:
    """Paints the masks of wrinkles, and a normal map for each texture set.

    The normal maps store differences from flat normals.

    Args:
        person: the person, with the age.
        head: mesh of the head, not subdivided.
        positions: float64[v, 3] of its vertices, in decimetres.
        eye: float64[3], middle of the left eye.
        units: raw control -> expression.
        size: number of texels of a side.
    """
    uvs = head.polygons.uvs
    raster = Raster(head.polygons, uvs, size)
    place = raster.image(positions)
    folds = wrinkles.vertex_folds(head, uvs, positions, units)
    strength = fold_strength(person, place, eye)
    out = Wrinkles({}, {}, np.zeros((size, size), np.float32))
    deeper = float(np.interp(person.age, (8, 30, 70), (0.6, 1.0, 1.4)))
    stays = float(np.interp(person.age, STAYS[0], STAYS[1]))
    for number in wrinkles.SETS:
        names = wrinkles.masks_of(number)
        depths = np.column_stack([folds[name][:, 0] for name in names])
        shares = raster.image(depths)
        whole = raster.image(np.asarray(sum(folds[name] for name in names)))
        out.sets[number] = f"head_normal_wm{number}.png"
        height = wrinkles.fold_heights(whole, strength)
        if wrinkles.FROWN in names:
            height *= 1 - smooth(*_FROWN_ENDS, place[..., 1] - eye[1])
        if wrinkles.SMILE in names:
            fold, there = wrinkles.laugh_fold(place, eye)
            height += deeper * fold
            for side, sign in (("L", 1), ("R", -1)):
                own = shares[..., names.index(wrinkles.SMILE[:-1] + side)]
                np.maximum(own, there * smooth(-0.01, 0.01, sign * place[..., 0]), out=own)
        masks = np.clip(shrunk(shares, MASK_SIZE), 0, 1)
        out.pictures |= {f"{name}_msk.png": masks[..., k] for k, name in enumerate(names)}
        normal = wrinkles.normals(height, place)
        out.pictures[out.sets[number]] = normal - [0, 0, 0.5]
        deep = np.clip(-height / wrinkles.DEPTH, 0, 1) * lasting(place, eye)
        if wrinkles.FROWN not in names:
            deep = deep * (1 - between_brows(place, eye))
        out.still = np.maximum(out.still, stays * deep.astype(np.float32))
    return out


def paint_head(
    person: Person,
    head: Part,
    positions: Floats,
    own: Floats,
    eye: Floats,
    units: dict[str, Expression],
    still: Floats,
    size: int,
) -> dict[str, Floats]:
    """File name -> image of the head's colour, normals and roughness.

    Args:
        person: the person, with colours and age.
        head: mesh of the head at LOD 0, in which each edge of the base mesh is divided in two.
        positions: float64[V, 3], all vertices of the base mesh of the man, in decimetres.
        own: float64[V, 3], all vertices of the person, whose form the relief shows.
        eye: float64[3], middle of the left eye.
        units: raw control -> expression.
        still: float32[h, w], 0 to 1, depth of each texel in a fold; h and w divide `size`.
        size: number of texels of a side.
    """
    p = head.carry(positions)
    raster = Raster(head.polygons, head.polygons.uvs, size)
    texels = Texels(raster, p)
    face = find_face(head, p, eye, units, DIVIDED)
    skin = Skin(person, face, texels, eye)
    creases = enlarged(still, size).ravel()[raster.where]
    formed = share_at(person.age) * form(head.polygons, head.carry(own), face, texels)
    files = {
        "head_color.png": raster.spread(skin.colour(np.maximum(creases, 0.5 * hollows(formed)))),
        "head_roughness.png": raster.spread(roughness(skin, creases)),
    }
    files = {name: filled(image, raster.covered) for name, image in files.items()}
    files["head_roughness.png"] = shrunk(files["head_roughness.png"], size // 2)
    files["head_normal.png"] = normals(skin, heights(skin, creases) + formed)
    return files


def flush_masks(head: Part, positions: Floats, eye: Floats) -> dict[str, Floats]:
    """File name -> mask of a cheek that blushes.

    Args:
        head: mesh of the head, not subdivided.
        positions: float64[V, 3], all vertices of the base mesh, in decimetres.
        eye: float64[3], middle of the left eye.
    """
    x, y, z = (head.carry(positions) - np.array([0, eye[1], eye[2]])).T
    files = {}
    raster = Raster(head.polygons, head.polygons.uvs, MASK_SIZE)
    for side, sign in (("L", 1), ("R", -1)):
        mask = 0.75 * np.exp(-(((sign * x - 0.42) / 0.25) ** 2) - ((y + 0.36) / 0.2) ** 2)
        mask *= smooth(-0.6, -0.2, z)
        files[f"head_flush_{side}.png"] = raster.image(mask[:, None])[..., 0]
    return files


def paint_textures(
    person: Person,
    positions: Floats,
    own: Floats,
    units: dict[str, Expression],
    parts: list[Part],
    largest: int = HEAD_SIZE,
) -> tuple[dict[str, bytes], dict[str, str]]:
    """Paints all textures of a person.

    Args:
        person: the person, with the colours.
        positions: float64[V, 3], all vertices of the base mesh of the man, in decimetres.
        own: float64[V, 3], all vertices of the person.
        units: raw control -> expression.
        parts: the meshes of the face.
        largest: a texture has at most as many texels as a square with this side.

    Returns:
        File name -> bytes of a PNG; and metadata for the DNA: texture:<mesh>:<role> -> file name.
        The roles are color, normal, roughness, normal:<wrinkle set>, and map:<animated map> for the
        mask of that map.
    """
    coarse = next(part for part in parts if part.name == "head_lod1_mesh")
    eye_parts = [part for part in parts if part.name.startswith("eyeLeft")]
    eye = eye_parts[0].carry(positions).mean(axis=0)
    size = max(HEAD_SIZE, largest)
    folded = head_wrinkles(
        person, coarse, coarse.carry(positions), eye, units, size // WRINKLE_SHARE
    )
    head = next(part for part in parts if part.name == "head_lod0_mesh")
    files = paint_head(person, head, positions, own, eye, units, folded.still, size)
    files |= flush_masks(coarse, positions, eye)
    files |= folded.pictures | {
        "eye_color.png": paint_eye(person),
        "shirt_color.png": paint_cloth(person.shirt),
    }
    out = {}
    for lod in (0, 1):
        for side in "LR":
            out[f"texture:head_lod{lod}_mesh:map:head_flush_{side}"] = f"head_flush_{side}.png"
    for number, name in folded.sets.items():
        for lod in (0, 1):
            out[f"texture:head_lod{lod}_mesh:normal:{number}"] = name
    for lod in (0, 1):
        for role in ("color", "normal", "roughness"):
            out[f"texture:head_lod{lod}_mesh:{role}"] = f"head_{role}.png"
        out[f"texture:shirt_lod{lod}_mesh:color"] = "shirt_color.png"
        for eye_side in ("Left", "Right"):
            out[f"texture:eye{eye_side}_lod{lod}_mesh:color"] = "eye_color.png"
    return {name: png(packable(name, image, largest)) for name, image in files.items()}, out


def packable(name: str, image: Floats, largest: int) -> Floats:
    """A texture at the size and precision in which it is stored.

    The sides of the eyes' textures are at most half as long as of other textures. If `largest` is
    at most 1024, as for the released zip, the textures of head and eyes keep 7 of 8 bits, and the
    head's roughness keeps 6, because the lower bits are noise, which PNG cannot compress.

    Args:
        name: file name of the texture.
        image: float64[h, w, ...] in [0, 1].
        largest: a texture has at most as many texels as a square with this side.
    """
    out = shrunk(image, largest // 2 if name.startswith("eye") else largest)
    if largest > 1024 or not name.startswith(("head_", "eye_")):
        return out
    # With both numbers of steps, the byte 128, which means a flat normal, is a multiple of the
    # step.
    steps = 63.75 if "roughness" in name else 127.5
    return np.round(out * steps) / steps
