# SPDX-License-Identifier: MIT
"""Explains active controls, correctives, networks, twist and swing setups, blend shape channels and
animated maps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

import risorius

from ..controls.control_names import ControlNames, named
from ..rigs.rotation import Doubles

Facts = dict[str, Any]


# ---- conditional tables


def table_hits(
    table: risorius.Conditionals, rows: int, inputs: Doubles
) -> dict[int, list[tuple[int, Facts]]]:
    """Find the rows of a conditional table whose interval contains their input. Of consecutive rows
    with the same input and output, only the first match counts.

    Args:
        table: conditional table of the face.
        rows: number of leading rows in use.
        inputs: float64[n], values by input index.

    Returns:
        Output -> list of (input; its value, and the interval and result of the row).
    """
    out: dict[int, list[tuple[int, Facts]]] = {}
    matched = None
    for row in range(rows):
        pair = int(table.input_indices[row]), int(table.output_indices[row])
        if pair == matched:
            continue  # of consecutive rows with one input and output, only the first match counts
        matched = None
        low, high = sorted((float(table.from_values[row]), float(table.to_values[row])))
        value = float(inputs[pair[0]])
        if not low <= value <= high:
            continue
        matched = pair
        slope, cut = float(table.slope_values[row]), float(table.cut_values[row])
        facts = {"from": low, "to": high, "slope": slope, "cut": cut, "gives": slope * value + cut}
        out.setdefault(pair[1], []).append((pair[0], {"value": value} | facts))
    return out


def explain_raw(
    dna: risorius.Dna, raw: Doubles, rest: Doubles, gui: Doubles | None, names: ControlNames
) -> list[Facts]:
    """Raw controls that differ from their rest value, and the GUI controls that set them.

    Args:
        dna: the face.
        raw: float64[raw controls], values in the pose.
        rest: float64[raw controls], values at rest.
        gui: float64[GUI controls]; None if the raw controls were set directly.
        names: names of the controls.
    """
    hits: dict[int, list[tuple[int, Facts]]] = {}
    if gui is not None:
        hits = table_hits(dna.gui_to_raw, len(dna.gui_to_raw.input_indices), gui)
    gui_names = dna.gui_control_names
    return [
        {
            "name": names.name(i),
            "index": i,
            "value": float(raw[i]),
            "is_outside_0_1": not 0 <= raw[i] <= 1,
            "from_gui": [
                {"name": named(gui_names, g, "GUI control"), "index": g} | row
                for g, row in hits.get(i, [])
                if row["gives"]
            ]
            if gui is not None
            else [],
        }
        for i in np.flatnonzero(raw != rest).tolist()
    ]


# ---- correctives


def used_controls(dna: risorius.Dna, lod: int) -> set[int]:
    """Controls that joint groups, blend shape channels, animated maps or joints of networks read at
    a LOD. A corrective that none of them reads stays 0 at this LOD.

    Args:
        dna: the face.
        lod: the LOD, from 0.
    """
    used: set[int] = set()
    for group in dna.joint_groups:
        rows = int(group.lods[lod]) if lod < len(group.lods) else 0
        used.update(group.input_indices[np.any(group.values[:rows] != 0, axis=0)].tolist())
    used.update(dna.blend_shape_channels.input_indices[: _count(dna.blend_shape_channels, lod)])
    maps = dna.animated_maps
    used.update(maps.conditionals.input_indices[: _count(maps, lod)].tolist())
    joints = dna.machine_learned_behavior_ext.joints
    keys = zip(joints.parameter_keys, joints.parameter_values, strict=True)
    stride = 10 if any(k == 1 and v == 1 for k, v in keys) else 9
    there = set(dna.lod_joint_mapping[lod].tolist()) if lod < len(dna.lod_joint_mapping) else set()
    pairs = zip(joints.input_indices.tolist(), joints.output_indices.tolist(), strict=True)
    return {int(i) for i in used} | {i for i, o in pairs if o // stride in there}


def _count(table: risorius.BlendShapeChannels | risorius.AnimatedMaps, lod: int) -> int:
    return int(table.lods[lod]) if lod < len(table.lods) else 0


def explain_correctives(
    dna: risorius.Dna, controls: Doubles, lod: int, names: ControlNames
) -> Facts:
    """The correctives in groups.

    Returns:
        "count": the number of correctives. "fire": the active correctives. "lack_one": the inactive
        correctives of several controls of which exactly one is not above 0, if something reads the
        corrective at this LOD. "rest_at_this_lod": correctives that are inactive although all their
        controls are above 0, because nothing reads them at this LOD or because they depend on
        themselves.

    Args:
        dna: the face.
        controls: float64[controls], of a pose.
        lod: LOD of the pose, from 0.
        names: names of the controls.
    """
    rows = np.asarray(dna.psds.rows)
    used = used_controls(dna, lod)
    fires, lacking, unread = [], [], []
    for output in np.unique(rows).tolist():
        mine = rows == output
        columns = dna.psds.columns[mine].tolist()
        weight = float(np.prod(dna.psds.values[mine].astype(float)))
        facts = _corrective(output, columns, weight, controls, names)
        missing = sorted({c for c in columns if not controls[c] > 0})
        if controls[output] != 0:
            fires.append(facts)
        elif not missing:
            reason = "it depends on itself" if output in used else "nothing reads it"
            unread.append(facts | {"reason": reason})
        elif len(missing) == 1 and len(set(columns)) > 1 and output in used:
            lacking.append(_near_miss(facts, missing[0], names))
    fires.sort(key=lambda f: (-abs(f["value"]), f["index"]))
    lacking.sort(key=lambda f: (-len(f["factors"]), -abs(f["would_be"]), f["index"]))
    return {
        "count": len(np.unique(rows)),
        "fire": fires,
        "lack_one": lacking,
        "rest_at_this_lod": unread,
    }


def _corrective(
    output: int, columns: Sequence[int], weight: float, controls: Doubles, names: ControlNames
) -> Facts:
    return {
        "name": names.name(output),
        "index": output,
        "value": float(controls[output]),
        "weight": weight,
        "factors": [
            {
                "name": names.name(c),
                "index": c,
                "value": float(controls[c]),
                "used": min(1.0, max(0.0, float(controls[c]))),
            }
            for c in columns
        ],
    }


def _near_miss(facts: Facts, missing: int, names: ControlNames) -> Facts:
    others = math.prod(f["used"] for f in facts["factors"] if f["index"] != missing)
    return facts | {
        "missing": {"name": names.name(missing), "index": missing},
        "would_be": min(1.0, facts["weight"] * others),
    }


# ---- networks and setups


def explain_networks(
    dna: risorius.Dna, controls: Doubles, lod: int, names: ControlNames
) -> list[Facts]:
    """The networks that run at a LOD, in the order of evaluation.

    Args:
        dna: the face.
        controls: float64[controls], of a pose.
        lod: LOD of the pose, from 0.
        names: names of the controls.
    """
    ml = dna.machine_learned_behavior
    regions = _regions(dna)
    out = []
    for number in _running(dna, lod):
        network = ml.neural_networks[number]
        out.append(
            {
                "index": number,
                "regions": regions.get(number, []),
                "inputs": _on(network.input_indices.tolist(), controls, names),
                "outputs": _on(network.output_indices.tolist(), controls, names),
                "input_count": len(network.input_indices),
                "output_count": len(network.output_indices),
            }
        )
    return out


def _running(dna: risorius.Dna, lod: int) -> list[int]:
    types = dna.machine_learned_behavior_ext.types
    if not types:
        mapping = dna.machine_learned_behavior.lod_neural_network_mapping
        return mapping[lod].tolist() if lod < len(mapping) else []
    out: list[int] = []
    for kind in types:
        pairs = zip(kind.operations, kind.lod_operation_mappings, strict=False)
        for operations, mapping in pairs:
            listed = mapping[lod].tolist() if lod < len(mapping) else []
            networks = (operations[o] for o in listed if operations[o].operation_type == 3)
            out += [int(op.parameters[0]) for op in networks if len(op.parameters)]
    return list(dict.fromkeys(out))


def _regions(dna: risorius.Dna) -> dict[int, list[str]]:
    ml = dna.machine_learned_behavior
    out: dict[int, list[str]] = {}
    for m, regions in enumerate(ml.region_network_indices):
        for r, networks in enumerate(regions):
            named = m < len(ml.region_names) and r < len(ml.region_names[m])
            for network in networks.tolist():
                label = ml.region_names[m][r] if named else f"mesh {m}, region {r}"
                out.setdefault(network, []).append(label)
    return out


def _on(indices: Sequence[int], controls: Doubles, names: ControlNames) -> list[Facts]:
    on = (i for i in dict.fromkeys(indices) if controls[i] != 0)
    rows = [{"name": names.name(i), "index": i, "value": float(controls[i])} for i in on]
    return sorted(rows, key=lambda row: -abs(row["value"]))


def explain_setups(dna: risorius.Dna, controls: Doubles, names: ControlNames) -> list[Facts]:
    """Twist and swing setups whose angle is not 0: their angles in degrees, and their joints. A
    setup that does not have four input controls is left out.

    Args:
        dna: the face.
        controls: float64[controls], of a pose.
        names: names of the controls.
    """
    layer = dna.twist_swing_behavior
    out = []
    for kind, setups in (("swing", layer.swings), ("twist", layer.twists)):
        for index, setup in enumerate(setups):
            inputs = setup.input_control_indices.tolist()
            if len(inputs) != 4:
                continue
            twist, swing = _twist_and_swing(controls[inputs], setup.twist_axis)
            degrees = swing if kind == "swing" else twist
            if degrees == 0:
                continue
            joints = zip(setup.output_joint_indices.tolist(), setup.blend_weights, strict=False)
            out.append(
                {
                    "kind": kind,
                    "index": index,
                    "axis": "xyz"[min(setup.twist_axis, 2)],
                    "degrees": degrees,
                    "inputs": [
                        {"name": names.name(i), "value": float(controls[i])} for i in inputs
                    ],
                    "joints": [
                        {"name": named(dna.joint_names, j, "joint"), "index": j, "weight": float(w)}
                        for j, w in joints
                    ],
                }
            )
    return out


def _twist_and_swing(q: Doubles, axis: int) -> tuple[float, float]:
    """Angles of a quaternion (x, y, z, w) from 0 to 180 degrees: twist about an axis, and swing."""
    axis = min(axis, 2)
    about, w = float(q[axis]), float(q[3])
    rest = math.hypot(*(float(q[a]) for a in range(3) if a != axis))
    if not q.any():
        return 0.0, 0.0
    return (
        math.degrees(2 * math.atan2(abs(about), abs(w))),
        math.degrees(2 * math.atan2(rest, math.hypot(about, w))),
    )


# ---- channels and maps


def explain_shapes(
    dna: risorius.Dna, values: Doubles, controls: Doubles, lod: int, names: ControlNames
) -> list[Facts]:
    """Active blend shape channels, each with its control; the largest value is first.

    Args:
        dna: the face.
        values: float64[channels], of a pose.
        controls: float64[controls], of the same pose.
        lod: LOD of the pose, from 0.
        names: names of the controls.
    """
    channels = dna.blend_shape_channels
    count = _count(channels, lod)
    by = dict(
        zip(
            channels.output_indices[:count].tolist(),
            channels.input_indices[:count].tolist(),
            strict=True,
        )
    )
    rows = [
        {
            "name": named(dna.blend_shape_channel_names, i, "channel"),
            "index": i,
            "value": float(values[i]),
            "by": {"name": names.name(by[i]), "index": by[i], "value": float(controls[by[i]])},
        }
        for i in np.flatnonzero(values).tolist()
    ]
    return sorted(rows, key=lambda row: -abs(row["value"]))


def explain_maps(
    dna: risorius.Dna,
    values: Doubles,
    at_rest: Doubles,
    controls: Doubles,
    lod: int,
    names: ControlNames,
) -> list[Facts]:
    """Animated maps that are not 0; the one with the largest difference from its value at rest is
    first.

    Args:
        dna: the face.
        values: float64[maps], of a pose.
        at_rest: float64[maps], values at rest.
        controls: float64[controls], of the same pose.
        lod: LOD of the pose, from 0.
        names: names of the controls.
    """
    table = dna.animated_maps.conditionals
    hits = table_hits(table, _count(dna.animated_maps, lod), controls)
    rows = [
        {
            "name": named(dna.animated_map_names, i, "map"),
            "index": i,
            "value": float(values[i]),
            "at_rest": float(at_rest[i]),
            "by": [{"name": names.name(c), "index": c} | row for c, row in hits.get(i, [])],
        }
        for i in np.flatnonzero(values).tolist()
    ]
    return sorted(rows, key=lambda row: -abs(row["value"] - row["at_rest"]))
