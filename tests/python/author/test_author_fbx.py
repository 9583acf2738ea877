# SPDX-License-Identifier: MIT
"""Tests heads from FBX: pivots, orders of rotation, axes, units, in-between targets.

Damaged and unsuitable files are refused.
"""

import command_line
import face_shapes
import numpy as np
import pytest
from fbx_files import I64, fbx
from risorius.author.input.fbx import read_fbx
from risorius.author.input.obj import ShapeFileError
from risorius.base.budget import BudgetError
from risorius.base.errors import RisoriusError
from risorius.importing.errors import AnimationFileError

MESH, NODE, ABOVE, BLEND = 10, 11, 12, 13
PLACE = {
    "Lcl Translation": (1.0, 2.0, 3.0), "RotationOffset": (0.3, 0.1, -0.2),
    "RotationPivot": (4.0, -1.0, 2.0), "PreRotation": (30.0, 0.0, 10.0),
    "Lcl Rotation": (20.0, -50.0, 70.0), "PostRotation": (0.0, 15.0, 0.0),
    "ScalingOffset": (0.0, 0.5, 0.0), "ScalingPivot": (2.0, 0.0, 1.0),
    "Lcl Scaling": (1.0, 2.0, 0.5),
}  # fmt: skip
ORDER, ORDERS = 4, ("XYZ", "XZY", "YZX", "YXZ", "ZXY", "ZYX")


def turned(points, degrees, order="XYZ", back=False):
    """Points rotated about the axes by Rodrigues' formula.

    Args:
        points: float[V, 3].
        degrees: angles about x, y and z.
        order: the axis of each rotation, first to last.
        back: whether to undo this rotation.
    """
    for letter in reversed(order) if back else order:
        axis = "XYZ".index(letter)
        angle = np.radians(degrees[axis]) * (-1 if back else 1)
        k = np.eye(3)[axis]
        points = (
            points * np.cos(angle)
            + np.cross(k, points) * np.sin(angle)
            + np.outer(points @ k, k) * (1 - np.cos(angle))
        )
    return points


def placed(points):
    """Points transformed by a node's properties, step by step as in FbxNode's manual."""
    p = {name: np.array(value) for name, value in PLACE.items()}
    points = (points - p["ScalingPivot"]) * p["Lcl Scaling"] + p["ScalingPivot"]
    points = points + p["ScalingOffset"] - p["RotationPivot"]
    points = turned(points, p["PostRotation"], back=True)
    points = turned(points, p["Lcl Rotation"], ORDERS[ORDER])
    points = turned(points, p["PreRotation"])
    points = points + p["RotationPivot"] + p["RotationOffset"] + p["Lcl Translation"]
    above = np.array([0.0, 0.0, 10.0])
    return points + above


def row(name, *values):
    return ("P", (name, "", "", "", *values))


def vectors(points):
    return np.ascontiguousarray(points, "<f8").ravel()


class Egg:
    """An FBX with the head of face_shapes, whose parts can be changed before it is saved."""

    def __init__(self):
        self.positions, quads = face_shapes.head()
        self.moved = face_shapes.expressions(self.positions)
        self.corners = quads.astype("<i4").copy()
        self.uvs = np.random.default_rng(1).random((len(quads) * 4, 2))
        ends = self.corners.copy()
        ends[:, 3] = ~ends[:, 3]
        self.mesh = {
            "Vertices": vectors(self.positions),
            "PolygonVertexIndex": ends.ravel(),
        }
        self.uv_index = np.arange(len(self.uvs))[::-1].astype("<i4").copy()
        self.uv_rows = [
            ("MappingInformationType", ("ByPolygonVertex",)),
            ("ReferenceInformationType", ("IndexToDirect",)),
        ]
        self.node = [row(name, *value) for name, value in PLACE.items()]
        self.node.append(row("RotationOrder", ORDER))
        self.settings = [row("UnitScaleFactor", 1.0)]
        self.shape = {}  # replaced fields of the first target
        self.extra, self.links = [], []

    def save(self, path, version=7400):
        objects = [
            ("Geometry", (I64(MESH), "Egg\0\1Geometry", "Mesh"), [
                *((name, (value,)) for name, value in self.mesh.items()),
                ("LayerElementUV", (0,), [
                    *self.uv_rows, ("UV", (vectors(self.uvs),)), ("UVIndex", (self.uv_index,)),
                ]),
            ]),
            ("Model", (I64(NODE), "Egg\0\1Model", "Mesh"), [("Properties70", (), self.node)]),
            ("Model", (I64(ABOVE), "Root\0\1Model", "Null"), [
                ("Properties70", (), [row("Lcl Translation", 0.0, 0.0, 10.0)]),
            ]),
            ("Deformer", (I64(BLEND), "\0\1Deformer", "BlendShape")),
            *self.extra,
        ]  # fmt: skip
        links = [(MESH, NODE), (NODE, ABOVE), (ABOVE, 0), (BLEND, MESH), *self.links]
        for number, (name, delta) in enumerate(self.moved.items()):
            channel = 100 + 10 * number
            links.append((channel, BLEND))
            # An in-between target that is not on the straight line, before the full target.
            weights = [50.0, 100.0] if number == 1 else [100.0]
            objects.append(
                ("Deformer", (I64(channel), f"face.{name}\0\1SubDeformer", "BlendShapeChannel"),
                 [("FullWeights", (np.array(weights),))])
            )  # fmt: skip
            for step in range(len(weights)):
                full = step == len(weights) - 1
                at = np.flatnonzero(delta.any(axis=1)).astype("<i4")
                parts = {"Indexes": at, "Vertices": vectors(delta[at] if full else -delta[at])}
                parts |= self.shape if number == 0 else {}
                identity = channel + 1 + step
                links.append((identity, channel))
                objects.append(
                    ("Geometry", (I64(identity), "\0\1Geometry", "Shape"),
                     [(key, (value,)) for key, value in parts.items()])
                )  # fmt: skip
        path.write_bytes(
            fbx(
                [
                    ("GlobalSettings", (), [("Properties70", (), self.settings)]),
                    ("Objects", (), objects),
                    ("Connections", (), [("C", ("OO", I64(a), I64(b))) for a, b in links]),
                ],
                version,
            )
        )
        return path


@pytest.mark.parametrize("version", [7400, 7700])
def test_a_head_is_what_was_written(tmp_path, version):
    egg = Egg()
    mesh, found = read_fbx(egg.save(tmp_path / "egg.fbx", version))
    np.testing.assert_allclose(mesh.positions, placed(egg.positions) / 100, atol=1e-9)
    assert list(found) == list(egg.moved)
    for name, delta in egg.moved.items():
        wanted = placed(egg.positions + delta) - placed(egg.positions)
        np.testing.assert_allclose(found[name], wanted / 100, atol=1e-9)
    assert mesh.faces == egg.corners.tolist()
    np.testing.assert_array_equal(mesh.uvs, egg.uvs)
    assert mesh.uv_faces == egg.uv_index.reshape(-1, 4).tolist()


def test_axes_and_unit_are_those_of_the_scene(tmp_path):
    egg = Egg()
    egg.settings = [
        row("UpAxis", 2), row("UpAxisSign", 1), row("FrontAxis", 1), row("FrontAxisSign", -1),
        row("CoordAxis", 0), row("CoordAxisSign", 1), row("UnitScaleFactor", 100.0),
    ]  # fmt: skip
    mesh, _ = read_fbx(egg.save(tmp_path / "egg.fbx"))
    x, y, z = placed(egg.positions).T
    np.testing.assert_allclose(mesh.positions, np.stack([x, z, -y], axis=1), atol=1e-9)


def test_texture_coordinates_of_vertices(tmp_path):
    egg = Egg()
    egg.uvs = egg.uvs[: len(egg.positions)]
    egg.uv_rows = [
        ("MappingInformationType", ("ByVertice",)),
        ("ReferenceInformationType", ("Direct",)),
    ]
    mesh, _ = read_fbx(egg.save(tmp_path / "egg.fbx"))
    assert mesh.uv_faces == mesh.faces


def test_the_command_makes_a_rig_of_it(tmp_path):
    egg = Egg()
    egg.node = []
    egg.save(tmp_path / "egg.fbx")
    spec = tmp_path / "spec.toml"
    spec.write_text('[source]\nneutral = "egg.fbx"\n[joints]\ncount = 20\n', encoding="utf-8")
    done = command_line.run("author", spec, "--names", text=True)
    assert '"jawOpen" = "jawOpen"' in done.stdout
    done = command_line.run("author", spec, "-o", tmp_path / "egg.dna", text=True)
    assert done.returncode == 0, done.stderr
    assert "20 new joints" in done.stdout


def test_what_is_no_head_is_one_sentence(tmp_path):
    path = tmp_path / "egg.fbx"

    def said(change, mesh=""):
        egg = Egg()
        change(egg)
        egg.save(path)
        with pytest.raises((ShapeFileError, AnimationFileError)) as found:
            read_fbx(path, mesh)
        assert str(found.value).startswith(str(path))
        return str(found.value)

    def corners(egg, values):
        egg.mesh["PolygonVertexIndex"] = np.array(values, "<i4")

    assert "one of Egg was expected, found Ham" in said(lambda egg: None, mesh="Ham")
    assert "with blend shapes was expected" in said(lambda egg: egg.moved.clear())
    assert "polygons of 506 vertices" in said(lambda egg: corners(egg, [0, 1, 2]))
    assert "polygons of 506 vertices" in said(lambda egg: corners(egg, [0, 506, ~2]))
    assert "polygons of 506 vertices" in said(lambda egg: corners(egg, []))
    assert "triples were expected" in said(
        lambda egg: egg.mesh.update(Vertices=egg.mesh["Vertices"][1:])
    )
    assert "finite numbers" in said(lambda egg: egg.positions.__setitem__(3, np.nan) or
                                    egg.mesh.update(Vertices=vectors(egg.positions)))  # fmt: skip
    assert "UVIndex: 1848 were expected, found 1847" in said(
        lambda egg: setattr(egg, "uv_index", egg.uv_index[1:])
    )
    assert "UVIndex: indices below 9" in said(lambda egg: setattr(egg, "uvs", egg.uvs[:9]))
    assert "Indexes below 506" in said(lambda egg: egg.shape.update(Indexes=np.array([506], "<i4"),
                                       Vertices=np.zeros(3)))  # fmt: skip
    assert "2 vertices were expected, found 1" in said(
        lambda egg: egg.shape.update(Indexes=np.array([1, 2], "<i4"), Vertices=np.zeros(3))
    )
    for name in ("Lcl Scaling", "PreRotation"):
        rows = [row(name, 1.0, "2", 3.0)]
        assert f"{name}: three numbers" in said(lambda egg, rows=rows: egg.node.extend(rows))
    assert "RotationOrder: 0 to 5" in said(lambda egg: egg.node.append(row("RotationOrder", 6)))
    settings = {
        "three different axes": [row("UpAxis", 0)],
        "UpAxis of 0, 1 or 2": [row("UpAxis", 7)],
        "UnitScaleFactor above 0": [row("UnitScaleFactor", 0.0)],
    }
    for sentence, rows in settings.items():
        assert sentence in said(lambda egg, rows=rows: egg.settings.extend(rows))
    path.write_text("; FBX 7.4.0 project file\n", encoding="utf-8")
    with pytest.raises(ShapeFileError, match="a binary FBX was expected"):
        read_fbx(path)


def test_damaged_files_are_refused_or_read(tmp_path):
    """Files with changed bytes or cut ends raise only errors of Risorius."""
    egg = Egg()
    egg.moved = dict(list(egg.moved.items())[:2])
    whole = egg.save(tmp_path / "egg.fbx").read_bytes()
    path = tmp_path / "odd.fbx"
    random = np.random.default_rng(20261123)
    refused = 0
    for case in range(600):
        data = bytearray(whole)
        if case % 3 == 0:
            del data[int(random.integers(len(data))) :]
        else:
            for at in random.integers(27, len(data), 1 + case % 4):
                data[at] = int(random.integers(256))
        path.write_bytes(data)
        try:
            mesh, _ = read_fbx(path)
            assert np.isfinite(mesh.positions).all()
        except (RisoriusError, BudgetError):
            refused += 1
    assert refused > 200


def test_a_mirrored_and_cut_head_is_one_surface_that_shows_its_front(tmp_path):
    egg = Egg()
    whole, seam = egg.positions.copy(), np.arange(11, 506, 23)
    cut = egg.corners.copy()
    right = np.isin(cut[:, 0] % 23, range(11, 23))
    for number, vertex in enumerate(seam.tolist()):
        cut[right] = np.where(cut[right] == vertex, 506 + number, cut[right])
    was = np.concatenate([np.arange(506), seam])
    egg.moved = {name: delta[was] for name, delta in egg.moved.items()}
    ends = cut.copy()
    ends[:, 3] = ~ends[:, 3]
    egg.mesh = {"Vertices": vectors(whole[was]), "PolygonVertexIndex": ends.ravel()}
    egg.node = [row("Lcl Scaling", -1.0, 1.0, 1.0)]
    mesh, found = read_fbx(egg.save(tmp_path / "egg.fbx"))
    np.testing.assert_allclose(mesh.positions, whole * [-0.01, 0.01, 0.01] + [0, 0, 0.1], atol=1e-9)
    assert mesh.faces == egg.corners[:, ::-1].tolist()
    assert mesh.uv_faces == egg.uv_index.reshape(-1, 4)[:, ::-1].tolist()
    assert len(found["jawOpen"]) == 506


def test_a_skinned_head_stands_as_it_was_bound(tmp_path):
    egg = Egg()
    places = {
        30: (0.0, 50.0, 0.0),
        31: (0.0, 20.0, 0.0),
    }  # a spine and its child, a posed neck
    bound = {30: (0.0, -50.0, 0.0), 31: (0.0, -70.0, 0.0)}
    egg.links = [(30, 0), (31, 30), (20, MESH), (21, 20), (22, 20), (31, 21), (30, 22)]
    for joint, shift in places.items():
        more = [row("Lcl Rotation", 0.0, 90.0, 0.0)] if joint == 31 else []
        egg.extra.append(
            ("Model", (I64(joint), "J\0\1Model", "LimbNode"),
             [("Properties70", (), [row("Lcl Translation", *shift), *more])])
        )  # fmt: skip
    egg.extra.append(("Deformer", (I64(20), "\0\1Deformer", "Skin")))
    for cluster, joint in ((21, 31), (22, 30)):
        matrix = np.eye(4)
        matrix[:3, :3] *= 2.0
        matrix[:3, 3] = bound[joint]
        egg.extra.append(
            ("Deformer", (I64(cluster), "\0\1SubDeformer", "Cluster"),
             [("Transform", (matrix.T.ravel().copy(),))])
        )  # fmt: skip
    mesh, found = read_fbx(egg.save(tmp_path / "egg.fbx"))
    np.testing.assert_allclose(mesh.positions, egg.positions * 2 / 100, atol=1e-9)
    np.testing.assert_allclose(found["jawOpen"], egg.moved["jawOpen"] * 2 / 100, atol=1e-9)
