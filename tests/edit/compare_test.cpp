// SPDX-License-Identifier: MIT
// regroup() measures the evaluation time of the given face and of the regrouped face only if timing
// is requested.
#include "edit/regrouped.h"

namespace risorius::edit {
namespace {

using namespace regrouping;

TEST(Regroup, TimesBothFacesWhereItIsAsked) {
  RegroupOptions options;
  options.timed = 3;
  const auto out = regroup(two_joints(), options);
  ASSERT_TRUE(out.has_value());
  EXPECT_GT(out->report.microseconds_before, 0.0);
  EXPECT_GT(out->report.microseconds_after, 0.0);
  EXPECT_EQ(must_regroup(two_joints()).report.microseconds_after, 0.0);
}

}  // namespace
}  // namespace risorius::edit
