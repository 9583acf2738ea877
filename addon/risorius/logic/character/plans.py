# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans the Blender data of a DNA file: armature, meshes, sliders and textures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..base import names
from ..base.errors import FaceError
from ..base.sentences import told
from ..base.space import Float, Space, make_space, world_matrices
from ..material import texture_search
from . import slider_words
from .dna_data import DnaData, MeshData

LIVE_KEY = "<channel sum>"
_LAYER_WORDS = {
    "mlbh": told("neural network behaviour"),
    "mlbe": told("neural network behaviour"),
    "rbfb": told("pose-driven correctives (RBF)"),
    "rbfe": told("pose-driven correctives (RBF)"),
    "twsw": told("twist and swing joints"),
    "jbmd": told("joint representations"),
}
_KINDS = (
    ("lashes", ("lash", "eyebrow")),
    ("hair", ("hair", "brows", "beard")),
    ("wet", ("eyeshell", "eyeedge", "saliva", "tear", "fluid", "cornea")),
    ("gum", ("cartilage", "caruncle", "gum")),
    ("eyes", ("eye",)),
    ("teeth", ("teeth", "tooth")),
    ("tongue", ("tongue",)),
    ("cloth", ("shirt", "cloth", "garment")),
)


class PlanError(FaceError):
    """A file that cannot become a character; the text is one sentence for users."""


@dataclass(frozen=True)
class ArmaturePlan:
    """The armature that deforms the meshes.

    Attributes:
        labels: bone names, by joint index.
        parents: index of each joint's parent, -1 for a root.
        rest: float64[J, 4, 4], world matrices at rest, in Blender units; the columns are the bone's
            axes.
        lengths: float64[J], display length of each bone in Blender units.
        order: joint indices, with parents before their children.
    """

    labels: list[str]
    parents: list[int]
    rest: Float
    lengths: Float
    order: list[int]


@dataclass(frozen=True)
class MeshPlan:
    """One mesh of the DNA file, in Blender units.

    Attributes:
        index: index of the mesh in the DNA file.
        label: name of the mesh; Blender's object is `<character>_<label>`.
        base: name without LOD; meshes with the same base share a material.
        kind: skin, eyes, teeth, tongue, lashes, hair, wet, gum or cloth.
        lods: levels of detail that show the mesh.
        positions: float32[V, 3].
        face_starts: int32[F], first corner of each face.
        corners: int32[N], vertex of each corner.
        uvs: float32[N, 2] per corner, or None.
        normals: float32[N, 3] per corner, or None.
        skin_offsets, skin_joints, skin_weights: skin_offsets[v] to skin_offsets[v + 1] are the
            influences of vertex v.
        channels: for each blend shape target of the mesh, the index of its blend shape channel.
    """

    index: int
    label: str
    base: str
    kind: str
    lods: tuple[int, ...]
    positions: NDArray[np.float32]
    face_starts: NDArray[np.int32]
    corners: NDArray[np.int32]
    uvs: NDArray[np.float32] | None
    normals: NDArray[np.float32] | None
    skin_offsets: NDArray[np.int64]
    skin_joints: NDArray[np.int64]
    skin_weights: NDArray[np.float32]
    channels: list[int]


@dataclass(frozen=True)
class ControlPlan:
    """One slider: its index, property name, tooltip, rest value and lowest value."""

    index: int
    label: str
    description: str
    rest: float = 0.0
    lowest: float = 0.0


@dataclass(frozen=True)
class Anchors:
    """Indices of the joints that bones of the control armature rotate; empty or None if missing.

    Attributes:
        neck: one or two joints, from the bottom up.
        eyes: side "L" or "R" -> joint.
    """

    neck: tuple[int, ...]
    head: int | None
    eyes: dict[str, int]


@dataclass(frozen=True)
class CharacterPlan:
    """All data that the add-on builds for one file.

    Attributes:
        map_labels: names of the animated maps, by index.
        channel_count: number of blend shape channels.
        lod_count: number of LODs of the file, also those that are not built.
        textures: (mesh base, role) -> file name, as in the file's metadata.
        origin: the file's metadata without the names of textures.
        size: largest extent of the planned meshes along an axis, in Blender units.
    """

    name: str
    space: Space
    armature: ArmaturePlan
    meshes: list[MeshPlan]
    controls: list[ControlPlan]
    map_labels: list[str]
    channel_count: int
    anchors: Anchors
    lod_count: int
    textures: dict[tuple[str, str], str]
    origin: dict[str, str]
    size: float


def kind_of(mesh_name: str) -> str:
    """The kind of a mesh from its name; skin by default."""
    word = mesh_name.lower()
    for kind, parts in _KINDS:
        if any(part in word for part in parts):
            return kind
    return "skin"


def layer_warnings(layers: Sequence[str]) -> list[str]:
    """Warnings about parts of a DNA file (layers) that the evaluator ignores."""
    words = [_LAYER_WORDS.get(layer) or told("layer '{name}'", name=layer) for layer in layers]
    return [told("Risorius does not support: {what}", what=word) for word in dict.fromkeys(words)]


def space_of(dna: DnaData, unit_scale: float) -> Space:
    """The conversion from a face's coordinates and units to the scene's.

    Args:
        dna: the face.
        unit_scale: metres per Blender unit of the scene.
    """
    return make_space(
        dna.coordinate_system,
        dna.translation_unit,
        dna.rotation_unit,
        dna.rotation_sequence,
        dna.rotation_signs,
        dna.face_winding_order,
        unit_scale,
    )


def find_anchors(joint_names: Sequence[str]) -> Anchors:
    """Find the neck, head and eye joints by their usual names, such as neck_01 or FACIAL_L_Eye.

    Upper and lower case are equal, and so are dots and underscores.
    """
    where: dict[str, int] = {}
    for index, name in enumerate(joint_names):
        where.setdefault(name.lower().replace(".", "_"), index)
    neck = tuple(where[n] for n in ("neck_01", "neck_02") if n in where)
    if not neck and "neck" in where:
        neck = (where["neck"],)
    eyes = {}
    for side in "LR":
        s = side.lower()
        for name in (f"facial_{s}_eye", f"eye_{s}", f"{s}_eye", f"eye{s}"):
            if name in where:
                eyes[side] = where[name]
                break
    return Anchors(neck, where.get("head"), eyes)


def plan_character(
    dna: DnaData,
    fallback_name: str,
    lods: Sequence[int] = (0,),
    unit_scale: float = 1.0,
    rests: Sequence[float] | NDArray[np.float32] = (),
) -> CharacterPlan:
    """Plan the character of a file.

    Args:
        dna: a risorius.Dna with definition, behavior and geometry.
        fallback_name: used if the file has no name.
        lods: levels of detail to build.
        unit_scale: metres per Blender unit.
        rests: rest value of each raw control; missing values are 0.

    Returns:
        The plan; it keeps no reference to `dna`.

    Raises:
        PlanError: the file has no geometry, no joints, no meshes at these LODs or no vertices, or
            its data are invalid.
        SpaceError: unknown axes or units.
    """
    if not dna.meshes or not dna.mesh_names:
        raise PlanError(told("The file has no geometry layer, so there is no face to build."))
    if not dna.joint_names:
        raise PlanError(told("The file has no joints, so there is no face to build."))
    space = space_of(dna, unit_scale)
    wanted = _mesh_lods(dna)
    chosen = [i for i, levels in enumerate(wanted) if set(levels) & set(lods)]
    if not chosen:
        raise PlanError(told("The file has no meshes at the chosen levels of detail."))
    labels = names.unique_labels(dna.mesh_names)
    meshes = [_plan_mesh(dna, i, labels[i], wanted[i], space) for i in chosen]
    points = np.concatenate([m.positions for m in meshes])
    if not len(points):
        raise PlanError(told("The chosen meshes have no vertices, so there is no face to build."))
    return CharacterPlan(
        name=names.cut(dna.name or fallback_name or "Face", 40),
        space=space,
        armature=_plan_armature(dna, space),
        meshes=meshes,
        controls=plan_controls(dna.raw_control_names, rests),
        map_labels=names.unique_labels(dna.animated_map_names),
        channel_count=len(dna.blend_shape_channel_names),
        anchors=find_anchors(dna.joint_names),
        lod_count=max(1, int(dna.lod_count)),
        textures=texture_search.from_metadata(dna.metadata),
        origin={
            k: names.printable(v, 10_000)
            for k, v in dna.metadata.items()
            if not k.startswith("texture:")
        },
        size=float(np.max(np.ptp(points, axis=0))),
    )


def _mesh_lods(dna: DnaData) -> list[tuple[int, ...]]:
    count = min(len(dna.meshes), len(dna.mesh_names))
    levels: list[list[int]] = [[] for _ in range(count)]
    for lod in range(len(dna.lod_mesh_mapping)):
        for mesh in dna.lod_mesh_mapping[lod]:
            if mesh < count:
                levels[mesh].append(lod)
    if not any(levels):
        levels = [[0] for _ in range(count)]
    return [tuple(level) for level in levels]


def existing_lods(dna: DnaData, wanted: Sequence[int]) -> tuple[int, ...]:
    """The wanted levels of detail for which the file has meshes.

    If the file has no meshes at any wanted level, the result is the finest level with meshes.

    Args:
        dna: the face.
        wanted: LODs, 0 is the finest.
    """
    there = sorted({level for levels in _mesh_lods(dna) for level in levels})
    return tuple(level for level in wanted if level in there) or tuple(there[:1])


def plan_controls(
    raw_names: Sequence[str], rests: Sequence[float] | NDArray[np.float32] = ()
) -> list[ControlPlan]:
    """The sliders of a file's raw controls, in index order.

    Args:
        raw_names: names of all raw controls.
        rests: rest value of each raw control; missing values are 0. A raw control with a rest value
            other than 0 is the w component of a joint's rotation (quaternion); the sliders of all
            four components of this rotation range from -1 to 1, all other sliders from 0.
    """
    labels = names.unique_labels(raw_names)
    values = [float(r) for r in rests] + [0.0] * (len(raw_names) - len(rests))
    turning = {
        name.rpartition(".")[0] for name, rest in zip(raw_names, values, strict=True) if rest
    }
    return [
        ControlPlan(
            i,
            labels[i],
            names.printable(f"{slider_words.title(name)} ({name})"),
            values[i],
            -1.0 if name.rpartition(".")[0] in turning else 0.0,
        )
        for i, name in enumerate(raw_names)
    ]


def _plan_armature(dna: DnaData, space: Space) -> ArmaturePlan:
    parents = np.asarray(dna.joint_parents)
    count = len(dna.joint_names)
    offsets, angles = dna.neutral_joint_translations, dna.neutral_joint_rotations
    if not len(parents) == len(offsets) == len(angles) == count:
        raise PlanError(told("The file's joint names, parents and neutral pose differ in length."))
    if parents.max(initial=0) >= count:
        raise PlanError(told("The file names a parent joint that does not exist."))
    _check_finite(offsets, "neutral joint translations")
    _check_finite(angles, "neutral joint rotations")
    order = _parents_first(parents.tolist())
    rest = world_matrices(space.rotations(angles), space.points(offsets), parents)
    heads = rest[:, :3, 3]
    reach = float(np.max(np.ptp(heads, axis=0), initial=0.0)) or 1.0
    # In float32, a very short bone loses its direction, so each bone is at least 3 % as long as the
    # largest extent of all joints.
    lengths = np.full(count, reach * 0.03)
    for joint, parent in enumerate(parents.tolist()):
        if joint != parent:
            distance = float(np.linalg.norm(heads[joint] - heads[parent]))
            lengths[parent] = max(lengths[parent], min(distance, reach * 0.06))
    links = [-1 if p == j else int(p) for j, p in enumerate(parents.tolist())]
    return ArmaturePlan(names.unique_labels(dna.joint_names), links, rest, lengths, order)


def _parents_first(parents: Sequence[int]) -> list[int]:
    order: list[int] = []
    state = [0] * len(parents)
    for start in range(len(parents)):
        chain = []
        joint = start
        while state[joint] == 0:
            state[joint] = 1
            chain.append(joint)
            if parents[joint] == joint:
                break
            joint = parents[joint]
            if state[joint] == 1:
                raise PlanError(told("The file's joints form a circle of parents."))
        for link in reversed(chain):
            state[link] = 2
            order.append(link)
    return order


def _check(indices: NDArray[np.int64], limit: int, what: str) -> None:
    if len(indices) and int(indices.max()) >= limit:
        raise PlanError(
            told(
                "The file's {what} leads to number {max} of {limit}, which does not exist.",
                what=what,
                max=int(indices.max()),
                limit=limit,
            )
        )


def _check_finite(values: NDArray[np.float32], what: str) -> None:
    if not np.isfinite(values).all():
        raise PlanError(told("The file's {what} are not all finite numbers.", what=what))


def _plan_mesh(
    dna: DnaData,
    index: int,
    label: str,
    lods: tuple[int, ...],
    space: Space,
) -> MeshPlan:
    mesh = dna.meshes[index]
    name = dna.mesh_names[index]
    _check_finite(mesh.positions, f"positions of mesh {name}")
    _check_finite(mesh.skin_weights, f"skin weights of mesh {name}")
    for target in mesh.blend_shape_targets:
        _check_finite(target.deltas, f"shapes of mesh {name}")
    layouts = np.asarray(mesh.layout_positions, np.int64)
    vertex_count = len(mesh.positions)
    _check(layouts, vertex_count, f"layout of mesh {name}")
    starts, corner_layouts = _faces(mesh, layouts, space.flip_faces)
    _check(corner_layouts, len(layouts), f"faces of mesh {name}")
    joints = np.asarray(mesh.skin_joint_indices, np.int64)
    _check(joints, len(dna.joint_names), f"skin of mesh {name}")
    offsets = np.asarray(mesh.skin_offsets, np.int64)
    if len(offsets) != vertex_count + 1:
        offsets = np.zeros(vertex_count + 1, np.int64)
    channels = [int(t.blend_shape_channel_index) for t in mesh.blend_shape_targets]
    _check(
        np.array(channels, np.int64), len(dna.blend_shape_channel_names), f"shapes of mesh {name}"
    )
    normals = _corner_values(mesh.normals, mesh.layout_normals, corner_layouts)
    return MeshPlan(
        index=index,
        label=label,
        base=names.without_lod(name),
        kind=kind_of(name),
        lods=lods,
        positions=np.ascontiguousarray(space.points(mesh.positions), np.float32),
        face_starts=starts,
        corners=layouts[corner_layouts].astype(np.int32),
        uvs=_corner_values(
            mesh.texture_coordinates, mesh.layout_texture_coordinates, corner_layouts
        ),
        normals=None
        if normals is None
        else np.ascontiguousarray(space.directions(normals), np.float32),
        skin_offsets=offsets,
        skin_joints=joints,
        skin_weights=np.asarray(mesh.skin_weights, np.float32),
        channels=channels,
    )


def _faces(
    mesh: MeshData, layouts: NDArray[np.int64], flip: bool
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """First corner of each face, int32[F], and layout of each corner, int64[N].

    Faces with fewer than 3 corners or a repeated vertex are left out.

    Args:
        mesh: the mesh in the DNA file.
        layouts: int64[L], vertex of each layout.
        flip: True: reverse the order of the corners of each face.
    """
    bounds = np.asarray(mesh.face_offsets, np.int64)
    flat = np.asarray(mesh.face_layouts, np.int64)
    _check(flat, len(layouts), "faces")
    kept: list[NDArray[np.int64]] = []
    for begin, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        face = flat[begin:end]
        vertices = layouts[face].tolist()
        if len(face) >= 3 and len(set(vertices)) == len(vertices):
            kept.append(face[::-1] if flip else face)
    sizes = np.array([len(f) for f in kept], np.int64)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]) if kept else np.zeros(0)
    corners = np.concatenate(kept) if kept else np.zeros(0, np.int64)
    return starts.astype(np.int32), corners


def _corner_values(
    values: NDArray[np.float32], layout: NDArray[np.uint32], corners: NDArray[np.int64]
) -> NDArray[np.float32] | None:
    """Values of the face corners, float32[N, n]; numbers that are not finite become 0.

    Args:
        values: float32[values, n], UV coordinates or normals.
        layout: index of the value of each layout.
        corners: layout of each of the N corners.

    Returns:
        None if there are no values or no corners, or if an index is too large.
    """
    if not len(values) or not len(corners) or int(corners.max()) >= len(layout):
        return None
    indices = np.asarray(layout, np.int64)[corners]
    if int(indices.max()) >= len(values):
        return None
    found = np.ascontiguousarray(np.asarray(values)[indices], np.float32)
    return np.nan_to_num(found, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
