// SPDX-License-Identifier: MIT
// Converts a Dna to other axes, rotation order, signs, winding and units, layer by layer. A joint
// group's rows are joint attributes, its columns controls.
#include "dna/convert/coordinates.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "dna/controls.h"
#include "dna/convert/change_of_basis.h"
#include "dna/validate.h"

namespace risorius::dna {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::ok;
using core::Status;
using detail::Basis;
using detail::Rotation;
using detail::System;
using detail::Vec3;
using Warnings = std::vector<Warning>;

std::string item(const std::string& where, std::size_t i) {
  return where + "[" + std::to_string(i) + "]";
}

// Rounds to float. Adding 0 turns -0 into 0.
float rounded(double v) { return static_cast<float>(v + 0.0); }

// ---- source and target systems

System system_of(const Dna& dna) {
  const Descriptor& d = dna.descriptor;
  return {d.coordinate_system, dna.descriptor_ext, d.translation_unit, d.rotation_unit};
}

System system_of(const CoordinateTarget& target, System s) {
  s.axes = target.axes.value_or(s.axes);
  s.ext.rotation_sequence = target.rotation_sequence.value_or(s.ext.rotation_sequence);
  s.ext.rotation_sign = target.rotation_signs.value_or(s.ext.rotation_sign);
  s.ext.face_winding_order = target.face_winding_order.value_or(s.ext.face_winding_order);
  s.translation_unit = target.translation_unit.value_or(s.translation_unit);
  s.rotation_unit = target.rotation_unit.value_or(s.rotation_unit);
  return s;
}

// Checks a coordinate system. In: of_file  true: errors name a field of the file; false: errors
// name an argument of the conversion
Status check_system(const System& s, bool of_file) {
  const ErrorCode code = of_file ? ErrorCode::kInvalidValue : ErrorCode::kInvalidArgument;
  const std::string d = of_file ? "descriptor." : "", e = of_file ? "descriptor_ext." : "";
  if (!detail::spans_space(s.axes)) {
    return fail(code, of_file ? "descriptor.coordinate_system" : "axes",
                "the axes do not span space");
  }
  for (const std::int32_t sign : s.ext.rotation_sign) {
    if (sign == 1 || sign == -1) continue;
    return fail(code, of_file ? "descriptor_ext.rotation_sign" : "rotation_signs",
                "a sign is " + std::to_string(sign) + ", 1 or -1 was expected");
  }
  struct Choice {
    std::string where;
    std::uint32_t value, limit;
  };
  for (const Choice& c : {Choice{e + "rotation_sequence", s.ext.rotation_sequence, 6},
                          Choice{e + "face_winding_order", s.ext.face_winding_order, 2},
                          Choice{d + "translation_unit", s.translation_unit, 2},
                          Choice{d + "rotation_unit", s.rotation_unit, 2}}) {
    if (c.value < c.limit) continue;
    return fail(code, c.where, "the value " + std::to_string(c.value) + " is not known");
  }
  return ok();
}

struct Conversion {
  Conversion(const System& from, const System& target)
      : source(from), basis(from.axes, target.axes), rotation(from, target, basis) {
    if (source.translation_unit != target.translation_unit) {
      unit = target.translation_unit == 0 ? 100.0 : 0.01;
    }
    const bool mirrored = basis.determinant < 0;
    const bool rewound = source.ext.face_winding_order != target.ext.face_winding_order;
    reverses_faces = mirrored != rewound;
  }

  bool keeps_positions() const { return basis.identity() && unit == 1; }
  bool keeps_rotations() const { return rotation.identity(); }
  Vec3 position(const Vec3& v) const {
    Vec3 out = basis(v);
    for (double& c : out) c *= unit;
    return out;
  }

  System source;
  Basis basis;
  Rotation rotation;
  double unit = 1;
  bool reverses_faces = false;
};

// ---- definition and geometry

template <class Convert>
Vec3Array mapped(const Vec3Array& vectors, const Convert& convert) {
  const std::size_t n = vectors.count();
  std::vector<float> out(n * 3);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 v = convert(Vec3{vectors.at(i, 0), vectors.at(i, 1), vectors.at(i, 2)});
    for (std::size_t p = 0; p < 3; ++p) out[p * n + i] = rounded(v[p]);
  }
  return {Array<float>(std::move(out))};
}

void convert_definition(const Conversion& c, Definition& d) {
  const auto position = [&](const Vec3& v) { return c.position(v); };
  if (!c.keeps_positions()) {
    d.neutral_joint_translations = mapped(d.neutral_joint_translations, position);
  }
  if (!c.keeps_rotations()) {
    d.neutral_joint_rotations = mapped(d.neutral_joint_rotations, c.rotation);
  }
}

void reverse_faces(Mesh& m) {
  std::vector<std::uint32_t> layouts(m.face_layouts.begin(), m.face_layouts.end());
  for (std::size_t f = 0; f + 1 < m.face_offsets.size(); ++f) {
    std::reverse(layouts.begin() + m.face_offsets[f], layouts.begin() + m.face_offsets[f + 1]);
  }
  m.face_layouts = std::move(layouts);
}

void convert_mesh(const Conversion& c, Mesh& m) {
  const auto position = [&](const Vec3& v) { return c.position(v); };
  if (c.reverses_faces) reverse_faces(m);
  if (!c.basis.identity()) m.normals = mapped(m.normals, c.basis);
  if (c.keeps_positions()) return;
  m.positions = mapped(m.positions, position);
  for (BlendShapeTarget& target : m.blend_shape_targets) {
    target.deltas = mapped(target.deltas, position);
  }
}

// ---- joint groups

constexpr std::size_t kAttributes = 9;  // tx ty tz rx ry rz sx sy sz

bool is_rotation(std::size_t output) { return output % kAttributes / 3 == 1; }

// The rows of a joint group that rotate one joint. The first and the last row are in file order.
struct RotationRows {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::array<std::size_t, 3> rows{kNone, kNone, kNone};  // by axis
  std::size_t first = 0, last = 0;
};

// The rotation rows of each joint, among the first row_count rows of the group. If two rows write
// the same output the last one counts, as in the evaluation.
std::map<std::size_t, RotationRows> rotation_rows(const JointGroup& g, std::size_t row_count) {
  std::map<std::size_t, RotationRows> out;
  for (std::size_t r = 0; r < row_count; ++r) {
    const std::size_t output = g.output_indices[r];
    if (!is_rotation(output)) continue;
    RotationRows& joint =
        out.try_emplace(output / kAttributes, RotationRows{.first = r}).first->second;
    joint.rows[output % 3] = r;
    joint.last = r;
  }
  return out;
}

// The number of leading rows that at least one LOD uses, or all rows if the group lists no LODs.
// The other rows are dropped: if they were converted together with used rows of the same joint,
// they would change the pose.
std::size_t used_rows(const JointGroup& g) {
  return g.lods.empty() ? g.output_indices.size() : *std::ranges::max_element(g.lods);
}

// The rows of a converted joint group: the output of each row, and the values row by row.
struct Rows {
  std::vector<std::size_t> outputs;
  std::vector<float> values;
};

// Converts a row to one row, which is added to `out`. This is possible for translations, for
// scales, and for angles if the order of rotation stays.
void move_row(const Conversion& c, const JointGroup& g, std::size_t row, Rows& out) {
  const std::size_t columns = g.input_indices.size(), output = g.output_indices[row];
  const std::size_t kind = output % kAttributes / 3, axis = output % 3;
  double factor = 1;  // scales have no sign along an axis
  if (kind == 0) factor = c.basis.sign[axis] * c.unit;
  if (kind == 1) factor = c.rotation.factor(axis);
  out.outputs.push_back(output - axis + c.basis.to[axis]);
  for (const float v : g.values.span().subspan(row * columns, columns)) {
    out.values.push_back(factor == 1 ? v : rounded(factor * v));
  }
}

// Converts the rotation rows of a joint, one to three, to at most three rows: rows of zeros are
// left out.
void mix_rows(const Conversion& c, const JointGroup& g, const RotationRows& joint, Rows& out) {
  const std::size_t columns = g.input_indices.size();
  const std::size_t output = g.output_indices[joint.first], rx = output - output % 3;
  std::vector<float> block(3 * columns);
  for (std::size_t col = 0; col < columns; ++col) {
    Vec3 angles{};
    for (std::size_t a = 0; a < 3; ++a) {
      if (joint.rows[a] != RotationRows::kNone) angles[a] = g.values[joint.rows[a] * columns + col];
    }
    angles = c.rotation(angles);
    for (std::size_t a = 0; a < 3; ++a) block[a * columns + col] = rounded(angles[a]);
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const auto row = block.begin() + static_cast<std::ptrdiff_t>(a * columns);
    const auto end = row + static_cast<std::ptrdiff_t>(columns);
    if (std::all_of(row, end, [](float v) { return v == 0; })) continue;
    out.outputs.push_back(rx + a);
    out.values.insert(out.values.end(), row, end);
  }
}

Status take_rows(const std::string& where, Rows rows, JointGroup& g) {
  constexpr std::size_t kMost = 0xFFFF;
  if (!g.lods.empty() && rows.outputs.size() > kMost) {
    return fail(ErrorCode::kInvalidValue, where, "more rows than the format can count");
  }
  std::vector<std::uint16_t> outputs;
  for (const std::size_t output : rows.outputs) {
    if (output > kMost) {
      return fail(ErrorCode::kInvalidValue, where + ".output_indices",
                  "joint " + std::to_string(output / kAttributes) +
                      " is the format's last one and has no row for another axis");
    }
    outputs.push_back(static_cast<std::uint16_t>(output));
  }
  g.output_indices = std::move(outputs);
  g.values = std::move(rows.values);
  return ok();
}

Status convert_group(const Conversion& c, const std::string& where, JointGroup& g) {
  const bool mixes = !c.rotation.same_order();
  const std::size_t row_count = mixes ? used_rows(g) : g.output_indices.size();
  const auto joints = mixes ? rotation_rows(g, row_count) : std::map<std::size_t, RotationRows>{};
  Rows rows;
  std::vector<std::size_t> rows_before{0};
  for (std::size_t r = 0; r < row_count; ++r) {
    const std::size_t output = g.output_indices[r];
    if (!mixes || !is_rotation(output)) {
      move_row(c, g, r, rows);
    } else if (const RotationRows& joint = joints.at(output / kAttributes); joint.first == r) {
      mix_rows(c, g, joint, rows);
    }
    rows_before.push_back(rows.outputs.size());
  }
  std::vector<std::uint16_t> lods;
  for (const std::uint16_t n : g.lods) lods.push_back(static_cast<std::uint16_t>(rows_before[n]));
  RISORIUS_TRY(take_rows(where, std::move(rows), g));
  g.lods = std::move(lods);
  return ok();
}

// Whether any LOD uses only some of the rows with which the group rotates a joint.
bool cuts_rotation(const JointGroup& g) {
  for (const auto& [joint, rows] : rotation_rows(g, used_rows(g))) {
    for (const std::uint16_t n : g.lods) {
      if (rows.first < n && n <= rows.last) return true;
    }
  }
  return false;
}

// The axes about which a joint rotates, and its joint groups: whether any group rotates the joint
// (driven), whether several do (split), and the last that does (group).
struct Turns {
  bool driven = false, split = false;
  std::size_t group = 0;
  std::array<bool, 3> about{};  // by the neutral pose or by a group
};

std::vector<Turns> turns_of(const Dna& dna) {
  const Definition& d = dna.definition;
  std::vector<Turns> out(d.joint_names.size());
  for (std::size_t j = 0; j < out.size(); ++j) {
    for (std::size_t a = 0; a < 3; ++a) out[j].about[a] = d.neutral_joint_rotations.at(j, a) != 0;
  }
  for (std::size_t i = 0; i < dna.behavior.joint_groups.size(); ++i) {
    for (const std::uint16_t output : dna.behavior.joint_groups[i].output_indices) {
      if (!is_rotation(output)) continue;
      Turns& joint = out[output / kAttributes];
      joint.split = joint.split || (joint.driven && joint.group != i);
      joint.driven = true;
      joint.group = i;
      joint.about[output % 3] = true;
    }
  }
  return out;
}

// Warns of joints whose rotation cannot be converted exactly to the new order of axes: their angles
// about several axes are sums, several groups rotate them, or a LOD uses only some of their
// rotation rows.
void warn_of_mixed_rotations(const Dna& dna, Warnings& warnings) {
  const auto& metadata = dna.joint_behavior_metadata.joint_representations;
  const std::string where = "behavior.joint_groups";
  const std::vector<Turns> joints = turns_of(dna);
  std::size_t split = 0, approximate = 0;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const bool quaternion = j < metadata.size() && metadata[j].rotation == 1;
    const bool several = std::ranges::count(joints[j].about, true) > 1;
    if (joints[j].split) ++split;
    if (joints[j].driven && several && !quaternion) ++approximate;
  }
  if (approximate > 0) {
    warnings.push_back({where, std::to_string(approximate) +
                                   " joints turn about several axes: each column is converted as a "
                                   "rotation of its own, and sums of them in the new order of axes "
                                   "are approximate"});
  }
  if (split > 0) {
    warnings.push_back({where, std::to_string(split) +
                                   " joints are turned by several groups: where two of them write "
                                   "one angle now, the later one wins"});
  }
  for (std::size_t i = 0; i < dna.behavior.joint_groups.size(); ++i) {
    if (!cuts_rotation(dna.behavior.joint_groups[i])) continue;
    warnings.push_back({item(where, i) + ".lods",
                        "a LOD that used some of a joint's rotation rows now uses all of them"});
  }
}

Status convert_joint_groups(const Conversion& c, Dna& dna) {
  if (c.keeps_positions() && c.keeps_rotations()) return ok();
  for (std::size_t i = 0; i < dna.behavior.joint_groups.size(); ++i) {
    Status converted =
        convert_group(c, item("behavior.joint_groups", i), dna.behavior.joint_groups[i]);
    if (!converted) return converted;
  }
  return ok();
}

// ---- rotations in controls

bool is_w(const std::vector<std::string>& raw_control_names, std::size_t control) {
  if (control >= raw_control_names.size()) return false;
  const std::string& name = raw_control_names[control];
  return name.ends_with(".w") || name.ends_with(".qw");
}

// Whether a solver's inputs are quaternions: their number is a multiple of 4, and the distance
// method is not the Euclidean one, or the name of each fourth control is that of a w component (*.w
// or *.qw).
bool takes_quaternions(const RbfSolver& s, const std::vector<std::string>& raw_control_names) {
  if (s.raw_control_indices.size() % 4 != 0) return false;
  if (s.distance_method != 0) return true;
  for (std::size_t i = 3; i < s.raw_control_indices.size(); i += 4) {
    if (!is_w(raw_control_names, s.raw_control_indices[i])) return false;
  }
  return true;
}

// Converts quaternions from the source's axes to the target's. If one system is the mirror image of
// the other, the sense of rotation is reversed.
Array<float> converted_quaternions(const Basis& basis, const Array<float>& values) {
  std::vector<float> out(values.begin(), values.end());
  for (std::size_t i = 0; i + 3 < out.size(); i += 4) {
    const Vec3 axis = basis({out[i], out[i + 1], out[i + 2]});
    for (std::size_t p = 0; p < 3; ++p) out[i + p] = rounded(basis.determinant * axis[p]);
  }
  return out;
}

// Converts the number of a twist axis (0 x 1 y 2 z). The sign of the axis is ignored, because a
// twist about the opposite axis is treated alike.
void convert_axis(const Basis& basis, std::uint16_t& axis) {
  if (axis < 3) axis = static_cast<std::uint16_t>(basis.to[axis]);
}

void convert_control_rotations(const Conversion& c, Dna& dna) {
  for (RbfSolver& s : dna.rbf_behavior.solvers) {
    // The evaluation reads the radius in the rotation unit for every distance method.
    if (c.rotation.unit() != 1) s.radius = rounded(c.rotation.unit() * s.radius);
    convert_axis(c.basis, s.twist_axis);
    if (c.basis.identity() || !takes_quaternions(s, dna.definition.raw_control_names)) continue;
    s.raw_control_values = converted_quaternions(c.basis, s.raw_control_values);
  }
  for (TwistSwingSetup& s : dna.twist_swing_behavior.twists) convert_axis(c.basis, s.twist_axis);
  for (TwistSwingSetup& s : dna.twist_swing_behavior.swings) convert_axis(c.basis, s.twist_axis);
}

// Warns if correctives, joint groups, channels, maps or networks read single components of a
// quaternion, because these readers are not converted to the new axes. Only the w component is
// recognised, by the name of its control (*.w or *.qw).
void warn_of_components(const Dna& dna, Warnings& warnings) {
  const auto check = [&](const char* where, const auto& controls) {
    for (const auto control : controls) {
      if (!is_w(dna.definition.raw_control_names, control)) continue;
      warnings.push_back({where, "control " + dna.definition.raw_control_names[control] +
                                     " is part of a rotation, which is read in the old axes"});
      return true;
    }
    return false;
  };
  check("behavior.psds.columns", dna.behavior.psds.columns);
  for (const JointGroup& g : dna.behavior.joint_groups) {
    if (check("behavior.joint_groups", g.input_indices)) break;
  }
  check("behavior.blend_shape_channels", dna.behavior.blend_shape_channels.input_indices);
  check("behavior.animated_maps", dna.behavior.animated_maps.conditionals.input_indices);
  for (const NeuralNetwork& n : dna.machine_learned_behavior.neural_networks) {
    if (check("machine_learned_behavior.neural_networks", n.input_indices)) break;
  }
}

// ---- networks that move joints

// The numbers of the networks are not converted. Instead, parameters 3 to 9 of MlJoints name the
// coordinate system to which the numbers refer. If the file has all of these parameters they stay
// as they are.
void name_ml_system(const System& source, MlJoints& joints) {
  constexpr std::uint16_t kFirst = 3, kLast = 9;
  const auto& keys = joints.parameter_keys;
  const auto named = [&](std::uint16_t key) { return std::ranges::find(keys, key) != keys.end(); };
  bool whole = true;
  for (std::uint16_t key = kFirst; key <= kLast; ++key) whole = whole && named(key);
  if (whole) return;
  std::vector<std::uint16_t> new_keys, values;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i] >= kFirst && keys[i] <= kLast) continue;
    new_keys.push_back(keys[i]);
    values.push_back(joints.parameter_values[i]);
  }
  const auto& signs = source.ext.rotation_sign;
  const auto sign = [&](std::size_t i) {
    return static_cast<std::uint16_t>(signs[i] == 1 ? 1 : 0);
  };
  for (std::uint16_t key = kFirst; key <= kLast; ++key) new_keys.push_back(key);
  values.insert(values.end(),
                {source.axes.x_axis, source.axes.y_axis, source.axes.z_axis, sign(0), sign(1),
                 sign(2), static_cast<std::uint16_t>(source.ext.rotation_sequence)});
  joints.parameter_keys = std::move(new_keys);
  joints.parameter_values = std::move(values);
}

void convert_ml_joints(const Conversion& c, const System& target, MlJoints& joints,
                       Warnings& warnings) {
  if (joints.output_indices.empty()) return;
  const bool same_axes = c.source.axes == target.axes &&
                         c.source.ext.rotation_sequence == target.ext.rotation_sequence &&
                         c.source.ext.rotation_sign == target.ext.rotation_sign;
  if (!same_axes) name_ml_system(c.source, joints);
  const std::uint16_t stride = ml_joint_stride(joints);
  bool translations = false, angles = false;
  for (const std::uint16_t output : joints.output_indices) {
    const std::size_t attribute = output % stride;
    translations = translations || attribute < 3;
    angles = angles || (stride == kAttributes && is_rotation(output));
  }
  if ((c.unit != 1 && translations) || (c.rotation.unit() != 1 && angles)) {
    warnings.push_back({"machine_learned_behavior_ext.joints",
                        "networks move joints in the old unit: not converted"});
  }
}

// ---- the whole Dna

void warn_of_unknown_layers(const Dna& dna, Warnings& warnings) {
  for (const UnknownLayer& layer : dna.unknown_layers) {
    warnings.push_back({"unknown_layers", "layer " + std::string(layer.id.data(), layer.id.size()) +
                                              " is not known: kept as it is"});
  }
}

void set_system(const System& target, Dna& dna) {
  // The layer dsce exists from 2.7 on, but stores all fields of descriptor_ext only from 2.8 on.
  if (dna.descriptor_ext != target.ext && dna.version < 8) dna.version = 8;
  dna.descriptor.coordinate_system = target.axes;
  dna.descriptor.translation_unit = target.translation_unit;
  dna.descriptor.rotation_unit = target.rotation_unit;
  dna.descriptor_ext = target.ext;
}

}  // namespace

core::Result<Dna> convert_coordinates(const Dna& dna, const CoordinateTarget& target,
                                      Warnings& warnings) {
  Warnings unused;
  RISORIUS_TRY(validate(dna, unused));
  const System source = system_of(dna), wanted = system_of(target, source);
  RISORIUS_TRY(check_system(source, true));
  RISORIUS_TRY(check_system(wanted, false));
  Dna out = dna;
  if (source == wanted) return out;
  const Conversion c(source, wanted);
  if (!c.rotation.same_order()) warn_of_mixed_rotations(dna, warnings);
  if (!c.basis.identity()) warn_of_components(dna, warnings);
  if (!c.keeps_positions() || !c.keeps_rotations()) warn_of_unknown_layers(dna, warnings);
  convert_definition(c, out.definition);
  RISORIUS_TRY(convert_joint_groups(c, out));
  for (Mesh& mesh : out.geometry.meshes) convert_mesh(c, mesh);
  convert_control_rotations(c, out);
  convert_ml_joints(c, wanted, out.machine_learned_behavior_ext.joints, warnings);
  set_system(wanted, out);
  return out;
}

}  // namespace risorius::dna
