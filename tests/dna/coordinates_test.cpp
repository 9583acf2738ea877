// SPDX-License-Identifier: MIT
// Compares conversions with matrix products computed here: a row vector v goes to v C, a matrix R
// to transpose(C) R C, with C = (axes of the source) * transpose(axes of the target).
#include "dna/convert/coordinates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>

#include "dna/file/parse.h"
#include "dna/file/write.h"
#include "dna/validate.h"
#include "support/stride.h"

namespace risorius::dna {
namespace {

using Row = std::array<double, 3>;
using Matrix = std::array<Row, 3>;
using Sign = std::array<std::int32_t, 3>;
constexpr double kEps = std::numeric_limits<float>::epsilon();
constexpr Matrix kIdentity{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
constexpr std::array<const char*, 6> kSequences{"xyz", "xzy", "yxz", "yzx", "zxy", "zyx"};

// ---- an independent computation

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) out[i][j] += a[i][k] * b[k][j];
    }
  }
  return out;
}

Matrix transpose(const Matrix& m) {
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[i][j] = m[j][i];
  }
  return out;
}

Row product(const Row& v, const Matrix& m) { return product(Matrix{v, Row{}, Row{}}, m)[0]; }

double determinant(const Matrix& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

Row direction(std::uint16_t axis) {
  constexpr std::array<Row, 6> kDirections{
      {{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  return kDirections[axis];
}

Matrix axes_of(const CoordinateSystem& s) {
  return {direction(s.x_axis), direction(s.y_axis), direction(s.z_axis)};
}

Matrix about(char axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  if (axis == 'x') return {{{1, 0, 0}, {0, c, s}, {0, -s, c}}};
  if (axis == 'y') return {{{c, 0, -s}, {0, 1, 0}, {s, 0, c}}};
  return {{{c, s, 0}, {-s, c, 0}, {0, 0, 1}}};
}

Matrix rotation_of(const Dna& dna, const Row& angles) {
  const double unit = dna.descriptor.rotation_unit == 0 ? std::numbers::pi / 180 : 1.0;
  Matrix out = kIdentity;
  for (const char axis : std::string(kSequences[dna.descriptor_ext.rotation_sequence])) {
    const auto i = static_cast<std::size_t>(axis - 'x');
    out = product(out, about(axis, angles[i] * dna.descriptor_ext.rotation_sign[i] * unit));
  }
  return out;
}

struct Change {
  Change(const Dna& from, const Dna& to)
      : c(product(axes_of(from.descriptor.coordinate_system),
                  transpose(axes_of(to.descriptor.coordinate_system)))) {
    constexpr std::array<double, 2> kCentimetres{1, 100};
    unit = kCentimetres[from.descriptor.translation_unit] /
           kCentimetres[to.descriptor.translation_unit];
  }
  Matrix rotation(const Matrix& r) const { return product(transpose(c), product(r, c)); }
  Matrix c;
  double unit = 1;
};

Row at(const Vec3Array& v, std::size_t i) { return {v.at(i, 0), v.at(i, 1), v.at(i, 2)}; }

void expect_vectors(const Vec3Array& before, const Vec3Array& after, const Matrix& c, double unit) {
  ASSERT_EQ(before.count(), after.count());
  for (std::size_t i = 0; i < before.count(); ++i) {
    const Row expected = product(at(before, i), c);
    for (std::size_t p = 0; p < 3; ++p) {
      EXPECT_NEAR(after.at(i, p), expected[p] * unit, std::abs(expected[p]) * unit * kEps);
    }
  }
}

// Three angles of up to 180 degrees in float32 have together an error of less than 2 eps pi
// radians. The elements of the rotation matrices may differ by 8 eps, which is more than this.
void expect_rotation(const Dna& from, const Row& before, const Dna& to, const Row& after) {
  const Matrix expected = Change(from, to).rotation(rotation_of(from, before));
  const Matrix result = rotation_of(to, after);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(result[i][j], expected[i][j], 8 * kEps);
  }
}

// ---- rigs

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }
  float number(double size) {
    return static_cast<float>((static_cast<double>(engine_()) / 4294967296.0 * 2 - 1) * size);
  }
  std::vector<float> numbers(std::size_t n, double size) {
    std::vector<float> out(n);
    for (float& v : out) v = number(size);
    return out;
  }

 private:
  std::mt19937 engine_;
};

std::vector<CoordinateSystem> all_axes() {
  std::vector<CoordinateSystem> out;
  for (std::uint16_t x = 0; x < 6; ++x) {
    for (std::uint16_t y = 0; y < 6; ++y) {
      for (std::uint16_t z = 0; z < 6; ++z) {
        if (x / 2 != y / 2 && y / 2 != z / 2 && x / 2 != z / 2) out.push_back({x, y, z});
      }
    }
  }
  return out;
}

Sign sign_number(std::size_t n) { return {n & 1 ? -1 : 1, n & 2 ? -1 : 1, n & 4 ? -1 : 1}; }

JointGroup make_group(std::vector<std::uint16_t> lods, std::vector<std::uint16_t> outputs,
                      std::vector<float> values) {
  JointGroup g;
  const std::size_t columns = outputs.empty() ? 0 : values.size() / outputs.size();
  std::vector<std::uint16_t> inputs(columns);
  for (std::size_t i = 0; i < columns; ++i) inputs[i] = static_cast<std::uint16_t>(i);
  g.lods = std::move(lods);
  g.input_indices = std::move(inputs);
  g.output_indices = std::move(outputs);
  g.values = std::move(values);
  return g;
}

// A rig whose joints have neutral transforms of 0, with controls raw0, raw1 and so on.
Dna bare_rig(std::size_t joints, std::size_t raw = 2) {
  Dna dna;
  dna.descriptor.lod_count = 1;
  for (std::size_t i = 0; i < raw; ++i) {
    dna.definition.raw_control_names.push_back("raw" + std::to_string(i));
  }
  dna.definition.joint_names.resize(joints);
  dna.definition.joint_parents = std::vector<std::uint16_t>(joints, 0);
  dna.definition.neutral_joint_translations.values = std::vector<float>(joints * 3);
  dna.definition.neutral_joint_rotations.values = std::vector<float>(joints * 3);
  return dna;
}

Mesh small_mesh(Random& random) {
  Mesh m;
  m.positions.values = random.numbers(4 * 3, 200);
  m.normals.values = random.numbers(4 * 3, 1);
  m.texture_coordinates.values = random.numbers(4 * 2, 1);
  m.layout_positions = {0, 1, 2, 3, 3};
  m.layout_texture_coordinates = {3, 2, 1, 0, 0};
  m.layout_normals = {1, 2, 3, 0, 1};
  m.face_offsets = {0, 3, 7};
  m.face_layouts = {0, 1, 2, 4, 3, 2, 1};
  BlendShapeTarget target;
  target.deltas.values = random.numbers(2 * 3, 5);
  target.vertex_indices = {1, 3};
  m.blend_shape_targets = std::vector<BlendShapeTarget>{target};
  return m;
}

Dna random_rig(Random& random) {
  Dna dna = bare_rig(3);
  dna.definition.neutral_joint_translations.values = random.numbers(9, 50);
  dna.definition.neutral_joint_rotations.values = random.numbers(9, 3);
  dna.descriptor.rotation_unit = 1;
  dna.descriptor.coordinate_system = all_axes()[random.below(48)];
  dna.descriptor_ext = {random.below(6), sign_number(random.below(8)), 0};
  dna.definition.mesh_names = {"mesh"};
  dna.definition.blend_shape_channel_names = {"channel"};
  dna.geometry.meshes = std::vector<Mesh>{small_mesh(random)};
  std::vector<std::uint16_t> outputs{16, 13, 9, 12, 17, 10, 14, 11, 15, 26, 22};
  const auto rows = static_cast<std::uint16_t>(outputs.size());
  std::vector<float> values = random.numbers(outputs.size() * 2, 1.5);
  dna.behavior.joint_groups = std::vector<JointGroup>{make_group({rows}, outputs, values)};
  return dna;
}

CoordinateTarget target_of(const CoordinateSystem& axes, std::uint32_t sequence, const Sign& sign) {
  CoordinateTarget t;
  t.axes = axes;
  t.rotation_sequence = sequence;
  t.rotation_signs = sign;
  return t;
}

CoordinateTarget system_of(const Dna& dna) {
  CoordinateTarget t =
      target_of(dna.descriptor.coordinate_system, dna.descriptor_ext.rotation_sequence,
                dna.descriptor_ext.rotation_sign);
  t.face_winding_order = dna.descriptor_ext.face_winding_order;
  t.translation_unit = dna.descriptor.translation_unit;
  t.rotation_unit = dna.descriptor.rotation_unit;
  return t;
}

Dna converted(const Dna& dna, const CoordinateTarget& target,
              std::vector<Warning>* warnings = nullptr) {
  std::vector<Warning> unused;
  core::Result<Dna> out = convert_coordinates(dna, target, warnings ? *warnings : unused);
  EXPECT_TRUE(out.has_value()) << out.error().describe();
  return out ? std::move(out).value() : Dna{};
}

std::vector<std::uint8_t> bytes_of(const Dna& dna) {
  std::vector<Warning> warnings;
  auto bytes = write(dna, {}, warnings);
  EXPECT_TRUE(bytes.has_value());
  return bytes ? *bytes : std::vector<std::uint8_t>{};
}

// The nine attributes of a joint in one column of a joint group; 0 if the group has no row for one.
std::array<double, 9> column_of(const JointGroup& g, std::size_t joint, std::size_t column) {
  std::array<double, 9> out{};
  const std::size_t columns = g.input_indices.size();
  for (std::size_t r = 0; r < g.output_indices.size(); ++r) {
    if (g.output_indices[r] / 9u == joint)
      out[g.output_indices[r] % 9u] = g.values[r * columns + column];
  }
  return out;
}

void expect_group(const Dna& from, const Dna& to) {
  const Change change(from, to);
  for (std::size_t joint = 0; joint < 3; ++joint) {
    for (std::size_t column = 0; column < 2; ++column) {
      const auto a = column_of(from.behavior.joint_groups[0], joint, column);
      const auto b = column_of(to.behavior.joint_groups[0], joint, column);
      const Row translation = product(Row{a[0], a[1], a[2]}, change.c);
      const Row scale = product(Row{a[6], a[7], a[8]}, change.c);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(b[i], translation[i] * change.unit, 200 * kEps);
        EXPECT_EQ(std::abs(b[6 + i]), std::abs(scale[i]));
      }
      // The three scale deltas of the source occur once each in the result, and keep their signs.
      EXPECT_TRUE(std::is_permutation(a.begin() + 6, a.end(), b.begin() + 6));
      expect_rotation(from, {a[3], a[4], a[5]}, to, {b[3], b[4], b[5]});
    }
  }
}

// ---- tests

TEST(DnaCoordinates, EveryTargetMatchesMatrices) {
  Random random(1);
  for (const CoordinateSystem& axes : all_axes()) {
    for (std::uint32_t sequence = 0; sequence < 6; ++sequence) {
      for (std::size_t sign = 0; sign < 8; ++sign) {
        const Dna from = random_rig(random);
        CoordinateTarget target = target_of(axes, sequence, sign_number(sign));
        target.translation_unit = static_cast<std::uint16_t>(random.below(2));
        const Dna to = converted(from, target);
        const Change change(from, to);
        expect_vectors(from.definition.neutral_joint_translations,
                       to.definition.neutral_joint_translations, change.c, change.unit);
        for (std::size_t j = 0; j < 3; ++j) {
          expect_rotation(from, at(from.definition.neutral_joint_rotations, j), to,
                          at(to.definition.neutral_joint_rotations, j));
        }
        const Mesh &a = from.geometry.meshes[0], &b = to.geometry.meshes[0];
        expect_vectors(a.positions, b.positions, change.c, change.unit);
        expect_vectors(a.normals, b.normals, change.c, 1);
        expect_vectors(a.blend_shape_targets[0].deltas, b.blend_shape_targets[0].deltas, change.c,
                       change.unit);
        expect_group(from, to);
        EXPECT_EQ(a.face_layouts == b.face_layouts, determinant(change.c) > 0);
        ASSERT_FALSE(HasFailure()) << "axes " << axes.x_axis << axes.y_axis << axes.z_axis << " "
                                   << kSequences[sequence] << " signs " << sign;
      }
    }
  }
}

TEST(DnaCoordinates, AScaleDeltaKeepsItsSignInAMirror) {
  Dna dna = bare_rig(1, 1);
  dna.behavior.joint_groups =
      std::vector<JointGroup>{make_group({3}, {6, 7, 8}, {-0.25f, 0.5f, -0.125f})};
  const Dna out = converted(dna, target_of({5, 0, 2}, 0, {1, 1, 1}));  // back left up
  const JointGroup& g = out.behavior.joint_groups[0];
  EXPECT_EQ(g.output_indices, (Array<std::uint16_t>{7, 8, 6}));  // of x (right), y (up), z (front)
  EXPECT_EQ(g.values, (Array<float>{-0.25f, 0.5f, -0.125f}));
}

TEST(DnaCoordinates, ItsOwnSystemChangesNoBit) {
  Random random(2);
  Dna dna = random_rig(random);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  dna.definition.neutral_joint_translations.values =
      std::vector<float>{-0.0f, nan, 1e-45f, 0, 0, 0, 1, 2, 3};
  dna.version = 2;
  for (const CoordinateTarget& target : {system_of(dna), CoordinateTarget{}}) {
    const Dna same = converted(dna, target);
    EXPECT_EQ(bytes_of(same), bytes_of(dna));
    EXPECT_EQ(same.version, 2);
  }
}

TEST(DnaCoordinates, PlacesAndSignsComeBackExactly) {
  Random random(3);
  for (int n = 0; n < 300; ++n) {
    const Dna dna = random_rig(random);
    const CoordinateSystem axes = all_axes()[random.below(48)];
    for (std::uint32_t sequence = 0; sequence < 6; ++sequence) {
      std::vector<Warning> warnings;
      const Dna there = converted(dna, target_of(axes, sequence, {1, -1, 1}), &warnings);
      if (!warnings.empty()) continue;  // the next test covers mixed angles
      const Dna back = converted(there, system_of(dna));
      EXPECT_EQ(back.definition, dna.definition);
      EXPECT_EQ(back.geometry, dna.geometry);
      EXPECT_EQ(back.behavior, dna.behavior);
    }
  }
}

// Rotations are converted there and back. The result may only differ by the rounding errors of two
// conversions.
TEST(DnaCoordinates, MixedRotationsComeBackAsRotations) {
  Random random(4);
  for (int n = 0; n < 500; ++n) {
    const Dna dna = random_rig(random);
    const Dna there = converted(dna, target_of(all_axes()[random.below(48)], random.below(6),
                                               sign_number(random.below(8))));
    const Dna back = converted(there, system_of(dna));
    for (std::size_t j = 0; j < 3; ++j) {
      expect_rotation(dna, at(dna.definition.neutral_joint_rotations, j), back,
                      at(back.definition.neutral_joint_rotations, j));
    }
    EXPECT_EQ(back.definition.neutral_joint_translations,
              dna.definition.neutral_joint_translations);
  }
}

TEST(DnaCoordinates, PolesKeepTheRotation) {
  Random random(5);
  const float quarter = static_cast<float>(std::numbers::pi / 2);
  for (const std::uint16_t unit : {std::uint16_t{0}, std::uint16_t{1}}) {
    for (std::uint32_t from = 0; from < 6; ++from) {
      for (std::uint32_t into = 0; into < 6; ++into) {
        for (const float offset : {0.0f, 1e-7f, 1e-6f, 1e-4f, -1e-7f, -1e-5f}) {
          Dna dna = bare_rig(1);
          const float size = unit == 0 ? 90.0f : quarter;
          const float middle = (random.below(2) != 0 ? size : -size) + offset;
          dna.definition.neutral_joint_rotations.values =
              std::vector<float>{random.number(size), middle, random.number(size)};
          dna.descriptor.rotation_unit = unit;
          dna.descriptor_ext.rotation_sequence = from;
          const Dna to = converted(dna, target_of(all_axes()[random.below(48)], into, {1, 1, 1}));
          expect_rotation(dna, at(dna.definition.neutral_joint_rotations, 0), to,
                          at(to.definition.neutral_joint_rotations, 0));
          const Dna back = converted(to, system_of(dna));  // the target's gimbal lock this time
          expect_rotation(dna, at(dna.definition.neutral_joint_rotations, 0), back,
                          at(back.definition.neutral_joint_rotations, 0));
        }
      }
    }
  }
}

TEST(DnaCoordinates, AtThePoleTheLastAngleIsZero) {
  Dna dna = bare_rig(1);
  dna.descriptor_ext.rotation_sequence = 2;  // yxz: a turn about x by 30 and z by 90 degrees ...
  dna.definition.neutral_joint_rotations.values = std::vector<float>{30, 0, 90};
  CoordinateTarget target;
  target.rotation_sequence = 1;  // ... is in gimbal lock in xzy
  const Dna out = converted(dna, target);
  EXPECT_EQ(out.definition.neutral_joint_rotations.values[1], 0);
  EXPECT_FLOAT_EQ(out.definition.neutral_joint_rotations.values[2], 90);
  EXPECT_FLOAT_EQ(out.definition.neutral_joint_rotations.values[0], 30);
}

TEST(DnaCoordinates, FacesReverseOnceForMirrorOrWinding) {
  Random random(6);
  Dna dna = random_rig(random);
  dna.descriptor.coordinate_system = {1, 2, 4};
  const Array<std::uint32_t> reversed{2, 1, 0, 1, 2, 3, 4}, kept{0, 1, 2, 4, 3, 2, 1};
  const CoordinateSystem mirror{0, 2, 4}, turned{4, 1, 2};
  for (const auto& [axes, winding, expected] : {std::tuple{mirror, 0, reversed},
                                                {mirror, 1, kept},
                                                {turned, 0, kept},
                                                {turned, 1, reversed}}) {
    CoordinateTarget target;
    target.axes = axes;
    target.face_winding_order = static_cast<std::uint8_t>(winding);
    const Mesh mesh = converted(dna, target).geometry.meshes[0];
    EXPECT_EQ(mesh.face_layouts, expected);
    EXPECT_EQ(mesh.face_offsets, dna.geometry.meshes[0].face_offsets);
    EXPECT_EQ(mesh.layout_positions, dna.geometry.meshes[0].layout_positions);
    EXPECT_EQ(mesh.layout_normals, dna.geometry.meshes[0].layout_normals);
    EXPECT_EQ(mesh.texture_coordinates, dna.geometry.meshes[0].texture_coordinates);
  }
}

TEST(DnaCoordinates, UnitsReachEverythingThatHasOne) {
  Dna dna = bare_rig(1, 1);
  Random random(7);
  dna.definition.mesh_names = {"mesh"};
  dna.definition.blend_shape_channel_names = {"channel"};
  dna.geometry.meshes = std::vector<Mesh>{small_mesh(random)};
  dna.geometry.meshes[0].positions.values = std::vector<float>(12, 250);
  dna.geometry.meshes[0].blend_shape_targets[0].deltas.values = std::vector<float>(6, -2);
  dna.definition.neutral_joint_translations.values = std::vector<float>{100, 200, 300};
  dna.definition.neutral_joint_rotations.values = std::vector<float>{180, 90, -45};
  dna.behavior.joint_groups = std::vector<JointGroup>{make_group({3}, {1, 5, 6}, {50, 90, 0.5f})};
  dna.rbf_behavior.solvers = std::vector<RbfSolver>(1);
  dna.rbf_behavior.solvers[0].radius = 90;
  CoordinateTarget target;
  target.translation_unit = 1;
  target.rotation_unit = 1;
  const Dna out = converted(dna, target);
  const float quarter = static_cast<float>(std::numbers::pi / 2);
  EXPECT_EQ(out.definition.neutral_joint_translations.values, (Array<float>{1, 2, 3}));
  EXPECT_EQ(out.definition.neutral_joint_rotations.values,
            (Array<float>{2 * quarter, quarter, -quarter / 2}));
  EXPECT_EQ(out.behavior.joint_groups[0].values, (Array<float>{0.5f, quarter, 0.5f}));
  EXPECT_EQ(out.geometry.meshes[0].positions.values, Array<float>(std::vector<float>(12, 2.5f)));
  EXPECT_EQ(out.geometry.meshes[0].blend_shape_targets[0].deltas.values,
            Array<float>(std::vector<float>(6, -0.02f)));
  EXPECT_EQ(out.geometry.meshes[0].normals, dna.geometry.meshes[0].normals);
  EXPECT_EQ(out.rbf_behavior.solvers[0].radius, quarter);
  const Dna back = converted(out, system_of(dna));
  EXPECT_EQ(back.definition, dna.definition);
  EXPECT_EQ(back.behavior, dna.behavior);
  target.rotation_unit = std::nullopt;
  EXPECT_EQ(converted(dna, target).rbf_behavior, dna.rbf_behavior);
}

TEST(DnaCoordinates, ARowStaysInItsLods) {
  Dna dna = bare_rig(2);
  dna.descriptor.lod_count = 3;
  dna.behavior.joint_groups =
      std::vector<JointGroup>{make_group({4, 2, 0}, {3, 9, 1, 17}, {1, 2, 3, 4, 5, 6, 7, 8})};
  // The source has x right, y up, z front; the result has x front, y right, z up. So x becomes y, y
  // becomes z and z becomes x, and the rotation order xyz becomes yzx.
  const Dna out = converted(dna, target_of({4, 1, 2}, 3, {1, 1, 1}));
  const JointGroup& g = out.behavior.joint_groups[0];
  EXPECT_EQ(g.lods, (Array<std::uint16_t>{4, 2, 0}));
  EXPECT_EQ(g.output_indices, (Array<std::uint16_t>{4, 10, 2, 15}));
  EXPECT_EQ(g.values, dna.behavior.joint_groups[0].values);
}

TEST(DnaCoordinates, MixedRotationRowsComeWithTheFirstOfThem) {
  Dna dna = bare_rig(2, 1);
  dna.descriptor.lod_count = 3;
  // The rows are rx of joint 0, tx of joint 1, ry of joint 0 and ry of joint 1; no LOD uses the
  // last one.
  dna.behavior.joint_groups =
      std::vector<JointGroup>{make_group({3, 2, 0}, {3, 9, 4, 13}, {40, 2, 30, 9})};
  std::vector<Warning> warnings;
  CoordinateTarget target;
  target.rotation_sequence = 5;
  const Dna out = converted(dna, target, &warnings);
  const JointGroup& g = out.behavior.joint_groups[0];
  EXPECT_EQ(g.output_indices, (Array<std::uint16_t>{3, 4, 5, 9}));
  EXPECT_EQ(g.lods, (Array<std::uint16_t>{4, 4, 0}));
  expect_rotation(dna, {40, 30, 0}, out, {g.values[0], g.values[1], g.values[2]});
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[0].where, "behavior.joint_groups");
  EXPECT_NE(warnings[0].message.find("1 joints turn about several axes"), std::string::npos);
  EXPECT_EQ(warnings[1].where, "behavior.joint_groups[0].lods");
}

// About fixed axes, a rotation about x by 90 and then y by 30 degrees equals a rotation about z by
// -30 and then x by 90 degrees.
TEST(DnaCoordinates, RotationRowsOfZerosAreLeftOut) {
  Dna dna = bare_rig(1, 1);
  dna.behavior.joint_groups = std::vector<JointGroup>{make_group({2}, {3, 4}, {90, 30})};
  CoordinateTarget target;
  target.rotation_sequence = 5;
  const JointGroup g = converted(dna, target).behavior.joint_groups[0];
  EXPECT_EQ(g.output_indices, (Array<std::uint16_t>{3, 5}));
  EXPECT_EQ(g.lods, (Array<std::uint16_t>{2}));
  EXPECT_FLOAT_EQ(g.values[0], 90);
  EXPECT_FLOAT_EQ(g.values[1], -30);
}

TEST(DnaCoordinates, QuaternionJointsAreNotSaidToBeApproximate) {
  Dna dna = bare_rig(1, 1);
  dna.behavior.joint_groups = std::vector<JointGroup>{make_group({2}, {3, 4}, {40, 30})};
  dna.joint_behavior_metadata.joint_representations =
      std::vector<JointRepresentation>{JointRepresentation{0, 1, 0}};
  std::vector<Warning> warnings;
  CoordinateTarget target;
  target.rotation_sequence = 5;
  converted(dna, target, &warnings);
  EXPECT_TRUE(warnings.empty());
}

TEST(DnaCoordinates, WarnsOfAJointThatSeveralGroupsTurn) {
  Dna dna = bare_rig(1, 1);
  dna.behavior.joint_groups =
      std::vector<JointGroup>{make_group({1}, {3}, {40}), make_group({1}, {4}, {30})};
  std::vector<Warning> warnings;
  CoordinateTarget target;
  target.rotation_sequence = 5;
  converted(dna, target, &warnings);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[1].message.find("turned by several groups"), std::string::npos);
}

TEST(DnaCoordinates, QuaternionTargetsAndTwistAxesTurn) {
  Dna dna = bare_rig(1, 0);
  dna.definition.raw_control_names = {"neck.x", "neck.y", "neck.z", "neck.w", "a", "b", "c", "d"};
  dna.rbf_behavior.poses = std::vector<RbfPose>(1);
  RbfSolver quaternion, plain;
  quaternion.raw_control_indices = {0, 1, 2, 3};
  quaternion.raw_control_values = {0.5f, -0.25f, 0.125f, 0.75f};
  quaternion.pose_indices = {0};
  quaternion.twist_axis = 1;
  plain = quaternion;
  plain.raw_control_indices = {4, 5, 6, 7};  // Euclidean, and no control name says quaternion
  dna.rbf_behavior.solvers = std::vector<RbfSolver>{quaternion, plain};
  TwistSwingSetup setup;
  setup.input_control_indices = {0, 1, 2, 3};
  setup.twist_axis = 1;
  dna.twist_swing_behavior.twists = std::vector<TwistSwingSetup>{setup};
  setup.twist_axis = 7;  // a file may contain an invalid axis
  dna.twist_swing_behavior.swings = std::vector<TwistSwingSetup>{setup};
  CoordinateTarget target;
  target.axes = CoordinateSystem{1, 4, 2};  // y and z are swapped: a mirror
  std::vector<Warning> warnings;
  const Dna out = converted(dna, target, &warnings);
  EXPECT_EQ(out.rbf_behavior.solvers[0].raw_control_values,
            (Array<float>{-0.5f, -0.125f, 0.25f, 0.75f}));
  EXPECT_EQ(out.rbf_behavior.solvers[0].twist_axis, 2);
  EXPECT_EQ(out.rbf_behavior.solvers[1].raw_control_values, plain.raw_control_values);
  EXPECT_EQ(out.twist_swing_behavior.twists[0].twist_axis, 2);
  EXPECT_EQ(out.twist_swing_behavior.swings[0].twist_axis, 7);
  EXPECT_TRUE(warnings.empty());
}

TEST(DnaCoordinates, WarnsOfComponentsOfRotationsReadAsNumbers) {
  Dna dna = bare_rig(1, 0);
  dna.definition.raw_control_names = {"neck.w"};
  dna.behavior.joint_groups = std::vector<JointGroup>{make_group({1}, {0}, {1})};
  std::vector<Warning> warnings;
  CoordinateTarget target;
  target.translation_unit = 1;
  converted(dna, target, &warnings);
  EXPECT_TRUE(warnings.empty());
  target.axes = CoordinateSystem{1, 4, 2};
  converted(dna, target, &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].where, "behavior.joint_groups");
}

Dna rig_with_ml_joints() {
  Dna dna = bare_rig(1, 1);
  MlJoints& joints = dna.machine_learned_behavior_ext.joints;
  joints.parameter_keys = {1, 6};
  joints.parameter_values = {1, 0};
  joints.input_indices = {0, 0};
  joints.output_indices = {0, 3};
  dna.descriptor.coordinate_system = {1, 4, 2};
  dna.descriptor_ext = {4, {1, -1, 1}, 0};
  return dna;
}

TEST(DnaCoordinates, NamesTheAxesOfJointsThatNetworksMove) {
  const Dna dna = rig_with_ml_joints();
  std::vector<Warning> warnings;
  const Dna out = converted(dna, target_of({1, 2, 4}, 0, {1, 1, 1}), &warnings);
  const MlJoints& joints = out.machine_learned_behavior_ext.joints;
  EXPECT_EQ(joints.parameter_keys, (Array<std::uint16_t>{1, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(joints.parameter_values, (Array<std::uint16_t>{1, 1, 4, 2, 1, 0, 1, 4}));
  EXPECT_TRUE(warnings.empty());
  const Dna again = converted(out, target_of({0, 2, 4}, 3, {1, 1, -1}));
  EXPECT_EQ(again.machine_learned_behavior_ext, out.machine_learned_behavior_ext);
}

TEST(DnaCoordinates, WarnsOfNetworksInTheOldUnit) {
  Dna dna = rig_with_ml_joints();
  CoordinateTarget metres, radians;
  metres.translation_unit = 1;
  radians.rotation_unit = 1;
  const auto count = [&](const CoordinateTarget& target) {
    std::vector<Warning> warnings;
    converted(dna, target, &warnings);
    return warnings.size();
  };
  EXPECT_EQ(count(metres), 1u);
  EXPECT_EQ(count(radians), 0u);  // quaternions have no unit
  dna.machine_learned_behavior_ext.joints.parameter_values = {0, 0};
  EXPECT_EQ(count(radians), 1u);
}

TEST(DnaCoordinates, WarnsOfLayersThatItCannotRead) {
  Dna dna = bare_rig(1);
  dna.unknown_layers.push_back({{'a', 'b', 'c', 'd'}, 1, {1, 2, 3}});
  std::vector<Warning> warnings;
  CoordinateTarget target;
  target.translation_unit = 1;
  const Dna out = converted(dna, target, &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].where, "unknown_layers");
  EXPECT_EQ(out.unknown_layers, dna.unknown_layers);
}

TEST(DnaCoordinates, RaisesTheVersionOnlyForWhatOlderFilesCannotSay) {
  Dna dna = bare_rig(1);
  dna.version = 4;
  CoordinateTarget target;
  target.axes = CoordinateSystem{0, 2, 4};
  EXPECT_EQ(converted(dna, target).version, 4);
  target.rotation_sequence = 1;
  EXPECT_EQ(converted(dna, target).version, 8);
}

void expect_error(const Dna& dna, const CoordinateTarget& target, core::ErrorCode code,
                  const std::string& where) {
  std::vector<Warning> warnings;
  const core::Result<Dna> out = convert_coordinates(dna, target, warnings);
  ASSERT_FALSE(out.has_value()) << where;
  EXPECT_EQ(out.error().code, code) << where;
  EXPECT_EQ(out.error().where, where);
}

TEST(DnaCoordinates, RefusesATargetThatMakesNoSense) {
  const core::ErrorCode code = core::ErrorCode::kInvalidArgument;
  std::vector<std::pair<CoordinateTarget, std::string>> cases(7);
  cases[0] = {target_of({0, 1, 2}, 0, {1, 1, 1}), "axes"};
  cases[1] = {target_of({6, 2, 4}, 0, {1, 1, 1}), "axes"};
  cases[2] = {target_of({1, 2, 4}, 6, {1, 1, 1}), "rotation_sequence"};
  cases[3] = {target_of({1, 2, 4}, 0, {1, 0, 1}), "rotation_signs"};
  cases[4].first.face_winding_order = std::uint8_t{2};
  cases[4].second = "face_winding_order";
  cases[5].first.translation_unit = std::uint16_t{2};
  cases[5].second = "translation_unit";
  cases[6].first.rotation_unit = std::uint16_t{2};
  cases[6].second = "rotation_unit";
  for (const auto& [target, where] : cases) expect_error(bare_rig(1), target, code, where);
}

TEST(DnaCoordinates, RefusesAFileInNoSystem) {
  const core::ErrorCode code = core::ErrorCode::kInvalidValue;
  const auto refuse = [&](const auto& spoil, const std::string& where) {
    Dna dna = bare_rig(1);
    spoil(dna);
    expect_error(dna, target_of({0, 2, 4}, 1, {1, 1, -1}), code, where);
  };
  refuse([](Dna& d) { d.descriptor.coordinate_system = {1, 1, 4}; },
         "descriptor.coordinate_system");
  refuse([](Dna& d) { d.descriptor.coordinate_system.z_axis = 65535; },
         "descriptor.coordinate_system");
  refuse([](Dna& d) { d.descriptor_ext.rotation_sequence = 4294967295u; },
         "descriptor_ext.rotation_sequence");
  refuse([](Dna& d) { d.descriptor_ext.rotation_sign[2] = -2147483647 - 1; },
         "descriptor_ext.rotation_sign");
  refuse([](Dna& d) { d.descriptor_ext.face_winding_order = 255; },
         "descriptor_ext.face_winding_order");
  refuse([](Dna& d) { d.descriptor.translation_unit = 2; }, "descriptor.translation_unit");
  refuse([](Dna& d) { d.descriptor.rotation_unit = 65535; }, "descriptor.rotation_unit");
}

TEST(DnaCoordinates, RefusesWhatValidateRefuses) {
  Dna dna = bare_rig(1, 1);
  dna.behavior.joint_groups = std::vector<JointGroup>{make_group({1}, {9}, {1})};
  expect_error(dna, {}, core::ErrorCode::kInvalidIndex,
               "behavior.joint_groups[0].output_indices[0]");
}

TEST(DnaCoordinates, RefusesRowsBeyondTheFormat) {
  Dna dna = bare_rig(7282, 1);
  dna.behavior.joint_groups =
      std::vector<JointGroup>{make_group({1}, {65535}, {1})};  // sx of the last joint
  CoordinateTarget target;
  target.axes = CoordinateSystem{4, 2, 1};
  expect_error(dna, target, core::ErrorCode::kInvalidValue,
               "behavior.joint_groups[0].output_indices");
  target.axes = CoordinateSystem{0, 2, 4};
  EXPECT_EQ(converted(dna, target).behavior.joint_groups[0].output_indices[0], 65535);

  // The format allows 65,535 rows. The last one here rotates a joint about a second axis, whose
  // conversion adds a row for the third axis.
  dna = bare_rig(1, 1);
  std::vector<std::uint16_t> outputs(65533, 0);
  outputs.insert(outputs.end(), {3, 4});
  std::vector<float> values(65535, 10);
  dna.behavior.joint_groups = std::vector<JointGroup>{make_group({65535}, outputs, values)};
  CoordinateTarget mixed;
  mixed.rotation_sequence = 5;
  expect_error(dna, mixed, core::ErrorCode::kInvalidValue, "behavior.joint_groups[0]");
}

TEST(DnaCoordinates, NumbersThatAreNoneStaySo) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kHuge = std::numeric_limits<float>::max();
  Dna dna = bare_rig(3, 1);
  dna.descriptor.translation_unit = 1;
  dna.definition.neutral_joint_translations.values =
      std::vector<float>{kNan, kInfinity, kHuge, 1, -kInfinity, kNan, 2, 3, -kHuge};
  dna.definition.neutral_joint_rotations.values =
      std::vector<float>{kNan, 1, kHuge, 2, kInfinity, 0, 3, 4, -kHuge};
  dna.behavior.joint_groups =
      std::vector<JointGroup>{make_group({3}, {3, 4, 5}, {kNan, 1, kInfinity})};
  CoordinateTarget target = target_of({4, 1, 3}, 5, {1, -1, 1});
  target.translation_unit = 0;
  const Dna out = converted(dna, target);
  // The conversion: x (right) becomes y, y (up) becomes -z, z (front) becomes x, and metres become
  // centimetres.
  const Array<float>& t = out.definition.neutral_joint_translations.values;
  const std::vector<float> expected{200,       300,  -kInfinity, kNan, kInfinity,
                                    kInfinity, -100, kInfinity,  kNan};
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_TRUE(t[i] == expected[i] || (std::isnan(t[i]) && std::isnan(expected[i]))) << i;
  }
  const Array<float>& r = out.definition.neutral_joint_rotations.values;
  for (std::size_t p = 0; p < 3; ++p) {
    EXPECT_TRUE(std::isnan(r[p * 3]) && std::isnan(r[p * 3 + 1])) << p;
    EXPECT_LE(std::abs(r[p * 3 + 2]), 180) << p;  // even for a huge angle
  }
  for (const float v : out.behavior.joint_groups[0].values) EXPECT_TRUE(std::isnan(v));
}

// Checks that a file that parse accepts is either converted to a valid Dna or rejected.
void expect_sound(const std::vector<std::uint8_t>& bytes, const CoordinateTarget& target) {
  bytes::SpanSource source(bytes);
  const core::Result<Dna> dna = parse(source);
  if (!dna) return;
  std::vector<Warning> warnings;
  const core::Result<Dna> out = convert_coordinates(*dna, target, warnings);
  if (!out) {
    EXPECT_EQ(out.error().code, core::ErrorCode::kInvalidValue);
    return;
  }
  EXPECT_TRUE(validate(*out, warnings).has_value());
}

TEST(DnaCoordinates, SurvivesEveryPatchedByte) {
  std::ifstream file(RISORIUS_TEST_DATA "/golden/tiny_v28.dna", std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  ASSERT_EQ(bytes.size(), 8109u);
  CoordinateTarget mixing = target_of({3, 5, 0}, 5, {1, -1, 1}), moving = mixing;
  mixing.translation_unit = std::uint16_t{1};
  moving.rotation_sequence = std::uint32_t{2};
  moving.rotation_unit = std::uint16_t{1};
  for (std::size_t i = 0; i < bytes.size(); i += testing_support::kStride) {
    const std::uint8_t kept = bytes[i];
    for (const std::uint8_t patch : {std::uint8_t{0x7F}, std::uint8_t{0xFF}}) {
      bytes[i] = patch;
      expect_sound(bytes, patch == 0x7F ? moving : mixing);
    }
    bytes[i] = kept;
  }
}

}  // namespace
}  // namespace risorius::dna
