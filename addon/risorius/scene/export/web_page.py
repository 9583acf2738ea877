# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a web page of a face: its DNA file with edits, textures, animation and sound."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ..base import compat, parts, saved
from ..base.blender_types import ArmatureObject


@dataclass(frozen=True)
class Sound:
    """A sound strip of the sequencer for a page.

    Attributes:
        path: path of the sound file.
        offset: seconds from the first exported frame to the frame at which the untrimmed sound file
            begins; below 0 if the file begins earlier.
    """

    path: Path
    offset: float


def first_sound(scene: bpy.types.Scene, start: float, end: float, rate: float) -> Sound | None:
    """The first audible sound strip in a range of frames, or None.

    Strips without a file, and with files of formats that a page cannot play, are left out.

    Args:
        scene: has the sequencer.
        start, end: first and last frame of the range.
        rate: frames per second.
    """
    endings = native.part("web.page").SOUNDS
    heard: list[tuple[float, Sound]] = []
    for each in compat.strips_of(scene) if scene.sequence_editor is not None else ():
        if each.type != "SOUND" or each.mute:
            continue
        strip = cast("bpy.types.SoundStrip", each)
        if strip.sound is None:
            continue
        path = Path(bpy.path.abspath(strip.sound.filepath, library=strip.sound.library))
        if path.suffix.lower() not in endings or not path.is_file():
            continue
        if strip.frame_final_end > start and strip.frame_final_start <= end:
            heard.append((strip.frame_final_start, Sound(path, (strip.frame_start - start) / rate)))
    return min(heard, key=lambda pair: pair[0])[1] if heard else None


def page(
    rig: ArmatureObject, content: bytes, clip: native.Clip | None, sound: Sound | None
) -> bytes:
    """The page of a face, as HTML.

    Args:
        rig: deforming armature.
        content: bytes of the DNA file.
        clip: clip of raw controls to play; None: no animation.
        sound: sound of the clip; None: no sound.

    Raises:
        FaceError: this build of Risorius cannot make pages, or the face cannot be shown.
    """
    web = native.part("web")
    dna = native.module().load(content)
    source = Path(bpy.path.abspath(saved.text(rig, parts.SOURCE)))
    heard = (sound.path.read_bytes(), sound.path.suffix, sound.offset) if sound else None
    title = rig.name.removesuffix("_rig")
    try:
        made: bytes = web.render(
            dna, title, looks=web.find_looks(dna, source), clip=clip, sound=heard
        )
    except web.WebError as error:
        raise FaceError(str(error)) from error
    return made
