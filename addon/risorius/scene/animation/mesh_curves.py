# SPDX-License-Identifier: GPL-3.0-or-later
"""Solves curves of a face's controls from an animated mesh with the topology of the face."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.animation.clip_units import ClipError
from ...logic.base import heat_ramp
from ...logic.base.sentences import told
from ..base import parts
from ..base.blender_types import ArmatureObject, Attribute, Context, MeshObject
from ..base.task import Task, telling
from ..character import runtime
from ..character.meshes import basis_of
from . import clip_actions

_HOTTEST_MM = 2.0  # the hottest colour shows the largest residual, but at least this many mm
MOST_FRAMES = 20_000
Floats = NDArray[np.float32]


def sources(context: Context, rig: ArmatureObject) -> list[MeshObject]:
    """Mesh objects that may be animated copies of a face mesh.

    They have as many vertices as one mesh of the face, but do not belong to the face.

    Args:
        context: has the scene.
        rig: the face.
    """
    live = runtime.there(rig)
    counts = {len(mesh.positions) for mesh in live.dna.meshes}
    items = [item for item in context.scene.objects if item.type == "MESH"]
    meshes = cast(list[MeshObject], items)
    return [m for m in meshes if len(m.data.vertices) in counts and parts.rig_of(m) != rig]


def source_of(context: Context, rig: ArmatureObject) -> MeshObject | None:
    """The mesh to read: a selected object from `sources`, or the only one that `sources` finds.

    None if there is neither.

    Args:
        context: has the scene.
        rig: the face.
    """
    there = sources(context, rig)
    selected = cast(list[MeshObject], context.selected_objects)
    chosen = [item for item in selected if item in there]
    if chosen:
        return chosen[0]
    return there[0] if len(there) == 1 else None


def meant(rig: ArmatureObject, item: MeshObject) -> tuple[int, int]:
    """The first face mesh that has as many vertices as a source object: (LOD, index of the mesh).

    Args:
        rig: the face.
        item: an object from `sources`.

    Raises:
        ClipError: no mesh of the face has this vertex count.
    """
    dna = runtime.there(rig).dna
    count = len(item.data.vertices)
    for lod in range(dna.lod_count):
        for mesh in dna.lod_mesh_mapping[lod]:
            if len(dna.meshes[mesh].positions) == count:
                return lod, int(mesh)
    raise ClipError(
        told("{name}: no mesh of this face has the same number of vertices.", name=item.name)
    )


def recorded(
    context: Context, item: MeshObject, first: int, last: int, progress: Callable[[float], None]
) -> Floats:
    """float32[F, V, 3]: an object's evaluated vertices in object space, frame by frame.

    Args:
        context: scene and view layer.
        item: a mesh object; its modifiers are applied.
        first, last: first and last frame, both included.
        progress: function that is called with the progress, 0 to 1.

    Raises:
        ClipError: the number of frames is outside 1 to MOST_FRAMES, or a modifier changes the
            number of vertices.
    """
    count = last - first + 1
    if not 1 <= count <= MOST_FRAMES:
        raise ClipError(
            told("1 to {most} frames were expected, found {count}.", most=MOST_FRAMES, count=count)
        )
    scene = context.scene
    before = scene.frame_current, scene.frame_subframe
    vertices = len(item.data.vertices)
    out = np.empty((count, vertices, 3), np.float32)
    try:
        for row in range(count):
            scene.frame_set(first + row)
            seen = item.evaluated_get(context.evaluated_depsgraph_get())
            mesh = seen.to_mesh()
            if len(mesh.vertices) != vertices:
                raise ClipError(
                    told("{name}: a modifier changes its number of vertices.", name=item.name)
                )
            mesh.vertices.foreach_get("co", out[row].ravel())
            seen.to_mesh_clear()
            progress((row + 1) / count)
    finally:
        scene.frame_set(before[0], subframe=before[1])
    return out


class MeshCurvesTask(Task["native.SolvedClip"]):
    """Solves control curves that reproduce a recorded mesh, in a background thread.

    Attributes:
        mesh: index of the mesh in the DNA file.
        mm: length of the DNA file's unit in millimetres.
    """

    def __init__(
        self,
        rig: ArmatureObject,
        item: MeshObject,
        frames: Floats,
        rate: float,
        *,
        relative: bool,
        sparse: float,
        smooth: float,
    ) -> None:
        """Read the meshes from Blender in the calling thread; the solve runs in the background.

        Args:
            rig: the face.
            item: the recorded mesh.
            frames: float32[F, V, 3], from `recorded`.
            rate: frames per second.
            relative: True: fit the motion of the recorded mesh away from its own neutral shape;
                False: fit its shape at each frame.
            sparse: factor of the price of a control's value; 0: no price, 1: the default.
            smooth: factor of the price of a sudden change; 0: no price, 1: the default.

        Raises:
            ClipError: no mesh of the face has as many vertices as the recorded mesh.
            DnaError: the face cannot be solved.
        """
        live = runtime.there(rig)
        lod, self.mesh = meant(rig, item)
        surface = native.module().Surface(live.dna, live.rig, lod)
        self.mm = float(surface.mm)
        made = native.part("solving.performance")
        take = made.Performance(frames, rate, 0.0, basis_of(item))
        own = np.asarray(live.dna.meshes[self.mesh].positions)

        def work(
            progress: Callable[[float], None], cancelled: Callable[[], bool]
        ) -> native.SolvedClip:
            fitted = made.fitted(take, own)
            return native.module().solve_clip(
                surface,
                {self.mesh: fitted.frames},
                rate=rate,
                neutral={self.mesh: fitted.neutral} if relative else None,
                sparse=sparse,
                smooth=smooth,
                progress=telling(progress, cancelled),
            )

        super().__init__(work)


def show_residual(rig: ArmatureObject, mesh: int, residual: Floats) -> float:
    """Paint the error of a solve onto a mesh of a face, as a colour attribute.

    Args:
        rig: the face.
        mesh: index of the mesh in the DNA file.
        residual: float32[V], distance in mm between each solved vertex and the recorded vertex.

    Returns:
        The distance in mm that the hottest colour shows; 0 if no object of the face is this mesh
        with V vertices.
    """
    hottest = max(_HOTTEST_MM, float(residual.max(initial=0)))
    colours = heat_ramp.linear(heat_ramp.colours(residual.astype(np.float64) / hottest))
    for item in parts.meshes_of(rig):
        if item.get(parts.MESH) != mesh or len(item.data.vertices) != len(residual):
            continue
        held = item.data.color_attributes
        layer: Attribute = held.get(parts.RESIDUAL)
        if layer is not None:
            held.remove(layer)
        layer = held.new(parts.RESIDUAL, "FLOAT_COLOR", "POINT")
        layer.data.foreach_set("color", colours.ravel())
        held.active_color_name = layer.name
        item.data.update_tag()
        return hottest
    return 0.0


def rate_of(scene: bpy.types.Scene) -> float:
    """Frames per second of a scene."""
    return clip_actions.frame_rate(scene)
