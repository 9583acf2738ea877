# SPDX-License-Identifier: MIT
"""Makes a sample person as a blend shape face: meshes, skeleton, controls and correctives."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from risorius import (
    AnimatedMaps,
    BlendShapeChannels,
    BlendShapeTarget,
    Conditionals,
    Dna,
    JointGroup,
    Mesh,
    Psds,
)
from risorius.author.geometry.polygon_mesh import polygon_mesh, vertex_normals

from . import expressions as ex
from . import wrinkles
from .body import JOINTS, NECK_CUT, NECK_SLOPE, REACH, Body
from .clothes import shirt
from .controls import gui_table
from .eyes import eye_parts, with_eyeballs
from .mouth.teeth import mouth_parts
from .mouth.tongue import over_lip
from .paint.layout import packed
from .part import Part
from .people import MAN, Person
from .polygons import (
    Floats,
    Ints,
    Polygons,
    clip_below,
    compact_uvs,
    subdivide,
)
from .source import BaseMesh, Source

CM = 10.0  # centimetres per decimetre: the data are in decimetres
FLUSH = ("head_flush_L", "head_flush_R")
PARTS = {  # mesh -> (groups of the base mesh, subdivisions at LOD 0, subdivisions at LOD 1)
    "head": (["body"], 1, 0),
    "tongue": (["helper-tongue"], 1, 0),
}


def make_parts(base: BaseMesh, groups: dict[str, Ints]) -> list[Part]:
    """Makes all meshes of both LODs.

    Args:
        base: the base mesh with its eyeballs.
        groups: name of a group of the base mesh -> vertex indices.
    """
    count = len(base.positions)
    out = []
    for lod in (0, 1):
        for name, (own, *levels) in PARTS.items():
            corners = [
                face
                for group in own
                for face in base.faces[group]
                if abs(base.positions[face[0][0], 0]) < REACH
            ]
            polygons = Polygons(
                [[c[0] for c in face] for face in corners],
                [[c[1] for c in face] for face in corners],
                base.uvs,
                count,
            )
            # The cut at the neck drops the body below it; the tongue is above the cut.
            aside = np.hypot(base.positions[:, 0], 0.35)  # makes the cut round in front
            height = base.positions[:, 1] - NECK_SLOPE * aside
            polygons, operator = clip_below(polygons, height, NECK_CUT)
            if name == "head":
                polygons.uvs = packed(polygons)
            part = Part(f"{name}_lod{lod}_mesh", compact_uvs(polygons), [operator])
            for _ in range(levels[lod]):
                part.polygons, operator = subdivide(part.polygons)
                part.operators.append(operator)
            out.append(part)
        out += mouth_parts(base, lod)
        out.append(shirt(base, lod))
        out += eye_parts(base, groups, lod)
    return out


def bind_displacement(
    positions: Floats, weights: Floats, expression: ex.Expression, joints: dict[str, Floats]
) -> Floats:
    """The blend shape delta of an expression whose joints move as well.

    The delta is added before skinning. After the joints have moved, each vertex is displaced by
    exactly the expression's displacement.

    Args:
        positions: float64[v, 3], neutral positions in decimetres.
        weights: float64[v, 9], skin weights of the vertices.
        expression: displacements of the same vertices, and the motions of its joints.
        joints: name of a joint -> float64[3], its position in decimetres.

    Returns:
        float64[v, 3], delta in decimetres.
    """
    if not expression.joints:
        return expression.displacement
    matrices = np.tile(np.eye(3), (len(positions), 1, 1))
    offsets = np.zeros_like(positions)
    for name, (rotation, shift) in expression.joints.items():
        w = weights[:, [k for k, (own, above) in enumerate(JOINTS) if name in (own, above)]]
        w = w.sum(axis=1)  # a joint also moves the vertices of its children
        matrices += w[:, None, None] * (rotation - np.eye(3))
        offsets += w[:, None] * (joints[name] + shift - rotation @ joints[name])
    wanted: Floats = positions + expression.displacement - offsets
    return np.linalg.solve(matrices, wanted[:, :, None])[:, :, 0] - positions


def euler_xyz(rotation: Floats) -> Floats:
    """float64[3]: the rotations about x, y and z, in degrees, whose matrix is Rz @ Ry @ Rx."""
    return np.degrees(
        [
            np.arctan2(rotation[2, 1], rotation[2, 2]),
            -np.arcsin(np.clip(rotation[2, 0], -1, 1)),
            np.arctan2(rotation[1, 0], rotation[0, 0]),
        ]
    )


def add_skin(mesh: Mesh, weights: Floats) -> None:
    """Adds skin weights to a mesh.

    Weights of 0.001 or less are left out; the others are scaled so that they sum to 1.

    Args:
        mesh: the mesh; changed.
        weights: float64[v, 9], a column for each of the nine JOINTS.
    """
    kept = np.where(weights > 1e-3, weights, 0)
    kept /= kept.sum(axis=1, keepdims=True)
    vertex, joint = np.nonzero(kept)
    mesh.skin_offsets = np.concatenate([[0], np.cumsum((kept > 0).sum(axis=1))])
    mesh.skin_weights = kept[vertex, joint]
    mesh.skin_joint_indices = joint
    mesh.maximum_influence_per_vertex = int((kept > 0).sum(axis=1).max())


def make_mesh(part: Part, positions: Floats, weights: Floats) -> Mesh:
    """The geometry and skin weights of a part as a mesh in centimetres.

    Args:
        part: the polygons, and the operators that compute their vertices from the base mesh.
        positions: float64[V, 3], all vertices of the base mesh, in decimetres.
        weights: float64[v, 9], skin weights of the part's vertices.
    """
    p = part.carry(positions)
    polygons = part.polygons
    uvs, uv_faces = polygons.uvs, polygons.uv_faces
    normals = vertex_normals(p, polygons.faces)
    mesh = polygon_mesh(p * CM, normals, polygons.faces, uvs, uv_faces)
    add_skin(mesh, weights)
    return mesh


def add_definition(
    dna: Dna,
    person: Person,
    parts: list[Part],
    joints: dict[str, Floats],
    raw: list[str],
    channels: list[str],
) -> None:
    """Fills the layers descriptor and definition: names, the skeleton, the indices for each LOD.

    Args:
        dna: the face; changed.
        person: the person, with name, gender and age.
        parts: the meshes; LOD 0 comes first.
        joints: name of a joint -> float64[3], its position in decimetres.
        raw: names of the raw controls without their prefix.
        channels: names of the blend shape channels.
    """
    names = [name for name, _ in JOINTS]
    dna.name = person.name
    dna.archetype, dna.gender, dna.age = "other", person.gender, person.age
    dna.coordinate_system = ("right", "up", "front")
    dna.lod_count = 2
    dna.complexity, dna.db_name = "sample", "risorius"
    dna.joint_names = names
    dna.joint_parents = [names.index(parent) if parent else 0 for _, parent in JOINTS]
    world = np.array([joints[name] for name in names]) * CM
    local = world - np.where(
        np.arange(len(names))[:, None] == 0, 0, world[np.asarray(dna.joint_parents)]
    )
    dna.neutral_joint_translations = local
    dna.neutral_joint_rotations = np.zeros_like(local)
    dna.raw_control_names = [ex.PREFIX + name for name in raw]
    dna.blend_shape_channel_names = channels
    dna.animated_map_names = [*FLUSH, *wrinkles.map_names()]
    dna.mesh_names = [part.name for part in parts]
    half = len(parts) // 2
    dna.lod_mesh_mapping = [range(half), range(half, len(parts))]
    dna.lod_joint_mapping = [range(len(names))] * 2
    dna.lod_blend_shape_mapping = [range(len(channels))] * 2
    dna.lod_animated_map_mapping = [range(len(dna.animated_map_names))] * 2


def add_gui(dna: Dna, raw: list[str]) -> None:
    """Fills the GUI controls and the table that maps them to raw controls.

    Args:
        dna: the face; changed.
        raw: names of the raw controls without their prefix.
    """
    table = gui_table()
    dna.gui_control_names = [gui for gui, _ in table]
    rows = [
        (g, raw.index(name), *where) for g, (_, leads) in enumerate(table) for name, where in leads
    ]
    dna.gui_to_raw = conditionals(rows)


def conditionals(rows: Sequence[tuple[int, int, float, float, float, float]]) -> Conditionals:
    columns = list(zip(*rows, strict=True))
    return Conditionals(
        input_indices=columns[0],
        output_indices=columns[1],
        from_values=np.array(columns[2], np.float32),
        to_values=np.array(columns[3], np.float32),
        slope_values=np.array(columns[4], np.float32),
        cut_values=np.array(columns[5], np.float32),
    )


def add_behavior(
    dna: Dna,
    raw: list[str],
    units: dict[str, ex.Expression],
    correctives: list[tuple[str, ...]],
) -> None:
    """Fills the correctives, joint groups, blend shape channels and animated maps.

    Args:
        dna: the face; changed.
        raw: names of the raw controls without their prefix.
        units: raw control -> its expression.
        correctives: the raw controls of each corrective.
    """
    names = [name for name, _ in JOINTS]
    dna.psd_count = len(correctives)
    dna.psds = Psds(
        rows=[len(raw) + i for i, names in enumerate(correctives) for _ in names],
        columns=[raw.index(name) for names in correctives for name in names],
        values=np.ones(sum(map(len, correctives)), np.float32),
    )
    groups = []
    for joint in (name for name in names if name.startswith("FACIAL_")):
        inputs = [name for name in raw if joint in units[name].joints]
        values = np.zeros((6, len(inputs)), np.float32)
        for column, name in enumerate(inputs):
            rotation, shift = units[name].joints[joint]
            values[:3, column] = shift * CM
            values[3:, column] = euler_xyz(rotation)
        used = np.flatnonzero(np.abs(values).max(axis=1) > 1e-4)
        index = names.index(joint)
        groups.append(
            JointGroup(
                lods=[len(used)] * 2,
                input_indices=[raw.index(name) for name in inputs],
                output_indices=index * 9 + used,
                values=values[used],
                joint_indices=[index],
            )
        )
    dna.joint_groups = groups
    dna.joint_row_count = 9 * len(names)
    dna.joint_column_count = len(raw) + len(correctives)
    count = len(raw) + len(correctives)
    dna.blend_shape_channels = BlendShapeChannels(
        lods=[count] * 2, input_indices=range(count), output_indices=range(count)
    )
    maps = []
    for output, side in enumerate("LR"):
        for name, slope in (
            ("mouthCornerPull", 0.25),
            ("eyeCheekRaise", 0.2),
            ("mouthCheekBlow", 0.35),
        ):
            maps.append((raw.index(name + side), output, 0, 1, slope, 0))
        maps.append((raw.index("jawOpenExtreme"), output, 0, 1, 0.35, 0))
    for name, number, slope in wrinkles.drivers():
        maps.append((raw.index(name), len(FLUSH) + number, 0, 1, slope, 0))
    dna.animated_maps = AnimatedMaps(lods=[len(maps)] * 2, conditionals=conditionals(maps))


def add_targets(mesh: Mesh, deltas: list[Floats]) -> None:
    """Adds a blend shape target for each channel that moves a vertex by more than 0.01 mm.

    Args:
        mesh: the mesh; changed.
        deltas: float64[v, 3] per channel, in decimetres.
    """
    targets = []
    for channel, delta in enumerate(deltas):
        moved = np.flatnonzero(np.abs(delta).max(axis=1) > 1e-4)
        if len(moved):
            targets.append(
                BlendShapeTarget(
                    deltas=delta[moved] * CM,
                    vertex_indices=moved,
                    blend_shape_channel_index=channel,
                )
            )
    mesh.blend_shape_targets = targets


def assemble(
    source: Source, say: Callable[[str], None], person: Person = MAN
) -> tuple[Dna, list[Part], Body]:
    """Makes the blend shape face of a person; returns it with its parts and the person's body.

    Args:
        source: the data of the sample people.
        say: called with a line of text per step.
        person: the person to make.
    """
    base = with_eyeballs(source.base_mesh())
    say("reading 52 ARKit units and further units")
    body = Body(source, base, person)
    positions, joints, units = body.positions, body.joints, body.units
    places = body.man.positions - [0, *body.man.joints["FACIAL_L_Eye"][1:]]
    correctives: dict[tuple[str, ...], Floats] = {}
    ways = {name: unit.displacement for name, unit in units.items()}
    tongue = over_lip(ways, positions, body.groups["helper-tongue"], body.lip_rim)
    for found in (
        ex.corrective_displacements(units, places), body.closing, body.eye_correctives, tongue
    ):  # fmt: skip
        correctives |= {tuple(pair): way for pair, way in found.items()}
    # The corrective of CLOSED (jaw open, lips together) has no displacements here. It exists for
    # the joint fit, because the joint rotations of its controls do not add up.
    correctives[ex.CLOSED] = np.zeros_like(positions)
    raw = list(units)
    pairs = list(correctives)
    channels = raw + ["_x_".join(pair) for pair in pairs]
    say(f"{len(raw)} raw controls, {len(pairs)} correctives; meshes and LODs")
    parts = make_parts(base, body.groups)
    weights = body.weights
    dna = Dna()
    add_definition(dna, person, parts, joints, raw, channels)
    add_gui(dna, raw)
    add_behavior(dna, raw, units, pairs)
    meshes, mapping = [], []
    for number, part in enumerate(parts):
        p, w = part.carry(positions), part.carry(weights)
        mesh = make_mesh(part, positions, w)
        if not part.rests:
            deltas = []
            for name, unit in units.items():
                whole = unit.displacement - correctives.get((name, name), 0.0)
                here = ex.Expression(part.carry(whole), unit.joints)
                deltas.append(bind_displacement(p, w, here, joints))
            jaw = raw.index("jawOpen")
            for pair, way in correctives.items():
                delta = part.carry(way)
                if pair in body.closing:  # corrected, so that the jaw joint does not rotate it
                    open_jaw = units["jawOpen"]
                    both = ex.Expression(part.carry(open_jaw.displacement) + delta, open_jaw.joints)
                    delta = bind_displacement(p, w, both, joints) - deltas[jaw]
                deltas.append(delta)
            add_targets(mesh, deltas)
        mapping += [(number, t.blend_shape_channel_index) for t in mesh.blend_shape_targets]
        meshes.append(mesh)
    dna.meshes = meshes
    dna.mesh_blend_shape_channel_mapping = np.array(mapping)
    return dna, parts, body
