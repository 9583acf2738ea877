// SPDX-License-Identifier: MIT
// The evaluator against a scalar CSR matrix:
//   rig_bench FILE.dna [FRAMES20.f32 FRAMES60.f32 FRAMES_ALL.f32] [Google Benchmark's options]
// Frames are little-endian float32[frames, raw controls]; without files their like is made: a part
// of the raw controls is active, each frame has other values, and every second frame another
// control takes one's place.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "bench/csr.h"
#include "bench/machine.h"
#include "compile/compile.h"
#include "core/source.h"
#include "dna/io.h"

namespace {

using namespace risorius;

struct Frames {
  std::size_t count = 0;
  std::vector<float> values;  // [count, raw]
};

Frames make_frames(std::size_t raw, std::size_t active) {
  constexpr std::size_t kCount = 1024;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(0.05f, 1.0f);
  std::vector<std::size_t> order(raw);
  for (std::size_t i = 0; i < raw; ++i) order[i] = i;
  std::ranges::shuffle(order, random);
  Frames frames{kCount, std::vector<float>(kCount * raw, 0.0f)};
  for (std::size_t f = 0; f < kCount; ++f) {
    if (active < raw && f % 2 == 1) {
      std::swap(order[random() % active], order[active + random() % (raw - active)]);
    }
    for (std::size_t i = 0; i < active; ++i) frames.values[f * raw + order[i]] = value(random);
  }
  return frames;
}

Frames read_frames(const char* path, std::size_t raw) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::size_t>(file.tellg());
  Frames frames{size / (4 * raw), std::vector<float>(size / 4)};
  file.seekg(0);
  file.read(reinterpret_cast<char*>(frames.values.data()), static_cast<std::streamsize>(size));
  return frames;
}

// Of this thread where the system counts it: another program on the machine costs then less.
double now() {
#ifdef CLOCK_THREAD_CPUTIME_ID
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) * 1e-9;
#else
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
#endif
}

double seconds_of(const std::function<void()>& f) {
  const double start = now();
  f();
  return now() - start;
}

// Reads more than every cache holds.
void empty_caches() {
  static std::vector<std::uint64_t> memory((std::size_t{256} << 20) / 8, 1);
  for (std::size_t i = 0; i < memory.size(); i += 8) ++memory[i];
  benchmark::ClobberMemory();
}

class Suite {
 public:
  Suite(const dna::Dna& dna, std::vector<Frames> frames) : dna_(dna), frames_(std::move(frames)) {
    rig_ = compiled(compile::Precision::kFloat32);
    half_ = compiled(compile::Precision::kFloat16);
    base_ = std::make_unique<bench::Baseline>(dna, 0);
    coarse_ = std::min<std::uint32_t>(4, rig_->lod_count - 1);
    coarse_base_ = std::make_unique<bench::Baseline>(dna, coarse_);
  }

  void add_all() {
    static const char* const kActive[] = {"20 active", "60 active", "all active"};
    for (std::size_t a = 0; a < 3; ++a) {
      add(
          std::string("csr, ") + kActive[a], [this, a](const float* raw) { base_->evaluate(raw); },
          a);
      add(std::string("float32, ") + kActive[a], one(*rig_, 0), a);
      add(std::string("float16, ") + kActive[a], one(*half_, 0), a);
    }
    add("csr, LOD 4, 60 active", [this](const float* raw) { coarse_base_->evaluate(raw); }, 1);
    add("float32, LOD 4, 60 active", one(*rig_, coarse_), 1);
    add("csr, cold, 60 active", [this](const float* raw) { base_->evaluate(raw); }, 1, true);
    add("float32, cold, 60 active", one(*rig_, 0), 1, true);
    add_reads();
    add_batches();
    add_instance();
    add_switch();
    add_making();
  }

  void print(const std::map<std::string, double>& ns) const {
    const auto at = [&](const std::string& name) {
      const auto found = ns.find(name);
      return found == ns.end() ? 0.0 : found->second;
    };
    std::printf("\n%s, %s, commit %s, %s kernels\n", bench::processor().c_str(), bench::compiler(),
                bench::commit(), rig_->kernels->name);
    const double coefficients = static_cast<double>(base_->matrix().values.size());
    std::printf("%zu values in the matrices, %.0f of them not 0; csr takes %.2f ns each\n\n",
                rig_->joint_values.size() - simd::kWidest, coefficients,
                at("csr, all active") / coefficients);
    std::printf("%-36s %10s %12s\n", "what", "us", "times csr");
    for (const auto& [name, base] : kRatios) {
      if (ns.count(name) == 0) continue;
      std::printf("%-36s %10.3f", name, at(name) / 1e3);
      if (at(base) > 0) std::printf(" %12.1f", at(base) / at(name));
      std::puts("");
    }
    std::printf(
        "\nall active against a plain read of the values: float32 %.2f, float16 %.2f times\n",
        at("float32, all active") / at("read float32"),
        at("float16, all active") / at("read float16"));
    std::printf("two cores: %.2f times one\n",
                at("batch, 60 active") / at("batch on two cores, 60 active"));
    std::printf("bytes: float32 %zu, float16 %zu; values alone %zu\n", rig_->memory_bytes(),
                half_->memory_bytes(), (rig_->joint_values.size() - simd::kWidest) * 4);
  }

 private:
  static constexpr std::size_t kCrowd = 64;
  using Step = std::function<void(const float*)>;
  static constexpr std::pair<const char*, const char*> kRatios[] = {
      {"csr, 20 active", ""},
      {"csr, 60 active", ""},
      {"csr, all active", ""},
      {"float32, 20 active", "csr, 20 active"},
      {"float32, 60 active", "csr, 60 active"},
      {"float32, all active", "csr, all active"},
      {"float16, 20 active", "csr, 20 active"},
      {"float16, 60 active", "csr, 60 active"},
      {"float16, all active", "csr, all active"},
      {"csr, LOD 4, 60 active", ""},
      {"float32, LOD 4, 60 active", "csr, LOD 4, 60 active"},
      {"csr, cold, 60 active", ""},
      {"float32, cold, 60 active", "csr, cold, 60 active"},
      {"batch, 20 active", "csr, 20 active"},
      {"batch, 60 active", "csr, 60 active"},
      {"batch, all active", "csr, all active"},
      {"batch on two cores, 60 active", "csr, 60 active"},
      {"no change", ""},
      {"LOD switched and evaluated", ""},
      {"compile", ""},
      {"open a block, header checked", ""},
      {"open a block, all checked", ""}};

  std::shared_ptr<rig::Rig> compiled(compile::Precision precision) const {
    compile::CompileOptions options;
    options.precision = precision;
    auto rig = compile::compile(dna_, options);
    if (!rig) {
      std::fprintf(stderr, "rig_bench: %s\n", rig.error().describe().c_str());
      std::exit(1);
    }
    return std::make_shared<rig::Rig>(std::move(rig).value());
  }

  Step one(const rig::Rig& rig, std::uint32_t lod) const {
    auto work = std::make_shared<rig::Workspace>(rig::make_workspace(rig));
    auto pose = std::make_shared<rig::Pose>(rig::make_pose(rig));
    return [&rig, lod, work, pose](const float* raw) {
      rig::evaluate(rig, raw, lod, true, *work, *pose);
      benchmark::DoNotOptimize(pose->joints.data());
    };
  }

  void add(const std::string& name, Step step, std::size_t active, bool cold = false) {
    auto* b = benchmark::RegisterBenchmark(
        name.c_str(), [this, step, active, cold](benchmark::State& state) {
          const Frames& frames = frames_[active];
          std::size_t f = 0;
          for (auto _ : state) {
            if (cold) empty_caches();
            const float* raw = frames.values.data() + f * rig_->raw_count;
            if (cold) {
              state.SetIterationTime(seconds_of([&] { step(raw); }));
            } else {
              step(raw);
            }
            f = (f + 1) % frames.count;
          }
        });
    if (cold) b->UseManualTime()->Iterations(20);
  }

  // The least that any evaluation of everything has to do.
  template <class T>
  void add_read(const char* name, std::span<const T> values) {
    benchmark::RegisterBenchmark(name, [values](benchmark::State& state) {
      for (auto _ : state) {
        std::uint64_t sums[16] = {};
        const auto* words = reinterpret_cast<const std::uint64_t*>(values.data());
        const std::size_t n = values.size_bytes() / 8;
        for (std::size_t i = 0; i + 16 <= n; i += 16) {
          for (std::size_t l = 0; l < 16; ++l) sums[l] += words[i + l];
        }
        benchmark::DoNotOptimize(sums);
      }
    });
  }
  void add_reads() {
    add_read("read float32", rig_->joint_values);
    add_read("read float16", half_->joint_halves);
  }

  void add_batches() {
    static const char* const kNames[] = {"batch, 20 active", "batch, 60 active",
                                         "batch, all active"};
    for (std::size_t a = 0; a < 3; ++a) add_batch(kNames[a], a, 1);
    add_batch("batch on two cores, 60 active", 1, 2);
  }
  void add_batch(const char* name, std::size_t active, std::size_t threads) {
    per_frame_[name] = static_cast<double>(std::min<std::size_t>(kCrowd, frames_[active].count));
    auto* b = benchmark::RegisterBenchmark(name, [this, active, threads](benchmark::State& state) {
      const Frames& frames = frames_[active];
      const std::size_t count = std::min<std::size_t>(kCrowd, frames.count);
      std::vector<float> out[4];
      const std::size_t sizes[4] = {std::size_t{rig_->joint_count} * 9, rig_->blend_shape_count,
                                    rig_->animated_map_count, rig_->control_count};
      for (int i = 0; i < 4; ++i) out[i].resize(count * sizes[i]);
      std::vector<rig::Workspace> work(threads, rig::make_batch_workspace(*rig_));
      const auto part = [&](std::size_t t) {
        const std::size_t begin = count * t / threads, end = count * (t + 1) / threads;
        rig::evaluate_frames(*rig_, frames.values.data() + begin * rig_->raw_count, end - begin, 0,
                             true, work[t],
                             {out[0].data() + begin * sizes[0], out[1].data() + begin * sizes[1],
                              out[2].data() + begin * sizes[2], out[3].data() + begin * sizes[3]});
      };
      for (auto _ : state) {
        state.SetIterationTime(seconds_of([&] {
          std::vector<std::thread> others;
          for (std::size_t t = 1; t < threads; ++t) others.emplace_back(part, t);
          part(0);
          for (std::thread& other : others) other.join();
        }));
      }
    });
    b->UseManualTime();
  }

  void add_instance() {
    benchmark::RegisterBenchmark("no change", [this](benchmark::State& state) {
      rig::Instance face(*rig_);
      for (auto _ : state) {
        benchmark::DoNotOptimize(face.evaluate(frames_[1].values.data()).joints.data());
      }
    });
  }
  void add_switch() {
    benchmark::RegisterBenchmark("LOD switched and evaluated", [this](benchmark::State& state) {
      rig::Instance face(*rig_);
      std::uint32_t lod = 0;
      std::size_t f = 0;
      for (auto _ : state) {
        face.set_lod(lod ^= 1u);
        const float* raw = frames_[1].values.data() + f * rig_->raw_count;
        benchmark::DoNotOptimize(face.evaluate(raw).joints.data());
        f = (f + 1) % frames_[1].count;
      }
    });
  }
  void add_making() {
    benchmark::RegisterBenchmark("compile", [this](benchmark::State& state) {
      for (auto _ : state) benchmark::DoNotOptimize(compiled(compile::Precision::kFloat32));
    });
    for (const bool full : {false, true}) {
      benchmark::RegisterBenchmark(
          full ? "open a block, all checked" : "open a block, header checked",
          [this, full](benchmark::State& state) {
            for (auto _ : state) {
              auto rig = rig::open_rig(rig_->block(), rig_,
                                       full ? rig::BlockCheck::kFull : rig::BlockCheck::kHeader,
                                       *rig_->kernels);
              benchmark::DoNotOptimize(rig.has_value());
            }
          });
    }
  }

 public:
  std::map<std::string, double> per_frame_;  // how many frames one iteration of it has

 private:
  const dna::Dna& dna_;
  std::vector<Frames> frames_;
  std::shared_ptr<rig::Rig> rig_, half_;
  std::unique_ptr<bench::Baseline> base_, coarse_base_;
  std::uint32_t coarse_ = 0;
};

// Keeps the medians.
class Medians : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type == Run::RT_Aggregate && run.aggregate_name == "median") {
        std::string name = run.run_name.function_name;
        const bool manual = run.run_name.time_type == "manual_time";
        ns[name] = manual ? run.GetAdjustedRealTime() : run.GetAdjustedCPUTime();
      }
    }
  }
  std::map<std::string, double> ns;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: rig_bench FILE.dna [FRAMES20 FRAMES60 FRAMES_ALL] [options]\n", stderr);
    return 2;
  }
  auto source = core::open_file(argv[1]);
  const auto dna =
      source ? dna::parse(**source) : core::Result<dna::Dna>(core::Unexpected{source.error()});
  if (!dna) {
    std::fprintf(stderr, "rig_bench: %s\n", dna.error().describe().c_str());
    return 1;
  }
  const std::size_t raw = dna->definition.raw_control_names.size();
  const bool files = argc >= 5 && argv[2][0] != '-';
  std::vector<Frames> frames;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t active[] = {std::min<std::size_t>(20, raw), std::min<std::size_t>(60, raw),
                                  raw};
    frames.push_back(files ? read_frames(argv[2 + a], raw) : make_frames(raw, active[a]));
  }
  Suite suite(*dna, std::move(frames));
  suite.add_all();
  std::string repetitions = "--benchmark_repetitions=9",
              mixed = "--benchmark_enable_random_interleaving=true",
              time = "--benchmark_min_time=0.05";
  std::vector<char*> arguments{argv[0], repetitions.data(), mixed.data(), time.data()};
  for (int i = files ? 5 : 2; i < argc; ++i) arguments.push_back(argv[i]);
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  Medians medians;
  benchmark::RunSpecifiedBenchmarks(&medians);
  for (const auto& [name, per] : suite.per_frame_) {
    if (medians.ns.count(name) != 0) medians.ns[name] /= per;
  }
  suite.print(medians.ns);
  return 0;
}
