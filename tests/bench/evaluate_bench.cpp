// SPDX-License-Identifier: MIT
// Measures one evaluation: evaluate_bench FILE.dna [Google Benchmark's options]. 8, 23 or 100 % of
// the raw controls are active; each frame has other active controls and other values. "morph" is
// one evaluation of the blend shapes of a generated mesh.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bytes/source.h"
#include "compile/compile.h"
#include "dna/file/parse.h"
#include "rig/stages/evaluate.h"

namespace {

using namespace risorius;

constexpr std::size_t kFrames = 256;

std::vector<float> make_frames(std::size_t raw, std::size_t active) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(0.05f, 1.0f);
  std::uniform_int_distribution<std::size_t> place(0, raw - 1);
  std::vector<float> frames(kFrames * raw, 0.0f);
  for (std::size_t f = 0; f < kFrames; ++f) {
    for (std::size_t set = 0; set < active;) {
      float& control = frames[f * raw + place(random)];
      if (control != 0.0f) continue;
      control = value(random);
      ++set;
    }
  }
  return frames;
}

void evaluate_frames(benchmark::State& state, const rig::Rig& rig, std::size_t active,
                     std::uint32_t lod) {
  const std::vector<float> frames = make_frames(rig.raw_count, active);
  rig::Workspace work = rig::make_workspace(rig);
  rig::Pose pose = rig::make_pose(rig);
  std::size_t frame = 0;
  for (auto _ : state) {
    rig::evaluate(rig, frames.data() + frame * rig.raw_count, lod, true, work, pose);
    benchmark::DoNotOptimize(pose.joints.data());
    frame = (frame + 1) % kFrames;
  }
}

void evaluate_shapes(benchmark::State& state) {
  constexpr std::uint32_t vertices = 24000, channels = 800, active = 60, per_channel = 800;
  rig::Morph morph;
  morph.vertex_count = vertices;
  morph.channel_count = channels;
  std::mt19937 random(8);
  for (std::uint32_t c = 0; c < channels; ++c) {
    morph.channels.push_back(static_cast<std::uint16_t>(c));
    morph.channel_offsets.push_back(c * per_channel);
    const std::uint32_t first = static_cast<std::uint32_t>(random() % (vertices - 2 * per_channel));
    for (std::uint32_t i = 0; i < per_channel; ++i) {
      morph.deltas.push_back({first + 2 * i, 0.1f, 0.2f, 0.3f});
    }
  }
  morph.channel_offsets.push_back(channels * per_channel);
  std::vector<float> weights(channels, 0.0f), base(vertices * 3, 1.0f), out(vertices * 3);
  for (std::uint32_t i = 0; i < active; ++i) weights[i * 13] = 0.5f;
  for (auto _ : state) {
    rig::evaluate_morph(morph, weights.data(), base.data(), out.data());
    benchmark::DoNotOptimize(out.data());
  }
}

std::unique_ptr<rig::Rig> load(const char* path, const simd::Kernels* kernels) {
  auto source = bytes::open_file(path);
  if (!source) return nullptr;
  const auto dna = dna::parse(**source);
  if (!dna) return nullptr;
  compile::CompileOptions options;
  options.kernels = kernels;
  auto rig = compile::compile(*dna, options);
  return rig ? std::make_unique<rig::Rig>(std::move(rig).value()) : nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: evaluate_bench FILE.dna [options]\n", stderr);
    return 2;
  }
  std::vector<std::unique_ptr<rig::Rig>> rigs;
  for (const simd::Kernels* kernels : {&simd::scalar_kernels(), simd::avx2_kernels()}) {
    if (kernels == nullptr) continue;
    rigs.push_back(load(argv[1], kernels));
    if (rigs.back() == nullptr || rigs.back()->raw_count == 0) {
      std::fprintf(stderr, "%s: cannot be read or has no controls\n", argv[1]);
      return 1;
    }
    const rig::Rig* rig = rigs.back().get();
    for (const std::size_t share : {8u, 23u, 100u}) {
      const std::size_t active = std::max<std::size_t>(1, (rig->raw_count * share + 50) / 100);
      for (const std::uint32_t lod : {0u, rig->lod_count / 2}) {
        const std::string name = std::string("evaluate/") + kernels->name +
                                 "/active:" + std::to_string(active) +
                                 "/lod:" + std::to_string(lod);
        benchmark::RegisterBenchmark(name.c_str(), [rig, active, lod](benchmark::State& state) {
          evaluate_frames(state, *rig, active, lod);
        });
      }
    }
  }
  benchmark::RegisterBenchmark("morph/active:60/vertices:800", evaluate_shapes);
  int rest = argc - 1;
  argv[1] = argv[0];
  benchmark::Initialize(&rest, argv + 1);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
