// SPDX-License-Identifier: MIT
// Computes prefix codes, and writes and reads the lengths of their codes.
#include "clip/codec/huffman.h"

#include <algorithm>
#include <queue>
#include <vector>

namespace risorius::clip {

bool Code::assign() {
  std::array<std::uint32_t, kLongestCode + 1> first{}, counts{};
  for (const std::uint8_t length : lengths) ++counts[length];
  counts[0] = 0;
  for (std::uint32_t length = 1; length <= kLongestCode; ++length) {
    first[length] = (first[length - 1] + counts[length - 1]) << 1;
    if (first[length] + counts[length] > 1u << length) return false;
  }
  for (std::size_t symbol = 0; symbol < kMostSymbols; ++symbol) {
    const std::uint8_t length = lengths[symbol];
    if (length == 0) continue;
    std::uint32_t code = first[length]++, reversed = 0;
    for (int i = 0; i < length; ++i, code >>= 1) reversed = reversed << 1 | (code & 1);
    bits[symbol] = static_cast<std::uint16_t>(reversed);
  }
  return true;
}

namespace {

// Sets code.lengths to the depths of the leaves of a Huffman tree over the symbols that occur.
// In: counts  how often each symbol occurs. Out: the largest depth
std::uint8_t measure(std::span<const std::uint32_t> counts, Code& code) {
  struct Node {
    std::uint64_t weight;
    std::size_t index;
    bool operator>(const Node& other) const {
      return weight != other.weight ? weight > other.weight : index > other.index;
    }
  };
  std::priority_queue<Node, std::vector<Node>, std::greater<>> queue;
  std::vector<std::size_t> parents(2 * counts.size(), 0);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) queue.push({counts[i], i});
  }
  if (queue.size() == 1) {
    code.lengths[queue.top().index] = 1;
    return 1;
  }
  std::size_t next = counts.size();
  for (; queue.size() > 1; ++next) {
    const Node a = queue.top();
    queue.pop();
    const Node b = queue.top();
    queue.pop();
    parents[a.index] = parents[b.index] = next;
    queue.push({a.weight + b.weight, next});
  }
  std::uint8_t longest = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    code.lengths[i] = 0;
    for (std::size_t at = i; counts[i] > 0 && parents[at] != 0; at = parents[at]) ++code.lengths[i];
    longest = std::max(longest, code.lengths[i]);
  }
  return longest;
}

}  // namespace

Code make_code(std::span<const std::uint32_t, kMostSymbols> counts) {
  Code code;
  std::array<std::uint32_t, kMostSymbols> weights{};
  std::copy(counts.begin(), counts.end(), weights.begin());
  // If a code is too long, the weights are made more equal, which shortens it; the encoded bytes
  // grow by far less than a percent.
  while (measure(weights, code) > kLongestCode) {
    for (std::uint32_t& weight : weights) weight = weight == 0 ? 0 : weight / 2 + 1;
  }
  code.assign();
  return code;
}

void put_lengths(Bytes& out, std::span<const Code> codes) {
  std::vector<std::uint8_t> halves;
  for (const Code& code : codes) {
    for (std::size_t i = 0; i < kMostSymbols; ++i) {
      halves.push_back(code.lengths[i]);
      if (code.lengths[i] > 0) continue;
      std::uint8_t more = 0;
      while (more < 15 && i + 1 < kMostSymbols && code.lengths[i + 1] == 0) ++i, ++more;
      halves.push_back(more);
    }
  }
  if (halves.size() % 2 != 0) halves.push_back(0);
  for (std::size_t i = 0; i < halves.size(); i += 2) {
    out.push_back(static_cast<std::uint8_t>(halves[i] | halves[i + 1] << 4));
  }
}

bool get_lengths(Cursor& in, std::span<Code> codes) {
  std::uint8_t byte = 0;
  bool is_high = false;
  const auto half = [&] {
    if (!is_high) byte = in.get<std::uint8_t>();
    is_high = !is_high;
    return static_cast<std::uint8_t>(is_high ? byte & 15 : byte >> 4);
  };
  for (Code& code : codes) {
    for (std::size_t i = 0; i < kMostSymbols; ++i) {
      const std::uint8_t length = half();
      if (in.failed() || length > kLongestCode) return false;
      code.lengths[i] = length;
      if (length > 0) continue;
      const std::uint8_t more = half();
      if (more > kMostSymbols - 1 - i) return false;
      i += more;
    }
    if (!code.assign()) return false;
  }
  return !in.failed();
}

}  // namespace risorius::clip
