// SPDX-License-Identifier: MIT
// The bodies of the layers, in the order of their bytes. Private to native/dna.
#pragma once

#include "core/byte_reader.h"
#include "dna/dna.h"

namespace risorius::dna::detail {

using core::ByteReader;

Descriptor read_descriptor(ByteReader& r);
DescriptorExt read_descriptor_ext(ByteReader& r, bool has_winding);
Definition read_definition(ByteReader& r);
void read_controls(ByteReader& r, Behavior& b);
void read_joints(ByteReader& r, Behavior& b);
void read_blend_shape_channels(ByteReader& r, Behavior& b);
void read_animated_maps(ByteReader& r, Behavior& b);
/// mesh_sizes: true = each mesh is preceded by its size (2.2+), false = by the offset of the byte
/// after it (2.1).
Geometry read_geometry(ByteReader& r, bool mesh_sizes, bool blend_shapes);

}  // namespace risorius::dna::detail
