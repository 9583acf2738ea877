# SPDX-License-Identifier: MIT
"""Makes the body of a person, before its meshes: positions, skin weights and expressions."""

from __future__ import annotations

from copy import copy

import numpy as np
from risorius.author.geometry.rigid import rigid_way
from risorius.base.easing import smooth_step

from . import expressions as ex
from .clothes import collar_heights
from .eyes import Eyes, with_eyeballs
from .mouth.lips import Mouth, rims, sealed
from .people import MAN, Person
from .polygons import Floats, Ints
from .proportions import Proportions
from .source import TARGETS, BaseMesh, Source

FLOOR = 8.168  # decimetres from the soles up to the origin of the data
# The base mesh is cut at the neck where y - NECK_SLOPE * hypot(x, 0.35) equals NECK_CUT, with x and
# y in decimetres.
NECK_CUT = 5.36
NECK_SLOPE = 0.35
TEETH_SHOW = 0.035  # decimetres of the upper teeth that show below the lip of an open mouth
# Two heights above the collar's seam in decimetres. Expressions do not move skin below the first
# height, because the skin would come through the shirt, and fully move skin above the second one.
# The neckThroat expressions are not limited in this way.
COVERED = (0.06, 0.4)
REACH = 1.3  # largest |x| of head and neck: the hands are as high as the neck, but farther out
# (name, name of the parent or None) of each joint of the blend shape face.
JOINTS = [
    ("spine_04", None),
    ("neck_01", "spine_04"),
    ("neck_02", "neck_01"),
    ("head", "neck_02"),
    ("FACIAL_C_Jaw", "head"),
    ("FACIAL_L_Eye", "head"),
    ("FACIAL_R_Eye", "head"),
    ("FACIAL_C_TeethUpper", "head"),
    ("FACIAL_C_TeethLower", "FACIAL_C_Jaw"),
]


def group_indices(base: BaseMesh) -> dict[str, Ints]:
    return {
        name: np.unique([corner[0] for face in faces for corner in face])
        for name, faces in base.faces.items()
        if faces
    }


def shaped(source: Source, base: BaseMesh, person: Person) -> Floats:
    """float64[V, 3]: positions of the base mesh with the person's shapes, in decimetres.

    Args:
        source: the data with the shapes.
        base: the base mesh.
        person: the person, with the names and weights of the shapes.
    """
    count = len(base.positions)
    out = base.positions.copy()
    for name, weight in person.shape().items():
        out += weight * source.target(f"{TARGETS}{name}.target.gz", count)
    for name, weight in person.features.items():
        out += weight * source.feature(name, count)
    return out


def head_size(base: BaseMesh, positions: Floats) -> float:
    """Root mean square distance of the vertices above the neck from their mean, in decimetres.

    Args:
        base: the base mesh, whose positions define which vertices are above the neck.
        positions: float64[V, 3] of a person, in decimetres.
    """
    above = np.abs(base.positions[:, 0]) < REACH
    above &= base.positions[:, 1] > NECK_CUT + 0.5
    held = positions[above]
    return float(np.sqrt(((held - held.mean(axis=0)) ** 2).sum(axis=1).mean()))


def show_upper_teeth(
    positions: Floats, groups: dict[str, Ints], jaw_open: Floats, size: float
) -> None:
    """Lowers the upper teeth until TEETH_SHOW (3.5 mm) of them show below the upper lip of an open
    mouth.

    Args:
        positions: float64[V, 3] in decimetres; the vertices of the upper teeth are changed.
        groups: name of a group of the base mesh -> vertex indices.
        jaw_open: float64[V, 3], displacement of the unit jawOpen; lip vertices that it does not
            move belong to the upper lip.
        size: size of the head relative to the man's.
    """
    upper = groups["helper-upper-teeth"]
    body = positions[groups["body"]]
    still = np.linalg.norm(jaw_open[groups["body"]], axis=1) < 0.03 * size
    front = positions[upper][:, 2].max() - 0.05 * size
    lip = body[still & (np.abs(body[:, 0]) < 0.05 * size) & (body[:, 2] > front)]
    edge = positions[upper][:, 1].min()
    below_nose = lip[(lip[:, 1] > edge - 0.15 * size) & (lip[:, 1] < edge + 0.25 * size)]
    positions[upper, 1] += min(0.0, below_nose[:, 1].min() - TEETH_SHOW * size - edge)


def joint_positions(positions: Floats, groups: dict[str, Ints], size: float) -> dict[str, Floats]:
    """Name of a joint -> float64[3], its world position in decimetres.

    Args:
        positions: float64[V, 3], in decimetres.
        groups: name of a group of the base mesh -> vertex indices.
        size: size of the head relative to the man's.
    """

    def middle(group: str) -> Floats:
        return np.asarray(positions[groups[group]].mean(axis=0))

    neck, head = middle("joint-neck"), middle("joint-head")
    eyes = {s: middle(f"helper-{s.lower()}-eye") for s in "LR"}
    jaw_hinge = np.array([0, eyes["L"][1] * 0.62 + head[1] * 0.38, head[2] + 0.35 * size])
    return {
        "spine_04": neck + size * np.array([0, -0.55, -0.15]),
        "neck_01": neck,
        "neck_02": (neck + head) / 2,
        "head": head,
        "FACIAL_C_Jaw": jaw_hinge,
        "FACIAL_L_Eye": eyes["L"],
        "FACIAL_R_Eye": eyes["R"],
        "FACIAL_C_TeethUpper": middle("helper-upper-teeth"),
        "FACIAL_C_TeethLower": middle("helper-lower-teeth"),
    }


def spine_weights(positions: Floats, joints: dict[str, Floats]) -> Floats:
    """Skin weights [V, 9] by height along the tilted neck: columns of JOINTS, 0 after the first
    four.

    The first four joints are spine_04, neck_01, neck_02 and head.

    Args:
        positions: float64[V, 3], in decimetres.
        joints: name of a joint -> float64[3], its position.
    """
    # Chin and nose are as high as the neck but in front of it, and must follow the head.
    ahead = np.clip(positions[:, 2] - joints["head"][2] - 0.45, 0, None)
    height = positions[:, 1] + 0.8 * ahead
    levels = [joints[n][1] for n in ("spine_04", "neck_01", "neck_02", "head")]
    middles = [levels[0] + 0.15, levels[1] + 0.1, levels[2] - 0.1, levels[3] - 0.35]
    out = np.zeros((len(positions), len(JOINTS)))
    rest = np.ones(len(positions))
    for k in range(3):
        up = smooth_step((height - middles[k]) / (middles[k + 1] - middles[k]))
        out[:, k] = rest * (1 - up)
        rest = rest * up
    out[:, 3] = rest
    return out


def skin_weights(
    positions: Floats,
    groups: dict[str, Ints],
    joints: dict[str, Floats],
    jaw_open: ex.Expression,
) -> Floats:
    """Skin weights [V, 9] of the base mesh's vertices for the nine JOINTS; rows sum to 1.

    A vertex's weight of the jaw joint is the vertex's displacement by jawOpen along the rigid
    motion of the jaw joint, as a fraction of this motion. The tongue follows the jaw joint alone,
    each eye its eye joint, and each row of teeth its teeth joint.

    Args:
        positions: float64[V, 3], in decimetres.
        groups: name of a group of the base mesh -> vertex indices.
        joints: name of a joint -> float64[3], its position.
        jaw_open: the unit jawOpen with the motion of its joint.
    """
    weights = spine_weights(positions, joints)
    rigid = rigid_way(positions, joints["FACIAL_C_Jaw"], *jaw_open.joints["FACIAL_C_Jaw"])
    length = np.einsum("ij,ij->i", rigid, rigid)
    share = np.einsum("ij,ij->i", jaw_open.displacement, rigid) / np.maximum(length, 1e-9)
    jaw = np.clip(share, 0, 1) * (length > 1e-6)
    for group, value in (
        ("helper-lower-teeth", 1),
        ("helper-tongue", 1),
        ("helper-upper-teeth", 0),
    ):
        jaw[groups[group]] = value
    weights *= (1 - jaw)[:, None]
    weights[:, 4] = jaw
    for column, letter in ((5, "l"), (6, "r")):
        for name in ("helper-{}-eye", "eyeball-{}", "cornea-{}"):
            weights[groups[name.format(letter)]] = np.eye(len(JOINTS))[column]
    for column, group in ((7, "helper-upper-teeth"), (8, "helper-lower-teeth")):
        weights[groups[group]] = np.eye(len(JOINTS))[column]
    return weights


class Body:
    """A person before meshes are made: positions, and the expression of each raw control.

    All people have the skin weights of the default person, MAN. Their expressions are the man's
    expressions, adapted to their proportions.

    Attributes:
        groups: name of a group of the base mesh -> vertex indices.
        positions: float64[V, 3], in decimetres.
        joints: name of a joint -> float64[3], its position.
        units: raw control -> its expression.
        closing: ("jawOpen", raw control) -> float64[V, 3], the displacement by which this control
            closes the lips of an open jaw, along the whole mouth or in a part of it.
        eyes: positions of the eyeballs, and rest pose of their lids.
        lip_rim: int64[n], vertices of the lower lip's rim, where the upper lip touches it.
        eye_correctives: two raw controls -> float64[V, 3], the displacement that keeps the lids on
            the eyeballs.
        man: body of the man, which is this object if it is the man's body.
        weights: float64[V, 9], skin weights for the nine JOINTS.
    """

    def __init__(self, source: Source, base: BaseMesh, person: Person) -> None:
        base = with_eyeballs(base)
        self.groups = groups = group_indices(base)
        man = person.shape() == MAN.shape() and person.features == MAN.features
        other = None if man else Body(source, base, MAN)
        self.positions = shaped(source, base, person)
        self.positions[:, 1] += FLOOR if man else -self.positions[groups["body"], 1].min()
        self.eyes = Eyes(base, groups, self.positions, person.age)
        # positions with placed eyeballs, before lids, lips and teeth are adjusted
        self._raw = self.positions.copy()
        self._ways: dict[str, Floats] = {}  # raw control -> displacement before eyes are adjusted
        self.man: Body = self
        self._change: Proportions | None = None
        size = 1.0
        if other is not None:
            self.man = other
            size = head_size(base, self.positions) / head_size(base, other.positions)
            self._change = Proportions(base, groups, other._raw, self._raw)
        count = len(self.positions)
        wide = {
            side[0]: self.carried(source.face_unit(f"eyeWide{side}", count))
            for side in ("Left", "Right")
        }
        self.eyes.open(self.positions, wide)
        jaw_open = self.carried(source.face_unit("jawOpen", count))
        pucker = self.carried(source.face_unit("mouthPucker", count))
        mouth = Mouth(base, pucker, jaw_open)
        self.positions = sealed(mouth, self.positions)
        lower = rims(mouth, mouth.operator.apply(self.positions))[1]
        # the first `count` vertices are vertices of the base mesh; subdivision adds the others
        self.lip_rim = lower[lower < count]
        show_upper_teeth(self.positions, groups, jaw_open, size)
        self.joints = joint_positions(self.positions, groups, size)
        if other is None:
            self.units = ex.split_units(source, self.positions)
            self.units |= ex.extra_units(source, self.positions, person.origin)
            self.closing = ex.add_further_units(
                self.units, source, base, groups, self.positions, person.origin
            )
            self.closing |= ex.take_closing(self.units)
        else:
            self.units = {
                name: ex.Expression(self.carried(way)) for name, way in other._ways.items()
            }
            self.closing = self._carried_closing(other)
        self._ways = {name: unit.displacement for name, unit in self.units.items()}
        moved = dict(self._ways)
        self.eye_correctives = self.eyes.move(moved)
        rests, free = COVERED
        above = (collar_heights(base.positions) - rests) / (free - rests)
        held = np.ones((count, 1))
        held[groups["body"]] = smooth_step(above[groups["body"]])[:, None]
        for name, way in moved.items():  # only neckThroat controls move the pit of the throat
            self.units[name].displacement = way if "neckThroat" in name else way * held
        ex.add_joint_motion(self.units, groups, self.positions, self.joints)
        ex.leave_bones(self.units, groups, self.positions, self.joints)
        if other is None:
            jaw = self.units["jawOpen"]
            self.weights = skin_weights(self.positions, groups, self.joints, jaw)
        else:
            self.weights = other.weights

    def carried(self, displacement: Floats) -> Floats:
        """float64[V, 3]: a displacement from the CC0 data, adapted to this person's proportions.

        Args:
            displacement: float64[V, 3], in decimetres.
        """
        return displacement if self._change is None else self._change.carried(displacement)

    def _carried_closing(self, man: Body) -> dict[tuple[str, str], Floats]:
        """The man's `closing` displacements, adapted to this person's proportions.

        Each is adapted together with jawOpen, because both lips share the jaw's rotation, and the
        lips would miss each other otherwise. The four quarters of the lips (LIPS_TOGETHER) are
        fractions of their adapted sum, because separately adapted quarters do not add up to it.

        Args:
            man: body of the man, whose displacements are adapted.
        """
        jaw = man._ways["jawOpen"]
        rest = self.carried(jaw)
        out = {pair: self.carried(jaw + way) - rest for pair, way in man.closing.items()}
        quarters = {pair: man.closing[pair] for pair in out if pair[1] in ex.LIPS_TOGETHER}
        whole = np.sum(list(quarters.values()), axis=0)
        length = np.maximum(np.einsum("vi,vi->v", whole, whole), 1e-12)
        carried = self.carried(jaw + whole) - rest
        for pair, way in quarters.items():
            out[pair] = carried * (np.einsum("vi,vi->v", way, whole) / length)[:, None]
        return out

    def moved(self, shape: Floats) -> Body:
        """A copy of the person with displaced vertices.

        Args:
            shape: float64[V, 3], displacement to add, in decimetres.
        """
        out = copy(self)
        out.positions = self.positions + shape
        return out
