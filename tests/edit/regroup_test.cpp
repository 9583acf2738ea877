// SPDX-License-Identifier: MIT
// Other joint groups, the same face.
#include "edit/regroup.h"

#include <cmath>
#include <limits>
#include <ostream>

#include "simd/kernels.h"
#include "support/face.h"

namespace risorius::edit {
namespace {

using namespace testing_support;
using core::ErrorCode;
using Indices = std::vector<std::uint16_t>;

Regrouped must_regroup(const dna::Dna& dna, RegroupOptions options = {}) {
  options.timed = 0;
  core::Result<Regrouped> result = regroup(dna, options);
  if (!result) {
    ADD_FAILURE() << result.error().describe();
    std::abort();
  }
  return std::move(result).value();
}

std::vector<float> joints_of(const dna::Dna& dna, const std::vector<float>& raw, std::uint32_t lod,
                             compile::Rotation rotation = compile::Rotation::kEuler) {
  compile::CompileOptions options;
  options.kernels = simd::find_kernels("scalar");
  options.rotation = rotation;
  const auto rig = compile::compile(dna, options);
  if (!rig) return {};
  return evaluate_once(rig.value(), raw, lod).joints;
}

// Every LOD, both forms of rotation, to the last bit.
void expect_same_function(const dna::Dna& a, const dna::Dna& b, const std::vector<float>& raw) {
  for (std::uint32_t lod = 0; lod < a.descriptor.lod_count; ++lod) {
    for (const auto rotation : {compile::Rotation::kEuler, compile::Rotation::kQuaternion}) {
      const auto wanted = joints_of(a, raw, lod, rotation);
      ASSERT_FALSE(wanted.empty());
      EXPECT_EQ(joints_of(b, raw, lod, rotation), wanted) << "LOD " << lod;
    }
  }
}

Indices list(const core::Array<std::uint16_t>& a) { return Indices(a.begin(), a.end()); }

// Joint 0 by control 0 and joint 1 by control 1, in one group with the zeros between.
dna::Dna two_joints() {
  dna::Dna dna = make_face(2, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({4, 1}, {1, 0}, {9, 0, 10, 1}, {5, 0, 0, 2, 6, 0, 0, 3})};
  return dna;
}

TEST(Regroup, MakesADenseGroupOfEachRegion) {
  RegroupOptions options;
  options.regions = {{1}, {0}};
  const Regrouped out = must_regroup(two_joints(), options);
  const auto& groups = out.dna.behavior.joint_groups;
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0], [] {
    dna::JointGroup g = make_group({2, 0}, {0}, {0, 1}, {2, 3});
    g.joint_indices = {0};
    return g;
  }());
  EXPECT_EQ(groups[1], [] {
    dna::JointGroup g = make_group({2, 1}, {1}, {9, 10}, {5, 6});
    g.joint_indices = {1};
    return g;
  }());
  EXPECT_EQ(out.report.before.coefficients, 8u);
  EXPECT_EQ(out.report.after.coefficients, 4u);
  EXPECT_EQ(out.report.after.nonzero, 4u);
  EXPECT_EQ(out.report.regions, (std::vector<Indices>{{0}, {1}}));
  expect_same_function(two_joints(), out.dna, {0.25f, 0.75f});
}

TEST(Regroup, PutsWhatCoarserLodsUseFirst) {
  dna::Dna dna = make_face(1, 0, 2, 3);
  dna.behavior.joint_groups = std::vector{make_group({2, 1, 0}, {0}, {5, 0}, {1, 2}),
                                          make_group({2, 2, 1}, {0}, {7, 1}, {3, 4})};
  RegroupOptions options;
  options.regions = {{0}};
  const Regrouped out = must_regroup(dna, options);
  ASSERT_EQ(out.dna.behavior.joint_groups.size(), 1u);
  const dna::JointGroup& g = out.dna.behavior.joint_groups[0];
  EXPECT_EQ(list(g.lods), (Indices{4, 3, 1}));
  EXPECT_EQ(list(g.output_indices), (Indices{7, 1, 5, 0}));
  expect_same_function(dna, out.dna, {0.5f});
}

// Twelve joints that control 0 moves; control 1 is foreign.
dna::Dna with_outliers(float small, float large) {
  dna::Dna dna = make_face(2, 0, 12);
  Indices outputs;
  std::vector<float> values;
  for (std::uint16_t j = 0; j < 12; ++j) {
    outputs.push_back(static_cast<std::uint16_t>(j * 9));
    values.insert(values.end(), {j == 5 ? small : 1.0f, j == 3 ? small : j == 4 ? large : 0.0f});
  }
  dna.behavior.joint_groups = std::vector{make_group({12, 12}, {0, 1}, outputs, values)};
  return dna;
}

RegroupOptions in_one_region() {
  RegroupOptions options;
  options.regions = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}};
  return options;
}

TEST(Regroup, TakesOutWhatIsSmallAndForeign) {
  RegroupOptions options = in_one_region();
  options.threshold.translation_mm = 0.5;
  const Regrouped out = must_regroup(with_outliers(0.049f, 0.051f), options);  // cm
  EXPECT_EQ(out.report.removed, 1u);
  EXPECT_EQ(out.report.before.nonzero - out.report.after.nonzero, 1u);
  EXPECT_NEAR(out.report.changes.translation_mm.value, 0.49, 1e-6);
  EXPECT_EQ(out.report.changes.translation_mm.joint, "joint3");
  EXPECT_EQ(out.report.changes.translation_mm.expression, "raw1");
  EXPECT_EQ(out.report.changes.rotation_degrees.value, 0.0);
  // Joint 5 is small where it belongs.
  EXPECT_EQ(joints_of(out.dna, {1, 0}, 0)[45], 0.049f);
}

TEST(Regroup, ZeroTakesOutNothing) {
  const Regrouped out = must_regroup(with_outliers(1e-6f, 1e-6f));
  EXPECT_EQ(out.report.removed, 0u);
  EXPECT_EQ(out.report.before.nonzero, out.report.after.nonzero);
}

// Two halves of the joints, each by a control of its own. The other half's control moves each fifth
// a little, which shows no kinship as long as what is small is left out of the search.
TEST(Regroup, FindsRegionsByWhatIsNotSmall) {
  constexpr std::uint16_t kHalf = 40;
  dna::Dna dna = make_face(2, 0, 2 * kHalf);
  Indices outputs;
  std::vector<float> values;
  std::vector<Indices> halves(2);
  for (std::uint16_t j = 0; j < 2 * kHalf; ++j) {
    outputs.push_back(static_cast<std::uint16_t>(j * 9));
    const float small = j % 5 == 0 ? 0.04f : 0.0f;
    values.insert(values.end(), {j < kHalf ? 1.0f : small, j < kHalf ? small : 1.0f});
    halves[j / kHalf].push_back(j);
  }
  dna.behavior.joint_groups =
      std::vector{make_group({2 * kHalf, 2 * kHalf}, {0, 1}, outputs, values)};
  RegroupOptions options;
  options.threshold.translation_mm = 0.5;
  const Regrouped out = must_regroup(dna, options);
  EXPECT_EQ(out.report.regions, halves);
  EXPECT_EQ(out.report.removed, 2u * kHalf / 5);
}

TEST(Regroup, TimesBothFacesWhereItIsAsked) {
  RegroupOptions options;
  options.timed = 3;
  const auto out = regroup(two_joints(), options);
  ASSERT_TRUE(out.has_value());
  EXPECT_GT(out->report.microseconds_before, 0.0);
  EXPECT_GT(out->report.microseconds_after, 0.0);
  EXPECT_EQ(must_regroup(two_joints()).report.microseconds_after, 0.0);
}

TEST(Regroup, NamesThePoseWhereAJointMovedMost) {
  // Joint 0 turns by a foreign degree; joint 1 is its child, 10 cm away.
  dna::Dna dna = with_outliers(0.0f, 0.0f);
  std::vector<float> places(36, 0.0f);
  places[1] = 10.0f;
  dna.definition.neutral_joint_translations.values = places;
  dna.behavior.joint_groups =
      std::vector{dna.behavior.joint_groups[0], make_group({1, 1}, {1}, {5}, {1.0f})};
  RegroupOptions options = in_one_region();
  options.threshold.rotation_degrees = 2.0;
  options.combinations = 0;
  const Changes changes = must_regroup(dna, options).report.changes;
  EXPECT_NEAR(changes.rotation_degrees.value, 1.0, 1e-6);
  EXPECT_EQ(changes.rotation_degrees.joint, "joint0");
  EXPECT_EQ(changes.translation_mm.value, 0.0);
  EXPECT_NEAR(changes.position_mm.value, 2 * 100 * std::sin(0.5 * 3.14159265358979 / 180), 1e-6);
  EXPECT_EQ(changes.position_mm.joint, "joint1");
  EXPECT_EQ(changes.expressions, 2u);
}

TEST(Regroup, ThresholdsCountInTheFilesUnits) {
  dna::Dna dna = with_outliers(0.00049f, 0.00051f);
  dna.descriptor.translation_unit = 1;  // metres
  RegroupOptions options = in_one_region();
  options.threshold.translation_mm = 0.5;
  EXPECT_EQ(must_regroup(dna, options).report.removed, 1u);
}

TEST(Regroup, KeepsQuaternionJointsWhole) {
  // Columns out of order and one of them twice: the product of rotations knows the difference.
  dna::Dna dna = make_face(3, 0, 3);
  dna.behavior.joint_groups =
      std::vector{make_group({4, 3}, {2, 0, 2, 1}, {12, 14, 13, 0},
                             {40, 0, 1e-4f, 0, 0, 50, 0, 0, 0, 0, 60, 1e-4f, 1, 2, 3, 4}),
                  make_group({2, 1}, {1, 0}, {22, 21}, {30, 1e-4f, 20, 70})};
  dna.joint_behavior_metadata.joint_representations =
      std::vector{dna::JointRepresentation{}, {0, 1, 0}, {0, 1, 0}};
  RegroupOptions options;
  options.regions = {{0, 1, 2}};
  options.threshold = {1.0, 1.0, 1.0};
  options.foreign_share = 1.0;
  const Regrouped out = must_regroup(dna, options);
  EXPECT_EQ(out.report.removed, 0u);
  expect_same_function(dna, out.dna, {0.3f, 0.5f, 0.9f});
}

TEST(Regroup, TheLastWriterOfARowStillWins) {
  // At LOD 1 the second group is gone and the first one's row shows; the third hides one for good.
  dna::Dna dna = make_face(2, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({2, 2}, {0}, {0, 9}, {1, 2}), make_group({2, 1}, {1}, {1, 0}, {3, 4}),
                  make_group({1, 1}, {0, 1}, {9}, {0, 0})};
  const Regrouped out = must_regroup(dna);
  EXPECT_EQ(out.report.after.rows, 4u);
  expect_same_function(dna, out.dna, {0.5f, 0.25f});
}

TEST(Regroup, TheLastGroupThatTurnsAQuaternionJointStillWins) {
  dna::Dna dna = make_face(2, 0, 1);
  dna.behavior.joint_groups =
      std::vector{make_group({2, 2}, {0}, {3, 4}, {30, 40}), make_group({1, 0}, {1}, {5}, {50})};
  dna.joint_behavior_metadata.joint_representations =
      std::vector{dna::JointRepresentation{0, 1, 0}};
  expect_same_function(dna, must_regroup(dna).dna, {0.5f, 0.25f});
}

TEST(Regroup, LodsThatDoNotNestStay) {
  dna::Dna dna = make_face(2, 0, 2, 3);
  dna.behavior.joint_groups = std::vector{make_group({1, 2, 0}, {0}, {0, 1}, {1, 2}),
                                          make_group({2, 1, 1}, {0, 1}, {2, 9}, {3, 4, 5, 6})};
  RegroupOptions options;
  options.regions = {{0, 1}};
  expect_same_function(dna, must_regroup(dna, options).dna, {0.5f, 0.25f});
}

TEST(Regroup, ACorrectiveThatAnotherReadsStaysInUse) {
  // Control 2 moves one joint a little, and control 3 is it times raw1.
  dna::Dna dna = with_outliers(0.0f, 0.0f);
  dna.behavior.psd_count = 2;
  dna.behavior.psds = {{2, 3, 3}, {0, 2, 1}, {1.0f, 1.0f, 1.0f}};
  dna.behavior.joint_groups =
      std::vector{dna.behavior.joint_groups[0], make_group({1, 0}, {2}, {1}, {0.001f}),
                  make_group({1, 1}, {3}, {2}, {5.0f})};
  RegroupOptions options = in_one_region();
  options.threshold.translation_mm = 1.0;
  const Regrouped out = must_regroup(dna, options);
  EXPECT_EQ(out.report.removed, 0u);
  expect_same_function(dna, out.dna, {0.5f, 0.25f});
  dna.behavior.psds = {{2, 3, 3}, {0, 0, 1}, {1.0f, 1.0f, 1.0f}};
  EXPECT_EQ(must_regroup(dna, options).report.removed, 1u);
}

TEST(Regroup, AHiddenRowThatKeepsACorrectiveInUseStays) {
  dna::Dna dna = make_face(2, 2, 2);
  dna.behavior.psds = {{2, 3, 3}, {0, 2, 1}, {1.0f, 1.0f, 1.0f}};
  dna.behavior.joint_groups =
      std::vector{make_group({1, 1}, {2}, {0}, {7}), make_group({2, 2}, {3}, {1, 0}, {5, 6})};
  const Regrouped out = must_regroup(dna);
  expect_same_function(dna, out.dna, {0.5f, 0.25f});
  EXPECT_NE(joints_of(out.dna, {0.5f, 0.25f}, 0)[0], 0.0f);
}

TEST(Regroup, AJointOfZerosIsStillTheRigs) {
  dna::Dna dna = make_face(1, 0, 2);
  dna.behavior.joint_groups =
      std::vector{make_group({3, 3}, {0}, {0, 9, 10}, {1, 0, 0}), make_group({0, 0}, {0}, {}, {})};
  const Regrouped out = must_regroup(dna);
  EXPECT_EQ(out.report.after.rows, 2u);
  const rig::Rig before = must_compile(dna), after = must_compile(out.dna);
  EXPECT_EQ(Indices(after.joints_written.begin(), after.joints_written.end()),
            Indices(before.joints_written.begin(), before.joints_written.end()));
}

TEST(Regroup, AFaceWithoutGroupsStaysOne) {
  const Regrouped out = must_regroup(make_face(1, 0, 2));
  EXPECT_EQ(out.report.after.groups, 0u);
  EXPECT_EQ(must_regroup(dna::Dna{}).report.after.groups, 0u);
}

struct Complaint {
  const char* name;
  RegroupOptions options;
  ErrorCode code;
  const char* where;
};
void PrintTo(const Complaint& c, std::ostream* out) { *out << c.name; }

RegroupOptions with_regions(std::vector<Indices> regions) {
  RegroupOptions o;
  o.regions = std::move(regions);
  return o;
}
RegroupOptions with_threshold(Threshold t) {
  RegroupOptions o;
  o.threshold = t;
  return o;
}
RegroupOptions with_share(double share) {
  RegroupOptions o;
  o.foreign_share = share;
  return o;
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const std::vector<Complaint> kComplaints{
    {"UnknownJoint", with_regions({{0}, {1, 2}}), ErrorCode::kInvalidIndex, "regions[1][1]"},
    {"JointTwice", with_regions({{0}, {1, 0}}), ErrorCode::kInvalidArgument, "regions[1][1]"},
    {"EmptyRegion", with_regions({{0}, {}}), ErrorCode::kInvalidArgument, "regions[1]"},
    {"ThresholdBelowZero", with_threshold({0, -1, 0}), ErrorCode::kInvalidArgument, "threshold"},
    {"ThresholdNaN", with_threshold({kNan, 0, 0}), ErrorCode::kInvalidArgument, "threshold"},
    {"Share", with_share(1.5), ErrorCode::kInvalidArgument, "foreign_share"},
    {"ShareNaN", with_share(kNan), ErrorCode::kInvalidArgument, "foreign_share"},
};

class RegroupRefuses : public testing::TestWithParam<Complaint> {};
TEST_P(RegroupRefuses, AndSaysWhere) {
  const auto result = regroup(two_joints(), GetParam().options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, GetParam().code);
  EXPECT_EQ(result.error().where, GetParam().where);
}
INSTANTIATE_TEST_SUITE_P(Regroup, RegroupRefuses, testing::ValuesIn(kComplaints),
                         [](const auto& each) { return each.param.name; });

TEST(Regroup, ADnaThatDoesNotFitTogetherIsRefused) {
  dna::Dna dna = two_joints();
  dna.behavior.joint_groups[0].values = {1.0f};
  const auto result = regroup(dna);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().where, "behavior.joint_groups[0].values");
}

}  // namespace
}  // namespace risorius::edit
