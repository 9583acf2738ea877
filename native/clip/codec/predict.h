// SPDX-License-Identifier: MIT
// Predicts the next value of a curve, with the same bits on every machine.
#pragma once

#include <bit>
#include <cfenv>
#include <cmath>
#include <cstdint>

namespace risorius::clip {

/// Number of predictors, of orders 0 to 4. Order n continues the polynomial through the last n + 1
/// values.
inline constexpr int kOrders = 5;

/// Maps the bits of a float to an integer so that ascending floats give ascending integers if these
/// are read as int32. The function is its own inverse.
inline std::uint32_t in_order(std::uint32_t bits) {
  return bits ^ static_cast<std::uint32_t>(static_cast<std::int32_t>(bits) >> 31) >> 1;
}

/// All 32 bits 1 if the difference, read as int32, is negative; otherwise 0.
inline std::uint32_t sign_of(std::uint32_t difference) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(difference) >> 31);
}

/// The last kOrder + 1 values of a curve, newest first, and the prediction of the next one.
template <int kOrder>
class History {
 public:
  explicit History(std::uint32_t bits) { rest(bits, kOrder + 1); }

  void add(std::uint32_t bits) {
    for (int i = kOrder; i > 0; --i) values_[i] = values_[i - 1];
    last_ = bits;
    if constexpr (kOrder > 0) values_[0] = std::bit_cast<float>(bits);
  }
  /// Has the same effect as n calls of add(bits).
  void rest(std::uint32_t bits, std::size_t n) {
    for (std::size_t i = 0; i < n && i <= kOrder; ++i) add(bits);
  }
  std::uint32_t last() const { return last_; }

  /// The predicted next value, as in_order maps it.
  std::uint32_t next() const {
    if constexpr (kOrder == 0) return in_order(last_);
    double p = 0.0;
    if constexpr (kOrder == 1) p = 2 * v(0) - v(1);
    if constexpr (kOrder == 2) p = 3 * (v(0) - v(1)) + v(2);
    if constexpr (kOrder == 3) p = 4 * (v(0) + v(2)) - 6 * v(1) - v(3);
    if constexpr (kOrder == 4) p = 5 * (v(0) - v(3)) - 10 * (v(1) - v(2)) + v(4);
    // Outside of 2^-60 to 2^100 the prediction is 0, because processors could differ there: they
    // round denormals differently, and NaN has several bit patterns.
    const double size = std::fabs(p);
    if (!(size >= 0x1p-60 && size <= 0x1p100)) return 0;
    return in_order(std::bit_cast<std::uint32_t>(static_cast<float>(p)));
  }

 private:
  double v(int i) const { return values_[i]; }

  std::uint32_t last_ = 0;
  float values_[kOrder + 1] = {};
};

/// While an object of this class exists, the processor rounds to nearest and keeps denormals, as at
/// the start of a process, even if the program that uses this library has changed these settings.
class DefaultArithmetic {
 public:
  DefaultArithmetic() {
    std::fegetenv(&before_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~DefaultArithmetic() { std::fesetenv(&before_); }
  DefaultArithmetic(const DefaultArithmetic&) = delete;
  DefaultArithmetic& operator=(const DefaultArithmetic&) = delete;

 private:
  std::fenv_t before_;
};

/// Calls `what` with the order as a template argument.
/// In: order  of the predictor, 0 to 4
template <class What>
auto with_order(int order, const What& what) {
  switch (order) {
    case 1:
      return what.template operator()<1>();
    case 2:
      return what.template operator()<2>();
    case 3:
      return what.template operator()<3>();
    case 4:
      return what.template operator()<4>();
    default:
      return what.template operator()<0>();
  }
}

}  // namespace risorius::clip
