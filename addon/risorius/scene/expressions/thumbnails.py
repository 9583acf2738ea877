# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes pictures of expressions on a character, and caches the pictures in files.

The name of a file is a hash of the data from which the picture was drawn. The files are in the
add-on's user folder, so that every .blend with this character uses the same files.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.names import without_lod
from ...logic.character import plans
from ..base import parts, sharing, storage
from ..base.blender_types import ArmatureObject
from ..character import runtime
from . import library, portrait

_MOST_FACES = 5000  # most polygons of a drawn mesh, if one of its levels of detail has no more
_TEXELS = 640  # largest width and height of a reduced image in pixels
_MOST_FILES = 3000  # number of cached pictures; the oldest are removed
_DIM = {"teeth": 0.9, "tongue": 0.75, "gum": 0.7}  # factor on colours in the shaded mouth
_GLOSS = {"eyes": 0.45, "teeth": 0.3, "skin": 0.07}  # strength of the highlight; others: 0.1


class Job(NamedTuple):
    """A picture to draw: path of its file, and slider values by property name."""

    path: Path
    sliders: Mapping[str, float]


def look_of(rig: ArmatureObject) -> str:
    """A hash that identifies the look of a character: DNA, images, and version of the drawing code.

    Args:
        rig: the character.
    """
    held = [storage.content_hash(rig.get(parts.DNA)), str(portrait.VERSION), str(portrait.SIZE)]
    for item in parts.meshes_of(rig):
        for material in item.data.materials:
            image = _image_of(material)
            if image is not None:
                held += [image.name, str(image.get(sharing.DIGEST) or image.size[:])]
    return hashlib.sha1("\n".join(held).encode(), usedforsecurity=False).hexdigest()


def path_of(look: str, sliders: Mapping[str, float]) -> Path:
    """The path of a picture.

    Args:
        look: hash of the character's look, from look_of.
        sliders: slider values of the expression, by property name.
    """
    text = look + repr(sorted((name, round(value, 4)) for name, value in sliders.items()))
    name = hashlib.sha1(text.encode(), usedforsecurity=False).hexdigest()
    return library.own_folder("thumbnails") / f"{name}.png"


def sitter_of(rig: ArmatureObject) -> portrait.Sitter | None:
    """The data for drawing pictures of a character, or None if it has no mesh.

    Args:
        rig: the character.
    """
    live = runtime.there(rig)
    names = live.dna.mesh_names
    paints = {}  # mesh name without its level -> materials, which all levels share
    for item in parts.meshes_of(rig):
        index = int(item[parts.MESH])
        if 0 <= index < len(names):
            paints.setdefault(without_lod(names[index]), list(item.data.materials))
    pixels: dict[str, NDArray[np.float32]] = {}
    pieces = [
        _piece(live, index, paints.get(without_lod(names[index]), []), pixels)
        for index in _meshes(live)
    ]
    return portrait.Sitter(live, tuple(pieces)) if pieces else None


def plain_pieces(live: runtime.Runtime) -> list[portrait.Piece]:
    """The data for drawing pictures of a file that is not in the scene, without materials.

    Args:
        live: Runtime of the DNA file.
    """
    return [_piece(live, index, (), {}) for index in _meshes(live)]


def _meshes(live: runtime.Runtime) -> list[int]:
    """Indices of the meshes to draw.

    Each mesh of LOD 0 is drawn in the finest LOD in which it has at most _MOST_FACES polygons. If
    there is no such LOD, its coarsest LOD is drawn. Wet films are left out.
    """
    dna = live.dna
    rows = dna.lod_mesh_mapping.rows or [range(len(dna.meshes))]
    chosen: dict[str, int] = {}
    for row in rows:
        for index in map(int, row):
            base = without_lod(dna.mesh_names[index]) if index < len(dna.meshes) else ""
            if (
                not base
                or plans.kind_of(base) == "wet"
                or (row is not rows[0] and base not in chosen)
            ):
                continue
            if base not in chosen or len(dna.meshes[chosen[base]].face_offsets) > _MOST_FACES:
                chosen[base] = index
    return list(chosen.values())


def _piece(
    live: runtime.Runtime,
    index: int,
    materials: Sequence[bpy.types.Material | None],
    pixels: dict[str, NDArray[np.float32]],
) -> portrait.Piece:
    mesh, kind = live.dna.meshes[index], plans.kind_of(live.dna.mesh_names[index])
    corners = native.part("plot.drawing.shade").corners_of(mesh)
    triangles = np.asarray(mesh.layout_positions, np.int64)[corners]
    uvs = np.zeros((*corners.shape, 2))
    if len(mesh.texture_coordinates) and len(mesh.layout_texture_coordinates):
        layouts = np.asarray(mesh.layout_texture_coordinates, np.int64)[corners]
        uvs = np.asarray(mesh.texture_coordinates, np.float64)[:, :2][layouts]
    colors = np.tile(_color_of(materials[0] if materials else None), (len(triangles), 1))
    if kind == "eyes" and len(materials) > 1:
        colors[_iris(live, np.asarray(mesh.positions)[triangles].mean(axis=1))] = _color_of(
            materials[1]
        )
    image = next((i for i in map(_image_of, materials) if i is not None), None)
    return portrait.Piece(
        index=index,
        triangles=triangles,
        uvs=uvs,
        colors=colors * _DIM.get(kind, 1.0),
        image=_pixels(image, pixels) if image is not None else None,
        gloss=_GLOSS.get(kind, 0.1),
        hairs=kind in ("lashes", "hair"),
        weights=portrait.skin_of(mesh, len(live.dna.joint_names)),
        shapes=portrait.shapes_of(mesh),
    )


def _iris(live: runtime.Runtime, places: NDArray[np.float32]) -> NDArray[np.bool_]:
    """bool[n]: whether a point of the eyeballs lies on the iris of the nearest eye.

    A point counts if it is in front of the eye's centre and near the axis on which the eye looks
    ahead.

    Args:
        live: Runtime of the character.
        places: float[n, 3], centres of the eyeballs' triangles in file space.
    """
    points = live.space.points(places)
    eyes = [live.rest[joint][:3, 3] for joint in live.anchors.eyes.values()]
    if not eyes:
        return np.zeros(len(points), bool)
    off = np.stack([points - eye for eye in eyes])
    nearest = np.linalg.norm(off, axis=2).argmin(axis=0)
    own = off[nearest, np.arange(len(points))]
    radius = np.linalg.norm(own, axis=1).max(initial=1e-9)
    return (own[:, 1] < 0) & (np.hypot(own[:, 0], own[:, 2]) < 0.45 * radius)


def _image_of(material: bpy.types.Material | None) -> bpy.types.Image | None:
    """The image of a material's active node (see materials.py), else of its node "Alpha", as for
    lashes; None if it has neither."""
    tree = material.node_tree if material is not None else None
    if tree is None:
        return None
    active = tree.nodes.active
    nodes: list[Any] = [active] if active is not None and active.type == "TEX_IMAGE" else []
    nodes += [n for n in tree.nodes if n.type == "TEX_IMAGE" and n.label == "Alpha"]
    return next((n.image for n in nodes if n.image is not None and n.image.size[0]), None)


def _color_of(material: bpy.types.Material | None) -> list[float]:
    """The viewport colour of a material, converted from linear to sRGB; grey without a material."""
    linear = np.array(material.diffuse_color[:3] if material is not None else (0.5, 0.5, 0.5))
    low = linear * 12.92
    return (
        np.where(linear < 0.0031308, low, 1.055 * linear ** (1 / 2.4) - 0.055).clip(0, 1).tolist()
    )


def _pixels(
    image: bpy.types.Image, known: dict[str, NDArray[np.float32]]
) -> NDArray[np.float32] | None:
    """float32[h, w, 4]: an image, scaled down to at most _TEXELS in width and height.

    If the image has no transparent pixels, its alpha becomes the mean of red, green and blue.
    None if the file of the image is missing.

    Args:
        image: the image.
        known: cache, full name of an image -> its pixels; this image is added.
    """
    if image.name_full not in known:
        copy = image.copy()
        try:
            width, height = (min(int(side), _TEXELS) for side in image.size)
            if (width, height) != tuple(image.size):
                copy.scale(width, height)
            held = np.empty(width * height * 4, np.float32)
            floats: Any = copy.pixels
            floats.foreach_get(held)
        except (RuntimeError, TypeError):  # the file of the image is missing
            return None
        finally:
            bpy.data.images.remove(copy)
        table = held.reshape(height, width, 4)
        if image.channels < 4 or table[..., 3].min() > 0.99:
            table[..., 3] = table[..., :3].mean(axis=2)
        known[image.name_full] = table
    return known[image.name_full]


def make(
    sitter: portrait.Sitter,
    jobs: Sequence[Job],
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> int:
    """Draw pictures and write their files, without using Blender data.

    Args:
        sitter: data of the character, from sitter_of.
        jobs: the pictures to draw.
        progress: function that is called with the progress, 0 to 1.
        cancelled: function that returns whether to stop.

    Returns:
        The number of written pictures.

    Raises:
        OSError: a file cannot be written.
    """
    png, write = native.part("files.png").png, native.part("files.fileio").write_bytes
    for number, job in enumerate(jobs):
        if cancelled():
            return number
        write(job.path, png(portrait.draw(sitter, job.sliders)))
        progress((number + 1) / len(jobs))
    return len(jobs)


def tidy() -> int:
    """Remove the oldest pictures if the folder has more than _MOST_FILES pictures.

    Returns:
        The number of removed pictures.
    """
    with os.scandir(library.own_folder("thumbnails")) as entries:
        files = [(e.stat().st_mtime, Path(e.path)) for e in entries if e.name.endswith(".png")]
    old = sorted(files)[: max(0, len(files) - _MOST_FILES)]
    for _, path in old:
        path.unlink(missing_ok=True)
    return len(old)
