# SPDX-License-Identifier: MIT
"""Tests controls of joint rotations: found in a file, and set from head curves of a clip."""

import numpy as np
import pytest
import risorius
from risorius.baking.bake import bake
from risorius.baking.face import load_face, prepared
from risorius.cli import main
from risorius.rigs.joint_controls import head_turns, joint_controls, one_sign

PARTS = "xyzw"
NEUTRAL = ((10, -20, 30), (-35, 5, 80), (15, 60, -10))
UP = (0.0, 0.0, 0.2164396, 0.9762960)  # a quaternion: 25 degrees about the head's own z axis


def face(axes=("right", "up", "front"), sequence="xyz", signs=(1, 1, 1), unit="degrees"):
    """Three joints in a chain, the last is the head; pose UP of the head drives a shape channel."""
    dna = risorius.Dna()
    dna.lod_count, dna.coordinate_system = 1, axes
    dna.rotation_sequence, dna.rotation_signs, dna.rotation_unit = sequence, signs, unit
    dna.raw_control_names = ["jaw", *(f"head.q{part}" for part in PARTS)]
    dna.joint_names, dna.joint_parents = ["spine", "neck_01", "head"], [0, 0, 1]
    dna.neutral_joint_translations = np.zeros((3, 3))
    angle = 1.0 if unit == "degrees" else np.pi / 180
    dna.neutral_joint_rotations = np.array(NEUTRAL) * angle
    dna.lod_joint_mapping = [[0, 1, 2]]
    dna.blend_shape_channel_names = ["stretch"]
    dna.lod_blend_shape_mapping = [[0]]
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[1], input_indices=[6], output_indices=[0]
    )
    dna.joint_column_count, dna.joint_row_count = 7, 27
    dna.rbf_behavior.lod_solver_mapping = [[0]]
    dna.rbf_behavior.solvers = [
        risorius.RbfSolver(
            name="neck", raw_control_indices=[1, 2, 3, 4], pose_indices=[0, 1],
            raw_control_values=[0, 0, 0, 1, *UP], radius=1.0, solver_type=1, distance_method=1,
        )
    ]  # fmt: skip
    dna.rbf_behavior.poses = [risorius.RbfPose(name=name, scale=1) for name in ("rest", "up")]
    dna.rbf_behavior_ext.pose_control_names = ["rest", "up"]
    dna.rbf_behavior_ext.poses = [
        risorius.RbfPoseControls(output_control_indices=[5 + i], output_control_weights=[1])
        for i in range(2)
    ]
    return dna


# ---- the same with matrices, from the description of the format

DIRECTIONS = {
    "right": (1, 0, 0), "left": (-1, 0, 0), "up": (0, 0, 1), "down": (0, 0, -1),
    "front": (0, -1, 0), "back": (0, 1, 0),
}  # fmt: skip


def about(axis, angle):
    """The rotation matrix about an axis, right-handed; angle in radians."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], float)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def resting(dna):
    """The rotation matrix from the head joint's axes at rest to the DNA file's axes."""
    unit = np.pi / 180 if dna.rotation_unit == "degrees" else 1.0
    out = np.eye(3)
    for angles in dna.neutral_joint_rotations:
        local = np.eye(3)
        for letter in dna.rotation_sequence:
            i = "xyz".index(letter)
            local = about(np.eye(3)[i], angles[i] * dna.rotation_signs[i] * unit) @ local
        out = out @ local
    return out


def head_matrix(yaw, pitch, roll):
    """Head rotation by yaw to its left, pitch up, and roll to its left shoulder, in radians."""
    return about((0, 0, 1), yaw) @ about((-1, 0, 0), pitch) @ about((0, 1, 0), roll)


def rotation_of(q):
    """The rotation matrix of a quaternion x, y, z, w."""
    x, y, z, w = np.asarray(q, float)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


CONVENTIONS = [
    {},
    {"sequence": "zyx", "unit": "radians"},
    {"axes": ("left", "front", "up"), "sequence": "yxz", "signs": (1, -1, 1)},
    {"axes": ("right", "front", "up")},  # left-handed axes
]


@pytest.mark.parametrize("options", CONVENTIONS)
def test_the_controls_are_the_rotation_against_the_neutral_pose_about_the_joints_axes(options):
    dna = face(**options)
    (head,), said = joint_controls(dna)
    assert (head.joint, head.controls, said) == (2, (1, 2, 3, 4), [])
    to_face = np.array([DIRECTIONS[word] for word in dna.coordinate_system], float).T
    rest = resting(dna)
    for angles in np.random.default_rng(1).uniform(-1, 1, (5, 3)):
        turn = to_face.T @ head_matrix(*angles) @ to_face
        found = head.values(head_turns(angles[None]))[0]
        np.testing.assert_allclose(rotation_of(found), rest.T @ turn @ rest, atol=1e-6)


def test_q_and_minus_q_and_half_a_turn_give_the_same_controls():
    (head,), _ = joint_controls(face())
    for q in [(0.1, 0.2, -0.3, 0.927), (0.6, 0.0, 0.8, 0.0), (-1.0, 0, 0, 0), (0, 0, 0, 1)]:
        assert head.values(q).tolist() == head.values(-np.array(q)).tolist()
    assert one_sign(np.array([0.0, 0.0, -1.0, 1e-9])).tolist() == [0.0, 0.0, 1.0, -1e-9]


def test_a_clips_head_fires_the_neck_poses_of_each_frame(tmp_path):
    dna = face()
    dna.save(str(tmp_path / "face.dna"))
    character = load_face(tmp_path / "face.dna")
    (head,) = character.turning
    # Angles of the head that rotate its joint as in the pose UP.
    x, y, z = np.linalg.inv(head.axes) @ UP[:3]
    turn = rotation_of((x, y, z, UP[3]))
    pitch = -np.arcsin(turn[2, 1])
    yaw, roll = np.arctan2(-turn[0, 1], turn[1, 1]), np.arctan2(-turn[2, 0], turn[2, 2])
    np.testing.assert_allclose(head_matrix(yaw, pitch, roll), turn, atol=1e-6)
    names = ["head.yaw", "head.pitch", "head.roll"]
    clip = risorius.Clip(names, np.outer([yaw, pitch, roll], [0.0, 1.0]), 24.0)
    ready = prepared(clip, character)
    assert ready.names[3:] == tuple(f"head.q{part}" for part in PARTS)
    bake(ready, character, 0, {"npz": tmp_path / "out.npz"})
    with np.load(tmp_path / "out.npz") as out:
        assert out["blend_shapes"][:, 0] == pytest.approx([0.0, 1.0], abs=4e-3)
    # If a clip has a curve of a raw control of the head's rotation, here head.qx, none is added.
    own = clip.replaced(names=[*names, "head.qx"], curves=np.vstack([clip.curves, [[0, 0]]]))
    assert prepared(own, character).names == own.names


def neck_face(folder):
    """(Dna, loaded face): the last joint is neck_02, which gets half of a clip's neck rotation."""
    dna = face()
    dna.joint_names = ["spine", "neck_01", "neck_02"]
    dna.raw_control_names = ["jaw", *(f"neck_02.q{part}" for part in PARTS)]
    dna.save(str(folder / "face.dna"))
    return dna, load_face(folder / "face.dna")


@pytest.mark.parametrize("kind", ["rzc", "csv"])
def test_a_clips_neck_turns_each_joint_of_the_neck_by_its_share(tmp_path, capsys, kind):
    dna, _character = neck_face(tmp_path)
    take = tmp_path / f"take.{kind}"
    if kind == "rzc":
        risorius.Clip(["neck.pitch", "jaw"], [[0.0, 0.6], [0.0, 1.0]], 24.0).save(take)
    else:
        take.write_text("time,neck.pitch,jaw\n0,0,0\n0.5,0.6,1\n")
    out = tmp_path / "out.npz"
    assert (
        main(["eval", str(take), str(tmp_path / "face.dna"), "-o", str(out), "--what", "controls"])
        == 0
    )
    assert "neck.pitch" not in capsys.readouterr().err
    with np.load(out) as found:
        controls = found["controls"][1]
    to_face = np.array([DIRECTIONS[word] for word in dna.coordinate_system], float).T
    rest = resting(dna)
    turn = rest.T @ to_face.T @ head_matrix(0.0, 0.3, 0.0) @ to_face @ rest
    np.testing.assert_allclose(rotation_of(controls[1:5]), turn, atol=1e-6)
    assert controls[0] == 1.0


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["head.qx", "head.qy", "head.qw", "jaw", "x"], "'head' has no raw control for z"),
        ([f"tail.q{part}" for part in PARTS] + ["x"], "'tail', and no joint has that name"),
        ([f"head.q{part}" for part in "xxyzw"], "two raw controls for one part of its rotation"),
    ],
)
def test_what_cannot_be_filled_is_said(names, said, tmp_path, capsys):
    dna = face()
    dna.raw_control_names = names
    dna.save(str(tmp_path / "odd.dna"))
    assert main(["check", str(tmp_path / "odd.dna")]) == 0
    assert said in capsys.readouterr().out


def test_controls_that_are_zero_or_too_long_are_evaluated_as_they_are():
    rig = risorius.Rig(face())
    for values in ([0, 0, 0, 0], [0, 0, 0, 7], [np.float32(3e38)] * 4):
        pose = rig.evaluate([0, *values])
        assert not np.isinf(pose.blend_shapes).any()


@pytest.mark.parametrize("second", [(0, 0, 0, 1), (0, 0, 0, -1)], ids=["q", "-q"])
def test_poses_that_are_one_rotation_share_what_is_near_them(second):
    dna = face()
    solvers = dna.rbf_behavior.solvers
    solvers[0].raw_control_values = [0, 0, 0, 1, *second]
    dna.rbf_behavior.solvers = solvers
    rig = risorius.Rig(dna)
    assert rig.evaluate([0, 0, 0, 0, 1]).controls[-2:] == pytest.approx([0.5, 0.5], abs=1e-4)
    assert rig.evaluate([0, *UP]).controls[-2:] == pytest.approx([0.0, 0.0], abs=1e-2)
