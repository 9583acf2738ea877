# SPDX-License-Identifier: MIT
"""Compares complete, partial and LOD-filtered loads with values of the reference's reader.

The reference is OpenRigLogic, which computed the values of tests/data/golden.
"""

import copy
import zlib

import decoded
import numpy as np
import pytest
import risorius
from conftest import GOLDEN_SET, SHARED, require_extra

MASKS = {
    495: ["all"],
    1: ["descriptor"],
    3: ["definition"],
    7: ["behavior"],
    11: ["geometry"],
    15: ["behavior", "geometry"],
    19: ["geometry_without_blend_shapes"],
    35: ["machine_learned_behavior"],
    71: ["rbf_behavior"],
    131: ["joint_behavior_metadata"],
    259: ["twist_swing_behavior"],
}
# Files with complete lists instead of digests, because filtered loads are compared by names, which
# digests do not contain.
FILES = sorted(
    p.name
    for p in GOLDEN_SET.glob("*.decode.*")
    if "transform" not in p.name and ".digest_" not in p.name
)
DIGEST = {"n", "crc32", "sum", "head"}


def load(folder, golden, name):
    options = golden["load"]
    lods = None
    if options["lods"]:
        lods = options["lods"]
    elif (options["maxLOD"], options["minLOD"]) != (0, 65535):
        lods = (options["maxLOD"], options["minLOD"])
    return risorius.load(
        folder / f"{name.split('.')[0]}.dna",
        layers=MASKS[options["layerMask"]],
        lods=lods,
        unknown_layers=options["unknownLayers"],
    )


def comparable(view, dna):
    """Remove values that the reference computes, or adds to older files, from a decoded file."""
    view = copy.deepcopy(view)
    view.pop("load", None)
    view.pop("ok", None)
    view["behavior"].pop("jointVariableAttributeIndices", None)
    for pose in view["rbfBehavior"]["poses"]:
        for derived in ("jointOutputIndices", "jointOutputValues"):
            pose.pop(derived, None)
        for derived in ("blendShapeChannelOutputIndices", "animatedMapOutputIndices"):
            pose.pop(derived, None)
    if dna.version < 6 or not dna.machine_learned_behavior_ext.types:
        # The reference derives operations from the networks of older files.
        view["machineLearnedBehaviorExt"]["types"] = []
    if dna.version < 5:  # and pose controls from the poses
        view["rbfBehavior"]["poseControlNames"] = []
        for pose in view["rbfBehavior"]["poses"]:
            for made_up in [k for k in pose if "Control" in k]:
                del pose[made_up]
    return view


def is_digest_of(digest, values):
    """Whether a digest fits a list: count, first values, and the CRC of one of four data types."""
    found = np.asarray(values).ravel()
    sums = {zlib.crc32(found.astype(kind).tobytes()) for kind in ("<f4", "<u2", "<u4", "u1")}
    head = np.float32(digest["head"])
    return (
        len(found) == digest["n"]
        and digest["crc32"] in sums
        and np.array_equal(np.float32(found[: len(head)]), head)
    )


def differences(expected, found, path=""):
    if isinstance(expected, dict) and set(expected) == DIGEST and isinstance(found, list):
        if not is_digest_of(expected, found):
            yield f"{path}: not the list of the digest {expected}"
    elif isinstance(expected, dict) and isinstance(found, dict):
        for key in sorted(set(expected) | set(found)):
            if key not in expected or key not in found:
                yield f"{path}.{key}: only in one"
            else:
                yield from differences(expected[key], found[key], f"{path}.{key}")
    elif isinstance(expected, list) and isinstance(found, list):
        if len(expected) != len(found):
            yield f"{path}: {len(expected)} against {len(found)}"
            return
        for i, pair in enumerate(zip(expected, found, strict=True)):
            yield from differences(*pair, f"{path}[{i}]")
    elif isinstance(expected, float) or isinstance(found, float):
        if np.float32(expected) != np.float32(found):
            yield f"{path}: {expected!r} against {found!r}"
    elif expected != found:
        yield f"{path}: {expected!r} against {found!r}"


def check(folder, name):
    golden = decoded.read(folder / name)
    dna = load(folder, golden, name)
    expected = comparable(golden, dna)
    found = comparable(decoded.with_defaults(decoded.decoded(dna), dna), dna)
    unfiltered = risorius.load(folder / f"{name.split('.')[0]}.dna")
    if dna.lod_count == unfiltered.lod_count:
        assert list(differences(expected, found)) == []
        return
    names = decoded.Names(decoded.with_defaults(decoded.decoded(unfiltered), unfiltered))
    expected = decoded.by_name(expected, names)
    found = decoded.by_name(found)
    without_kept_ancestors(expected, found)
    assert list(differences(expected, found)) == []


def without_kept_ancestors(expected, found):
    """Remove joints that only Risorius keeps, because they are parents of kept joints.

    The reference uses joint 0 as the parent instead, and assigns weights of such joints to other
    joints, so that vertices with these weights are not compared.
    """
    joints = found["joints"]
    extra = [name for name in joints if name not in expected["joints"]]
    parents = {joint["parent"] for joint in joints.values()}
    assert set(extra) <= parents
    for name, joint in joints.items():
        if joint["parent"] in extra:
            joint["parent"] = expected["joints"][name]["parent"] if name not in extra else None
    for name in extra:
        del joints[name]
    for group in found["groups"]:
        group["joints"] = [j for j in group["joints"] if j not in extra]
    for name, mesh in found["meshes"].items():
        for i, (_, joints_of_vertex) in enumerate(mesh["skinWeights"]):
            if set(joints_of_vertex) & set(extra):
                mesh["skinWeights"][i] = expected["meshes"][name]["skinWeights"][i] = None


@pytest.mark.parametrize("name", FILES)
def test_what_the_reference_decodes(name):
    check(GOLDEN_SET, name)


def test_extra_every_load_of_the_medium_rig():
    folder = require_extra(SHARED, "the reference's decodes of the medium rig") / "data" / "golden"
    names = sorted(p.name for p in folder.glob("medium.decode.*") if "transform" not in p.name)
    assert len(names) > 20
    for name in names:
        check(folder, name)
