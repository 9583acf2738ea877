# SPDX-License-Identifier: MIT
"""Tests DirectFace: its final vertices equal those of an oracle, and bad input is refused.

The oracle is skin_oracle.py, which computes skinning in double precision. Only meshes that have
changed are written.
"""

import re
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import risorius
import skin_oracle

TURN = np.array([[0.9238795, 0.0, 0.3826834, 0.0]], np.float32)  # 45 degrees about y


class Face:
    """The face of skin_oracle.py with its six joints as bones in another order, and a root bone."""

    ROWS = (3, 0, 6, 1, 5, 4)
    OTHER = 2  # no joint of the file: a root above all others

    def __init__(self):
        self.dna = dna = skin_oracle.small_face()
        self.rig = risorius.Rig(dna)
        self.space = risorius.BoneSpace(
            dna.neutral_joint_rotations, range(6), axes=np.eye(3), radians=np.pi / 180
        )
        parents, rest = np.full(7, self.OTHER), np.tile(np.eye(4), (7, 1, 1))
        parents[self.OTHER] = -1
        still = np.zeros((6, 9), np.float32)
        for joint, world in enumerate(skin_oracle._worlds(dna, still)):
            rest[self.ROWS[joint]] = world
            above = dna.joint_parents[joint]
            if above != joint:
                parents[self.ROWS[joint]] = self.ROWS[above]
        self.chain = risorius.JointChain(parents, rest)
        geometry = dna.meshes[0]
        self.base = geometry.positions
        self.morph = risorius.Morph(dna, 0)
        bones = np.array(self.ROWS)[geometry.skin_joint_indices]
        self.skin = risorius.Skin(
            len(self.base), geometry.skin_offsets, bones, 0.5 * geometry.skin_weights, 7
        )
        self.meshes = [(self.morph, self.base, self.skin)]

    def direct(self, turned=()):
        return risorius.DirectFace(
            self.rig, self.space, self.chain, self.ROWS, self.meshes, turned=turned
        )

    def raw(self, **controls):
        raw = np.zeros(len(self.dna.raw_control_names), np.float32)
        for name, value in controls.items():
            where = [n.endswith("." + name) for n in self.dna.raw_control_names]
            raw[where.index(True)] = value
        return raw

    def empty(self):
        return np.full((len(self.base), 3), np.nan, np.float32)


@pytest.fixture(scope="module")
def face():
    return Face()


def one(direct, raw, out, **options):
    """Evaluate a frame of one face. Returns (Pose, indices of the meshes that were written)."""
    return risorius.evaluate_faces([direct], [raw], [0], [{0: out}], **options)[0]


# ---- values


@pytest.mark.parametrize(
    "controls", [{}, {"jawOpen": 1, "smileLeft": 0.7, "puff": 0.5, "widen": 1}, {"jawOpen": -2}]
)
def test_vertices_are_those_of_the_oracle(face, controls):
    raw, out = face.raw(**controls), face.empty()
    pose, written = one(face.direct(), raw, out)
    assert written == (0,)
    alone = face.rig.evaluate(raw)
    np.testing.assert_array_equal(pose.joints, alone.joints)
    np.testing.assert_array_equal(pose.controls, alone.controls)
    np.testing.assert_allclose(out, skin_oracle.skinned(face.dna, alone), atol=2e-5)


def test_it_is_the_morph_the_bones_the_chain_and_the_skin_one_after_the_other(face):
    raw, out = face.raw(jawOpen=0.6, puff=1), face.empty()
    pose, _ = one(face.direct(turned=[0]), raw, out, turns=[TURN])
    kept = [
        np.zeros((7, 3), "f4"),
        np.tile(np.float32([1, 0, 0, 0]), (7, 1)),
        np.ones((7, 3), "f4"),
    ]
    for channel, own in zip(kept, face.space.evaluate(pose.joints), strict=True):
        channel[list(face.ROWS)] = own
    turned, (w, x, y, z) = kept[1][face.ROWS[0]], TURN[0].astype(float)
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    kept[1][face.ROWS[0]] = left @ turned
    points = face.morph.evaluate(pose.blend_shapes, base=face.base)
    simd = face.rig.simd
    apart = face.skin.evaluate(points, face.chain.evaluate(*kept), simd=simd)
    np.testing.assert_allclose(out, apart, atol=2e-6)
    again = face.empty()
    assert risorius.deform_faces(
        [face.direct(turned=[0])], [pose.joints], [pose.blend_shapes], [{0: again}], turns=[TURN]
    ) == [(0,)]
    np.testing.assert_array_equal(again, out)


def test_bones_that_are_no_joints_keep_what_they_were_given(face):
    direct, out, moved = face.direct(), face.empty(), face.empty()
    one(direct, face.raw(), out)
    location = np.zeros((7, 3))
    location[face.OTHER] = [1, 2, 3]
    location[face.ROWS[1]] = 99  # the rig's: passed over
    direct.keep(location, np.tile([1, 0, 0, 0], (7, 1)), np.ones((7, 3)))
    assert one(direct, face.raw(), moved)[1] == (0,)
    np.testing.assert_allclose(moved - out, np.tile([1, 2, 3], (len(out), 1)), atol=1e-5)


def test_weights_need_not_add_up_and_a_vertex_without_any_stays():
    chain = risorius.JointChain([1, -1], np.tile(np.eye(4), (2, 1, 1)))
    matrices = chain.evaluate([[0, 0, 0], [2, 0, 0]], [[1, 0, 0, 0]] * 2, np.ones((2, 3)))
    skin = risorius.Skin(4, [0, 2, 2, 3, 4], [0, 1, 1, 0], [0.25, 0.25, 1e-4, 7], 2)
    points = np.arange(12).reshape(4, 3)
    moved = points + np.array([[2, 0, 0], [0, 0, 0], [0, 0, 0], [2, 0, 0]])
    for simd in risorius.available_simd().split(", "):
        np.testing.assert_allclose(skin.evaluate(points, matrices, simd=simd), moved, rtol=1e-6)


def test_what_is_no_number_spoils_what_it_moves_and_no_later_frame(face):
    direct, out, clean = face.direct(), face.empty(), face.empty()
    still, shapes = np.zeros((6, 9), np.float32), np.float32([np.nan, 0])
    risorius.deform_faces([direct], [still], [shapes], [{0: out}])
    puff = face.dna.meshes[0].blend_shape_targets[0].vertex_indices
    assert np.flatnonzero(np.isnan(out).any(axis=1)).tolist() == puff.tolist()
    one(direct, face.raw(jawOpen=np.nan), out)
    one(direct, face.raw(), out)
    one(face.direct(), face.raw(), clean)
    np.testing.assert_array_equal(out, clean)
    skin = risorius.Skin(3, [0, 2, 3, 5], [0, 1, 0, 1, 0], [1, 0, 1, 1, 1], 2)
    matrices = np.tile(np.eye(4)[:3], (2, 1, 1))
    matrices[1, 0, 0] = np.nan
    for simd in risorius.available_simd().split(", "):
        moved = skin.evaluate(np.ones((3, 3)), matrices, simd=simd)
        assert np.isnan(moved).any(axis=1).tolist() == [False, False, True]


# ---- what is written


def test_a_mesh_of_which_nothing_changed_is_passed_over(face):
    direct, out = face.direct(), face.empty()
    raw = face.raw(jawOpen=0.5)
    assert one(direct, raw, out)[1] == (0,)
    out[:] = 7
    assert one(direct, raw, out)[1] == ()
    assert one(direct, face.raw(jawOpen=0.5, idle=1), out)[1] == ()
    assert (out == 7).all()
    assert one(direct, raw, face.empty())[1] == (0,)  # other memory
    assert one(direct, raw, out, anew=True)[1] == (0,)
    direct.forget()
    assert one(direct, raw, out)[1] == (0,)
    risorius.evaluate_faces([direct], [face.raw(puff=1)], [0], [{}])  # it is hidden meanwhile
    assert one(direct, face.raw(puff=1), out)[1] == (0,)
    direct.set_base(0, face.base + 1)
    assert one(direct, face.raw(puff=1), out)[1] == (0,)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_faces_together_in_any_number_of_threads_are_each_alone(face, threads):
    raws = [face.raw(jawOpen=i / 7, puff=i % 2) for i in range(8)]
    alone = [face.empty() for _ in raws]
    for raw, out in zip(raws, alone, strict=True):
        one(face.direct(), raw, out, threads=1)
    directs, outs = [face.direct() for _ in raws], [face.empty() for _ in raws]
    targets = [{0: out} for out in outs]
    done = risorius.evaluate_faces(directs, raws, [0] * 8, targets, threads=threads)
    assert [written for _, written in done] == [(0,)] * 8
    np.testing.assert_array_equal(outs, alone)


def test_an_address_is_as_good_as_an_array(face):
    out, there = face.empty(), face.empty()
    one(face.direct(), face.raw(puff=1), out)
    one(face.direct(), face.raw(puff=1), (there.ctypes.data, len(there)))
    np.testing.assert_array_equal(there, out)


def test_calls_of_several_threads_for_one_face_wait_for_each_other(face):
    direct, out = face.direct(), [face.empty() for _ in range(4)]

    def frames(mine):
        for i in range(50):
            one(direct, face.raw(jawOpen=i % 2), mine)
        return mine

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(frames, out))
    one(face.direct(), face.raw(jawOpen=1), alone := face.empty())
    for mine in out:
        np.testing.assert_array_equal(mine, alone)


# ---- wrong arguments


def rest(n=2):
    return np.tile(np.eye(4), (n, 1, 1))


@pytest.mark.parametrize(
    ("parents", "matrices", "message"),
    [
        ([1, 0], rest(), "bone 0 is in a circle of parents"),
        ([-1, 2], rest(), "bone 1 has the parent 2; -1 or a bone below 2 was expected"),
        ([-2, -1], rest(), "bone 0 has the parent -2"),
        ([2**40, -1], rest(), "bone 0 has the parent 2147483647"),
        ([-1, 0], rest() * 0, "0 0 0 1 was expected as the last row of the rest matrix of bone 0"),
        ([-1, 0], rest() * np.nan, "the rest matrix of bone 0 has a value that is not finite"),
        ([-1, 0], rest() * [[[1], [1], [0], [1]]], "the rest matrix of bone 0 has no inverse"),
        ([-1, 0], rest(3), re.escape("shape (2, 4, 4) was expected, the shape is (3, 4, 4)")),
        ([-1.0, 0.0], rest(), "parents: whole numbers"),
        ([[-1, 0]], rest(), "parents: whole numbers"),
        ([-1, 0], "no", "rest: an array of numbers"),
    ],
)
def test_a_chain_says_what_is_wrong(parents, matrices, message):
    with pytest.raises(ValueError, match=message):
        risorius.JointChain(parents, matrices)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((2, [0, 1], [0], [1], 1), "3 offsets were expected"),
        ((2, [0, 2, 1], [0], [1], 1), "offsets that ascend from 0"),
        ((2, [0, 1, 2], [0], [1], 1), "offsets that ascend from 0"),
        ((1, [0, 1], [0], [1, 2], 1), "a weight for each of 1 bones was expected, found 2"),
        ((1, [0, 1], [3], [1], 3), "vertex 0 has a weight of bone 3, but there are 3"),
        ((1, [0, 1], [0], [-0.5], 3), "vertex 0 has the weight -0.5"),
        ((1, [0, 1], [0], [np.nan], 3), "vertex 0 has the weight nan"),
        ((1, [0, 1], [-1], [1], 3), "bones: values from 0"),
        ((1, [0, 1], [0.0], [1], 3), "bones: whole numbers"),
        ((1, [0, 1], [0], "x", 3), "weights: an array of numbers"),
        ((1, [0, 1], [0], [1], 65536), "at most 65535 bones"),
    ],
)
def test_a_skin_says_what_is_wrong(arguments, message):
    with pytest.raises(ValueError, match=message):
        risorius.Skin(*arguments)


def test_evaluating_a_skin_says_what_is_wrong(face):
    matrices, points = np.zeros((7, 3, 4)), face.base
    for given, message in [
        ((points[1:], matrices), r"points: .*\(196, 3\).*\(195, 3\)"),
        ((points, matrices[1:]), r"matrices: .*\(7, 3, 4\)"),
        ((points, matrices, np.zeros((196, 3))), "out: a C-contiguous float32 array"),
        ((points, matrices, np.zeros((196, 6), "f4")[:, ::2]), "out: a C-contiguous float32 array"),
        ((points, matrices, np.zeros((195, 3), "f4")), r"out: .*\(196, 3\)"),
        ((points, matrices, np.frombuffer(bytes(2352), "f4").reshape(196, 3)), "out: .*read-only"),
        ((points, matrices, None, "mmx"), "simd: mmx is not available"),
    ]:
        with pytest.raises(ValueError, match=message):
            face.skin.evaluate(*given)
    memory = np.zeros((197, 3), np.float32)
    with pytest.raises(ValueError, match="out: points, or an array that does not overlap"):
        face.skin.evaluate(memory[1:], matrices, memory[:-1])
    strided = np.zeros((196, 6), np.float32)[:, ::2]
    assert face.skin.evaluate(strided, matrices).shape == (196, 3)


def test_parts_that_do_not_belong_together_are_refused(face):
    def refused(message, **changed):
        parts = {"rig": face.rig, "space": face.space, "chain": face.chain}
        parts |= {"rows": face.ROWS, "meshes": face.meshes}
        with pytest.raises((ValueError, TypeError), match=message):
            risorius.DirectFace(**{**parts, **changed})

    refused("a bone for each of 6 bones", rows=[0, 1])
    refused("bone 7, but the chain has 7", rows=[0, 1, 2, 3, 4, 7])
    refused("bone 4 stands there twice", rows=[0, 1, 2, 3, 4, 4])
    refused("bone 6, but the space has 6", turned=[6])
    refused(r"base: .*\(196, 3\)", meshes=[(face.morph, face.base[1:], face.skin)])
    refused(r"\(Morph, base, Skin\)", meshes=[(face.morph, face.base)])
    skin = risorius.Skin(196, [0] * 197, np.zeros(0, int), [], 3)
    refused("a Skin of the chain's 7 bones", meshes=[(face.morph, face.base, skin)])
    skin = risorius.Skin(1, [0, 0], np.zeros(0, int), [], 7)
    refused("a Morph, a base and a Skin of as many", meshes=[(face.morph, [[0, 0, 0]], skin)])
    refused("rotation='euler'", rig=risorius.Rig(face.dna, rotation="quaternion"))
    refused(r"\(Morph, base, Skin\)", meshes=[(None, face.base, face.skin)])
    for name in ("rig", "space", "chain"):
        refused("incompatible", **{name: None})


def test_a_frame_says_what_is_wrong(face):
    direct, raw, out = face.direct(turned=[1]), face.raw(), face.empty()
    for faces, raws, targets, options, message in [
        ([direct, direct], [raw] * 2, [{0: out}, {}], {}, "faces: a face stands there twice"),
        ([direct], [raw] * 2, [{0: out}], {}, "raw: one for each of 1 faces was expected, found 2"),
        ([direct], [raw], [], {}, "targets: one for each of 1 faces"),
        ([direct], [raw[1:]], [{0: out}], {}, "raw: "),
        ([direct], [raw], [out], {}, "targets: {mesh"),
        ([direct], [raw], [{1: out}], {}, "mesh 1, but the face has 1"),
        ([direct], [raw], [{0: out[1:]}], {}, r"targets: .*\(196, 3\)"),
        ([direct], [raw], [{0: out.astype(float)}], {}, "targets: a C-contiguous float32"),
        ([direct], [raw], [{0: (out.ctypes.data, 195)}], {}, "memory of 196 vertices was expected"),
        ([direct], [raw], [{0: (0, 196)}], {}, "the address of float32 numbers"),
        ([direct], [raw], [{0: (out.ctypes.data + 1, 196)}], {}, "the address of float32 numbers"),
        ([direct], [raw], [{0: (1,)}], {}, r"\(address, vertices\)"),
        ([direct], [raw], [{0: out}], {"turns": [TURN[:, :3]]}, "turns: "),
        ([direct, face.direct()], [raw] * 2, [{0: out}] * 2, {}, "two meshes share memory"),
    ]:
        with pytest.raises(ValueError, match=message):
            risorius.evaluate_faces(faces, raws, [0] * len(faces), targets, **options)
    with pytest.raises((TypeError, ValueError)):
        risorius.evaluate_faces([None], [raw], [0], [{0: out}])
    assert np.isnan(out).all()
    assert sys.getrefcount(out) == sys.getrefcount(face.empty()) + 1  # nothing is kept
