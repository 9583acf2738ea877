// SPDX-License-Identifier: MIT
// Measures reading a file: parse_bench FILE.dna [Google Benchmark's options]. "plain" is the least
// work of any reader: the whole file into fresh memory, with every word swapped. Memory is returned
// to the system before each run, so that every run pays for its pages.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "bench/machine.h"
#include "bytes/source.h"
#include "dna/file/parse.h"

namespace {

using namespace risorius;
using Clock = std::chrono::steady_clock;

class CountingSource final : public bytes::Source {
 public:
  explicit CountingSource(bytes::Source& source) : source_(source) {}
  std::uint64_t size() const override { return source_.size(); }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    const std::size_t n = source_.read(offset, out);
    bytes_ += n;
    return n;
  }
  std::uint64_t bytes() const { return bytes_; }

 private:
  bytes::Source& source_;
  std::uint64_t bytes_ = 0;
};

// The results of a benchmark: its times, and the numbers of bytes that it reads and keeps, which
// count_bytes measures in a separate run.
struct Row {
  std::string name;
  std::vector<double> ms;
  std::function<void(Row&)> count_bytes = [](Row&) {};
  std::uint64_t bytes_read = 0, bytes_kept = 0;
};

// Returns the value of a result. An error ends the program: it is a mistake of the caller, because
// main() has read the file before.
template <class T>
T must(core::Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().describe().c_str());
    std::exit(1);
  }
  return std::move(result).value();
}

std::unique_ptr<bytes::Source> open(const char* path) { return must(bytes::open_file(path)); }

void return_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

std::uint64_t bytes_in_use() {
#ifdef __GLIBC__
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
#else
  return 0;
#endif
}

struct Free {
  void operator()(void* p) const { std::free(p); }
};
using Bytes = std::unique_ptr<std::uint8_t, Free>;

Bytes read_plainly(bytes::Source& source) {
  const auto size = static_cast<std::size_t>(source.size());
  Bytes bytes(static_cast<std::uint8_t*>(std::malloc(size + 1)));
  if (bytes == nullptr || source.read(0, {bytes.get(), size}) != size) std::exit(1);
  return bytes;
}

Bytes read_and_swap(bytes::Source& source) {
  Bytes bytes = read_plainly(source);
  const auto words = static_cast<std::size_t>(source.size()) / 4;
  for (std::size_t i = 0; i < words; ++i) {
    std::uint32_t v;
    std::memcpy(&v, bytes.get() + 4 * i, 4);
    v = (v >> 24) | ((v >> 8) & 0xFF00u) | ((v << 8) & 0xFF0000u) | (v << 24);
    std::memcpy(bytes.get() + 4 * i, &v, 4);
  }
  return bytes;
}

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// Measures the time of load(). The objects that it returns are freed outside of the measured time.
template <class Load>
void measure_load(benchmark::State& state, Row& row, const Load& load) {
  for (auto _ : state) {
    return_memory();
    const Clock::time_point begin = Clock::now();
    auto loaded = load();
    benchmark::DoNotOptimize(loaded);
    row.ms.push_back(ms_since(begin));
    state.SetIterationTime(row.ms.back() / 1e3);
  }
}

template <class Load>
std::uint64_t bytes_kept(const Load& load) {
  const std::uint64_t before = bytes_in_use();
  const auto loaded = load();
  return bytes_in_use() - before;
}

class Bench {
 public:
  explicit Bench(const char* path) : path_(path) {}

  void plain() {
    Row& row = add("plain");
    const auto load = [this] { return read_and_swap(*open(path_)); };
    row.bytes_read = row.bytes_kept = open(path_)->size();
    run(row, [&row, load](benchmark::State& s) { measure_load(s, row, load); });
  }

  void parse(const char* name, const dna::ParseOptions& options) {
    Row& row = add(name);
    const auto load = [this, options] { return must(dna::parse(*open(path_), options)); };
    count(row, options, load);
    run(row, [&row, load](benchmark::State& s) { measure_load(s, row, load); });
  }

  void parse_from_memory() {
    Row& row = add("full, from memory");
    const auto file = open(path_);
    bytes_ = read_plainly(*file);
    const std::span<const std::uint8_t> all(bytes_.get(), static_cast<std::size_t>(file->size()));
    const auto load = [all] {
      bytes::SpanSource source(all);
      return must(dna::parse(source));
    };
    count(row, {}, load);
    run(row, [&row, load](benchmark::State& s) { measure_load(s, row, load); });
  }

  void freeing() {
    Row& row = add("freeing the full one");
    run(row, [&row, this](benchmark::State& state) {
      for (auto _ : state) {
        return_memory();
        auto dna = std::make_unique<dna::Dna>(must(dna::parse(*open(path_))));
        const Clock::time_point begin = Clock::now();
        dna.reset();
        row.ms.push_back(ms_since(begin));
        state.SetIterationTime(row.ms.back() / 1e3);
      }
    });
  }

  void print();

 private:
  Row& add(const char* name) {
    rows_.push_back(std::make_unique<Row>());
    rows_.back()->name = name;
    return *rows_.back();
  }
  // Registers a benchmark. If Google Benchmark's filter excludes it, its row has no times and is
  // not printed.
  template <class Run>
  void run(Row& row, Run measure) {
    benchmark::RegisterBenchmark(row.name.c_str(), measure)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
  template <class Load>
  void count(Row& row, const dna::ParseOptions& options, const Load& load) {
    row.count_bytes = [this, options, load](Row& r) {
      const auto file = open(path_);
      CountingSource source(*file);
      must(dna::parse(source, options));
      r.bytes_read = source.bytes();
      r.bytes_kept = bytes_kept(load);
    };
  }

  const char* path_;
  Bytes bytes_;
  std::vector<std::unique_ptr<Row>> rows_;
};

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 0.0 : values[values.size() / 2];
}

void Bench::print() {
  const double plain = median(rows_.front()->ms);
  std::printf("\n%s, %s, commit %s\n\n", bench::processor().c_str(), bench::compiler(),
              bench::commit());
  std::printf("%-30s %9s %8s %12s %12s %9s\n", "what", "ms", "MB/s", "bytes read", "bytes kept",
              "of plain");
  for (const auto& row : rows_) {
    if (row->ms.empty()) continue;
    row->count_bytes(*row);
    const double ms = median(row->ms);
    const double speed = static_cast<double>(row->bytes_read) / 1e3 / ms;
    std::printf("%-30s %9.3f %8.0f %12llu %12llu %8.0f%%\n", row->name.c_str(), ms, speed,
                static_cast<unsigned long long>(row->bytes_read),
                static_cast<unsigned long long>(row->bytes_kept), 100 * plain / ms);
  }
  std::puts(
      "\nms: medians. MB/s: bytes read of the file (counted while it is read piece by piece, from\n"
      "memory the same) by time. Bytes kept: of the heap (0: not known here). of plain: 100 *\n"
      "plain's ms / ms.");
}

void add_partial_loads(Bench& bench, std::uint16_t lod_count) {
  dna::ParseOptions only;  // only the definition
  only.behavior = only.geometry = only.machine_learned_behavior = only.rbf_behavior = false;
  only.joint_behavior_metadata = only.twist_swing_behavior = only.unknown_layers = false;
  dna::ParseOptions behavior = only, geometry = only, descriptor = only;
  behavior.behavior = true;
  bench.parse("behavior only", behavior);
  geometry.geometry = true;
  geometry.blend_shapes = false;
  bench.parse("geometry without blend shapes", geometry);
  descriptor.definition = false;
  bench.parse("descriptor only", descriptor);
  for (const std::uint16_t lod : {std::uint16_t{0}, std::uint16_t{3}, std::uint16_t{7}}) {
    if (lod >= lod_count) continue;
    dna::ParseOptions one;
    one.lods.lods = {lod};
    bench.parse(("LOD " + std::to_string(lod) + " only").c_str(), one);
  }
  dna::ParseOptions coarse;
  coarse.lods.max_lod = 2;
  if (lod_count > 2) bench.parse("LODs from 2 on", coarse);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: parse_bench FILE.dna [options]\n", stderr);
    return 2;
  }
  Bench bench(argv[1]);
  const std::uint16_t lod_count = must(dna::parse(*open(argv[1]))).descriptor.lod_count;
  bench.plain();
  bench.parse("full", {});
  bench.parse_from_memory();
  add_partial_loads(bench, lod_count);
  bench.freeing();
  int rest = argc - 1;
  argv[1] = argv[0];
  benchmark::Initialize(&rest, argv + 1);
  benchmark::RunSpecifiedBenchmarks();
  bench.print();
  return 0;
}
