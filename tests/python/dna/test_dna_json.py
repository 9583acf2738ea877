# SPDX-License-Identifier: MIT
"""Dna as JSON: it uses the names of the file format, and loses no bit of a number."""

import json

import numpy as np
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra

FIXTURES = SHARED / "data" / "fixtures"
FILES = sorted(GOLDEN.glob("*.dna"))


def own_version(dna):
    return f"2.{min(dna.version, 8)}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_there_and_back_gives_the_same_bytes(path):
    data = path.read_bytes()
    dna = risorius.load(data)
    text = dna.to_json()
    again = risorius.Dna.from_json(text)
    assert again.to_bytes(own_version(dna)) == data
    assert again.to_json() == text


def test_the_standard_library_reads_the_numbers_of_the_file():
    dna = risorius.load(GOLDEN / "medium.dna")
    facts = json.loads(dna.to_json())
    assert facts["defn1.1"]["jointNames"] == dna.joint_names
    mesh = facts["geom1.1"]["meshes"][0]
    np.testing.assert_array_equal(
        np.float32([mesh["positions"][axis] for axis in ("xs", "ys", "zs")]).T,
        dna.meshes[0].positions,
    )
    # JSON that the standard library wrote in another order loses no value.
    shuffled = json.dumps(facts, sort_keys=True, separators=(",", ":"))
    assert risorius.Dna.from_json(shuffled).to_bytes() == dna.to_bytes()


@pytest.mark.parametrize("minor", range(1, 9))
def test_extra_the_names_are_those_of_the_format(minor):
    """Each layer's JSON has the names and values of an independent parser's JSON."""
    require_extra(FIXTURES, "the reference's fixtures")
    facts = json.loads((FIXTURES / f"raw_v2{minor}.decoded.json").read_text())
    ours = json.loads(risorius.load(FIXTURES / f"raw_v2{minor}.dna").to_json())
    for key, layer in facts.items():
        if key[:4] in ("desc", "defn", "bhvr", "geom", "mlbh", "mlbe", "rbfb", "rbfe", "jbmd",
                       "twsw", "dsce"):  # fmt: skip
            if minor == 7:  # this field came with the layer's second version
                ours[key].pop("faceWindingOrder", None)
            assert as_floats(ours[key]) == as_floats(layer), key


def as_floats(value):
    if isinstance(value, dict):
        return {k: as_floats(v) for k, v in value.items()}
    if isinstance(value, list):
        return [as_floats(v) for v in value]
    return float(np.float32(value)) if isinstance(value, float) else value


def test_floats_keep_every_bit():
    bits = np.array(
        [
            *(0x00000000, 0x80000000, 0x00000001, 0x007FFFFF, 0x00800000, 0x7F7FFFFF),
            *(0x3DCCCCCD, 0x3F800001, 0x4B800001, 0xFF7FFFFF, 0x33D6BF95),
        ],
        np.uint32,
    )
    values = np.concatenate(
        [bits, np.random.default_rng(7).integers(0, 0x7F800000, 5000, np.uint32)]
    ).view(np.float32)
    values = values[: len(values) // 3 * 3]
    dna = risorius.load(GOLDEN / "core.dna")
    psds = risorius.Psds(rows=[5] * len(values), columns=[0] * len(values), values=values)
    dna.psds = psds
    again = risorius.Dna.from_json(dna.to_json())
    assert again.psds.values.tobytes() == values.tobytes()


def test_numbers_that_json_does_not_know_are_texts():
    dna = risorius.load(GOLDEN / "core.dna")
    odd = np.array([0x7F800000, 0xFF800000, 0x7FC00000, 0x7F800001, 0xFFC12345], np.uint32)
    texture = np.zeros((5, 2), np.float32)
    texture[:, 0] = odd.view(np.float32)
    mesh = dna.meshes[0]
    count = len(mesh.texture_coordinates)
    mesh.texture_coordinates = np.concatenate([texture, mesh.texture_coordinates])
    text = dna.to_json()
    us = json.loads(text)["geom1.1"]["meshes"][0]["textureCoordinates"]["us"]
    assert us[:4] == ["Infinity", "-Infinity", "NaN:7fc00000", "NaN:7f800001"]
    again = risorius.Dna.from_json(text).meshes[0].texture_coordinates
    assert len(again) == count + 5
    assert again[:5].tobytes() == texture.tobytes()


def test_texts_of_any_bytes_survive():
    dna = risorius.load(GOLDEN / "core.dna")
    name = b"\xff\xfe caf\xc3\xa9".decode("utf-8", "surrogateescape")
    dna.name = name
    dna.metadata = {"snowman": '☃ \u0000 " \\ \n', "": ""}
    again = risorius.Dna.from_json(dna.to_json())
    assert again.name == name
    assert again.metadata == dna.metadata
    assert again.to_bytes() == dna.to_bytes()


def test_unknown_layers_survive_at_their_place():
    dna = risorius.load(GOLDEN / "core.dna")
    dna.unknown_layers = [("zzzz", "7.3", bytes(range(256)))]
    again = risorius.Dna.from_json(dna.to_json())
    assert again.unknown_layers == dna.unknown_layers
    assert again.to_bytes() == dna.to_bytes()


def test_an_edit_in_the_text_is_an_edit_of_the_file():
    facts = json.loads(risorius.load(GOLDEN / "core.dna").to_json())
    facts["desc1.1"]["name"] = "edited"
    facts["defn1.1"]["neutralJointTranslations"]["xs"][1] = 0.1
    again = risorius.Dna.from_json(json.dumps(facts))
    assert again.name == "edited"
    assert again.neutral_joint_translations[1, 0] == np.float32(0.1)


def without(*path):
    def change(facts):
        for key in path[:-1]:
            facts = facts[key]
        del facts[path[-1]]

    return change


def replaced(value, *path):
    def change(facts):
        for key in path[:-1]:
            facts = facts[key]
        facts[path[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (without("desc1.1", "age"), "desc1.1.age"),
        (without("desc1.1", "name"), "desc1.1.name"),
        (replaced("old", "desc1.1", "age"), "desc1.1.age"),
        (replaced(-1, "desc1.1", "age"), "desc1.1.age"),
        (replaced(70000, "desc1.1", "age"), "desc1.1.age"),
        (replaced(1.5, "desc1.1", "age"), "desc1.1.age"),
        (replaced([1, 2], "defn1.1", "jointNames"), "defn1.1.jointNames[0]"),
        (replaced({}, "defn1.1", "jointNames"), "defn1.1.jointNames"),
        (replaced(1, "desc1.1", "colour"), "desc1.1.colour"),
        (replaced([9], "defn1.1", "jointHierarchy"), "joint_parents"),
        (replaced({}, "xxxx1.0"), "xxxx1.0"),
    ],
)
def test_what_is_wrong_is_named_by_its_path(change, where):
    facts = json.loads(risorius.load(GOLDEN / "core.dna").to_json())
    change(facts)
    with pytest.raises(risorius.DnaError) as caught:
        risorius.Dna.from_json(json.dumps(facts))
    assert where in caught.value.where, (caught.value.where, str(caught.value))
    assert caught.value.code in ("invalid_value", "invalid_length", "invalid_index")


def test_a_number_beyond_every_float_is_named():
    facts = json.loads(risorius.load(GOLDEN / "core.dna").to_json())
    facts["bhvr1.1"]["controls"]["psds"]["values"][2] = 1e300
    with pytest.raises(risorius.DnaError, match=r"beyond every float: '1e\+300'"):
        risorius.Dna.from_json(json.dumps(facts))


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "1", '{"version": }', "\ufeff", "nul", '{"a": 1,}', "{}x"]
)
def test_what_is_not_json_has_a_place(text):
    with pytest.raises(risorius.DnaError) as caught:
        risorius.Dna.from_json(text)
    assert caught.value.code in ("not_dna", "invalid_value")
    assert str(caught.value)


def test_nesting_and_counts_have_limits():
    with pytest.raises(risorius.DnaError) as caught:
        risorius.Dna.from_json('{"version":' + "[" * 100000 + "]" * 100000 + "}")
    assert caught.value.code == "limit_exceeded"
    text = risorius.load(GOLDEN / "core.dna").to_json()
    for limits in (
        risorius.Limits(max_nesting=3),
        risorius.Limits(max_count=2),
        risorius.Limits(max_bytes=1000),
    ):
        with pytest.raises(risorius.DnaError) as caught:
            risorius.Dna.from_json(text, limits=limits)
        assert caught.value.code == "limit_exceeded"
