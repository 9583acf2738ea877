# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the files of a mix, shows the preview mesh, and writes the mixed face.

The parents are the faces that are mixed. The share of a parent is its fraction of the mixed face.
"""

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

PREVIEW = "risorius_mix_preview"  # custom property of the object that shows the mix
# Path -> ((time of the last change, size in bytes) of the file, its Dna).
_read: dict[str, tuple[tuple[float, int], native.Dna]] = session.table(
    "parents.read", ("unregister",)
)
# Paths of the faces that are mixed in the preview -> data of the preview.
_seen: dict[tuple[str, ...], _Seen] = session.table("parents.seen", ("unregister",))

Regions = Mapping[str, Mapping[int, float]]


class MixError(FaceError, ValueError):
    """Faces cannot be mixed; the message gives the reason."""


def region_names() -> tuple[str, ...]:
    """The names of the regions for which the user can set separate shares of the parents."""
    return tuple(native.part("mixing").REGIONS)


def read(path: str) -> native.Dna:
    """The Dna of a file, from memory if the file has not changed.

    Args:
        path: absolute path of the file.

    Raises:
        DnaError: the file is not a DNA file.
        OSError: the file cannot be read.
    """
    stat = Path(path).stat()
    stamp = (stat.st_mtime, stat.st_size)
    if path not in _read or _read[path][0] != stamp:
        _read[path] = (stamp, native.module().load(path))
        _seen.clear()
    return _read[path][1]


def forget() -> None:
    """Free the memory of all read files and of the preview data."""
    _read.clear()
    _seen.clear()


def refused(first: str, other: str) -> str:
    """The reason why two faces cannot be mixed, as a sentence; "" if they can.

    Args:
        first: path of the first file.
        other: path of the other file.
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
    """Preview data that do not depend on the shares: faces without hair, region masks, and the
    meshes of the finest LOD."""

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
        """float64[V, 3]: vertices of the mix, in Blender's axes and units.

        Args:
            shares: share of each parent; only their ratios count.
            regions: region -> index of a parent -> share, 0 to 1, for regions with separate shares.
        """
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
    """Show a mix, or move the vertices of the existing preview.

    Args:
        context: Blender context.
        paths: paths of matching parents.
        shares: share of each parent.
        regions: region -> index of a parent in `paths` -> share, for regions with separate shares.

    Raises:
        ValueError: invalid shares.
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
    """Remove the preview of the mix.

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
    """Write the mix as a DNA file, and its textures to a folder next to this file.

    Args:
        path: path of the new file.
        paths: paths of matching parents.
        shares: share of each parent.
        regions: region -> index of a parent in `paths` -> share, for regions with separate shares.
        progress: function that is called with the progress, 0 to 1.

    Returns:
        File name of a texture taken unmixed from the parent with the largest share -> reason, a
        key of mixing.textures.WHY.

    Raises:
        MixError: the new file is one of the parents.
        OSError: a file cannot be written; no file has changed.
        ValueError: invalid shares, a region that the first face lacks, or a picture of the user
            would be replaced.
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
