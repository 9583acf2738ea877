// SPDX-License-Identifier: MIT
// Clips for tests, and functions that check the codec with arbitrary bytes.
#pragma once

#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "clip/codec/block.h"
#include "clip/file/encoder.h"
#include "clip/file/layout.h"
#include "clip/file/reader.h"
#include "core/hash.h"

namespace risorius::testing_support {

using clip::Bytes;
using clip::View;

inline bool same_bits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

inline clip::Clip make_clip(std::size_t controls, std::size_t frames) {
  clip::Clip clip;
  for (std::size_t i = 0; i < controls; ++i) {
    clip.head.names.push_back("CTRL_expressions.c" + std::to_string(i));
  }
  clip.frame_count = frames;
  clip.curves.resize(controls * frames);
  return clip;
}

/// One control of each kind that the codec distinguishes: control 0 is always 0, 1 is constant, 2 a
/// line, 3 a polynomial, 4 steps, 5 equal to 3, 6 random bits, and 7 NaN payloads, 0, -0 and
/// denormals.
inline clip::Clip make_all_kinds(std::size_t frames) {
  clip::Clip clip = make_clip(8, frames);
  std::mt19937 random(7);
  constexpr std::uint32_t kOdd[] = {0x7FC12345u, 0x80000000u, 1u, 0xFF812345u, 0u, 0x807FFFFFu};
  for (std::size_t i = 0; i < frames; ++i) {
    const float t = static_cast<float>(i) / 64.0f;
    const float values[] = {0.0f, 0.3f, 0.1f + 0.01f * t, t * (t - 1.0f) * (t - 2.5f),
                            static_cast<float>(i / 50) * 0.1f};
    for (std::size_t k = 0; k < 5; ++k) clip.curves[k * frames + i] = values[k];
    clip.curves[5 * frames + i] = values[3];
    clip.curves[6 * frames + i] = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    clip.curves[7 * frames + i] = std::bit_cast<float>(kOdd[random() % 6]);
  }
  return clip;
}

/// A clip that uses every field of a head, a block and an index.
inline clip::Clip make_full_clip(std::size_t frames) {
  clip::Clip clip = make_all_kinds(frames);
  clip.head.rate = 59.94;
  clip.head.start = -1.5;
  clip.head.has_times = true;
  clip.head.metadata = {{"take", "3"}, {"actor", "\xC3\xA9"}};
  for (std::size_t i = 0; i < frames; ++i) {
    clip.times.push_back(-1.5 + static_cast<double>(i) / 60.0 + (i % 3 == 0 ? 1e-5 : 0.0));
  }
  clip.events = {{-1.0, "word", 0.25, "hello"}, {0.5, "flash", 0.0, ""}};
  return clip;
}

/// Corrects the checksum of each part of a damaged file (head, block, end) that can be found.
inline void seal(Bytes& bytes) {
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 <= bytes.size()) std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  const auto put_hash = [&](std::size_t begin, std::size_t end, std::size_t at) {
    const std::uint64_t hash = core::xxh64(View(bytes).subspan(begin, end - begin));
    std::memcpy(bytes.data() + at, &hash, sizeof hash);
  };
  if (bytes.size() < clip::kHeadStart) return;
  std::size_t at = clip::kHeadStart + number(8);
  if (at + clip::kHashSize > bytes.size()) return;
  put_hash(0, at, at);
  at += clip::kHashSize;
  while (at + clip::kBlockStart <= bytes.size() && number(at) == clip::kBlockMark) {
    const std::size_t end = at + clip::kBlockStart + number(at + 4);
    if (end > bytes.size()) break;
    const std::size_t hash_at = at + clip::kBlockStart - clip::kHashSize;
    std::memset(bytes.data() + hash_at, 0, clip::kHashSize);
    put_hash(at, end, hash_at);
    at = end;
  }
  if (at + clip::kEndSize > bytes.size()) return;
  put_hash(at, bytes.size() - clip::kHashSize, bytes.size() - clip::kHashSize);
}

/// Checks reading of any bytes as a clip. It must give a clip that can be written and read again
/// without a change (of the events only the number is compared), or an error that names a part of
/// the file; an offset, if the error has one, must be inside the file.
/// Out: a sentence about the broken promise, or "" if none is broken
inline std::string reading_clip(View bytes, clip::Ends ends) {
  clip::Limits limits;
  limits.values = 1u << 15;
  const auto read = clip::decode(bytes, ends, limits);
  if (!read) {
    const core::Error& error = read.error();
    if (error.message.empty() || error.where.empty()) return "an error that says nothing";
    if (error.offset && *error.offset > bytes.size()) return "an error beyond the file";
    return "";
  }
  const auto written = clip::encode(*read, 64);
  if (!written) return "a clip that was read cannot be written: " + written.error().describe();
  const auto again = clip::decode(*written);
  if (!again) return "what was written cannot be read: " + again.error().describe();
  const bool is_same = again->head == read->head && again->times == read->times &&
                       same_bits(again->curves, read->curves) &&
                       again->events.size() == read->events.size();
  return is_same ? "" : "written and read again a clip is another";
}

/// Checks decoding of any bytes as the curves of a block. They must be refused with a message, or
/// decoding all curves together must succeed exactly if each curve can be decoded alone.
/// Out: a sentence about the broken promise, or "" if none is broken
inline std::string reading_curves(View bytes, std::size_t controls, std::size_t frames) {
  const auto curves = clip::EncodedCurves::open(bytes, controls, frames);
  if (!curves) return curves.error().message.empty() ? "an error that says nothing" : "";
  std::vector<float> out(frames);
  std::size_t good = 0;
  for (std::uint32_t i = 0; i < controls; ++i) {
    good += curves->decode({&i, 1}, out.data(), frames).has_value();
  }
  std::vector<float> all_out(controls * frames);
  std::vector<std::uint32_t> all(controls);
  std::iota(all.begin(), all.end(), 0u);
  if (curves->decode(all, all_out.data(), frames).has_value() != (good == controls)) {
    return "curves together are not as they are alone";
  }
  return "";
}

/// Checks encoding of any bytes as float32 curves of one block; bytes beyond whole frames or beyond
/// the longest block are ignored. Decoding, of each curve alone and of all together, must give the
/// same bits, and the encoded curves may be at most one byte longer than the float32 values.
/// Out: a sentence about the broken promise, or "" if none is broken
inline std::string keeping_bits(View bytes, std::size_t controls) {
  const std::size_t frames =
      std::min<std::size_t>(bytes.size() / 4 / controls, clip::kMostBlockFrames);
  if (frames == 0) return "";
  std::vector<float> values(controls * frames), out(frames);
  std::memcpy(values.data(), bytes.data(), 4 * values.size());
  Bytes encoded;
  clip::encode_curves({values.data(), frames, controls, frames}, encoded);
  if (encoded.size() > 1 + 4 * values.size()) return "curves that grew";
  const auto curves = clip::EncodedCurves::open(encoded, controls, frames);
  if (!curves) return "curves that cannot be read: " + curves.error().describe();
  for (std::uint32_t i = 0; i < controls; ++i) {
    if (!curves->decode({&i, 1}, out.data(), frames)) return "a curve that cannot be read";
    if (!same_bits(out, std::span(values).subspan(i * frames, frames))) return "other bits";
  }
  std::vector<std::uint32_t> all(controls);
  std::iota(all.begin(), all.end(), 0u);
  std::vector<float> all_out(values.size());
  if (!curves->decode(all, all_out.data(), frames)) return "curves that cannot be read";
  if (!same_bits(all_out, values)) return "other bits of all";
  return "";
}

}  // namespace risorius::testing_support
