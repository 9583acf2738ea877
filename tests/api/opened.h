// SPDX-License-Identifier: MIT
// Faces and instances of the C API that are closed at the end of a test.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "risorius.h"
#include "support/files.h"

namespace risorius::testing_support {

using FacePtr = std::unique_ptr<risorius_face, decltype(&risorius_close)>;
using InstancePtr = std::unique_ptr<risorius_instance, decltype(&risorius_destroy)>;

inline std::string golden_path(const std::string& name) {
  return (data_folder() / "golden" / (name + ".dna")).string();
}

inline FacePtr open_golden(const std::string& name, const risorius_options& options = {}) {
  risorius_face* face = nullptr;
  EXPECT_EQ(risorius_open_file(golden_path(name).c_str(), &options, &face), RISORIUS_OK)
      << risorius_last_error()->message;
  return {face, risorius_close};
}

inline InstancePtr make_instance(const FacePtr& face, risorius_timing timing = RISORIUS_SETTLED) {
  risorius_instance* instance = nullptr;
  EXPECT_EQ(risorius_create(face.get(), timing, &instance), RISORIUS_OK)
      << risorius_last_error()->message;
  return {instance, risorius_destroy};
}

inline std::vector<float> values(const InstancePtr& instance, risorius_list list) {
  std::uint32_t count = 0;
  const float* first = risorius_values(instance.get(), list, &count);
  EXPECT_NE(first, nullptr);
  return {first, first + count};
}

}  // namespace risorius::testing_support
