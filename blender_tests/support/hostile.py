# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes broken DNA files, and valid files with unusual content.

Broken files have indices out of range, cycles of joints or huge counts. The package risorius
refuses to write such files, so this module changes bytes of valid files.
"""

from pathlib import Path

import numpy as np

from .faces import CONTROLS, JOINTS, small_face

DATA = Path(__file__).resolve().parents[2] / "tests" / "data"


def found_by_fuzzing():
    """Paths of the stored .dna and .json files that the project's fuzzers have found."""
    return [p for p in sorted((DATA / "fuzz").iterdir()) if p.suffix in {".dna", ".json"}]


def broken_on_purpose():
    """Yield (name, bytes, whether reading must fail) for each broken file of tests/data/malformed.

    Each line of edits.txt defines a file: name, name of the valid file, outcome, and edits
    `offset:number of removed bytes:inserted bytes in hexadecimal`.
    """
    bases = {}
    for line in (DATA / "malformed" / "edits.txt").read_text(encoding="utf-8").splitlines():
        name, base, outcome, *edits = line.split()
        if base not in bases:
            bases[base] = (DATA / "golden" / base).read_bytes()
        content, end, parts = bases[base], 0, []
        for edit in edits:
            offset, gone, come = edit.split(":")
            parts += [content[end : int(offset)], bytes.fromhex(come)]
            end = int(offset) + int(gone)
        yield name, b"".join([*parts, content[end:]]), outcome == "error"


def cut_short(content, count):
    """Yield up to `count` beginnings of a file, from the empty one to one that lacks one byte."""
    for length in np.unique(np.linspace(0, len(content) - 1, count).astype(int)):
        yield content[:length]


def with_flipped_bytes(content, count, seed):
    """Yield `count` copies of a file, each with one to eight randomly changed bytes.

    Most changed bytes are near the beginning, where counts and offsets are.
    """
    random = np.random.default_rng(seed)
    for _ in range(count):
        changed = bytearray(content)
        for _ in range(random.integers(1, 9)):
            place = int(random.random() ** 2 * len(changed))
            changed[place] ^= int(random.integers(1, 256))
        yield bytes(changed)


def _with(array, value, where=slice(None)):
    changed = np.array(array)
    changed[where] = value
    return changed


def _set(face, mesh=None, **values):
    """Set attributes of a face, or of its mesh with the index `mesh`."""
    meshes = list(face.meshes)
    for name, value in values.items():
        setattr(face if mesh is None else meshes[mesh], name, value)
    face.meshes = meshes


def _numbers(face, value):
    """Set some elements of each array of numbers in the meshes to `value`."""
    meshes = list(face.meshes)
    for mesh in meshes:
        mesh.positions = _with(mesh.positions, value, np.s_[::5])
        mesh.normals = _with(mesh.normals, value, np.s_[::3])
        mesh.texture_coordinates = _with(mesh.texture_coordinates, value, np.s_[::4])
        mesh.skin_weights = _with(mesh.skin_weights, value, np.s_[::7])
        targets = list(mesh.blend_shape_targets)
        for target in targets:
            target.deltas = _with(target.deltas, value, np.s_[::2])
        mesh.blend_shape_targets = targets
    face.meshes = meshes


def _surface(face, value):
    """Set some normals and texture coordinates to `value`; these affect only the shading."""
    for mesh in range(len(face.meshes)):
        normals, uvs = face.meshes[mesh].normals, face.meshes[mesh].texture_coordinates
        _set(
            face,
            mesh,
            normals=_with(normals, value, np.s_[::3]),
            texture_coordinates=_with(uvs, value, np.s_[::4]),
        )


def _neutral(face, value):
    _set(
        face,
        neutral_joint_translations=_with(face.neutral_joint_translations, value, 3),
        neutral_joint_rotations=_with(face.neutral_joint_rotations, value, 4),
    )


def _named(face, text):
    """Give the face, its joints, raw controls, channels, maps and meshes the same name `text`."""
    face.name = text
    face.joint_names = [text] * len(JOINTS)
    face.raw_control_names = [text] * len(CONTROLS)
    face.blend_shape_channel_names = [text] * len(face.blend_shape_channel_names)
    face.animated_map_names = [text] * len(face.animated_map_names)
    face.mesh_names = [text] * len(face.mesh_names)
    face.metadata = {text: text, f"texture:{text}:color": text}


def _flat_faces(face):
    """Replace the polygons of all meshes by polygons without area.

    They have one or two corners, or one vertex at several corners.
    """
    layouts = np.array([0, 1, 2, 5, 5, 5, 5, 6, 7, 6], np.uint32)
    for mesh in range(len(face.meshes)):
        _set(face, mesh, face_layouts=layouts, face_offsets=np.array([0, 1, 3, 7, 10], np.uint32))


def _empty(face, which=(0, 1, 2)):
    none = {"layout_positions": 0, "layout_normals": 0, "layout_texture_coordinates": 0}
    none |= {"face_layouts": 0, "skin_weights": 0, "skin_joint_indices": 0}
    for mesh in which:
        values = {n: np.zeros(0, getattr(face.meshes[mesh], n).dtype) for n in none}
        values |= {n: np.zeros((0, 3), np.float32) for n in ("positions", "normals")}
        values["texture_coordinates"] = np.zeros((0, 2), np.float32)
        values |= {n: np.zeros(1, np.uint32) for n in ("face_offsets", "skin_offsets")}
        _set(face, mesh, blend_shape_targets=[], **values)
    face.mesh_blend_shape_channel_mapping = [
        pair for pair in face.mesh_blend_shape_channel_mapping.tolist() if pair[0] not in which
    ]


def _no_faces(face):
    for mesh in range(len(face.meshes)):
        _set(
            face,
            mesh,
            face_layouts=np.zeros(0, np.uint32),
            face_offsets=np.zeros(1, np.uint32),
        )


def _no_skin(face):
    for mesh in range(len(face.meshes)):
        count = len(face.meshes[mesh].positions)
        _set(
            face,
            mesh,
            skin_weights=np.zeros(0, np.float32),
            skin_joint_indices=np.zeros(0, np.uint16),
            skin_offsets=np.zeros(count + 1, np.uint32),
        )


def _many_joints(face, count=5000):
    """Add a long chain of joints, each of which is 0.01 mm from its parent."""
    more = count - len(JOINTS)
    face.joint_names = [*JOINTS, *(f"tiny_{i}" for i in range(more))]
    face.joint_parents = np.array(
        [*face.joint_parents, *range(len(JOINTS) - 1, count - 1)], np.uint16
    )
    offsets = np.zeros((more, 3), np.float32)
    offsets[:, 0] = 0.001
    face.neutral_joint_translations = np.concatenate([face.neutral_joint_translations, offsets])
    face.neutral_joint_rotations = np.concatenate([face.neutral_joint_rotations, offsets * 0])
    face.joint_row_count = 9 * count
    face.lod_joint_mapping = [list(range(count))] * 2


def _matrix(face, value):
    groups = list(face.joint_groups)
    for group in groups:
        group.values = _with(group.values, value, np.s_[::2])
    face.joint_groups = groups


# Name of a change -> function that changes a small face. risorius can write and parse each changed
# face.
ODD = {
    "nan everywhere": lambda f: _numbers(f, np.nan),
    "infinite numbers": lambda f: _numbers(f, np.inf),
    "numbers of 1e38": lambda f: _numbers(f, 1e38),
    "nan in normals and UVs": lambda f: _surface(f, np.nan),
    "negative numbers": lambda f: _numbers(f, -1.0),
    "joints at nan": lambda f: _neutral(f, np.nan),
    "joints at infinity": lambda f: _neutral(f, np.inf),
    "joints at 1e38": lambda f: _neutral(f, 1e38),
    "all joints at one place": lambda f: _set(
        f, neutral_joint_translations=np.zeros((len(JOINTS), 3), np.float32)
    ),
    "nan in the joint matrix": lambda f: _matrix(f, np.nan),
    "1e38 in the joint matrix": lambda f: _matrix(f, 1e38),
    "names without a letter": lambda f: _named(f, ""),
    "names with a zero byte": lambda f: _named(f, "a\0b"),
    "names with line ends": lambda f: _named(f, "a\nb\r\n\x1b[31m"),
    "names with quotes": lambda f: _named(f, 'a"]["b\\'),
    "names like paths": lambda f: _named(f, "../../etc/passwd"),
    "names of 100,000 letters": lambda f: _named(f, "x" * 100_000),
    "names cut inside a letter": lambda f: _named(f, "é" * 40 + "\U0001f600" * 9),
    "names of our own": lambda f: _named(f, "risorius_rig"),
    "names of the control bones": lambda f: _named(f, "face"),
    "names of data blocks": lambda f: _named(f, "Basis"),
    "faces without area": _flat_faces,
    "meshes without vertices": _empty,
    "one mesh without vertices": lambda f: _empty(f, (1,)),
    "meshes without faces": _no_faces,
    "meshes without skin": _no_skin,
    "thousands of joints": _many_joints,
    "one vertex at each end of the world": lambda f: _set(
        f, 0, positions=_with(f.meshes[0].positions, [[1e30, -1e30, 1e30]], np.s_[:1])
    ),
}


def odd_face(name):
    """The bytes of a DNA file with a small face that ODD[name] has changed."""
    face = small_face()
    ODD[name](face)
    return face.to_bytes()
