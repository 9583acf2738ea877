# SPDX-License-Identifier: MIT
"""Makes a face by formula: half an ellipsoid, 25 cm high, with 506 vertices and expressions."""

import numpy as np

ACROSS, DOWN = 23, 22


def head():
    """Vertices float64[V, 3] in cm and quads int[F, 4] of the face."""
    u, v = np.meshgrid(np.linspace(-1.3, 1.3, ACROSS), np.linspace(1.3, -1.3, DOWN))
    x, y = 8 * np.sin(u) * np.cos(v), 13 * np.sin(v)
    z = 10 * np.cos(u) * np.cos(v)
    x = (x - x[:, ::-1]) / 2  # makes the sides equal to the last bit
    positions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    corner = np.arange(ACROSS * DOWN).reshape(DOWN, ACROSS)
    faces = np.stack(
        [corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1
    ).reshape(-1, 4)
    return positions, faces


def bump(positions, x, y, size):
    d = ((positions[:, 0] - x) ** 2 + (positions[:, 1] - y) ** 2) / size**2
    return np.where(d < 1, (1 - d) ** 2, 0.0)


def expressions(positions):
    """Name of an ARKit shape -> displacement in cm, float64[V, 3]."""
    out = {}
    for side, sign in (("Left", 1), ("Right", -1)):
        pull = bump(positions, sign * 3, -5, 4)[:, None]
        out[f"mouthSmile{side}"] = pull * [sign * 0.8, 0.7, -0.3]
        out[f"browOuterUp{side}"] = bump(positions, sign * 4, 6, 4)[:, None] * [0, 0.8, 0.05]
        out[f"eyeBlink{side}"] = bump(positions, sign * 3.2, 3, 2.5)[:, None] * [0, -0.7, 0.1]
    share = np.clip((-positions[:, 1] - 2) / 6, 0, 1)
    share = (share * share * (3 - 2 * share))[:, None]
    hinge, angle = np.array([0, 0, -2.0]), 0.3
    arm = positions - hinge
    c, s = np.cos(angle), np.sin(angle)
    turned = np.stack(
        [arm[:, 0], c * arm[:, 1] - s * arm[:, 2], s * arm[:, 1] + c * arm[:, 2]], axis=1
    )
    out["jawOpen"] = share * (turned - arm)
    return out


def write_obj(path, positions, faces):
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*p) for p in positions]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_all(folder, joints=40, more=""):
    """Write neutral.obj, shapes/*.obj and spec.toml to a folder. Returns the path of spec.toml.

    Args:
        folder: folder that has no folder "shapes" yet.
        joints: number of joints in the section [joints] of spec.toml.
        more: further text of spec.toml, after the number of joints.
    """
    positions, faces = head()
    (folder / "shapes").mkdir(parents=True)
    write_obj(folder / "neutral.obj", positions, faces)
    for name, delta in expressions(positions).items():
        write_obj(folder / "shapes" / f"{name}.obj", positions + delta, faces)
    spec = folder / "spec.toml"
    spec.write_text(
        'name = "egg"\n[source]\nneutral = "neutral.obj"\nexpressions = "shapes"\n'
        f"[joints]\ncount = {joints}\n{more}",
        encoding="utf-8",
    )
    return spec
