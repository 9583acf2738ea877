// SPDX-License-Identifier: MIT
// The table of kernels, the inner loops for one instruction set, is chosen by its name, by the
// environment variable RISORIUS_SIMD, or as the best table of the CPU.
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "simd/kernels.h"

namespace risorius::simd {
namespace {

// Sets RISORIUS_SIMD while the object exists. Its destructor restores the value; a variable that
// was not set becomes empty, which find_kernels treats alike.
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
  EXPECT_EQ(find_kernels("avx512"), avx512_kernels());
  EXPECT_EQ(find_kernels("sse4"), sse4_kernels());
  EXPECT_EQ(find_kernels("neon"), neon_kernels());
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
  EXPECT_EQ(&usual_kernels(), &scalar_kernels());
}

std::vector<std::string> names_by_the_cpu() {
  std::vector<std::string> names{"scalar"};
  if (cpu_has_sse4()) names.push_back("sse4");
#if defined(__aarch64__) || defined(_M_ARM64)
  names.push_back("neon");
#endif
  if (cpu_has_avx2()) names.push_back("avx2");
  if (cpu_has_avx512()) names.push_back("avx512");
  return names;
}

TEST(SimdDispatch, BestOfTheCpuByDefault) {
  const Environment none("");
  const Kernels* best = find_kernels(nullptr);
  ASSERT_NE(best, nullptr);
  EXPECT_EQ(best->name, names_by_the_cpu().back());
  EXPECT_EQ(&usual_kernels(), best);
}

TEST(SimdDispatch, ListsWhatTheCpuHas) {
  std::string list;
  for (const std::string& name : names_by_the_cpu()) list += (list.empty() ? "" : ", ") + name;
  EXPECT_EQ(available_kernels(), list);
}

}  // namespace
}  // namespace risorius::simd
