# SPDX-License-Identifier: GPL-3.0-or-later
"""The files whose faces are mixed, read once; and the mesh that shows what comes of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...logic.character import plans
from ..base import session
from ..base.blender_types import Context, MeshObject

PREVIEW = "risorius_mix_preview"  # on the object that shows the mix
# Path -> when and how large, its Dna.
_read: dict[str, tuple[tuple[float, int], native.Dna]] = session.table(
    "parents.read", ("unregister",)
)
# The paths of now -> what the preview needs.
_seen: dict[tuple[str, ...], _Seen] = session.table("parents.seen", ("unregister",))

Regions = Mapping[str, Mapping[int, float]]


class MixError(FaceError, ValueError):
    """Faces that cannot be mixed; the sentence says why."""


def region_names() -> tuple[str, ...]:
    """The regions that a face may have from another one."""
    return tuple(native.part("mixing").REGIONS)


def read(path: str) -> native.Dna:
    """The Dna of a file, from memory where the file is as it was.

    Args:
        path: of the file, absolute.
    """
    stat = Path(path).stat()
    stamp = (stat.st_mtime, stat.st_size)
    if path not in _read or _read[path][0] != stamp:
        _read[path] = (stamp, native.module().load(path))
        _seen.clear()
    return _read[path][1]


def forget() -> None:
    """Let go of the files."""
    _read.clear()
    _seen.clear()


def refused(first: str, other: str) -> str:
    """Why a face cannot be mixed with another, in a sentence; empty: it can.

    Args:
        first: path of a file.
        other: path of another one.
    """
    why = native.part("mixing").difference(read(first), read(other))
    if not why:
        return ""
    return told(
        "{other} cannot be mixed with {first}: {why}.",
        other=Path(other).name,
        first=Path(first).name,
        why=why,
    )


class _Seen:
    """What does not change while sliders move: masks and polygons of the finest level."""

    def __init__(self, context: Context, paths: Sequence[str]) -> None:
        bald = native.part("mixing").without_hair
        self.parents = [bald(read(path)) for path in paths]
        first = self.parents[0]
        self.masks = native.part("mixing").Masks(first)
        self.space = plans.space_of(first, context.scene.unit_settings.scale_length)
        listed = first.lod_mesh_mapping
        self.meshes = [int(m) for m in listed[0]] if len(listed) else list(range(len(first.meshes)))

    def polygons(self) -> list[list[int]]:
        out: list[list[int]] = []
        begin = 0
        for number in self.meshes:
            mesh = self.parents[0].meshes[number]
            corners = np.asarray(mesh.layout_positions, np.int64)[
                np.asarray(mesh.face_layouts, np.int64)
            ]
            corners = corners + begin
            ends = np.asarray(mesh.face_offsets, np.int64)
            for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
                face = corners[a:b].tolist()
                out.append(face[::-1] if self.space.flip_faces else face)
            begin += len(mesh.positions)
        return out

    def points(self, shares: Sequence[float], regions: Regions) -> NDArray[np.float64]:
        """float64[V, 3] of the mix, in Blender's space."""
        mixing = native.part("mixing")
        places = mixing.Places(self.parents, mixing.Mix(list(shares), regions), self.masks)
        rows = [
            places.of_mesh(number).places(
                [parent.meshes[number].positions for parent in self.parents]
            )
            for number in self.meshes
        ]
        return self.space.points(np.concatenate(rows))


def preview(context: Context) -> MeshObject | None:
    """The object that shows the mix, if there is one.

    Args:
        context: Blender context.
    """
    for item in context.scene.objects:
        if item.type == "MESH" and PREVIEW in item:
            return cast(MeshObject, item)
    return None


def show(
    context: Context, paths: Sequence[str], shares: Sequence[float], regions: Regions
) -> MeshObject:
    """Shows a mix; where it is shown already, its vertices move.

    Args:
        context: Blender context.
        paths: of the parents, which go together.
        shares: of each.
        regions: where they are others.

    Raises:
        ValueError: shares that make no sense.
    """
    key = tuple(paths)
    if key not in _seen:
        _seen.clear()
        _seen[key] = _Seen(context, paths)
    seen = _seen[key]
    points = seen.points(shares, regions)
    item = preview(context)
    if item is None:
        mesh = bpy.data.meshes.new("Mix")
        item = cast(MeshObject, bpy.data.objects.new("Mix", mesh))
        item[PREVIEW] = True
        context.scene.collection.objects.link(item)
    mesh = item.data
    if len(mesh.vertices) != len(points):
        mesh.clear_geometry()
        mesh.from_pydata(points.tolist(), [], seen.polygons())
        mesh.shade_smooth()
    else:
        mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.update()
    return item


def hide(context: Context) -> None:
    """Removes what shows the mix.

    Args:
        context: Blender context.
    """
    item = preview(context)
    if item is not None:
        mesh = item.data
        bpy.data.objects.remove(item)
        bpy.data.meshes.remove(mesh)


def write(
    path: str,
    paths: Sequence[str],
    shares: Sequence[float],
    regions: Regions,
    progress: Callable[[float], None],
) -> dict[str, str]:
    """Writes the mix as a DNA file, with its textures beside it.

    Args:
        path: of the new file.
        paths: of the parents, which go together.
        shares: of each.
        regions: where they are others.
        progress: told the share that is done, 0 to 1.

    Returns:
        Names of textures that are the leading parent's own -> why: a key of mixing.textures.WHY.

    Raises:
        MixError: the file is one of the parents.
        OSError: it cannot be written; then each file is as it was.
        ValueError: shares that make no sense, a region that the first face does not have, a picture
            of the user's that would be replaced.
    """
    target = Path(path)
    if any(target.resolve() == Path(p).resolve() for p in paths):
        raise MixError(told("A face that is mixed cannot be written over: choose another name."))
    fileio = native.part("files.fileio")
    fileio.check_writable(target)
    mixing, textures = native.part("mixing"), native.part("mixing.textures")
    parents = [read(p) for p in paths]
    mix = mixing.Mix(list(shares), regions)
    masks = mixing.Masks(parents[0])
    progress(0.3)
    dna = mixing.mix_faces(parents, mix, name=target.stem, masks=masks)
    progress(0.5)
    pictures, own = textures.mix_textures(parents, [Path(p) for p in paths], mix, masks)
    progress(0.9)
    textures.check_room(target, pictures)
    folder = textures.texture_folder(target)
    files = {target: dna.to_bytes()} | {folder / name: data for name, data in pictures.items()}
    fileio.write_all(files)
    return dict(own)
