// SPDX-License-Identifier: MIT
// Tests that opening a compiled rig, and workspaces for it, take limited heap memory.
#include <gtest/gtest.h>

#include <algorithm>

#include "compile/compile.h"
#include "core/aligned.h"
#include "rig/block.h"
#include "rig/pose.h"
#include "support/bombs.h"
#include "support/heap.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

struct Copy {
  std::shared_ptr<std::uint8_t> owner;
  std::span<const std::uint8_t> bytes;
};

Copy copy(std::span<const std::uint8_t> block) {
  const auto owner = core::allocate_pages(block.size());
  std::ranges::copy(block, owner.get());
  return {owner, {owner.get(), block.size()}};
}

// Limits of heap memory. Opening a block takes at most the block's size plus kBeside bytes. Two
// workspaces and a pose take at most kTimesTheBlock times the block's size plus kBeside bytes. The
// second limit holds only for rigs that compile() made: their scratch memory has the lengths of
// lists in the block. The workspaces of a forged block may be far larger.
constexpr std::size_t kTimesTheBlock = 4, kBeside = 16 * 1024;

class RigMemory : public testing::TestWithParam<Bomb> {};

TEST_P(RigMemory, GrowsWithTheBlock) {
  for (const std::uint16_t n : {std::uint16_t{500}, std::uint16_t{1000}}) {
    const auto compiled = compile::compile(GetParam().make(n));
    ASSERT_TRUE(compiled.has_value()) << compiled.error().describe();
    const Copy block = copy(compiled->block());
    const HeapCount heap;
    const auto rig = open_rig(block.bytes, block.owner, BlockCheck::kFull, *compiled->kernels);
    ASSERT_TRUE(rig.has_value()) << rig.error().describe();
    const std::size_t opened = heap.peak();
    const HeapCount evaluated;
    const Workspace one = make_workspace(*rig), batch = make_batch_workspace(*rig);
    const Pose pose = make_pose(*rig);
    EXPECT_LE(opened, block.bytes.size() + kBeside) << n;
    EXPECT_LE(evaluated.peak(), kTimesTheBlock * block.bytes.size() + kBeside) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Every, RigMemory, testing::ValuesIn(kBombs),
                         [](const auto& about) { return std::string(about.param.name); });

}  // namespace
}  // namespace risorius::rig
