// SPDX-License-Identifier: MIT
// Reads the cache lines that an evaluation must read, the columns of the active controls (controls
// that are not 0), as fast as the CPU can.
#include "bench/tight_read.h"

#include <algorithm>
#include <cstring>

#include "rig/stages/evaluate.h"
#include "simd/kernels.h"

#if (defined(__x86_64__) || defined(_M_X64)) && !defined(_MSC_VER)
#include <immintrin.h>
#define RISORIUS_WIDE
#endif

namespace risorius::bench {

namespace {

constexpr std::size_t kLine = 64, kSums = 8;

struct Words {
  std::uint64_t sums[kSums] = {};
  void add(const char* from, std::size_t count) {
    std::uint64_t words[kSums];
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(words, from + i * kLine, kLine);
      for (std::size_t s = 0; s < kSums; ++s) sums[s] += words[s];
    }
  }
};

std::uint64_t read_words(const char* memory, std::span<const Lines> lines) {
  Words all;
  for (const Lines& l : lines) all.add(memory + l.first * kLine, l.count);
  std::uint64_t sum = 0;
  for (const std::uint64_t s : all.sums) sum += s;
  return sum;
}

#ifdef RISORIUS_WIDE

__attribute__((target("avx512f"))) std::uint64_t read_512(const char* memory,
                                                          std::span<const Lines> lines) {
  __m512i sums[kSums];
  for (__m512i& s : sums) s = _mm512_setzero_si512();
  for (const Lines& l : lines) {
    const char* from = memory + l.first * kLine;
    std::size_t i = 0;
    for (; i + kSums <= l.count; i += kSums, from += kSums * kLine) {
      for (std::size_t s = 0; s < kSums; ++s) {
        sums[s] = _mm512_add_epi64(sums[s], _mm512_load_si512(from + s * kLine));
      }
    }
    for (; i < l.count; ++i, from += kLine) {
      sums[0] = _mm512_add_epi64(sums[0], _mm512_load_si512(from));
    }
  }
  std::uint64_t sum = 0, words[kSums];
  for (const __m512i& s : sums) {
    _mm512_storeu_si512(words, s);
    for (const std::uint64_t w : words) sum += w;
  }
  return sum;
}

__attribute__((target("avx2"))) std::uint64_t read_256(const char* memory,
                                                       std::span<const Lines> lines) {
  __m256i sums[kSums];
  for (__m256i& s : sums) s = _mm256_setzero_si256();
  for (const Lines& l : lines) {
    const auto* from = reinterpret_cast<const __m256i*>(memory + l.first * kLine);
    std::size_t i = 0;
    for (; i + kSums <= 2 * std::size_t{l.count}; i += kSums, from += kSums) {
      for (std::size_t s = 0; s < kSums; ++s) {
        sums[s] = _mm256_add_epi64(sums[s], _mm256_load_si256(from + s));
      }
    }
    for (; i < 2 * std::size_t{l.count}; ++i, ++from) {
      sums[0] = _mm256_add_epi64(sums[0], _mm256_load_si256(from));
    }
  }
  std::uint64_t sum = 0, words[4];
  for (const __m256i& s : sums) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(words), s);
    for (const std::uint64_t w : words) sum += w;
  }
  return sum;
}

#endif

// Appends the runs of cache lines that one frame needs to out.lines, with adjacent runs joined, and
// adds the size of the columns to out.bytes.
void append_lines(const rig::Rig& rig, const float* controls, std::uint32_t lod, Reads& out) {
  const std::size_t size = rig.is_half() ? 2 : 4, begin = out.lines.size();
  for (std::size_t c = 0; c < rig.control_count; ++c) {
    if (controls[c] == 0.0f) continue;
    for (std::uint32_t i = rig.joint_column_begins[c]; i < rig.joint_column_begins[c + 1]; ++i) {
      const rig::JointColumn& column = rig.joint_columns[i];
      const std::size_t rows = rig.joint_group_lods[column.group * rig.lod_count + lod];
      if (rows == 0) continue;
      out.bytes += static_cast<double>(rows * size);
      const auto first = static_cast<std::uint32_t>(column.offset * size / kLine);
      const auto end =
          static_cast<std::uint32_t>(((column.offset + rows) * size + kLine - 1) / kLine);
      if (out.lines.size() > begin && first <= out.lines.back().first + out.lines.back().count) {
        Lines& last = out.lines.back();
        last.count = std::max(last.count, end - last.first);
      } else {
        out.lines.push_back({first, end - first});
      }
    }
  }
}

}  // namespace

std::uint64_t tight_read(const void* memory, std::span<const Lines> lines) {
  const char* from = static_cast<const char*>(memory);
#ifdef RISORIUS_WIDE
  static const bool has_512 = simd::avx512_kernels() != nullptr,
                    has_256 = simd::avx2_kernels() != nullptr;
  if (has_512) return read_512(from, lines);
  if (has_256) return read_256(from, lines);
#endif
  return read_words(from, lines);
}

void streaming_store(void* memory, std::size_t bytes) {
#ifdef RISORIUS_WIDE
  auto* to = static_cast<char*>(memory);
  for (std::size_t at = 0; at < bytes; at += 16) {
    _mm_stream_si128(reinterpret_cast<__m128i*>(to + at), _mm_set1_epi32(1));
  }
  _mm_sfence();
#else
  std::memset(memory, 1, bytes);
#endif
}

Reads reads_of(const rig::Rig& rig, const Frames& frames, std::uint32_t lod) {
  rig::Workspace work = rig::make_workspace(rig);
  rig::Pose pose = rig::make_pose(rig);
  Reads out;
  out.begins.push_back(0);
  for (std::size_t f = 0; f < frames.count; ++f) {
    rig::evaluate(rig, frames.at(f), lod, true, work, pose);
    append_lines(rig, pose.controls.data(), lod, out);
    out.begins.push_back(out.lines.size());
  }
  out.bytes /= static_cast<double>(frames.count);
  return out;
}

}  // namespace risorius::bench
