# SPDX-License-Identifier: MIT
"""Draws the neutral face from the front and the side, with its joints and bones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

import risorius

from ..content.facts import Facts, listed
from . import shade, skeleton
from .paper import MUTED, Canvas, heading, rgb

Floats = npt.NDArray[np.float64]

# Beginnings of names of meshes that are left out: films and hair would hide the face,
# because the renderer draws everything opaque.
_FILMS = (
    "eyeshell",
    "cornea",
    "eyeedge",
    "eyelash",
    "saliva",
    "cartilage",
    "hair_",
    "brows_",
    "beard_",
)
_MARGIN = 0.04


@dataclass(frozen=True)
class Scene:
    """The data of one view, in view axes (right, up, front) and file units.

    Attributes:
        shape: the meshes.
        joints: float64[J, 3], positions of all joints.
        shown: indices of the joints that are drawn.
        bones: int64[n, 2], parent and child of each drawn bone.
    """

    shape: shade.Surface
    joints: Floats
    shown: npt.NDArray[np.int64]
    bones: npt.NDArray[np.int64]


def scene(facts: Facts, lod: int) -> Scene:
    """The meshes and joints of one LOD, in view axes.

    Args:
        facts: facts of the face.
        lod: number of the LOD, from 0.
    """
    dna = facts.dna
    axes = skeleton.view_axes(dna)
    names, meshes = _meshes(dna, lod)
    joints = skeleton.world_positions(dna) @ axes
    shown = listed(dna.lod_joint_mapping, lod)
    shown = shown[shown < len(joints)] if len(shown) else np.arange(len(joints))
    above = skeleton.parents(dna)
    bones = shown[(above[shown] != shown) & np.isin(above[shown], shown)]
    pairs = np.stack([above[bones], bones], axis=1)
    paints = [_paint(name, mesh, axes) for name, mesh in zip(names, meshes, strict=True)]
    shape = shade.surface(meshes, paints, axes)
    return Scene(shape, joints, shown, pairs)


def _meshes(dna: risorius.Dna, lod: int) -> tuple[list[str], list[risorius.Mesh]]:
    """Names and meshes of a LOD, without films and hair; all meshes if no others remain."""
    wanted = listed(dna.lod_mesh_mapping, lod).tolist()
    found = [(dna.mesh_names[i], dna.meshes[i]) for i in wanted if i < len(dna.meshes)]
    solid = [(name, mesh) for name, mesh in found if not name.lower().startswith(_FILMS)]
    chosen = solid or found
    return [name for name, _ in chosen], [mesh for _, mesh in chosen]


def _paint(name: str, mesh: risorius.Mesh, axes: Floats) -> Floats:
    """float64[V]: lightness of each vertex; an eyeball gets an iris and a pupil.

    Args:
        name: name of the mesh.
        mesh: the mesh.
        axes: float64[3, 3], maps file axes to right, up, front.
    """
    points = np.asarray(mesh.positions, float).reshape(-1, 3) @ axes
    tone = np.ones(len(points))
    if not name.lower().startswith("eye") or not len(points):
        return tone
    low, high = points.min(axis=0), points.max(axis=0)
    radius = max(float((high - low)[:2].max()) / 2, 1e-9)
    off = np.linalg.norm((points - (low + high) / 2)[:, :2], axis=1) / radius
    ahead = points[:, 2] > (low + high)[2] / 2
    tone[:] = 1.12
    tone[ahead & (off < 0.5)] = 0.62
    tone[ahead & (off < 0.22)] = 0.2
    return tone


def draw(canvas: Canvas, facts: Facts, lod: int, dpi: int) -> None:
    """Draws both views at the same scale.

    Args:
        canvas: receives the drawing.
        facts: facts of the rig.
        lod: number of the LOD, from 0.
        dpi: resolution of the images in dots per inch.
    """
    seen = scene(facts, lod)
    if not len(seen.joints) and not len(seen.shape.triangles):
        canvas.say("This file has neither meshes nor joints.")
        return
    # In the side view, the face looks to the left.
    side = _turned(seen, np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], float))
    frames = [frame_of(seen), frame_of(side)]
    bottom, top = min(f[2] for f in frames), max(f[3] for f in frames)
    widths = [f[1] - f[0] for f in frames]
    gap, edge, head = 0.3, 0.35, 0.6
    high = canvas.height - head - 0.15
    scale = min(high / (top - bottom), (canvas.width - 2 * edge - gap) / sum(widths))
    spare = canvas.width - 2 * edge - sum(widths) * scale - gap
    left, tall = edge + spare / 2, (top - bottom) * scale
    for title, view, frame in zip(("Front", "Side"), (seen, side), frames, strict=True):
        wide = (frame[1] - frame[0]) * scale
        axes = canvas.place(left, canvas.height - head - tall, wide, tall)
        _draw_view(axes, facts, view, (frame[0], frame[1], bottom, top), round(tall * dpi))
        heading(axes, title, _words(seen) if view is seen else "from the face's left")
        left += wide + gap


def _turned(seen: Scene, turn: Floats) -> Scene:
    shape = shade.Surface(
        seen.shape.points @ turn, seen.shape.normals @ turn, seen.shape.triangles, seen.shape.paint
    )
    return Scene(shape, seen.joints @ turn, seen.shown, seen.bones)


def _words(seen: Scene) -> str:
    joints = f"{len(seen.shown):,} joints" if len(seen.shown) else "no joints in this file"
    if not len(seen.shape.triangles):
        return f"{joints}, no meshes at this level"
    return f"{joints}, {len(seen.shape.triangles):,} triangles"


def frame_of(seen: Scene) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) of a frame around the meshes and the joints near the meshes."""
    used = seen.shape.points[np.unique(seen.shape.triangles)]
    joints = seen.joints[seen.shown]
    if len(used):
        low, high = used[:, :2].min(axis=0), used[:, :2].max(axis=0)
        # Distant joints are left out, because the root of a spine may be metres below a head.
        reach = 0.1 * float((high - low).max())
        near = np.all((joints[:, :2] > low - reach) & (joints[:, :2] < high + reach), axis=1)
        # If most joints are distant, this is not a face, and all of them are shown.
        used = np.concatenate([used, joints[near] if 2 * near.sum() >= len(near) else joints])
    else:
        used = joints
    low, high = used[:, :2].min(axis=0), used[:, :2].max(axis=0)
    # The frame of a single joint, or of joints on a line, still needs a width and a height.
    size = max(float((high - low).max()), 1e-3)
    pad = np.maximum(_MARGIN * size, (0.3 * size - (high - low)) / 2)
    (left, bottom), (right, top) = (low - pad).tolist(), (high + pad).tolist()
    return left, right, bottom, top


def _draw_view(
    axes: Axes, facts: Facts, seen: Scene, frame: tuple[float, float, float, float], pixels: int
) -> None:
    left, right, bottom, top = frame
    if len(seen.shape.triangles):
        picture = shade.render(seen.shape, frame, pixels)
        axes.imshow(picture, extent=frame, aspect="auto", interpolation="none")
    axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()
    _draw_joints(axes, facts, seen)


def _draw_joints(axes: Axes, facts: Facts, seen: Scene) -> None:
    """Draws joints and bones; far joints first and fainter, so that the near side is clear."""
    if not len(seen.shown):
        return
    order = seen.shown[np.argsort(seen.joints[seen.shown, 2], kind="stable")]
    points = seen.joints[order]
    depth = points[:, 2] - points[:, 2].min()
    near = 1 - 0.75 * (1 - depth / max(float(depth.max()), 1e-9))
    many = len(order) > 100
    # Hundreds of bones may start at one root; strong lines would hide the face.
    width, alpha = (0.4, 0.3) if many else (1.4, 0.6)
    lines = [seen.joints[pair][:, :2] for pair in seen.bones]
    axes.add_collection(
        LineCollection(lines, colors=MUTED, linewidths=width, alpha=alpha),
        autolim=False,
    )
    size = float(np.clip(9000 / len(order), 12, 90))
    shade_of = np.array([rgb(facts.joint_regions[j]) for j in order.tolist()])
    axes.scatter(
        points[:, 0],
        points[:, 1],
        s=size,
        c=np.column_stack([shade_of, near if many else np.ones(len(order))]),
        edgecolors=[(1.0, 1.0, 1.0, alpha) for alpha in near.tolist()],
        linewidths=0.3 if many else 0.9,
        zorder=3,
    )
