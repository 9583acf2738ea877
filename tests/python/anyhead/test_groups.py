# SPDX-License-Identifier: MIT
"""Tests of names of vertex groups and joints, which tell where the head of a body is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fbx_files import I64, fbx
from glb_files import Glb
from risorius.anyhead.form.heads import head_form
from risorius.anyhead.landmarks.find import Hints, find_form
from risorius.anyhead.landmarks.groups import head_box, part_in, place_of
from risorius.anyhead.landmarks.marks import LandmarkError
from risorius.anyhead.reading import read_head
from risorius.anyhead.standing import stand
from risorius.anyhead.surface import Surface
from risorius.author.heads.parts import Wishes

STANDS = Wishes(up="+y", front="+z", unit="cm")  # a search of all directions takes seconds
NAMES = {
    "head": ("head", "Head_mesh_LOD0", "mixamorig:Head", "J_Bip_C_Head", "DEF-spine.006"),
    "eye_L": ("eye.L", "CC_Base_L_Eye", "LeftEye", "lEye", "J_Adj_L_FaceEye", "FACIAL_L_Eye"),
    "eye_R": ("eye_R.001", "EYE_R"),
    "lip_L": ("DEF-lip.T.L",),
    "lip": ("lips", "Lips_upper"),
    "mouth_R": ("mouthCorner_R",),
    "lid_R": ("UpperLid_R", "DEF-lid.B.R.002"),
    "ear": ("Ears",),
    "jaw": ("jaw_master", "CC_Base_JawRoot"),
    "nose": ("nose",),
    "neck": ("neck_01", "CC_Base_NeckTwist01", "Neck"),
    "": ("headphones", "Headband_03", "Hand_L", "RightUpLeg", "DEF-spine.003", "eye_L_R", "", "12"),
}


def test_names_of_groups_and_joints_mean_places() -> None:
    assert {name: place_of(name) for names in NAMES.values() for name in names} == {
        name: place for place, names in NAMES.items() for name in names
    }


def plate(low: tuple[float, ...], high: tuple[float, ...], count: int) -> Surface:
    """A closed box with a grid of triangles on each side."""
    low_, size = np.array(low), np.array(high) - np.array(low)
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, count)] * 2, indexing="ij"), -1).reshape(-1, 2)
    at = np.arange(count * count).reshape(count, count)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], -1).reshape(-1, 4)
    points, faces = [], []
    for axis in range(3):
        for end in (0, 1):
            side = np.insert(grid, axis, end, axis=1)
            side[:, [(axis + 1) % 3, (axis + 2) % 3]] = grid
            faces.append((quads if end else quads[:, ::-1]) + len(points) * count * count)
            points.append(low_ + size * side)
    return Surface.of_polygons(np.concatenate(points), np.concatenate(faces).tolist())


def model_head() -> Surface:
    form = head_form()
    points = form.shaped(np.zeros(len(form.parts)), np.zeros(len(form.expressions)))
    return Surface(points[: form.skin], form.triangles)


def write_groups(path: Path, rows: list[tuple[str, Surface]]) -> Path:
    """Write an OBJ file; each surface is in the group of its name."""
    lines, count = [], 1
    for name, surface in rows:
        lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in surface.points]
        lines += [f"g {name}", *(f"f {a} {b} {c}" for a, b, c in surface.triangles + count)]
        count += len(surface.points)
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_group_of_an_obj_tells_where_the_head_of_a_body_is(tmp_path: Path) -> None:
    """The banner is higher than the head, so the search at the top finds no face."""
    rows = [
        ("body clothes", plate((-20, -150, -15), (20, -16, 5), 6)),
        ("default Head_geo", model_head()),
        ("banner", plate((15, -150, -8), (55, 60, -4), 8)),
    ]
    parts, unit = read_head(write_groups(tmp_path / "wizard.obj", rows))
    assert list(parts[0].groups) == ["body", "clothes", "default", "Head_geo", "banner"]
    np.testing.assert_allclose(parts[0].groups["Head_geo"], rows[1][1].points, atol=1e-5)
    found = stand("wizard", parts, unit, STANDS, None).found.landmarks.points
    form = head_form()
    wanted = {name: form.mean[vertex] for name, vertex in form.places.items()}
    assert max(np.linalg.norm(found[name] - wanted[name]) for name in wanted) < 0.15
    parts[0].groups.clear()
    with pytest.raises(LandmarkError):
        stand("wizard", parts, unit, STANDS, None)


def test_a_group_with_a_wrong_name_does_no_harm() -> None:
    surface = model_head()
    points, upright = surface.points, Hints(up=np.eye(3)[1], front=np.eye(3)[2])
    plain = find_form(surface, upright).landmarks.points
    for wrong in (points[points[:, 1] > 4], points[points[:, 1] < -10]):
        box = head_box([("head", wrong)])
        assert part_in(surface, box) is not None
        misled = find_form(surface, replace(upright, box=box)).landmarks.points
        assert misled.keys() == plain.keys()
        assert all(np.array_equal(misled[name], plain[name]) for name in plain)


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float64)


def test_joints_of_a_gltf_are_groups(tmp_path: Path) -> None:
    glb = Glb()
    attributes = {
        "POSITION": glb.accessor(SQUARE.astype("<f4"), "VEC3"),
        "JOINTS_0": glb.accessor(np.array([[0, 1, 0, 0]] * 4, "u1"), "VEC4", 5121),
        "WEIGHTS_0": glb.accessor(
            np.array([[1, 0, 0, 0], [0.2, 0.8, 0, 0], [0.5, 0.5, 0, 0], [0, 1, 0, 0]], "<f4"),
            "VEC4",
        ),
    }
    indices = glb.accessor(np.array([0, 1, 2, 0, 2, 3], "<u2"), "SCALAR", 5123)
    glb.json["meshes"] = [{"primitives": [{"attributes": attributes, "indices": indices}]}]
    glb.json["nodes"] = [
        {"name": "body", "mesh": 0, "skin": 0},
        {"name": "spine", "translation": [0, 0, 5]},
        {"name": "Head"},
    ]
    glb.json["skins"] = [{"joints": [1, 2]}]
    glb.save(tmp_path / "body.glb")
    groups = read_head(tmp_path / "body.glb")[0][0].groups
    assert {name: rows.tolist() for name, rows in groups.items()} == {
        "spine": [[0, 0, 5]], "Head": [[1, 0, 5], [0, 1, 5]],
    }  # fmt: skip
    attributes["WEIGHTS_0"] = attributes["JOINTS_0"] = 99
    glb.save(tmp_path / "body.glb")
    assert read_head(tmp_path / "body.glb")[0][0].groups == {}


def test_joints_of_an_fbx_are_groups(tmp_path: Path) -> None:
    def cluster(number: int, vertices: list[int], weights: list[float]) -> tuple:
        inner = [("Indexes", (np.array(vertices, "<i4"),)), ("Weights", (np.array(weights),))]
        return "Deformer", (I64(number), "\0\1SubDeformer", "Cluster"), inner

    corners = np.array([0, 1, 2, ~3], "<i4")
    mesh = [("Vertices", (100 * SQUARE.ravel(),)), ("PolygonVertexIndex", (corners,))]
    joints = ((2, "body", "Mesh"), (3, "head", "LimbNode"), (4, "hips", "LimbNode"))
    objects = [
        ("Geometry", (I64(1), "body\0\1Geometry", "Mesh"), mesh),
        *(("Model", (I64(n), f"{name}\0\1Model", kind), [("Version", (232,))])
          for n, name, kind in joints),
        ("Deformer", (I64(5), "\0\1Deformer", "Skin"), [("Version", (101,))]),
        cluster(6, [1, 2, 9], [0.9, 0.4, 1.0]),
        cluster(7, [0, 3], [1.0]),
    ]  # fmt: skip
    links = [(1, 2), (2, 0), (3, 0), (4, 0), (5, 1), (6, 5), (3, 6), (7, 5), (4, 7)]
    connections = [("C", ("OO", I64(child), I64(parent))) for child, parent in links]
    written = fbx([("Objects", (), objects), ("Connections", (), connections)])
    (tmp_path / "body.fbx").write_bytes(written)
    groups = read_head(tmp_path / "body.fbx")[0][0].groups
    assert {name: rows.tolist() for name, rows in groups.items()} == {"head": [[1, 0, 0]]}
