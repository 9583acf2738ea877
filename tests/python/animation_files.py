# SPDX-License-Identifier: MIT
"""Files of animation as the tools write them: header order, decimals, quotes, line ends.

What each follows:

* Live Link Face: takes of the app as published recordings show them. 63 columns, 10 decimals, LF;
  BlendShapeCount 61; timecode HH:MM:SS:FF.sss where FF counts 60 a second while rows come 30 times
  a second; a row that the phone could not write is missing; head columns 0.0000000000 where head
  streaming is off.
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
MouthLeft MouthSmileLeft MouthSmileRight MouthFrownLeft MouthFrownRight MouthDimpleLeft MouthDimpleRight
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
    """HH:MM:SS:FF.sss of seconds since midnight, with thousandths of a frame."""
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
    """Text of a take. Args: [rows, names]; seconds since midnight of each row."""
    lines = ["Timecode,BlendShapeCount," + ",".join(names)]
    stated = len(names) if count is None else count
    for at, row in zip(seconds, rows, strict=True):
        lines.append(f"{timecode(at, base)},{stated}," + ",".join(f"{v:.10f}" for v in row))
    return "\n".join(lines) + "\n"


def capture(count: int, names: list[str] = COLUMNS) -> np.ndarray:
    """Values [count, names] of 10 decimals, each column another; rotations to 0.6 both ways."""
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
