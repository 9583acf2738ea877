# SPDX-License-Identifier: GPL-3.0-or-later
"""The primary board: about 30 handles arranged like a face, most for several controls.

A handle's location along each of its axes is a value from -1 to 1, and each half of an axis drives
raw controls with weights. The result is a table of GUI controls like a file's, made from names of
raw controls. Raw controls that a face lacks are left out, and so are halves, axes and handles
without controls. Raw controls without a handle keep their sliders.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ..base import names
from . import slider_words
from .board_layout import DOWN, LEFT, RIGHT, UP, Axis, Direction, Handle
from .board_letters import Point
from .board_table import BoardTable, Row

Led = Mapping[str, float]  # raw control without prefix and side -> weight
_CLEAR = 0.05  # smallest sideways share of the measured motion that decides a direction


@dataclass(frozen=True)
class Part:
    """A handle of the face, or a pair of handles.

    Attributes:
        stem: name of the handle without its side.
        label: words on the board, in short lines; `inwards | outwards` names both ends of the
            handle's horizontal axis.
        region: region of the face.
        place: rest place on the board; for a pair, the place of the handle on the character's left.
        paired: True: one handle for each side; False: one handle for both sides.
        up, down, out, inward: raw controls of each half of the axes; for a single handle, `out` is
            the character's left.
        label_at: side of the handle's frame on which the label is placed; for a pair, the side for
            the handle on the character's left.
    """

    stem: str
    label: tuple[str, ...]
    region: str
    place: Point
    paired: bool
    up: Led = field(default_factory=dict)
    down: Led = field(default_factory=dict)
    out: Led = field(default_factory=dict)
    inward: Led = field(default_factory=dict)
    label_at: Direction = DOWN


PARTS = (
    Part("brow_inner", ("Brow", "Inner"), "brow", (1.75, 5.2), True,
         up={"browRaiseIn": 1.0}, down={"browDown": 1.0}, inward={"browLateral": 1.0},
         label_at=RIGHT),
    # The face has only one control that lowers a brow, so both brow handles drive it.
    Part("brow_outer", ("Brow Outer",), "brow", (3.35, 5.2), True,
         up={"browRaiseOuter": 1.0}, down={"browDown": 1.0}),
    Part("gaze", ("Gaze",), "eye", (0.0, 2.75), False,
         up={"eyeLookUp": 1.0}, down={"eyeLookDown": 1.0},
         out={"eyeLookLeft": 1.0}, inward={"eyeLookRight": 1.0}),
    Part("lid_upper", ("Upper Lid",), "eye", (1.9, 2.75), True,
         up={"eyeWiden": 1.0}, down={"eyeBlink": 1.0}),
    Part("lid_lower", ("Lower Lid",), "eye", (3.2, 2.3), True,
         up={"eyeSquintInner": 1.0}, down={"eyeLowerLidDown": 1.0}),
    Part("nose", ("Nose",), "nose", (1.25, -0.05), True, up={"noseWrinkle": 1.0},
         out={"noseNostrilDilate": 1.0}, inward={"noseNostrilCompress": 1.0}),
    Part("cheek", ("Cheek",), "cheek", (4.2, 0.0), True, up={"eyeCheekRaise": 1.0}),
    Part("puff", ("Dimple | Puff",), "cheek", (3.4, -1.15), True,
         out={"mouthCheekBlow": 1.0, "mouthLipsBlow": 0.4}, inward={"mouthDimple": 1.0}),
    Part("mouth", ("Mouth",), "mouth", (0.0, -1.2), False,
         out={"mouthLeft": 1.0}, inward={"mouthRight": 1.0}),
    Part("mouth_corner", ("Corner",), "mouth", (3.2, -3.2), True,
         up={"mouthCornerPull": 1.0}, down={"mouthCornerDepress": 1.0},
         out={"mouthStretch": 1.0}, inward={"mouthCornerNarrow": 1.0}),
    Part("lip_upper", ("Upper", "Lip"), "mouth", (1.6, -2.7), True,
         up={"mouthUpperLipRaise": 1.0}, label_at=UP),
    Part("lip_lower", ("Lower", "Lip"), "mouth", (1.6, -4.22), True,
         up={"mouthLowerLipBite": 1.0}, down={"mouthLowerLipDepress": 1.0}),
    Part("lips", ("Lips",), "mouth", (0.0, -3.2), False,
         up={"mouthFunnelU": 1.0, "mouthFunnelD": 1.0},
         down={"mouthPressU": 1.0, "mouthPressD": 1.0, "mouthLipsPress": 0.4},
         out={"mouthLipsPurseU": 1.0, "mouthLipsPurseD": 1.0},
         inward={"mouthUpperLipRollIn": 1.0, "mouthLowerLipRollIn": 1.0}),
    Part("jaw", ("Jaw",), "jaw", (0.0, -5.05), False,
         down={"jawOpen": 1.0}, out={"jawLeft": 1.0}, inward={"jawRight": 1.0}),
    Part("jaw_forward", ("Jaw", "Fwd"), "jaw", (-2.5, -5.72), False,
         up={"jawFwd": 1.0}, down={"jawBack": 1.0}, label_at=LEFT),
    Part("chin", ("Chin",), "jaw", (2.5, -5.72), False,
         up={"jawChinRaiseD": 1.0, "jawChinRaiseU": 0.4}, down={"jawOpenExtreme": 1.0},
         label_at=RIGHT),
    Part("tongue", ("Tongue",), "tongue", (6.0, -1.25), False,
         up={"tongueUp": 1.0}, down={"tongueDown": 1.0},
         out={"tongueLeft": 1.0}, inward={"tongueRight": 1.0}),
    Part("tongue_out", ("Tongue Out",), "tongue", (6.0, -4.1), False,
         up={"tongueIn": 1.0}, down={"tongueOut": 1.0},
         out={"tongueWide": 1.0}, inward={"tongueNarrow": 1.0}),
    Part("tongue_tip", ("Tip",), "tongue", (5.4, 1.7), False,
         up={"tongueTipUp": 1.0}, down={"tongueTipDown": 1.0}),
    Part("tongue_bend", ("Bend",), "tongue", (6.25, 1.7), False,
         up={"tongueBendUp": 1.0}, down={"tongueBendDown": 1.0}),
    Part("neck_tension", ("Neck",), "neck", (-4.1, -6.25), False, up={"neckStretch": 1.0}),
)  # fmt: skip


@dataclass(frozen=True)
class _Way:
    """An axis of a handle: its GUI control, and weights of raw controls.

    `rises` is for values above 0, `falls` for values below 0: index of a raw control -> weight.
    """

    name: str
    rises: dict[int, float]
    falls: dict[int, float]


def bone_of(part: Part, side: str) -> str:
    """The name of a handle's bone.

    The side is in the middle of the name, where Blender does not recognise it. Otherwise Blender
    would mirror handles about the armature's centre instead of the board's centre.

    Args:
        part: the handle, or the pair of handles to which it belongs.
        side: "L" or "R"; "" for none.
    """
    return f"face_{side}_{part.stem}" if side else f"face_{part.stem}"


def table_of(labels: Sequence[str]) -> BoardTable:
    """Make the table of the primary board.

    Args:
        labels: names of the face's raw controls.

    Returns:
        BoardTable with GUI controls named after the bones: `face_L_mouth_corner.ty`.
    """
    index = {slider_words.short_name(label): i for i, label in enumerate(labels)}
    found: list[str] = []
    rows: list[Row] = []
    for part in PARTS:
        for side in "LR" if part.paired else ("",):
            for way in _ways_of(part, side, index):
                here = len(found)
                found.append(way.name)
                rows += [Row(here, raw, 0.0, 1.0, share, 0.0) for raw, share in way.rises.items()]
                rows += [Row(here, raw, -1.0, 0.0, -share, 0.0) for raw, share in way.falls.items()]
    return BoardTable(tuple(found), tuple(rows), len(labels), is_own=True)


def _ways_of(part: Part, side: str, index: Mapping[str, int]) -> Iterator[_Way]:
    for axis, rise, fall in (("tx", part.out, part.inward), ("ty", part.up, part.down)):
        rises, falls = _raws(rise, side, index), _raws(fall, side, index)
        if rises or falls:
            yield _Way(f"{bone_of(part, side)}.{axis}", rises, falls)


def _raws(led: Led, side: str, index: Mapping[str, int]) -> dict[int, float]:
    """Index of each raw control that half an axis drives -> weight.

    Args:
        led: raw controls of the half axis, without prefix and side -> weight.
        side: side of the handle, "L" or "R"; "" drives both sides of each raw control.
        index: name of a raw control without prefix -> its index in the face.
    """
    out: dict[int, float] = {}
    for stem, share in led.items():
        wanted = (stem + side,) if side else (stem, f"{stem}L", f"{stem}R")
        out |= {index[name]: share for name in wanted if name in index}
    return out


def handles_of(
    table: BoardTable, sideways: Mapping[int, float], taken: Iterable[str] = ()
) -> list[Handle]:
    """Make the handles of the primary board with their places.

    Args:
        table: the result of table_of.
        sideways: index of a GUI control -> motion of the face to its own left, as a share of the
            whole motion, -1 to 1.
        taken: bone names that are in use.
    """
    index = {name: gui for gui, name in enumerate(table.names)}
    found = []
    for part, side in sides_of(table):
        bone, (x, y) = bone_of(part, side), part.place
        across, upright = index.get(f"{bone}.tx"), index.get(f"{bone}.ty")
        goes = RIGHT if side != "R" else LEFT
        if across is not None and not side and sideways.get(across, 0.0) < -_CLEAR:
            goes = LEFT
        ways = [
            Axis(gui, float(table.lowest[gui]), float(table.highest[gui]), 1.0, way)
            if gui is not None
            else None
            for gui, way in ((across, goes), (upright, UP))
        ]
        place = (-x if side == "R" else x, y)
        found.append(Handle(bone, side, part.region, part.stem, ways[0], ways[1], place))
    labels = names.unique_labels([handle.bone for handle in found], taken)
    return [replace(h, bone=label) for h, label in zip(found, labels, strict=True)]


def sides_of(table: BoardTable) -> Iterator[tuple[Part, str]]:
    """The parts whose handles are in a table, each with its side.

    Args:
        table: the result of table_of.
    """
    there = {name.rpartition(".")[0] for name in table.names}
    for part in PARTS:
        for side in "LR" if part.paired else ("",):
            if bone_of(part, side) in there:
                yield part, side
