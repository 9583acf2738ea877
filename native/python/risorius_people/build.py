# SPDX-License-Identifier: MIT
"""Build a sample person: CC0 head and 52 units -> blend shape face -> joint face.

The passes in `_PASSES` run one after the other; each changes the same `_Making`.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from risorius import Dna, Mesh
from risorius.author import FitOptions, Progress, RigOptions, find_reference, make_joint_rig
from risorius.author.correctives import (
    CorrectiveOptions,
    add_correctives,
    correct_again,
    find_correctives,
)
from risorius.author.levels import level_name
from risorius.author.lighter import within_deltas
from risorius.base import blas
from risorius.files import fileio

from . import references
from .askew import askew, set_askew
from .blend_shape_face import CM, FLUSH, assemble
from .body import Body
from .further import CONTROLS_OF_CODE
from .hair import Grown, add_hair, grow_hair, hair_metadata, hair_picture
from .paint.skin import HEAD_SIZE
from .paint.textures import paint_textures
from .part import Part
from .people import MAN, Person
from .polygons import Floats
from .source import PACKAGE, SHA256, Fetched, Source, SourceError, fetch

NEW_JOINTS = 250
DELTA_STEP = 2.0**-10  # centimetres: 10 micrometres, so the rounding error is 5
WEIGHTS = 4096  # a skin weight is a multiple of 1 / WEIGHTS
NO_WRINKLES = 4  # the first LOD without wrinkles
_FIT_BEGINS = 0.2  # as a share of the whole time
_SEARCH_ENDS = 0.4
_REFIT_BEGINS = 0.7
_AGAIN_BEGINS = 0.75
RIG = RigOptions(
    FitOptions(joints=NEW_JOINTS),
    kept=("eyeLeft", "eyeRight"),
    between=False,
)
NO_SEARCH = CorrectiveOptions(most=0)
METADATA = {
    "licence": "CC0-1.0",
    "origin": "MakeHuman community base mesh and targets; Face Units pack by Mika Suominen",
    "source": PACKAGE,
    "source_sha256": SHA256,
    "generator": "risorius sample build",
}


def leave_maps(dna: Dna) -> None:
    """Keep only the flush maps on coarse LODs, which show no wrinkles.

    Args:
        dna: is changed; its animated maps and their conditionals begin with the flush maps.
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


def rounded(values: Floats, step: float) -> Floats:
    """`values` rounded to multiples of a step, float64.

    Args:
        values: values of any shape.
        step: above 0.
    """
    return np.round(np.asarray(values, np.float64) / step) * step


def even_weights(mesh: Mesh) -> None:
    """Round skin weights to multiples of 1 / 4096 with sum 1; the largest weight takes the rest.

    Args:
        mesh: is changed.
    """
    offsets = np.asarray(mesh.skin_offsets, np.int64)
    shares = np.round(np.asarray(mesh.skin_weights, np.float64) * WEIGHTS)
    vertex = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    over = WEIGHTS - np.bincount(vertex, shares, minlength=len(offsets) - 1)
    # Sorted by vertex and weight, the last entry of a vertex is its largest weight.
    order = np.lexsort((shares, vertex))
    last = order[np.flatnonzero(np.diff(vertex[order], append=-1) != 0)]
    shares[last] += over[vertex[last]]
    mesh.skin_weights = shares / WEIGHTS


def round_numbers(dna: Dna) -> None:
    """Round all numbers to small steps, far below visible errors: the file packs to two thirds.

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
        # centimetres; degrees get the same step.
        group.values = rounded(group.values, DELTA_STEP / 2)
    dna.joint_groups = groups


class Steps:
    """Reports the progress of the build and stops it if the user wants that."""

    def __init__(self, say: Callable[[str], None], progress: Progress | None) -> None:
        self.say = say
        self._progress = progress

    def at(self, share: float, line: str = "") -> None:
        """Report progress. Raises SourceError "stopped" if the progress callback returned False.

        Args:
            share: share of the whole work that is done, 0 to 1.
            line: a sentence for `say`; empty: none.
        """
        if line:
            self.say(line)
        if self._progress is not None and self._progress(share) is False:
            raise SourceError("stopped")

    def share_of(self, begin: float, end: float) -> Progress:
        """A progress callback for one part of the work, which takes 0 to 1.

        Args:
            begin: share of the whole at the part's begin.
            end: share of the whole at its end.
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
    """The face with correctives for the errors of combined expressions.

    Args:
        dna: the blend shape face; is not changed.
        options: number of correctives; with most 0 and together 0 the face is returned as it is.
        steps: gets the progress.
    """
    if not options.most and not options.together:
        return dna
    steps.at(_FIT_BEGINS, "searching for errors of combined expressions")
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
    """The face with joints in place of most of its blend shapes, and with coarser LODs.

    The joints are fitted once, on the man; every other person's joints learn that person's motions
    at the same places. The joints of RIG ship with the package; others are fitted here and kept in
    the user's cache.

    Args:
        dna: the blend shape face.
        man: makes the man's blend shape face; None: `dna` is the man's.
        options: number of joints, and the share that blend shapes keep.
        steps: gets the progress.
        begins: share of the work done before.
        ends: share of the work done after.
    """
    joints = options.fit.joints
    like = references.shipped() if options == RIG else references.kept(options)
    if like is None and man is None:
        steps.at(begins, f"fitting {joints} joints, weights and LODs")
        rig = make_joint_rig(dna, options, steps.share_of(begins, ends))
        references.keep(options, rig.reference)
        return rig.dna
    if like is None and man is not None:
        steps.at(begins, f"fitting the {joints} joints of all people (once)")
        like = find_reference(man(), options, steps.share_of(begins, _REFIT_BEGINS))
        begins = _REFIT_BEGINS
        references.keep(options, like)
    steps.at(begins, f"fitting the motions of {joints} joints")
    return make_joint_rig(dna, options, steps.share_of(begins, ends), like).dna


def textures_of_levels(dna: Dna, metadata: dict[str, str]) -> dict[str, str]:
    """Texture metadata with entries for the meshes of all LODs.

    Args:
        dna: has the meshes.
        metadata: entries for the meshes of LOD 0 and 1.
    """
    out = dict(metadata)
    for key, value in metadata.items():
        kind, mesh, role = key.split(":", 2)
        for lod in range(2, dna.lod_count):
            if level_name(mesh, lod) in dna.mesh_names:
                out[f"{kind}:{level_name(mesh, lod)}:{role}"] = value
    return out


class _Painted(NamedTuple):
    """The textures of a person, and the hair."""

    textures: dict[str, bytes]
    metadata: dict[str, str]
    hair: Grown
    hair_pictures: dict[str, bytes]


@dataclass
class _Making:
    """A person while the passes build it."""

    source: Source
    person: Person
    rig: RigOptions | None
    correctives: CorrectiveOptions
    texture_size: int
    steps: Steps
    dna: Dna = field(default_factory=Dna)  # the result
    shapes: Dna = field(default_factory=Dna)  # the blend shape face
    found: bool = False  # whether the search found correctives beyond the ones of all people
    textures: dict[str, bytes] = field(default_factory=dict)  # by file name

    parts: list[Part] = field(init=False)  # the meshes of the face
    body: Body = field(init=False)
    asymmetry: Floats = field(init=False)
    painting: Future[_Painted] = field(init=False)  # runs in parallel to the passes

    @property
    def searches(self) -> bool:
        """Whether to search for correctives beyond the ones of all people."""
        return bool(self.correctives.most or self.correctives.together)

    @property
    def corrects_again(self) -> bool:
        """Whether correctives were found and blend shapes keep the rest that joints cannot do."""
        return self.found and self.rig is not None and self.rig.shapes


def _assemble(making: _Making) -> None:
    """Make the blend shape face."""
    making.shapes, making.parts, making.body = assemble(
        making.source, making.steps.say, making.person
    )
    making.dna = making.shapes
    making.asymmetry = askew(making.source, making.body, making.person)


def _begin_painting(making: _Making) -> None:
    """Start painting textures and growing hair on a thread; the native fits release the GIL.

    If the build stops, the thread runs to its end and its result is dropped.
    """
    making.steps.at(0.08, "painting textures")
    painter = ThreadPoolExecutor(1)
    making.painting = painter.submit(_paint, making)
    painter.shutdown(wait=False)


def _paint(making: _Making) -> _Painted:
    """Paint textures and grow hair; reads the assembled face and changes nothing."""
    person, parts, size = making.person, making.parts, making.texture_size
    even = making.body.man.positions  # all people have hair at the same places of the man's head
    own = making.body.moved(making.asymmetry)
    units = making.body.man.units
    textures, metadata = paint_textures(person, even, own.positions, units, parts, size)
    hair = grow_hair(person, own, even, making.source.base_mesh(), parts, CM)
    return _Painted(textures, metadata, hair, hair_picture(person, size))


def _search_correctives(making: _Making) -> None:
    """Search before the joints are fitted, because the joints must fit the correctives too."""
    making.dna = search_correctives(making.shapes, making.correctives, making.steps)
    making.found = making.dna.psd_count > making.shapes.psd_count


def _fit_joints(making: _Making) -> None:
    """Put joints in place of most blend shapes and add the coarser LODs."""
    if making.rig is None:
        return
    body, source = making.body, making.source
    man = None if body.man is body else lambda: assemble(source, lambda _: None)[0]
    begins = _SEARCH_ENDS if making.searches else _FIT_BEGINS
    ends = _AGAIN_BEGINS if making.corrects_again else 1.0
    making.dna = joint_face(making.dna, man, making.rig, making.steps, begins, ends)


def _correct_again(making: _Making) -> None:
    """Search again after the fit: errors of joints and shapes add up in combined expressions."""
    if not making.corrects_again:
        return
    making.steps.at(_AGAIN_BEGINS, "searching again for errors of joints and shapes together")
    tell = making.steps.share_of(_AGAIN_BEGINS, 1.0)
    making.dna = correct_again(making.dna, making.shapes, making.correctives, tell)
    making.dna = within_deltas(making.dna, making.shapes).dna


def _make_askew(making: _Making) -> None:
    """Add the asymmetry after all passes that need a symmetric face (fits and search mirror)."""
    set_askew(making.dna, making.parts, making.asymmetry, CM)


def _add_pictures(making: _Making) -> None:
    """Add textures, hair and metadata, also for the LODs that the joint fit added."""
    painted = making.painting.result()
    add_hair(making.dna, painted.hair)
    textures = textures_of_levels(making.dna, painted.metadata)
    by_code = {"controls_by_code": " ".join(CONTROLS_OF_CODE)}
    hair = hair_metadata(making.dna, painted.hair, making.person)
    making.dna.metadata = METADATA | by_code | textures | hair
    making.textures = painted.textures | painted.hair_pictures


_PASSES: tuple[Callable[[_Making], None], ...] = (
    _assemble,
    _begin_painting,
    _search_correctives,
    _fit_joints,
    _correct_again,
    _make_askew,
    _add_pictures,
    lambda making: leave_maps(making.dna),
    lambda making: round_numbers(making.dna),
)


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
        person: the person to build.
        rig: options of the joint fit; None: blend shapes alone, two LODs.
        correctives: options of the search for correctives beyond the ones of all people.
        data: path of the data wheel; None: fetch it.
        offline: do not download.
        texture_size: each texture has at most texture_size * texture_size texels.
        say: gets a line per step.
        progress: gets the share of the work that is done, 0 to 1; return False to stop.
        fetched: gets the number of bytes fetched so far; return False to stop.

    Raises:
        SourceError: the data are not available, or progress or fetched returned False.
        OSError: a file cannot be written; every file then keeps its old content.
    """
    fileio.check_writable(path)
    steps = Steps(say, progress)
    steps.at(0.0, f"data: {PACKAGE} (48 MB, CC0), from the cache or the package index")
    source = Source(data or fetch(offline, fetched))
    with blas.one_thread():
        made = _Making(source, person, rig, correctives, texture_size, steps)
        for each in _PASSES:
            each(made)
    folder = path.with_name(path.stem + "_textures")
    files = {folder / name: data for name, data in made.textures.items()}
    fileio.write_all({path: made.dna.to_bytes()} | files)
    return made.dna
