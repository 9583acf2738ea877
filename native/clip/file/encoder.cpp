// SPDX-License-Identifier: MIT
// Encodes a clip as the bytes of a .rzc file: head, blocks of frames, index.
#include "clip/file/encoder.h"

#include <cmath>
#include <unordered_set>

#include "clip/codec/block.h"
#include "clip/codec/predict.h"
#include "clip/file/layout.h"
#include "clip/file/reader.h"
#include "core/hash.h"

namespace risorius::clip {

namespace {

using core::ErrorCode;
using core::fail;

// Rejects names and metadata that are more or longer than a reader accepts.
core::Status check_sizes(const Head& head) {
  const Limits limits;
  if (head.names.size() > limits.controls || head.metadata.size() > limits.metadata) {
    return fail(ErrorCode::kInvalidArgument, "names",
                "at most " + std::to_string(limits.controls) + " controls and " +
                    std::to_string(limits.metadata) + " metadata were expected, found " +
                    std::to_string(head.names.size()) + " and " +
                    std::to_string(head.metadata.size()));
  }
  std::uint64_t bytes = 64;
  for (const std::string& name : head.names) bytes += name.size() + 16;
  for (const auto& [key, value] : head.metadata) bytes += key.size() + value.size() + 16;
  if (bytes > limits.head_bytes) {
    return fail(ErrorCode::kInvalidArgument, "metadata",
                "names and metadata of " + std::to_string(bytes) + " bytes, the limit is " +
                    std::to_string(limits.head_bytes));
  }
  return core::ok();
}

core::Status check(const Head& head) {
  RISORIUS_TRY(check_sizes(head));
  std::unordered_set<std::string> seen;
  for (std::size_t i = 0; i < head.names.size(); ++i) {
    if (!seen.insert(head.names[i]).second) {
      return fail(ErrorCode::kInvalidArgument, "names[" + std::to_string(i) + "]",
                  head.names[i] + ": a control may have one curve only, found two");
    }
  }
  if (!(std::isfinite(head.rate) && head.rate > 0.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "rate",
        "a rate above 0 frames per second was expected, found " + std::to_string(head.rate));
  }
  if (!std::isfinite(head.start)) {
    return fail(ErrorCode::kInvalidArgument, "start", "a start in seconds was expected");
  }
  return core::ok();
}

void put_head(Bytes& out, const Head& head) {
  Bytes body;
  put(body, head.rate);
  put(body, head.start);
  body.push_back(head.has_times ? 1 : 0);
  put_count(body, head.names.size());
  std::string before;
  for (const std::string& name : head.names) {
    put_next_text(body, before, name);
    before = name;
  }
  put_count(body, head.metadata.size());
  for (const auto& [key, value] : head.metadata) {
    put_text(body, key);
    put_text(body, value);
  }
  const std::size_t begin = out.size();
  out.insert(out.end(), kMagic.begin(), kMagic.end());
  put(out, kVersion);
  put(out, static_cast<std::uint32_t>(body.size()));
  out.insert(out.end(), body.begin(), body.end());
  put(out, core::xxh64(View(out).subspan(begin)));
}

void put_times(Bytes& out, std::span<const double> times) {
  std::uint64_t last = 0, step = 0;
  for (const double time : times) {
    const std::uint64_t here = time_in_order(std::bit_cast<std::uint64_t>(time));
    const std::uint64_t change = here - last - step;
    put_count(out,
              change << 1 ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(change) >> 63));
    step = here - last;
    last = here;
  }
}

core::Status check_times(std::span<const double> times, std::uint64_t first, double before) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i]) || (first + i > 0 && times[i] <= before)) {
      return fail(ErrorCode::kInvalidArgument, "times[" + std::to_string(first + i) + "]",
                  "a time after " + std::to_string(before) + " s was expected, found " +
                      std::to_string(times[i]) + " s");
    }
    before = times[i];
  }
  return core::ok();
}

}  // namespace

core::Result<Encoder> Encoder::create(Head head, std::size_t block_frames) {
  RISORIUS_TRY(check(head));
  if (block_frames < 1 || block_frames > kMostBlockFrames) {
    return fail(ErrorCode::kInvalidArgument, "block_frames",
                "1 to " + std::to_string(kMostBlockFrames) +
                    " frames a block were expected, found " + std::to_string(block_frames));
  }
  Encoder encoder;
  encoder.head_ = std::move(head);
  encoder.block_frames_ = block_frames;
  put_head(encoder.out_, encoder.head_);
  return encoder;
}

core::Status Encoder::append(std::span<const float> frames, std::span<const double> times) {
  const std::size_t controls = head_.names.size();
  const std::size_t count = head_.has_times ? times.size()
                            : controls      ? frames.size() / controls
                                            : 0;
  if (frames.size() != count * controls || (!head_.has_times && !times.empty())) {
    return fail(ErrorCode::kInvalidArgument, "frames",
                head_.has_times ? "as many times as frames were expected"
                                : "frames of " + std::to_string(controls) +
                                      " controls and no times were expected");
  }
  RISORIUS_TRY(check_times(times, frame_count(), last_time_));
  if (!times.empty()) last_time_ = times.back();
  curves_.resize(controls * block_frames_);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t control = 0; control < controls; ++control) {
      curves_[control * block_frames_ + filled_] = frames[i * controls + control];
    }
    if (head_.has_times) times_.push_back(times[i]);
    if (++filled_ < block_frames_) continue;
    filled_ = 0;
    put_block(curves_.data(), block_frames_, times_, block_frames_);
    times_.clear();
  }
  return core::ok();
}

void Encoder::put_block(const float* curves, std::size_t stride, std::span<const double> times,
                        std::size_t frames) {
  const std::size_t begin = out_.size();
  put(out_, kBlockMark);
  put(out_, std::uint32_t{0});
  put(out_, static_cast<std::uint32_t>(frames));
  put(out_, frames_);
  put(out_, std::uint64_t{0});
  put_events(out_, pending_);
  put_times(out_, times);
  if (frames > 0) encode_curves({curves, stride, head_.names.size(), frames}, out_);
  const auto size = static_cast<std::uint32_t>(out_.size() - begin - kBlockStart);
  std::memcpy(out_.data() + begin + 4, &size, sizeof size);
  // The hash is computed while its own bytes are 0.
  const std::uint64_t hash = core::xxh64(View(out_).subspan(begin));
  std::memcpy(out_.data() + begin + kBlockStart - kHashSize, &hash, sizeof hash);
  blocks_.push_back({written_ + begin, size, static_cast<std::uint32_t>(frames)});
  frames_ += frames;
  events_.insert(events_.end(), pending_.begin(), pending_.end());
  pending_.clear();
}

void Encoder::finish() {
  if (filled_ > 0 || !pending_.empty()) {
    const std::size_t frames = std::exchange(filled_, 0);
    put_block(curves_.data(), block_frames_, times_, frames);
  }
  const std::size_t begin = out_.size();
  put(out_, kIndexMark);
  put_count(out_, blocks_.size());
  for (const Block& block : blocks_) {
    put_count(out_, block.size);
    put_count(out_, block.frames);
  }
  put_events(out_, events_);
  put(out_, written_ + begin);
  put(out_, static_cast<std::uint32_t>(out_.size() - 8 - begin));
  put(out_, kEndMark);
  put(out_, core::xxh64(View(out_).subspan(begin)));
}

Bytes Encoder::take() {
  written_ += out_.size();
  return std::exchange(out_, {});
}

core::Result<Bytes> encode(const Clip& clip, std::size_t block_frames) {
  auto made = Encoder::create(clip.head, block_frames);
  if (!made) return std::move(made).propagate();
  Encoder& encoder = *made;
  const std::size_t frames = clip.frame_count;
  if (clip.curves.size() != frames * clip.head.names.size() ||
      clip.times.size() != (clip.head.has_times ? frames : 0)) {
    return fail(ErrorCode::kInvalidArgument, "curves",
                "curves and times of " + std::to_string(frames) + " frames were expected");
  }
  RISORIUS_TRY(check_times(clip.times, 0, 0.0));
  encoder.pending_ = clip.events;
  for (std::size_t first = 0; first < frames; first += block_frames) {
    const std::size_t count = std::min(block_frames, frames - first);
    const std::span<const double> times(clip.times);
    encoder.put_block(clip.curves.empty() ? nullptr : clip.curves.data() + first, frames,
                      clip.head.has_times ? times.subspan(first, count) : times, count);
  }
  encoder.finish();
  return encoder.take();
}

}  // namespace risorius::clip
