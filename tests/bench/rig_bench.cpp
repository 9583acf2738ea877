// SPDX-License-Identifier: MIT
// Compares the evaluator with one scalar CSR (compressed sparse row) matrix of all joint groups:
//   rig_bench FILE.dna [FRAMES20.f32 FRAMES60.f32 FRAMES_ALL.f32] [--sweep] [--progress]
//   [--clip FRAMES.f32] [options of Google Benchmark]
// FRAMES20, FRAMES60 and FRAMES_ALL have 20, 60 and all raw controls active (not 0); without these
// files, such frames are generated. Files are little-endian float32[frames, raw controls].
// --progress shows the name of the running benchmark. --clip adds the frames of a real clip.
// --sweep instead measures how time grows with the size of the work, and prints a row for each
// point: name, x (the size), us, us of csr, us of only reading the columns of active controls.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <deque>
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
#include "bench/tight_read.h"
#include "bytes/source.h"
#include "compile/compile.h"
#include "core/aligned.h"
#include "dna/file/parse.h"
#include "rig/block.h"
#include "rig/stages/evaluate.h"
#include "rig/stages/instance.h"

namespace {

using namespace risorius;
using bench::Frames;

// A row of the table. name: the benchmark; base: the benchmark to which it is compared; read: a
// benchmark that only reads the same columns, or ""; asked: the target as text. If `read` is given,
// the target is a time of at most kReads times the time of `read`, plus kBeside us for other work.
struct Line {
  std::string name, base, read, asked;
  double bytes = 0;  // size of the active columns
};
constexpr double kReads = 1.3, kBeside = 1.3;

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
Step an_instance(std::shared_ptr<const rig::Rig> rig) {
  auto face = std::make_shared<rig::Instance>(*rig);
  return [rig, face](const float* raw) {
    benchmark::DoNotOptimize(face->evaluate(raw).joints.data());
  };
}
Step csr(const dna::Dna& dna, std::uint32_t lod) {
  auto base = std::make_shared<bench::Baseline>(dna, lod);
  return [base](const float* raw) { base->evaluate(raw); };
}

// Adds a benchmark of single evaluations. No frame is evaluated twice in a row.
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

// Adds a benchmark that evaluates many frames or faces together. Several threads are measured by
// wall time and in rounds, because starting a thread on an idle core of a virtual machine takes as
// long as hundreds of frames. One thread is measured by its processor time, which does not count
// the time of other processes.
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
    const auto all = [&] {
      std::vector<std::thread> others;
      for (std::size_t t = 1; t < threads; ++t) others.emplace_back(part, t);
      part(0);
      for (std::thread& other : others) other.join();
    };
    for (auto _ : state) {
      const double seconds =
          threads == 1 ? bench::own_seconds_of(all) : bench::wall_seconds_of(all);
      state.SetIterationTime(seconds / static_cast<double>(n * rounds));
    }
  });
  b->UseManualTime()->Iterations(static_cast<benchmark::IterationCount>(2000 / count + 2));
}

// Adds a benchmark that only reads the columns that an evaluation of these frames needs.
// Out: mean size of these columns per frame, in bytes
double add_read(const std::string& name, std::shared_ptr<const rig::Rig> rig, const Frames& frames,
                std::uint32_t lod) {
  auto reads = std::make_shared<bench::Reads>(bench::reads_of(*rig, frames, lod));
  const double bytes = reads->bytes;
  benchmark::RegisterBenchmark(name.c_str(), [=, &frames](benchmark::State& state) {
    std::size_t f = 0;
    for (auto _ : state) {
      benchmark::DoNotOptimize(bench::tight_read(bench::values_of(*rig), reads->at(f)));
      f = (f + 1) % frames.count;
    }
  });
  return bytes;
}

// Adds a benchmark that stores as many bytes as `count` poses have, with stores that bypass the
// caches. Its result is the time for one pose.
void add_store(const std::string& name, std::shared_ptr<const rig::Rig> rig, std::size_t count) {
  auto* b = benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    const std::size_t pose = std::size_t{rig->joint_count} * rig->joint_stride +
                             rig->blend_shape_count + rig->animated_map_count + rig->control_count;
    core::AlignedVector<float> out(simd::rounded_up(count * pose));
    for (auto _ : state) {
      const double seconds =
          bench::own_seconds_of([&] { bench::streaming_store(out.data(), out.size() * 4); });
      state.SetIterationTime(seconds / static_cast<double>(count));
    }
  });
  b->UseManualTime()->Iterations(4);
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
    turned_ = compiled(dna, compile::Precision::kFloat32, compile::Rotation::kQuaternion);
    coarse_ = std::min<std::uint32_t>(4, rig_->lod_count - 1);
  }

  void add_all() {
    for (const Frames& frames : frames_) add_frames(frames);
    const Frames& some = *std::ranges::find(frames_, "60 active", &Frames::name);
    add_ours("quaternions", turned_, some, 0, "70x");
    add_ours("LOD 4", rig_, some, coarse_, "0.45 of LOD 0", ", LOD 4");
    row("csr, cold, 60 active");
    add_cold("csr, cold, 60 active", csr(dna_, 0), some);
    add_cold(row("cold, 60 active", "csr, cold, 60 active", "20x"), one_face(rig_, 0), some);
    add_cold(row("float16, cold, 60 active", "csr, cold, 60 active"), one_face(half_, 0), some);
    add_batch(row("two cores, 64 faces each", "csr, 60 active"), rig_, some, 128, 2, 60);
    add_batch(row("clip of 1000, 60 active", "csr, 60 active", "crowd + 1.2 stores"), rig_, some,
              1000, 1);
    add_batch(row("clip, two cores, 60 active", "csr, 60 active"), rig_, some, 1000, 2, 8);
    add_store(row("streaming store of a pose"), rig_, 1000);
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
    std::printf("%zu coefficients, %.0f of them not 0; csr takes %.2f ns each\n\n", values,
                coefficients, at("csr, all active") / coefficients);
    std::printf("%-30s %11s %10s %8s %8s %8s  %s\n", "", "us", "times csr", "KB", "read us",
                "reads", "asked");
    for (const Line& line : lines_) print_line(line, at);
    std::printf("\nreads: what is beyond %.1f us, in tight reads of the active columns\n", kBeside);
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
  // Adds a row of the table. Returns the row's name.
  const std::string& row(const std::string& name, const std::string& base = "",
                         const std::string& asked = "", const std::string& read = "",
                         double bytes = 0) {
    lines_.push_back({name, base, read, asked, bytes});
    return lines_.back().name;
  }
  // Adds benchmarks of a face, of the face as one sparse matrix (CSR; not for LOD 0, for which
  // add_frames adds it), and of reading the active columns only.
  void add_ours(const std::string& what, const std::shared_ptr<rig::Rig>& rig, const Frames& frames,
                std::uint32_t lod, const std::string& asked, const std::string& level = "") {
    const std::string base = "csr" + level + ", " + frames.name;
    if (lod > 0) add(row(base), csr(dna_, lod), frames);
    const std::string name = what + ", " + frames.name, read = "read for " + name;
    const double bytes = add_read(read, rig, frames, lod);
    add(row(name, base, asked, read, bytes), one_face(rig, lod), frames);
  }
  void add_frames(const Frames& frames) {
    static const std::map<std::string, std::string> kCrowd = {{"60 active", "180x"},
                                                              {"all active", "25x"}};
    add(row("csr, " + frames.name), csr(dna_, 0), frames);
    add_ours("one face", rig_, frames, 0, frames.name == "1 active" ? "1.4 us" : "1.3 reads");
    add_ours("float16", half_, frames, 0, "1.3 reads");
    const auto crowd = kCrowd.find(frames.name);
    add_batch(row("crowd of 64, " + frames.name, "csr, " + frames.name,
                  crowd == kCrowd.end() ? "" : crowd->second),
              rig_, frames, 64, 1);
  }
  template <class At>
  static void print_line(const Line& line, At at) {
    const double us = at(line.name) / 1e3, read = at(line.read) / 1e3;
    if (us == 0) return;
    std::printf("%-30s %11.3f", line.name.c_str(), us);
    at(line.base) > 0 ? std::printf(" %10.1f", at(line.base) / at(line.name))
                      : std::printf(" %10s", "");
    read > 0 ? std::printf(" %8.0f %8.3f %8.2f", line.bytes / 1e3, read, (us - kBeside) / read)
             : std::printf(" %8s %8s %8s", "", "", "");
    std::printf("  %s\n", line.asked.c_str());
  }
  void add_instance(const Frames& frames) {
    const Frames& one = frames_.front();
    const std::string name = "an Instance, " + one.name;
    add(row(name, "csr, " + one.name), an_instance(rig_), one);
    for (const char* other : {"no change", "LOD switched and evaluated"}) row(other);
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
    row("compile", "", "2 ms");
    benchmark::RegisterBenchmark("compile", [this](benchmark::State& state) {
      for (auto _ : state) benchmark::DoNotOptimize(compiled(dna_));
    });
    for (const bool full : {false, true}) {
      benchmark::RegisterBenchmark(
          row(full ? "open a block, all checked" : "open a block, header checked").c_str(),
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
  std::shared_ptr<rig::Rig> rig_, half_, turned_;
  std::uint32_t coarse_ = 0;
  std::deque<Line> lines_;
};

// Measures how the time grows with the size of the work x. Each point is a benchmark "name/x",
// compared with "csr name/x".
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
      const std::size_t kept = kept_coefficients(*rig_, lod);
      pair("LOD", kept, one_face(rig_, lod), csr(dna_, lod), frames_);
      add_read("read LOD/" + std::to_string(kept), rig_, frames_, lod);
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
    std::printf("# %s, %s, commit %s, %s kernels\nwhat,x,us,csr,read\n", bench::processor().c_str(),
                bench::compiler(), bench::commit(), rig_->kernels->name);
    for (const auto& [name, time] : ns) {
      if (name.starts_with("csr ") || name.starts_with("read ")) continue;
      const std::size_t slash = name.find('/');
      const auto base = ns.find("csr " + name), read = ns.find("read " + name);
      std::printf("%s,%s,%.4f,", name.substr(0, slash).c_str(), name.substr(slash + 1).c_str(),
                  time / 1e3);
      if (base != ns.end()) std::printf("%.4f", base->second / 1e3);
      std::printf(",");
      if (read != ns.end()) std::printf("%.4f", read->second / 1e3);
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
    add_read("read active controls/" + std::to_string(n), rig_, *made_.back(), 0);
  }
  // Adds benchmarks of the face with only its first n joint groups.
  void add_groups(std::size_t n) {
    smaller_.push_back(std::make_unique<dna::Dna>(dna_));
    auto& groups = smaller_.back()->behavior.joint_groups;
    groups = std::vector<dna::JointGroup>(groups.begin(),
                                          groups.begin() + static_cast<std::ptrdiff_t>(n));
    auto rig = compiled(*smaller_.back());
    const std::size_t joints = rig->joints_written.size();
    pair("joints", joints, one_face(rig, 0), csr(*smaller_.back(), 0), frames_);
    add_read("read joints/" + std::to_string(joints), std::move(rig), frames_, 0);
  }

  const dna::Dna& dna_;
  const Frames& frames_;
  std::shared_ptr<rig::Rig> rig_;
  std::vector<std::unique_ptr<Frames>> made_;
  std::vector<std::unique_ptr<dna::Dna>> smaller_;
};

// Stores the median of each benchmark.
// In: progress  whether the name of the running benchmark is shown on one line of the terminal
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
  auto source = bytes::open_file(path);
  if (!source) return core::Unexpected{source.error()};
  return dna::parse(**source);
}

// The name of a part that a face must have for a table of evaluations but lacks; nullptr if it has
// all.
const char* missing_part(const dna::Dna& dna) {
  if (dna.definition.raw_control_names.empty()) return "raw controls";
  if (dna.descriptor.lod_count == 0) return "LODs";
  if (dna.definition.joint_names.empty()) return "joints";
  const auto has_values = [](const dna::JointGroup& group) { return !group.values.empty(); };
  return std::ranges::any_of(dna.behavior.joint_groups, has_values) ? nullptr : "joint groups";
}

// Adds one set of frames to `out`, read from a file, or generated if `file` is nullptr. Prints a
// message and returns false if the file is not valid.
bool add_frames(const std::string& name, std::size_t raw, std::size_t active, const char* file,
                std::vector<Frames>& out) {
  Frames frames = file != nullptr ? bench::read_frames(file, raw) : bench::make_frames(raw, active);
  if (frames.count == 0) {
    std::fprintf(stderr, "rig_bench: %s: frames of %zu float32 were expected\n", file, raw);
    return false;
  }
  frames.name = name;
  out.push_back(std::move(frames));
  return true;
}

// Makes the sets of frames that the table compares.
// In: files  three files: frames with 20, with 60 and with all controls active; nullptr: generated
//     clip   file with the frames of a real clip, or nullptr
// Out: out    the sets; the result is false, after a message, if a file is not valid
bool list_frames(std::size_t raw, char** files, const char* clip, std::vector<Frames>& out) {
  // 60 and 100 are first, because in captured animations 60 to 100 raw controls move.
  for (const std::size_t active : {60u, 100u, 20u, 1u, 5u, 140u, 190u}) {
    // A set that needs at least as many controls as the face has is left out. The sets 20 and 60
    // are kept, because files may give their frames and other rows are compared with 60.
    if (active >= raw && active != 20 && active != 60) continue;
    const char* file = files == nullptr ? nullptr
                       : active == 20   ? files[0]
                       : active == 60   ? files[1]
                                        : nullptr;
    const std::string name = std::to_string(active) + " active";
    if (!add_frames(name, raw, std::min(active, raw), file, out)) return false;
  }
  if (!add_frames("all active", raw, raw, files == nullptr ? nullptr : files[2], out)) return false;
  return clip == nullptr || add_frames("clip's frames", raw, raw, clip, out);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs(
        "usage: rig_bench FILE.dna [FRAMES20 FRAMES60 FRAMES_ALL] [--sweep] [--progress] [--clip "
        "FRAMES] "
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
  if (const char* missing = missing_part(*dna)) {
    std::fprintf(stderr, "rig_bench: %s: a face with %s was expected, found none\n", argv[1],
                 missing);
    return 1;
  }
  const bool files = argc >= 5 && argv[2][0] != '-';
  int option = files ? 5 : 2;
  const auto asked_for = [&](const char* name) {
    const bool found = option < argc && std::strcmp(argv[option], name) == 0;
    option += found ? 1 : 0;
    return found;
  };
  const bool sweep = asked_for("--sweep"), progress = asked_for("--progress");
  const char* clip = asked_for("--clip") && option < argc ? argv[option++] : nullptr;
  std::vector<Frames> frames;
  if (!list_frames(raw, files ? argv + 2 : nullptr, clip, frames)) return 1;
  std::string repetitions = "--benchmark_repetitions=9",
              mixed = "--benchmark_enable_random_interleaving=true",
              time = "--benchmark_min_time=0.05";
  std::vector<char*> arguments{argv[0], repetitions.data(), mixed.data(), time.data()};
  for (int i = option; i < argc; ++i) arguments.push_back(argv[i]);
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 2;
  Suite suite(*dna, frames);
  Sweep growth(*dna, *std::ranges::find(frames, "60 active", &Frames::name));
  sweep ? growth.add_all() : suite.add_all();
  Reporter reporter(progress);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  sweep ? growth.print(reporter.ns) : suite.print(reporter.ns);
  return 0;
}
