// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "simd/cpu.h"
#include "simd/kernels.h"

namespace risorius::simd {
namespace {

// Sets RISORIUS_SIMD for one test and puts back what was there.
class Environment {
 public:
  explicit Environment(const char* value) {
    if (const char* now = std::getenv("RISORIUS_SIMD")) before_ = now;
    set(value);
  }
  ~Environment() { set(before_.c_str()); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  static void set(const char* value) {
#ifdef _WIN32
    _putenv_s("RISORIUS_SIMD", value);
#else
    setenv("RISORIUS_SIMD", value, 1);
#endif
  }
  std::string before_;
};

TEST(SimdDispatch, NameChoosesTheTable) {
  EXPECT_EQ(find_kernels("scalar"), &scalar_kernels());
  EXPECT_EQ(find_kernels("avx2"), avx2_kernels());
  EXPECT_EQ(find_kernels("avx9"), nullptr);
  EXPECT_EQ(find_kernels("AVX2"), nullptr);
}

TEST(SimdDispatch, EnvironmentChoosesWhenNoNameIsGiven) {
  const Environment scalar("scalar");
  EXPECT_EQ(find_kernels(nullptr), &scalar_kernels());
  EXPECT_EQ(find_kernels(""), &scalar_kernels());
  EXPECT_EQ(find_kernels("avx2"), avx2_kernels()) << "a name wins over the environment";
}

TEST(SimdDispatch, UnknownNameInTheEnvironmentIsAnError) {
  const Environment wrong("fast");
  EXPECT_EQ(find_kernels(nullptr), nullptr);
}

TEST(SimdDispatch, BestOfTheCpuByDefault) {
  const Environment none("");
  const Kernels* best = find_kernels(nullptr);
  ASSERT_NE(best, nullptr);
  EXPECT_STREQ(best->name, cpu_has_avx2_fma() ? "avx2" : "scalar");
}

TEST(SimdDispatch, ListsWhatTheCpuHas) {
  EXPECT_EQ(std::string(available_kernels()), cpu_has_avx2_fma() ? "scalar, avx2" : "scalar");
}

}  // namespace
}  // namespace risorius::simd
