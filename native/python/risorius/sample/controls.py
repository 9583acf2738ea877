# SPDX-License-Identifier: MIT
"""GUI controls of the sample: the board's names and ranges, each leading to raw controls."""

# GUI control, raw control for its positive half, raw control for its negative half or "".
# {s} stands for the side.
SIDED = [
    ("CTRL_{s}_brow_down.ty", "browDown", ""),
    ("CTRL_{s}_brow_raiseIn.ty", "browRaiseIn", ""),
    ("CTRL_{s}_brow_raiseOut.ty", "browRaiseOuter", ""),
    ("CTRL_{s}_eye_blink.ty", "eyeBlink", "eyeWiden"),
    ("CTRL_{s}_eye_squintInner.ty", "eyeSquintInner", ""),
    ("CTRL_{s}_eye_cheekRaise.ty", "eyeCheekRaise", ""),
    ("CTRL_{s}_eye.ty", "eyeLookUp", "eyeLookDown"),
    ("CTRL_{s}_eye.tx", "eyeLookLeft", "eyeLookRight"),
    ("CTRL_{s}_nose.ty", "noseWrinkle", "noseNostrilDepress"),
    ("CTRL_{s}_nose.tx", "noseNostrilDilate", "noseNostrilCompress"),
    ("CTRL_{s}_mouth_suckBlow.ty", "mouthCheekBlow", ""),
    ("CTRL_{s}_mouth_upperLipRaise.ty", "mouthUpperLipRaise", ""),
    ("CTRL_{s}_mouth_lowerLipDepress.ty", "mouthLowerLipDepress", ""),
    ("CTRL_{s}_mouth_cornerPull.ty", "mouthCornerPull", ""),
    ("CTRL_{s}_mouth_sharpCornerPull.ty", "mouthSharpCornerPull", ""),
    ("CTRL_{s}_mouth_stretch.ty", "mouthStretch", ""),
    ("CTRL_{s}_mouth_dimple.ty", "mouthDimple", ""),
    ("CTRL_{s}_mouth_cornerDepress.ty", "mouthCornerDepress", ""),
    ("CTRL_{s}_mouth_pressU.ty", "mouthPressU", ""),
    ("CTRL_{s}_mouth_pressD.ty", "mouthPressD", ""),
    ("CTRL_{s}_mouth_purseU.ty", "mouthLipsPurseU", ""),
    ("CTRL_{s}_mouth_purseD.ty", "mouthLipsPurseD", ""),
    ("CTRL_{s}_mouth_funnelU.ty", "mouthFunnelU", ""),
    ("CTRL_{s}_mouth_funnelD.ty", "mouthFunnelD", ""),
    ("CTRL_{s}_mouth_lipsTogetherU.ty", "mouthLipsTogetherU", ""),
    ("CTRL_{s}_mouth_lipsTogetherD.ty", "mouthLipsTogetherD", ""),
    ("CTRL_{s}_mouth_lipsPressU.ty", "mouthLipsPress", ""),
    ("CTRL_{s}_mouth_lipsRollU.ty", "mouthUpperLipRollIn", ""),
    ("CTRL_{s}_mouth_lipsRollD.ty", "mouthLowerLipRollIn", ""),
    ("CTRL_{s}_jaw_ChinRaiseU.ty", "jawChinRaiseU", ""),
    ("CTRL_{s}_jaw_ChinRaiseD.ty", "jawChinRaiseD", ""),
    ("CTRL_{s}_neck_stretch.ty", "neckStretch", ""),
]
MIDDLE = [
    ("CTRL_C_mouth.tx", "mouthLeft", "mouthRight"),
    ("CTRL_C_mouth.ty", "mouthUp", "mouthDown"),
    ("CTRL_C_jaw.ty", "jawOpen", ""),
    ("CTRL_C_jaw.tx", "jawLeft", "jawRight"),
    ("CTRL_C_jaw_fwdBack.ty", "jawFwd", "jawBack"),
    ("CTRL_C_jaw_openExtreme.ty", "jawOpenExtreme", ""),
    ("CTRL_C_tongue_inOut.ty", "tongueOut", ""),
]


def gui_table() -> list[tuple[str, str, str]]:
    """(GUI control, raw control of its positive half, of its negative half or "")."""
    rows = []
    for gui, up, down in SIDED:
        for side in ("L", "R"):
            rows.append((gui.format(s=side), up + side, down + side if down else ""))
    return rows + MIDDLE
