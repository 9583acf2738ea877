// SPDX-License-Identifier: MIT
// Tests files that are cut short, patched or malformed. Each must give a Dna that can be used in
// every way, or an error with a field and an offset.
#include <gtest/gtest.h>

#include <cstring>
#include <iostream>
#include <sstream>

#include "bytes/source.h"
#include "dna/file/write.h"
#include "dna/layers.h"
#include "support/files.h"
#include "support/full_face.h"
#include "support/promises.h"
#include "support/stride.h"

namespace risorius {
namespace {

using promises::Bytes;
using testing_support::bytes_to_change;
using testing_support::data_folder;
using testing_support::dna_files;
using testing_support::read_file;

Bytes generated(std::uint16_t minor) {
  std::vector<dna::Warning> warnings;
  auto bytes = dna::write(testing_support::make_full_face(), {minor, false}, warnings);
  EXPECT_TRUE(bytes.has_value());
  return bytes ? *bytes : Bytes{};
}

Bytes golden(const std::string& name) {
  const Bytes bytes = read_file(data_folder() / "golden" / name);
  EXPECT_FALSE(bytes.empty()) << name;
  return bytes;
}

// Checks a variant of a golden file against one promise of support/promises.h, because all promises
// would take too long. It is the promise about reading, but in every third turn, if the variant can
// be read, one of the other promises.
std::string one_promise(const Bytes& bytes, std::size_t turn) {
  const auto dna = promises::parse(bytes);
  if (!dna || turn % 3 != 0) return promises::reading(bytes, dna);
  switch (turn / 3 % 5) {
    case 0:
      return promises::rewriting(*dna, 8);
    case 1:
      return promises::evaluation(*dna, static_cast<std::uint32_t>(turn));
    case 2:
      return promises::conversion(*dna, Bytes{0x3F, 19, 4, 2, 1, 1, 1, 0});
    case 3:
      return promises::json(*dna);
    default:
      return promises::checking(bytes, true);
  }
}

template <class Check>
void expect_of_every_prefix(const Bytes& bytes, Check check) {
  for (std::size_t size = 0; size <= bytes.size(); ++size) {
    const std::string broken = check(Bytes(bytes.begin(), bytes.begin() + long(size)), size);
    ASSERT_EQ(broken, "") << "of the first " << size << " bytes";
  }
}

// Expects that check(changed bytes, turn) returns "" for every kStride-th of the offsets `places`:
// the byte there is replaced by 0x00, by 0xFF, and by itself with one bit flipped. `turn` differs
// between the three calls.
template <class Check>
void expect_of_every_patch(const Bytes& bytes, const std::vector<std::size_t>& places,
                           Check check) {
  for (std::size_t i = 0; i < places.size(); i += testing_support::kStride) {
    const std::size_t at = places[i];
    const auto flipped = static_cast<std::uint8_t>(bytes[at] ^ (1u << at % 8));
    std::size_t turn = at;
    for (const std::uint8_t value : {std::uint8_t{0x00}, std::uint8_t{0xFF}, flipped}) {
      Bytes patched = bytes;
      patched[at] = value;
      ASSERT_EQ(check(patched, turn++), "") << "with byte " << at << " = " << int(value);
    }
  }
}

std::vector<std::size_t> each(const Bytes& bytes, std::size_t step) {
  std::vector<std::size_t> places;
  for (std::size_t at = 0; at < bytes.size(); at += step) places.push_back(at);
  return places;
}

const auto kEverything = [](const Bytes& bytes, std::size_t turn) {
  return promises::everything(bytes, turn);
};

// ---- one generated file of each version

class HostileFace : public testing::TestWithParam<std::uint16_t> {};

TEST_P(HostileFace, HasSomethingInEveryLayerOfItsVersion) {
  const auto dna = promises::parse(generated(GetParam()));
  ASSERT_TRUE(dna.has_value()) << dna.error().describe();
  dna::detail::for_each_layer(*dna, [&](std::string_view id, const char*, const auto& layer) {
    for (const dna::detail::KnownLayer& known : dna::detail::kLayers) {
      if (id != known.id || (known.since_minor > GetParam() && known.since_minor > 2)) continue;
      EXPECT_FALSE(layer == std::remove_cvref_t<decltype(layer)>{}) << id;
    }
  });
}

TEST_P(HostileFace, IsUsableOrRefusedCutAtEveryByte) {
  expect_of_every_prefix(generated(GetParam()), kEverything);
}

TEST_P(HostileFace, IsUsableOrRefusedWithEveryBytePatched) {
  const Bytes bytes = generated(GetParam()), newest = GetParam() < 8 ? generated(8) : Bytes{};
  expect_of_every_patch(bytes, bytes_to_change(bytes, newest), kEverything);
}

// Every prefix of a file is rejected with an error. Only a 2.1 file that lacks nothing but its end
// mark is read, with a warning.
TEST_P(HostileFace, IsRefusedCutAtEveryByte) {
  const Bytes bytes = generated(GetParam());
  const std::size_t needed = bytes.size() - (GetParam() == 1 ? 3 : 0);
  for (std::size_t size = 0; size < needed; ++size) {
    ASSERT_FALSE(promises::parse({bytes.data(), size}).has_value()) << size;
  }
  EXPECT_TRUE(promises::parse({bytes.data(), needed}).has_value());
}

INSTANTIATE_TEST_SUITE_P(Version2, HostileFace, testing::Range(std::uint16_t{1}, std::uint16_t{9}));

// ---- committed goldens

class HostileGolden : public testing::TestWithParam<const char*> {};

TEST_P(HostileGolden, IsUsableOrRefusedCutAtEveryByte) {
  expect_of_every_prefix(golden(GetParam()), [](const Bytes& bytes, std::size_t size) {
    return size % 16 == 0 ? promises::everything(bytes, size / 16) : one_promise(bytes, size);
  });
}

TEST_P(HostileGolden, IsReadWithEveryBytePatchedThreeWaysAndUsedInOne) {
  const bool is_newest = GetParam() == std::string_view("tiny_v28.dna");
  const Bytes bytes = golden(GetParam()), newest = is_newest ? Bytes{} : golden("tiny_v28.dna");
  expect_of_every_patch(bytes, bytes_to_change(bytes, newest), one_promise);
}

TEST_P(HostileGolden, IsUsableOrRefusedWithEvery61stBytePatched) {
  const Bytes bytes = golden(GetParam());
  expect_of_every_patch(bytes, each(bytes, 61), kEverything);
}

INSTANTIATE_TEST_SUITE_P(File, HostileGolden,
                         testing::Values("core.dna", "tiny_v21.dna", "tiny_v22.dna", "tiny_v23.dna",
                                         "tiny_v24.dna", "tiny_v25.dna", "tiny_v26.dna",
                                         "tiny_v27.dna", "tiny_v28.dna"),
                         [](const auto& file) {
                           return std::string(file.param, std::strcspn(file.param, "."));
                         });

// ---- malformed files

struct Malformed {
  std::string name, outcome;
  Bytes bytes;
};

std::uint8_t hex_byte(const std::string& text, std::size_t at) {
  return static_cast<std::uint8_t>(std::stoul(text.substr(at, 2), nullptr, 16));
}

// Appends to `out` the bytes of the base file from offset `copied` up to the offset of an edit, and
// the bytes that the edit inserts. `copied` becomes the offset after the removed bytes. An edit is
// a text OFFSET:NUMBER OF BYTES TO REMOVE:BYTES TO INSERT IN HEX (tests/data/malformed/README.md).
void apply_edit(const std::string& edit, const Bytes& base, std::size_t& copied, Bytes& out) {
  const std::size_t first = edit.find(':'), second = edit.find(':', first + 1);
  const std::size_t at = std::stoul(edit.substr(0, first));
  const std::size_t cut = std::stoul(edit.substr(first + 1, second - first - 1));
  out.insert(out.end(), base.begin() + long(copied), base.begin() + long(at));
  for (std::size_t i = second + 1; i < edit.size(); i += 2) out.push_back(hex_byte(edit, i));
  copied = at + cut;
}

std::vector<Malformed> malformed_files() {
  std::vector<Malformed> files;
  std::ifstream in(data_folder() / "malformed" / "edits.txt");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string base_name, edit;
    Malformed file;
    words >> file.name >> base_name >> file.outcome;
    const Bytes base = golden(base_name);
    std::size_t copied = 0;
    while (words >> edit) apply_edit(edit, base, copied, file.bytes);
    file.bytes.insert(file.bytes.end(), base.begin() + long(copied), base.end());
    files.push_back(std::move(file));
  }
  return files;
}

std::string outcome(const core::Result<dna::Dna>& dna) {
  if (!dna) return "error";
  return dna->warnings.empty() ? "good" : "odd";
}

TEST(HostileMalformed, FilesAreUsableOrRefusedAsTheirKindAsks) {
  const std::vector<Malformed> files = malformed_files();
  EXPECT_EQ(files.size(), 337u);
  std::size_t turn = 0;
  for (const Malformed& file : files) {
    EXPECT_EQ(outcome(promises::parse(file.bytes)), file.outcome) << file.name;
    EXPECT_EQ(promises::everything(file.bytes, turn++), "") << file.name;
  }
}

// ---- a file that changes during reading

// A file that changes during reading. The first `honest_reads` reads give the bytes of the file. In
// later reads every byte whose offset leaves the remainder `phase` when divided by 4 is increased
// by one. For one of the four values of `phase`, these bytes are the lowest bytes of counts.
class ChangingSource final : public bytes::Source {
 public:
  ChangingSource(const Bytes& bytes, std::size_t honest_reads, std::uint64_t phase)
      : bytes_(bytes), honest_(honest_reads), phase_(phase) {}
  std::uint64_t size() const override { return bytes_.size(); }
  std::size_t read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    bytes::SpanSource memory(bytes_);
    const std::size_t n = memory.read(offset, out);
    if (reads_++ < honest_) return n;
    for (std::size_t i = 0; i < n; ++i) {
      if ((offset + i) % 4 == phase_) ++out[i];
    }
    return n;
  }

 private:
  const Bytes& bytes_;
  std::size_t honest_, reads_ = 0;
  std::uint64_t phase_;
};

// A file that changes while it is parsed must do no harm: parsing fails, or gives a Dna that can be
// rewritten. The polygons and skin weights are longer than the reader's window, so that they take
// several reads.
TEST(HostileSource, ThatChangesBetweenTwoReadsIsNoHarm) {
  dna::Dna face = testing_support::make_full_face();
  constexpr std::uint32_t kCount = 30000;
  dna::Mesh& mesh = face.geometry.meshes[0];
  std::vector<std::uint32_t> offsets(kCount + 1), corners(3 * kCount), influences(kCount + 1);
  for (std::uint32_t i = 0; i <= kCount; ++i) offsets[i] = 3 * i;
  for (std::uint32_t i = 0; i < 3 * kCount; ++i) corners[i] = i % 3;
  for (std::uint32_t i = 0; i <= kCount; ++i) influences[i] = i;
  mesh.face_offsets = offsets;
  mesh.face_layouts = corners;
  mesh.positions.values = std::vector<float>(3 * kCount, 0.5f);
  mesh.skin_offsets = influences;
  mesh.skin_weights = std::vector<float>(kCount, 1.0f);
  mesh.skin_joint_indices = std::vector<std::uint16_t>(kCount, 1);
  std::vector<dna::Warning> warnings;
  const Bytes bytes = *dna::write(face, {8, true}, warnings);
  for (std::size_t honest = 0; honest < 60; honest += testing_support::kStride) {
    for (std::uint64_t phase = 0; phase < 4; ++phase) {
      ChangingSource source(bytes, honest, phase);
      const auto dna = dna::parse(source);
      if (dna) {
        EXPECT_EQ(promises::rewriting(*dna, 8), "") << honest;
      }
    }
  }
}

// ---- files of RISORIUS_SHARED, which a clone lacks

TEST(HostileExtra, MalformedFilesAreUsableOrRefused) {
  const auto folder = testing_support::shared_folder("data/golden/malformed");
  if (folder.empty()) {
    std::cout << "EXTRA NOT RUN (no data): malformed files of the reference\n";
    return;
  }
  std::size_t turn = 0;
  for (const auto& path : dna_files(folder)) {
    EXPECT_EQ(promises::everything(read_file(path), turn++), "") << path.filename();
  }
}

TEST(HostileExtra, FixturesAreUsableOrRefusedCutAndPatchedAtEvery17thByte) {
  const auto folder = testing_support::shared_folder("data/fixtures");
  if (folder.empty()) {
    std::cout << "EXTRA NOT RUN (no data): the reference's fixtures, cut and patched\n";
    return;
  }
  for (const auto& path : dna_files(folder)) {
    SCOPED_TRACE(path.filename());
    const Bytes bytes = read_file(path);
    expect_of_every_prefix(bytes, one_promise);
    expect_of_every_patch(bytes, each(bytes, 17), kEverything);
  }
}

}  // namespace
}  // namespace risorius
