# SPDX-License-Identifier: MIT
"""Exports a face as one glTF file within a size limit: meshes, targets, materials, joints."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .._native import Dna, Rig
from ..author.geometry.simplify import fan_triangles
from ..base.words import counted, joined
from ..web.textures import base_name
from . import faces
from .avatar import licence
from .avatar.vrm import Manner
from .body.reading import Body, read_body
from .combining import Combination, Sums, chosen, driver_table
from .errors import GameFaceError
from .joints.hair import Chains, Hair, add_chains, is_long
from .joints.hanging import hung
from .joints.skeleton import Skeleton, facing_back, find_skeleton
from .manner import measured
from .materials import Materials
from .parts import Points, axes_of
from .refining import POSES, Refiner
from .targets import Target, find_targets
from .wishes import Wishes
from .writing import Change, Written, write

Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

_SMALL = 256  # pixels per side: smaller textures are more visible than quantized vertices
_COMBINATIONS = 256  # limit of combination targets if the user gives no limit of targets


@dataclass
class Made:
    """The exported files, and notes for the user.

    Attributes:
        files: file name -> bytes, the .glb first.
        notes: sentences about parts that are missing, approximated, or reduced for the size limit.
        groups: one line of text per group of targets.
    """

    files: dict[str, bytes]
    notes: list[str] = field(default_factory=list)
    groups: list[str] = field(default_factory=list)


def export(dna: Dna, rig: Rig, file: Path, out: str, wishes: Wishes) -> Made:
    """Exports a face as glTF; if wishes.within is set, also the JSON and script of combinations.

    Args:
        dna: the whole face, with geometry.
        rig: rig compiled from `dna`, with rotations as Euler angles.
        file: path of the face: textures are in its folder, and errors name it.
        out: file name of the .glb; the names of the other files derive from it.
        wishes: export options.

    Raises:
        GameFaceError: the face lacks something requested; too many targets; the size limit cannot
            be met.
    """
    levels = max(1, rig.lod_count)
    if not wishes.lod < levels:
        raise GameFaceError(
            f"{file}: a LOD from 0 to {levels - 1} was expected, found {wishes.lod}"
        )
    wishes = _as_avatar(wishes, out)
    targets, notes = find_targets(rig, wishes.shapes, str(file))
    if wishes.most is not None and len(targets) > wishes.most:
        raise GameFaceError(
            f"{file}: {counted(wishes.most, 'target')} at most were asked for, "
            f"{' and '.join(wishes.shapes)} are {len(targets)}: leave a group out"
        )
    maker = _Maker(dna, rig, file, targets)
    written, wish = maker.make(wishes), wishes
    if wishes.mb is not None:
        written, wish = _within(maker, written, wishes, levels, str(file))
        if wish != wishes:
            said = ", ".join(_lowered(wishes, wish))
            notes.append(f"for {wishes.mb:g} MB: {said}; the file has {_megabytes(written)}")
    made = Made({out: written.data}, notes + maker.notes, maker.lines(written))
    if wishes.within is not None:
        stem = out.rpartition(".")[0]
        table = json.dumps(driver_table(out, maker.made), indent=1) + "\n"
        made.files[f"{stem}.combinations.json"] = table.encode()
        script = resources.files(__package__).joinpath("combinations.js").read_bytes()
        made.files["combinations.js"] = script
    return made


def _as_avatar(wishes: Wishes, out: str) -> Wishes:
    """The wishes with the options that a VRM or a humanoid needs.

    Raises:
        GameFaceError: a VRM without a complete licence.
    """
    if not (wishes.vrm or wishes.humanoid or wishes.body):
        return wishes
    if wishes.vrm:
        licence.checked(wishes.licence, wishes.vrm, out)
        # VRM presets come first, so that no other target takes their names.
        wishes = replace(wishes, shapes=tuple(dict.fromkeys(("vrm", *wishes.shapes))))
    return replace(wishes, skeleton=True)


def _within(
    maker: _Maker, written: Written, wishes: Wishes, levels: int, face: str
) -> tuple[Written, Wishes]:
    """The file within the size limit, and the reduced options that it was made with.

    Args:
        maker: makes the file.
        written: the file without reductions.
        wishes: the options of the user.
        levels: number of LODs.
        face: name of the face for errors.

    Raises:
        GameFaceError: the file is still too large with every reduction.
    """
    most, wish = int((wishes.mb or 0) * 1e6), wishes
    for lower in _lower(wishes, levels):
        if len(written.data) <= most:
            break
        wish = lower
        written = maker.make(wish)
    if len(written.data) > most:
        more = "" if wishes.meshopt else ", or --meshopt"
        raise GameFaceError(
            f"{face}: at most {wishes.mb:g} MB were expected, with all reductions the file has "
            f"{_megabytes(written)}: ask for fewer shapes{more}"
        )
    size = wishes.textures
    # The textures were reduced before the LOD. The coarser LOD may leave room for larger textures.
    while wish.lod != wishes.lod and size > wish.textures:
        larger = replace(wish, textures=size)
        again = maker.make(larger)
        if len(again.data) <= most:
            return again, larger
        size //= 2
    return written, wish


def _lower(wishes: Wishes, levels: int) -> Iterator[Wishes]:
    """Options that make the file smaller step by step; the most visible reductions come last."""
    wish = wishes
    if not (wish.sparse or wish.meshopt):
        wish = replace(wish, sparse=True)
        yield wish
    while wish.textures > _SMALL:
        wish = replace(wish, textures=max(_SMALL, wish.textures // 2))
        yield wish
    if not (wish.quantize or wish.vrm):  # few programs that read VRM read quantized vertices
        wish = replace(wish, quantize=True)
        yield wish
    for lod in range(wish.lod + 1, levels):
        wish = replace(wish, lod=lod)
        yield wish


def _lowered(before: Wishes, after: Wishes) -> Iterator[str]:
    """The names, for a note to the user, of the options that were reduced from `before` to
    `after`."""
    if after.sparse != before.sparse:
        yield "sparse targets"
    if after.textures != before.textures:
        yield f"textures of {after.textures} pixels"
    if after.quantize != before.quantize:
        yield "quantized vertices"
    if after.lod != before.lod:
        yield f"LOD {after.lod}"


def _megabytes(written: Written) -> str:
    return f"{len(written.data) / 1e6:.2f} MB"


class _Maker:
    """Makes the exported file of a face for different sets of options; reuses the parts that do not
    depend on the changed options."""

    def __init__(self, dna: Dna, rig: Rig, file: Path, targets: Sequence[Target]) -> None:
        self._dna, self._rig, self._targets = dna, rig, targets
        self._materials = Materials(dna, file)
        self._file = file
        self._body: Body | None = None
        self._lod = -1
        self._wishes = Wishes()
        self.notes: list[str] = []
        self.made: list[Combination] = []
        self._found: dict[str, list[Combination]] = {}
        self._refined: list[tuple[Combination, Floats]] = []

    def make(self, wishes: Wishes) -> Written:
        """The file with the given options, whatever its size."""
        self._wishes = wishes
        if wishes.lod != self._lod:
            self._take_level(wishes)
        changes = [Change(t.name, t.group, self._sums.delta(t.name)) for t in self._targets]
        deltas = {c.name: delta for c, delta in self._refined}
        for one in self.made:
            delta = deltas[one.name] if one.name in deltas else self._sums.combination(one)
            changes.append(Change(one.name, "combinations", delta))
        written = write(
            self._points, self._skeleton, self._materials, changes, wishes, self._manner,
            self._body, self._chains,
        )  # fmt: skip
        self.notes = self._pair_notes + list(dict.fromkeys(self._materials.notes))
        self.notes += self._body.notes if self._body else []
        return written

    def _take_level(self, wishes: Wishes) -> None:
        self._lod = wishes.lod
        self._skeleton, move = self._find_skeleton(wishes)
        axes = axes_of(self._dna, faces_back=wishes.vrm == "0.x")
        self._points = Points(self._dna, self._rig, wishes.lod, self._skeleton, axes, move)
        if self._body is not None:
            out = set(self._body.others)
            parts = self._points.parts
            self._points.parts = [p for p in parts if not {base_name(p.mesh), p.mesh} & out]
        if not self._points.parts:
            raise GameFaceError(
                f"{self._file}: meshes at LOD {wishes.lod} were expected, there are none"
            )
        self._chains = Chains()
        if wishes.vrm and wishes.springs:
            self._add_chains()
        self._sums = Sums(self._points, self._rig, self._targets)
        presets = {t.name: t for t in self._targets if t.group == "vrm"}
        self._manner = measured(self._points, self._sums, presets) if wishes.vrm else Manner()
        self._found = {group: self._sums.errors(group) for group in dict.fromkeys(wishes.shapes)}
        self.made, self._pair_notes, self._refined = [], [], []
        if wishes.within is None:
            return
        room = _COMBINATIONS if wishes.most is None else wishes.most - len(self._targets)
        first = self._found[_driven(wishes)]
        self.made = chosen(first, wishes.within, room)
        left = first[len(self.made)].error_mm if len(self.made) < len(first) else 0.0
        if left > wishes.within:
            self._pair_notes.append(
                f"combinations: with {counted(room, 'target')}, {left:.2f} mm of "
                f"{joined(first[len(self.made)].of)} remain: more than {wishes.within:g} mm"
            )

        if _driven(wishes) == "arkit":
            self._refine(wishes, room - len(self.made))

    def _refine(self, wishes: Wishes, room: int) -> None:
        """Adds combinations for deviations that the pairs' combinations leave at typical poses.

        Args:
            wishes: the options of the user.
            room: largest number of additional combinations.
        """
        mine = [t for t in self._targets if t.group == "arkit"]
        names = [t.name for t in mine]
        poses = faces.typical(names, POSES)
        if wishes.frames:  # twice, because captured poses matter more than random ones
            own = faces.of_frames(names, wishes.frames)
            poses = np.concatenate([poses, own, own])
        self._refiner = Refiner(self._points, self._rig, self._sums, mine, self.made)
        self._refined = self._refiner.found(poses, room)
        self.made = self.made + [one for one, _ in self._refined]

    def _add_chains(self) -> None:
        """Adds chains of joints to long hair.

        The length of hair cards is measured at LOD 0, because coarser LODs merge cards.
        """
        parts, long = self._points.parts, list[int]()
        up = axes_of(self._dna)
        for number, part in enumerate(parts):
            if part.kind == "hair":
                names = [base_name(name) for name in self._dna.mesh_names]
                finest = self._dna.meshes[names.index(base_name(part.mesh))]
                triangles = finest.layout_positions.astype(np.int64)[fan_triangles(finest)]
                if is_long(finest.positions.astype(np.float64) @ up.T, triangles):
                    long.append(number)
        hairs = [
            Hair(self._points.rest[p.rows], p.rows, p.triangles, p.joints, p.weights)
            for p in (parts[number] for number in long)
        ]
        self._skeleton, self._chains, made = add_chains(self._skeleton, hairs)
        for number, hair in zip(long, made, strict=True):
            parts[number] = replace(parts[number], joints=hair.joints, weights=hair.weights)

    def _find_skeleton(self, wishes: Wishes) -> tuple[Skeleton, Doubles]:
        """The joints, and float64[3]: metres by which the face moves to meet its body."""
        move = np.zeros(3)
        if wishes.body and self._body is None:
            names = {*self._dna.mesh_names, *map(base_name, self._dna.mesh_names)}
            self._body = read_body(
                wishes.body, scale=wishes.body_scale, without=wishes.without, faces=names,
                needs_all=bool(wishes.vrm),
            )  # fmt: skip
        try:
            found = find_skeleton(
                self._dna, axes_of(self._dna), kind=wishes.humanoid,
                is_body=bool(wishes.vrm) and self._body is None,
                is_turned=wishes.humanoid == "mixamo" and wishes.vrm != "0.x",
            )  # fmt: skip
            if self._body is not None:
                found, move = hung(found, self._body)
        except GameFaceError as error:
            raise GameFaceError(f"{self._file}: {error}") from None
        if wishes.vrm == "0.x":
            return facing_back(found), move * [-1.0, 1.0, -1.0]
        return found, move

    def lines(self, written: Written) -> list[str]:
        """One line per group of targets, and for combinations: number of targets, vertices and
        bytes, deviation of linear sums from the rig."""
        out = []
        for group, found in self._found.items():
            tried, there = self._sums.tried[group]
            few = "" if tried == there else f" of {tried:,} of {there:,} pairs"
            worst = found[0] if found else None
            away = f"{worst.error_mm:.2f} mm ({' + '.join(worst.of)})" if worst else "0.00 mm"
            out.append(f"{_size(written, group)}, linear sum within {away}{few}")
        if self.made:
            done = {one.name for one in self.made}
            left = [c for c in self._found[_driven(self._wishes)] if c.name not in done]
            most = left[0].error_mm if left else 0.0
            out.append(f"{_size(written, 'combinations')}, with them within {most:.2f} mm")
        if self._refined:
            before, after = (
                np.percentile(x, 95) for x in (self._refiner.before, self._refiner.after)
            )
            out.append(
                f"of those {len(self._refined)} for targets that are partly on: 19 of 20 poses "
                f"within {after:.2f} mm, without them {before:.2f}"
            )
        return out


def _driven(wishes: Wishes) -> str:
    """The group of targets for face capture: the first requested group.

    In a VRM export, the group vrm is passed over unless it is the only requested group.
    """
    return next((g for g in wishes.shapes if not (wishes.vrm and g == "vrm")), wishes.shapes[0])


def _size(written: Written, group: str) -> str:
    count, vertices, size = written.groups.get(group, (0, 0, 0))
    return f"{group}: {counted(count, 'target')}, {counted(vertices, 'vertex')}, {size:,} bytes"
