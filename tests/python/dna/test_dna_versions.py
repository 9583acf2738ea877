# SPDX-License-Identifier: MIT
"""Tests conversion of every version to every version: kept layers, warnings about others."""

import json
import warnings

import numpy as np
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra

FIXTURES = SHARED / "data" / "fixtures"
# Layer -> minor version of the format in which the layer appeared.
SINCE = {
    "desc": 1, "defn": 1, "bhvr": 1, "geom": 1, "mlbh": 3, "rbfb": 4, "jbmd": 4, "twsw": 4,
    "rbfe": 5, "mlbe": 6, "dsce": 7,
}  # fmt: skip
VERSIONS = range(1, 9)


def known(minor):
    """Names of the layers of a version; version 2.1 has four sections instead, counted as 2.2."""
    return {name for name, since in SINCE.items() if since <= max(minor, 2)}


def written(dna, minor, **options):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        data = dna.to_bytes(f"2.{minor}", **options)
    return data, [str(w.message) for w in caught]


@pytest.mark.parametrize("target", VERSIONS)
@pytest.mark.parametrize("source", VERSIONS)
def test_between_all_versions(source, target):
    path = GOLDEN / f"tiny_v2{source}.dna"
    dna = risorius.load(path)
    data, words = written(dna, target)
    again = risorius.load(data)
    assert again.version == target
    # Version 2.1 stores four layers. Other versions store all, so that newer layers are written for
    # readers that know them.
    kept = set(dna.layers) | known(source)
    expected = known(1) if target == 1 else kept | known(target)
    assert set(again.layers) == expected
    # Each layer that the target version cannot store, and that is not empty, is named in a warning.
    missing = {
        name for name in kept if SINCE[name] > max(target, 2) and holds_something(path, name)
    }
    named = {word.split(":")[0] for word in words}
    assert missing <= named <= missing | {"behavior"}
    if target > 1:
        assert named == missing
        returned, _ = written(again, source)
        assert parts(risorius.load(returned)) == parts(dna)


@pytest.mark.parametrize("source", range(3, 9))
def test_what_a_lost_layer_drove_goes_with_it(source):
    """In version 2.1, groups and channels lose the inputs that networks and poses drove."""
    dna = risorius.load(GOLDEN / f"tiny_v2{source}.dna")
    data, words = written(dna, 1)
    again = risorius.load(data)
    assert any("controls that drove them" in word for word in words)
    count = len(dna.raw_control_names) + dna.psd_count
    expected = [[i for i in group.input_indices if i < count] for group in dna.joint_groups]
    assert [group.input_indices.tolist() for group in again.joint_groups] == expected
    for old, new in zip(dna.joint_groups, again.joint_groups, strict=True):
        np.testing.assert_array_equal(new.values, old.values[:, old.input_indices < count])
    inputs = dna.blend_shape_channels.input_indices
    assert again.blend_shape_channels.input_indices.tolist() == [i for i in inputs if i < count]
    assert again.blend_shape_channels.lods.tolist() == [
        sum(i < count for i in inputs[:n]) for n in dna.blend_shape_channels.lods
    ]


@pytest.mark.parametrize("layers", ["behavior", "rbf_behavior", "machine_learned_behavior"])
def test_what_was_not_loaded_is_not_missed_by_the_written_file(layers):
    dna = risorius.load(GOLDEN / "tiny_v28.dna", layers=layers)
    try:
        data, _ = written(dna, 8)
    except risorius.DnaError as error:
        assert error.code == "invalid_argument"  # networks read correctives
        assert layers == "machine_learned_behavior"
        return
    again = risorius.load(data)
    names = len(again.raw_control_names) + again.psd_count
    names += len(again.rbf_behavior_ext.pose_control_names)
    for group in again.joint_groups:
        assert all(i < names for i in group.input_indices)
    # Pose controls have new indices, which start after the correctives, but keep their order.
    first = len(again.raw_control_names) + again.psd_count
    for old, new in zip(dna.rbf_behavior_ext.poses, again.rbf_behavior_ext.poses, strict=True):
        shift = old.output_control_indices - new.output_control_indices
        assert set(shift) == {4}
        assert all(new.output_control_indices >= first)


@pytest.mark.parametrize("target", range(1, 8))
def test_a_winding_that_a_version_cannot_hold_is_named(target):
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    dna.face_winding_order = "cw"
    data, words = written(dna, target)
    if target == 7:  # version 7 has the layer, but not its last field
        assert risorius.load(data).face_winding_order == "ccw"
        assert [w for w in words if "dsce" in w and "winding" in w]
    else:
        assert [w for w in words if "dsce" in w]


def holds_something(path, name):
    """Whether a layer of the file differs from the same layer of an empty file."""
    if name == "dsce":
        dna = risorius.load(path)
        default = risorius.Dna()
        fields = ("rotation_sequence", "rotation_signs", "face_winding_order")
        return any(getattr(dna, f) != getattr(default, f) for f in fields)
    return layer_bytes(path.read_bytes(), name) != layer_bytes(risorius.Dna().to_bytes(), name)


def layer_bytes(data, name):
    """The bytes of a layer, found through the index at the begin of the file."""
    count = int.from_bytes(data[7:11], "big")
    for i in range(count):
        at = 11 + 16 * i
        if data[at : at + 4] == name.encode():
            offset, size = (int.from_bytes(data[at + k : at + k + 4], "big") for k in (8, 12))
            return data[offset : offset + size]
    return b""


@pytest.mark.parametrize("target", range(2, 9))
def test_newer_layers_can_be_left_out(target):
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    dna.unknown_layers = [("abcd", "1.0", b"12345")]
    data, words = written(dna, target, unknown_layers="ignore")
    assert set(risorius.load(data).layers) == known(target)
    named = {w.split(":")[0] for w in words}
    missing = set(SINCE) - known(target) - {"dsce"}  # the layer has only default values
    assert missing | {"abcd"} <= named <= missing | {"abcd", "behavior"}


@pytest.mark.parametrize(
    "version", ["1.65536", "65536.0", "-1.0", "x.1", "1.x", "1", "1.", " 1.0", ""]
)
def test_versions_of_layers_are_two_numbers_of_16_bits(version):
    dna = risorius.Dna()
    dna.unknown_layers = [("abcd", "65535.65535", b"1")]
    with pytest.raises(
        ValueError, match=f"from 0.0 to 65535.65535 was expected, found '{version}'"
    ):
        dna.unknown_layers = [("abcd", version, b"")]
    assert dna.unknown_layers == [("abcd", "65535.65535", b"1")]


def test_unknown_layers_are_kept_or_dropped_by_choice():
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    dna.unknown_layers = [("abcd", "1.0", b"12345"), ("mlbh", "9.0", b"")]
    data = dna.to_bytes()
    assert risorius.load(data).unknown_layers == dna.unknown_layers
    assert risorius.load(data, unknown_layers="ignore").unknown_layers == []
    assert risorius.load(data).to_bytes() == data
    # A newer version of a known layer is kept as an unknown layer, and does not replace the known
    # one.
    assert len(risorius.load(data).machine_learned_behavior.neural_networks) > 0


@pytest.mark.parametrize("minor", [9, 255, 65535])
def test_a_newer_minor_is_read_by_the_rules_of_the_newest(minor):
    data = bytearray((GOLDEN / "tiny_v28.dna").read_bytes())
    data[5:7] = minor.to_bytes(2, "big")
    dna = risorius.load(bytes(data))
    assert dna.version == minor
    assert dna.to_bytes() == (GOLDEN / "tiny_v28.dna").read_bytes()


def test_extra_downgraded_fixtures_hold_every_layer():
    """Files whose version number was lowered keep the layers of the newer version."""
    require_extra(FIXTURES / "raw_v28.dna", "the reference's fixtures")
    names = [f"RawV2{n}DowngradedFromV2{n + 1}" for n in range(2, 8)]
    for name in names:
        data = (FIXTURES / f"{name}.dna").read_bytes()
        dna = risorius.load(data)
        newer = risorius.load(FIXTURES / f"raw_v2{int(name[5]) + 1}.dna")
        assert dna.version == int(name[5])
        again, words = written(dna, dna.version)
        assert again == data
        assert len(words) == len(set(newer.layers) - known(dna.version))
        if dna.version == 7:  # in version 7 dsce ends before the winding order
            newer.face_winding_order = "ccw"
        assert parts(dna) == parts(newer)


def parts(dna):
    """The content of a file without its version and the order of its layers."""
    facts = json.loads(dna.to_json())
    return {k: v for k, v in facts.items() if k not in ("version", "index")}


def test_extra_policy_ignore_is_the_references():
    require_extra(FIXTURES / "raw_v22.dna", "the reference's fixtures")
    ignored = risorius.load(FIXTURES / "raw_v22.dna", unknown_layers="ignore")
    expected = FIXTURES / "RawV22WithUnknownDataIgnoredAndDNARewritten.dna"
    assert ignored.to_bytes("2.2") == expected.read_bytes()
    newer = risorius.load(FIXTURES / "RawV2xNewer.dna", unknown_layers="ignore")
    expected = FIXTURES / "RawV2xNewerWithUnknownDataIgnoredAndDNARewritten.dna"
    assert newer.to_bytes()[7:] == expected.read_bytes()[7:]
