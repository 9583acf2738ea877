// SPDX-License-Identifier: MIT
// Tests which faces and options regroup() accepts or refuses.
#include <limits>
#include <ostream>
#include <utility>

#include "edit/regrouped.h"

namespace risorius::edit {
namespace {

using namespace regrouping;
using core::ErrorCode;

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
