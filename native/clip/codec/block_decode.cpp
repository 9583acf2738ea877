// SPDX-License-Identifier: MIT
// Decodes the curves of a block. A coded curve is a chunk of bytes: the order of its predictor,
// the first value, then tokens (a prefix code and extra bits) for the other values.
#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "clip/codec/block.h"
#include "clip/codec/predict.h"
#include "clip/codec/symbols.h"

namespace risorius::clip {

namespace {

using core::ErrorCode;
using core::fail;

// The entry of a table that is indexed by the next bits of a chunk: the meaning of these bits,
// packed into one word:
// bits 0-5    number of bits of the code and its extra bits together
// bit 6       the symbol repeats the last value; bit 7: no code begins with these bits
// bits 8-11   length of the code; 16-20: number of extra bits
// bit 14      the prediction error has the opposite sign of the one before
// bit 15      the highest bit of the error or count, whose lower bits are the extra bits
// bits 24-27  number of the prefix code of the next symbol
using Entry = std::uint32_t;
constexpr Entry kIsRest = 1u << 6, kIsNone = 1u << 7;

Entry entry_of(std::uint32_t symbol, std::uint32_t length, std::uint32_t next) {
  const std::uint32_t extra = extra_bits(symbol);
  return (length + extra) | (symbol >= kRest ? kIsRest : 0) | length << 8 |
         (has_other_sign(symbol) ? 1u << 14 : 0) | (symbol > 0 ? 1u << 15 : 0) | extra << 16 |
         next << 24;
}

constexpr std::size_t kTableSize = std::size_t{1} << kLongestCode;
constexpr std::size_t kSpare = 8;  // bytes that a load may read past a chunk

class BitReader {
 public:
  BitReader(const std::uint8_t* bytes, std::size_t size) : bytes_(bytes), end_(8 * size) {}
  // A word with at least the next 57 bits, the first of them in the lowest bit. Bits after the end
  // of the chunk are undefined.
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

// The state of a curve during decoding.
template <int kOrder>
class Lane {
 public:
  // In: tables  the tables of all prefix codes of the block, one after the other
  //     chunk   a coded chunk; kSpare bytes after its end must be readable
  //     out     [frames] gets the bits of the values
  Lane(const Entry* tables, View chunk, std::uint32_t* out, std::size_t frames)
      : tables_(tables),
        table_(tables),
        bits_(chunk.data() + 5, chunk.size() - 5),
        history_(first_of(chunk)),
        out_(out),
        end_(out + frames) {
    *out_++ = history_.last();
  }
  bool is_done() const { return out_ == end_; }
  bool is_whole() const { return bits_.is_at_end(); }

  // Decodes the next symbol: a value, or a repetition of the last value. False if no code begins
  // with the next bits, if the last bits were beyond the chunk, or if the repetition has too many
  // frames.
  bool step() {
    if (bits_.is_beyond()) [[unlikely]]
      return false;
    const std::uint64_t word = bits_.peek();
    const Entry entry = table_[word & (kTableSize - 1)];
    table_ = tables_ + (entry >> 24) * kTableSize;
    bits_.skip(entry & 63);
    const std::uint32_t number = number_of(word, entry);
    if ((entry & (kIsRest | kIsNone)) != 0) [[unlikely]]
      return rest(entry, number);
    sign_ ^= 0 - (entry >> 14 & 1);
    const std::uint32_t value = in_order(history_.next() + ((number ^ sign_) - sign_));
    *out_++ = value;
    history_.add(value);
    return true;
  }

 private:
  static std::uint32_t first_of(View chunk) {
    std::uint32_t bits;
    std::memcpy(&bits, chunk.data() + 1, sizeof bits);
    return bits;
  }
  bool rest(Entry entry, std::uint32_t count) {
    if ((entry & kIsNone) != 0 || count > static_cast<std::size_t>(end_ - out_)) return false;
    std::fill_n(out_, count, history_.last());
    history_.rest(history_.last(), count);
    out_ += count;
    return true;
  }

  const Entry *tables_, *table_;
  BitReader bits_;
  History<kOrder> history_;
  std::uint32_t *out_, *end_;
  std::uint32_t sign_ = 0;  // of the last error that was not 0
};

// Decodes the remaining frames of a curve. Out: true if the chunk had every frame and nothing more
template <int kOrder>
bool finish(Lane<kOrder>& lane) {
  while (!lane.is_done()) {
    if (!lane.step()) return false;
  }
  return lane.is_whole();
}

// Decodes two curves in turns: while one waits for a read of its table, the other continues.
template <int kOrder>
std::array<bool, 2> finish_both(Lane<kOrder> a, Lane<kOrder> b) {
  while (!a.is_done() && !b.is_done()) {
    if (!a.step()) return {false, finish(b)};
    if (!b.step()) return {finish(a), false};
  }
  const bool first = finish(a);
  return {first, finish(b)};
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
      parts_.push_back({Part::kCoded, false, 0, size, static_cast<std::size_t>(number)});
      size += static_cast<std::size_t>(number);
    } else if (kind == PartKind::kRepeated) {
      if (number >= parts_.size()) return refuse("a curve repeats one that is not before it");
      parts_.push_back(Part(parts_[static_cast<std::size_t>(number)]));
    } else {
      if (number == 0 || number > controls - parts_.size()) {
        return refuse("resting curves for more controls than there are");
      }
      parts_.resize(parts_.size() + static_cast<std::size_t>(number),
                    {Part::kConstant, false, bits});
    }
  }
  if (size != in.left()) return refuse("bytes follow the last curve");
  for (Part& part : parts_) part.offset += in.position();
  keep_tail();
  return core::ok();
}

// Copies the end of the block from the first coded chunk on that has fewer than kSpare bytes after
// it, and adds kSpare bytes, because decoding may read past a chunk.
void EncodedCurves::keep_tail() {
  tail_begin_ = bytes_.size();
  for (Part& part : parts_) {
    part.is_near_end =
        part.kind == Part::kCoded && bytes_.size() - part.offset - part.size < kSpare;
    if (part.is_near_end) tail_begin_ = std::min(tail_begin_, part.offset);
  }
  const View tail = bytes_.subspan(tail_begin_);
  tail_.assign(tail.begin(), tail.end());
  tail_.resize(tail_.size() + kSpare);
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
      curves.parts_.push_back({Part::kStored, false, 0, 1 + 4 * frames * i, 4 * frames});
    }
    return curves;
  }
  if (form != kCodedBlock || in.failed()) {
    return fail(ErrorCode::kInvalidValue, "form", "a form of 0 or 1 was expected", 0);
  }
  if (!curves.read_tables(in)) {
    return fail(ErrorCode::kInvalidValue, "codes", "these are no prefix codes", in.position());
  }
  RISORIUS_TRY(curves.read_parts(in, controls));
  return curves;
}

// A coded chunk that waits for a second one of the same order, because two are decoded together.
struct EncodedCurves::Pending {
  std::size_t control = 0;
  View chunk;
  std::uint32_t* out = nullptr;
};

core::Status EncodedCurves::refuse(std::size_t control, const char* message) const {
  return fail(ErrorCode::kInvalidValue, "parts[" + std::to_string(control) + "]", message,
              parts_[control].offset);
}

// Writes all frames of a control to `out` if its curve is not coded. Out: false if it is coded
core::Result<bool> EncodedCurves::fill(std::size_t control, float* out) const {
  const Part& part = parts_[control];
  if (part.kind == Part::kConstant) {
    std::fill_n(reinterpret_cast<std::uint32_t*>(out), frames_, part.bits);
    return true;
  }
  const View bytes = bytes_.subspan(part.offset, part.size);
  if (part.kind == Part::kStored) {
    std::memcpy(out, bytes.data(), bytes.size());
    return true;
  }
  if (bytes[0] == kStoredChunk) {
    if (bytes.size() != 1 + 4 * frames_) {
      return refuse(control, "a stored curve of another length").propagate();
    }
    std::memcpy(out, bytes.data() + 1, 4 * frames_);
    return true;
  }
  if (bytes[0] >= kOrders || tables_ == nullptr) {
    return refuse(control, "a curve of an unknown kind").propagate();
  }
  return false;
}

core::Status EncodedCurves::decode_pair(const Pending& a, const Pending* b) const {
  const Entry* const tables = tables_->entries.data();
  const std::array<bool, 2> whole = with_order(a.chunk[0], [&]<int kOrder> {
    Lane<kOrder> first(tables, a.chunk, a.out, frames_);
    if (b == nullptr) return std::array{finish(first), true};
    return finish_both(first, Lane<kOrder>(tables, b->chunk, b->out, frames_));
  });
  constexpr const char* kMessage = "a curve's bits do not give its frames";
  if (!whole[0]) return refuse(a.control, kMessage);
  if (!whole[1]) return refuse(b->control, kMessage);
  return core::ok();
}

core::Status EncodedCurves::decode(std::span<const std::uint32_t> controls, float* out,
                                   std::size_t stride) const {
  const DefaultArithmetic arithmetic;
  std::array<std::optional<Pending>, kOrders> waiting;
  for (std::size_t i = 0; i < controls.size(); ++i) {
    float* const to = out + i * stride;
    auto filled = fill(controls[i], to);
    if (!filled) return std::move(filled).propagate();
    if (*filled) continue;
    const Part& part = parts_[controls[i]];
    const View bytes = part.is_near_end ? View(tail_).subspan(part.offset - tail_begin_, part.size)
                                        : bytes_.subspan(part.offset, part.size);
    const Pending here{controls[i], bytes, reinterpret_cast<std::uint32_t*>(to)};
    std::optional<Pending>& other = waiting[bytes[0]];
    if (!other) {
      other = here;
      continue;
    }
    RISORIUS_TRY(decode_pair(*other, &here));
    other.reset();
  }
  for (const std::optional<Pending>& last : waiting) {
    if (!last) continue;
    RISORIUS_TRY(decode_pair(*last, nullptr));
  }
  return core::ok();
}

}  // namespace risorius::clip
