// SPDX-License-Identifier: MIT
// Measures clips in .rzc files: clip_bench FILE.rzc ... [--dna FILE.dna] [options of the library]
//   encode, decode     GB/s of curve data, one core, from memory to memory
//   one frame          a frame of all controls in another block than the frame before; its whole
//                    block is read and decoded
//   play               frame by frame; each block is read and decoded when it is reached; per frame
//   play, decoded      like play, but only the frames of the first block, which is decoded once
//   evaluate           evaluation of the rig of --dna, for comparison, with generated frames in
//                      which 60 controls are active; per frame
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "bench/frames.h"
#include "bench/machine.h"
#include "bytes/source.h"
#include "clip/file/encoder.h"
#include "clip/file/player.h"
#include "clip/file/reader.h"
#include "compile/compile.h"
#include "dna/file/parse.h"
#include "rig/stages/evaluate.h"

namespace {

using namespace risorius;

struct File {
  std::string name;
  clip::Bytes bytes;
  clip::Clip clip;
};

clip::Reader open(const File& file) {
  return *clip::Reader::open(std::make_unique<bytes::SpanSource>(file.bytes));
}

void set_rate(benchmark::State& state, const File& file) {
  state.SetBytesProcessed(
      static_cast<std::int64_t>(state.iterations() * file.clip.curves.size() * sizeof(float)));
}

void encode(benchmark::State& state, const File& file) {
  for (auto _ : state) benchmark::DoNotOptimize(clip::encode(file.clip)->size());
  set_rate(state, file);
}

void decode(benchmark::State& state, const File& file) {
  std::vector<std::uint32_t> all(file.clip.head.names.size());
  std::iota(all.begin(), all.end(), 0u);
  std::vector<float> out(file.clip.curves.size());
  for (auto _ : state) {
    clip::Reader reader = open(file);
    if (!reader.read(0, reader.frame_count(), all, out.data(), nullptr)) state.SkipWithError("");
    benchmark::ClobberMemory();
  }
  set_rate(state, file);
}

void one_frame(benchmark::State& state, const File& file) {
  clip::Player player(open(file));
  // Each frame is more than the length of a block after the previous one, so that it is in another
  // block. Where the clip begins again, a short clip may stay in the same block.
  std::size_t at = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(player.frame(at));
    at = (at + clip::kDefaultBlockFrames + 7) % file.clip.frame_count;
  }
}

void play(benchmark::State& state, const File& file) {
  clip::Player player(open(file));
  std::size_t at = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(player.frame(at));
    if (++at == file.clip.frame_count) at = 0;
  }
}

void play_decoded(benchmark::State& state, const File& file) {
  clip::Player player(open(file));
  std::size_t at = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(player.frame(at));
    if (++at == clip::kDefaultBlockFrames) at = 0;
  }
}

void evaluate(benchmark::State& state, const std::string& path) {
  auto source = bytes::open_file(path);
  if (!source) return state.SkipWithError(source.error().describe().c_str());
  const auto dna = dna::parse(**source, {});
  if (!dna) return state.SkipWithError(dna.error().describe().c_str());
  const auto rig = compile::compile(*dna, {});
  if (!rig) return state.SkipWithError(rig.error().describe().c_str());
  const bench::Frames frames = bench::make_frames(rig->raw_count, 60);
  rig::Workspace work = rig::make_workspace(*rig);
  rig::Pose pose = rig::make_pose(*rig);
  std::size_t at = 0;
  for (auto _ : state) {
    rig::evaluate(*rig, frames.at(at++ % frames.count), 0, true, work, pose);
    benchmark::DoNotOptimize(pose.joints.data());
  }
}

struct Case {
  const char* name;
  void (*run)(benchmark::State&, const File&);
};
constexpr Case kCases[] = {{"encode", encode},
                           {"decode", decode},
                           {"one frame", one_frame},
                           {"play", play},
                           {"play, decoded", play_decoded}};

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::unique_ptr<File>> files;
  std::vector<char*> rest{argv[0]};
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--dna") == 0 && i + 1 < argc) {
      benchmark::RegisterBenchmark("evaluate", evaluate, std::string(argv[++i]));
      continue;
    }
    if (argv[i][0] == '-') {
      rest.push_back(argv[i]);
      continue;
    }
    auto file = std::make_unique<File>();
    file->name = argv[i];
    std::ifstream in(argv[i], std::ios::binary);
    file->bytes.assign(std::istreambuf_iterator<char>(in), {});
    auto read = clip::decode(file->bytes);
    if (!read) {
      std::fprintf(stderr, "%s: %s\n", argv[i], read.error().describe().c_str());
      return 1;
    }
    file->clip = std::move(read).value();
    files.push_back(std::move(file));
  }
  for (const auto& file : files) {
    const std::string name = file->name.substr(file->name.find_last_of('/') + 1);
    const auto& one = *file;
    for (const Case& made : kCases) {
      benchmark::RegisterBenchmark(
          (made.name + (", " + name)).c_str(),
          [&made, &one](benchmark::State& state) { made.run(state, one); });
    }
  }
  std::printf("%s, %s, commit %s\n", bench::processor().c_str(), bench::compiler(),
              bench::commit());
  int count = static_cast<int>(rest.size());
  benchmark::Initialize(&count, rest.data());
  benchmark::RunSpecifiedBenchmarks();
}
