// SPDX-License-Identifier: MIT
// The evaluator against a scalar CSR matrix:
//   rig_bench FILE.dna [FRAMES20.f32 FRAMES60.f32 FRAMES_ALL.f32] [--sweep] [options of the
//   library]
// Frames are little-endian float32[frames, raw controls]; without files their like is made.
// --sweep measures how cost grows instead, and prints a row per point: what, x, us, us of csr.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bench/clocks.h"
#include "bench/csr.h"
#include "bench/frames.h"
#include "bench/machine.h"
#include "bytes/source.h"
#include "compile/compile.h"
#include "dna/file/parse.h"
#include "rig/block.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/instance.h"

namespace {

using namespace risorius;
using bench::Frames;

// A row of the table: what it is measured against, and what was asked of it.
struct Line {
  const char *name, *base, *asked;
};
constexpr Line kLines[] = {{"csr, 20 active", "", ""},
                           {"csr, 60 active", "", ""},
                           {"csr, all active", "", ""},
                           {"one face, 20 active", "csr, 20 active", "60"},
                           {"one face, 60 active", "csr, 60 active", "40"},
                           {"one face, all active", "csr, all active", ""},
                           {"float16, 20 active", "csr, 20 active", ""},
                           {"float16, 60 active", "csr, 60 active", ""},
                           {"float16, all active", "csr, all active", ""},
                           {"quaternions, 60 active", "csr, 60 active", "30"},
                           {"csr, LOD 4, 60 active", "", ""},
                           {"LOD 4, 60 active", "csr, LOD 4, 60 active", ""},
                           {"csr, cold, 60 active", "", ""},
                           {"cold, 60 active", "csr, cold, 60 active", "25"},
                           {"float16, cold, 60 active", "csr, cold, 60 active", ""},
                           {"crowd of 64, 20 active", "csr, 20 active", ""},
                           {"crowd of 64, 60 active", "csr, 60 active", "100"},
                           {"crowd of 64, all active", "csr, all active", ""},
                           {"clip of 1000, 60 active", "csr, 60 active", "100"},
                           {"clip, two cores, 60 active", "csr, 60 active", ""},
                           {"two cores, 64 faces each", "csr, 60 active", ""},
                           {"no change", "", ""},
                           {"LOD switched and evaluated", "", ""},
                           {"compile", "", ""},
                           {"open a block, header checked", "", ""},
                           {"open a block, all checked", "", ""}};

std::shared_ptr<rig::Rig> compiled(const dna::Dna& dna,
                                   compile::Precision precision = compile::Precision::kFloat32,
                                   compile::Rotation rotation = compile::Rotation::kEuler) {
  compile::CompileOptions options;
  options.precision = precision;
  options.rotation = rotation;
  auto rig = compile::compile(dna, options);
  if (!rig) {
    std::fprintf(stderr, "rig_bench: %s\n", rig.error().describe().c_str());
    std::exit(1);
  }
  return std::make_shared<rig::Rig>(std::move(rig).value());
}

using Step = std::function<void(const float*)>;

Step one_face(std::shared_ptr<const rig::Rig> rig, std::uint32_t lod) {
  auto work = std::make_shared<rig::Workspace>(rig::make_workspace(*rig));
  auto pose = std::make_shared<rig::Pose>(rig::make_pose(*rig));
  return [rig, lod, work, pose](const float* raw) {
    rig::evaluate(*rig, raw, lod, true, *work, *pose);
    benchmark::DoNotOptimize(pose->joints.data());
  };
}
Step csr(const dna::Dna& dna, std::uint32_t lod) {
  auto base = std::make_shared<bench::Baseline>(dna, lod);
  return [base](const float* raw) { base->evaluate(raw); };
}

// Never the same frame twice in a row.
void add(const std::string& name, Step step, const Frames& frames) {
  benchmark::RegisterBenchmark(name.c_str(), [&frames, step](benchmark::State& state) {
    std::size_t f = 0;
    for (auto _ : state) {
      step(frames.at(f));
      f = (f + 1) % frames.count;
    }
  });
}

void add_cold(const std::string& name, Step step, const Frames& frames) {
  auto* b = benchmark::RegisterBenchmark(name.c_str(), [&frames, step](benchmark::State& state) {
    std::size_t f = 0;
    for (auto _ : state) {
      bench::empty_caches();
      state.SetIterationTime(bench::wall_seconds_of([&] { step(frames.at(f)); }));
      f = (f + 1) % frames.count;
    }
  });
  b->UseManualTime()->Iterations(1)->Repetitions(61);
}

// Many frames or faces at once, in as many threads. By the clock on the wall, in several rounds:
// to begin a thread on an idle core of a virtual machine takes as long as hundreds of frames.
void add_batch(const std::string& name, std::shared_ptr<const rig::Rig> rig, const Frames& frames,
               std::size_t count, std::size_t threads, std::size_t rounds = 1) {
  auto* b = benchmark::RegisterBenchmark(name.c_str(), [=, &frames](benchmark::State& state) {
    const std::size_t n = std::min(count, frames.count);
    const std::size_t sizes[4] = {std::size_t{rig->joint_count} * rig->joint_stride,
                                  rig->blend_shape_count, rig->animated_map_count,
                                  rig->control_count};
    std::vector<float> out[4];
    for (int i = 0; i < 4; ++i) out[i].resize(n * sizes[i]);
    std::vector<std::unique_ptr<rig::Workspace>> work;
    for (std::size_t t = 0; t < threads; ++t) {
      work.push_back(std::make_unique<rig::Workspace>(rig::make_batch_workspace(*rig)));
    }
    const auto part = [&](std::size_t t) {
      const std::size_t begin = n * t / threads, end = n * (t + 1) / threads;
      for (std::size_t r = 0; r < rounds; ++r) {
        rig::evaluate_frames(*rig, frames.at(begin), end - begin, 0, true, *work[t],
                             {out[0].data() + begin * sizes[0], out[1].data() + begin * sizes[1],
                              out[2].data() + begin * sizes[2], out[3].data() + begin * sizes[3]});
      }
    };
    for (auto _ : state) {
      const double seconds = bench::wall_seconds_of([&] {
        std::vector<std::thread> others;
        for (std::size_t t = 1; t < threads; ++t) others.emplace_back(part, t);
        part(0);
        for (std::thread& other : others) other.join();
      });
      state.SetIterationTime(seconds / static_cast<double>(n * rounds));
    }
  });
  b->UseManualTime()->Iterations(static_cast<benchmark::IterationCount>(2000 / count + 2));
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

std::size_t kept_coefficients(const rig::Rig& rig, std::uint32_t lod) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < rig.joint_groups.size(); ++i) {
    n += std::size_t{rig.joint_group_lods[i * rig.lod_count + lod]} *
         rig.joint_groups[i].column_count;
  }
  return n;
}

using Medians = std::map<std::string, double>;  // ns

class Suite {
 public:
  Suite(const dna::Dna& dna, const std::vector<Frames>& frames) : dna_(dna), frames_(frames) {
    rig_ = compiled(dna);
    half_ = compiled(dna, compile::Precision::kFloat16);
    coarse_ = std::min<std::uint32_t>(4, rig_->lod_count - 1);
  }

  void add_all() {
    static const char* const kActive[] = {"20 active", "60 active", "all active"};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::string active = kActive[a];
      add("csr, " + active, csr(dna_, 0), frames_[a]);
      add("one face, " + active, one_face(rig_, 0), frames_[a]);
      add("float16, " + active, one_face(half_, 0), frames_[a]);
      add_batch("crowd of 64, " + active, rig_, frames_[a], 64, 1);
    }
    const Frames& some = frames_[1];
    add("quaternions, 60 active",
        one_face(compiled(dna_, compile::Precision::kFloat32, compile::Rotation::kQuaternion), 0),
        some);
    add("csr, LOD 4, 60 active", csr(dna_, coarse_), some);
    add("LOD 4, 60 active", one_face(rig_, coarse_), some);
    add_cold("csr, cold, 60 active", csr(dna_, 0), some);
    add_cold("cold, 60 active", one_face(rig_, 0), some);
    add_cold("float16, cold, 60 active", one_face(half_, 0), some);
    add_batch("two cores, 64 faces each", rig_, some, 128, 2, 60);
    add_batch("clip of 1000, 60 active", rig_, some, 1000, 1);
    add_batch("clip, two cores, 60 active", rig_, some, 1000, 2, 8);
    add_read("read float32", rig_->joint_values);
    add_read("read float16", half_->joint_halves);
    add_instance(some);
    add_making();
  }

  void print(const Medians& ns) const {
    const auto at = [&](const std::string& name) {
      const auto found = ns.find(name);
      return found == ns.end() ? 0.0 : found->second;
    };
    const bench::Baseline base(dna_, 0);
    const auto coefficients = static_cast<double>(base.matrix().values.size());
    const std::size_t values = rig_->joint_values.size() - simd::kWidest;
    std::printf("%s, %s, commit %s, %s kernels\n", bench::processor().c_str(), bench::compiler(),
                bench::commit(), rig_->kernels->name);
    std::printf("%zu coefficients, %.0f of them not 0 (padding: none); csr takes %.2f ns each\n\n",
                values, coefficients, at("csr, all active") / coefficients);
    std::printf("%-30s %11s %10s %8s\n", "", "us", "times csr", "asked");
    for (const Line& line : kLines) {
      if (at(line.name) == 0) continue;
      std::printf("%-30s %11.3f", line.name, at(line.name) / 1e3);
      if (at(line.base) > 0) std::printf(" %10.1f %8s", at(line.base) / at(line.name), line.asked);
      std::puts("");
    }
    std::printf(
        "\nall active, times a plain read of the values (asked: at most 1.25 and 1.5):\n"
        "  float32 %.2f, float16 %.2f\n",
        at("one face, all active") / at("read float32"),
        at("float16, all active") / at("read float16"));
    std::printf("LOD 4 has %.2f of the coefficients and takes %.2f of the time\n",
                static_cast<double>(kept_coefficients(*rig_, coarse_)) /
                    static_cast<double>(kept_coefficients(*rig_, 0)),
                at("LOD 4, 60 active") / at("one face, 60 active"));
    std::printf("two cores: %.2f times one (asked: 1.8)\n",
                at("crowd of 64, 60 active") / at("two cores, 64 faces each"));
    std::printf("bytes: float32 %zu, float16 %zu; the values alone %zu\n", rig_->memory_bytes(),
                half_->memory_bytes(), values * 4);
  }

 private:
  void add_instance(const Frames& frames) {
    benchmark::RegisterBenchmark("no change", [this, &frames](benchmark::State& state) {
      rig::Instance face(*rig_);
      for (auto _ : state) benchmark::DoNotOptimize(face.evaluate(frames.at(0)).joints.data());
    });
    benchmark::RegisterBenchmark(
        "LOD switched and evaluated", [this, &frames](benchmark::State& state) {
          rig::Instance face(*rig_);
          std::uint32_t lod = 0;
          std::size_t f = 0;
          for (auto _ : state) {
            face.set_lod(lod ^= 1u);
            benchmark::DoNotOptimize(face.evaluate(frames.at(f)).joints.data());
            f = (f + 1) % frames.count;
          }
        });
  }
  void add_making() {
    benchmark::RegisterBenchmark("compile", [this](benchmark::State& state) {
      for (auto _ : state) benchmark::DoNotOptimize(compiled(dna_));
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

  const dna::Dna& dna_;
  const std::vector<Frames>& frames_;
  std::shared_ptr<rig::Rig> rig_, half_;
  std::uint32_t coarse_ = 0;
};

// How cost grows: each point as "what/x" beside "csr what/x".
class Sweep {
 public:
  Sweep(const dna::Dna& dna, const Frames& frames) : dna_(dna), frames_(frames) {
    rig_ = compiled(dna);
  }

  void add_all() {
    const std::size_t raw = rig_->raw_count;
    for (std::size_t n = 1; n < raw; n += std::max<std::size_t>(1, n / 2)) add_active(n);
    add_active(raw);
    for (std::uint32_t lod = 0; lod < rig_->lod_count; ++lod) {
      pair("LOD", kept_coefficients(*rig_, lod), one_face(rig_, lod), csr(dna_, lod), frames_);
    }
    for (std::size_t n = dna_.behavior.joint_groups.size(); n > 0; n /= 2) add_groups(n);
    for (const std::size_t n : {1u, 2u, 4u, 8u, 16u, 64u, 256u, 1000u}) {
      add_batch("faces/" + std::to_string(n), rig_, frames_, n, 1);
    }
    for (std::size_t n = 1; n <= std::max(1u, std::thread::hardware_concurrency()); ++n) {
      add_batch("cores/" + std::to_string(n), rig_, frames_, 64 * n, n, 60);
    }
  }

  void print(const Medians& ns) const {
    std::printf("# %s, %s, commit %s, %s kernels\nwhat,x,us,csr\n", bench::processor().c_str(),
                bench::compiler(), bench::commit(), rig_->kernels->name);
    for (const auto& [name, time] : ns) {
      if (name.starts_with("csr ")) continue;
      const std::size_t slash = name.find('/');
      const auto base = ns.find("csr " + name);
      std::printf("%s,%s,%.4f,", name.substr(0, slash).c_str(), name.substr(slash + 1).c_str(),
                  time / 1e3);
      if (base != ns.end()) std::printf("%.4f", base->second / 1e3);
      std::puts("");
    }
  }

 private:
  void pair(const std::string& what, std::size_t x, Step ours, Step base, const Frames& frames) {
    const std::string name = what + "/" + std::to_string(x);
    add(name, std::move(ours), frames);
    add("csr " + name, std::move(base), frames);
  }
  void add_active(std::size_t n) {
    made_.push_back(std::make_unique<Frames>(bench::make_frames(rig_->raw_count, n)));
    pair("active controls", n, one_face(rig_, 0), csr(dna_, 0), *made_.back());
  }
  // The same face with some of its joint groups only.
  void add_groups(std::size_t n) {
    smaller_.push_back(std::make_unique<dna::Dna>(dna_));
    auto& groups = smaller_.back()->behavior.joint_groups;
    groups = std::vector<dna::JointGroup>(groups.begin(),
                                          groups.begin() + static_cast<std::ptrdiff_t>(n));
    auto rig = compiled(*smaller_.back());
    const std::size_t joints = rig->joints_written.size();
    pair("joints", joints, one_face(std::move(rig), 0), csr(*smaller_.back(), 0), frames_);
  }

  const dna::Dna& dna_;
  const Frames& frames_;
  std::shared_ptr<rig::Rig> rig_;
  std::vector<std::unique_ptr<Frames>> made_;
  std::vector<std::unique_ptr<dna::Dna>> smaller_;
};

// Keeps the medians. In: progress  on one line of a terminal what runs
class Reporter : public benchmark::ConsoleReporter {
 public:
  explicit Reporter(bool progress) : progress_(progress) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type == Run::RT_Aggregate && run.aggregate_name == "median") {
        const bool manual = run.run_name.time_type == "manual_time";
        ns[run.run_name.function_name] =
            manual ? run.GetAdjustedRealTime() : run.GetAdjustedCPUTime();
      } else if (progress_ && run.run_type == Run::RT_Iteration && run.repetition_index == 0) {
        std::fprintf(stderr, "\r%-50s", run.run_name.function_name.c_str());
      }
    }
  }
  void Finalize() override {
    if (progress_) std::fprintf(stderr, "\r%50s\r", "");
  }
  bool ReportContext(const Context&) override { return true; }
  Medians ns;

 private:
  bool progress_;
};

core::Result<dna::Dna> read(const char* path) {
  auto source = core::open_file(path);
  if (!source) return core::Unexpected{source.error()};
  return dna::parse(**source);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs(
        "usage: rig_bench FILE.dna [FRAMES20 FRAMES60 FRAMES_ALL] [--sweep] [--progress] "
        "[options]\n",
        stderr);
    return 2;
  }
  const auto dna = read(argv[1]);
  if (!dna) {
    std::fprintf(stderr, "rig_bench: %s\n", dna.error().describe().c_str());
    return 1;
  }
  const std::size_t raw = dna->definition.raw_control_names.size();
  if (raw == 0 || dna->descriptor.lod_count == 0) {
    std::fprintf(stderr, "rig_bench: %s: a face with controls and LODs was expected\n", argv[1]);
    return 1;
  }
  const bool files = argc >= 5 && argv[2][0] != '-';
  std::vector<Frames> frames;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t active[] = {std::min<std::size_t>(20, raw), std::min<std::size_t>(60, raw),
                                  raw};
    auto list = files ? bench::read_frames(argv[2 + a], raw) : bench::make_frames(raw, active[a]);
    if (list.count == 0) {
      std::fprintf(stderr, "rig_bench: %s: frames of %zu float32 were expected\n", argv[2 + a],
                   raw);
      return 1;
    }
    frames.push_back(std::move(list));
  }
  const int first = files ? 5 : 2;
  int option = first;
  const auto asked_for = [&](const char* name) {
    const bool found = option < argc && std::strcmp(argv[option], name) == 0;
    option += found ? 1 : 0;
    return found;
  };
  const bool sweep = asked_for("--sweep"), progress = asked_for("--progress");
  std::string repetitions = "--benchmark_repetitions=9",
              mixed = "--benchmark_enable_random_interleaving=true",
              time = "--benchmark_min_time=0.05";
  std::vector<char*> arguments{argv[0], repetitions.data(), mixed.data(), time.data()};
  for (int i = option; i < argc; ++i) arguments.push_back(argv[i]);
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;
  Suite suite(*dna, frames);
  Sweep growth(*dna, frames[1]);
  sweep ? growth.add_all() : suite.add_all();
  Reporter reporter(progress);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  sweep ? growth.print(reporter.ns) : suite.print(reporter.ns);
  return 0;
}
