// SPDX-License-Identifier: MIT
// Evaluation takes no memory. The counter sees every operator new of this executable.
#include <atomic>
#include <cstdlib>
#include <new>

#include "support/face.h"

namespace {
std::atomic<long> allocations{0};

void* counted(std::size_t bytes) {
  ++allocations;
  if (void* p = std::malloc(bytes)) return p;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t bytes) { return counted(bytes); }
void* operator new[](std::size_t bytes) { return counted(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(bytes);
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }

#ifndef _WIN32  // there aligned memory has a release of its own; its allocations are not counted
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  ++allocations;
  const auto a = static_cast<std::size_t>(alignment);
  if (void* p = std::aligned_alloc(a, (bytes + a - 1) / a * a)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
#endif

namespace risorius::rig {
namespace {

using namespace testing_support;

TEST(Allocation, CounterSeesAnAllocation) {
  const long before = allocations;
  const std::vector<float> some(10);
  EXPECT_GT(allocations, before);
}

TEST(Allocation, EvaluateTakesNoMemory) {
  dna::Dna dna = make_face(3, 2, 4);
  dna.definition.blend_shape_channel_names = names("shape", 1);
  dna.behavior.psds.rows = {3, 4};
  dna.behavior.psds.columns = {0, 3};
  dna.behavior.psds.values = {1.0f, 1.0f};
  dna.behavior.joint_groups = std::vector{make_probe({0, 1, 2, 3, 4})};
  dna.behavior.blend_shape_channels.lods = {1, 1};
  dna.behavior.blend_shape_channels.input_indices = {4};
  dna.behavior.blend_shape_channels.output_indices = {0};
  const Rig rig = must_compile(dna);
  Workspace work = make_workspace(rig);
  Pose pose = make_pose(rig);
  Instance face(rig);
  const float raw[3] = {0.5f, 0.25f, 1.0f};
  const long before = allocations;
  for (std::uint32_t lod = 0; lod < 3; ++lod) {
    evaluate(rig, raw, lod, true, work, pose);
    evaluate(rig, raw, lod, false, work, pose);
    face.set_lod(lod);
    (void)face.evaluate(raw);
  }
  EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace risorius::rig
