// SPDX-License-Identifier: MIT
// Encodes curves as a block: chooses the kind of each curve and its predictor, and the prefix
// codes of the symbols.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "clip/codec/block.h"
#include "clip/codec/predict.h"
#include "clip/codec/symbols.h"
#include "core/hash.h"

namespace risorius::clip {

namespace {

std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }

template <int kOrder>
std::vector<Token> tokens_of(std::span<const float> curve) {
  std::vector<Token> tokens;
  History<kOrder> history(bits_of(curve[0]));
  std::uint32_t sign = 0;
  for (std::size_t i = 1; i < curve.size();) {
    std::size_t rest = 0;
    while (i + rest < curve.size() && bits_of(curve[i + rest]) == history.last()) ++rest;
    if (rest > 0) {
      tokens.push_back(rest_token(static_cast<std::uint32_t>(rest)));
      history.rest(history.last(), rest);
      i += rest;
      continue;
    }
    const std::uint32_t bits = bits_of(curve[i++]);
    tokens.push_back(value_token(in_order(bits) - history.next(), sign));
    history.add(bits);
  }
  return tokens;
}

// Estimates the number of bits of encoded tokens: the entropy of their symbols, and their extra
// bits.
double cost_of(const std::vector<Token>& tokens) {
  std::array<std::uint32_t, kMostSymbols> counts{};
  double bits = 0.0;
  for (const Token token : tokens) {
    ++counts[token.symbol];
    bits += extra_bits(token.symbol);
  }
  for (const std::uint32_t count : counts) {
    if (count > 0) bits += count * std::log2(double(tokens.size()) / count);
  }
  return bits;
}

struct Coded {
  int order = 0;
  std::uint32_t first = 0;
  std::vector<Token> tokens;
};

Coded best_tokens(std::span<const float> curve) {
  Coded best{0, bits_of(curve[0]), tokens_of<0>(curve)};
  double least = cost_of(best.tokens);
  for (int order = 1; order < kOrders; ++order) {
    auto tokens = with_order(order, [&]<int kOrder> { return tokens_of<kOrder>(curve); });
    const double cost = cost_of(tokens);
    if (cost >= least) continue;
    least = cost;
    best.order = order;
    best.tokens = std::move(tokens);
  }
  return best;
}

// The prefix codes of a block, and the symbols that choose between them.
struct Codes {
  // Code i + 1 is used after a value symbol of at most bounds[i] that is above bounds[i - 1]; the
  // last code after larger symbols; code 0 after a repetition.
  std::vector<std::uint8_t> bounds;
  std::vector<Code> codes;

  std::size_t after(std::uint32_t symbol) const {
    if (symbol >= kRest) return 0;
    return 1 + static_cast<std::size_t>(std::lower_bound(bounds.begin(), bounds.end(), symbol) -
                                        bounds.begin());
  }
};

Codes make_codes(const std::vector<Coded>& all) {
  Codes out;
  std::array<std::uint32_t, kRest> values{};
  std::uint32_t total = 0;
  for (const Coded& one : all) {
    for (const Token token : one.tokens) {
      if (token.symbol < kRest) ++values[token.symbol], ++total;
    }
  }
  // The bounds divide the value symbols into about equally frequent groups, one for each code: the
  // group of a symbol chooses the code of the next symbol.
  const std::size_t wanted = std::clamp<std::size_t>(total / 250, 1, kMostCodes - 1);
  std::uint64_t seen = 0;
  for (std::uint32_t symbol = 0; symbol < kRest - 1; ++symbol) {
    seen += values[symbol];
    const std::size_t due = seen * wanted / std::max<std::uint32_t>(total, 1);
    if (due > out.bounds.size() && out.bounds.size() + 1 < wanted) {
      out.bounds.push_back(static_cast<std::uint8_t>(symbol));
    }
  }
  std::vector<std::array<std::uint32_t, kMostSymbols>> counts(out.bounds.size() + 2);
  for (const Coded& one : all) {
    std::size_t code = 0;
    for (const Token token : one.tokens) {
      ++counts[code][token.symbol];
      code = out.after(token.symbol);
    }
  }
  for (const auto& count : counts) out.codes.push_back(make_code(count));
  return out;
}

class BitWriter {
 public:
  explicit BitWriter(Bytes& out) : out_(out) {}
  void put(std::uint64_t value, std::uint32_t count) {
    word_ |= (value & ((std::uint64_t{1} << count) - 1)) << used_;
    for (used_ += count; used_ >= 8; used_ -= 8, word_ >>= 8) {
      out_.push_back(static_cast<std::uint8_t>(word_));
    }
  }
  void finish() {
    if (used_ > 0) out_.push_back(static_cast<std::uint8_t>(word_));
  }

 private:
  Bytes& out_;
  std::uint64_t word_ = 0;
  std::uint32_t used_ = 0;
};

Bytes chunk_of(const Coded& coded, const Codes& codes) {
  Bytes out{static_cast<std::uint8_t>(coded.order)};
  put(out, coded.first);
  BitWriter bits(out);
  std::size_t code = 0;
  for (const Token token : coded.tokens) {
    bits.put(codes.codes[code].bits[token.symbol], codes.codes[code].lengths[token.symbol]);
    bits.put(token.extra, extra_bits(token.symbol));
    code = codes.after(token.symbol);
  }
  bits.finish();
  return out;
}

// How a block describes a control's curve.
struct Choice {
  PartKind kind;
  std::size_t index = 0;  // of the control that it repeats, or in the list of coded curves
};

std::vector<Choice> choose(const BlockCurves& curves, std::vector<Coded>& coded) {
  std::vector<Choice> choices;
  std::unordered_map<std::uint64_t, std::size_t> known;
  for (std::size_t control = 0; control < curves.controls; ++control) {
    const std::span<const float> curve = curves.curve(control);
    const View bytes{reinterpret_cast<const std::uint8_t*>(curve.data()), curve.size_bytes()};
    const bool is_constant = std::memcmp(bytes.data(), bytes.data() + 4, bytes.size() - 4) == 0;
    if (is_constant) {
      choices.push_back({bits_of(curve[0]) == 0 ? PartKind::kZero : PartKind::kConstant});
      continue;
    }
    const auto [place, is_new] = known.try_emplace(core::xxh64(bytes), control);
    if (!is_new &&
        std::memcmp(bytes.data(), curves.curve(place->second).data(), bytes.size()) == 0) {
      choices.push_back({PartKind::kRepeated, place->second});
      continue;
    }
    choices.push_back({PartKind::kCoded, coded.size()});
    coded.push_back(best_tokens(curve));
  }
  return choices;
}

Bytes stored_chunk(std::span<const float> curve) {
  Bytes out{kStoredChunk};
  const auto* first = reinterpret_cast<const std::uint8_t*>(curve.data());
  out.insert(out.end(), first, first + curve.size_bytes());
  return out;
}

void put_part(Bytes& out, PartKind kind, std::uint64_t number) {
  put_count(out, number << 2 | static_cast<std::uint64_t>(kind));
}

// Writes how the block describes each control. Neighbouring controls with the same constant value
// share an entry.
void put_parts(Bytes& out, const BlockCurves& curves, const std::vector<Choice>& choices,
               const std::vector<Bytes>& chunks) {
  for (std::size_t i = 0; i < choices.size();) {
    const Choice& choice = choices[i];
    if (choice.kind == PartKind::kCoded) {
      put_part(out, choice.kind, chunks[choice.index].size());
    } else if (choice.kind == PartKind::kRepeated) {
      put_part(out, choice.kind, choice.index);
    }
    if (choice.kind == PartKind::kCoded || choice.kind == PartKind::kRepeated) {
      ++i;
      continue;
    }
    const std::uint32_t bits = bits_of(curves.curve(i)[0]);
    std::size_t count = 1;
    while (i + count < choices.size() && choices[i + count].kind == choice.kind &&
           bits_of(curves.curve(i + count)[0]) == bits) {
      ++count;
    }
    put_part(out, choice.kind, count);
    if (choice.kind == PartKind::kConstant) put(out, bits);
    i += count;
  }
}

void put_codes(Bytes& out, const Codes& codes) {
  out.push_back(static_cast<std::uint8_t>(codes.codes.size()));
  out.insert(out.end(), codes.bounds.begin(), codes.bounds.end());
  put_lengths(out, codes.codes);
}

void put_stored(Bytes& out, const BlockCurves& curves) {
  out.push_back(kStoredBlock);
  for (std::size_t control = 0; control < curves.controls; ++control) {
    const std::span<const float> curve = curves.curve(control);
    const auto* first = reinterpret_cast<const std::uint8_t*>(curve.data());
    out.insert(out.end(), first, first + curve.size_bytes());
  }
}

}  // namespace

void encode_curves(const BlockCurves& curves, Bytes& out) {
  const DefaultArithmetic arithmetic;
  std::vector<Coded> coded;
  const std::vector<Choice> choices = choose(curves, coded);
  const Codes codes = make_codes(coded);
  std::vector<Bytes> chunks(coded.size());
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i].kind != PartKind::kCoded) continue;
    Bytes& chunk = chunks[choices[i].index];
    chunk = chunk_of(coded[choices[i].index], codes);
    if (chunk.size() > 4 * curves.frames) chunk = stored_chunk(curves.curve(i));
  }
  const std::size_t begin = out.size();
  out.push_back(kCodedBlock);
  if (coded.empty()) {
    out.push_back(0);
  } else {
    put_codes(out, codes);
  }
  put_parts(out, curves, choices, chunks);
  for (const Bytes& chunk : chunks) out.insert(out.end(), chunk.begin(), chunk.end());
  if (out.size() - begin <= 4 * curves.controls * curves.frames) return;
  out.resize(begin);
  put_stored(out, curves);
}

}  // namespace risorius::clip
