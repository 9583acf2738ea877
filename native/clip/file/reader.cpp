// SPDX-License-Identifier: MIT
// Reads .rzc files: head and index first, then single blocks of frames.
#include "clip/file/reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>
#include <unordered_set>

#include "clip/codec/block.h"
#include "clip/file/layout.h"
#include "core/hash.h"

namespace risorius::clip {

namespace {

using core::ErrorCode;
using core::fail;

// The `size` bytes from `offset` on, or nullopt if the source has fewer.
std::optional<Bytes> read_bytes(bytes::Source& source, std::uint64_t offset, std::uint64_t size) {
  if (offset > source.size() || size > source.size() - offset) return std::nullopt;
  Bytes bytes(static_cast<std::size_t>(size));
  if (source.read(offset, bytes) != bytes.size()) return std::nullopt;
  return bytes;
}

template <class T>
T number_at(View bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

// Whether the last 8 bytes are the hash of the bytes before them.
bool is_sealed(View bytes) {
  const std::size_t size = bytes.size() - kHashSize;
  return number_at<std::uint64_t>(bytes, size) == core::xxh64(bytes.first(size));
}

bool get_times(Cursor& in, std::size_t frames, std::vector<double>& times) {
  std::uint64_t last = 0, step = 0;
  for (std::size_t i = 0; i < frames; ++i) {
    const std::uint64_t folded = in.count();
    step += folded >> 1 ^ (0 - (folded & 1));
    last += step;
    const double time = std::bit_cast<double>(time_in_order(last));
    if (in.failed() || !std::isfinite(time) || (i > 0 && !(time > times.back()))) return false;
    times.push_back(time);
  }
  return true;
}

}  // namespace

// A loaded block. `curves` refers to `bytes`.
struct Reader::Loaded {
  std::size_t block = 0;
  Bytes bytes;
  std::vector<double> times;
  std::optional<EncodedCurves> curves;
};

core::Status Reader::read_head(const Limits& limits) {
  const auto start = read_bytes(*source_, 0, std::min<std::uint64_t>(kHeadStart, source_->size()));
  if (!start || start->size() < kMagic.size() ||
      !std::equal(kMagic.begin(), kMagic.end(), start->begin())) {
    return fail(ErrorCode::kNotClip, "head.magic", "this is no clip of Risorius (.rzc)", 0);
  }
  if (start->size() < kHeadStart) {
    return fail(ErrorCode::kTruncated, "head", "the file ends within its head", start->size());
  }
  const auto version = number_at<std::uint32_t>(*start, 4);
  if (version != kVersion) {
    return fail(ErrorCode::kUnsupportedGeneration, "head.version",
                "a clip of version " + std::to_string(kVersion) + " was expected, found version " +
                    std::to_string(version),
                4);
  }
  const auto size = number_at<std::uint32_t>(*start, 8);
  if (size > limits.head_bytes) {
    return fail(ErrorCode::kLimitExceeded, "head",
                "a head of " + std::to_string(size) + " bytes, the limit is " +
                    std::to_string(limits.head_bytes),
                8);
  }
  const auto bytes = read_bytes(*source_, 0, kHeadStart + size + kHashSize);
  if (!bytes) {
    return fail(ErrorCode::kTruncated, "head", "the file ends within its head", source_->size());
  }
  if (!is_sealed(*bytes)) {
    return fail(ErrorCode::kInvalidValue, "head", "the head is damaged: its checksum is another",
                kHeadStart);
  }
  first_block_ = end_ = bytes->size();
  return read_names(View(*bytes).subspan(kHeadStart, size), limits);
}

// Reads rate, start, control names and metadata. In: body  the bytes of the head
core::Status Reader::read_names(View body, const Limits& limits) {
  Cursor in(body);
  const auto refuse = [&](ErrorCode code, std::string where, std::string message) {
    return fail(code, std::move(where), std::move(message), kHeadStart + in.position());
  };
  head_.rate = in.get<double>();
  head_.start = in.get<double>();
  const auto flags = in.get<std::uint8_t>();
  head_.has_times = flags == 1;
  if (flags > 1 || !(std::isfinite(head_.rate) && head_.rate > 0.0) ||
      !std::isfinite(head_.start)) {
    return refuse(ErrorCode::kInvalidValue, "head", "a rate, a start and a flag were expected");
  }
  const std::uint64_t controls = in.count();
  if (controls > limits.controls) {
    return refuse(
        ErrorCode::kLimitExceeded, "head.names",
        std::to_string(controls) + " controls, the limit is " + std::to_string(limits.controls));
  }
  std::unordered_set<std::string> seen;
  std::uint64_t length = 0;
  for (std::uint64_t i = 0; i < controls && !in.failed(); ++i) {
    head_.names.push_back(in.next_text(head_.names.empty() ? "" : head_.names.back()));
    // The limit holds for the decoded names: in the file a name may repeat most of the previous
    // name in a few bytes.
    length += head_.names.back().size();
    if (length > limits.head_bytes) {
      return refuse(ErrorCode::kLimitExceeded, "head.names",
                    "names longer than " + std::to_string(limits.head_bytes) + " bytes together");
    }
    if (!seen.insert(head_.names.back()).second && !in.failed()) {
      return refuse(ErrorCode::kInvalidValue, "head.names[" + std::to_string(i) + "]",
                    "a control may have one curve only, found two");
    }
  }
  const std::uint64_t pairs = in.count();
  if (pairs > limits.metadata) {
    return refuse(
        ErrorCode::kLimitExceeded, "head.metadata",
        std::to_string(pairs) + " pairs, the limit is " + std::to_string(limits.metadata));
  }
  for (std::uint64_t i = 0; i < pairs && !in.failed(); ++i) {
    std::string key = in.text();
    head_.metadata.emplace_back(std::move(key), in.text());
  }
  if (in.failed() || in.left() > 0) {
    return refuse(ErrorCode::kInvalidLength, "head", "names and metadata do not fill the head");
  }
  return core::ok();
}

core::Status Reader::read_index() {
  const std::uint64_t size = source_->size();
  if (size < first_block_ + kEndSize) {
    return fail(ErrorCode::kTruncated, "index", "the file ends before its index", size);
  }
  const auto end = read_bytes(*source_, size - kEndSize, kEndSize);
  if (!end || number_at<std::uint32_t>(*end, 12) != kEndMark) {
    return fail(ErrorCode::kTruncated, "index",
                "the file has no index at its end: it was cut, or not closed", size - kEndSize);
  }
  const auto offset = number_at<std::uint64_t>(*end, 0);
  const auto length = number_at<std::uint32_t>(*end, 8);
  if (offset < first_block_ || offset > size - kEndSize || length != size - kEndSize - offset) {
    return fail(ErrorCode::kInvalidValue, "index", "the index lies elsewhere", size - kEndSize);
  }
  const auto bytes = read_bytes(*source_, offset, size - offset);
  if (!bytes || !is_sealed(*bytes)) {
    return fail(ErrorCode::kInvalidValue, "index", "the index is damaged: its checksum is another",
                offset);
  }
  end_ = size;
  return read_blocks(View(*bytes).first(length), offset);
}

// Reads the table of blocks and the events. In: index  the index's bytes; offset  their byte offset
// in the file
core::Status Reader::read_blocks(View index, std::uint64_t offset) {
  Cursor in(index);
  const auto refuse = [&](ErrorCode code, std::string message) {
    return fail(code, "index[" + std::to_string(blocks_.size()) + "]", std::move(message),
                offset + in.position());
  };
  const bool is_index = in.get<std::uint32_t>() == kIndexMark;
  const std::uint64_t count = in.count();
  if (!is_index || count > in.left()) return refuse(ErrorCode::kInvalidCount, "this is no index");
  std::uint64_t at = first_block_;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t bytes_of = in.count(), frames = in.count();
    if (in.failed() || frames > kMostBlockFrames || bytes_of > offset - at ||
        kBlockStart > offset - at - bytes_of) {
      return refuse(ErrorCode::kInvalidValue, "a block ends beyond the blocks");
    }
    blocks_.push_back(
        {at, static_cast<std::uint32_t>(bytes_of), static_cast<std::uint32_t>(frames)});
    at += kBlockStart + bytes_of;
    starts_.push_back(frames_ += frames);
  }
  events_ = get_events(in);
  if (in.failed() || in.left() > 0 || at != offset) {
    return refuse(ErrorCode::kInvalidLength, "blocks and events do not fill the file");
  }
  return core::ok();
}

// Loads the block at `offset` and adds it to the list. Out: false if no complete block is there
bool Reader::take_block(std::uint64_t offset, Block& block) {
  const auto start = read_bytes(*source_, offset, kBlockStart);
  if (!start || number_at<std::uint32_t>(*start, 0) != kBlockMark) return false;
  block = {offset, number_at<std::uint32_t>(*start, 4), number_at<std::uint32_t>(*start, 8)};
  if (block.frames > kMostBlockFrames) return false;
  blocks_.push_back(block);
  const bool is_whole = load(blocks_.size() - 1).has_value();
  if (!is_whole) blocks_.pop_back();
  return is_whole;
}

// Reads the blocks one after the other without the index, up to the last complete one.
void Reader::find_blocks() {
  blocks_.clear();
  starts_.assign(1, 0);
  events_.clear();
  frames_ = 0;
  end_ = first_block_;
  Block block{};
  while (take_block(end_, block)) {
    Cursor in(View(loaded_->bytes).subspan(kBlockStart));
    std::vector<Event> events = get_events(in);
    events_.insert(events_.end(), events.begin(), events.end());
    starts_.push_back(frames_ += block.frames);
    end_ += kBlockStart + block.size;
  }
}

core::Result<Reader> Reader::open(std::unique_ptr<bytes::Source> source, Ends ends,
                                  const Limits& limits) {
  Reader reader;
  reader.source_ = std::move(source);
  reader.limits_ = limits;
  RISORIUS_TRY(reader.read_head(limits));
  reader.starts_.assign(1, 0);
  if (auto read = reader.read_index(); !read) {
    if (ends == Ends::kMustBeWhole) return std::move(read).propagate();
    reader.find_blocks();
  }
  if (reader.frames_ > limits.frames) {
    return fail(
        ErrorCode::kLimitExceeded, "index",
        std::to_string(reader.frames_) + " frames, the limit is " + std::to_string(limits.frames),
        reader.end_);
  }
  return reader;
}

core::Status Reader::load(std::size_t index) {
  if (loaded_ && loaded_->block == index) return core::ok();
  const Block& block = blocks_[index];
  const auto refuse = [&](ErrorCode code, const std::string& where, std::string message,
                          std::uint64_t at) {
    return fail(code, "blocks[" + std::to_string(index) + "]" + where, std::move(message),
                block.offset + at);
  };
  auto loaded = std::make_shared<Loaded>();
  loaded_.reset();
  auto bytes = read_bytes(*source_, block.offset, kBlockStart + std::uint64_t{block.size});
  if (!bytes) return refuse(ErrorCode::kTruncated, "", "the file ends within the block", 0);
  loaded->block = index;
  loaded->bytes = std::move(*bytes);
  std::uint8_t* const hash_at = loaded->bytes.data() + kBlockStart - kHashSize;
  const auto hash = number_at<std::uint64_t>(loaded->bytes, kBlockStart - kHashSize);
  std::fill_n(hash_at, kHashSize, std::uint8_t{0});
  if (hash != core::xxh64(loaded->bytes)) {
    return refuse(ErrorCode::kInvalidValue, "", "the block is damaged: its checksum is another", 0);
  }
  const View all = loaded->bytes;
  const bool is_this = number_at<std::uint32_t>(all, 0) == kBlockMark &&
                       number_at<std::uint32_t>(all, 4) == block.size &&
                       number_at<std::uint32_t>(all, 8) == block.frames &&
                       number_at<std::uint64_t>(all, 12) == starts_[index];
  if (!is_this) return refuse(ErrorCode::kInvalidValue, "", "this is another block", 0);
  Cursor in(all.subspan(kBlockStart));
  get_events(in);
  if (head_.has_times && !in.failed() && !get_times(in, block.frames, loaded->times)) {
    return refuse(ErrorCode::kInvalidValue, ".times", "times that ascend were expected",
                  kBlockStart + in.position());
  }
  if (in.failed() || (block.frames == 0 && in.left() > 0)) {
    return refuse(ErrorCode::kInvalidValue, ".events", "the block ends within its events",
                  kBlockStart);
  }
  if (block.frames > 0) {
    const std::size_t at = kBlockStart + in.position();
    auto curves = EncodedCurves::open(all.subspan(at), head_.names.size(), block.frames);
    if (!curves) {
      const core::Error& error = curves.error();
      return refuse(error.code, "." + error.where, error.message, at + error.offset.value_or(0));
    }
    loaded->curves = std::move(curves).value();
  }
  loaded_ = std::move(loaded);
  return core::ok();
}

core::Status Reader::read_block(std::size_t index, std::uint64_t begin, std::uint64_t end,
                                std::span<const std::uint32_t> controls, float* out,
                                std::size_t stride, double* out_times) {
  RISORIUS_TRY(load(index));
  const std::uint64_t first = starts_[index];
  const auto skip = static_cast<std::size_t>(begin - first);
  const auto count = static_cast<std::size_t>(end - begin);
  const std::size_t frames = blocks_[index].frames;
  const auto decode = [&](std::span<const std::uint32_t> some, float* to, std::size_t apart) {
    auto decoded = loaded_->curves->decode(some, to, apart);
    if (decoded) return decoded;
    const core::Error& error = decoded.error();
    return core::Status(fail(error.code, "blocks[" + std::to_string(index) + "]." + error.where,
                             error.message, blocks_[index].offset));
  };
  if (count == frames) {
    RISORIUS_TRY(decode(controls, out, stride));
  } else {
    // Only some frames of the block are wanted. kAtOnce controls at a time are decoded with all
    // frames of the block, and only the wanted frames are copied.
    constexpr std::size_t kAtOnce = 16;
    std::vector<float> curves(kAtOnce * frames);
    for (std::size_t i = 0; i < controls.size(); i += kAtOnce) {
      const auto some = controls.subspan(i, std::min(kAtOnce, controls.size() - i));
      RISORIUS_TRY(decode(some, curves.data(), frames));
      for (std::size_t k = 0; k < some.size(); ++k) {
        std::memcpy(out + (i + k) * stride, curves.data() + k * frames + skip,
                    sizeof(float) * count);
      }
    }
  }
  if (out_times != nullptr) {
    std::copy_n(loaded_->times.begin() + static_cast<std::ptrdiff_t>(skip), count, out_times);
  }
  return core::ok();
}

core::Status Reader::may_read(std::uint64_t begin, std::uint64_t end,
                              std::span<const std::uint32_t> controls) const {
  if (begin > end || end > frames_) {
    return fail(ErrorCode::kInvalidArgument, "frames",
                "frames from 0 to " + std::to_string(frames_) + " were expected, found " +
                    std::to_string(begin) + " to " + std::to_string(end));
  }
  for (const std::uint32_t control : controls) {
    if (control >= head_.names.size()) {
      return fail(
          ErrorCode::kInvalidArgument, "controls",
          "control " + std::to_string(control) + " of " + std::to_string(head_.names.size()));
    }
  }
  const std::uint64_t count = end - begin;
  // A time takes as much memory as two values.
  const std::uint64_t values = controls.size() + (head_.has_times ? 2 : 0);
  if (count > limits_.values / std::max<std::uint64_t>(values, 1)) {
    return fail(ErrorCode::kLimitExceeded, "frames",
                std::to_string(count) + " frames of " + std::to_string(controls.size()) +
                    " controls, the limit is " + std::to_string(limits_.values) + " values");
  }
  return core::ok();
}

core::Status Reader::read(std::uint64_t begin, std::uint64_t end,
                          std::span<const std::uint32_t> controls, float* out, double* out_times) {
  RISORIUS_TRY(may_read(begin, end, controls));
  const std::uint64_t count = end - begin;
  if (!head_.has_times) out_times = nullptr;
  auto next = std::upper_bound(starts_.begin(), starts_.end(), begin) - starts_.begin();
  for (std::uint64_t at = begin; at < end; ++next) {
    const auto block = static_cast<std::size_t>(next - 1);
    const std::uint64_t until = std::min(end, starts_[block + 1]);
    if (until == at) continue;  // a block with events only
    const auto done = static_cast<std::size_t>(at - begin);
    auto read = read_block(block, at, until, controls, out == nullptr ? nullptr : out + done,
                           static_cast<std::size_t>(count),
                           out_times == nullptr ? nullptr : out_times + done);
    if (!read) return read;
    if (out_times != nullptr && done > 0 && out_times[done] <= out_times[done - 1]) {
      return fail(ErrorCode::kInvalidValue, "blocks[" + std::to_string(block) + "].times",
                  "times after the last time of the previous block were expected",
                  blocks_[block].offset);
    }
    at = until;
  }
  return core::ok();
}

core::Status Reader::resting(std::size_t block, std::span<float> values,
                             std::vector<std::uint32_t>& moving) {
  RISORIUS_TRY(load(block));
  for (std::uint32_t control = 0; control < values.size(); ++control) {
    if (!loaded_->curves || !loaded_->curves->is_resting(control, values[control])) {
      moving.push_back(control);
    }
  }
  return core::ok();
}

core::Result<Clip> decode(View bytes, Ends ends, const Limits& limits) {
  auto opened = Reader::open(std::make_unique<bytes::SpanSource>(bytes), ends, limits);
  if (!opened) return std::move(opened).propagate();
  Reader& reader = *opened;
  Clip clip;
  clip.head = reader.head();
  clip.events = reader.events();
  std::vector<std::uint32_t> all(clip.head.names.size());
  std::iota(all.begin(), all.end(), 0u);
  RISORIUS_TRY(reader.may_read(0, reader.frame_count(), all));
  clip.frame_count = static_cast<std::size_t>(reader.frame_count());
  clip.curves.resize(all.size() * clip.frame_count);
  if (clip.head.has_times) clip.times.resize(clip.frame_count);
  auto read = reader.read(0, reader.frame_count(), all, clip.curves.data(), clip.times.data());
  if (!read) return std::move(read).propagate();
  return clip;
}

}  // namespace risorius::clip
