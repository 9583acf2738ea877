// SPDX-License-Identifier: MIT
// Compares the kernels of every instruction set with plain computations, for example sums in
// double, at sizes around the ends of vector loops.
#include "simd/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "simd/four.h"
#include "simd/half.h"

namespace risorius::simd {

const Kernels& scalar_kernels_unoptimised();

namespace {

// A matrix stored as columns without padding. After the last column there are kWidest further
// values, because kernels read whole vectors.
template <class T>
struct Matrix {
  std::size_t rows, columns;
  std::vector<T> values;
};

Matrix<float> random_matrix(std::size_t rows, std::size_t columns, std::mt19937& random) {
  std::uniform_real_distribution<float> any(-4.0f, 4.0f);
  Matrix<float> m{rows, columns, std::vector<float>(rows * columns + kWidest)};
  for (float& v : m.values) v = any(random);
  return m;
}

Matrix<std::uint16_t> halves(const Matrix<float>& from) {
  Matrix<std::uint16_t> m{from.rows, from.columns, {}};
  for (const float v : from.values) m.values.push_back(to_half(v));
  return m;
}

std::vector<float> random_weights(std::size_t n, std::mt19937& random) {
  std::uniform_real_distribution<float> any(-1.5f, 1.5f);
  std::vector<float> weights(n + 1);
  for (float& v : weights) v = any(random);
  return weights;
}

std::vector<std::uint32_t> every_second(std::size_t n, std::size_t rows) {
  std::vector<std::uint32_t> offsets(n + 1);
  for (std::size_t i = 0; i < n; ++i) offsets[i] = static_cast<std::uint32_t>(2 * i * rows);
  return offsets;
}

// A Column for each of the first n offsets; column i has weight index i.
std::vector<Column> columns_of(const std::vector<std::uint32_t>& offsets, std::size_t n) {
  std::vector<Column> columns;
  for (std::size_t i = 0; i < n; ++i)
    columns.push_back({offsets[i], static_cast<std::uint32_t>(i)});
  return columns;
}

std::vector<std::string> all_kernels() {
  std::vector<std::string> all;
  for (const Kernels* k :
       {&scalar_kernels(), sse4_kernels(), avx2_kernels(), avx512_kernels(), neon_kernels()}) {
    if (k != nullptr) all.push_back(k->name);
  }
  return all;
}

double value(float v) { return v; }
double value(std::uint16_t v) { return from_half(v); }

// Expects that out[r] is, for each row r, the sum of the n products of weights[i * step] and
// m.values[offsets[i] + r], up to the error of rounding. In any order, fused or not, this error is
// at most n * eps * sum|w v| to first order; one more eps covers the second order for these n.
template <class T>
void expect_sums(const Matrix<T>& m, const std::vector<std::uint32_t>& offsets,
                 const float* weights, std::size_t step, std::size_t n, const float* out) {
  const double eps = std::numeric_limits<float>::epsilon();
  for (std::size_t r = 0; r < m.rows; ++r) {
    double sum = 0, size = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double term = double{weights[i * step]} * value(m.values[offsets[i] + r]);
      sum += term;
      size += std::fabs(term);
    }
    const double bound = static_cast<double>(n + 1) * eps * size;
    ASSERT_LE(std::fabs(double{out[r]} - sum), bound) << "row " << r << " of " << m.rows;
  }
}

constexpr std::size_t kRows[] = {1, 3, 4, 5, 7, 8, 9, 15, 16, 17, 47, 48, 49, 95, 96, 97, 200};
constexpr std::size_t kColumns[] = {0, 1, 2, 7, 8, 9, 100};

class SimdKernels : public testing::TestWithParam<std::string> {
 protected:
  const Kernels& kernels_ = *find_kernels(GetParam().c_str());
};

TEST_P(SimdKernels, SumWithinTheRoundingOfItsTerms) {
  std::mt19937 random(1);
  for (const std::size_t rows : kRows) {
    for (const std::size_t n : kColumns) {
      const Matrix<float> m = random_matrix(rows, 2 * n, random);
      const Matrix<std::uint16_t> half = halves(m);
      const std::vector<float> weights = random_weights(n, random);
      const std::vector<std::uint32_t> offsets = every_second(n, rows);
      std::vector<float> out(rounded_up(rows), 1e30f);
      kernels_.columns(m.values.data(), columns_of(offsets, n).data(), n, weights.data(),
                       out.data(), rows);
      expect_sums(m, offsets, weights.data(), 1, n, out.data());
      kernels_.half_columns(half.values.data(), columns_of(offsets, n).data(), n, weights.data(),
                            out.data(), rows);
      expect_sums(half, offsets, weights.data(), 1, n, out.data());
    }
  }
}

// Adding column by column must give the same bits as the sum of a group, because each row has the
// same terms in the same order.
TEST_P(SimdKernels, AddColumnsToTheBitsOfTheirSums) {
  constexpr std::size_t kCount = 9;
  constexpr float kOthers = 7.0f;
  std::mt19937 random(12);
  for (const std::size_t rows : kRows) {
    const Matrix<float> m = random_matrix(rows, 2 * kCount, random);
    const Matrix<std::uint16_t> half = halves(m);
    const std::vector<float> weights = random_weights(kCount, random);
    const std::vector<Column> columns = columns_of(every_second(kCount, rows), kCount);
    // The columns are added to the run of the group with index 1. Values before and after this run
    // must not change.
    const std::size_t first = rounded_up(rows), end = first + rows;
    const Rows runs[] = {{0, 1},
                         {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(rows)}};
    for (const bool is_half : {false, true}) {
      std::vector<float> sums(end + kWidest, kOthers), expected(rounded_up(rows));
      std::fill(sums.begin() + std::ptrdiff_t(first), sums.begin() + std::ptrdiff_t(end), 0.0f);
      std::uint8_t added[2] = {};
      const Sums to{runs, 2, sums.data(), added};
      for (const Column& c : columns) {
        const Addend addend{c.offset, 1};
        const float weight = weights[c.weight];
        is_half ? kernels_.add_half_columns(half.values.data(), &addend, 1, weight, to)
                : kernels_.add_columns(m.values.data(), &addend, 1, weight, to);
      }
      is_half ? kernels_.half_columns(half.values.data(), columns.data(), kCount, weights.data(),
                                      expected.data(), rows)
              : kernels_.columns(m.values.data(), columns.data(), kCount, weights.data(),
                                 expected.data(), rows);
      for (std::size_t i = 0; i < sums.size(); ++i) {
        const bool inside = first <= i && i < end;
        ASSERT_EQ(std::bit_cast<std::uint32_t>(sums[i]),
                  std::bit_cast<std::uint32_t>(inside ? expected[i - first] : kOthers))
            << rows << " rows, " << i;
      }
    }
  }
}

// At a coarse LOD the last groups have no rows. Their columns must not be added: the runs of these
// groups may contain any numbers.
TEST_P(SimdKernels, AddNoColumnOfAGroupWithoutRows) {
  constexpr std::uint32_t kRowCount = 16;
  std::mt19937 random(13);
  const Matrix<float> m = random_matrix(kRowCount, 4, random);
  const Matrix<std::uint16_t> half = halves(m);
  const Addend columns[] = {{0, 0}, {kRowCount, 2}, {2 * kRowCount, 3}};
  constexpr Rows kNowhere{0x7FFFFFFFu, kRowCount};
  const Rows runs[] = {
      {0, kRowCount}, {kRowCount, kRowCount}, {2 * kRowCount, kRowCount}, kNowhere};
  for (const bool is_half : {false, true}) {
    std::vector<float> sums(4 * kRowCount, 0.0f);
    std::uint8_t added[4] = {};
    const Sums to{runs, 3, sums.data(), added};
    is_half ? kernels_.add_half_columns(half.values.data(), columns, 3, 2.0f, to)
            : kernels_.add_columns(m.values.data(), columns, 3, 2.0f, to);
    EXPECT_EQ(std::vector(added, added + 4), (std::vector<std::uint8_t>{1, 0, 1, 0}));
    for (std::uint32_t r = 0; r < kRowCount; ++r) {
      const auto value = [&](std::uint32_t i) {
        return is_half ? from_half(half.values[i]) : m.values[i];
      };
      EXPECT_EQ(sums[r], 2.0f * value(r));
      EXPECT_EQ(sums[kRowCount + r], 0.0f);
      EXPECT_EQ(sums[2 * kRowCount + r], 2.0f * value(kRowCount + r));
      EXPECT_EQ(sums[3 * kRowCount + r], 0.0f);
    }
  }
}

constexpr std::size_t kLengths[] = {0, 1, 2, 3, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65, 200};

template <class T>
T shifted_together(const std::uint8_t* bytes) {
  T value = 0;
  for (std::size_t b = 0; b < sizeof(T); ++b) value = static_cast<T>(value * 256 + bytes[b]);
  return value;
}

TEST_P(SimdKernels, BringNumbersOfAFileIntoTheOrderOfTheMachine) {
  std::mt19937 random(7);
  std::vector<std::uint8_t> bytes(4 * 200 + 1);
  for (std::uint8_t& b : bytes) b = static_cast<std::uint8_t>(random());
  for (const std::size_t n : kLengths) {
    const std::uint8_t* from = bytes.data() + 1;  // of no alignment
    std::vector<std::uint16_t> halves(n);
    std::vector<std::uint32_t> wholes(n);
    std::vector<float> floats(n);
    kernels_.native_u16(from, halves.data(), n);
    const std::uint32_t largest = kernels_.native_u32(from, wholes.data(), n);
    kernels_.native_f32(from, floats.data(), n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto whole = shifted_together<std::uint32_t>(from + 4 * i);
      ASSERT_EQ(halves[i], shifted_together<std::uint16_t>(from + 2 * i)) << i << " of " << n;
      ASSERT_EQ(wholes[i], whole) << i << " of " << n;
      ASSERT_EQ(std::bit_cast<std::uint32_t>(floats[i]), whole) << i << " of " << n;
    }
    EXPECT_EQ(largest, n == 0 ? 0 : *std::max_element(wholes.begin(), wholes.end()));
  }
}

TEST_P(SimdKernels, FindTheOneNumberThatIsNotFinite) {
  const float most = std::numeric_limits<float>::max(), none = std::nanf("");
  const float infinite = std::numeric_limits<float>::infinity();
  for (const std::size_t n : kLengths) {
    std::vector<std::uint8_t> bytes(4 * n);
    std::vector<float> out(n);
    const auto put = [&](std::size_t at, float value) {
      const auto bits = std::bit_cast<std::uint32_t>(value);
      for (std::size_t b = 0; b < 4; ++b) {
        bytes[4 * at + b] = static_cast<std::uint8_t>(bits >> (24 - 8 * b));
      }
    };
    for (std::size_t i = 0; i < n; ++i) put(i, i % 2 == 0 ? most : -most);
    EXPECT_TRUE(kernels_.native_f32(bytes.data(), out.data(), n)) << n;
    for (std::size_t i = 0; i < n; ++i) {
      for (const float value : {none, infinite, -infinite}) {
        put(i, value);
        EXPECT_FALSE(kernels_.native_f32(bytes.data(), out.data(), n)) << i << " of " << n;
      }
      put(i, 0.0f);
    }
  }
}

TEST_P(SimdKernels, AFrameOfABatchHasTheBitsOfTheFrameAlone) {
  std::mt19937 random(5);
  for (const std::size_t rows : kRows) {
    const std::size_t n = 13, stride = rounded_up(rows);
    const Matrix<float> m = random_matrix(rows, 2 * n, random);
    const Matrix<std::uint16_t> half = halves(m);
    const std::vector<float> weights = random_weights(n * kFrames, random);
    const std::vector<std::uint32_t> offsets = every_second(n, rows);
    const std::vector<Column> columns = columns_of(offsets, n);
    std::vector<float> batch(stride * kFrames), alone(stride), own(n);
    for (const bool is_half : {false, true}) {
      if (is_half) {
        kernels_.batch_half_columns(half.values.data(), columns.data(), n, weights.data(),
                                    batch.data(), stride, rows);
      } else {
        kernels_.batch_columns(m.values.data(), columns.data(), n, weights.data(), batch.data(),
                               stride, rows);
      }
      for (std::size_t f = 0; f < kFrames; ++f) {
        for (std::size_t i = 0; i < n; ++i) own[i] = weights[i * kFrames + f];
        if (is_half) {
          kernels_.half_columns(half.values.data(), columns.data(), n, own.data(), alone.data(),
                                rows);
        } else {
          kernels_.columns(m.values.data(), columns.data(), n, own.data(), alone.data(), rows);
        }
        for (std::size_t r = 0; r < rows; ++r) {
          ASSERT_EQ(std::bit_cast<std::uint32_t>(batch[f * stride + r]),
                    std::bit_cast<std::uint32_t>(alone[r]))
              << "frame " << f << " row " << r;
        }
      }
    }
  }
}

TEST_P(SimdKernels, ReadOnlyTheActiveColumns) {
  std::mt19937 random(2);
  Matrix<float> m = random_matrix(64, 20, random);  // whole vectors: no surplus is read
  for (std::size_t c = 1; c < m.columns; c += 2) {
    for (std::size_t r = 0; r < m.rows; ++r) m.values[c * m.rows + r] = std::nanf("");
  }
  const std::vector<float> weights = random_weights(10, random);
  const std::vector<std::uint32_t> offsets = every_second(10, m.rows);
  std::vector<float> out(64);
  kernels_.columns(m.values.data(), columns_of(offsets, 10).data(), 10, weights.data(), out.data(),
                   64);
  for (const float v : out) ASSERT_FALSE(std::isnan(v));
}

TEST_P(SimdKernels, PlaceByTheBitsOfThePieces) {
  std::mt19937 random(8);
  std::vector<float> from(4000 + kPlaces);
  for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<float>(i + 1);
  std::vector<Piece> pieces{{0, 0, 0}, {7, 0xFFFF, 0}, {3, 1, 0}, {9, 0x8000, 0}};
  for (int i = 0; i < 300; ++i) {
    pieces.push_back(
        {static_cast<std::uint32_t>(random() % 3984), static_cast<std::uint16_t>(random()), 0});
  }
  std::vector<float> to(pieces.size() * kPlaces + 1, 7.0f);
  kernels_.place(pieces.data(), pieces.size(), {from.data(), 0, to.data(), 0, 1});
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    std::uint32_t next = pieces[i].from;
    for (std::size_t p = 0; p < kPlaces; ++p) {
      const bool taken = (pieces[i].mask >> p & 1) != 0;
      ASSERT_EQ(to[i * kPlaces + p], taken ? from[next++] : 0.0f) << i << " place " << p;
    }
  }
  EXPECT_EQ(to.back(), 7.0f);
}

TEST_P(SimdKernels, PlaceMoreWithoutChangingOtherPlaces) {
  std::mt19937 random(9);
  std::vector<float> from(400 + kPlaces);
  for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<float>(i + 1);
  for (int i = 0; i < 200; ++i) {
    const auto mask = static_cast<std::uint16_t>(random() % 0x10000);
    const Piece piece{static_cast<std::uint32_t>(random() % 400), mask, 2};
    std::vector<float> to(3 * kPlaces), expected;  // a write after the block is out of range
    for (std::size_t p = 0; p < to.size(); ++p) to[p] = -static_cast<float>(p + 1);
    expected = to;
    std::uint32_t next = piece.from;
    for (std::size_t p = 0; p < kPlaces; ++p) {
      if ((mask >> p & 1) != 0) expected[2 * kPlaces + p] = from[next++];
    }
    kernels_.place_more(&piece, 1, {from.data(), 0, to.data(), 0, 1});
    ASSERT_EQ(to, expected) << "mask " << mask;
  }
}

// Between the frames are gaps that must not be written.
TEST_P(SimdKernels, PlaceEachFrameAsIfItWereAlone) {
  constexpr std::size_t kCount = 5, kPieces = 40, kRowStride = 700, kStride = kPieces * kPlaces + 3;
  std::mt19937 random(10);
  std::vector<float> from(kCount * kRowStride), all(kCount * kStride, 7.0f), expected = all;
  for (float& v : from) v = static_cast<float>(random() % 1000);
  std::vector<Piece> pieces, more;
  for (std::uint16_t i = 0; i < kPieces; ++i) {
    const auto row = [&] { return static_cast<std::uint32_t>(random() % (kRowStride - kPlaces)); };
    pieces.push_back({row(), static_cast<std::uint16_t>(random()), i});
    const auto mask =
        static_cast<std::uint16_t>(i % 3 == 0 ? random() & 0xFFu : random() & 0xFF80u);
    more.push_back({row(), mask, i});
  }
  kernels_.place(pieces.data(), kPieces, {from.data(), kRowStride, all.data(), kStride, kCount});
  kernels_.place_more(more.data(), kPieces, {from.data(), kRowStride, all.data(), kStride, kCount});
  for (std::size_t f = 0; f < kCount; ++f) {
    const PlacedFrames one{from.data() + f * kRowStride, 0, expected.data() + f * kStride, 0, 1};
    kernels_.place(pieces.data(), kPieces, one);
    kernels_.place_more(more.data(), kPieces, one);
  }
  EXPECT_EQ(all, expected);
}

struct Turn {
  std::array<std::uint8_t, 3> order;
  float parity;
};

// The quaternion (x, y, z, w) of three rotations about x, y and z, computed in double. turn.order
// is the order in which they are applied.
// In: angles  float[3], radians about x, y and z
std::array<double, 4> product_of_turns(const Turn& turn, const float* angles) {
  std::array<double, 4> q{0, 0, 0, 1};
  for (const std::uint8_t axis : turn.order) {
    const double half = 0.5 * double{angles[axis]};
    std::array<double, 4> step{0, 0, 0, std::cos(half)};
    step[axis] = std::sin(half);
    const auto& [ax, ay, az, aw] = step;
    const auto [bx, by, bz, bw] = q;
    q = {aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
         aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz};
  }
  return q;
}

TEST_P(SimdKernels, TurnEulerAnglesIntoQuaternions) {
  const Turn turns[] = {{{0, 1, 2}, 1},  {{1, 2, 0}, 1},  {{2, 0, 1}, 1},
                        {{0, 2, 1}, -1}, {{2, 1, 0}, -1}, {{1, 0, 2}, -1}};
  std::mt19937 random(10);
  for (std::size_t t = 0; t < 2 * std::size(turns); ++t) {
    const Turn& turn = turns[t / 2];
    // Alternately angles up to 20 radians, and angles up to pi / 2, which need no reduction.
    const float most = t % 2 == 0 ? 20.0f : 1.55f;
    std::uniform_real_distribution<float> angle(-most, most);
    for (const std::size_t count : {0u, 1u, 15u, 16u, 17u, 40u}) {
      std::vector<float> rotations(10 * 41, 7.0f);
      std::vector<std::uint16_t> which;
      for (std::size_t i = 0; i < count; ++i) which.push_back(static_cast<std::uint16_t>(40 - i));
      for (const std::uint16_t i : which) {
        for (std::size_t a = 0; a < 3; ++a) rotations[i * 10 + a] = angle(random);
      }
      if (count > 2 && t % 2 == 0)
        rotations[which[1] * 10] = 30000.0f;  // beyond the fast reduction
      const std::vector<float> angles = rotations;
      EulerTurns e;
      std::ranges::copy(turn.order, e.order);
      e.parity = turn.parity;
      kernels_.quaternions(e, which.data(), count, rotations.data(), 10);
      for (const std::uint16_t i : which) {
        const std::array<double, 4> expected = product_of_turns(turn, angles.data() + i * 10);
        for (std::size_t k = 0; k < 4; ++k) {
          ASSERT_NEAR(double{rotations[i * 10u + k]}, expected[k], 4e-7) << i << " part " << k;
        }
      }
      for (std::size_t r = 0; r < rotations.size(); ++r) {
        const bool ours = r % 10 < 4 && r / 10 > 40 - count;
        if (!ours) {
          ASSERT_EQ(rotations[r], 7.0f) << r;
        }
      }
    }
  }
}

// Several rotations are computed in one call, with large and small angles. Each result must have
// the same bits as if the rotation were computed alone.
TEST_P(SimdKernels, TurnRotationsTogetherAsAlone) {
  constexpr std::size_t kCount = 700, kStride = 10;
  std::mt19937 random(12);
  for (const float most : {0.5f, 1.57f, 2.0f, 40.0f}) {
    std::uniform_real_distribution<float> angle(-most, most);
    for (const std::size_t one_in : {1u, 2u, 7u, 200u}) {
      std::vector<float> rotations(kStride * kCount);
      std::vector<std::uint16_t> which(kCount);
      for (std::size_t i = 0; i < kCount; ++i) {
        which[i] = static_cast<std::uint16_t>(i);
        if (i % one_in == 1 % one_in) rotations[i * kStride + i % 3] = angle(random);
        rotations[i * kStride + 3] = 7.0f;  // old content of the memory
      }
      rotations[5 * kStride] = -0.0f;  // is treated as a rotation by 0
      const std::vector<float> angles = rotations;
      std::vector<float> alone = rotations;
      kernels_.quaternions({}, which.data(), kCount, rotations.data(), kStride);
      for (std::size_t i = 0; i < kCount; ++i) {
        kernels_.quaternions({}, &which[i], 1, alone.data(), kStride);
        const float* own = alone.data() + i * kStride;
        const float half = 0.5f * angles[i * kStride + i % 3];
        EXPECT_NEAR(own[3], std::cos(half), 2e-7f) << i;
      }
      EXPECT_EQ(std::memcmp(rotations.data(), alone.data(), alone.size() * sizeof(float)), 0);
    }
  }
}

TEST_P(SimdKernels, ANaNTurnsOnlyItsOwnRotation) {
  std::vector<float> rotations(10 * 3, 0.25f);
  rotations[10] = std::nanf("");
  const std::uint16_t which[] = {0, 1, 2};
  kernels_.quaternions({}, which, 3, rotations.data(), 10);
  EXPECT_TRUE(std::isnan(rotations[10]));
  for (const std::size_t r : {0u, 1u, 2u, 3u, 20u, 21u, 22u, 23u}) {
    EXPECT_FALSE(std::isnan(rotations[r])) << r;
  }
}

TEST_P(SimdKernels, WriteNoFurtherThanTheWidestVector) {
  std::mt19937 random(3);
  for (const std::size_t rows : kRows) {
    const Matrix<float> m = random_matrix(rows, 6, random);
    const std::vector<float> weights = random_weights(3, random);
    const std::vector<std::uint32_t> offsets = every_second(3, rows);
    std::vector<float> out(rounded_up(rows) + 64, 7.0f);
    kernels_.columns(m.values.data(), columns_of(offsets, 3).data(), 3, weights.data(), out.data(),
                     rows);
    for (std::size_t r = rounded_up(rows); r < out.size(); ++r) ASSERT_EQ(out[r], 7.0f) << rows;
  }
}

// Skins ten vertices with eight influences each, in three groups of kSkinGroup vertices. The three
// floats after the vertices must not be written.
std::vector<float> skinned(const Kernels& kernels) {
  std::mt19937 random(8);
  const Matrix<float> matrices = random_matrix(12, 5, random),
                      points = random_matrix(3, 10, random);
  const std::vector<float> weights = random_weights(3 * kSkinGroup * 8, random);
  std::vector<std::uint16_t> vertices(10), bones(3 * kSkinGroup * 8);
  for (std::uint16_t v = 0; v < 10; ++v) vertices[v] = v;
  for (std::size_t i = 0; i < bones.size(); ++i) bones[i] = static_cast<std::uint16_t>(i * 7 % 5);
  alignas(64) float rows[5 * kSkinRow];
  kernels.skin_rows(matrices.values.data(), 5, rows);
  const SkinRun run{10, 2};
  std::vector<float> out(33, 7.0f);
  kernels.skin(rows, {&run, 1, vertices.data(), bones.data(), weights.data()}, points.values.data(),
               out.data());
  return out;
}

TEST_P(SimdKernels, SkinTheVerticesOfTheirPartAlone) {
  const std::vector<float> out = skinned(kernels_), wanted = skinned(scalar_kernels());
  for (std::size_t i = 0; i < 30; ++i) EXPECT_NEAR(out[i], wanted[i], 1e-3f) << i;
  for (std::size_t i = 30; i < 33; ++i) EXPECT_EQ(out[i], 7.0f);
}

INSTANTIATE_TEST_SUITE_P(Every, SimdKernels, testing::ValuesIn(all_kernels()),
                         [](const auto& about) { return about.param; });

void expect_bits(const Kernels& a, const Kernels& b) {
  EXPECT_EQ(skinned(a), skinned(b));
  std::mt19937 random(4);
  const Matrix<float> m = random_matrix(200, 200, random);
  const Matrix<std::uint16_t> half = halves(m);
  const std::vector<float> weights = random_weights(100, random);
  const std::vector<std::uint32_t> offsets = every_second(100, 200);
  std::vector<float> first(rounded_up(200)), second(rounded_up(200));
  for (const bool is_half : {false, true}) {
    for (const auto& [kernels, out] : {std::pair(&a, &first), std::pair(&b, &second)}) {
      if (is_half) {
        kernels->half_columns(half.values.data(), columns_of(offsets, 100).data(), 100,
                              weights.data(), out->data(), 200);
      } else {
        kernels->columns(m.values.data(), columns_of(offsets, 100).data(), 100, weights.data(),
                         out->data(), 200);
      }
    }
    for (std::size_t r = 0; r < 200; ++r) {
      ASSERT_EQ(std::bit_cast<std::uint32_t>(first[r]), std::bit_cast<std::uint32_t>(second[r]));
    }
  }
}

TEST(ScalarKernels, SameBitsAtEveryOptimisation) {
  expect_bits(scalar_kernels(), scalar_kernels_unoptimised());
}

TEST(ScalarKernels, SameBitsAsSse4) {
  if (sse4_kernels() == nullptr) GTEST_SKIP() << "this CPU has no SSE4";
  expect_bits(scalar_kernels(), *sse4_kernels());
}

TEST(Half, EveryFiniteHalfSurvivesTheWayThroughAFloat) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    if ((bits & 0x7C00u) == 0x7C00u) continue;
    const auto half = static_cast<std::uint16_t>(bits);
    ASSERT_EQ(to_half(from_half(half)), half);
  }
}

// The expected value of a half float follows from its definition by exponent and fraction.
TEST(Half, HasTheValueOfItsFields) {
  for (std::uint32_t bits = 0; bits < 0x8000; ++bits) {
    const int exponent = static_cast<int>(bits >> 10);
    if (exponent == 31) continue;
    const double fraction = static_cast<double>(bits & 0x3FFu) / 1024.0;
    const double expected =
        exponent == 0 ? std::ldexp(fraction, -14) : std::ldexp(1.0 + fraction, exponent - 15);
    ASSERT_EQ(double{from_half(static_cast<std::uint16_t>(bits))}, expected) << bits;
  }
}

TEST(Half, RoundsToTheNearest) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> exponent(-26.0f, 15.9f);
  for (int i = 0; i < 100000; ++i) {
    const float v = std::exp2(exponent(random)) * (i % 2 == 0 ? 1.0f : -1.0f);
    const std::uint16_t half = to_half(v);
    const double error = std::fabs(double{from_half(half)} - double{v});
    for (const int step : {-1, 1}) {
      const int near = half + step;
      if ((near & 0x7FFF) >= 0x7C00 || (near & 0x8000) != (half & 0x8000) || near < 0) continue;
      ASSERT_LE(error, std::fabs(double{from_half(static_cast<std::uint16_t>(near))} - double{v}));
    }
  }
}

TEST(Four, KeepNanAndSayWhatIsNot0) {
  const float nan = std::nanf(""), values[4] = {-0.0f, nan, 3.0f, -2.0f};
  const Four four = Four::load(values);
  EXPECT_TRUE(four.any_but_0());
  EXPECT_FALSE(Four::all(-0.0f).any_but_0());
  EXPECT_TRUE(four.any_nan());
  EXPECT_FALSE((Four::all(2.0f) * Four::all(3.0f)).any_nan());
  float out[4];
  (four.at_least(0.0f).at_most(1.0f) * Four::all(5.0f) + Four::all(0.0f)).store(out);
  EXPECT_EQ(out[0], 0.0f);
  EXPECT_FALSE(std::signbit(out[0]));
  EXPECT_TRUE(std::isnan(out[1]));
  EXPECT_EQ(out[2], 5.0f);
  EXPECT_EQ(out[3], 0.0f);
}

TEST(Four, RowsBecomeColumns) {
  constexpr std::size_t kStride = 7;
  float rows[4 * kStride], columns[4][6] = {};
  for (std::size_t i = 0; i < std::size(rows); ++i) rows[i] = static_cast<float>(i);
  turn_four(rows + 2, kStride, columns[0] + 1, columns[1] + 1, columns[2] + 1, columns[3] + 1);
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t r = 0; r < 4; ++r) {
      EXPECT_EQ(columns[c][1 + r], static_cast<float>(r * kStride + 2 + c));
    }
    EXPECT_EQ(columns[c][0], 0.0f);
    EXPECT_EQ(columns[c][5], 0.0f);
  }
}

}  // namespace
}  // namespace risorius::simd
