# SPDX-License-Identifier: MIT
"""The generator of a file of a real one's size keeps its promises."""

import sys

import numpy as np
import risorius
from conftest import PROJECT

sys.path.insert(0, str(PROJECT / "tests" / "fullscale"))
import generate


def test_the_file_has_a_real_ones_size_and_traps():
    dna = generate.generate(seed=3)
    assert dna.validate() == []
    assert (len(dna.joint_names), len(dna.blend_shape_channel_names)) == (870, 800)
    assert (dna.translation_unit, dna.rotation_unit) == ("cm", "degrees")
    assert dna.coordinate_system[1] == "up"
    assert len(dna.meshes) == 8
    assert len(dna.meshes[0].positions) == 24000
    assert "head_lod0_mesh" in dna.mesh_names
    moved = [len(t.vertex_indices) for t in dna.meshes[0].blend_shape_targets]
    assert 700 < np.mean(moved) < 900
    names = [
        *dna.joint_names,
        *dna.blend_shape_channel_names,
        *dna.raw_control_names,
        *dna.gui_control_names,
        *dna.animated_map_names,
    ]
    assert max(map(len, names)) == 100
    spaces = (dna.joint_names, dna.blend_shape_channel_names, dna.raw_control_names)
    assert any(len(set(space)) < len(space) for space in spaces)
    driven = set(dna.gui_to_raw.output_indices.tolist())
    assert driven < set(range(len(dna.raw_control_names)))
    assert set(dna.gui_to_raw.input_indices.tolist()) < set(range(len(dna.gui_control_names)))
    rig = risorius.Rig(dna)
    pose = rig.evaluate(np.full(len(dna.raw_control_names), 0.5, np.float32))
    assert np.isfinite(pose.joints).all()
    assert np.abs(pose.joints).max() > 0
    data = dna.to_bytes()
    assert generate.generate(seed=3).to_bytes() == data
