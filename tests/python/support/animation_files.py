# SPDX-License-Identifier: MIT
"""Writes animation files exactly as other programs do, for tests of importers.

Sources of the formats:

* Live Link Face: recordings of the app that were published. 63 columns, 10 decimals, LF;
  BlendShapeCount 61; timecode HH:MM:SS:FF.sss, where FF counts 60 per second although there are
  30 rows per second; rows that the phone could not write are missing; head columns are
  0.0000000000 if head streaming is off.
* Audio2Face: the solver's export {exportFps, trackPath, numPoses, numFrames, facsNames, weightMat,
  joints, rotations, translations}; and animation_frames.csv of the service, which pandas writes
  with its row numbers in a column without a header: ,timeCode,blendShapes.EyeBlinkLeft,...
* Unreal: a curve table as JSON, [{"Name": ..., "0": ...}]; an exported animation's
  RawCurveData.FloatCurves with keys of InterpMode, Time and Value.
"""

from __future__ import annotations

import json

import numpy as np

SIDED_EYE = [
    "EyeBlink",
    "EyeLookDown",
    "EyeLookIn",
    "EyeLookOut",
    "EyeLookUp",
    "EyeSquint",
    "EyeWide",
]
MOUTH = """JawForward JawRight JawLeft JawOpen MouthClose MouthFunnel MouthPucker MouthRight
MouthLeft MouthSmileLeft MouthSmileRight MouthFrownLeft MouthFrownRight MouthDimpleLeft
MouthDimpleRight
MouthStretchLeft MouthStretchRight MouthRollLower MouthRollUpper MouthShrugLower MouthShrugUpper
MouthPressLeft MouthPressRight MouthLowerDownLeft MouthLowerDownRight MouthUpperUpLeft
MouthUpperUpRight BrowDownLeft BrowDownRight BrowInnerUp BrowOuterUpLeft BrowOuterUpRight CheekPuff
CheekSquintLeft CheekSquintRight NoseSneerLeft NoseSneerRight TongueOut""".split()
SHAPES = [name + side for side in ("Left", "Right") for name in SIDED_EYE] + MOUTH
ROTATIONS = """HeadYaw HeadPitch HeadRoll LeftEyeYaw LeftEyePitch LeftEyeRoll RightEyeYaw
RightEyePitch RightEyeRoll""".split()
COLUMNS = SHAPES + ROTATIONS


def camel(name: str) -> str:
    return name[0].lower() + name[1:]


def timecode(seconds: float, base: int) -> str:
    """Seconds since midnight as HH:MM:SS:FF.sss.

    FF counts frames of 1 / base s, sss thousandths of a frame.
    """
    units = round((seconds % 86400.0) * base * 1000)
    frames, rest = divmod(units, 1000)
    whole, frame = divmod(frames, base)
    return f"{whole // 3600:02}:{whole // 60 % 60:02}:{whole % 60:02}:{frame:02}.{rest:03}"


def live_link_face(
    rows: np.ndarray,
    seconds: np.ndarray,
    *,
    base: int = 60,
    names: list[str] = COLUMNS,
    count: int | None = None,
) -> str:
    """CSV text of a take.

    Args:
        rows: values of the columns, float[frames, names].
        seconds: times of the frames since midnight, in seconds.
        base: frames per second of the timecode.
        names: names of the columns after BlendShapeCount.
        count: number that the column BlendShapeCount states; None: the number of names.
    """
    lines = ["Timecode,BlendShapeCount," + ",".join(names)]
    stated = len(names) if count is None else count
    for at, row in zip(seconds, rows, strict=True):
        lines.append(f"{timecode(at, base)},{stated}," + ",".join(f"{v:.10f}" for v in row))
    return "\n".join(lines) + "\n"


def capture(count: int, names: list[str] = COLUMNS) -> np.ndarray:
    """Sine curves for `count` frames, float64[count, names], rounded to 10 decimals.

    Values lie in 0 to 1, and in -0.6 to 0.6 in columns whose name ends with Yaw, Pitch or Roll.
    """
    at = np.arange(count)[:, None]
    column = np.arange(len(names))[None, :]
    values = 0.5 + 0.5 * np.sin(0.11 * at + 0.7 * column)
    angles = np.array([name.endswith(("Yaw", "Pitch", "Roll")) for name in names])
    return np.round(np.where(angles, 1.2 * values - 0.6, values), 10)


def audio2face_json(rows: np.ndarray, names: list[str], fps: float = 30.0) -> str:
    return json.dumps(
        {
            "exportFps": fps,
            "trackPath": "/tmp/voice.wav",
            "numPoses": len(names),
            "numFrames": len(rows),
            "facsNames": names,
            "weightMat": rows.tolist(),
            "joints": ["jaw", "eye_L"],
            "rotations": [[[0.0, 0.0, 0.0, 1.0]] * 2] * len(rows),
            "translations": [[[0.0, 0.0, 0.0]] * 2] * len(rows),
        }
    )


def audio2face_csv(rows: np.ndarray, names: list[str], times: np.ndarray) -> str:
    lines = [",timeCode," + ",".join("blendShapes." + name for name in names)]
    for i, (at, row) in enumerate(zip(times, rows, strict=True)):
        lines.append(f"{i},{float(at)!r}," + ",".join(repr(float(v)) for v in row))
    return "\n".join(lines) + "\n"


def unreal_curve_table(curves: dict[str, dict[float, float]]) -> str:
    table = [
        {"Name": name, **{f"{t:g}": v for t, v in keys.items()}} for name, keys in curves.items()
    ]
    return json.dumps(table, indent="\t").replace("\n", "\r\n")


def unreal_animation(curves: dict[str, dict[float, float]], mode: str = "RCIM_Linear") -> str:
    def keys(points: dict[float, float]) -> list[dict[str, object]]:
        return [
            {"InterpMode": mode, "TangentMode": "RCTM_Auto", "Time": t, "Value": v}
            for t, v in points.items()
        ]

    floats = [
        {"CurveName": name, "CurveTypeFlags": 4, "FloatCurve": {"Keys": keys(points)}}
        for name, points in curves.items()
    ]
    return json.dumps(
        [{"Type": "AnimSequence", "Name": "A_Take", "RawCurveData": {"FloatCurves": floats}}],
        indent=2,
    )


def rhubarb_tsv(cues: list[tuple[float, float, str]]) -> str:
    """Rhubarb's TSV: start in seconds, tab, shape; then X at the end of the last cue.

    cues: (start in seconds, end in seconds, mouth shape); each cue begins where the last one ends.
    """
    lines = [f"{start:.2f}\t{shape}\n" for start, _, shape in cues]
    return "".join(lines) + f"{cues[-1][1]:.2f}\tX\n"


def rhubarb_xml(cues: list[tuple[float, float, str]]) -> str:
    """Rhubarb's XML, formatted by Boost's property tree with 2 spaces per level."""
    rows = [
        f'    <mouthCue start="{start:.2f}" end="{end:.2f}">{shape}</mouthCue>\n'
        for start, end, shape in cues
    ]
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<rhubarbResult>\n  <metadata>\n'
        "    <soundFile>/home/me/a &amp; b.wav</soundFile>\n"
        f"    <duration>{cues[-1][1]:.2f}</duration>\n  </metadata>\n  <mouthCues>\n"
        + "".join(rows)
        + "  </mouthCues>\n</rhubarbResult>\n"
    )


def rhubarb_json(cues: list[tuple[float, float, str]]) -> str:
    """Rhubarb's JSON, which has one cue per line."""
    rows = [
        f'    {{ "start": {start:.2f}, "end": {end:.2f}, "value": "{shape}" }}'
        for start, end, shape in cues
    ]
    return (
        '{\n  "metadata": {\n    "soundFile": "C:\\\\takes\\\\a.wav",\n'
        f'    "duration": {cues[-1][1]:.2f}\n  }},\n  "mouthCues": [\n'
        + ",\n".join(rows)
        + "\n  ]\n}\n"
    )


# Words of a Papagayo document with 24 frames per second: (text, first frame, last frame, [(first
# frame, phoneme)]).
WORDS = [
    ("hello", 6, 17, [(6, "AI"), (9, "L"), (13, "O")]),
    ("bob", 24, 35, [(24, "MBP"), (28, "O")]),
]


def papagayo_pgo() -> str:
    """WORDS in Papagayo's version 1: tabs show the level of a line, "|" replaces line ends."""
    out = ["lipsync version 1", "voice.wav", "24", "72", "1"]
    out += ["\tVoice 1", "\thello|bob", "\t1", "\t\thello bob", "\t\t6", "\t\t35", "\t\t2"]
    for text, first, last, phonemes in WORDS:
        out.append(f"\t\t\t{text} {first} {last} {len(phonemes)}")
        out += [f"\t\t\t\t{frame} {shape}" for frame, shape in phonemes]
    return "\n".join(out) + "\n"


def papagayo_pgo_json() -> str:
    """WORDS in Papagayo's version 2, the JSON of Papagayo-NG."""
    words = [
        {
            "id": i, "text": text, "start_frame": first, "end_frame": last, "tags": [],
            "phonemes": [
                {"id": k, "text": shape, "frame": frame, "tags": []}
                for k, (frame, shape) in enumerate(phonemes)
            ],
        }
        for i, (text, first, last, phonemes) in enumerate(WORDS)
    ]  # fmt: skip
    phrase = {
        "id": 0,
        "text": "hello bob",
        "start_frame": 6,
        "end_frame": 35,
        "tags": [],
        "words": words,
    }
    voice = {"name": "Voice 1", "start_frame": 6, "end_frame": 35, "text": "hello\nbob"}
    return json.dumps(
        {
            "version": 2,
            "sound_path": "voice.wav",
            "fps": 24,
            "sound_duration": 72,
            "num_voices": 1,
            "voices": [{**voice, "num_children": 8, "phrases": [phrase]}],
        },
        indent=True,
    )


def moho_dat() -> str:
    """WORDS in Papagayo's export for Moho: frames from 1, a rest at both ends of each pause."""
    rows = [
        "1 rest",
        "6 rest",
        "7 AI",
        "10 L",
        "14 O",
        "19 rest",
        "24 rest",
        "25 MBP",
        "29 O",
        "37 rest",
    ]
    return "MohoSwitch1\n" + "\n".join(rows) + "\n"
