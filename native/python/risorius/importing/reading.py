# SPDX-License-Identifier: MIT
"""Reads a file, applies a mapping, and returns a clip of raw controls with a report."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip
from ..base.budget import Budget
from ..base.errors import ArgumentError
from . import fbx, gltf, named_json, ranges, tables, visemes
from .clock import units
from .errors import AnimationFileError
from .keys import Keys, on_one_clock
from .mapping import (
    ANGLES,
    HEAD_ANGLES,
    Mapped,
    apply_rows,
    best_mapping,
    load_mapping,
    single_letters,
)
from .mapping import Mapping as ControlMapping
from .report import Report
from .source import Take, decode, make_clip, read_bytes, refuse_other_kinds

KINDS = {
    "live_link_face": "Live Link Face CSV",
    "csv": "CSV of named curves",
    "json": "JSON of named curves",
    "rhubarb": "mouth shapes of Rhubarb Lip Sync: TSV, XML, JSON",
    "moho": "mouth shapes of Moho and Papagayo: .dat",
    "papagayo": "Papagayo documents: .pgo",
    "gltf": "glTF and GLB: morph targets and properties",
    "fbx": "FBX: properties, blend shapes, face boards",
}
ROTATIONS = ("head", "all", "none")
# Kinds of files whose curves are Risorius' own controls or were keyframed by an animator. Every
# value in them is intended, so that none is refused as implausible.
_OWN_KINDS = ("clip", "rzc", "curves")


class Options(NamedTuple):
    """The arguments of `read` after the path."""

    kind: str | None
    asked: units.Asked
    take: str | None
    budget: Budget


class RigLike(Protocol):
    """The members of `risorius.Rig` that a mapping of GUI controls needs."""

    @property
    def gui_control_names(self) -> list[str]: ...
    @property
    def raw_control_names(self) -> list[str]: ...
    def gui_to_raw(self, gui: npt.ArrayLike, /) -> npt.NDArray[np.float32]: ...


@dataclass
class Imported:
    """The curves of a file before a mapping is applied.

    Attributes:
        clip: curves with the file's own names and times. Timecodes and dates are counted from the
            first frame, visemes from the start of the sound.
        kind: one of KINDS; "curves" for curves that are not from a file, "rzc" or "clip" for a
            clip file of Risorius.
        mapping: name of the built-in mapping for this kind of file, else of the mapping that knows
            the most curves; "" if none knows any.
        source: the file's name.
        notes: sentences for the user about dropped or assumed data.
    """

    clip: Clip
    kind: str
    mapping: str
    source: str
    notes: list[str] = field(default_factory=list)

    def apply(
        self,
        mapping: str | os.PathLike[str] | ControlMapping | None = None,
        *,
        rig_names: Iterable[str] | None = None,
        rig: RigLike | None = None,
        rotations: str = "head",
        full_value: float | None = None,
        angles: str | None = None,
    ) -> tuple[Clip, Report]:
        """Converts to a clip of raw controls, and reports the use of each curve.

        Args:
            mapping: a Mapping, name of a built-in mapping, or path of a TOML file; None:
                self.mapping.
            rig_names: raw controls of the rig, `Rig.raw_control_names`; other controls are dropped
                and reported. None: all are kept.
            rig: needed for a mapping of GUI controls, because the rig has their table.
            rotations: curves of angles to keep. "head": head and neck; the eyes follow eyeLook
                controls. "all": the eyes' angles too. "none": no angles.
            full_value: the file's value of a full movement: 100 for per cent, 255 for bytes. None:
                1, and values above 4 are an error.
            angles: unit of the file's angles, one of ANGLE_UNITS. None: radians, and values above 2
                are an error.

        Raises:
            ValueError: no mapping fits, an unusable mapping, a GUI mapping without a rig,
                implausible values.
        """
        ranges.check_options(full_value, angles)
        if rotations not in ROTATIONS:
            raise ArgumentError(
                f"rotations: one of {', '.join(ROTATIONS)} was expected, found {rotations!r}"
            )
        chosen = load_mapping(mapping if mapping is not None else self._fitting())
        done = apply_rows(chosen, ranges.rescaled(self.clip, chosen, full_value, angles))
        report = Report(
            self.source, self.kind, chosen.name, done.mapped, done.unmapped, done.ignored,
            absent=done.absent, notes=[*self.notes, *done.notes],
        )  # fmt: skip
        report.always_zero = [
            name
            for name, row in zip(self.clip.names, self.clip.curves, strict=True)
            if not row.any()
        ]
        clip = _without_angles(done, rotations, report)
        if self.kind not in _OWN_KINDS:
            ranges.refuse_other_scales(clip, self.source, full_value, angles)
        if chosen.is_gui:
            if rig is None:
                raise ArgumentError(
                    f"mapping {chosen.name}: its curves are GUI controls, which only a rig's own "
                    "table turns into raw controls: give the rig"
                )
            clip = _gui_to_raw(clip, rig, report)
        if rig_names is not None:
            clip = _in_rig(clip, rig_names, report)
        return clip, report

    def _fitting(self) -> str:
        if self.mapping:
            return self.mapping
        letters = single_letters(_moving(self.clip))
        if letters:
            raise AnimationFileError(
                self.source,
                "names longer than a letter were expected, found curves "
                f"{', '.join(self.clip.names[:10])}, which stand for other shapes in each of "
                f"{', '.join(letters)}: give one of these mappings (--mapping; Mapping in Blender)",
            )
        raise AnimationFileError(
            self.source,
            f"no mapping knows any of its {len(self.clip.names)} curves "
            f"({', '.join(self.clip.names[:4])} ...): give a mapping of your own (--mapping; "
            "Mapping in Blender)",
            unknown=self.clip.names,
        )


def _without_angles(done: Mapped, rotations: str, report: Report) -> Clip:
    """Keeps the requested angles of head and eyes.

    If all head angles are 0 in all frames, they are dropped, because the capture did not record
    them and their curves would keep the head still.

    Args:
        done: the mapped clip.
        rotations: angles to keep: "head" (head and neck), "all" (the eyes' angles too) or "none".
        report: receives the dropped curves and a note; changed.
    """
    clip = done.clip
    drop = set()
    for name in clip.names:
        if name not in ANGLES:
            continue
        is_head = name in HEAD_ANGLES
        if rotations == "none" or (rotations == "head" and not is_head):
            drop.add(name)
    head = [name for name in clip.names if name in HEAD_ANGLES]
    if head and rotations != "none" and not any(clip.curve(name).any() for name in head):
        drop.update(head)
        report.notes.append("the head does not move: its rotation was not recorded")
    for source, row in list(report.mapped.items()):
        if set(row) <= drop:
            del report.mapped[source]
            report.ignored.append(source)
    return clip.selected([name for name in clip.names if name not in drop])


def _gui_to_raw(clip: Clip, rig: RigLike, report: Report) -> Clip:
    """Converts GUI curves to raw controls, frame by frame, with the rig's table.

    Raw controls that are 0 in every frame get no curve.

    Args:
        clip: curves of GUI controls and angles; the angles are kept.
        rig: rig with the table from GUI controls to raw controls.
        report: receives a note and the controls that the rig lacks; changed.
    """
    index = {name: i for i, name in enumerate(rig.gui_control_names)}
    gui = np.zeros((clip.frame_count, len(index)), np.float32)
    angles = [name for name in clip.names if name in ANGLES]
    for name, curve in zip(clip.names, clip.curves, strict=True):
        if name in index:
            gui[:, index[name]] = curve
        elif name not in ANGLES:
            report.not_in_rig.append(name)
    raw = np.array([rig.gui_to_raw(frame) for frame in gui], np.float32)
    raw = raw.reshape(clip.frame_count, len(rig.raw_control_names))
    moving = np.flatnonzero(raw.any(axis=0))
    names = [rig.raw_control_names[i] for i in moving]
    report.notes.append(f"{len(index)} GUI controls of the rig became {len(names)} raw controls")
    rows = [raw[:, moving].T, clip.selected(angles).curves]
    return clip.replaced(names=[*names, *angles], curves=np.concatenate(rows))


def _in_rig(clip: Clip, rig_names: Iterable[str], report: Report) -> Clip:
    own = set(rig_names)
    known = own | set(ANGLES)
    report.not_in_rig += [name for name in clip.names if name not in known]
    report.bones += [name for name in clip.names if name in known - own]
    return clip.selected([name for name in clip.names if name in known])


def read(
    path: str | os.PathLike[str],
    *,
    kind: str | None = None,
    rate: float | None = None,
    timecode_rate: float | None = None,
    time_unit: str | None = None,
    take: str | None = None,
) -> Imported:
    """Reads an animation file.

    Args:
        path: path of the file.
        kind: one of KINDS, or None: inferred from the content. GLB and binary FBX are always
            recognised by their content.
        rate: frames per second, for tables with frame numbers or without times.
        timecode_rate: frames per second of timecodes, if it cannot be inferred; 29.97 means
            30000/1001, and so on.
        time_unit: unit of the times in tables and JSON, one of importing.TIME_UNITS, used instead
            of a unit in the file; "rows" ignores the times, and each row is a frame at `rate`.
            None: from the file.
        take: name of an animation, or its number from 0, for glTF and FBX with several; None: the
            first with curves.

    Raises:
        AnimationFileError: the file cannot be read or used; the sentence names file and place.
        ValueError: an invalid option.
    """
    if kind is not None and kind not in KINDS:
        raise ArgumentError(f"kind: one of {', '.join(KINDS)} was expected, found {kind!r}")
    for name, value in (("rate", rate), ("timecode_rate", timecode_rate)):
        if value is not None and not 0.0 < value < 1e6:
            raise ArgumentError(f"{name}: frames a second above 0 were expected, found {value}")
    if time_unit is not None and time_unit not in units.CHOICES:
        raise ArgumentError(
            f"time_unit: one of {', '.join(units.CHOICES)} was expected, found {time_unit!r}"
        )
    file = Path(path)
    data = read_bytes(file)
    try:
        budget, asked = Budget.of(len(data)), units.Asked(rate, timecode_rate, time_unit)
        found = _read_kind(file, data, Options(kind, asked, take, budget))
    except AnimationFileError:
        raise
    # A reader may raise these errors, for example if a number in the file causes an overflow.
    except (ValueError, ArithmeticError) as error:
        raise AnimationFileError(str(path), str(error)) from error
    except RecursionError as error:
        raise AnimationFileError(str(path), "nested too deeply to be read") from error
    mapping = found.mapping or best_mapping(_moving(found.clip), found.clip.names) or ""
    facts = {"source": file.name, "kind": found.kind, **found.clip.metadata}
    return Imported(
        found.clip.replaced(metadata=facts), found.kind, mapping, str(path), found.notes
    )


def _moving(clip: Clip) -> list[str]:
    """Names of the curves that are not constantly 0; all names if every curve is constantly 0."""
    moving = [n for n, curve in zip(clip.names, clip.curves, strict=True) if curve.any()]
    return moving or list(clip.names)


def _read_kind(file: Path, data: bytes, options: Options) -> Take:
    name = str(file)
    if gltf.is_glb(data):
        return gltf.read(gltf.open_glb(file, data, options.budget), options.take)
    if fbx.is_fbx(data):
        return fbx.read(data, name, options.take, options.budget)
    refuse_other_kinds(data, name)
    text = decode(data, name)
    if text.lstrip()[:1] in ("{", "[") or options.kind == "json":
        return _read_json(named_json.parse(text, name), file, options)
    return _read_mouth(text, name, options) or _read_table(text, name, options)


def _read_mouth(text: str, name: str, options: Options) -> Take | None:
    """Reads a text of mouth shapes from a lip sync tool, or returns None for any other text."""
    if options.kind in (None, "moho") and text.lstrip().startswith("MohoSwitch1"):
        return visemes.read_dat(text.lstrip(), name, options.asked.rate)
    is_asked = options.kind in (None, "rhubarb", "papagayo")
    reader = visemes.reader_of(text, options.kind) if is_asked else None
    return reader(text, name) if reader is not None else None


def _read_table(text: str, name: str, options: Options) -> Take:
    if fbx.is_text_fbx(text):
        raise AnimationFileError(
            name, "a binary FBX was expected, found one as text: export as binary"
        )
    if options.kind not in (None, "live_link_face", "csv", "rhubarb"):
        raise AnimationFileError(name, f"{KINDS[options.kind]} was expected, found something else")
    table = tables.read_table(text, name)
    is_capture = options.kind is None and tables.is_live_link_face(table.header)
    if is_capture or options.kind == "live_link_face":
        return tables.read_live_link_face(table, options.asked)
    take = tables.read_plain(table, options.asked)
    if options.kind == "rhubarb" and take.kind != "rhubarb":
        raise AnimationFileError(
            name, "a time, a tab and a shape A-H or X in each line were expected, found a table"
        )
    return take


def _read_json(document: object, file: Path, options: Options) -> Take:
    name = str(file)
    if isinstance(document, dict) and options.kind != "json":
        if gltf.is_gltf(document):
            return gltf.read(gltf.open_gltf(file, document, None, options.budget), options.take)
        if "mouthCues" in document:
            return visemes.read_rhubarb_json(document, name)
        if "voices" in document and "fps" in document:
            return visemes.read_pgo_json(document, name)
    return named_json.read(document, name, options.asked, options.budget)


def import_file(
    path: str | os.PathLike[str],
    rig_names: Iterable[str] | None = None,
    *,
    mapping: str | os.PathLike[str] | ControlMapping | None = None,
    kind: str | None = None,
    rate: float | None = None,
    timecode_rate: float | None = None,
    time_unit: str | None = None,
    take: str | None = None,
    rig: RigLike | None = None,
    rotations: str = "head",
    full_value: float | None = None,
    angles: str | None = None,
) -> tuple[Clip, Report]:
    """Reads a file and maps it to a clip of raw controls; also reports the use of its curves.

    Args:
        path: path of the file.
        kind, rate, timecode_rate, time_unit, take: options for reading the file, as in `read`.
        rig_names, mapping, rig, rotations, full_value, angles: options for the conversion to raw
            controls, as in `Imported.apply`.

    Raises:
        ValueError: an error of `read` or `Imported.apply`.
    """
    found = read(
        path, kind=kind, rate=rate, timecode_rate=timecode_rate, time_unit=time_unit, take=take
    )
    return found.apply(
        mapping,
        rig_names=rig_names,
        rig=rig,
        rotations=rotations,
        full_value=full_value,
        angles=angles,
    )


def import_curves(
    curves: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
    rig_names: Iterable[str] | None = None,
    *,
    source: str = "action",
    mapping: str | os.PathLike[str] | ControlMapping | None = None,
    rig: RigLike | None = None,
    rotations: str = "head",
) -> tuple[Clip, Report]:
    """Maps named curves, such as shape keys of another rig's action, to a clip of raw controls.

    Args:
        curves: name of a shape key or property -> (float64[keys] seconds, ascending; float[keys]
            values), linear between keyframes.
        source: name of the curves in the report.
        rig_names: raw controls of the rig; other controls are dropped and reported. None: all are
            kept.
        mapping: a Mapping, name of a built-in mapping, or path of a TOML file; None: the built-in
            mapping that knows the most curves.
        rig: needed for a mapping of GUI controls.
        rotations: angles to keep: "head", "all" (eyes too) or "none".

    Raises:
        ValueError: no curves, times that do not ascend, values that are not finite; errors of
            `Imported.apply`.
    """
    keys = {name: _keys(name, times, values) for name, (times, values) in curves.items()}
    if not any(key.times.size for key in keys.values()):
        raise ArgumentError(f"{source}: curves with keys were expected, found none")
    budget = Budget.of(sum(key.times.nbytes + key.values.nbytes for key in keys.values()))
    times, rows = on_one_clock(list(keys.values()), None, budget)
    clip = make_clip(list(keys), rows, times, metadata={"source": source, "kind": "curves"})
    found = Imported(clip, "curves", best_mapping(_moving(clip), clip.names) or "", source)
    return found.apply(mapping, rig_names=rig_names, rig=rig, rotations=rotations)


def _keys(name: str, times: npt.ArrayLike, values: npt.ArrayLike) -> Keys:
    t, v = np.asarray(times, np.float64), np.asarray(values, np.float64)
    if t.ndim != 1 or t.shape != v.shape:
        raise ArgumentError(
            f"{name}: as many values as times were expected, "
            f"found the shapes {v.shape} and {t.shape}"
        )
    if not (np.isfinite(t).all() and np.isfinite(v).all()):
        raise ArgumentError(f"{name}: finite times and values were expected")
    if (np.diff(t) <= 0.0).any():
        raise ArgumentError(f"{name}: times that ascend were expected")
    return Keys(t, v)
