# SPDX-License-Identifier: MIT
"""Makes the input heads of docs/anyhead.md: heads without expressions and without a rig.

any_heads.py FOLDER    writes scan.obj, stylised.obj and avatar.glb, and voice.wav with its sounds
                       said.tsv; needs bpy and the data of the sample people

scan.obj has noise and holes like a scan. stylised.obj has large eyes, a small jaw and few polygons.
avatar.glb has separate meshes for head, eyes and teeth. The head meshes are remeshed, so they share
no topology with a sample person.
"""

from __future__ import annotations

import sys
import wave
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from risorius.author.geometry.skeleton import Doubles
from risorius_people.blend_shape_face import assemble
from risorius_people.people import MAN, PEOPLE, Person
from risorius_people.source import Source, fetch

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tests" / "python" / "support"))

import likenesses  # noqa: E402

Faces = list[list[int]]
HEAD = "head_lod0_mesh"
_PLAIN = {"asymmetry": {}, "hair_style": "none", "beard_style": "none"}
SCANNED = replace(
    MAN, name="Scanned", age=48, muscle=0.6, weight=0.65, **_PLAIN,
    origin={"caucasian": 0.3, "african": 0.5, "asian": 0.2},
    features={"nose/nose-width1-incr": 0.5, "chin/chin-width-incr": 0.4,
              "head/head-square": 0.3, "mouth/mouth-scale-horiz-incr": 0.3},
)  # fmt: skip
DRAWN = replace(PEOPLE["girl"], name="Drawn", age=12, **_PLAIN)
WORN = replace(
    PEOPLE["woman"], name="Worn", age=24, **_PLAIN,
    origin={"caucasian": 0.2, "african": 0.1, "asian": 0.7},
)  # fmt: skip


def meshes_of(person: Person, source: Source) -> dict[str, tuple[Doubles, Faces]]:
    """The meshes of LOD 0 of a person in the neutral pose: name -> (positions in cm, polygons).

    Args:
        person: a person of PEOPLE or a changed copy.
        source: the data of the sample people, with y up.
    """
    dna, _parts, _body = assemble(source, lambda _share: None, person)
    out = {}
    for number in dna.lod_mesh_mapping[0]:
        mesh = dna.meshes[int(number)]
        corners = np.asarray(mesh.layout_positions)[np.asarray(mesh.face_layouts, np.int64)]
        ends = np.asarray(mesh.face_offsets, np.int64)[1:-1]
        faces = [face.tolist() for face in np.split(corners, ends)]
        out[dna.mesh_names[int(number)]] = (np.asarray(mesh.positions, np.float64), faces)
    return out


def remeshed(
    points: Doubles, faces: Faces, *modifiers: tuple[str, dict[str, object]]
) -> tuple[Doubles, Faces]:
    """Apply Blender modifiers to a mesh. Returns its positions and polygons.

    Args:
        points: vertex positions, float64[V, 3].
        faces: vertex indices of each polygon.
        modifiers: (type of modifier, its settings), applied in this order.
    """
    mesh = bpy.data.meshes.new("head")
    mesh.from_pydata(points.tolist(), [], faces)
    item = bpy.data.objects.new("head", mesh)
    bpy.context.scene.collection.objects.link(item)
    for kind, settings in modifiers:
        modifier = item.modifiers.new(kind, kind)
        for name, value in settings.items():
            setattr(modifier, name, value)
    seen = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    out = np.empty(3 * len(seen.vertices), np.float32)
    seen.vertices.foreach_get("co", out)
    polygons = [list(polygon.vertices) for polygon in seen.polygons]
    bpy.data.objects.remove(item)
    return out.reshape(-1, 3).astype(np.float64), polygons


def scan(points: Doubles, faces: Faces, seed: int = 4) -> tuple[Doubles, Faces]:
    """A mesh like a scan: with noise of 0.1 mm (standard deviation on each axis), and with five
    holes in the rear 60 % of its polygons.

    Args:
        points: vertex positions, float64[V, 3], cm.
        faces: vertex indices of each polygon.
        seed: seed of noise and holes.
    """
    points, faces = remeshed(
        points, faces, ("SUBSURF", {"levels": 1, "subdivision_type": "SIMPLE"}),
        ("DECIMATE", {"ratio": 0.25}),
    )  # fmt: skip
    random = np.random.default_rng(seed)
    middles = np.array([points[face].mean(axis=0) for face in faces])
    kept = np.ones(len(faces), bool)
    back = np.flatnonzero(middles[:, 2] < np.quantile(middles[:, 2], 0.6))
    for place in middles[random.choice(back, 5, replace=False)]:
        kept &= np.linalg.norm(middles - place, axis=1) > random.uniform(0.4, 1.1)
    noisy = points + random.normal(0, 0.01, points.shape)
    return _used(noisy, [face for face, stays in zip(faces, kept, strict=True) if stays])


def _used(points: Doubles, faces: Faces) -> tuple[Doubles, Faces]:
    """The mesh without unused vertices."""
    used = np.unique(np.concatenate([np.array(face) for face in faces]))
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    return points[used], [number[face].tolist() for face in faces]


def drawn(meshes: dict[str, tuple[Doubles, Faces]]) -> tuple[Doubles, Faces]:
    """A stylised head of few polygons with large eyes, a small jaw and a high forehead."""
    points, faces = meshes[HEAD]
    eyes = [meshes[f"eye{side}_lod0_mesh"][0].mean(axis=0) for side in ("Left", "Right")]
    points = points.copy()
    for eye in eyes:
        away = points - eye
        near = np.exp(-((np.linalg.norm(away, axis=1) / 3.0) ** 4))
        points += 0.35 * near[:, None] * away
    height = (points[:, 1] - eyes[0][1]) / 10.0  # 0 at the eyes, -1 at the chin or so
    low = np.clip(-height, 0.0, 1.2)
    points[:, 0] *= 1 - 0.22 * low
    points[:, 1] += 0.9 * low - 0.0
    points[:, [0, 2]] *= (1 + 0.12 * np.clip(height, 0.0, 1.0))[:, None]
    return remeshed(points, faces, ("DECIMATE", {"ratio": 0.3}))


def avatar(meshes: dict[str, tuple[Doubles, Faces]]) -> list[dict[str, object]]:
    """Triangle meshes of a head, its eyes and its teeth, named as Ready Player Me names them."""
    head = remeshed(*meshes[HEAD], ("SUBSURF", {"levels": 1}), ("DECIMATE", {"ratio": 0.12}))
    named = {"Wolf3D_Head": head, "EyeLeft": meshes["eyeLeft_lod0_mesh"]}
    named |= {"EyeRight": meshes["eyeRight_lod0_mesh"], "Wolf3D_Teeth": meshes["teeth_lod0_mesh"]}
    return [
        likenesses.mesh(name, (points, _triangles(faces)))
        for name, (points, faces) in named.items()
    ]


def _triangles(faces: Faces) -> list[list[int]]:
    return [[f[0], f[k], f[k + 1]] for f in faces for k in range(1, len(f) - 1)]


def write_obj(path: Path, points: Doubles, faces: Faces) -> None:
    """Write a mesh as an OBJ file.

    Args:
        path: the file.
        points: vertex positions, float64[V, 3].
        faces: vertex indices of each polygon, from 0.
    """
    lines = ["v {:.5f} {:.5f} {:.5f}".format(*point) for point in points]
    lines += ["f " + " ".join(str(vertex + 1) for vertex in face) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_voice(folder: Path) -> None:
    """Write voice.wav, a hum of 1.5 s, and said.tsv, the times of ten phonemes."""
    sounds = ("sil", "HH", "AH", "L", "OW", "M", "AA", "M", "AA", "sil")
    rows = [f"{0.15 * n:.2f}\t{0.15 * (n + 1):.2f}\t{sound}\t1\t" for n, sound in enumerate(sounds)]
    text = "\n".join(["begin\tend\tphoneme\tconfidence\tword", *rows]) + "\n"
    (folder / "said.tsv").write_text(text, encoding="utf-8")
    tone = 6000 * np.sin(2 * np.pi * 150 * np.arange(24_000) / 16_000)
    with wave.open(str(folder / "voice.wav"), "wb") as file:
        file.setparams((1, 2, 16_000, 0, "NONE", ""))
        file.writeframes(tone.astype("<i2").tobytes())


def write_all(folder: Path) -> None:
    """Write the three heads and the voice into a folder, which is made if it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    write_voice(folder)
    source = Source(fetch(offline=True))
    write_obj(folder / "scan.obj", *scan(*meshes_of(SCANNED, source)[HEAD]))
    write_obj(folder / "stylised.obj", *drawn(meshes_of(DRAWN, source)))
    rows = avatar(meshes_of(WORN, source))
    likenesses.save_glb(folder / "avatar.glb", likenesses.placed(rows))


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))
