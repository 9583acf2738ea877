# SPDX-License-Identifier: MIT
"""Tests that compressed or quantized heads equal plain heads; damaged files are refused."""

import functools
import sys

import face_shapes
import numpy as np
import pytest
from glb_files import MESHOPT, Glb
from risorius import _native, importing
from risorius.author.input.gltf import read_gltf
from risorius.base.budget import BudgetError
from risorius.base.errors import RisoriusError

STEP = 1e-4  # metres per step of a quantized position


def triangles():
    faces = face_shapes.head()[1]
    return np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]]).astype("<u4")


def rows(array, stride):
    """Bytes of an array whose rows are padded to `stride` bytes."""
    array = np.ascontiguousarray(array)
    return b"".join(row.tobytes().ljust(stride, b"\0") for row in array)


def numbers():
    """Quantized numbers of the head of face_shapes.

    Returns:
        The lower corner in m; positions from the corner, in steps of STEP; shape -> displacements
        in steps of STEP; texture coordinates in steps of 1 / 4095.
    """
    positions, _ = face_shapes.head()
    low = positions.min(axis=0) / 100
    whole = np.round((positions / 100 - low) / STEP).astype("<u2")
    moved = {
        name: np.round(delta / 100 / STEP).astype("<i2")
        for name, delta in face_shapes.expressions(positions).items()
    }
    uvs = np.round(4095 * (positions[:, :2] / 40 + 0.5)).astype("<u2")
    return low, whole, moved, uvs


def head(path, *, packed, change=None):
    """Write a head as gltfpack does, compressed only if `packed`.

    It has quantized numbers, a node that scales them back, normals of eight bits, and texture
    coordinates that the material scales.
    """
    low, whole, moved, uvs = numbers()
    glb = Glb()

    def accessor(array, stride, component, kind="VEC3"):
        data = rows(array, stride)
        view = glb.packed(data, stride) if packed else glb.view(data, stride)
        return glb.of_view(view, kind, component, len(array))

    normals = np.tile(np.array([[0.0, 0.0, 1.0, 0.0]], np.float32), (len(whole), 1))
    octahedral = _native.filter_buffer(normals, 4, "OCTAHEDRAL", 8)
    view = (
        glb.packed(octahedral, 4, "ATTRIBUTES", "OCTAHEDRAL") if packed else glb.view(octahedral, 4)
    )
    normal = glb.of_view(view, "VEC3", 5120, len(whole), normalized=True)
    order = triangles().astype("<u2").tobytes()
    view = glb.packed(order, 2, "TRIANGLES", seen=False) if packed else glb.view(order)
    glb.json |= {
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {
            "KHR_texture_transform": {"offset": [0.25, 0.0], "scale": [1 / 4095, 1 / 4095]}}}}}],
        "textures": [{"extensions": {"KHR_texture_basisu": {"source": 0}}}],
        "meshes": [{"extras": {"targetNames": list(moved)}, "primitives": [{
            "attributes": {"POSITION": accessor(whole, 8, 5123), "NORMAL": normal,
                           "TEXCOORD_0": accessor(uvs, 4, 5123, "VEC2")},
            "indices": glb.of_view(view, "SCALAR", 5123, triangles().size),
            "targets": [{"POSITION": accessor(delta, 8, 5122), "NORMAL": normal}
                        for delta in moved.values()],
            "material": 0,
        }]}],
        "nodes": [{"mesh": 0, "translation": low.tolist(), "scale": [STEP] * 3},
                  {"children": [0], "name": "Egg"}],
    }  # fmt: skip
    if change:
        change(glb.json)
    glb.save(path)
    return path


def test_a_packed_head_is_its_plain_twin(tmp_path):
    low, whole, moved, uvs = numbers()
    plain, plain_moved = read_gltf(head(tmp_path / "plain.glb", packed=False), "Egg")
    mesh, found = read_gltf(head(tmp_path / "packed.vrm", packed=True))
    np.testing.assert_array_equal(mesh.positions, plain.positions)
    np.testing.assert_allclose(mesh.positions, whole * STEP + low, atol=1e-12)
    assert list(found) == list(plain_moved) == list(moved)
    for name, delta in moved.items():
        np.testing.assert_array_equal(found[name], plain_moved[name])
        np.testing.assert_allclose(found[name], delta * STEP, atol=1e-12)
    np.testing.assert_allclose(mesh.uvs, uvs / 4095 * [1, -1] + [0.25, 1], atol=1e-12)
    assert {tuple(sorted(face)) for face in mesh.faces} == {
        tuple(sorted(face)) for face in triangles().tolist()
    }


@pytest.mark.parametrize("bits", [12, 23])
def test_floats_and_corners_in_a_row_are_unpacked(tmp_path, bits):
    """A GLB is read whose packed data use features that gltfpack's usual files lack.

    These are the exponential filter, the mode INDICES, and two accessors in one buffer view.
    """
    positions, moved = face_shapes.head()[0] / 100, face_shapes.expressions(face_shapes.head()[0])
    jaw = moved["jawOpen"] / 100
    glb = Glb()
    both = np.concatenate([positions, jaw]).astype(np.float32)
    data = _native.filter_buffer(both, 12, "EXPONENTIAL", bits)
    view = glb.packed(data, 12, "ATTRIBUTES", "EXPONENTIAL", seen=False)
    second = glb.of_view(view, "VEC3", 5126, len(jaw), byteOffset=12 * len(jaw))
    order = glb.packed(triangles().tobytes(), 4, "INDICES", seen=False)
    glb.json["meshes"] = [{"primitives": [{
        "attributes": {"POSITION": glb.of_view(view, "VEC3", 5126, len(positions))},
        "targets": [{"POSITION": second}],
        "indices": glb.of_view(order, "SCALAR", 5125, triangles().size),
    }]}]  # fmt: skip
    glb.save(tmp_path / "egg.glb")
    mesh, found = read_gltf(tmp_path / "egg.glb")
    largest = 2.0 ** (1 - bits)
    np.testing.assert_allclose(mesh.positions, positions, atol=largest)
    np.testing.assert_allclose(found["target0"], jaw, atol=largest)
    assert mesh.faces == triangles().tolist()


def test_packed_curves_of_an_animation_are_read(tmp_path):
    glb = Glb()
    times, weights = np.linspace(0, 1, 8, dtype="<f4"), np.linspace(0, 1, 8)
    eights = np.round(255 * weights).astype("u1")
    shape = glb.accessor(np.zeros((3, 3), "<f4"), "VEC3")
    glb.json["meshes"] = [{"extras": {"targetNames": ["jawOpen"]}, "primitives": [
        {"attributes": {"POSITION": shape}, "targets": [{"POSITION": shape}]}]}]  # fmt: skip
    glb.json["nodes"] = [{"mesh": 0}]
    first = glb.of_view(glb.packed(times.tobytes(), 4, seen=False), "SCALAR", 5126, 8)
    second = glb.of_view(glb.packed(eights.tobytes(), 4, seen=False), "SCALAR", 5121, 8)
    glb.json["animations"] = [{
        "samplers": [{"input": first, "output": second}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
    }]  # fmt: skip
    glb.save(tmp_path / "take.glb")
    clip = importing.read(tmp_path / "take.glb").clip
    np.testing.assert_allclose(clip.curves[0], weights, atol=0.5 / 255)


def test_unit_quaternions_come_back():
    turns = np.random.default_rng(3).normal(size=(50, 4)).astype(np.float32)
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    packed = _native.pack_buffer(
        _native.filter_buffer(turns, 8, "QUATERNION", 16), 50, 8, "ATTRIBUTES", "QUATERNION"
    )
    back = _native.unpack_buffer(packed, 50, 8, "ATTRIBUTES", "QUATERNION")
    found = np.frombuffer(back, "<i2").reshape(-1, 4) / 32767
    assert (np.abs((found * turns).sum(axis=1)) > 1 - 1e-4).all()  # q and -q are the same rotation


def test_what_is_packed_badly_is_one_sentence(tmp_path):
    path = tmp_path / "odd.glb"

    def said(**values):
        def change(document):
            document["bufferViews"][2]["extensions"][MESHOPT].update(values)

        with pytest.raises(RisoriusError) as found:
            read_gltf(head(path, packed=True, change=change))
        assert str(found.value).startswith(f"{path}: bufferViews[2]")
        return str(found.value)

    assert "byteStride: a whole number was expected, found None" in said(byteStride=None)
    assert "byteStride of 4, 8, .. 256 was expected, found 6" in said(byteStride=6)
    assert "byteStride: 0 to 256 was expected, found 512" in said(byteStride=512)
    assert "three corners a triangle" in said(mode="TRIANGLES", byteStride=4, count=506)
    assert "mode: one of ATTRIBUTES, TRIANGLES, INDICES was expected, found 'LINES'" in said(
        mode="LINES"
    )
    assert "filter: one of NONE, OCTAHEDRAL" in said(filter="COLOR")
    assert "byteStride of 4 or 8 was expected for the filter" in said(
        byteStride=12, filter="OCTAHEDRAL"
    )
    assert "506 packed rows of 4 bytes were expected" in said(byteStride=4)
    assert "count: 0 to 2147483648 was expected, found -1" in said(count=-1)
    assert "cannot hold 1000000 rows" in said(count=1_000_000)
    assert "would be needed" in said(count=1 << 30)
    assert "byteLength: 0 or more was expected, found -5" in said(byteLength=-5)
    assert "the buffer is shorter" in said(byteLength=1 << 40)
    assert "a filter was expected of attributes alone" in said(
        mode="INDICES", byteStride=4, filter="EXPONENTIAL"
    )


def test_texture_coordinates_that_no_picture_has_are_one_sentence(tmp_path):
    def far(document):
        texture = document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
        texture["extensions"]["KHR_texture_transform"].update(scale=[1e30, 1e30])

    with pytest.raises(RisoriusError, match=r"TEXCOORD_0: texture coordinates up to 1e\+06 were"):
        read_gltf(head(tmp_path / "odd.glb", packed=True, change=far))


def test_damaged_bytes_are_refused_or_read(tmp_path):
    """Files with changed bytes or cut ends raise only errors of Risorius."""
    whole = head(tmp_path / "whole.glb", packed=True).read_bytes()
    path = tmp_path / "odd.glb"
    random = np.random.default_rng(20261127)
    refused = 0
    for case in range(300):
        data = bytearray(whole)
        begin = (
            12 if case % 2 else 12 + int.from_bytes(whole[12:16], "little")
        )  # the whole file, or only the packed data
        for at in random.integers(begin, len(data), 1 + case % 4):
            data[at] = int(random.integers(256))
        if case % 10 == 0:
            del data[int(random.integers(20, len(data))) :]
        path.write_bytes(data)
        try:
            mesh, _ = read_gltf(path)
            assert np.isfinite(mesh.positions).all()
        except (RisoriusError, BudgetError) as error:
            assert str(path) in str(error) or "would be needed" in str(error)
            refused += 1
    assert refused > 150


def with_draco(path, packed, count, change=None):
    positions, _ = face_shapes.head()
    delta = (face_shapes.expressions(positions)["jawOpen"] / 100).astype("<f4")
    glb = Glb()
    for kind in ("VEC3", "SCALAR"):
        glb.json["accessors"].append({"type": kind, "componentType": 5126, "count": count})
    glb.json["meshes"] = [{"extras": {"targetNames": ["jawOpen"]}, "primitives": [{
        "attributes": {"POSITION": 0}, "indices": 1,
        "targets": [{"POSITION": glb.accessor(delta, "VEC3")}],
        "extensions": {"KHR_draco_mesh_compression": {
            "bufferView": glb.view(packed), "attributes": {"POSITION": 0}}},
    }]}]  # fmt: skip
    if change:
        change(glb.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"])
    glb.save(path)
    return path


def test_draco_names_its_package_where_it_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(RisoriusError, match=r"primitives\[0\]: .*`pip install DracoPy` reads it"):
        read_gltf(with_draco(tmp_path / "egg.glb", b"DRACO", 506))


def test_a_head_that_draco_packed(tmp_path):
    package = pytest.importorskip("DracoPy", reason="NOT RUN: DracoPy is not installed")
    positions, moved = face_shapes.head()[0], face_shapes.expressions(face_shapes.head()[0])
    packed = package.encode(
        (positions / 100).astype(np.float32), triangles(), quantization_bits=20, preserve_order=True
    )
    mesh, found = read_gltf(with_draco(tmp_path / "egg.glb", packed, len(positions)))
    np.testing.assert_allclose(mesh.positions, positions / 100, atol=1e-6)
    np.testing.assert_allclose(found["jawOpen"], moved["jawOpen"] / 100, atol=1e-7)
    assert mesh.faces == triangles().tolist()

    def said(packed=packed, count=506, change=None):
        with pytest.raises(RisoriusError) as error:
            read_gltf(with_draco(tmp_path / "egg.glb", packed, count, change))
        assert "meshes[0].primitives[0]" in str(error.value)
        return str(error.value)

    assert "505 rows of 3 numbers were expected, found (506, 3)" in said(count=505)
    assert "a mesh of Draco was expected" in said(packed=packed[:40])
    assert "an attribute of 0 was expected, found 7" in said(
        change=lambda d: d.update(attributes={"POSITION": 7})
    )


def test_every_odd_value_of_the_json_is_one_sentence_that_names_the_file(tmp_path):
    """One odd value at a time is put at each place of the JSON.

    Reading succeeds or raises an error that names the file. It gives no warnings and does not use
    gigabytes of memory.
    """
    path = tmp_path / "odd.glb"
    random = np.random.default_rng(20261128)
    odd = [None, -1, [], {}, "x", 1e308, 10**400, True, 2**53, 0.5, float("nan"), 7, 2**31]

    def places(value, at=()):
        yield at
        rows = value.items() if isinstance(value, dict) else enumerate(value[:3])
        for key, inner in rows if isinstance(value, dict | list) else ():
            yield from places(inner, (*at, key)) if isinstance(inner, dict | list) else [(*at, key)]

    def spoil(document, at):
        *way, last = at
        for key in way:
            document = document[key]
        document[last] = odd[int(random.integers(len(odd)))]

    everywhere = []
    head(path, packed=True, change=lambda document: everywhere.extend(places(document)))
    everywhere = [at for at in everywhere if at and at[0] != "buffers"]  # save() replaces them
    refused = 0
    for at in everywhere:
        head(path, packed=True, change=functools.partial(spoil, at=at))
        try:
            read_gltf(path)
        except RisoriusError as error:
            assert str(error).startswith(str(path))
            assert len(str(error)) < 400
            refused += 1
    assert refused > 0.4 * len(everywhere)
