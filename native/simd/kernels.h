// SPDX-License-Identifier: MIT
// The inner loops of the evaluator and of the reader of files, one table of functions per
// instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

namespace risorius::simd {

/// The widest vector. Results are rounded up to it, and a matrix needs as many readable values
/// behind its last one: rows are not padded, a kernel reads on into the next column and its caller
/// passes the surplus over.
inline constexpr std::size_t kWidest = 16;
template <class T>
constexpr T rounded_up(T rows) {
  return (rows + kWidest - 1) / kWidest * kWidest;
}
/// Frames that a batch kernel takes at once.
inline constexpr std::size_t kFrames = 8;

/// A column of a matrix and what it is multiplied by.
struct Column {
  std::uint32_t offset = 0;  // of its first value
  std::uint32_t weight = 0;  // which of the weights
};

/// A column of a matrix and the run of rows that it is added to.
struct Addend {
  std::uint32_t offset = 0;  // of its first value
  std::uint32_t group = 0;   // which of the runs
};
/// A run of rows. Where count is a multiple of kWidest they are added by whole vectors.
struct Rows {
  std::uint32_t begin = 0, count = 0;
};
/// What columns are added to.
struct Sums {
  const Rows* runs = nullptr;     // by group
  std::uint32_t groups = 0;       // those from here on have no rows
  float* values = nullptr;        // of all runs; kWidest of them may be read from any row on
  std::uint8_t* added = nullptr;  // by group: becomes 1 where a column is added
};

/// Sixteen places: those whose bit is set take the values from `from` on, one after the other.
struct Piece {
  std::uint32_t from = 0;
  std::uint16_t mask = 0;
  std::uint16_t block = 0;  // of the places; of an extra piece only
};
inline constexpr std::size_t kPlaces = 16;
/// Where the values and the places of the first frame are, and those of the next ones.
struct PlacedFrames {
  const float* from;
  std::size_t from_stride;
  float* to;
  std::size_t to_stride;
  std::size_t count;
};

/// How Euler angles are spelled: the axis of each turn, half a unit of its angle in radians with
/// the sign of its direction, and +1 for the cyclic orders xyz, yzx, zxy, -1 for the others.
struct EulerTurns {
  std::uint8_t order[3] = {0, 1, 2};
  float half_units[3] = {0.5f, 0.5f, 0.5f};
  float parity = 1;
};

/// Vertices one after the other, by groups of kSkinGroup of which the last may have fewer; each has
/// so many times four influences.
struct SkinRun {
  std::uint32_t vertices = 0, fours = 0;
};
inline constexpr std::size_t kSkinGroup = 4;
/// Floats that a bone's matrix takes, as `skin_rows` writes it; it begins on a cache line.
inline constexpr std::size_t kSkinRow = 16;
/// Some vertices of a skin, run after run. Of each group of a run, four influences of its first
/// vertex, of its second .. fourth, then the next four of each; where a vertex has fewer, or a
/// group has none, there stand weights of 0 and a bone whose row is 0.
struct SkinPart {
  const SkinRun* runs = nullptr;
  std::size_t run_count = 0;
  const std::uint16_t* vertices = nullptr;  // which of the points each is, ascending in a run
  const std::uint16_t* bones = nullptr;
  const float* weights = nullptr;
};

/// Fewer columns a group than these are best added in the order of memory (add_columns); where
/// there are more, a list for `columns` takes less time. Measured for each instruction set.
struct FewColumns {
  static constexpr std::uint32_t kAny = 0xffffffff;  // any number of columns is added so
  std::uint32_t floats = kAny, halves = 64;
};

/// All sums are taken in the order of the columns, so that a frame of a batch has the bits of the
/// frame alone.
struct Kernels {
  const char* name;

  /// out[r] = sum over i of weights[columns[i].weight] * values[columns[i].offset + r].
  /// In:   values   of all matrices
  ///       n        columns
  /// Out:  out      float32[rounded_up(rows)], overwritten; beyond rows anything
  void (*columns)(const float* values, const Column* columns, std::size_t n, const float* weights,
                  float* out, std::size_t rows);
  /// The same from IEEE half floats, none of them infinite.
  void (*half_columns)(const std::uint16_t* values, const Column* columns, std::size_t n,
                       const float* weights, float* out, std::size_t rows);
  /// sums.values[begin + r] += weight * values[offset + r] for each row r of each column's run,
  /// one column after the other, up to the first of a group that has no rows. Other sums stay as
  /// they are. In: columns  by ascending group
  void (*add_columns)(const float* values, const Addend* columns, std::size_t n, float weight,
                      const Sums& sums);
  void (*add_half_columns)(const std::uint16_t* values, const Addend* columns, std::size_t n,
                           float weight, const Sums& sums);
  /// As columns, for kFrames frames: weights float32[.., kFrames], frame f at out + f * stride.
  void (*batch_columns)(const float* values, const Column* columns, std::size_t n,
                        const float* weights, float* out, std::size_t stride, std::size_t rows);
  void (*batch_half_columns)(const std::uint16_t* values, const Column* columns, std::size_t n,
                             const float* weights, float* out, std::size_t stride,
                             std::size_t rows);
  /// Fills n blocks of kPlaces with their pieces, other places with 0; of each frame.
  /// In: from  kPlaces values may be read from any piece's first on
  void (*place)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// The same for extra pieces, which leave the other places of their blocks as they are: these may
  /// be read and written as well.
  void (*place_more)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// Euler angles x y z to quaternions x y z w in place, error below 2e-7; the same bits on every
  /// CPU.
  /// In:   which      n numbers of rotations
  ///       rotations  the angles of rotation i are at i * stride, behind them there is room for w
  void (*quaternions)(const EulerTurns& turns, const std::uint16_t* which, std::size_t n,
                      float* rotations, std::size_t stride);

  /// Matrices of bones as `skin` of this table takes them.
  /// In:  matrices  float32[n, 3, 4], rows
  /// Out: rows      float32[n, kSkinRow], each less the identity: a bone at rest then adds nothing
  void (*skin_rows)(const float* matrices, std::size_t n, float* rows);
  /// out[v] = points[v] + (sum of weight * (M - 1)) points[v]; without influences out[v] =
  /// points[v]. Influences are added in their order, each vertex by itself. In:  rows    of
  /// skin_rows, on a cache line
  ///      points  float32[.., 3]
  /// Out: out     float32[.., 3]: the vertices of the part alone; may be points
  void (*skin)(const float* rows, const SkinPart& part, const float* points, float* out);

  /// n big-endian numbers of a file in the machine's byte order.
  /// In:   from  the bytes of the numbers, of any alignment
  /// Out:  to    the numbers, overwritten
  void (*native_u16)(const std::uint8_t* from, std::uint16_t* to, std::size_t n);
  /// The same. Out: the largest number, 0 where n is 0.
  std::uint32_t (*native_u32)(const std::uint8_t* from, std::uint32_t* to, std::size_t n);
  /// The same. Out: whether all numbers are finite.
  bool (*native_f32)(const std::uint8_t* from, float* to, std::size_t n);

  FewColumns few = {};
};

/// No fused operations and a fixed order of sums: the same bits on every machine.
const Kernels& scalar_kernels();
/// nullptr where the build or the CPU has none. SSE4 has the bits of the scalar path.
const Kernels* sse4_kernels();
const Kernels* avx2_kernels();    // with FMA and F16C
const Kernels* avx512_kernels();  // F, BW, DQ, VL
const Kernels* neon_kernels();

/// What CPU and operating system both support.
bool cpu_has_sse4();    // 4.1
bool cpu_has_avx2();    // with FMA and F16C
bool cpu_has_avx512();  // F, BW, DQ, VL

/// The table of that name ("scalar", "sse4", "avx2", "avx512", "neon"), or nullptr. An empty name
/// is the environment variable RISORIUS_SIMD when it is set, else the best that this CPU has.
const Kernels* find_kernels(const char* name);
/// find_kernels(""), or the scalar table where RISORIUS_SIMD names none that this CPU has: for what
/// has nobody to tell of a wrong name.
const Kernels& usual_kernels();
/// What this CPU can run, for an error message: "scalar, sse4, avx2".
const char* available_kernels();

}  // namespace risorius::simd
