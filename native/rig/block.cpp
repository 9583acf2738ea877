// SPDX-License-Identifier: MIT
// Makes, opens and checks a Rig (a compiled face) as one block of bytes: a header, then the arrays
// of the Rig, each at a multiple of 64 bytes. The header states the sizes, the place of each array
// and a hash of the bytes.
#include "rig/block.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <mutex>

#include "core/aligned.h"
#include "core/hash.h"
#include "rig/check.h"

namespace risorius::rig {

namespace {

using core::ErrorCode;
using core::fail;
using core::Result;
using core::Status;

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kArrays = [] {
  RigArrays<View> all;
  std::size_t n = 0;
  for_each_array(all, [&](const auto&) { ++n; });
  return n;
}();
constexpr char kMagic[8] = {'R', 'S', 'R', 'I', 'G', 0, 0, 7};  // the last byte is the version
constexpr std::uint32_t kByteOrder = 0x01020304;

struct Place {
  std::uint64_t offset = 0, count = 0;
};

struct BlockHeader {
  char magic[8];
  std::uint32_t byte_order, header_size;
  std::uint64_t size, hash;  // bytes of the whole block; XXH64 of everything behind the hash
  RigHeader rig;
  Place places[kArrays];
};

std::size_t aligned(std::size_t n) { return (n + kAlignment - 1) / kAlignment * kAlignment; }

std::span<const std::uint8_t> hashed_part(std::span<const std::uint8_t> block) {
  return block.subspan(offsetof(BlockHeader, rig));
}

Status damaged(const std::string& where, const std::string& message) {
  return fail(ErrorCode::kInvalidValue, "rig." + where, message);
}

std::string number(std::uint64_t n) { return std::to_string(n); }

Status check_header(std::span<const std::uint8_t> bytes, const BlockHeader& h) {
  constexpr std::size_t kName = sizeof(kMagic) - 1;
  if (std::memcmp(h.magic, kMagic, kName) != 0) {
    return damaged("magic", "these bytes are no compiled face");
  }
  if (h.magic[kName] != kMagic[kName]) {
    return damaged("magic", "a compiled face of version " +
                                number(static_cast<std::uint8_t>(h.magic[kName])) + ", version " +
                                number(kMagic[kName]) + " was expected");
  }
  if (h.byte_order != kByteOrder) {
    return damaged("byte_order", "compiled on a machine of another byte order");
  }
  if (h.header_size != sizeof(BlockHeader)) {
    return damaged("header_size", "a header of " + number(h.header_size) + " bytes, one of " +
                                      number(sizeof(BlockHeader)) + " was expected");
  }
  if (h.size != bytes.size()) {
    return damaged("size",
                   number(h.size) + " bytes were expected, there are " + number(bytes.size()));
  }
  return core::ok();
}

}  // namespace

// Delays the hash of a block that this process compiled. The hash takes a tenth of the time of
// making the block, and only a caller that stores the bytes needs it.
struct Rig::Seal {
  std::span<std::uint8_t> bytes;
  std::once_flag done;
};

std::span<const std::uint8_t> Rig::block() const {
  if (seal_ != nullptr) std::call_once(seal_->done, seal_block, seal_->bytes);
  return block_;
}

struct BlockReader {
  static void seal_later(Rig& rig, std::span<std::uint8_t> bytes) {
    rig.seal_ = std::make_shared<Rig::Seal>();
    rig.seal_->bytes = bytes;
  }

  static Result<Rig> read(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> owner) {
    BlockHeader h;
    if (bytes.size() < sizeof(h)) {
      return fail(
          ErrorCode::kInvalidValue, "rig.size",
          number(bytes.size()) + " bytes, a header of " + number(sizeof(h)) + " was expected");
    }
    std::memcpy(&h, bytes.data(), sizeof(h));
    RISORIUS_TRY(check_header(bytes, h));
    Rig rig;
    static_cast<RigHeader&>(rig) = h.rig;
    std::size_t i = 0;
    bool inside = true;
    for_each_array(rig, [&](auto& view) {
      using T = std::remove_const_t<typename std::remove_reference_t<decltype(view)>::element_type>;
      const Place p = h.places[i++];
      const bool fits = p.offset % kAlignment == 0 && p.offset <= bytes.size() &&
                        p.count <= (bytes.size() - p.offset) / sizeof(T);
      inside = inside && fits;
      if (!fits) return;
      view = {reinterpret_cast<const T*>(bytes.data() + p.offset),
              static_cast<std::size_t>(p.count)};
    });
    if (!inside) return fail(ErrorCode::kInvalidIndex, "rig.places", "an array outside the block");
    rig.block_ = bytes;
    rig.owner_ = std::move(owner);
    return rig;
  }
};

std::uint32_t block_version() { return static_cast<std::uint32_t>(kMagic[sizeof(kMagic) - 1]); }

Result<Rig> open_rig(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> owner,
                     BlockCheck check, const simd::Kernels& kernels) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kAlignment != 0) {
    return fail(ErrorCode::kInvalidArgument, "rig", "the bytes must be aligned to 64");
  }
  static std::atomic<std::uint64_t> opened = 0;
  auto rig = BlockReader::read(bytes, std::move(owner));
  if (!rig) return rig;
  rig->kernels = &kernels;
  rig->number = ++opened;
  if (check == BlockCheck::kHeader) return rig;
  BlockHeader h;
  std::memcpy(&h, bytes.data(), sizeof(h));
  if (h.hash != core::xxh64(hashed_part(bytes))) {
    return fail(ErrorCode::kInvalidValue, "rig.hash", "the bytes were changed or cut");
  }
  if (check == BlockCheck::kHash) return rig;
  RISORIUS_TRY(detail::check_everything(*rig));
  return rig;
}

void seal_block(std::span<std::uint8_t> bytes) {
  const std::uint64_t value = core::xxh64(hashed_part(bytes));
  std::memcpy(bytes.data() + offsetof(BlockHeader, hash), &value, sizeof(value));
}

Result<Rig> make_rig(const RigData& data, const simd::Kernels& kernels, const LateValues& late) {
  BlockHeader h{};
  std::copy(std::begin(kMagic), std::end(kMagic), h.magic);
  h.byte_order = kByteOrder;
  h.header_size = sizeof(BlockHeader);
  h.rig = data;
  const auto is_late = [&](const auto& array) {
    return late.count > 0 &&
           static_cast<const void*>(&array) == static_cast<const void*>(&data.joint_values);
  };
  std::size_t size = aligned(sizeof(BlockHeader)), longest = 0, i = 0;
  for_each_array(data, [&](const auto& array) {
    const std::size_t count = is_late(array) ? late.count : array.size();
    h.places[i++] = {size, count};
    size = aligned(size + count * sizeof(array[0]));
    longest = std::max(longest, count);
  });
  if (longest > UINT32_MAX) {
    return fail(
        ErrorCode::kLimitExceeded, "rig",
        "a list of " + number(longest) + " elements, an index reaches " + number(UINT32_MAX));
  }
  h.size = size;
  const std::shared_ptr<std::uint8_t> block = core::allocate_pages(size, core::Fill::kNothing);
  const std::span<std::uint8_t> bytes(block.get(), size);
  std::size_t end = sizeof(BlockHeader);
  i = 0;
  for_each_array(data, [&](const auto& array) {
    const Place place = h.places[i++];
    const std::size_t length = static_cast<std::size_t>(place.count) * sizeof(array[0]);
    std::uint8_t* const to = bytes.data() + place.offset;
    std::fill(bytes.data() + end, to, std::uint8_t{0});  // the bytes between two arrays
    end = static_cast<std::size_t>(place.offset) + length;
    if (is_late(array)) {
      late.write({reinterpret_cast<float*>(to), late.count});
    } else if (length > 0) {
      std::memcpy(to, array.data(), length);
    }
  });
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(end), bytes.end(), std::uint8_t{0});
  std::memcpy(bytes.data(), &h, sizeof(h));
  auto rig = open_rig(bytes, block, BlockCheck::kHeader, kernels);
  if (!rig) return rig;
  BlockReader::seal_later(*rig, bytes);
  if (!detail::scratch_fits(*rig)) {
    return fail(ErrorCode::kLimitExceeded, "machine_learned_behavior",
                number(data.operation_values) + " values and " + number(data.mask_count) +
                    " regions of networks, more than 64 times the compiled face");
  }
  return rig;
}

}  // namespace risorius::rig
