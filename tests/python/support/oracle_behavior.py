# SPDX-License-Identifier: MIT
"""Evaluates networks, RBF solvers, twist/swing setups and rotations in double precision.

It has no schedule: a frame runs networks, then solvers, then correctives, in the order of the file.
A value that is computed later in a frame is read from the previous frame. A pose is settled when a
frame changes no control. Quaternions are rows x y z w.
"""

import numpy as np
import oracle

AXES = {"left": (-1, 0, 0), "right": (1, 0, 0), "up": (0, 1, 0)}
AXES |= {"down": (0, -1, 0), "front": (0, 0, 1), "back": (0, 0, -1)}
SEQUENCES = ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]


def multiply(a, b):
    """The products of quaternions a b, float64[..., 4] in the order x, y, z, w."""
    # The formula is written out, because np.cross of three numbers takes fifty times as long.
    # Single quaternions are converted to Python floats, because NumPy scalars take ten times as
    # long.
    single = np.ndim(a) == np.ndim(b) == 1
    (ax, ay, az, aw), (bx, by, bz, bw) = (
        map(float, q) if single else np.transpose(q) for q in (a, b)
    )
    return np.transpose([
        aw * bx + bw * ax + ay * bz - az * by,
        aw * by + bw * ay + az * bx - ax * bz,
        aw * bz + bw * az + ax * by - ay * bx,
        aw * bw - ax * bx - ay * by - az * bz,
    ])  # fmt: skip


def conjugate(q):
    return q * [-1, -1, -1, 1]


def unit(q):
    length = np.linalg.norm(q)
    return q / length if length > 0 else np.array([0, 0, 0, 1.0])


def from_euler(sequence, signs, angles):
    """Quaternions [..., 4] of Euler angles [..., 3] about x, y and z, in radians.

    The rotations are about fixed axes. `sequence` is their order: "xyz" rotates about x first.
    `signs` has a factor for the angle about each of x, y and z: 1 or -1.
    """
    angles = np.asarray(angles, float)
    q = np.broadcast_to([0, 0, 0, 1.0], (*angles.shape[:-1], 4))
    for axis in ("xyz".index(a) for a in sequence):
        half = angles[..., axis] / 2
        step = np.zeros(q.shape)
        step[..., axis], step[..., 3] = np.sin(signs[axis] * half), np.cos(half)
        q = multiply(step, q)
    return q


def to_euler(dna, q):
    """The Euler angles of a quaternion, in the file's unit and rotation sequence."""
    m = oracle.quaternion_to_matrix(q)
    i, j, k = ("xyz".index(a) for a in dna.rotation_sequence)
    parity = 1 if j == (i + 1) % 3 else -1
    angles = np.zeros(3)
    angles[i] = np.arctan2(parity * m[j, k], m[k, k])
    angles[j] = np.arcsin(np.clip(-parity * m[i, k], -1, 1))
    angles[k] = np.arctan2(parity * m[i, j], m[i, i])
    return angles * dna.rotation_signs / radians_per_unit(dna)


def radians_per_unit(dna):
    return 1.0 if dna.rotation_unit == "radians" else np.pi / 180


def listed(mapping, lod):
    return mapping[lod].tolist() if lod < len(mapping) else []


# ---- networks


def activate(layer, v):
    kind = layer.activation_function
    if kind == 2:
        return np.where(v < 0, layer.activation_parameters[0] * v, v)
    if kind == 4:
        return 1 / (1 + np.exp(-v))
    return (np.copy, lambda x: np.maximum(x, 0), None, np.tanh)[kind](v)


def run_network(network, x, rows):
    for layer, count in zip(network.layers, rows, strict=True):
        weights = np.asarray(layer.weights, float).reshape(len(layer.biases), -1)
        x = np.pad(x, (0, weights.shape[1] - len(x)))
        x = activate(layer, weights @ x + np.asarray(layer.biases, float))
        x[count:] = 0
    return x


def row_counts(network, parameters, lod, lod_count):
    counts = np.asarray(parameters[1 : 1 + len(network.layers) * lod_count], int)
    if len(counts) < len(network.layers) * lod_count:
        return [len(layer.biases) for layer in network.layers]
    return counts.reshape(-1, lod_count)[:, lod]


def mask_of(dna, number, masks):
    regions = [r for mesh in dna.machine_learned_behavior.region_network_indices for r in mesh]
    return next((masks[i] for i, r in enumerate(regions) if number in r), 1)


def run_graph(dna, kind, lod, c, masks):
    values = {}
    joints = dna.machine_learned_behavior_ext.joints
    quaternion = 1 in [
        v for k, v in zip(joints.parameter_keys, joints.parameter_values, strict=True) if k == 1
    ]
    w = [i for i, o in zip(joints.input_indices, joints.output_indices, strict=True) if o % 10 == 6]
    for s, operations in enumerate(kind.operations):
        for o in listed(kind.lod_operation_mappings[s], lod):
            op = operations[o]
            pairs = zip(
                op.operation_set_dependency_indices, op.operation_dependency_indices, strict=True
            )
            sources = [values[int(a), int(b)] for a, b in pairs]
            parameters = np.asarray(op.parameters)
            if op.operation_type == 1:
                out = c[parameters]
            elif op.operation_type == 3 and mask_of(dna, parameters[0], masks) == 0:
                out = None
            elif op.operation_type == 3:
                network = dna.machine_learned_behavior.neural_networks[parameters[0]]
                counts = row_counts(network, parameters, lod, dna.lod_count)
                out = run_network(network, np.concatenate(sources), counts)
            elif op.operation_type == 4:
                weights = parameters[1:].astype(np.uint32).view(np.float32)
                out = sum(float(k) * v for k, v in zip(weights, sources, strict=True))
            elif sources[0] is None:
                c[parameters] = [quaternion and p in w for p in parameters]
            else:
                n = min(len(parameters), len(sources[0]))
                c[parameters[:n]] = sources[0][:n]
            values[s, o] = out if op.operation_type != 2 else None


def run_networks(dna, lod, c, masks):
    ml = dna.machine_learned_behavior
    if dna.machine_learned_behavior_ext.types:
        for kind in dna.machine_learned_behavior_ext.types:
            run_graph(dna, kind, lod, c, masks)
        return
    for n in listed(ml.lod_neural_network_mapping, lod):
        network = ml.neural_networks[n]
        outputs = np.asarray(network.output_indices)
        if mask_of(dna, n, masks) == 0:
            c[outputs] = 0
            continue
        rows = [len(layer.biases) for layer in network.layers]
        y = run_network(network, c[network.input_indices], rows)
        c[outputs[: len(y)]] = y[: len(outputs)]


# ---- solvers


def reduced(q, method, axis):
    """The twist about an axis (method 3) or the remaining swing (method 2) of a quaternion.

    Methods 0 and 1 return the quaternion itself. `axis`: 0, 1 or 2.
    """
    if method < 2:
        return q
    twist = np.zeros(4)
    twist[[axis, 3]] = q[[axis, 3]]
    length = np.linalg.norm(twist)
    if length == 0 and (method == 3 or not q.any()):
        return np.full(4, np.nan)  # the twist or swing is undefined, so that no pose is near
    if method == 3:
        return twist / length
    if length == 0:
        return q
    # The swing is q times the inverse of its twist. All four numbers are negated, which gives the
    # same rotation.
    return -multiply(q, conjugate(twist)) / length


def distance(a, b, method):
    if method == 0:
        return np.linalg.norm(a - b)
    dots = np.sum(a.reshape(-1, 4) * b.reshape(-1, 4), axis=1)
    arcs = np.where(dots**2 > 1, 0, np.arccos(np.clip(2 * dots**2 - 1, -1, 1)))
    return np.linalg.norm(arcs)


def kernel(function, d, r):
    powers = {2: 1, 3: 3, 4: 5}
    if function in powers:
        return np.maximum(0, 1 - (d / r) ** powers[function])
    return np.exp(-d / r**2) if function == 0 else np.exp(-2 * d / r)


class Solver:
    """An RBF solver with its target poses and the matrix of their kernel values, computed once."""

    def __init__(self, dna, solver):
        self.solver = solver
        n = len(solver.pose_indices)
        self.targets = [
            self.convert(row) for row in np.asarray(solver.raw_control_values, float).reshape(n, -1)
        ]
        apart = np.array(
            [[distance(a, b, solver.distance_method) for a in self.targets] for b in self.targets]
        )
        self.radius = solver.radius * radians_per_unit(dna)
        if solver.automatic_radius == 0:
            self.radius = apart[np.triu_indices(n, 1)].mean()
        self.matrix = kernel(solver.function_type, apart, self.radius)
        self.condition = np.linalg.cond(self.matrix) if solver.solver_type == 1 else 1

    def convert(self, x):
        s = self.solver
        if s.distance_method < 2:
            return x
        parts = x.reshape(-1, 4)
        return np.concatenate([reduced(q, s.distance_method, s.twist_axis) for q in parts])

    def values(self, x):
        s = self.solver
        x = self.convert(x)
        d = np.array([distance(x, t, s.distance_method) for t in self.targets])
        out = kernel(s.function_type, d, self.radius)
        if s.solver_type == 1:
            out = np.clip(np.linalg.solve(self.matrix, out), 0, 1)
        total = out.sum()
        if total > 1 or (s.normalize_method == 1 and total > 0):
            out = out / total
        return out


def solvers_of(dna):
    return [Solver(dna, s) for s in dna.rbf_behavior.solvers]


def run_solvers(dna, solvers, lod, c):
    poses = dna.rbf_behavior_ext.poses
    first = len(c) - len(dna.rbf_behavior.poses)  # first pose's control in files without layer rbfe
    for i in listed(dna.rbf_behavior.lod_solver_mapping, lod):
        solver = solvers[i]
        x = c[solver.solver.raw_control_indices].copy()
        indices = solver.solver.pose_indices
        outputs = [poses[p].output_control_indices if poses else [first + p] for p in indices]
        for output in outputs:
            c[output] = 0
        for p, output, near in zip(indices, outputs, solver.values(x), strict=True):
            value = near * dna.rbf_behavior.poses[p].scale
            if not value > np.float32(solver.solver.weight_threshold):
                continue
            weights = poses[p].output_control_weights if poses else [1]
            inputs = poses[p].input_control_indices if poses else []
            for o, weight in zip(output, weights, strict=True):
                c[o] += weight * value * np.prod(c[inputs])


# ---- controls


def initial_controls(dna, count):
    c = np.zeros(count)
    first = len(dna.raw_control_names) + dna.psd_count
    for i, name in enumerate(dna.machine_learned_behavior.ml_control_names):
        c[first + i] = name.endswith((".w", ".qw"))
    return c


def frame(dna, solvers, c, lod, masks=None):
    """Run one frame with the raw controls in `c`, and set all other controls in `c`.

    masks: float[regions], 0 switches the networks of a region off; None: none is off.
    """
    regions = sum(len(mesh) for mesh in dna.machine_learned_behavior.region_network_indices)
    run_networks(dna, lod, c, np.ones(regions) if masks is None else masks)
    run_solvers(dna, solvers, lod, c)
    oracle.correctives(dna, c, used_controls(dna, lod), settle=False)


def used_controls(dna, lod):
    used = oracle.used_controls(dna, lod)
    joints = dna.machine_learned_behavior_ext.joints
    stride = ml_stride(dna)
    there = set(listed(dna.lod_joint_mapping, lod))
    pairs = zip(joints.input_indices.tolist(), joints.output_indices.tolist(), strict=True)
    return used | {i for i, o in pairs if o // stride in there}


def settled(dna, solvers, raw, lod, count):
    """Values of all controls after the frame has been repeated until it changes no control.

    Raises an AssertionError if controls still change after count + 2 frames.

    Args:
        dna: the face.
        solvers: its RBF solvers.
        raw: values of the raw controls.
        lod: the LOD.
        count: number of all controls.
    """
    c = initial_controls(dna, count)
    for _ in range(count + 2):
        c[: len(raw)] = raw
        before = c.copy()
        frame(dna, solvers, c, lod)
        if np.array_equal(before, c):
            return c
    raise AssertionError("these controls never come to rest")


# ---- joints


def ml_stride(dna):
    joints = dna.machine_learned_behavior_ext.joints
    settings = dict(
        zip(joints.parameter_keys.tolist(), joints.parameter_values.tolist(), strict=True)
    )
    return 10 if settings.get(1) == 1 else 9


def blended(dna, group, joint, controls, order):
    """The quaternion of a joint: the product of the rotations of its group's columns.

    Args:
        dna: the face.
        group: the joint group.
        joint: index of the joint.
        controls: values of all controls.
        order: columns of the group in the order of the product.
    """
    matrix, outputs = np.asarray(group.values, float), np.asarray(group.output_indices)
    total = np.array([0, 0, 0, 1.0])
    for column in order:
        v = controls[group.input_indices[column]]
        angles = [matrix[outputs == joint * 9 + 3 + a, column].sum() for a in range(3)]
        q = from_euler(
            dna.rotation_sequence, dna.rotation_signs, np.array(angles) * radians_per_unit(dna)
        )
        part = q * v + np.array([0, 0, 0, (1 - v) * (1 if q[3] >= 0 else -1)])
        total = multiply(part / np.linalg.norm(part), total)
    return total


def twist(q, axis):
    t = np.zeros(4)
    t[[axis, 3]] = q[[axis, 3]]
    return unit(t)


def toward_identity(q, weight):
    identity = np.array([0, 0, 0, 1.0]) * (1 if q[3] >= 0 else -1)
    angle = np.arccos(min(1, abs(q[3])))
    if angle < 1e-5:
        return q * (1 - weight) + identity * weight
    return (np.sin((1 - weight) * angle) * q + np.sin(weight * angle) * identity) / np.sin(angle)


def twist_swing_rotations(dna, c):
    """Joint index -> quaternion that a twist or swing setup gives the joint."""
    out = {}
    layer = dna.twist_swing_behavior
    swung = [s.input_control_indices.tolist() for s in layer.swings]
    for s in layer.swings:
        q = c[s.input_control_indices]
        back = conjugate(twist(q, s.twist_axis))
        swing = multiply(q, back)
        inverse = conjugate(swing) / (swing @ swing)
        for joint, weight in zip(s.output_joint_indices, s.blend_weights, strict=True):
            out[joint] = multiply(back, toward_identity(inverse, weight))
    for t in layer.twists:
        q = twist(c[t.input_control_indices], t.twist_axis)
        if t.input_control_indices.tolist() in swung:
            q = conjugate(q)
        for joint, weight in zip(t.output_joint_indices, t.blend_weights, strict=True):
            out[joint] = toward_identity(q, weight)
    return out


def ml_values(dna, c, lod):
    """Joint -> (translation, quaternion, scale, Euler angles or None) that networks give it.

    Euler angles are None if the networks output quaternions or have axes of their own.

    The values are in the DNA's axes.
    """
    joints, stride = dna.machine_learned_behavior_ext.joints, ml_stride(dna)
    settings = dict(
        zip(joints.parameter_keys.tolist(), joints.parameter_values.tolist(), strict=True)
    )
    raw = {}
    for i, o in zip(joints.input_indices, joints.output_indices, strict=True):
        raw.setdefault(int(o) // stride, np.zeros(stride))[int(o) % stride] = c[i]
    sequence, signs, basis = dna.rotation_sequence, np.asarray(dna.rotation_signs), np.eye(3)
    converted = all(key in settings for key in range(3, 10))
    if converted:
        sequence = SEQUENCES[settings[9]]
        signs = np.array([1 if settings[k] == 1 else -1 for k in (6, 7, 8)])
        names = list(AXES)
        theirs = np.array([AXES[names[settings[k]]] for k in (3, 4, 5)])
        ours = np.array([AXES[name] for name in dna.coordinate_system])
        basis = theirs @ ours.T
    out = {}
    for joint, v in raw.items():
        if joint not in listed(dna.lod_joint_mapping, lod):
            continue
        euler = v[3:6] if stride == 9 else None
        q = (
            unit(v[3:7])
            if stride == 10
            else from_euler(sequence, signs, v[3:6] * radians_per_unit(dna))
        )
        q = np.array([*(np.linalg.det(basis) * (q[:3] @ basis)), q[3]])
        scale = v[-3:] @ np.abs(basis)
        out[joint] = (v[:3] @ basis, q, scale, None if converted else euler)
    return out


def joints(dna, c, lod, rotation):
    """Joints of a pose from its controls, [J, 9] (Euler angles) or [J, 10] (quaternions)."""
    count = len(dna.joint_names)
    linear = np.zeros(count * 9)
    turned, q_of = {}, {}
    for group in dna.joint_groups:
        rows = int(group.lods[lod]) if len(group.lods) else 0
        outputs = np.asarray(group.output_indices)[:rows]
        linear[outputs] = np.asarray(group.values, float)[:rows] @ c[group.input_indices]
        columns = oracle.column_order(dna, group)
        for joint in {int(o) // 9 for o in outputs if 3 <= o % 9 <= 5}:
            if oracle.is_quaternion(dna, joint):
                q_of[joint] = blended(dna, group, joint, c, columns)
            else:
                turned[joint] = True
    linear = linear.reshape(count, 9)
    q_of |= twist_swing_rotations(dna, c)
    if rotation == "euler":
        out = linear
        for joint, q in q_of.items():
            out[joint, 3:6] = to_euler(dna, q)
    else:
        out = np.concatenate([linear[:, :6], np.ones((count, 1)), linear[:, 6:]], axis=1)
        for joint in turned:
            angles = linear[joint, 3:6] * radians_per_unit(dna)
            out[joint, 3:7] = from_euler(dna.rotation_sequence, dna.rotation_signs, angles)
        for joint, q in q_of.items():
            out[joint, 3:7] = q
    for joint, (translation, q, scale, euler) in ml_values(dna, c, lod).items():
        out[joint, :3] += translation
        out[joint, -3:] += scale
        if rotation == "quaternion":
            out[joint, 3:7] = multiply(q, out[joint, 3:7])
        else:
            out[joint, 3:6] += to_euler(dna, q) if euler is None else euler
    return out
