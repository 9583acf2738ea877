# SPDX-License-Identifier: MIT
"""Evaluates DNA files in double precision, directly by the semantics of the format.

It shares no code with the native evaluator and does not optimise. The reference is OpenRigLogic,
which computed the values of tests/data/golden.

For each value this module also returns a bound of the float32 error. A sum of n products k x,
rounded in any order, errs by at most (n + 1) * eps * sum|k x|. The inputs of a sum are correctives,
whose relative error is already (number of factors + 1) * eps.
"""

import numpy as np

EPS = float(np.finfo(np.float32).eps)
FACTORS = 16  # larger than the number of factors of any corrective in the tests


def table(conditionals, rows, values, output_count):
    """Outputs [O] of a conditional table, and bounds [O] of their float32 errors.

    Args:
        conditionals: the Conditionals of a Dna.
        rows: number of rows from the beginning of the table that are evaluated.
        values: values of all inputs.
        output_count: number O of outputs.
    """
    out = np.zeros(output_count)
    size = np.zeros(output_count)
    columns = [
        np.asarray(getattr(conditionals, name), float)[:rows]
        for name in ("from_values", "to_values", "slope_values", "cut_values")
    ]
    low, high = np.minimum(columns[0], columns[1]), np.maximum(columns[0], columns[1])
    inputs = conditionals.input_indices[:rows]
    outputs = conditionals.output_indices[:rows]
    matched = None
    for r in range(rows):
        pair = (inputs[r], outputs[r])
        if pair == matched:
            continue
        matched = None
        if low[r] <= values[pair[0]] <= high[r]:
            out[pair[1]] += columns[2][r] * values[pair[0]] + columns[3][r]
            size[pair[1]] += abs(columns[2][r] * values[pair[0]]) + abs(columns[3][r])
            matched = pair
    return np.clip(out, 0, 1), (FACTORS + rows + 4) * EPS * size


def correctives(dna, controls, used, settle):
    """Calculate in place the correctives whose index is in `used`.

    Args:
        dna: the Dna.
        controls: float64 vector of all controls; its correctives are set.
        used: indices of the controls that something reads.
        settle: True: repeat until no corrective changes; False: correctives read the previous
            values of other correctives.
    """
    rows, columns, values = (
        np.asarray(a) for a in (dna.psds.rows, dna.psds.columns, dna.psds.values)
    )
    before = np.clip(controls, 0, 1)
    for _ in range(len(set(rows.tolist())) + 1 if settle else 1):
        source = np.clip(controls, 0, 1) if settle else before
        last = controls.copy()
        for p in sorted(set(rows.tolist()) & used):
            mine = rows == p
            weight = np.prod(values[mine].astype(float))
            controls[p] = min(1.0, weight * np.prod(source[columns[mine]]))
        if np.array_equal(last, controls):
            break


def used_controls(dna, lod):
    """The set of indices of controls that joints, shapes or maps read at the LOD."""
    used = set()
    for group in dna.joint_groups:
        rows = int(group.lods[lod]) if len(group.lods) else 0
        matrix = np.asarray(group.values)[:rows]
        used |= (
            {int(c) for c in group.input_indices[np.any(matrix != 0, axis=0)]} if rows else set()
        )
    shapes, maps = dna.blend_shape_channels, dna.animated_maps
    if len(shapes.lods):
        used |= set(shapes.input_indices[: shapes.lods[lod]].tolist())
    if len(maps.lods):
        used |= set(maps.conditionals.input_indices[: maps.lods[lod]].tolist())
    return used


def rotation_matrix(dna, angles):
    """Rotation matrix for row vectors, from Euler angles in the file's sequence, signs and unit."""
    out = np.eye(3)
    for axis in ("xyz".index(a) for a in dna.rotation_sequence):
        angle = angles[axis] * dna.rotation_signs[axis]
        angle = np.radians(angle) if dna.rotation_unit == "degrees" else angle
        step, (a, b) = np.eye(3), ((1, 2), (2, 0), (0, 1))[axis]
        step[a, a] = step[b, b] = np.cos(angle)
        step[a, b], step[b, a] = np.sin(angle), -np.sin(angle)
        out = out @ step
    return out


def matrix_to_quaternion(m):
    """Quaternion x y z w with w >= 0 of a rotation matrix, as the eigenvector of a 4 x 4 matrix."""
    k = np.zeros((4, 4))
    k[:3, :3] = m.T + m - np.trace(m) * np.eye(3)
    k[3, :3] = k[:3, 3] = [m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0]]
    k[3, 3] = np.trace(m)
    q = np.linalg.eigh(k)[1][:, -1]
    return q if q[3] >= 0 else -q


def quaternion_to_matrix(q):
    """Rotation matrix for row vectors, from a unit quaternion x y z w."""
    x, y, z, w = q
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (np.eye(3) + 2 * w * cross + 2 * cross @ cross).T


def is_quaternion(dna, joint):
    """Whether the file's joint metadata declares the joint's rotation to be a quaternion."""
    given = dna.joint_behavior_metadata.joint_representations
    return joint < len(given) and given[joint][1] == 1


def column_order(dna, group):
    """Columns of a joint group that rotate quaternion joints, in the reference's order.

    The order is built for each LOD, finest first: search backwards from the end for a column that
    is zero in all rotation rows of the LOD, swap it with the column at the end, and move the end
    back by one.
    """
    matrix, outputs = np.asarray(group.values), np.asarray(group.output_indices).tolist()
    turning = [r for r, o in enumerate(outputs) if 3 <= o % 9 <= 5 and is_quaternion(dna, o // 9)]
    order = [c for c in range(matrix.shape[1]) if np.any(matrix[turning, c])]
    start, lod = len(order) - 1, 0
    while start >= 0 and lod < min(len(group.lods), dna.lod_count):
        here = [r for r in turning if r < group.lods[lod]]
        empty = [i for i in range(start + 1) if not np.any(matrix[here, order[i]])]
        if not empty:
            lod += 1
            continue
        order[empty[-1]], order[start] = order[start], order[empty[-1]]
        start -= 1
    return order


def quaternion_rotations(dna, group, rows, inputs, joints, bounds):
    """Calculate in place the Euler angles of the joints that the file declares as quaternions.

    Also sets their error bounds: float32 products of n unit quaternions err by about 8 (n + 2) eps,
    the reference's arc sine by 1e-6; both are divided by the squared cosine of the middle Euler
    angle.

    Args:
        dna: the Dna.
        group: the joint group; only joints whose rotation it writes are calculated.
        rows: number of rows of the group at the LOD.
        inputs: values of the group's controls, one per column.
        joints: float64[9 * J] joint values, in the file's units; changed.
        bounds: float64[9 * J] error bounds of `joints`; changed.
    """
    matrix = np.asarray(group.values, float)
    outputs = np.asarray(group.output_indices)
    for joint in sorted({int(o) // 9 for o in outputs[:rows] if 3 <= o % 9 <= 5}):
        if not is_quaternion(dna, joint):
            continue
        total = np.eye(3)
        for c in column_order(dna, group):
            v = inputs[c]
            if v == 0:
                continue
            angles = [
                matrix[outputs == joint * 9 + 3 + a, c].sum() if len(outputs) else 0
                for a in range(3)
            ]
            q = matrix_to_quaternion(rotation_matrix(dna, angles)) * v
            q[3] += 1 - v
            total = total @ quaternion_to_matrix(q / np.linalg.norm(q))
        i, j, k = ("xyz".index(a) for a in dna.rotation_sequence)
        parity = 1 if j == (i + 1) % 3 else -1
        angles = np.zeros(3)
        angles[i] = np.arctan2(parity * total[j, k], total[k, k])
        angles[j] = np.arcsin(-parity * total[i, k])
        angles[k] = np.arctan2(parity * total[i, j], total[i, i])
        unit = 1 if dna.rotation_unit == "radians" else np.degrees(1)
        at = slice(joint * 9 + 3, joint * 9 + 6)
        joints[at] = angles * dna.rotation_signs * unit
        bounds[at] = (1e-6 + 8 * (len(inputs) + 2) * EPS) * unit / np.cos(angles[j]) ** 2


def evaluate(dna, raw, lod, *, settle, controls=None, control_count=None):
    """Evaluate in float64. Returns (values, bounds) of each: joints, shapes, maps and controls.

    Args:
        dna: the Dna.
        raw: raw controls.
        lod: the LOD.
        settle: repeat the correctives until they no longer change.
        controls: vector of the previous evaluation, for one-frame latency; changed in place.
        control_count: number of all controls; None: the file's raw controls and correctives.
    """
    count = control_count or len(dna.raw_control_names) + dna.psd_count
    if controls is None:
        controls = np.zeros(count)
    controls[: len(raw)] = raw
    correctives(dna, controls, used_controls(dna, lod), settle)
    joints = np.zeros(len(dna.joint_names) * 9)
    bounds = np.zeros_like(joints)
    for group in dna.joint_groups:
        rows = int(group.lods[lod]) if len(group.lods) else 0
        if rows == 0:
            continue
        matrix = np.asarray(group.values, float)[:rows]
        inputs = controls[group.input_indices]
        joints[group.output_indices[:rows]] = matrix @ inputs
        terms = matrix.shape[1] + FACTORS + 2
        bounds[group.output_indices[:rows]] = terms * EPS * (np.abs(matrix) @ np.abs(inputs))
        quaternion_rotations(dna, group, rows, inputs, joints, bounds)
    shapes = np.zeros(len(dna.blend_shape_channel_names))
    channel = dna.blend_shape_channels
    rows = int(channel.lods[lod]) if len(channel.lods) else 0
    shapes[channel.output_indices[:rows]] = controls[channel.input_indices[:rows]]
    maps = dna.animated_maps
    rows = int(maps.lods[lod]) if len(maps.lods) else 0
    map_values = table(maps.conditionals, rows, controls, len(dna.animated_map_names))
    relative = FACTORS * EPS
    return (
        (joints, bounds),
        (shapes, relative * np.abs(shapes)),
        map_values,
        (controls.copy(), relative * np.abs(controls)),
    )
