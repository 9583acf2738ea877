# SPDX-License-Identifier: MIT
"""Makes heads by formula, with mesh and shape names of other programs, and saves them as GLB."""

import json
import struct

import face_shapes
import numpy as np

# Direction in which a head looks -> rotation of a head that looks along +z, with y up and its left
# side at +x. Rows are the images of the axes x, y and z.
STANDS = {
    "+z": np.eye(3),
    "-z": np.array([[-1, 0, 0], [0, 1, 0], [0, 0, -1]]),
    "+x": np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
    "-y, z up": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "+y, z up": np.array([[-1, 0, 0], [0, 0, 1], [0, 1, 0]]),
    "+x, z up": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "+z, x up": np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    "-y, x up": np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]]),
}
EYE, EYE_RADIUS = np.array([3.2, 3.0, 6.9]), 1.4


def ball(middle, radius, across=12, down=8):
    """Positions and triangles of a closed sphere."""
    u = np.linspace(0, 2 * np.pi, across, endpoint=False)
    v = np.linspace(0, np.pi, down + 1)[1:-1]
    rings = np.stack(
        [np.outer(np.sin(v), np.sin(u)), np.outer(np.cos(v), np.ones(across)),
         np.outer(np.sin(v), np.cos(u))], axis=-1,
    ).reshape(-1, 3)  # fmt: skip
    points = np.concatenate([[[0, 1, 0]], rings, [[0, -1, 0]]]) * radius + middle
    last, faces = len(points) - 1, []
    for a in range(across):
        b = (a + 1) % across
        faces += [[0, 1 + a, 1 + b], [last, last - across + b, last - across + a]]
        for row in range(down - 2):
            one, two = 1 + row * across, 1 + (row + 1) * across
            faces += [[one + a, two + a, two + b], [one + a, two + b, one + b]]
    return points, np.array(faces)


def slab(low, high):
    """Positions and triangles of a closed box with 26 vertices."""
    points, faces = ball((np.array(low) + high) / 2, 1.0, 8, 4)
    middle = (np.array(low) + high) / 2
    way = points - middle
    way /= np.abs(way).max(axis=1, keepdims=True)
    return middle + way * (np.array(high) - low) / 2, faces


def joined(*pieces):
    points, faces, count = [], [], 0
    for own, triangles in pieces:
        points.append(own)
        faces.append(np.asarray(triangles) + count)
        count += len(own)
    return np.concatenate(points), np.concatenate(faces)


def skull(lopsided=False):
    """(positions, triangles, shapes): the face of face_shapes, with a nose and a closed skull.

    lopsided: True: a bump on the left side makes the head asymmetric.
    """
    points, quads = face_shapes.head()
    moved = face_shapes.expressions(points)
    nose = face_shapes.bump(points, 0, -1, 2.0)[:, None] * [0, 0, 2.5]
    back = ball([0, 1.0, -2.0], 9.0)
    if lopsided:
        nose = nose + face_shapes.bump(points, 5, 6, 5)[:, None] * [2.0, 1.0, 1.0]
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    whole, faces = joined((points + nose, triangles), back)
    still = np.zeros((len(back[0]), 3))
    return whole, faces, {name: np.concatenate([d, still]) for name, d in moved.items()}


def eyes():
    left = ball(EYE, EYE_RADIUS)
    return left, ball(EYE * [-1, 1, 1], EYE_RADIUS)


def teeth():
    """The upper and the lower row of teeth, each as (positions, triangles)."""
    return slab([-2, -4.5, 5], [2, -3.2, 7]), slab([-2, -8, 5], [2, -6.8, 7])


def mesh(name, geometry, shapes=None, **more):
    points, faces = geometry
    return {"name": name, "points": np.asarray(points, float), "faces": np.asarray(faces),
            "shapes": shapes or {}, **more}  # fmt: skip


def with_moving_teeth(shapes):
    """Both rows of teeth as one mesh, and its shapes; only jawOpen rotates the lower row."""
    whole, faces = joined(*teeth())
    half = len(whole) // 2
    hinge, angle = np.array([0, 0, -2.0]), 0.3
    arm = whole - hinge
    c, s = np.cos(angle), np.sin(angle)
    turned = np.stack(
        [arm[:, 0], c * arm[:, 1] - s * arm[:, 2], s * arm[:, 1] + c * arm[:, 2]], axis=1
    )
    delta = np.where(np.arange(len(whole))[:, None] < half, 0, turned - arm)
    none = np.zeros_like(whole)
    return (whole, faces), {name: delta if name == "jawOpen" else none for name in shapes}


def ready_player(lopsided=False):
    """Like Ready Player Me: head, eyes and teeth have equally named shapes, hair and body none."""
    points, faces, shapes = skull(lopsided)
    left, right = eyes()
    none = {name: np.zeros_like(left[0]) for name in shapes}
    row, moved = with_moving_teeth(shapes)
    return [
        mesh("Wolf3D_Head", (points, faces), shapes),
        mesh("EyeLeft", left, none),
        mesh("EyeRight", right, none),
        mesh("Wolf3D_Teeth", row, moved),
        mesh("Wolf3D_Hair", ball([0, 5, -3], 10.5)),
        mesh("Wolf3D_Body", slab([-25, -150, -12], [25, -20, 12])),
    ]


def rename(shapes, names):
    return {names.get(name, name): delta for name, delta in shapes.items()}


def vroid():
    """A head like VRoid's: the face has three Fcl shapes; hair and body have no shapes."""
    points, faces, shapes = skull()
    told = {"jawOpen": "Fcl_MTH_A", "eyeBlinkLeft": "Fcl_EYE_Close_L",
            "eyeBlinkRight": "Fcl_EYE_Close_R"}  # fmt: skip
    return [
        mesh("Face", (points, faces), {told[n]: d for n, d in shapes.items() if n in told}),
        mesh("Hair001", ball([0, 5, -3], 10.5)),
        mesh("Body", slab([-25, -150, -12], [25, -20, 12])),
    ]


def everything_in_one():
    """A head like ICT FaceKit's: one mesh with face, eyes and teeth as separate islands."""
    points, faces, shapes = skull()
    row, moved = with_moving_teeth(shapes)
    whole = joined((points, faces), *eyes(), row)
    rest = len(eyes()[0][0]) * 2
    out = {}
    for name, delta in shapes.items():
        spelled = name.replace("Left", "_L").replace("Right", "_R")
        out[spelled] = np.concatenate([delta, np.zeros((rest, 3)), moved[name]])
    return [mesh("ict", whole, out)]


def face_cap():
    """A head like Face Cap's with shape names such as eyeBlink_L; only the head has shapes."""
    points, faces, shapes = skull()
    spelled = {n: n.replace("Left", "_L").replace("Right", "_R") for n in shapes}
    return [
        mesh("head", (points, faces), rename(shapes, spelled)),
        mesh("eyes", joined(*eyes())),
        mesh("teeth", joined(*teeth())),
        mesh("tongue", slab([-1, -8.5, 3], [1, -7.5, 6])),
        mesh("glasses", slab([-7, 2.4, 10.2], [7, 3.6, 10.6])),
    ]


def placed(meshes, stand="+z", scale=0.01, shift=(0, 0, 0)):
    """Meshes rotated by STANDS[stand], then scaled and shifted."""
    turn = STANDS[stand].T * scale
    return [
        {**m, "points": m["points"] @ turn.T @ np.eye(3) + shift,
         "shapes": {n: d @ turn.T for n, d in m["shapes"].items()}}
        for m in meshes
    ]  # fmt: skip


def save_glb(path, meshes, materials=(), images=()):
    """Write meshes as a GLB.

    Args:
        path: path of the file.
        meshes: results of `mesh`, optionally with the key `material`, an index of materials, or
            `primitives`, a list of (triangles, index of a material or None).
        materials: JSON of the materials.
        images: contents of PNG files; each becomes a texture.
    """
    binary, views, accessors = bytearray(), [], []

    def view(data):
        binary.extend(b"\0" * (-len(binary) % 4))
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        binary.extend(data)
        return len(views) - 1

    def accessor(array, kind, component=5126):
        accessors.append({"bufferView": view(array.tobytes()), "type": kind, "count": len(array),
                          "componentType": component})  # fmt: skip
        return len(accessors) - 1

    rows = []
    for m in meshes:
        count = len(m["points"])
        uvs = np.stack([np.linspace(0, 1, count), np.linspace(1, 0, count)], axis=1)
        shared = {
            "attributes": {"POSITION": accessor(m["points"].astype("<f4"), "VEC3"),
                           "TEXCOORD_0": accessor(uvs.astype("<f4"), "VEC2")},
        }  # fmt: skip
        if m["shapes"]:
            shared["targets"] = [
                {"POSITION": accessor(d.astype("<f4"), "VEC3")} for d in m["shapes"].values()
            ]
        parts = m.get("primitives") or [(m["faces"], m.get("material"))]
        primitives = []
        for faces, material in parts:
            own = {"indices": accessor(faces.ravel().astype("<u4"), "SCALAR", 5125), **shared}
            primitives.append(own if material is None else {**own, "material": material})
        rows.append({"name": m["name"], "primitives": primitives,
                     "extras": {"targetNames": list(m["shapes"])}})  # fmt: skip
    listed = [{"bufferView": view(data), "mimeType": "image/png"} for data in images]
    document = {
        "asset": {"version": "2.0"}, "meshes": rows, "accessors": accessors, "bufferViews": views,
        "nodes": [{"name": m["name"], "mesh": i} for i, m in enumerate(meshes)],
        "materials": list(materials), "images": listed,
        "textures": [{"source": i} for i in range(len(listed))],
        "buffers": [{"byteLength": len(binary)}],
    }  # fmt: skip
    binary.extend(b"\0" * (-len(binary) % 4))
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(
        struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(binary), len(text), 0x4E4F534A)
        + text + struct.pack("<II", len(binary), 0x004E4942) + bytes(binary)
    )  # fmt: skip
    return path
