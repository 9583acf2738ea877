// SPDX-License-Identifier: MIT
// make_seeds FOLDER FILE.dna ...: writes the first inputs of each fuzz target to FOLDER/<target>:
// generated faces of every version, clips and packed buffers, and the given files if they are
// small.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "author/packed.h"
#include "clip/file/encoder.h"
#include "compile/compile.h"
#include "dna/file/json.h"
#include "dna/file/write.h"
#include "dna/layers.h"
#include "support/bombs.h"
#include "support/clips.h"
#include "support/full_face.h"
#include "support/promises.h"

namespace {

using risorius::promises::Bytes;
namespace dna = risorius::dna;
namespace fs = std::filesystem;

constexpr std::size_t kLargestSeed = 4400;  // bytes; larger seeds make every run slow
constexpr std::size_t kLargestBomb = 8000;
constexpr std::size_t kOptions = risorius::promises::kOptionBytes;

// Bytes that fuzz targets expect before the file. Each entry gives one seed for each file.
const std::vector<Bytes> kFilters{{0, 0, 0, 0, 0, 0, 0, 0},       {0, 0x20, 1, 0, 0, 0, 0, 0},
                                  {0, 0x80, 0, 0, 0, 0, 0, 0},    {0x1D, 0x83, 1, 0, 0, 0, 0, 0},
                                  {0, 0x14, 0, 0, 200, 20, 9, 0}, {0, 0x0C, 0, 0, 0, 0, 0, 3}};
const std::vector<Bytes> kTargets{
    {0, 0, 0, 0, 0, 0, 0, 0}, {0x3F, 19, 4, 2, 1, 1, 1, 0}, {0x02, 0, 5, 0, 0, 0, 0, 0}};
const std::vector<Bytes> kControls{{0, 0, 0, 2}, {0, 0, 0, 3}};

std::string without_spaces(const std::string& json) {
  std::string out;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '"' && (i == 0 || json[i - 1] != '\\')) in_text = !in_text;
    if (in_text || (json[i] != ' ' && json[i] != '\n')) out += json[i];
  }
  return out;
}

class Seeds {
 public:
  explicit Seeds(fs::path folder) : folder_(std::move(folder)) {}

  void add(const std::string& name, const Bytes& file) {
    put("parse", name, {}, file);
    put("round_trip", name, {}, file);
    put_each("filter", name, kFilters, file);
    put_each("coordinates", name, kTargets, file);
    put_each("evaluate", name, kControls, file);
    const auto read = risorius::promises::parse(file);
    if (!read) return;
    const std::string json = without_spaces(*dna::to_json(*read));
    put("json", name, {}, {json.begin(), json.end()});
    add_rig(name, *read);
  }

  /// Adds inputs for the fuzz target `evaluate` to the folder `bombs`, made from a file for which a
  /// reader may need steps in proportion to the product of two list lengths. Each input takes as
  /// long as a thousand other inputs, so it is run only once and not mutated.
  void add_bomb(const std::string& name, const Bytes& file) {
    put_each("bombs", name, kControls, file, kLargestBomb);
  }

  /// Adds a seed for the fuzz target `greedy`, which has a deliberate fault. One run with this seed
  /// must find the fault.
  void add_greedy() { put("greedy", "zeros", {}, Bytes(kLargestSeed, 0)); }

  /// Adds rows to be packed, and packed buffers of each meshopt mode, in the form that packed_fuzz
  /// reads.
  void add_packed() {
    namespace author = risorius::author;
    using Mode = author::PackedMode;
    Bytes rows(1200);
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = i % 4 != 0 ? 0 : i / 12 % 64;
    put("packed", "rows", {1, 2, 0, 0}, rows);
    for (const auto& [mode, stride] :
         {std::pair{Mode::kAttributes, std::size_t{12}},
          std::pair{Mode::kTriangles, std::size_t{4}}, std::pair{Mode::kIndices, std::size_t{4}}}) {
      const author::Packing packing{rows.size() / stride, stride, mode,
                                    author::PackedFilter::kNone};
      const auto kind = static_cast<std::uint8_t>(2 * static_cast<int>(mode));
      const auto of = static_cast<std::uint8_t>(mode == Mode::kAttributes ? 2 : 1);
      const auto count = static_cast<std::uint8_t>(packing.count % 256);
      put("packed", "mode-" + std::to_string(kind),
          {kind, of, count, static_cast<std::uint8_t>(packing.count / 256)},
          *author::pack(rows, packing));
    }
  }

  void add_clips() {
    namespace clip = risorius::clip;
    for (const std::size_t frames : {0u, 1u, 40u, 90u}) {
      const clip::Clip made = risorius::testing_support::make_full_clip(frames);
      put("clip", "file-" + std::to_string(frames), {0, 0, 0, 0}, *clip::encode(made, 30));
      if (frames == 0) continue;
      Bytes curves;
      clip::encode_curves({made.curves.data(), frames, 8, frames}, curves);
      const auto count = static_cast<std::uint8_t>(frames - 1);
      put("clip", "curves-" + std::to_string(frames), {1, 7, count, 0}, curves);
      const auto* first = reinterpret_cast<const std::uint8_t*>(made.curves.data());
      put("clip", "values-" + std::to_string(frames), {2, 7, 0, 0},
          {first, first + 4 * made.curves.size()});
    }
  }

 private:
  void add_rig(const std::string& name, const dna::Dna& face) {
    risorius::compile::CompileOptions options;
    for (const bool quaternions : {false, true}) {
      if (quaternions) options.rotation = risorius::compile::Rotation::kQuaternion;
      if (quaternions) options.precision = risorius::compile::Precision::kFloat16;
      const auto rig = risorius::compile::compile(face, options);
      if (!rig) continue;
      put("rig", name + (quaternions ? "-1" : "-0"), kControls[0],
          {rig->block().begin(), rig->block().end()});
    }
  }
  void put_each(const std::string& target, const std::string& name,
                const std::vector<Bytes>& options, const Bytes& file,
                std::size_t largest = kLargestSeed) {
    for (std::size_t i = 0; i < options.size(); ++i) {
      put(target, name + "-" + std::to_string(i), options[i], file, largest);
    }
  }
  void put(const std::string& target, const std::string& name, Bytes bytes, const Bytes& file,
           std::size_t largest = kLargestSeed) {
    bytes.insert(bytes.end(), file.begin(), file.end());
    // Seeds with the block of a rig may be four times as large, because blocks are padded.
    if (bytes.size() > (target == "rig" ? 4 : 1) * (largest + kOptions)) return;
    fs::create_directories(folder_ / target);
    std::ofstream out(folder_ / target / name, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
  }

  fs::path folder_;
};

Bytes written(const dna::Dna& face, std::uint16_t minor) {
  std::vector<dna::Warning> warnings;
  return *dna::write(face, {minor, false}, warnings);
}

// Adds a seed for each layer: the layers desc and defn, this layer, and the layer that it extends
// if there is one. Also adds a face with a layer of an unknown kind. Small inputs are useful
// because fuzzers try them most often.
void add_parts(Seeds& seeds) {
  const dna::Dna face = risorius::testing_support::make_full_face();
  for (const dna::detail::KnownLayer& wanted : dna::detail::kLayers) {
    dna::Dna part = face;
    dna::detail::for_each_layer(part, [&](std::string_view id, const char*, auto& layer) {
      const bool extends = wanted.id[3] == 'e' && id.substr(0, 2) == std::string_view(wanted.id, 2);
      if (id != "desc" && id != "defn" && id != wanted.id && !extends) layer = {};
    });
    // The controls of removed layers must still be counted, so that indices remain valid.
    part.behavior.psd_count = face.behavior.psd_count;
    part.machine_learned_behavior.ml_control_names = face.machine_learned_behavior.ml_control_names;
    seeds.add(std::string("only-") + wanted.id, written(part, 8));
  }
  dna::Dna unknown;
  unknown.unknown_layers = {{{'n', 'e', 'w', '!'}, 0x10000, {1, 2, 3}}};
  std::vector<dna::Warning> warnings;
  seeds.add("unknown", *dna::write(unknown, {8, true}, warnings));
}

// Adds each bomb with the largest n that gives at most kLargestBomb bytes, but at most 352, so that
// n * n steps take less than a second.
void add_bombs(Seeds& seeds) {
  for (const risorius::testing_support::Bomb& bomb : risorius::testing_support::kBombs) {
    std::uint16_t n = 16;
    const auto next = [&] { return static_cast<std::uint16_t>(n + 16); };
    while (n < 352 && written(bomb.make(next()), 8).size() <= kLargestBomb) n = next();
    seeds.add_bomb(std::string("bomb-") + bomb.name, written(bomb.make(n), 8));
  }
}

Bytes read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "make_seeds FOLDER FILE.dna ...\n";
    return 2;
  }
  Seeds seeds(argv[1]);
  const dna::Dna face = risorius::testing_support::make_full_face();
  for (std::uint16_t minor = 1; minor <= 8; ++minor) {
    const std::string version = "2." + std::to_string(minor);
    seeds.add("full-" + version, written(face, minor));
    seeds.add("empty-" + version, written({}, minor));
  }
  add_parts(seeds);
  seeds.add_clips();
  seeds.add_packed();
  seeds.add_greedy();
  add_bombs(seeds);
  for (int i = 2; i < argc; ++i) {
    const fs::path path = argv[i];
    seeds.add(path.stem().string(), read_file(path));
  }
}
