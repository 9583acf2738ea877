# SPDX-License-Identifier: MIT
"""Makes the expression of each raw control: displacements of all vertices, and joint motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from risorius.author.geometry.rigid import about, part_rotation, rigid_fit, rigid_way
from risorius.base.easing import smooth_step
from risorius.controls.arkit import mapping

from .folds import from_laugh_line
from .further import find_places, further_units, unit_shape
from .polygons import Floats, Ints
from .source import BaseMesh, Source

# decimetres: largest displacement of the ball of the cheek and of the skin roll at the laugh line
_CHEEK_BALL, _ROLL = 0.032, 0.022
PREFIX = "CTRL_expressions."
LIPS_TOGETHER = [f"mouthLipsTogether{lip}{side}" for lip in "UD" for side in "LR"]
CLOSED = ("jawOpen", *LIPS_TOGETHER)
_BROWS = [f"eyebrows-{side}-{way}" for side in ("left", "right") for way in ("down", "up")]


@dataclass
class Expression:
    """The motion of a raw control at 1, and the part of it that joints perform."""

    displacement: Floats  # [V, 3], decimetres: the whole motion, including that of the joints
    # joint -> (rotation matrix [3, 3] about the joint's position, translation [3] in decimetres)
    joints: dict[str, tuple[Floats, Floats]] = field(default_factory=dict)


def side_masks(positions: Floats) -> dict[str, Floats]:
    """Weights of the left and right side at each vertex: `L` or `R` -> float64[V].

    Both weights of a vertex sum to 1. The character's left is +x.
    """
    left = smooth_step(positions[:, 0] / 0.5 + 0.5)
    return {"L": left, "R": 1 - left}


def lip_masks(jaw_open: Floats) -> dict[str, Floats]:
    """`U` or `D` -> float64[V], weight of the upper or lower lip at each vertex; both sum to 1.

    The lips touch, so their positions cannot distinguish them. The lower lip consists of the
    vertices that jawOpen moves.
    """
    travel = np.linalg.norm(jaw_open, axis=1)
    lower = smooth_step(travel / (0.55 * np.quantile(travel[travel > 0], 0.95)))
    return {"U": 1 - lower, "D": lower}


def split_units(source: Source, positions: Floats) -> dict[str, Expression]:
    """Splits the shape of each ARKit unit among the raw controls that arkit.toml lists for it.

    Args:
        source: the data with the units.
        positions: float64[V, 3] in decimetres, which distinguish left from right.
    """
    count = len(positions)
    sides = side_masks(positions)
    lips = lip_masks(source.face_unit("jawOpen", count))
    out: dict[str, Expression] = {}
    for unit, row in mapping().items():
        whole = source.face_unit(unit, count)
        names = [name.removeprefix(PREFIX) for name in row]
        for name in names:
            mask = np.ones(count)
            if len(names) > 1:
                if {n[-1] for n in names} == {"L", "R"}:
                    mask = mask * sides[name[-1]]
                if {n[-2] for n in names} == {"U", "D"}:
                    mask = mask * lips[name[-2]]
            out[name] = Expression(whole * mask[:, None])
    return out


def extra_units(
    source: Source, positions: Floats, origin: Mapping[str, float]
) -> dict[str, Expression]:
    """Makes expressions beyond ARKit from FACS-like targets of the data.

    Args:
        source: the data with the targets.
        positions: float64[V, 3] in decimetres, which distinguish left from right.
        origin: one of ORIGINS (parts of the world) -> its share in the person; the sum is 1.
    """
    sides = side_masks(positions)

    def unit(name: str) -> Floats:
        return unit_shape(source, origin, name, len(positions))

    out = {}
    halves = {
        "neckStretch": unit("neck-platysma"),
        "noseNostrilCompress": unit("nose-compression"),
        "noseNostrilDepress": unit("nose-depression"),
        "mouthLipsPress": unit("mouth-compression"),
        "mouthSharpCornerPull": unit("mouth-corner-puller"),
    }
    for name, whole in halves.items():
        for side, mask in sides.items():
            out[name + side] = Expression(whole * mask[:, None])
    out["noseNostrilDilateL"] = Expression(unit("nose-left-dilatation"))
    out["noseNostrilDilateR"] = Expression(unit("nose-right-dilatation"))
    out["mouthUp"] = Expression(unit("mouth-elevation"))
    out["mouthDown"] = Expression(unit("mouth-depression"))
    return out


def add_further_units(
    out: dict[str, Expression],
    source: Source,
    base: BaseMesh,
    groups: dict[str, Ints],
    positions: Floats,
    origin: Mapping[str, float],
) -> dict[tuple[str, str], Floats]:
    """Adds the expressions of further.toml, for which the data have no units.

    Args:
        out: raw control -> expression; changed.
        source: the data.
        base: the base mesh.
        groups: name of a group of the base mesh -> vertex indices.
        positions: float64[V, 3], in decimetres.
        origin: one of ORIGINS (parts of the world) -> its share in the person; the sum is 1.

    Returns:
        Correctives: two raw controls -> float64[V, 3].
    """
    count = len(positions)
    brows = sum(np.abs(unit_shape(source, origin, name, count)) for name in _BROWS)
    jaw_open = out["jawOpen"].displacement
    places = find_places(base, positions, groups, jaw_open, np.asarray(brows))
    units = {name: unit.displacement for name, unit in out.items()}
    further, correctives = further_units(source, origin, places, units, side_masks(positions))
    for name, displacement in further.items():
        out[name] = Expression(displacement)
    return correctives


def add_joint_motion(
    out: dict[str, Expression],
    groups: dict[str, Floats],
    positions: Floats,
    pivots: dict[str, Floats],
) -> None:
    """Adds joint motions of jaw, teeth and eyes.

    The jaw joint gets the rigid motion that best fits the lower teeth, a teeth joint the mean shift
    of its teeth, and an eye joint the rotation that best fits its eyeball.

    Args:
        out: raw control -> expression; changed; jawBack and jawOpenExtreme are added.
        groups: name of a group of the base mesh -> vertex indices.
        positions: float64[V, 3], in decimetres.
        pivots: name of a joint -> float64[3], its position.
    """
    teeth = groups["helper-lower-teeth"]
    jaw = pivots["FACIAL_C_Jaw"]
    for name in ("jawOpen", "jawLeft", "jawRight", "jawFwd"):
        moved = positions[teeth] + out[name].displacement[teeth]
        out[name].joints["FACIAL_C_Jaw"] = about(jaw, *rigid_fit(positions[teeth], moved))
    forward = out["jawFwd"].joints["FACIAL_C_Jaw"][1]
    out["jawBack"] = Expression(
        -0.4 * out["jawFwd"].displacement, {"FACIAL_C_Jaw": (np.eye(3), -0.4 * forward)}
    )
    rotation, shift = out["jawOpen"].joints["FACIAL_C_Jaw"]
    out["jawOpenExtreme"] = Expression(
        0.4 * out["jawOpen"].displacement,
        {"FACIAL_C_Jaw": (part_rotation(rotation, 0.4), 0.4 * shift)},
    )
    for jaw_side, ends in (("Upper", "U"), ("Lower", "D")):
        teeth = groups[f"helper-{jaw_side.lower()}-teeth"]
        for name in [n for n in out if n.startswith("teeth") and n.endswith(ends)]:
            shift = out[name].displacement[teeth].mean(axis=0)
            out[name].joints[f"FACIAL_C_Teeth{jaw_side}"] = (np.eye(3), shift)
    for side, letter in (("L", "l"), ("R", "r")):
        eye = groups[f"helper-{letter}-eye"]
        for look in ("Up", "Down", "Left", "Right"):
            expression = out[f"eyeLook{look}{side}"]
            moved = positions[eye] + expression.displacement[eye]
            rotation, _ = rigid_fit(positions[eye], moved)
            expression.joints[f"FACIAL_{side}_Eye"] = (rotation, np.zeros(3))


def cheek_mass(units: dict[str, Expression], places: Floats, side: str) -> Floats:
    """float64[V, 3]: the displacement that bulges a cheek in a true smile.

    The bulge ends at the laugh line, where the skin folds in. Vertices that the controls of the
    smile do not move, such as the teeth, have no displacement.

    Args:
        units: raw control -> expression.
        places: float64[V, 3] on the man's head, relative to the point between his eyes, in
            decimetres.
        side: L or R.
    """
    away, there = from_laugh_line(places)
    x, y = np.abs(places[:, 0]), places[:, 1]
    ball = np.exp(-(((x - 0.40) / 0.15) ** 2) - ((y + 0.36) / 0.15) ** 2)
    ball *= smooth_step((places[:, 2] + 0.45) / 0.3)
    roll = there * np.exp(-(((away - 0.06) / 0.07) ** 2))
    dip = there * np.exp(-(((away + 0.015) / 0.03) ** 2))
    own = 1.0 if side == "L" else -1.0
    half = places[:, 0] * own > 0
    out = _CHEEK_BALL * ball[:, None] * [0.35 * own, 0.25, 0.9]
    out = out * smooth_step((away + 0.02) / 0.06)[:, None]
    out += _ROLL * (roll[:, None] * [0.3 * own, -0.1, 0.9] - 0.6 * dip[:, None] * [0.0, 0.0, 1.0])
    moved = [units[name + side].displacement for name in ("mouthCornerPull", "eyeCheekRaise")]
    soft = smooth_step(np.linalg.norm(moved, axis=2).max(axis=0) / 0.02)
    return np.asarray(out * (half * soft)[:, None])


def leave_bones(
    out: dict[str, Expression],
    groups: dict[str, Ints],
    positions: Floats,
    pivots: dict[str, Floats],
) -> None:
    """Moves teeth and eyeballs by their joints alone, so that they stay rigid.

    The pupil controls are excepted: they keep their displacements of the eyeballs.

    Args:
        out: raw control -> expression with its joints; displacements are changed.
        groups: name of a group of the base mesh -> vertex indices.
        positions: float64[V, 3], in decimetres.
        pivots: name of a joint -> float64[3], its position.
    """
    bones: dict[str, tuple[str, ...]] = {
        "helper-upper-teeth": ("FACIAL_C_TeethUpper",),
        "helper-lower-teeth": ("FACIAL_C_TeethLower", "FACIAL_C_Jaw"),
    }
    for side, letter in (("L", "l"), ("R", "r")):
        for name in ("helper-{}-eye", "eyeball-{}", "cornea-{}"):
            bones[name.format(letter)] = (f"FACIAL_{side}_Eye",)
    for name, unit in out.items():
        unit.displacement = unit.displacement.copy()
        for group, joints in bones.items():
            if "Pupil" in name and "teeth" not in group:
                continue
            at = positions[groups[group]]
            way = np.zeros_like(at)
            for joint in joints:
                if joint in unit.joints:
                    way += rigid_way(at, pivots[joint], *unit.joints[joint])
            unit.displacement[groups[group]] = way


def take_closing(out: dict[str, Expression]) -> dict[tuple[str, str], Floats]:
    """Removes the displacements that close the lips of an open jaw, and returns them.

    Returns ("jawOpen", one of LIPS_TOGETHER) -> float64[V, 3].

    The data's shape assumes an open jaw. If the jaw is shut, the shape would lift the lower lip
    far over the upper one. Therefore the controls alone move nothing, and their displacements
    become correctives for the open jaw.

    Args:
        out: raw control -> expression; the displacements of LIPS_TOGETHER become 0.
    """
    result: dict[tuple[str, str], Floats] = {}
    for name in LIPS_TOGETHER:
        result[("jawOpen", name)] = out[name].displacement
        out[name] = Expression(np.zeros_like(out[name].displacement))
    return result


def corrective_displacements(
    out: dict[str, Expression], places: Floats
) -> dict[tuple[str, str], Floats]:
    """Correctives: two raw controls -> displacement, whose weight is the product of both controls.

    Args:
        out: raw control -> expression.
        places: float64[V, 3] of the man's vertices, relative to the point between his eyes, in
            decimetres.
    """
    lower = lip_masks(out["jawOpen"].displacement)["D"][:, None]
    result: dict[tuple[str, str], Floats] = {}
    for side in ("L", "R"):
        # The open jaw stretches the lower lip, so a smile lifts the lip less.
        smile = out[f"mouthCornerPull{side}"].displacement
        result[("jawOpen", f"mouthCornerPull{side}")] = -0.3 * lower * smile
        # If the cheek raises the lower lid, the upper lid has a shorter way to close.
        blink = out[f"eyeBlink{side}"].displacement
        raised = out[f"eyeCheekRaise{side}"].displacement
        travel = np.linalg.norm(blink, axis=1)
        lid_rise = np.clip(raised[:, 1], 0, None)
        near = travel > 0.02
        share = np.zeros(len(blink))
        share[near] = np.minimum(0.25, lid_rise[near].max() / max(travel.max(), 1e-9))
        result[(f"eyeBlink{side}", f"eyeCheekRaise{side}")] = -share[:, None] * blink
        ball = cheek_mass(out, places, side)
        result[(f"mouthCornerPull{side}", f"eyeCheekRaise{side}")] = ball
        for lips in ("mouthFunnel", "mouthLipsPurse"):
            # The open jaw moves the lower lip off the teeth, so the lip is pushed forward less.
            result[("jawOpen", f"{lips}D{side}")] = -0.25 * out[f"{lips}D{side}"].displacement
    return result
