// SPDX-License-Identifier: MIT
// A face without behavior, for tests, benchmarks and fuzz targets.
#pragma once

#include <string>
#include <vector>

#include "dna/dna.h"

namespace risorius::testing_support {

inline std::vector<std::string> names(const char* stem, std::size_t n) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < n; ++i) out.push_back(stem + std::to_string(i));
  return out;
}

/// A face with counts and names but without behavior. All joints are at the origin; joint 0 is the
/// root and the parent of all others. The `psds` correctives have no rows.
inline dna::Dna make_face(std::size_t raw, std::uint16_t psds, std::size_t joints,
                          std::uint16_t lods = 2) {
  dna::Dna dna;
  dna.descriptor.lod_count = lods;
  dna.definition.raw_control_names = names("raw", raw);
  dna.definition.joint_names = names("joint", joints);
  dna.definition.joint_parents = std::vector<std::uint16_t>(joints, 0);
  dna.definition.neutral_joint_translations.values = std::vector<float>(joints * 3, 0.0f);
  dna.definition.neutral_joint_rotations.values = std::vector<float>(joints * 3, 0.0f);
  dna.behavior.psd_count = psds;
  return dna;
}

}  // namespace risorius::testing_support
