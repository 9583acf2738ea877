# SPDX-License-Identifier: MIT
"""Lists the keyframes of controls and bones in the demo. Does not need Blender.

A track is control: [(frame, value), ...]. A name that ends in * stands for both sides or all four
lip quarters. The frame rate is 24 frames per second.
"""

from __future__ import annotations

FRAME_RATE = 24
LAST_FRAME = 96

# Frames at which blinks begin. The lids close in two frames, stay closed for one, and open in four.
BLINKS = [9, 25, 64]

TRACKS = {
    # Looks to one side and back. The eyes lead and the head follows.
    "eyeLookLeft*": [(12, 0), (15, 0.75), (24, 0.35), (29, 0.3), (32, 0), (96, 0)],
    "eyeLookUp*": [(12, 0), (16, 0.25), (24, 0.15), (31, 0), (96, 0)],
    "browRaiseIn*": [(30, 0), (35, 0.55), (42, 0.25), (50, 0.1), (58, 0.35), (64, 0), (96, 0)],
    "browRaiseOuterL": [(30, 0), (36, 0.5), (44, 0.2), (52, 0), (96, 0)],
    "browRaiseOuterR": [(30, 0), (36, 0.3), (44, 0.15), (52, 0), (96, 0)],
    # A smile that begins on the left side.
    "mouthCornerPullL": [
        (26, 0),
        (34, 0.95),
        (40, 0.7),
        (46, 0.1),
        (51, 0.3),
        (62, 0.25),
        (68, 0.2),
        (74, 0.35),
        (88, 0.35),
        (96, 0.3),
    ],
    "mouthCornerPullR": [
        (28, 0),
        (36, 0.85),
        (40, 0.65),
        (46, 0.1),
        (51, 0.3),
        (62, 0.25),
        (68, 0.2),
        (74, 0.35),
        (88, 0.35),
        (96, 0.3),
    ],
    "eyeCheekRaise*": [
        (28, 0),
        (36, 0.55),
        (44, 0.3),
        (60, 0.1),
        (66, 0),
        (74, 0.4),
        (90, 0.4),
        (96, 0.3),
    ],
    # The syllables of "Hello, I'm alive", then silence before the shout.
    "jawOpen": [
        (38, 0),
        (41, 0.34),
        (43, 0.16),
        (46, 0.3),
        (48, 0.14),
        (51, 0.62),
        (54, 0.02),
        (57, 0.4),
        (60, 0.22),
        (63, 0.05),
        (66, 0),
        (70, 0.1),
        (74, 0.75),
        (88, 0.75),
        (96, 0.55),
    ],
    "mouthUpperLipRaise*": [
        (38, 0),
        (41, 0.12),
        (44, 0),
        (48, 0),
        (51, 0.15),
        (54, 0),
        (57, 0.2),
        (63, 0.1),
        (66, 0),
        (74, 0.55),
        (90, 0.55),
        (96, 0.4),
    ],
    "mouthLowerLipDepress*": [
        (38, 0),
        (41, 0.25),
        (44, 0),
        (48, 0),
        (51, 0.2),
        (54, 0),
        (57, 0.3),
        (61, 0.25),
        (64, 0),
        (72, 0),
        (76, 0.5),
        (90, 0.5),
        (96, 0.4),
    ],
    "mouthFunnel*": [(42, 0), (46, 0.75), (49, 0.1), (52, 0), (96, 0)],
    "mouthLipsPurse*": [(42, 0), (46, 0.5), (50, 0), (96, 0)],
    "mouthStretch*": [
        (48, 0),
        (51, 0.25),
        (53, 0),
        (56, 0.25),
        (60, 0),
        (68, 0),
        (75, 0.6),
        (90, 0.6),
        (96, 0.45),
    ],
    "mouthPressU*": [(52, 0), (54, 0.35), (56, 0), (64, 0), (67, 0.4), (70, 0), (96, 0)],
    "mouthPressD*": [(52, 0), (54, 0.35), (56, 0), (64, 0), (67, 0.4), (70, 0), (96, 0)],
    "mouthLowerLipRollIn*": [(60, 0), (62, 0.45), (64, 0), (96, 0)],
    # An angry shout. Tracks without a control of the demo's face have no effect.
    "jawOpenExtreme": [(70, 0), (76, 0.9), (88, 1.0), (96, 0.6)],
    "neckStretch*": [(68, 0), (76, 0.9), (88, 1.0), (96, 0.7)],
    "noseWrinkle*": [(64, 0), (70, 0.5), (76, 1.0), (90, 0.9), (96, 0.7)],
    "eyeSquintInner*": [(64, 0), (70, 0.6), (76, 1.0), (90, 0.9), (96, 0.7)],
    "browDown*": [(62, 0), (69, 0.7), (76, 1.0), (90, 1.0), (96, 0.8)],
    "noseNostrilDilate*": [(64, 0), (70, 0.4), (76, 0.8), (96, 0.6)],
}

# Bone -> (frame, Euler angles in degrees about x, y and z, see turn() in demo.py). Positive: x nods
# down, y tilts to the left shoulder, z turns to the left.
BONES = {
    "head": [
        (1, (0, 0, 0)),
        (14, (0, 0, 1)),
        (22, (-2, 2, 13)),
        (28, (-2, 2, 12)),
        (38, (1, -3, -2)),
        (46, (-2, -2, -1)),
        (54, (2, 0, -4)),
        (62, (0, 1, -3)),
        (70, (6, 0, -1)),
        (77, (-7, 2, 1)),
        (88, (-5, -2, -1)),
        (96, (-3, 0, 0)),
    ],
    "neck": [
        (1, (0, 0, 0)),
        (16, (0, 0, 0)),
        (24, (0, 0, 5)),
        (38, (0, 0, 0)),
        (70, (2, 0, 0)),
        (77, (-4, 0, 0)),
        (96, (-3, 0, 0)),
    ],
}

# (frame, caption) of each picture on the sheet of stills.
SHEET = [
    (1, "neutral"),
    (11, "blink"),
    (23, "look and turn"),
    (37, "smile"),
    (41, "speech: he"),
    (46, "speech: oh"),
    (51, "speech: ah"),
    (80, "the shout"),
]


def expand(name: str, available: set[str], prefix: str) -> list[str]:
    """The names of the character's controls that a track moves; empty if the character lacks them.

    Args:
        name: name of a track; with * at the end it stands for all sides and quarters.
        available: full names of the character's controls.
        prefix: prefix of these names.
    """
    if not name.endswith("*"):
        return [prefix + name] if prefix + name in available else []
    stem = prefix + name[:-1]
    endings = ("L", "R", "UL", "UR", "DL", "DR")
    return [stem + ending for ending in endings if stem + ending in available]


def tracks(
    available: set[str], prefix: str = "CTRL_expressions."
) -> tuple[dict[str, list[tuple[float, float]]], list[str]]:
    """The keyframes for a character's controls.

    Args:
        available: full names of the character's controls.
        prefix: prefix of these names.

    Returns:
        Control name -> (frame, value) of each keyframe; and the names of the tracks for which
        the character has no control.
    """
    out: dict[str, list[tuple[float, float]]] = {}
    missing = []
    blinks = [(1.0, 0.0)]
    for start in BLINKS:
        blinks += [(start, 0.0), (start + 2, 1.0), (start + 3, 1.0), (start + 7, 0.0)]
    for name, keys in {"eyeBlink*": blinks, **TRACKS}.items():
        controls = expand(name, available, prefix)
        if not controls:
            missing.append(name)
        for control in controls:
            out[control] = list(keys)
    return out, missing
