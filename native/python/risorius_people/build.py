# SPDX-License-Identifier: MIT
"""Builds a sample person: CC0 head and 52 ARKit units -> blend shape face -> joint face.

The functions in `_PASSES` run one after the other; each changes the same `_Making`.
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
# Step of coordinates in centimetres: about 10 micrometres, so that rounding errors are at most 5
# micrometres.
DELTA_STEP = 2.0**-10
WEIGHTS = 4096  # skin weights are multiples of 1 / WEIGHTS
NO_WRINKLES = 4  # number of the first LOD without wrinkles
# progress, as a fraction of the whole work, at which the fit of the joints begins
_FIT_BEGINS = 0.2
_SEARCH_ENDS = 0.4  # likewise, at which the search for correctives ends
_REFIT_BEGINS = 0.7  # likewise, at which this person's motions are fitted after the man's joints
_AGAIN_BEGINS = 0.75  # likewise, at which the second search for correctives begins
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
    """Removes wrinkle maps from LOD 4 and coarser LODs; only the maps of flushed skin stay there.

    Args:
        dna: the face; changed. Its list of animated maps begins with the flush maps, and so does
            the table of their conditionals.
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
    """float64: `values` rounded to multiples of a step.

    Args:
        values: values of any shape.
        step: the step, above 0.
    """
    return np.round(np.asarray(values, np.float64) / step) * step


def even_weights(mesh: Mesh) -> None:
    """Rounds skin weights to multiples of 1 / 4096.

    The largest weight of each vertex absorbs the rounding errors, so that its weights sum to 1.

    Args:
        mesh: the mesh; changed.
    """
    offsets = np.asarray(mesh.skin_offsets, np.int64)
    shares = np.round(np.asarray(mesh.skin_weights, np.float64) * WEIGHTS)
    vertex = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    over = WEIGHTS - np.bincount(vertex, shares, minlength=len(offsets) - 1)
    # Sorted by vertex, then by weight, the last entry of a vertex is its largest weight.
    order = np.lexsort((shares, vertex))
    last = order[np.flatnonzero(np.diff(vertex[order], append=-1) != 0)]
    shares[last] += over[vertex[last]]
    mesh.skin_weights = shares / WEIGHTS


def round_numbers(dna: Dna) -> None:
    """Rounds coordinates, weights and motions, so that the file compresses to 2/3 of its size.

    The rounding errors are too small to be visible.

    Args:
        dna: the face; meshes and joint groups are changed.
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
        # the step is in centimetres for translations, and in degrees for rotations
        group.values = rounded(group.values, DELTA_STEP / 2)
    dna.joint_groups = groups


class Steps:
    """Reports the progress of the build, and stops the build if a callback returns False."""

    def __init__(self, say: Callable[[str], None], progress: Progress | None) -> None:
        self.say = say
        self._progress = progress

    def at(self, share: float, line: str = "") -> None:
        """Reports progress.

        Raises SourceError "stopped" if the progress callback returned False.

        Args:
            share: fraction of the whole work done, 0 to 1.
            line: a line of text for `say`, or "".
        """
        if line:
            self.say(line)
        if self._progress is not None and self._progress(share) is False:
            raise SourceError("stopped")

    def share_of(self, begin: float, end: float) -> Progress:
        """A progress callback for a part of the work, called with the done fraction of this part.

        The callback also says a percentage whenever at least a quarter of the part was done since
        the last percentage.

        Args:
            begin: fraction of the whole work at the beginning of the part.
            end: fraction of the whole work at the end of the part.
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
    """Adds correctives for the errors of combined expressions.

    Args:
        dna: the blend shape face; not changed.
        options: limits of the search; with `most` 0 and `together` 0 the face is returned
            unchanged.
        steps: reports the progress.
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
    """Replaces most blend shapes of a face by joints, and adds coarser LODs.

    The joints are fitted once, on the man; for every other person only the joints' motions are
    fitted, with the joints at the same vertices. The package contains the man's joints for the
    options RIG; for other options they are fitted here once and stored in the user's cache.

    Args:
        dna: the blend shape face.
        man: makes the man's blend shape face; None: `dna` is the man's face.
        options: number of joints, the errors that blend shapes correct, and the LODs.
        steps: reports the progress.
        begins: fraction of the whole work that is done before this function begins.
        ends: fraction of the whole work that is done when this function returns.
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
    """Texture metadata, extended to the meshes of all LODs.

    Args:
        dna: the face with its meshes.
        metadata: entries for the meshes of LODs 0 and 1.
    """
    out = dict(metadata)
    for key, value in metadata.items():
        kind, mesh, role = key.split(":", 2)
        for lod in range(2, dna.lod_count):
            if level_name(mesh, lod) in dna.mesh_names:
                out[f"{kind}:{level_name(mesh, lod)}:{role}"] = value
    return out


class _Painted(NamedTuple):
    """The textures of a person, their metadata, and the hair."""

    textures: dict[str, bytes]
    metadata: dict[str, str]
    hair: Grown
    hair_pictures: dict[str, bytes]


@dataclass
class _Making:
    """The state of a person during the build, which the passes change."""

    source: Source
    person: Person
    rig: RigOptions | None
    correctives: CorrectiveOptions
    texture_size: int
    steps: Steps
    dna: Dna = field(default_factory=Dna)  # the face that becomes the result
    shapes: Dna = field(default_factory=Dna)  # the symmetric blend shape face
    found: bool = False  # whether the search found correctives
    textures: dict[str, bytes] = field(default_factory=dict)  # file name -> content

    parts: list[Part] = field(init=False)  # the meshes made from the base mesh
    body: Body = field(init=False)
    asymmetry: Floats = field(init=False)
    painting: Future[_Painted] = field(init=False)  # runs in parallel with the passes

    @property
    def searches(self) -> bool:
        """Whether to search for correctives in addition to the built-in ones."""
        return bool(self.correctives.most or self.correctives.together)

    @property
    def corrects_again(self) -> bool:
        """Whether to search again after the joint fit: the first search found correctives, and the
        joint face has blend shapes."""
        return self.found and self.rig is not None and self.rig.shapes


def _assemble(making: _Making) -> None:
    """Makes the blend shape face."""
    making.shapes, making.parts, making.body = assemble(
        making.source, making.steps.say, making.person
    )
    making.dna = making.shapes
    making.asymmetry = askew(making.source, making.body, making.person)


def _begin_painting(making: _Making) -> None:
    """Starts to paint textures and grow hair in a thread, parallel to fits, which release the GIL.

    If the build stops, the thread still runs to its end, and its result is dropped.
    """
    making.steps.at(0.08, "painting textures")
    painter = ThreadPoolExecutor(1)
    making.painting = painter.submit(_paint, making)
    painter.shutdown(wait=False)


def _paint(making: _Making) -> _Painted:
    """Paints textures and grows hair; it only reads the assembled face."""
    person, parts, size = making.person, making.parts, making.texture_size
    # Hair grows from vertices that are chosen on the man's head; they are the same for all people.
    even = making.body.man.positions
    own = making.body.moved(making.asymmetry)
    units = making.body.man.units
    textures, metadata = paint_textures(person, even, own.positions, units, parts, size)
    hair = grow_hair(person, own, even, making.source.base_mesh(), parts, CM)
    return _Painted(textures, metadata, hair, hair_picture(person, size))


def _search_correctives(making: _Making) -> None:
    """Searches for correctives before the joints are fitted, because the joints must fit them,
    too."""
    making.dna = search_correctives(making.shapes, making.correctives, making.steps)
    making.found = making.dna.psd_count > making.shapes.psd_count


def _fit_joints(making: _Making) -> None:
    """Replaces most blend shapes by joints, and adds the coarser LODs."""
    if making.rig is None:
        return
    body, source = making.body, making.source
    man = None if body.man is body else lambda: assemble(source, lambda _: None)[0]
    begins = _SEARCH_ENDS if making.searches else _FIT_BEGINS
    ends = _AGAIN_BEGINS if making.corrects_again else 1.0
    making.dna = joint_face(making.dna, man, making.rig, making.steps, begins, ends)


def _correct_again(making: _Making) -> None:
    """Searches for correctives again after the joint fit, because the errors of joints and of blend
    shapes add up in combined expressions."""
    if not making.corrects_again:
        return
    making.steps.at(_AGAIN_BEGINS, "searching again for errors of joints and shapes together")
    tell = making.steps.share_of(_AGAIN_BEGINS, 1.0)
    making.dna = correct_again(making.dna, making.shapes, making.correctives, tell)
    making.dna = within_deltas(making.dna, making.shapes).dna


def _make_askew(making: _Making) -> None:
    """Adds the asymmetry last, because the fits and the search assume a symmetric face."""
    set_askew(making.dna, making.parts, making.asymmetry, CM)


def _add_pictures(making: _Making) -> None:
    """Adds textures, hair and metadata, also to the LODs that the joint fit added."""
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
    """Builds a sample person, and writes it with its textures.

    Args:
        path: path of the DNA file; the textures are written to the folder <stem>_textures beside
            it.
        person: the person to build.
        rig: options of the joint fit; None: blend shapes only, with two LODs.
        correctives: options of the search for correctives in addition to the built-in ones.
        data: path of the data wheel; None: it is taken from the cache, or downloaded.
        offline: whether to use only cached data.
        texture_size: a texture has at most as many texels as a square with this side.
        say: called with a line of text per step.
        progress: called with the fraction of the work done, 0 to 1; returning False stops the
            build.
        fetched: called with the number of downloaded bytes; returning False stops the build.

    Raises:
        SourceError: the data are not available, or progress or fetched returned False.
        OSError: a file cannot be written; all files keep their old content.
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
