// SPDX-License-Identifier: MIT
// Compares the skinning kernel of each instruction set with two lower bounds: skin_bench. 24,000
// vertices with 12 influences, 870 bones: random bones for each influence, or bones near each other
// as on a face. Bound (a) is the time to read and write the kernel's bytes once; bound (b) is the
// time to issue the kernel's loads and multiply-adds on data in the first-level cache.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <random>
#include <vector>

#include "bench/clocks.h"
#include "bench/issue.h"
#include "bench/machine.h"
#include "bench/tight_read.h"
#include "rig/outputs/skin.h"

namespace {

using namespace risorius;

constexpr std::uint32_t kVertices = 24000, kInfluences = 12, kBones = 870;

struct Times {
  double median = 0, least = 0;  // us
};

// Measures each step `rounds` times, in turn with the others, so that other load of the machine
// affects all steps alike.
// Out: median and least time of each step, in us
std::vector<Times> measure(const std::vector<std::function<void()>>& steps, std::size_t rounds) {
  std::vector<std::vector<double>> all(steps.size());
  for (std::size_t r = 0; r < rounds; ++r) {
    for (std::size_t s = 0; s < steps.size(); ++s) {
      steps[s]();  // replaces the caches' content from other steps
      all[s].push_back(1e6 * bench::wall_seconds_of(steps[s]));
    }
  }
  std::vector<Times> out;
  for (std::vector<double>& times : all) {
    std::ranges::sort(times);
    out.push_back({times[times.size() / 2], times.front()});
  }
  return out;
}

struct Problem {
  rig::Skin skin;
  std::vector<float> matrices, points, out;
  core::AlignedVector<float> rows;
};

// A mesh with random weights.
// In: spread  number of neighbouring bones from which the bones of a vertex are chosen; kBones: the
//             bones are chosen from all bones
Problem make_problem(std::uint32_t spread) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(0.01f, 1.0f);
  std::vector<std::uint32_t> offsets(kVertices + 1), bones;
  std::vector<float> weights;
  for (std::uint32_t v = 0; v < kVertices; ++v) {
    const std::uint32_t first = v * (kBones - spread) / kVertices;
    for (std::uint32_t i = 0; i < kInfluences; ++i) {
      bones.push_back(first + static_cast<std::uint32_t>(random() % spread));
      weights.push_back(any(random));
    }
    offsets[v + 1] = static_cast<std::uint32_t>(bones.size());
  }
  Problem problem{
      rig::make_skin(kVertices, offsets, bones, weights, kBones).value(), {}, {}, {}, {}};
  problem.points.resize(kVertices * 3);
  problem.out.resize(kVertices * 3);
  problem.matrices.resize(kBones * 12);
  problem.rows.resize((kBones + 1) * simd::kSkinRow);
  for (float& p : problem.points) p = any(random);
  for (float& m : problem.matrices) m = any(random);
  return problem;
}

void read_whole(const void* memory, std::size_t bytes) {
  const bench::Lines lines{0, static_cast<std::uint32_t>(bytes / 64)};
  benchmark::DoNotOptimize(bench::tight_read(memory, {&lines, 1}));
}

// The address of the first whole cache line in `values`.
template <class T>
const void* on_a_line(const std::vector<T>& values) {
  const auto address = reinterpret_cast<std::uintptr_t>(values.data());
  return reinterpret_cast<const void*>((address + 63) / 64 * 64);
}

void stream(Problem& p) {
  read_whole(p.skin.weights.data(), p.skin.weights.size() * 4);
  read_whole(on_a_line(p.skin.bones), p.skin.bones.size() * 2 - 64);
  read_whole(on_a_line(p.skin.vertices), p.skin.vertices.size() * 2 - 64);
  read_whole(p.rows.data(), p.rows.size() * 4);
  std::memcpy(p.out.data(), p.points.data(), p.points.size() * 4);
  benchmark::ClobberMemory();
}

void compare(const char* name, std::uint32_t spread) {
  Problem p = make_problem(spread);
  const std::size_t bytes = p.skin.memory_bytes() + (p.rows.size() + 2 * p.points.size()) * 4;
  std::printf("\nbones %s: %.2f MB\n", name, static_cast<double>(bytes) / 1e6);
  std::printf("%-8s %9s %9s %9s %9s %7s   %s\n", "set", "kernel", "(a)", "(b)", "least", "ratio",
              "ratio of the least times");
  for (const char* set : {"avx512", "avx2", "sse4", "neon", "scalar"}) {
    const simd::Kernels* kernels = simd::find_kernels(set);
    if (kernels == nullptr) continue;
    kernels->skin_rows(p.matrices.data(), kBones, p.rows.data());
    const auto t = measure(
        {[&] {
           rig::evaluate_skin(p.skin, *kernels, p.rows.data(), p.points.data(), p.out.data());
           benchmark::ClobberMemory();
         },
         [&] { stream(p); }, [&] { bench::issue_skin(set, std::size_t{kVertices} * kInfluences); }},
        300);
    const double floor = std::max(t[1].median, t[2].median),
                 least = std::max(t[1].least, t[2].least);
    std::printf("%-8s %9.1f %9.1f %9.1f %9.1f %7.2f   %.2f\n", set, t[0].median, t[1].median,
                t[2].median, t[0].least, t[0].median / floor, t[0].least / least);
  }
}

}  // namespace

int main() {
  std::printf("%s, %s, commit %s; us, medians\n", bench::processor().c_str(), bench::compiler(),
              bench::commit());
  compare("anywhere", kBones);
  compare("near each other", 40);
  return 0;
}
