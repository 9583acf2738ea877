// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cstring>

#include "clip/block.h"
#include "clip/predict.h"
#include "clip/symbols.h"

namespace risorius::clip {

namespace {

using core::ErrorCode;
using core::fail;

// What the next bits of a chunk mean, packed so that one load gives all.
// bits 0-5    how many bits the code and what follows it have together
// bit 6       a rest, bit 7: no code begins so
// bits 8-11   length of the code, 16-20: how many bits follow it
// bit 15      1 above the bits that follow
// bits 24-27  the code of the next symbol
using Entry = std::uint32_t;
constexpr Entry kIsRest = 1u << 6, kIsNone = 1u << 7;

Entry entry_of(std::uint32_t symbol, std::uint32_t length, std::uint32_t next) {
  const std::uint32_t extra = extra_bits(symbol);
  return (length + extra) | (symbol >= kRest ? kIsRest : 0) | length << 8 |
         (symbol > 0 ? 1u << 15 : 0) | extra << 16 | next << 24;
}

constexpr std::size_t kTableSize = std::size_t{1} << kLongestCode;
constexpr std::size_t kSpare = 8;  // bytes that a load may reach beyond a chunk

class BitReader {
 public:
  BitReader(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), end_(8 * size) {}
  // At least 57 bits, those behind the end are anything.
  std::uint64_t peek() const {
    std::uint64_t word;
    std::memcpy(&word, bytes_ + (at_ >> 3), sizeof word);
    return word >> (at_ & 7);
  }
  void skip(std::uint32_t count) { at_ += count; }
  bool is_beyond() const { return at_ > end_; }
  bool is_at_end() const { return at_ <= end_ && end_ - at_ < 8; }

 private:
  const std::uint8_t* bytes_;
  std::size_t at_ = 0, end_;
};

std::uint32_t number_of(std::uint64_t word, Entry entry) {
  const std::uint32_t extra = entry >> 16 & 31;
  const std::uint64_t below = word >> (entry >> 8 & 15) & ((std::uint64_t{1} << extra) - 1);
  return static_cast<std::uint32_t>(below | std::uint64_t{entry >> 15 & 1} << extra);
}

// Out: every frame was there, and nothing more.
template <int kOrder>
bool decode_chunk(const Entry* tables, BitReader bits, std::uint32_t first, std::uint32_t* out,
                  std::size_t frames) {
  History<kOrder> history(first);
  std::uint32_t* const end = out + frames;
  *out++ = first;
  for (const Entry* table = tables; out < end;) {
    if (bits.is_beyond()) return false;
    const std::uint64_t word = bits.peek();
    const Entry entry = table[word & (kTableSize - 1)];
    table = tables + (entry >> 24) * kTableSize;
    bits.skip(entry & 63);
    const std::uint32_t number = number_of(word, entry);
    if ((entry & (kIsRest | kIsNone)) == 0) [[likely]] {
      *out++ = in_order(history.next() + unfold(number));
      history.add(out[-1]);
      continue;
    }
    if ((entry & kIsNone) != 0 || number > static_cast<std::size_t>(end - out)) return false;
    std::fill_n(out, number, history.last());
    history.rest(history.last(), number);
    out += number;
  }
  return bits.is_at_end();
}

}  // namespace

struct EncodedCurves::Tables {
  std::array<Entry, kMostCodes * kTableSize> entries;
};

EncodedCurves::EncodedCurves() = default;
EncodedCurves::EncodedCurves(EncodedCurves&&) noexcept = default;
EncodedCurves& EncodedCurves::operator=(EncodedCurves&&) noexcept = default;
EncodedCurves::~EncodedCurves() = default;

bool EncodedCurves::read_tables(Cursor& in) {
  const auto count = in.get<std::uint8_t>();
  if (in.failed() || count == 0) return !in.failed();
  if (count < 2 || count > kMostCodes) return false;
  const View bounds = in.take(count - 2u);
  std::array<Code, kMostCodes> codes;
  if (!get_lengths(in, std::span(codes).first(count))) return false;
  if (!std::is_sorted(bounds.begin(), bounds.end())) return false;
  tables_ = std::make_unique<Tables>();
  tables_->entries.fill(kIsNone);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::uint32_t symbol = 0; symbol < kRest + kRests; ++symbol) {
      const std::uint32_t length = codes[i].lengths[symbol];
      if (length == 0) continue;
      const auto place = std::lower_bound(bounds.begin(), bounds.end(), symbol) - bounds.begin();
      const Entry entry =
          entry_of(symbol, length, symbol >= kRest ? 0 : static_cast<std::uint32_t>(1 + place));
      for (std::size_t at = codes[i].bits[symbol]; at < kTableSize;
           at += std::size_t{1} << length) {
        tables_->entries[i * kTableSize + at] = entry;
      }
    }
  }
  return true;
}

core::Status EncodedCurves::read_parts(Cursor& in, std::size_t controls) {
  std::size_t size = 0;
  const auto refuse = [&](const char* message) {
    return fail(ErrorCode::kInvalidValue, "parts[" + std::to_string(parts_.size()) + "]", message,
                in.position());
  };
  while (parts_.size() < controls) {
    const std::uint64_t token = in.count(), number = token >> 2;
    const auto kind = static_cast<PartKind>(token & 3);
    const std::uint32_t bits = kind == PartKind::kConstant ? in.get<std::uint32_t>() : 0;
    if (in.failed()) return refuse("the list of controls ends before the last control");
    if (kind == PartKind::kCoded) {
      if (number < 5 || number > in.left() || size > in.left() - number) {
        return refuse("a curve's bytes end beyond the block");
      }
      parts_.push_back({Part::kCoded, 0, size, static_cast<std::size_t>(number)});
      size += static_cast<std::size_t>(number);
    } else if (kind == PartKind::kRepeated) {
      if (number >= parts_.size()) return refuse("a curve repeats one that is not before it");
      parts_.push_back(Part(parts_[static_cast<std::size_t>(number)]));
    } else {
      if (number == 0 || number > controls - parts_.size()) {
        return refuse("resting curves for more controls than there are");
      }
      parts_.resize(parts_.size() + static_cast<std::size_t>(number), {Part::kConstant, bits});
    }
  }
  if (size != in.left()) return refuse("bytes follow the last curve");
  for (Part& part : parts_) part.offset += in.position();
  return core::ok();
}

core::Result<EncodedCurves> EncodedCurves::open(View bytes, std::size_t controls,
                                                std::size_t frames) {
  EncodedCurves curves;
  curves.bytes_ = bytes;
  curves.frames_ = frames;
  Cursor in(bytes);
  const auto form = in.get<std::uint8_t>();
  if (form == kStoredBlock && !in.failed()) {
    if (in.left() / 4 / frames != controls || in.left() % (4 * frames) != 0) {
      return fail(ErrorCode::kInvalidLength, "", "stored curves of another size", 0);
    }
    for (std::size_t i = 0; i < controls; ++i) {
      curves.parts_.push_back({Part::kStored, 0, 1 + 4 * frames * i, 4 * frames});
    }
    return curves;
  }
  if (form != kCodedBlock || in.failed()) {
    return fail(ErrorCode::kInvalidValue, "form", "a form of 0 or 1 was expected", 0);
  }
  if (!curves.read_tables(in)) {
    return fail(ErrorCode::kInvalidValue, "codes", "these are no prefix codes", in.position());
  }
  if (auto read = curves.read_parts(in, controls); !read) return std::move(read).propagate();
  return curves;
}

core::Status EncodedCurves::decode(std::size_t control, float* out) const {
  const Part& part = parts_[control];
  if (part.kind == Part::kConstant) {
    std::fill_n(reinterpret_cast<std::uint32_t*>(out), frames_, part.bits);
    return core::ok();
  }
  View bytes = bytes_.subspan(part.offset, part.size);
  if (part.kind == Part::kStored) {
    std::memcpy(out, bytes.data(), bytes.size());
    return core::ok();
  }
  const auto refuse = [&](const char* message) {
    return fail(ErrorCode::kInvalidValue, "parts[" + std::to_string(control) + "]", message,
                part.offset);
  };
  if (bytes[0] == kStoredChunk) {
    if (bytes.size() != 1 + 4 * frames_) return refuse("a stored curve of another length");
    std::memcpy(out, bytes.data() + 1, 4 * frames_);
    return core::ok();
  }
  if (bytes[0] >= kOrders || tables_ == nullptr) return refuse("a curve of an unknown kind");
  Bytes copy;
  if (bytes_.size() - part.offset - part.size < kSpare) {
    copy.assign(bytes.begin(), bytes.end());
    copy.resize(copy.size() + kSpare);
    bytes = View(copy).first(bytes.size());
  }
  std::uint32_t first;
  std::memcpy(&first, bytes.data() + 1, sizeof first);
  const BitReader bits(bytes.data() + 5, bytes.size() - 5);
  const DefaultArithmetic arithmetic;
  const bool whole = with_order(bytes[0], [&]<int kOrder>() {
    return decode_chunk<kOrder>(tables_->entries.data(), bits, first,
                                reinterpret_cast<std::uint32_t*>(out), frames_);
  });
  if (!whole) return refuse("a curve's bits do not give its frames");
  return core::ok();
}

}  // namespace risorius::clip
