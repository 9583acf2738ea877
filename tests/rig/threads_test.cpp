// SPDX-License-Identifier: MIT
// One Rig in eight threads gives each thread the same poses as alone. The preset `tsan` runs the
// tests of OneRig with the thread sanitizer.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "core/parallel_for.h"
#include "rig/block.h"
#include "rig/direct/direct_face.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/instance.h"
#include "support/face.h"
#include "support/full_face.h"

namespace risorius::rig {
namespace {

using compile::CompileOptions;

constexpr std::size_t kThreads = 8, kTurns = 40, kFramesEach = 11;

// Two variants of compiling: Euler angles with float16, and quaternions with float32.
std::vector<CompileOptions> ways() {
  CompileOptions halves, quaternions;
  halves.precision = compile::Precision::kFloat16;
  quaternions.rotation = compile::Rotation::kQuaternion;
  return {halves, quaternions};
}

Rig full_rig(const CompileOptions& options) {
  core::Result<Rig> rig = compile::compile(testing_support::make_full_face(), options);
  if (!rig) std::abort();
  return std::move(rig).value();
}

// The raw controls of make_full_face in frame n of an animation: a jaw moves, and a quaternion
// rotates.
std::vector<float> frame(std::size_t n) {
  const float jaw = static_cast<float>(n % 5) / 4.0f;
  const float side = static_cast<float>(n % 3) * 0.48f;  // 0, 0.48, 0.96
  const float w = n % 3 == 0 ? 1.0f : (n % 3 == 1 ? 0.8772684f : 0.28f);
  return {jaw, 0.0f, side, 0.0f, w};
}

bool same(const Pose& a, const Pose& b) {
  return a.joints == b.joints && a.blend_shapes == b.blend_shapes &&
         a.animated_maps == b.animated_maps && a.controls == b.controls;
}

// Runs body(thread) in kThreads threads, which begin at the same time.
template <class Body>
void together(const Body& body) {
  std::atomic<std::size_t> waiting{kThreads};
  std::vector<std::jthread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&body, &waiting, t] {
      for (--waiting; waiting != 0;) std::this_thread::yield();
      body(t);
    });
  }
}

TEST(OneRig, GivesEveryWorkspaceWhatItGivesOneAlone) {
  for (const CompileOptions& way : ways()) {
    const Rig rig = full_rig(way);
    std::vector<Pose> wanted;
    for (std::size_t n = 0; n < kTurns; ++n) {
      wanted.push_back(
          testing_support::evaluate_once(rig, frame(n), static_cast<std::uint32_t>(n % 2)));
    }
    EXPECT_FALSE(same(wanted[0], wanted[2]));
    std::atomic<int> wrong{0};
    together([&](std::size_t t) {
      Workspace work = make_workspace(rig);
      Pose pose = make_pose(rig);
      for (std::size_t turn = 0; turn < kTurns; ++turn) {
        const std::size_t n = (turn + 5 * t) % kTurns;
        evaluate(rig, frame(n).data(), static_cast<std::uint32_t>(n % 2), true, work, pose);
        wrong += same(pose, wanted[n]) ? 0 : 1;
      }
    });
    EXPECT_EQ(wrong, 0);
  }
}

TEST(OneRig, GivesEveryInstanceItsOwnPast) {
  for (const CompileOptions& way : ways()) {
    const Rig rig = full_rig(way);
    // The last pose of an Instance that evaluates kTurns frames from `first` on, and then frame
    // `first` again.
    const auto film = [&rig](std::size_t first) {
      Instance face(rig);
      face.set_mask(0, static_cast<float>(first % 2));
      for (std::size_t n = first; n < first + kTurns; ++n) {
        face.set_lod(n / 8 % 2);
        (void)face.evaluate(frame(n).data());
      }
      return face.evaluate(frame(first).data());
    };
    std::vector<Pose> wanted;
    for (std::size_t t = 0; t < kThreads; ++t) wanted.push_back(film(t));
    std::atomic<int> wrong{0};
    together([&](std::size_t t) { wrong += same(film(t), wanted[t]) ? 0 : 1; });
    EXPECT_EQ(wrong, 0);
  }
}

TEST(OneRig, GivesABatchOnEightThreadsTheFramesAlone) {
  for (const CompileOptions& way : ways()) {
    const Rig rig = full_rig(way);
    constexpr std::size_t kCount = kThreads * kFramesEach;
    std::vector<float> raw, joints(kCount * rig.joint_count * rig.joint_stride),
        shapes(kCount * rig.blend_shape_count), maps(kCount * rig.animated_map_count),
        controls(kCount * rig.control_count);
    for (std::size_t n = 0; n < kCount; ++n) {
      const std::vector<float> values = frame(n);
      raw.insert(raw.end(), values.begin(), values.end());
    }
    core::parallel_for(kCount, kThreads, [&](std::size_t begin, std::size_t end) {
      Workspace work = make_batch_workspace(rig);
      const PoseView first{joints.data() + begin * rig.joint_count * rig.joint_stride,
                           shapes.data() + begin * rig.blend_shape_count,
                           maps.data() + begin * rig.animated_map_count,
                           controls.data() + begin * rig.control_count};
      evaluate_frames(rig, raw.data() + begin * rig.raw_count, end - begin, 0, true, work, first);
    });
    for (std::size_t n = 0; n < kCount; ++n) {
      const Pose alone = testing_support::evaluate_once(rig, frame(n));
      const float* row = joints.data() + n * alone.joints.size();
      EXPECT_TRUE(std::equal(alone.joints.begin(), alone.joints.end(), row)) << n;
      row = controls.data() + n * alone.controls.size();
      EXPECT_TRUE(std::equal(alone.controls.begin(), alone.controls.end(), row)) << n;
    }
  }
}

TEST(OneRig, MayBeLetGoByThreadsInAnyOrder) {
  std::atomic<int> wrong{0};
  {
    const Rig rig = full_rig({});
    const Pose wanted = testing_support::evaluate_once(rig, frame(1));
    together([&, rig](std::size_t) {
      for (std::size_t turn = 0; turn < kTurns; ++turn) {
        const Rig mine = rig;
        wrong += same(testing_support::evaluate_once(mine, frame(1)), wanted) ? 0 : 1;
      }
    });
  }
  EXPECT_EQ(wrong, 0);
}

TEST(OneRig, SealsItsBlockOnceWhoeverAsksFirst) {
  const Rig rig = full_rig({});
  std::atomic<int> wrong{0};
  together([&, rig](std::size_t) {
    const auto opened = open_rig(rig.block(), nullptr, BlockCheck::kHash, *rig.kernels);
    wrong += opened.has_value() ? 0 : 1;
  });
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(rig.block().data(), Rig(rig).block().data());
}

// The parts of a DirectFace for the rig of make_full_face, with two equal meshes, each of six
// blocks of at most kSkinBlock vertices.
FaceParts many_blocks(const Rig& rig) {
  constexpr std::uint32_t kVertices = 5 * kSkinBlock + 7;
  FaceParts parts;
  parts.rig = std::make_shared<Rig>(rig);
  const std::vector<float> neutral(rig.joint_count * 3, 0.0f);
  parts.space = std::make_shared<BoneSpace>(make_bone_space({}, neutral.data(), 3, {0, 1, 2}));
  std::vector<double> rest;
  for (std::size_t i = 0; i < 48; ++i) rest.push_back(i % 16 % 5 == 0 ? 1.0 : 0.0);
  const std::vector<std::int32_t> parents{-1, 0, 1};
  parts.chain = std::make_shared<JointChain>(make_joint_chain(parents, rest.data()).value());
  parts.rows = {0, 1, 2};
  Morph morph;
  morph.vertex_count = kVertices, morph.channel_count = rig.blend_shape_count;
  morph.channels = {1}, morph.channel_offsets = {0, kVertices};
  FaceParts::Mesh mesh;
  std::vector<std::uint32_t> offsets{0}, bones;
  for (std::uint32_t v = 0; v < kVertices; ++v) {
    morph.deltas.push_back({v, 0.1f, 0.2f, 0.3f});
    mesh.base.insert(mesh.base.end(), {static_cast<float>(v % 97), 1.0f, 2.0f});
    for (std::uint32_t i = 0; i < v % 4; ++i) bones.push_back((v + i) % 3);
    offsets.push_back(static_cast<std::uint32_t>(bones.size()));
  }
  const std::vector<float> weights(bones.size(), 0.4f);
  mesh.skin = std::make_shared<Skin>(make_skin(kVertices, offsets, bones, weights, 3).value());
  mesh.morph = std::make_shared<Morph>(std::move(morph));
  parts.meshes = {mesh, mesh};
  return parts;
}

TEST(OneRig, GivesFacesInAnyNumberOfThreadsTheVerticesOfEachAlone) {
  const Rig rig = full_rig({});
  std::vector<std::vector<std::vector<float>>> all;  // [number of threads][2 * face + mesh]
  for (const std::size_t threads : {1u, 2u, 5u, 8u}) {
    std::vector<std::unique_ptr<DirectFace>> faces;
    std::vector<DirectFace*> pointers;
    std::vector<std::vector<float>> raw, out;
    for (std::size_t f = 0; f < 3; ++f) {
      faces.push_back(DirectFace::make(many_blocks(rig)).value());
      pointers.push_back(faces.back().get());
      for (int m = 0; m < 2; ++m) out.emplace_back(faces[f]->parts().meshes[0].base.size(), 1e30f);
    }
    for (std::size_t n = 0; n < 4; ++n) {
      std::vector<FaceFrame> frames(3);
      for (std::size_t f = 0; f < 3; ++f) {
        raw.push_back(frame(n + f));
        frames[f].targets = {{0, out[2 * f].data()}, {1, out[2 * f + 1].data()}};
      }
      for (std::size_t f = 0; f < 3; ++f) frames[f].raw = raw[3 * n + f].data();
      evaluate_faces(pointers, frames, threads);
      EXPECT_TRUE(frames[0].targets[0].written && frames[2].targets[1].written);
    }
    all.push_back(out);
  }
  for (const auto& out : all) EXPECT_EQ(out, all[0]);
  EXPECT_NE(all[0][0], all[0][2]);  // face 1 shows another frame than face 0
}

// This test is not part of OneRig, which the tsan preset runs, because exceptions pass between
// threads here.
TEST(Parallel, WhatAThreadThrowsIsTheCallers) {
  std::atomic<std::size_t> done = 0;
  const auto body = [&](std::size_t begin, std::size_t end) {
    if (begin > 0) throw std::bad_alloc();
    done += end - begin;
  };
  EXPECT_THROW(core::parallel_for(8, 4, body), std::bad_alloc);
  EXPECT_EQ(done, 2u);
}

}  // namespace
}  // namespace risorius::rig
