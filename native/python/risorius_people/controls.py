# SPDX-License-Identifier: MIT
"""GUI controls of the sample people: names, ranges, and their mapping to raw controls."""

# (GUI control, raw control for its positive half, raw control for its negative half or ""). {s} is
# replaced by L or R; the names of the raw controls get the same letter at their end.
SIDED = [
    ("CTRL_{s}_brow_down.ty", "browDown", ""),
    ("CTRL_{s}_brow_lateral.ty", "browLateral", ""),
    ("CTRL_{s}_ear_up.ty", "earUp", ""),
    ("CTRL_{s}_brow_raiseIn.ty", "browRaiseIn", ""),
    ("CTRL_{s}_brow_raiseOut.ty", "browRaiseOuter", ""),
    ("CTRL_{s}_eye_blink.ty", "eyeBlink", "eyeWiden"),
    ("CTRL_{s}_eye_lidPress.ty", "eyeLidPress", ""),
    ("CTRL_{s}_eye_faceScrunch.ty", "eyeFaceScrunch", ""),
    ("CTRL_{s}_eye_eyelidU.ty", "eyeUpperLidUp", "eyeRelax"),
    ("CTRL_{s}_eye_eyelidD.ty", "eyeLowerLidUp", "eyeLowerLidDown"),
    ("CTRL_{s}_eye_pupil.ty", "eyePupilWide", "eyePupilNarrow"),
    ("CTRL_{s}_eyelashes_tweakerIn.ty", "eyelashesUpIN", "eyelashesDownIN"),
    ("CTRL_{s}_eyelashes_tweakerOut.ty", "eyelashesUpOUT", "eyelashesDownOUT"),
    ("CTRL_{s}_eye_squintInner.ty", "eyeSquintInner", ""),
    ("CTRL_{s}_eye_cheekRaise.ty", "eyeCheekRaise", ""),
    ("CTRL_{s}_eye.ty", "eyeLookUp", "eyeLookDown"),
    ("CTRL_{s}_eye.tx", "eyeLookLeft", "eyeLookRight"),
    ("CTRL_{s}_nose.ty", "noseWrinkle", "noseNostrilDepress"),
    ("CTRL_{s}_nose.tx", "noseNostrilDilate", "noseNostrilCompress"),
    ("CTRL_{s}_nose_wrinkleUpper.ty", "noseWrinkleUpper", ""),
    ("CTRL_{s}_nose_nasolabialDeepen.ty", "noseNasolabialDeepen", ""),
    ("CTRL_{s}_mouth_suckBlow.ty", "mouthCheekBlow", "mouthCheekSuck"),
    ("CTRL_{s}_mouth_lipsBlow.ty", "mouthLipsBlow", ""),
    ("CTRL_{s}_mouth_upperLipRaise.ty", "mouthUpperLipRaise", ""),
    ("CTRL_{s}_mouth_lowerLipDepress.ty", "mouthLowerLipDepress", ""),
    ("CTRL_{s}_mouth_cornerPull.ty", "mouthCornerPull", ""),
    ("CTRL_{s}_mouth_sharpCornerPull.ty", "mouthSharpCornerPull", ""),
    ("CTRL_{s}_mouth_stretch.ty", "mouthStretch", ""),
    ("CTRL_{s}_mouth_stretchLipsClose.ty", "mouthStretchLipsClose", ""),
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
    ("CTRL_{s}_mouth_lipsRollU.ty", "mouthUpperLipRollIn", "mouthUpperLipRollOut"),
    ("CTRL_{s}_mouth_lipsRollD.ty", "mouthLowerLipRollIn", "mouthLowerLipRollOut"),
    ("CTRL_{s}_mouth_corner.ty", "mouthCornerUp", "mouthCornerDown"),
    ("CTRL_{s}_mouth_corner.tx", "mouthCornerWide", "mouthCornerNarrow"),
    ("CTRL_{s}_mouth_lipBiteU.ty", "mouthUpperLipBite", ""),
    ("CTRL_{s}_mouth_lipBiteD.ty", "mouthLowerLipBite", ""),
    ("CTRL_{s}_mouth_lipsTowardsTeethU.ty", "mouthUpperLipTowardsTeeth", ""),
    ("CTRL_{s}_mouth_lipsTowardsTeethD.ty", "mouthLowerLipTowardsTeeth", ""),
    ("CTRL_{s}_jaw_clench.ty", "jawClench", ""),
    ("CTRL_{s}_jaw_chinCompress.ty", "jawChinCompress", ""),
    ("CTRL_{s}_neck_mastoidContract.ty", "neckMastoidContract", ""),
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
    ("CTRL_neck_throatUpDown.ty", "neckThroatUp", "neckThroatDown"),
    ("CTRL_neck_digastricUpDown.ty", "neckDigastricUp", "neckDigastricDown"),
    ("CTRL_neck_throatExhaleInhale.ty", "neckThroatExhale", "neckThroatInhale"),
    ("CTRL_C_tongue_inOut.ty", "tongueOut", "tongueIn"),
    ("CTRL_C_tongue_move.ty", "tongueUp", "tongueDown"),
    ("CTRL_C_tongue_move.tx", "tongueLeft", "tongueRight"),
    ("CTRL_C_tongue_press.ty", "tonguePress", ""),
    ("CTRL_C_tongue_wideNarrow.ty", "tongueWide", "tongueNarrow"),
    ("CTRL_C_tongue_bendTwist.ty", "tongueBendUp", "tongueBendDown"),
    ("CTRL_C_tongue_bendTwist.tx", "tongueTwistLeft", "tongueTwistRight"),
    ("CTRL_C_tongue_roll.ty", "tongueRoll", ""),
    ("CTRL_C_tongue_tipMove.ty", "tongueTipUp", "tongueTipDown"),
    ("CTRL_C_tongue_tipMove.tx", "tongueTipLeft", "tongueTipRight"),
    ("CTRL_C_tongue_thickThin.ty", "tongueThick", "tongueThin"),
]
# GUI controls of lips and teeth, as in SIDED; {v} is replaced by U (upper) or D (lower), {s} by L
# or R.
LIPS = [
    ("CTRL_{s}_mouth_towards{v}.ty", "mouthLipsTowards{v}", ""),
    ("CTRL_{s}_mouth_tighten{v}.ty", "mouthLipsTighten{v}", ""),
    ("CTRL_{s}_mouth_stickyInner{v}.ty", "mouthSticky{v}IN", ""),
    ("CTRL_{s}_mouth_stickyOuter{v}.ty", "mouthSticky{v}OUT", ""),
    ("CTRL_{s}_mouth_pushPull{v}.ty", "mouthLipsPush{v}", "mouthLipsPull{v}"),
    ("CTRL_{s}_mouth_thickness{v}.ty", "mouthLipsThick{v}", "mouthLipsThin{v}"),
    ("CTRL_{s}_mouth_thicknessInward{v}.ty", "mouthLipsThickInward{v}", "mouthLipsThinInward{v}"),
    ("CTRL_{s}_mouth_cornerSharpness{v}.ty", "mouthCornerSharpen{v}", "mouthCornerRounder{v}"),
]
LIPS_MIDDLE = [
    ("CTRL_C_mouth_sticky{v}.ty", "mouthSticky{v}C", ""),
    ("CTRL_C_mouth_lipShift{v}.ty", "mouth{lip}LipShiftLeft", "mouth{lip}LipShiftRight"),
    ("CTRL_C_teeth{v}.ty", "teethUp{v}", "teethDown{v}"),
    ("CTRL_C_teeth{v}.tx", "teethLeft{v}", "teethRight{v}"),
    ("CTRL_C_teeth_fwdBack{v}.ty", "teethFwd{v}", "teethBack{v}"),
]
# STICKY and SWALLOW: (GUI control, raw controls that rise one after the other while the GUI control
# goes from 0 to 1). The raw controls of STICKY stay at 1; the ones of SWALLOW fall back to 0.
STICKY = ("CTRL_{s}_mouth_lipSticky.ty", [f"mouthLipsSticky{{s}}Ph{n}" for n in (1, 2, 3)])
SWALLOW = ("CTRL_C_neck_swallow.ty", [f"neckSwallowPh{n}" for n in (1, 2, 3, 4)])
# (from, to, slope, cut): for an input from `from` to `to`, the output is slope * input + cut.
Range = tuple[float, float, float, float]


def gui_table() -> list[tuple[str, list[tuple[str, Range]]]]:
    """(GUI control, its raw controls with their input ranges) for each GUI control."""
    rows = []
    for side in "LR":
        for gui, up, down in SIDED:
            rows.append((gui.format(s=side), up + side, down + side if down else ""))
        for gui, up, down in LIPS:
            for v in "UD":
                both = (up.format(v=v) + side, down.format(v=v) + side if down else "")
                rows.append((gui.format(s=side, v=v), *both))
    rows += MIDDLE
    for gui, up, down in LIPS_MIDDLE:
        for v, lip in (("U", "Upper"), ("D", "Lower")):
            rows.append((gui.format(v=v), up.format(v=v, lip=lip), down.format(v=v, lip=lip)))
    table = [(gui, _two_sided(up, down)) for gui, up, down in rows]
    for side in "LR":
        gui, phases = STICKY
        table.append((gui.format(s=side), _filling([name.format(s=side) for name in phases])))
    table.append((SWALLOW[0], _passing(SWALLOW[1])))
    return table


def _two_sided(up: str, down: str) -> list[tuple[str, Range]]:
    return [(up, (0, 1, 1, 0)), *([(down, (-1, 0, -1, 0))] if down else [])]


def _filling(names: list[str]) -> list[tuple[str, Range]]:
    """Conditionals that raise raw controls from 0 to 1 one after the other; each control then stays
    at 1."""
    count = len(names)
    out: list[tuple[str, Range]] = []
    for k, name in enumerate(names):
        out.append((name, (k / count, (k + 1) / count, count, -k)))
        if k + 1 < count:
            out.append((name, ((k + 1) / count, 1, 0, 1)))
    return out


def _passing(names: list[str]) -> list[tuple[str, Range]]:
    """Conditionals that raise raw controls from 0 to 1 and lower them again, one after the other:
    each control starts to rise where the control before it has its peak."""
    count = len(names) + 1
    out: list[tuple[str, Range]] = []
    for k, name in enumerate(names):
        out.append((name, (k / count, (k + 1) / count, count, -k)))
        out.append((name, ((k + 1) / count, (k + 2) / count, -count, k + 2)))
    return out
