// SPDX-License-Identifier: MIT
// Compares opening a compiled face with compiling it: cache_bench FILE.dna
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "bench/machine.h"
#include "bytes/source.h"
#include "compile/compile.h"
#include "dna/file/parse.h"
#include "rig/rig_file.h"
#include "rig/stages/evaluate.h"

namespace {

using namespace risorius;

void add(const char* name, const std::filesystem::path& file, rig::Trust trust, bytes::ReadBy by,
         bool evaluates = false) {
  benchmark::RegisterBenchmark(name, [=](benchmark::State& state) {
    for (auto _ : state) {
      auto rig = rig::open_rig_file(file, trust, by, *simd::find_kernels(nullptr));
      if (!rig) std::abort();
      if (!evaluates) continue;
      rig::Workspace work = rig::make_workspace(*rig);
      rig::Pose pose = rig::make_pose(*rig);
      const std::vector<float> raw(rig->raw_count, 0.5f);
      rig::evaluate(*rig, raw.data(), 0, true, work, pose);
    }
  })->Unit(benchmark::kMicrosecond);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: cache_bench FILE.dna [options]\n", stderr);
    return 2;
  }
  const std::filesystem::path dna_file = argv[1];
  const auto compiled = [&] {
    auto source = bytes::open_file(dna_file);
    if (!source) return core::Result<rig::Rig>(std::move(source).propagate());
    const auto dna = dna::parse(**source);
    return dna ? compile::compile(*dna, {}) : core::Result<rig::Rig>(core::Unexpected{dna.error()});
  };
  const auto rig = compiled();
  const auto file = std::filesystem::temp_directory_path() / "risorius_cache_bench.rig";
  if (!rig || !rig::save_rig(*rig, file)) {
    std::fputs("cache_bench: cannot compile or write\n", stderr);
    return 1;
  }
  std::printf("%s, %s, commit %s, %zu bytes\n", bench::processor().c_str(), bench::compiler(),
              bench::commit(), rig->block().size());
  benchmark::RegisterBenchmark("read the DNA and compile", [&](benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(compiled());
  })->Unit(benchmark::kMicrosecond);
  using bytes::ReadBy;
  add("header checked, mapped", file, rig::Trust::kCaller, ReadBy::kMap);
  add("header checked, copied", file, rig::Trust::kCaller, ReadBy::kCopy);
  add("hash checked, mapped", file, rig::Trust::kOwner, ReadBy::kMap);
  add("hash checked, copied", file, rig::Trust::kOwner, ReadBy::kCopy);
  add("all checked, copied", file, rig::Trust::kNobody, ReadBy::kCopy);
  add("header checked, mapped, first pose of all controls", file, rig::Trust::kCaller, ReadBy::kMap,
      true);
  add("hash checked, copied, first pose of all controls", file, rig::Trust::kOwner, ReadBy::kCopy,
      true);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  std::filesystem::remove(file);
  return 0;
}
