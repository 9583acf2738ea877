// SPDX-License-Identifier: MIT
#include "clip/codec/hash.h"

#include <bit>
#include <cstring>

namespace risorius::clip {

namespace {

static_assert(std::endian::native == std::endian::little, "files are read as they lie in memory");

constexpr std::uint64_t kPrimes[5] = {0x9E3779B185EBCA87u, 0xC2B2AE3D27D4EB4Fu, 0x165667B19E3779F9u,
                                      0x85EBCA77C2B2AE63u, 0x27D4EB2F165667C5u};

template <class T>
std::uint64_t load(const std::uint8_t* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

std::uint64_t round(std::uint64_t lane, std::uint64_t word) {
  return std::rotl(lane + word * kPrimes[1], 31) * kPrimes[0];
}

// Four lanes over the whole stripes of 32 bytes; moves `at` behind them.
std::uint64_t stripes(const std::uint8_t*& at, const std::uint8_t* end) {
  std::uint64_t lanes[4] = {kPrimes[0] + kPrimes[1], kPrimes[1], 0, 0 - kPrimes[0]};
  for (; end - at >= 32; at += 32) {
    for (int i = 0; i < 4; ++i) lanes[i] = round(lanes[i], load<std::uint64_t>(at + 8 * i));
  }
  std::uint64_t hash = std::rotl(lanes[0], 1) + std::rotl(lanes[1], 7) + std::rotl(lanes[2], 12) +
                       std::rotl(lanes[3], 18);
  for (const std::uint64_t lane : lanes) {
    hash = (hash ^ round(0, lane)) * kPrimes[0] + kPrimes[3];
  }
  return hash;
}

}  // namespace

std::uint64_t xxh64(std::span<const std::uint8_t> bytes) {
  const std::uint8_t *at = bytes.data(), *end = at + bytes.size();
  std::uint64_t hash = bytes.size() >= 32 ? stripes(at, end) : kPrimes[4];
  hash += bytes.size();
  for (; end - at >= 8; at += 8) {
    hash = std::rotl(hash ^ round(0, load<std::uint64_t>(at)), 27) * kPrimes[0] + kPrimes[3];
  }
  for (; end - at >= 4; at += 4) {
    hash = std::rotl(hash ^ load<std::uint32_t>(at) * kPrimes[0], 23) * kPrimes[1] + kPrimes[2];
  }
  for (; at < end; ++at) hash = std::rotl(hash ^ *at * kPrimes[4], 11) * kPrimes[0];
  hash = (hash ^ hash >> 33) * kPrimes[1];
  hash = (hash ^ hash >> 29) * kPrimes[2];
  return hash ^ hash >> 32;
}

}  // namespace risorius::clip
