# SPDX-License-Identifier: MIT
"""Tests settled poses of random chains of correctives, networks and solvers.

Most nodes are read by nodes that a frame evaluates earlier, so that a pose settles only after
several frames. The expected pose is computed by oracle_behavior.py in double precision: it repeats
a frame until no control changes.
"""

import numpy as np
import oracle_behavior
import pytest
import risorius
from risorius import _native

SIMD = _native.available_simd().split(", ")
RAW, JOINTS = 4, 9
KINDS = ("corrective", "network", "solver")
# Largest error of a settled control. A float32 sum of n = 9 products below 1, the longest sum of a
# node, has an error of at most (n + 1) eps. No node magnifies its inputs, so errors add up along a
# chain of at most 12 nodes.
LOSS = 12 * 10 * float(np.finfo(np.float32).eps)


class Chain:
    """A chain of nodes: each reads the previous node, and earlier nodes or raw controls."""

    def __init__(self, kinds, rng):
        self.rng, self.kinds = rng, kinds
        self.correctives = kinds.count("corrective")
        self.networks = kinds.count("network")
        self.solvers = kinds.count("solver")
        # Controls are numbered by kind, and within each kind in random order.
        numbers = {kind: list(rng.permutation(kinds.count(kind))) for kind in KINDS}
        first = {"corrective": RAW, "network": RAW + self.correctives}
        first["solver"] = first["network"] + 2 * self.networks
        self.nodes = []
        readable = list(range(RAW))
        for kind in kinds:
            number = int(numbers[kind].pop())
            width = 1 if kind == "corrective" else 2
            outputs = [first[kind] + number * width + i for i in range(width)]
            # Each node reads the previous node, so all nodes form one chain.
            inputs = [readable[-1], *rng.choice(readable[:-1], 2, replace=False).tolist()]
            self.nodes.append((kind, number, inputs, outputs))
            readable += outputs
        self.count = len(readable)

    def of(self, kind):
        """(inputs, outputs) of the nodes of a kind, in the order of the file."""
        return [n[2:] for n in sorted(self.nodes, key=lambda n: n[1]) if n[0] == kind]


def network(rng, inputs, outputs):
    def layer(rows, columns, function):
        weights = rng.uniform(-1, 1, (rows, columns)) / columns
        return risorius.NeuralNetworkLayer(
            biases=rng.uniform(0, 0.3, rows),
            weights=weights.ravel(),
            activation_function=function,
            activation_parameters=[0.25],
        )

    layers = [layer(5, len(inputs), int(rng.integers(5))), layer(len(outputs), 5, 2)]
    return risorius.NeuralNetwork(input_indices=inputs, output_indices=outputs, layers=layers)


def graph(networks):
    """Networks as a graph of three sets of operations.

    The first set gathers the inputs of the networks, the second runs the networks, and the third
    writes their outputs.
    """

    def operation(kind, parameters, before):
        return risorius.MlOperation(
            operation_type=kind,
            parameters=parameters,
            operation_set_dependency_indices=[s for s, _ in before],
            operation_dependency_indices=[o for _, o in before],
        )

    sets = [[], [], []]
    for i, n in enumerate(networks):
        sets[0].append(operation(1, n.input_indices.tolist(), []))
        sets[1].append(operation(3, [i], [(0, i)]))
        sets[2].append(operation(2, n.output_indices.tolist(), [(1, i)]))
    every = [list(range(len(networks)))] * 2
    return risorius.MlType(lod_operation_mappings=[every] * 3, operations=sets)


def solver(rng, number, inputs):
    return risorius.RbfSolver(
        name=f"solver{number}",
        raw_control_indices=inputs,
        pose_indices=[2 * number, 2 * number + 1],
        raw_control_values=rng.uniform(0, 1, 2 * len(inputs)),
        radius=rng.uniform(2, 3),
        weight_threshold=0,
        solver_type=0,
        automatic_radius=1,
        distance_method=0,
        normalize_method=0,
        function_type=2,
        twist_axis=0,
    )


def make_dna(chain, as_graph):
    rng, dna = chain.rng, risorius.Dna()
    dna.lod_count, dna.rotation_unit = 2, "radians"
    dna.raw_control_names = [f"raw{i}" for i in range(RAW)]
    dna.joint_names = [f"joint{i}" for i in range(JOINTS)]
    dna.joint_parents = [0] * JOINTS
    dna.neutral_joint_translations = np.zeros((JOINTS, 3))
    dna.neutral_joint_rotations = np.zeros((JOINTS, 3))
    dna.psd_count = chain.correctives
    rows = [(o[0], c, rng.uniform(0.7, 1)) for i, o in chain.of("corrective") for c in i[:2]]
    rows = [rows[i] for i in rng.permutation(len(rows))]
    names = ("rows", "columns", "values")
    dna.psds = risorius.Psds(**{name: [r[i] for r in rows] for i, name in enumerate(names)})
    # A joint value uses each control at LOD 0, and each of the first half of controls at LOD 1.
    half = chain.count // 2
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[chain.count, half],
            input_indices=list(range(chain.count)),
            output_indices=list(range(chain.count)),
            values=np.eye(chain.count, dtype=np.float32),
        )
    ]
    ml = dna.machine_learned_behavior
    ml.ml_control_names = [f"ml{i}" for i in range(2 * chain.networks)]
    ml.neural_networks = [network(rng, i, o) for i, o in chain.of("network")]
    ml.lod_neural_network_mapping = [list(range(chain.networks))] * 2
    if as_graph:
        dna.machine_learned_behavior_ext.types = [graph(ml.neural_networks)]
    rbf, poses = dna.rbf_behavior, dna.rbf_behavior_ext
    rbf.solvers = [solver(rng, n, i) for n, (i, _) in enumerate(chain.of("solver"))]
    rbf.lod_solver_mapping = [list(range(chain.solvers))] * 2
    rbf.poses = [risorius.RbfPose(name=f"pose{i}", scale=1) for i in range(2 * chain.solvers)]
    poses.pose_control_names = [f"near{i}" for i in range(2 * chain.solvers)]
    poses.poses = [
        risorius.RbfPoseControls(
            input_control_indices=[], output_control_indices=[output], output_control_weights=[1]
        )
        for _, outputs in chain.of("solver")
        for output in outputs
    ]
    return dna


CHAINS = {
    "PSD of PSD": ("corrective",) * 8,
    "RBF of PSD": ("corrective", "solver") * 4,
    "RBF of PSD of PSD": ("corrective", "corrective", "solver") * 3,
    "networks of networks": ("network",) * 6,
    "networks of PSD": ("corrective", "network") * 4,
    "networks of RBF": ("solver", "network") * 4,
    "RBF of RBF": ("solver",) * 5,
    "PSD of all": ("network", "corrective", "solver", "corrective") * 2,
}


def check(chain, dna, simd):
    rig = risorius.Rig(dna, simd=simd)
    assert rig.control_count == chain.count
    solvers = oracle_behavior.solvers_of(dna)
    raw = chain.rng.uniform(0.2, 1, (3, RAW)).astype(np.float32)
    changed = 0
    for lod in (0, 1):
        batch = rig.evaluate_batch(raw, lod=lod)
        for n, values in enumerate(raw):
            wanted = oracle_behavior.settled(dna, solvers, values, lod, rig.control_count)
            pose = rig.evaluate(values, lod=lod)
            np.testing.assert_allclose(pose.controls, wanted, rtol=0, atol=LOSS)
            joints = oracle_behavior.joints(dna, wanted, lod, "euler")
            np.testing.assert_allclose(pose.joints, joints, rtol=0, atol=LOSS)
            np.testing.assert_array_equal(batch.controls[n], pose.controls)
            instance = rig.instance()
            instance.lod = lod
            for _ in range(chain.count + 2):
                last = instance.evaluate(values)
            np.testing.assert_array_equal(last.controls, pose.controls)
            first = rig.evaluate(values, lod=lod, settle=False)
            changed += np.count_nonzero(first.controls != pose.controls)
    return changed


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize("as_graph", [False, True], ids=["list", "graph"])
@pytest.mark.parametrize("kinds", CHAINS.values(), ids=CHAINS)
def test_chain_settles_at_the_fixed_point(kinds, as_graph, simd):
    changed = 0
    for seed in range(4):
        chain = Chain(kinds, np.random.default_rng(seed))
        changed += check(chain, make_dna(chain, as_graph), simd)
    assert changed > 0, "settling did nothing that the first frame had not done"


@pytest.mark.parametrize("seed", range(40))
def test_any_chain_settles_at_the_fixed_point(seed):
    rng = np.random.default_rng(1000 + seed)
    kinds = tuple(rng.choice(KINDS, 11))
    chain = Chain(kinds, rng)
    check(chain, make_dna(chain, as_graph=seed % 2 == 1), SIMD[seed % len(SIMD)])
