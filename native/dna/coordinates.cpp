// SPDX-License-Identifier: MIT
// Row vectors throughout: v' = v C and R' = transpose(C) R C, where C is a signed permutation.
#include "dna/coordinates.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "dna/io.h"

namespace risorius::dna {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::ok;
using core::Status;
using Vec3 = std::array<double, 3>;
using Matrix = std::array<Vec3, 3>;

std::string item(const std::string& where, std::size_t i) {
  return where + "[" + std::to_string(i) + "]";
}

// Adding 0 turns -0 into 0.
float rounded(double v) { return static_cast<float>(v + 0.0); }

// ---- what to convert from and to

struct System {
  CoordinateSystem axes;
  DescriptorExt ext;
  std::uint16_t translation_unit = 0, rotation_unit = 0;
};

System system_of(const Dna& dna) {
  const Descriptor& d = dna.descriptor;
  return {d.coordinate_system, dna.descriptor_ext, d.translation_unit, d.rotation_unit};
}

System system_of(const CoordinateTarget& target, const System& source) {
  System s;
  s.axes = target.axes.value_or(source.axes);
  s.ext.rotation_sequence = target.rotation_sequence.value_or(source.ext.rotation_sequence);
  s.ext.rotation_sign = target.rotation_sign.value_or(source.ext.rotation_sign);
  s.ext.face_winding_order = target.face_winding_order.value_or(source.ext.face_winding_order);
  s.translation_unit = target.translation_unit.value_or(source.translation_unit);
  s.rotation_unit = target.rotation_unit.value_or(source.rotation_unit);
  return s;
}

bool spans_space(const CoordinateSystem& a) {
  const std::uint16_t x = a.x_axis / 2, y = a.y_axis / 2, z = a.z_axis / 2;
  return x < 3 && y < 3 && z < 3 && x != y && y != z && x != z;
}

// The layer that a field lies in is named only for the file's own system.
Status check_system(const System& s, ErrorCode code, const std::string& descriptor,
                    const std::string& ext, const std::string& axes) {
  const auto unknown = [&](const std::string& where, std::uint32_t value) {
    return fail(code, where, "the value " + std::to_string(value) + " is not known");
  };
  if (!spans_space(s.axes)) return fail(code, descriptor + axes, "the axes do not span space");
  if (s.ext.rotation_sequence > 5) {
    return unknown(ext + "rotation_sequence", s.ext.rotation_sequence);
  }
  for (const std::int32_t sign : s.ext.rotation_sign) {
    if (sign == 1 || sign == -1) continue;
    return fail(code, ext + "rotation_sign",
                "a sign is " + std::to_string(sign) + ", 1 or -1 was expected");
  }
  if (s.ext.face_winding_order > 1) {
    return unknown(ext + "face_winding_order", s.ext.face_winding_order);
  }
  if (s.translation_unit > 1) return unknown(descriptor + "translation_unit", s.translation_unit);
  if (s.rotation_unit > 1) return unknown(descriptor + "rotation_unit", s.rotation_unit);
  return ok();
}

// ---- vectors

// The matrix C: component i of the source becomes component to[i], times sign[i].
struct Basis {
  std::array<std::size_t, 3> to{0, 1, 2};
  Vec3 sign{1, 1, 1};
  double determinant = 1;

  bool keeps_places() const { return to == std::array<std::size_t, 3>{0, 1, 2}; }
  bool identity() const { return keeps_places() && sign == Vec3{1, 1, 1}; }
  Vec3 operator()(const Vec3& v) const {
    Vec3 out{};
    for (std::size_t i = 0; i < 3; ++i) out[to[i]] = sign[i] * v[i];
    return out;
  }
};

// In: axes that span space.
Basis basis_between(const CoordinateSystem& source, const CoordinateSystem& target) {
  constexpr std::array<double, 6> kSign{-1, 1, 1, -1, 1, -1};  // of left right up down front back
  const std::array<std::uint16_t, 3> from{source.x_axis, source.y_axis, source.z_axis};
  const std::array<std::uint16_t, 3> into{target.x_axis, target.y_axis, target.z_axis};
  Basis b;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      if (from[i] / 2 != into[j] / 2) continue;
      b.to[i] = j;
      b.sign[i] = kSign[from[i]] * kSign[into[j]];
    }
  }
  const bool cyclic = b.to[1] == (b.to[0] + 1) % 3;
  b.determinant = (cyclic ? 1.0 : -1.0) * b.sign[0] * b.sign[1] * b.sign[2];
  return b;
}

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

// ---- rotations

constexpr double kDegree = std::numbers::pi / 180;

// The order in which the angles' rotations are applied.
std::array<std::size_t, 3> axis_order(std::uint32_t sequence) {
  constexpr std::array<std::array<std::size_t, 3>, 6> kOrders{
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  return kOrders[sequence];
}

// R times the rotation about one axis.
void rotate(Matrix& r, std::size_t axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  for (Vec3& row : r) {
    const double a = row[u], b = row[v];
    row[u] = a * c - b * s;
    row[v] = a * s + b * c;
  }
}

// The angles of R = Ri Rj Rk. The middle one comes from both its sine and its cosine: asin alone
// would lose half of the digits near the pole.
Vec3 angles_of(const Matrix& r, const std::array<std::size_t, 3>& order) {
  const auto [i, j, k] = order;
  const double parity = j == (i + 1) % 3 ? 1.0 : -1.0;
  const double cosine = std::hypot(r[i][i], r[i][j]);
  Vec3 out{};
  out[j] = std::atan2(-parity * r[i][k], cosine);
  // Below this the outer angles are noise (1e-16 / 1e-9 is a float's rounding); only their sum or
  // difference is known, and the first gets it.
  if (cosine < 1e-9) {
    out[i] = std::atan2(-parity * r[k][j], r[j][j]);
  } else {
    out[i] = std::atan2(parity * r[j][k], r[k][k]);
    out[k] = std::atan2(parity * r[i][j], r[i][i]);
  }
  // What cos(90 degrees) in double leaves of a zero; a row of a matrix would live on by it.
  for (double& angle : out) {
    if (std::abs(angle) < 1e-14) angle = 0;
  }
  return out;
}

// Stored angles to stored angles.
class Rotation {
 public:
  Rotation(const System& source, const System& target, const Basis& basis)
      : basis_(basis),
        from_(axis_order(source.ext.rotation_sequence)),
        into_(axis_order(target.ext.rotation_sequence)) {
    const double in = source.rotation_unit == 0 ? kDegree : 1.0;
    const double out = target.rotation_unit == 0 ? kDegree : 1.0;
    if (in != out) unit_ = in / out;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = basis.to[i];
      same_order_ = same_order_ && basis.to[from_[i]] == into_[i];
      to_radians_[i] = in * source.ext.rotation_sign[i];
      from_radians_[j] = target.ext.rotation_sign[j] / out;
      per_axis_[i] = basis.determinant * basis.sign[i] * source.ext.rotation_sign[i] *
                     target.ext.rotation_sign[j] * unit_;
    }
  }

  /// Angles change places, signs and unit, but do not mix.
  bool same_order() const { return same_order_; }
  bool identity() const {
    return same_order_ && basis_.keeps_places() && per_axis_ == Vec3{1, 1, 1};
  }
  double unit() const { return unit_; }
  const Vec3& per_axis() const { return per_axis_; }

  Vec3 operator()(const Vec3& stored) const {
    Vec3 out{};
    if (same_order_ || std::ranges::count(stored, 0.0) >= 2) {
      for (std::size_t i = 0; i < 3; ++i) out[basis_.to[i]] = per_axis_[i] * stored[i];
      return out;
    }
    Matrix r{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, converted{};
    for (const std::size_t axis : from_) rotate(r, axis, to_radians_[axis] * stored[axis]);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        converted[basis_.to[i]][basis_.to[j]] = basis_.sign[i] * basis_.sign[j] * r[i][j];
      }
    }
    out = angles_of(converted, into_);
    for (std::size_t i = 0; i < 3; ++i) out[i] *= from_radians_[i];
    return out;
  }

 private:
  Basis basis_;
  std::array<std::size_t, 3> from_, into_;
  bool same_order_ = true;
  double unit_ = 1;
  Vec3 to_radians_{}, from_radians_{}, per_axis_{};
};

struct Conversion {
  Conversion(const System& source, const System& target)
      : basis(basis_between(source.axes, target.axes)), rotation(source, target, basis) {
    if (source.translation_unit != target.translation_unit) {
      unit = target.translation_unit == 0 ? 100.0 : 0.01;
    }
    const bool flipped = basis.determinant < 0;
    const bool changed = source.ext.face_winding_order != target.ext.face_winding_order;
    reverse_faces = flipped != changed;
  }

  bool keeps_positions() const { return basis.identity() && unit == 1; }
  Vec3 position(const Vec3& v) const {
    Vec3 out = basis(v);
    for (double& c : out) c *= unit;
    return out;
  }
  // Scale deltas change places only: growing along an axis is growing along its opposite.
  Vec3 scale(const Vec3& v) const {
    Vec3 out{};
    for (std::size_t i = 0; i < 3; ++i) out[basis.to[i]] = v[i];
    return out;
  }

  Basis basis;
  double unit = 1;
  Rotation rotation;
  bool reverse_faces = false;
};

// ---- definition and geometry

void convert_definition(const Conversion& c, Definition& d) {
  const auto position = [&](const Vec3& v) { return c.position(v); };
  if (!c.keeps_positions()) {
    d.neutral_joint_translations = mapped(d.neutral_joint_translations, position);
  }
  if (!c.rotation.identity()) {
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
  if (c.reverse_faces) reverse_faces(m);
  if (!c.basis.identity()) m.normals = mapped(m.normals, c.basis);
  if (c.keeps_positions()) return;
  m.positions = mapped(m.positions, position);
  for (BlendShapeTarget& target : m.blend_shape_targets) {
    target.deltas = mapped(target.deltas, position);
  }
}

// ---- joint groups

constexpr std::size_t kAttributes = 9;  // tx ty tz rx ry rz sx sy sz

// The rows of a group by joint, in the order in which the joints first appear.
struct RowsByJoint {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct Block {
    std::size_t joint = 0;
    std::array<std::size_t, kAttributes> rows{};
  };
  std::vector<Block> blocks;
  std::vector<std::size_t> joints_before;  // [rows + 1] how many blocks the rows before it touch
};

// Rows that no LOD uses are left out: in a block they would come alive.
std::size_t used_rows(const JointGroup& g) {
  if (g.lods.empty()) return g.output_indices.size();
  return std::min<std::size_t>(*std::ranges::max_element(g.lods), g.output_indices.size());
}

RowsByJoint rows_by_joint(const JointGroup& g, std::size_t joint_count) {
  RowsByJoint out;
  std::vector<std::size_t> block_of(joint_count, RowsByJoint::kNone);
  const std::size_t rows = used_rows(g);
  out.joints_before.push_back(0);
  for (std::size_t r = 0; r < rows; ++r) {
    const std::size_t joint = g.output_indices[r] / kAttributes;
    if (block_of[joint] == RowsByJoint::kNone) {
      block_of[joint] = out.blocks.size();
      out.blocks.push_back({joint, {}});
      out.blocks.back().rows.fill(RowsByJoint::kNone);
    }
    // Of two rows with one output the last wins, as in the evaluation.
    out.blocks[block_of[joint]].rows[g.output_indices[r] % kAttributes] = r;
    out.joints_before.push_back(out.blocks.size());
  }
  return out;
}

// One joint's block, [9, columns].
void convert_block(const Conversion& c, const JointGroup& g, const RowsByJoint::Block& block,
                   std::vector<float>& out) {
  const std::size_t columns = g.input_indices.size();
  for (std::size_t col = 0; col < columns; ++col) {
    std::array<Vec3, 3> pose{};  // translation, rotation, scale
    for (std::size_t a = 0; a < kAttributes; ++a) {
      const std::size_t row = block.rows[a];
      if (row != RowsByJoint::kNone) pose[a / 3][a % 3] = g.values[row * columns + col];
    }
    pose = {c.position(pose[0]), c.rotation(pose[1]), c.scale(pose[2])};
    for (std::size_t a = 0; a < kAttributes; ++a) {
      out[a * columns + col] = rounded(pose[a / 3][a % 3]);
    }
  }
}

void drop_zero_columns(std::vector<std::uint16_t>& inputs, std::vector<float>& values) {
  const std::size_t columns = inputs.size();
  std::vector<bool> used(columns, false);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != 0) used[i % columns] = true;
  }
  if (std::ranges::find(used, false) == used.end()) return;
  std::size_t kept_inputs = 0, kept_values = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (used[i % columns]) values[kept_values++] = values[i];
  }
  for (std::size_t col = 0; col < columns; ++col) {
    if (used[col]) inputs[kept_inputs++] = inputs[col];
  }
  values.resize(kept_values);
  inputs.resize(kept_inputs);
}

void regroup(const Conversion& c, std::size_t joint_count, JointGroup& g) {
  const RowsByJoint by_joint = rows_by_joint(g, joint_count);
  const std::size_t columns = g.input_indices.size();
  std::vector<float> block(kAttributes * columns), values;
  std::vector<std::uint16_t> inputs(g.input_indices.begin(), g.input_indices.end());
  std::vector<std::uint16_t> outputs, lods, rows_of_joints{0};
  for (const RowsByJoint::Block& b : by_joint.blocks) {
    convert_block(c, g, b, block);
    for (std::size_t a = 0; a < kAttributes; ++a) {
      const float* row = block.data() + a * columns;
      if (std::all_of(row, row + columns, [](float v) { return v == 0; })) continue;
      outputs.push_back(static_cast<std::uint16_t>(b.joint * kAttributes + a));
      values.insert(values.end(), row, row + columns);
    }
    rows_of_joints.push_back(static_cast<std::uint16_t>(outputs.size()));
  }
  for (const std::uint16_t rows : g.lods) {
    lods.push_back(rows_of_joints[by_joint.joints_before[rows]]);
  }
  drop_zero_columns(inputs, values);
  g.lods = std::move(lods);
  g.input_indices = std::move(inputs);
  g.output_indices = std::move(outputs);
  g.values = std::move(values);
}

// No value changes its row: the rows stay where they are.
void scale_rows(const Conversion& c, JointGroup& g) {
  const std::size_t columns = g.input_indices.size();
  std::vector<float> values(g.values.begin(), g.values.end());
  for (std::size_t r = 0; r < g.output_indices.size(); ++r) {
    const std::size_t attribute = g.output_indices[r] % kAttributes, axis = attribute % 3;
    double factor = 1;
    if (attribute < 3) factor = c.basis.sign[axis] * c.unit;
    if (attribute / 3 == 1) factor = c.rotation.per_axis()[axis];
    if (factor == 1) continue;
    for (std::size_t i = r * columns; i < (r + 1) * columns; ++i) {
      values[i] = rounded(factor * values[i]);
    }
  }
  g.values = std::move(values);
}

// A joint's rotation can only be converted as a whole.
void warn_of_split_rotations(const Behavior& b, std::size_t joint_count,
                             std::vector<Warning>& warnings) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> group_of(joint_count, kNone);
  for (std::size_t i = 0; i < b.joint_groups.size(); ++i) {
    for (const std::uint16_t output : b.joint_groups[i].output_indices) {
      const std::size_t joint = output / kAttributes;
      if (output % kAttributes / 3 != 1) continue;
      if (group_of[joint] == kNone) group_of[joint] = i;
      if (group_of[joint] == i) continue;
      warnings.push_back({item("behavior.joint_groups", i) + ".output_indices",
                          "group " + std::to_string(group_of[joint]) + " rotates joint " +
                              std::to_string(joint) +
                              " as well: each part was converted as a rotation of its own"});
      return;
    }
  }
}

void convert_joint_groups(const Conversion& c, std::size_t joint_count, Behavior& b,
                          std::vector<Warning>& warnings) {
  if (c.keeps_positions() && c.rotation.identity()) return;
  if (!c.rotation.same_order()) warn_of_split_rotations(b, joint_count, warnings);
  const bool in_place = c.basis.keeps_places() && c.rotation.same_order();
  for (JointGroup& g : b.joint_groups) {
    if (in_place) {
      scale_rows(c, g);
    } else {
      regroup(c, joint_count, g);
    }
  }
}

// ---- RBF solvers

// Whether the inputs of a solver are quaternions. All distances but the Euclidean one say so; there
// the names do, as everywhere in the format.
bool takes_quaternions(const RbfSolver& s, const std::vector<std::string>& raw_control_names) {
  if (s.raw_control_indices.size() % 4 != 0) return false;
  if (s.distance_method != 0) return true;
  for (std::size_t i = 3; i < s.raw_control_indices.size(); i += 4) {
    const std::size_t control = s.raw_control_indices[i];
    if (control >= raw_control_names.size()) return false;
    const std::string& name = raw_control_names[control];
    if (!name.ends_with(".w") && !name.ends_with(".qw")) return false;
  }
  return true;
}

// The axis of a quaternion turns with the basis, and a mirrored basis turns the other way.
Array<float> converted_quaternions(const Basis& basis, const Array<float>& values) {
  std::vector<float> out(values.begin(), values.end());
  for (std::size_t i = 0; i + 3 < out.size(); i += 4) {
    const Vec3 axis = basis({out[i], out[i + 1], out[i + 2]});
    for (std::size_t p = 0; p < 3; ++p) out[i + p] = rounded(basis.determinant * axis[p]);
  }
  return out;
}

void convert_rbf(const Conversion& c, Dna& dna, std::vector<Warning>& warnings) {
  enum : std::uint16_t { kSwingAngle = 2, kTwistAngle = 3 };
  bool warned = false;
  for (std::size_t i = 0; i < dna.rbf_behavior.solvers.size(); ++i) {
    RbfSolver& s = dna.rbf_behavior.solvers[i];
    // The evaluation reads the radius in the rotation unit, whatever the distance.
    if (c.rotation.unit() != 1) s.radius = rounded(c.rotation.unit() * s.radius);
    if (c.basis.identity() || !takes_quaternions(s, dna.definition.raw_control_names)) continue;
    s.raw_control_values = converted_quaternions(c.basis, s.raw_control_values);
    const bool has_axis = s.distance_method == kSwingAngle || s.distance_method == kTwistAngle;
    if (warned || !has_axis || s.twist_axis > 2 || c.basis.to[s.twist_axis] == s.twist_axis) {
      continue;
    }
    warnings.push_back({item("rbf_behavior.solvers", i) + ".twist_axis",
                        "twist axes are not converted, as in the reference"});
    warned = true;
  }
}

// ---- what cannot be converted

void warn_of_networks(const Conversion& c, const MlJoints& joints, std::vector<Warning>& warnings) {
  const std::string where = "machine_learned_behavior_ext.joints";
  const std::uint16_t stride = ml_joint_stride(joints);
  bool translations = false, angles = false, rotations = false;
  for (const std::uint16_t output : joints.output_indices) {
    const std::size_t attribute = output % stride;
    translations = translations || attribute < 3;
    rotations = rotations || (attribute >= 3 && attribute < stride - 3u);
  }
  angles = rotations && stride == kAttributes;
  if ((c.unit != 1 && translations) || (c.rotation.unit() != 1 && angles)) {
    warnings.push_back({where, "networks move joints in the old unit: not converted"});
  }
  std::array<bool, 10> keys{};
  for (const std::uint16_t key : joints.parameter_keys) {
    if (key < keys.size()) keys[key] = true;
  }
  const bool has_system = std::all_of(keys.begin() + 3, keys.end(), [](bool k) { return k; });
  const bool moves = !c.basis.identity() && (translations || rotations);
  if (!has_system && (moves || (angles && !c.rotation.identity()))) {
    warnings.push_back({where + ".parameter_keys",
                        "networks move joints in axes that the file does not name: not converted"});
  }
}

void warn_of_setups(const Conversion& c, const Dna& dna, std::vector<Warning>& warnings) {
  const TwistSwingBehavior& b = dna.twist_swing_behavior;
  const auto moved = [&](const TwistSwingSetup& s) {
    return s.twist_axis < 3 && c.basis.to[s.twist_axis] != s.twist_axis;
  };
  const std::string message = "twist axes are not converted, as in the reference";
  if (std::ranges::any_of(b.twists, moved)) {
    warnings.push_back({"twist_swing_behavior.twists", message});
  }
  if (std::ranges::any_of(b.swings, moved)) {
    warnings.push_back({"twist_swing_behavior.swings", message});
  }
}

void warn_of_unknown_layers(const Dna& dna, std::vector<Warning>& warnings) {
  for (const UnknownLayer& layer : dna.unknown_layers) {
    warnings.push_back({"unknown_layers", "layer " + std::string(layer.id.data(), layer.id.size()) +
                                              " is not known: kept as it is"});
  }
}

void set_system(const System& target, Dna& dna) {
  // Only 2.8 has room for all of dsce.
  if (dna.descriptor_ext != target.ext && dna.version < 8) dna.version = 8;
  dna.descriptor.coordinate_system = target.axes;
  dna.descriptor.translation_unit = target.translation_unit;
  dna.descriptor.rotation_unit = target.rotation_unit;
  dna.descriptor_ext = target.ext;
}

}  // namespace

core::Result<Dna> convert_coordinates(const Dna& dna, const CoordinateTarget& target,
                                      std::vector<Warning>& warnings) {
  std::vector<Warning> unused;
  if (Status valid = validate(dna, unused); !valid) return std::move(valid).propagate();
  const System source = system_of(dna), wanted = system_of(target, source);
  if (Status good = check_system(source, ErrorCode::kInvalidValue, "descriptor.", "descriptor_ext.",
                                 "coordinate_system");
      !good) {
    return std::move(good).propagate();
  }
  if (Status good = check_system(wanted, ErrorCode::kInvalidArgument, "", "", "axes"); !good) {
    return std::move(good).propagate();
  }
  const Conversion c(source, wanted);
  Dna out = dna;
  convert_definition(c, out.definition);
  convert_joint_groups(c, out.definition.joint_names.size(), out.behavior, warnings);
  for (Mesh& mesh : out.geometry.meshes) convert_mesh(c, mesh);
  convert_rbf(c, out, warnings);
  warn_of_networks(c, out.machine_learned_behavior_ext.joints, warnings);
  warn_of_setups(c, out, warnings);
  if (!c.keeps_positions() || !c.rotation.identity()) warn_of_unknown_layers(out, warnings);
  set_system(wanted, out);
  return out;
}

}  // namespace risorius::dna
