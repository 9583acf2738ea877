// SPDX-License-Identifier: MIT
// ByteReader converts numbers with the kernels that it is given, or else with the kernels that
// RISORIUS_SIMD names.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <limits>

#include "bytes/byte_reader.h"

namespace risorius::bytes {
namespace {

constexpr std::array<std::uint8_t, 12> kBytes{0, 0, 0, 2, 0x40, 0, 0, 0, 0xC0, 0x40, 0, 0};
int calls = 0;

bool spy(const std::uint8_t*, float* to, std::size_t n) {
  ++calls;
  for (std::size_t i = 0; i < n; ++i) to[i] = std::numeric_limits<float>::infinity();
  return false;
}

TEST(ByteOrder, IsThatOfTheTable) {
  simd::Kernels table = simd::scalar_kernels();
  table.native_f32 = spy;
  SpanSource source(kBytes);
  ByteReader reader(source, table);
  bool finite = true;
  calls = 0;
  const core::Array<float> values = reader.f32_list(&finite);
  EXPECT_EQ(calls, 1);
  ASSERT_EQ(values.size(), 2u);
  EXPECT_EQ(values[1], std::numeric_limits<float>::infinity());
  EXPECT_FALSE(finite);
}

TEST(ByteOrder, IsThatOfTheEnvironment) {
  const char* forced = std::getenv("RISORIUS_SIMD");
  ASSERT_NE(forced, nullptr);  // CMake runs this once for each instruction set
  SpanSource source(kBytes);
  ByteReader reader(source);
  EXPECT_STREQ(reader.simd(), forced);
  bool finite = true;
  const core::Array<float> values = reader.f32_list(&finite);
  EXPECT_EQ(values, (core::Array<float>{2.0f, -3.0f}));
  EXPECT_TRUE(finite);
}

}  // namespace
}  // namespace risorius::bytes
