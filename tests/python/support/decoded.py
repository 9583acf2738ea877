# SPDX-License-Identifier: MIT
"""Converts a Dna to the JSON form of the reference's golden files, by index or by name.

The reference is OpenRigLogic, which computed the values of tests/data/golden. Its
LOD filter does not renumber some indices of the complete file, so filtered files are compared by
the names of the elements.
"""

import gzip
import itertools
import json

import numpy as np
import risorius

ARCHETYPES = ["asian", "black", "caucasian", "hispanic", "alien", "other"]
GENDERS = ["male", "female", "other"]
DIRECTIONS = ["left", "right", "up", "down", "front", "back"]
SEQUENCES = ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]


def read(path):
    with gzip.open(path) if path.suffix == ".gz" else path.open("rb") as file:
        return json.loads(file.read())


def listed(array):
    return np.asarray(array).tolist()


def lods(mapping, name, lod_count):
    """The number of rows of a LOD mapping and the indices of each LOD, as in golden files."""
    rows = [listed(mapping[lod]) for lod in range(min(lod_count, len(mapping)))]
    return {
        f"{name}IndexListCount": len(mapping.rows),
        f"{name}IndicesForLOD": rows + [[]] * (lod_count - len(rows)),
    }


def planes(array, name, axes="XYZ"):
    return {f"{name}{axis}s": listed(array[:, i]) for i, axis in enumerate(axes)}


def descriptor(dna):
    return {
        "name": dna.name,
        "archetype": ARCHETYPES.index(dna.archetype),
        "gender": GENDERS.index(dna.gender),
        "age": dna.age,
        "metaData": [[k, v] for k, v in dna.metadata.items()],
        "translationUnit": ["cm", "m"].index(dna.translation_unit),
        "rotationUnit": ["degrees", "radians"].index(dna.rotation_unit),
        "coordinateSystem": [DIRECTIONS.index(d) for d in dna.coordinate_system],
        "rotationSequence": SEQUENCES.index(dna.rotation_sequence),
        "rotationSign": list(dna.rotation_signs),
        "faceWindingOrder": ["ccw", "cw"].index(dna.face_winding_order),
        "lodCount": dna.lod_count,
        "dbMaxLOD": dna.max_lod,
        "dbComplexity": dna.complexity,
        "dbName": dna.db_name,
    }


def pairs_in_lods(dna):
    """For each LOD, indices of the mesh/channel pairs whose mesh and channel belong to the LOD."""
    pairs = listed(dna.mesh_blend_shape_channel_mapping)
    return [
        [
            i
            for i, (mesh, channel) in enumerate(pairs)
            if mesh in dna.lod_mesh_mapping[lod] and channel in dna.lod_blend_shape_mapping[lod]
        ]
        for lod in range(dna.lod_count)
    ]


def definition(dna):
    pairs = np.asarray(dna.mesh_blend_shape_channel_mapping).reshape(-1, 2)
    return {
        "guiControlNames": dna.gui_control_names,
        "rawControlNames": dna.raw_control_names,
        "jointNames": dna.joint_names,
        **lods(dna.lod_joint_mapping, "joint", dna.lod_count),
        "jointParentIndices": listed(dna.joint_parents),
        "blendShapeChannelNames": dna.blend_shape_channel_names,
        **lods(dna.lod_blend_shape_mapping, "blendShapeChannel", dna.lod_count),
        "animatedMapNames": dna.animated_map_names,
        **lods(dna.lod_animated_map_mapping, "animatedMap", dna.lod_count),
        "meshNames": dna.mesh_names,
        **lods(dna.lod_mesh_mapping, "mesh", dna.lod_count),
        "meshBlendShapeMappingMesh": listed(pairs[:, 0]),
        "meshBlendShapeMappingChannel": listed(pairs[:, 1]),
        "meshBlendShapeChannelMappingIndicesForLOD": pairs_in_lods(dna),
        **planes(dna.neutral_joint_translations, "neutralJointTranslation"),
        **planes(dna.neutral_joint_rotations, "neutralJointRotation"),
    }


def conditionals(table, name):
    return {
        f"{name}InputIndices": listed(table.input_indices),
        f"{name}OutputIndices": listed(table.output_indices),
        f"{name}FromValues": listed(table.from_values),
        f"{name}ToValues": listed(table.to_values),
        f"{name}SlopeValues": listed(table.slope_values),
        f"{name}CutValues": listed(table.cut_values),
    }


def behavior(dna):
    return {
        **conditionals(dna.gui_to_raw, "guiToRaw"),
        "psdCount": dna.psd_count,
        "psdRowIndices": listed(dna.psds.rows),
        "psdColumnIndices": listed(dna.psds.columns),
        "psdValues": listed(dna.psds.values),
        "jointRowCount": dna.joint_row_count,
        "jointColumnCount": dna.joint_column_count,
        "jointGroups": [
            {
                "lods": listed(g.lods),
                "inputIndices": listed(g.input_indices),
                "outputIndices": listed(g.output_indices),
                "values": listed(np.ravel(g.values)),
                "jointIndices": listed(g.joint_indices),
            }
            for g in dna.joint_groups
        ],
        "blendShapeChannelLODs": listed(dna.blend_shape_channels.lods),
        "blendShapeChannelInputIndices": listed(dna.blend_shape_channels.input_indices),
        "blendShapeChannelOutputIndices": listed(dna.blend_shape_channels.output_indices),
        "animatedMapLODs": listed(dna.animated_maps.lods),
        **conditionals(dna.animated_maps.conditionals, "animatedMap"),
    }


def split(offsets, values):
    offsets, values = listed(offsets), listed(values)
    return [values[a:b] for a, b in itertools.pairwise(offsets)]


def mesh(m):
    weights = split(m.skin_offsets, m.skin_weights)
    return {
        "vertexPositionCount": len(m.positions),
        **planes(m.positions, "position"),
        **planes(m.texture_coordinates, "texture", "UV"),
        **planes(m.normals, "normal"),
        "layoutPositions": listed(m.layout_positions),
        "layoutTextureCoordinates": listed(m.layout_texture_coordinates),
        "layoutNormals": listed(m.layout_normals),
        "faces": split(m.face_offsets, m.face_layouts),
        "maximumInfluencePerVertex": m.maximum_influence_per_vertex,
        "skinWeightsCount": len(weights),
        "skinWeights": [
            list(pair)
            for pair in zip(weights, split(m.skin_offsets, m.skin_joint_indices), strict=True)
        ],
        "blendShapeTargets": [
            {
                "channel": t.blend_shape_channel_index,
                "vertexIndices": listed(t.vertex_indices),
                **planes(t.deltas, "delta"),
            }
            for t in m.blend_shape_targets
        ],
    }


def machine_learned_behavior(dna):
    ml = dna.machine_learned_behavior
    return {
        "controlNames": ml.ml_control_names,
        **lods(ml.lod_neural_network_mapping, "neuralNetwork", dna.lod_count),
        "meshRegions": [
            [{"name": n, "nets": listed(i)} for n, i in zip(names, networks, strict=True)]
            for names, networks in zip(ml.region_names, ml.region_network_indices, strict=True)
        ],
        "networks": [
            {
                "inputIndices": listed(n.input_indices),
                "outputIndices": listed(n.output_indices),
                "layers": [
                    {
                        "activation": layer.activation_function,
                        "activationParams": listed(layer.activation_parameters),
                        "biases": listed(layer.biases),
                        "weights": listed(layer.weights),
                    }
                    for layer in n.layers
                ],
            }
            for n in ml.neural_networks
        ],
    }


def machine_learned_behavior_ext(dna):
    ext = dna.machine_learned_behavior_ext
    return {
        "types": [
            [
                {
                    **lods(mapping, "operation", dna.lod_count),
                    "operations": [
                        {
                            "type": o.operation_type,
                            "parameters": listed(o.parameters),
                            "dependencySets": listed(o.operation_set_dependency_indices),
                            "dependencyOps": listed(o.operation_dependency_indices),
                        }
                        for o in operations
                    ],
                }
                for mapping, operations in zip(t.lod_operation_mappings, t.operations, strict=True)
            ]
            for t in ext.types
        ],
        "jointsInputIndices": listed(ext.joints.input_indices),
        "jointsOutputIndices": listed(ext.joints.output_indices),
        "jointsParameterKeys": listed(ext.joints.parameter_keys),
        "jointsParameterValues": listed(ext.joints.parameter_values),
    }


def rbf_behavior(dna):
    rbf, ext = dna.rbf_behavior, dna.rbf_behavior_ext
    controls = [
        {
            "inputControlIndices": listed(p.input_control_indices),
            "outputControlIndices": listed(p.output_control_indices),
            "outputControlWeights": listed(p.output_control_weights),
        }
        for p in ext.poses
    ]
    return {
        "poseControlNames": ext.pose_control_names,
        "poses": [
            {"name": p.name, "scale": p.scale, **(controls[i] if i < len(controls) else {})}
            for i, p in enumerate(rbf.poses)
        ],
        **lods(rbf.lod_solver_mapping, "solver", dna.lod_count),
        "solvers": [
            {
                "name": s.name,
                "rawControlIndices": listed(s.raw_control_indices),
                "poseIndices": listed(s.pose_indices),
                "rawControlValues": listed(s.raw_control_values),
                "radius": s.radius,
                "weightThreshold": s.weight_threshold,
                "type": s.solver_type,
                "automaticRadius": s.automatic_radius,
                "distanceMethod": s.distance_method,
                "normalizeMethod": s.normalize_method,
                "functionType": s.function_type,
                "twistAxis": s.twist_axis,
            }
            for s in rbf.solvers
        ],
    }


def twist_swing_behavior(dna):
    def setups(values):
        return [
            {
                "axis": s.twist_axis,
                "inputControlIndices": listed(s.input_control_indices),
                "outputJointIndices": listed(s.output_joint_indices),
                "blendWeights": listed(s.blend_weights),
            }
            for s in values
        ]

    layer = dna.twist_swing_behavior
    return {"twists": setups(layer.twists), "swings": setups(layer.swings)}


def joint_behavior_metadata(dna):
    rows = np.asarray(dna.joint_behavior_metadata.joint_representations).reshape(-1, 3)
    return {
        "translation": listed(rows[:, 0]),
        "rotation": listed(rows[:, 1]),
        "scale": listed(rows[:, 2]),
    }


def decoded(dna):
    return {
        "header": {"generation": dna.generation, "version": dna.version},
        "descriptor": descriptor(dna),
        "definition": definition(dna),
        "behavior": behavior(dna),
        "geometry": [mesh(m) for m in dna.meshes],
        "machineLearnedBehavior": machine_learned_behavior(dna),
        "machineLearnedBehaviorExt": machine_learned_behavior_ext(dna),
        "rbfBehavior": rbf_behavior(dna),
        "twistSwingBehavior": twist_swing_behavior(dna),
        "jointBehaviorMetadata": joint_behavior_metadata(dna),
    }


def with_defaults(view, dna):
    """Add the reference's default values for layers that are missing or not loaded."""
    joints, meshes = len(dna.joint_names), len(dna.mesh_names)
    for attribute in view["jointBehaviorMetadata"].values():
        attribute.extend([0] * (joints - len(attribute)))
    view["geometry"] += [mesh(risorius.Mesh()) for _ in range(meshes - len(dna.meshes))]
    regions = view["machineLearnedBehavior"]["meshRegions"]
    regions += [[]] * (meshes - len(regions))
    return view


def stride(keys, values):
    """Values per joint in machineLearnedBehaviorExt: 10 if rotations are quaternions, else 9."""
    quaternions = any(k == 1 and v == 1 for k, v in zip(keys, values, strict=True))
    return 10 if quaternions else 9


class Names:
    """The names of all elements in a file, and its networks, in the order of their indices."""

    def __init__(self, view):
        d = view["definition"]
        self.joints = d["jointNames"]
        self.channels = d["blendShapeChannelNames"]
        self.maps = d["animatedMapNames"]
        self.meshes = d["meshNames"]
        self.networks = view["machineLearnedBehavior"]["networks"]


def by_name(view, unmapped=None):
    """Replace indices of joints, channels, maps, meshes and networks in a decoded file by names.

    Args:
        view: result of decoded(), or a decoded golden file.
        unmapped: Names of the unfiltered file, for indices that the reference's LOD filter does not
            change: outputs of channels and animated maps, channels of targets, networks. None: use
            the names of `view`.
    """
    own = Names(view)
    old = unmapped or own
    d = view["definition"]
    behavior = view["behavior"]
    return {
        "descriptor": view["descriptor"],
        "controls": [d["guiControlNames"], d["rawControlNames"]],
        "lods": _lods_by_name(d, own),
        "joints": _joints_by_name(view, own),
        "mesh channels": sorted(
            [own.meshes[m], own.channels[c]]
            for m, c in zip(
                d["meshBlendShapeMappingMesh"], d["meshBlendShapeMappingChannel"], strict=True
            )
        ),
        "gui": {k: v for k, v in behavior.items() if k.startswith(("guiToRaw", "psd"))},
        "groups": [_group_by_name(g, own) for g in behavior["jointGroups"]],
        "channels": _outputs_by_name(behavior, "blendShapeChannel", old.channels, own.channels),
        "maps": _outputs_by_name(behavior, "animatedMap", old.maps, own.maps),
        "meshes": {
            name: _mesh_by_name(m, own, old)
            for name, m in zip(own.meshes, view["geometry"], strict=True)
        },
        "ml": view["machineLearnedBehavior"],
        "operations": _operations_by_name(view["machineLearnedBehaviorExt"], own, old),
        "rbf": view["rbfBehavior"],
        "setups": [
            {
                "axis": s["axis"],
                "inputs": s["inputControlIndices"],
                "outputs": [own.joints[j] for j in s["outputJointIndices"]],
                "weights": s["blendWeights"],
            }
            for kind in ("twists", "swings")
            for s in view["twistSwingBehavior"][kind]
        ],
    }


def _lods_by_name(d, own):
    spaces = {
        "joint": own.joints,
        "blendShapeChannel": own.channels,
        "animatedMap": own.maps,
        "mesh": own.meshes,
    }
    return {
        space: [[names[i] for i in row] for row in d[f"{space}IndicesForLOD"]]
        for space, names in spaces.items()
    }


def _joints_by_name(view, own):
    d = view["definition"]
    planes_of = [
        f"neutralJoint{kind}{axis}s" for kind in ("Translation", "Rotation") for axis in "XYZ"
    ]
    return {
        name: {
            "parent": own.joints[d["jointParentIndices"][i]],
            "neutral": [d[plane][i] for plane in planes_of],
            "representation": [v[i] for v in view["jointBehaviorMetadata"].values()],
        }
        for i, name in enumerate(own.joints)
    }


def _group_by_name(g, own):
    return {
        "lods": g["lods"],
        "inputs": g["inputIndices"],
        "outputs": [[own.joints[o // 9], o % 9] for o in g["outputIndices"]],
        "values": g["values"],
        "joints": [own.joints[j] for j in g["jointIndices"]],
    }


def _outputs_by_name(behavior, name, old, kept):
    """For each LOD, the entries of a table whose output is in `kept`, with names of outputs.

    Args:
        behavior: the decoded layer.
        name: beginning of the names of the table's fields.
        old: names of the outputs by index.
        kept: names of the outputs that remain.
    """
    fields = [
        k
        for k in behavior
        if k.startswith(name) and k.endswith(("Indices", "Values")) and not k.endswith("LODs")
    ]
    entries = []
    for row in zip(*(behavior[f] for f in fields), strict=True):
        entry = dict(zip(fields, row, strict=True))
        entry[f"{name}OutputIndices"] = old[entry[f"{name}OutputIndices"]]
        entries.append(entry)
    return [
        [e for e in entries[:n] if e[f"{name}OutputIndices"] in kept]
        for n in behavior[f"{name}LODs"]
    ]


def _mesh_by_name(m, own, old):
    return {
        **m,
        "skinWeights": [[w, [own.joints[j] for j in joints]] for w, joints in m["skinWeights"]],
        "blendShapeTargets": [
            {**t, "channel": old.channels[t["channel"]]} for t in m["blendShapeTargets"]
        ],
    }


def _operations_by_name(ext, own, old):
    """The decoded layer machineLearnedBehaviorExt without indices of networks and joints.

    Operations contain the networks in place of their indices; joint outputs are [name of the joint,
    attribute].
    """
    mlp = 3
    width = stride(ext["jointsParameterKeys"], ext["jointsParameterValues"])
    types = [
        [
            {
                **operation_set,
                "operations": [
                    {**o, "parameters": old.networks[o["parameters"][0]]}
                    if o["type"] == mlp and o["parameters"]
                    else o
                    for o in operation_set["operations"]
                ],
            }
            for operation_set in sets
        ]
        for sets in ext["types"]
    ]
    outputs = [[own.joints[o // width], o % width] for o in ext["jointsOutputIndices"]]
    return {**ext, "types": types, "jointsOutputIndices": outputs}
