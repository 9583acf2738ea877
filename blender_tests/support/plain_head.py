# SPDX-License-Identifier: GPL-3.0-or-later
"""A head without expressions, and fake functions of risorius that process heads."""

from types import SimpleNamespace

import bpy
import numpy as np

from . import scene
from .egg import face_shapes

METRES = 0.01
# Landmarks that the fake search finds on the head of face_shapes, in cm with y up. The landmark
# chin is missing, so that tests can place it.
PLACES = {
    "eye_inner_L": (2.0, 3.0, 9.0),
    "eye_inner_R": (-2.0, 3.0, 9.0),
    "mouth_corner_L": (2.5, -5.0, 8.0),
}
WORDS = {
    "eye_inner_L": "the inner corner of the left eye",
    "eye_inner_R": "the inner corner of the right eye",
    "mouth_corner_L": "the left corner of the mouth",
    "chin": "the chin",
}


def to_blender(points):
    """Convert points from centimetres with y up to metres with z up."""
    points = np.asarray(points, np.float64)
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1) * METRES


def plain_head(name="Egg"):
    """Add the head of face_shapes, without shape keys, as the active object."""
    positions, faces = face_shapes.head()
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(to_blender(positions).tolist(), [], faces.tolist())
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    item.select_set(True)
    return item


class Package:
    """Replaces the functions of scene/anyhead/finding.py that find landmarks by risorius.

    Attributes:
        places: name -> landmark that the fake search finds, in centimetres with y up.
        heads: the finding.Head that each search got.
    """

    def __init__(self, monkeypatch):
        self.places, self.heads = dict(PLACES), []
        finding = scene.submodule("scene.anyhead.finding")
        monkeypatch.setattr(finding, "words", lambda: WORDS)
        monkeypatch.setattr(finding, "needed", lambda: frozenset(WORDS))
        monkeypatch.setattr(finding, "_search", self._search)

    def _search(self, head, _progress):
        self.heads.append(head)
        points = {**self.places, **head.fixed}
        return SimpleNamespace(points=points, notes=["It is an egg."])


def opened(positions):
    """Displacements of a fake expression jawOpen, float64[V, 3] in cm.

    The lower half of the head moves down by 1 cm.
    """
    low = positions[:, 1] < positions[:, 1].mean()
    return low[:, None] * np.array([0.0, -1.0, 0.0])


class Onto(Package):
    """Also replaces the functions that transfer expressions to a head or conform a face to it.

    The fake transfer gives the head only the expression jawOpen.

    Attributes:
        asked: arguments of the calls: (Dna of the template, Transfer) for each transfer, (Dna,
            finding.Head) for each conform.
    """

    def __init__(self, monkeypatch):
        super().__init__(monkeypatch)
        self.places["chin"] = (0.0, -11.0, 7.0)
        self.asked = []
        self._making = scene.submodule("scene.anyhead.making")
        monkeypatch.setattr(self._making, "_carry_over", self._carry_over)
        monkeypatch.setattr(self._making, "_conform", self._conform)

    def _carry_over(self, head, template, transfer, progress):
        self.heads.append(head)
        self.asked.append((template.load(), transfer))
        assert progress(0.5)
        part = scene.submodule("native").part
        parts, faces = part("author.heads.parts"), part("author.input.shape_face")
        face = head.parts[0]
        moved = {"jawOpen": transfer.strength * opened(face.mesh.positions)}
        rows = [parts.HeadPart(face.name, face.mesh, moved, source=face.source)]
        joined = part("author.heads.joining").join("Egg", rows, "cm", parts.Wishes(scale=1.0), {})
        shapes = faces.shape_set(face.name, joined)
        marks = SimpleNamespace(points={**self.places, **head.fixed}, notes=[])
        made = SimpleNamespace(shapes=shapes, landmarks=marks, notes=["It stands."])
        face = faces.make_shape_face(shapes, {"jawOpen": ["jawOpen"]})
        dna = template.load()
        part("anyhead.tables").copy_board(dna, face)
        odd = ["It stands.", "It is odd."]
        return made, SimpleNamespace(dna=face, kept=(), odd=odd, materials={}, template=dna)

    def _conform(self, head, dna, _progress):
        self.asked.append((dna, head))
        return SimpleNamespace(dna=dna, notes=["It fits."])
