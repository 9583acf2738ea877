# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds one material per mesh name without LOD; animated maps drive inputs of its nodes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...logic.character import plans
from ...logic.material import animated_maps, skin_folds, texture_search
from ..base.blender_types import ArmatureObject, Attribute, MeshObject
from . import card_color, cloth_material, eye_mouth_materials, hair_material, nodes, skin_material
from .image_loading import Images
from .look import Look
from .nodes import Graph

# Colours of the solid view. Lashes are cards, and opaque cards would cover the lids with black
# bands. Cards with a picture get the colour and opacity of the picture, see card_color.
_VIEW_COLORS = {
    "skin": (0.62, 0.36, 0.27, 1.0),
    "eyes": (0.75, 0.70, 0.66, 1.0),
    "teeth": (0.72, 0.66, 0.55, 1.0),
    "tongue": (0.45, 0.12, 0.11, 1.0),
    "gum": (0.50, 0.17, 0.15, 1.0),
    "lashes": (0.03, 0.02, 0.015, 0.3),
    "wet": (1.0, 1.0, 1.0, 0.0),
    "cloth": (0.10, 0.11, 0.13, 1.0),
    "hair": (0.05, 0.035, 0.025, 0.5),
}
_VIEW_ROUGHNESS = {"skin": 0.6, "cloth": 1.0, "hair": 0.8}  # others keep Blender's default
_IRIS_COLOR = (0.035, 0.02, 0.012, 1.0)
_IRIS_RADIUS = 0.47  # radius of iris and limbus in radii of the eye, see eye_mouth_materials.eyes
_WIDE = 1.6  # a mesh wider than this times its height holds both eyes


def build_materials(
    plan: plans.CharacterPlan,
    rig: ArmatureObject,
    built: Sequence[MeshObject],
    made: list[bpy.types.ID],
    found: texture_search.TexturePlan | None = None,
    simple: bool = False,
) -> list[str]:
    """Build the materials of a character, one per mesh name without LOD, and assign them.

    Args:
        plan: the CharacterPlan.
        rig: the deforming armature, whose `maps` array drives the map values.
        built: mesh objects, in the order of the plan's meshes.
        made: receives every new datablock.
        found: texture_search.TexturePlan; None for no textures.
        simple: True builds cheaper materials without subsurface scattering, relief and animated
            maps.

    Returns:
        Sentences about textures that are missing, cannot be read or stay outside the .blend.
    """
    found = found if found is not None else texture_search.TexturePlan()
    images = Images(made)
    frame = _face_frame(plan)
    uses = animated_maps.uses_of(plan.map_labels)
    by_base = {}
    for mesh, item in zip(plan.meshes, built, strict=True):
        areas = _add_attributes(item.data, mesh, frame)
        if mesh.base not in by_base:
            look = _look(plan, mesh, rig, frame, uses, areas, found, images, simple)
            look.border = skin_material.BORDER in item.data.attributes
            by_base[mesh.base] = _build(plan, look, made)
            if mesh.kind in ("lashes", "hair"):
                shown = card_color.color_of(look, mesh)
                by_base[mesh.base][0].diffuse_color = shown or _VIEW_COLORS[mesh.kind]
        for material in by_base[mesh.base]:
            item.data.materials.append(material)
        if mesh.kind == "eyes" and eye_mouth_materials.EYES in item.data.attributes:
            _give_iris(item.data)
    return [*found.missing, *images.troubles]


def _look(
    plan: plans.CharacterPlan,
    mesh: plans.MeshPlan,
    rig: ArmatureObject,
    frame: skin_folds.FaceFrame | None,
    uses: list[animated_maps.MapUse],
    areas: set[str],
    found: texture_search.TexturePlan,
    images: Images,
    simple: bool,
) -> Look:
    same = [m for m in plan.meshes if m.base == mesh.base]
    extent = np.ptp(mesh.positions, axis=0) if len(mesh.positions) else np.ones(3)
    look = Look(
        kind=mesh.kind,
        base=mesh.base,
        rig=rig,
        extent=np.maximum(extent, 1e-6),
        unit=frame.unit if frame else plan.size * 0.2,
        vertices=max(len(m.positions) for m in same),
        has_uvs=mesh.uvs is not None,
        simple=simple,
        uses=uses,
        areas=areas,
        found=found,
        images=images,
        cornea=any("cornea" in m.base.lower() for m in plan.meshes),
    )
    if mesh.kind == "skin" and areas and found.masks and not simple:
        wanted = {u.region for u in uses} & set(found.masks)
        masks = {r: found.masks[r] for r in sorted(wanted)}
        look.atlas, look.places = images.atlas(f"{plan.name}_masks", masks)
    return look


def _build(
    plan: plans.CharacterPlan, look: Look, made: list[bpy.types.ID]
) -> list[bpy.types.Material]:
    """Build the materials of one mesh name without LOD, in the order of their slots.

    Args:
        plan: gives the name of the character.
        look: the Look of the meshes.
        made: receives every new datablock.
    """
    material = bpy.data.materials.new(f"{plan.name}_{look.base}")
    made.append(material)
    material.diffuse_color = _VIEW_COLORS[look.kind]
    material.roughness = _VIEW_ROUGHNESS.get(look.kind, material.roughness)
    graph = nodes.Graph(material)
    if look.kind == "skin":
        skin_material.Skin(graph, look).build()
    elif look.kind == "cloth":
        cloth_material.build(graph, look)
    elif look.kind == "hair":
        hair_material.build(graph, look)
    else:
        eye_mouth_materials.build(graph, look)
    graph.tidy()
    _choose_picture(look, graph)
    if look.kind != "eyes":
        return [material]
    # The iris gets a copy of the material in a second slot, because the solid view has one colour
    # for each material, and a visible iris shows the direction of an eye.
    iris = material.copy()
    made.append(iris)
    iris.name, iris.diffuse_color = f"{material.name}_iris", _IRIS_COLOR
    return [material, iris]


def _choose_picture(look: Look, graph: Graph) -> None:
    """Make the colour image active, because the solid view's *Texture* mode shows the active image.

    Without a colour image, a node with a procedural pattern becomes active, so that the view shows
    the material's colour. The view would otherwise show the first image, such as a mask.
    """
    pictures = [n for n in graph.tree.nodes if n.type == "TEX_IMAGE" and n.image is not None]
    colors = [n for n in pictures if n.image == look.image("color")]
    if look.kind in ("lashes", "hair"):  # cards: without alpha they would hide the eyes
        colors = [n for n in colors if n.image.channels == 4]
    patterns = [n for n in graph.tree.nodes if n.type in ("TEX_NOISE", "TEX_VORONOI")]
    graph.tree.nodes.active = next(iter([*colors, *patterns]), None)


def _give_iris(mesh: bpy.types.Mesh) -> None:
    """Assign the faces of the iris and the pupil to the second material slot."""
    flat = np.empty(len(mesh.vertices) * 3, np.float32)
    places_of: Attribute = mesh.attributes[eye_mouth_materials.EYES]
    places_of.data.foreach_get("vector", flat)
    places = flat.reshape(-1, 3)
    away = np.hypot(places[:, 0], places[:, 1]) + 2.0 * (1.0 - places[:, 2])
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    if len(starts):
        counts = np.diff(np.append(starts, len(corners)))
        inside = np.add.reduceat(away[corners], starts) / counts < _IRIS_RADIUS
        mesh.polygons.foreach_set("material_index", inside.astype(np.int32))


# --- mesh attributes that materials read -----------------------------------------------------


def _face_frame(plan: plans.CharacterPlan) -> skin_folds.FaceFrame | None:
    """The FaceFrame of a character, or None if no mesh is skin."""
    skins = [m for m in plan.meshes if m.kind == "skin" and len(m.positions)]
    heads = [m for m in skins if "head" in m.base.lower() or "face" in m.base.lower()]
    if not skins:
        return None
    rest = plan.armature.rest
    eyes = [rest[j][:3, 3] for j in plan.anchors.eyes.values()]
    teeth = next((m for m in plan.meshes if m.kind == "teeth" and len(m.positions)), None)
    mouth = None
    if teeth is not None:
        mouth = (teeth.positions.min(axis=0) + teeth.positions.max(axis=0)) / 2
    return skin_folds.find_frame(eyes, (heads or skins)[0].positions, mouth)


def _add_attributes(
    mesh: bpy.types.Mesh, plan: plans.MeshPlan, frame: skin_folds.FaceFrame | None
) -> set[str]:
    """Write the mesh attributes that the material of a mesh reads.

    Returns:
        Names of the areas of a face, such as the forehead, that a skin mesh has; empty for other
        meshes.
    """
    if not len(plan.positions):
        return set()
    if plan.kind == "eyes":
        _add(mesh, eye_mouth_materials.EYES, _eye_coordinates(plan.positions))
    elif plan.kind in ("teeth", "tongue", "gum"):
        unit = frame.unit if frame else float(np.ptp(plan.positions[:, 0]))
        if plan.kind == "teeth":
            _add(mesh, eye_mouth_materials.TEETH, _tooth_coordinates(plan.positions, unit))
        behind: Attribute = mesh.attributes.new(eye_mouth_materials.MOUTH, "FLOAT", "POINT")
        away = plan.positions[:, 1] - plan.positions[:, 1].min()
        behind.data.foreach_set("value", (away / max(unit, 1e-9)).astype(np.float32))
    elif plan.kind == "skin" and frame is not None:
        _add_border(mesh, plan.positions, frame)
        return _add_areas(mesh, plan.positions, frame)
    return set()


def _add(
    mesh: bpy.types.Mesh, name: str, values: NDArray[np.float32] | NDArray[np.float64]
) -> None:
    attribute: Attribute = mesh.attributes.new(name, "FLOAT_VECTOR", "POINT")
    attribute.data.foreach_set("vector", np.ascontiguousarray(values, np.float32).ravel())


def _add_border(
    mesh: bpy.types.Mesh, points: NDArray[np.float32], frame: skin_folds.FaceFrame
) -> None:
    """Write an attribute: 1 at an open border away from the face, falling to 0 with distance.

    A mesh without such a border gets no attribute.

    Args:
        mesh: the mesh of a skin.
        points: float32[V, 3], its vertices in Blender units.
        frame: place and size of the face.
    """
    edges = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", edges)
    used = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("edge_index", used)
    faces = np.bincount(used, minlength=len(mesh.edges))
    open_ones = np.unique(edges.reshape(-1, 2)[faces == 1]).astype(np.int64)
    near = skin_folds.border_share(points, open_ones, frame)
    if near.any():
        attribute: Attribute = mesh.attributes.new(skin_material.BORDER, "FLOAT", "POINT")
        attribute.data.foreach_set("value", near)


def _add_areas(
    mesh: bpy.types.Mesh, points: NDArray[np.float32], frame: skin_folds.FaceFrame
) -> set[str]:
    masks = skin_folds.area_masks(points, frame)
    there = {area for area, mask in masks.items() if float(mask.max()) > 0.3}
    if not there:
        return there
    columns = [masks[a] for a in animated_maps.AREAS] + [skin_folds.left_share(points, frame)]
    for number, name in enumerate(skin_material.AREAS):
        _add(mesh, name, np.stack(columns[3 * number : 3 * number + 3], axis=1))
    _add(mesh, skin_material.FOLDS, skin_folds.fold_coordinates(points, frame))
    return there


def _eye_coordinates(points: NDArray[np.float32] | NDArray[np.float64]) -> NDArray[np.float64]:
    """float64[V, 3]: x and height from the eye's axis in eye radii; 1 on the front half, else 0."""
    points = points.astype(np.float64)
    middle = (points[:, 0].min() + points[:, 0].max()) / 2
    wide = np.ptp(points[:, 0]) > _WIDE * np.ptp(points[:, 2])
    left = points[:, 0] > middle if wide else np.ones(len(points), bool)
    values = np.zeros((len(points), 3))
    for side in (left, ~left):
        if not side.any():
            continue
        own = points[side]
        center = (own.min(axis=0) + own.max(axis=0)) / 2
        radius = max(float(np.ptp(own[:, 2])) / 2, 1e-9)
        values[side, 0] = (own[:, 0] - center[0]) / radius
        values[side, 1] = (own[:, 2] - center[2]) / radius
        values[side, 2] = own[:, 1] < center[1]
    return values


def _tooth_coordinates(
    points: NDArray[np.float32] | NDArray[np.float64], unit: float
) -> NDArray[np.float64]:
    """float64[V, 3]: position along the arch, pi per tooth; height from the mesh's middle, -1 to
    1; and 0.

    Args:
        points: float[V, 3], vertices of the teeth in Blender units.
        unit: distance between the eyes in Blender units.
    """
    points = points.astype(np.float64)
    low, high = points.min(axis=0), points.max(axis=0)
    half = max((high[0] - low[0]) / 2, 1e-9)
    across = (points[:, 0] - (low[0] + high[0]) / 2) / half
    # The arch is taken as a half circle, because teeth are spaced along it and not along x.
    along = np.arcsin(np.clip(across, -1, 1)) * half
    width = 0.125 * unit  # an upper front tooth is about an eighth of the eyes' distance
    height = (points[:, 2] - (low[2] + high[2]) / 2) / max((high[2] - low[2]) / 2, 1e-9)
    return np.stack([np.pi * along / width, height, np.zeros(len(points))], axis=1)


def map_drivers(material: bpy.types.Material | None) -> Iterator[bpy.types.FCurve]:
    """The drivers (F-curves) through which animated maps change a material."""
    data = material.node_tree.animation_data if material and material.node_tree else None
    for curve in data.drivers if data else ():
        if skin_material.MAP_PREFIX in curve.data_path:
            yield curve
