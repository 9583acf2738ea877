// SPDX-License-Identifier: MIT
// The inner loops of the evaluator and of the file reader: one table of functions per instruction
// set.
#pragma once

#include <cstddef>
#include <cstdint>

namespace risorius::simd {

/// The widest vector. Results are rounded up to it, and a matrix needs this many readable values
/// behind its last one: rows are not padded, so that a kernel reads on into the next column and its
/// caller ignores the surplus.
inline constexpr std::size_t kWidest = 16;
template <class T>
constexpr T rounded_up(T rows) {
  return (rows + kWidest - 1) / kWidest * kWidest;
}
/// Frames that a batch kernel takes at once.
inline constexpr std::size_t kFrames = 8;

/// A column of a matrix and the index of its weight.
struct Column {
  std::uint32_t offset = 0;  // of its first value
  std::uint32_t weight = 0;  // index into the weights
};

/// A column of a matrix and the index of the rows to which it is added.
struct Addend {
  std::uint32_t offset = 0;  // of its first value
  std::uint32_t group = 0;   // index into the runs
};
/// A run of rows. If count is a multiple of kWidest, whole vectors are added.
struct Rows {
  std::uint32_t begin = 0, count = 0;
};
/// The sums to which columns are added.
struct Sums {
  const Rows* runs = nullptr;     // by group
  std::uint32_t groups = 0;       // groups from this index on have no rows
  float* values = nullptr;        // of all runs; kWidest values are readable from any row on
  std::uint8_t* added = nullptr;  // by group: set to 1 when a column is added
};

/// Sixteen places. The places with a set bit take consecutive values, beginning at `from`.
struct Piece {
  std::uint32_t from = 0;
  std::uint16_t mask = 0;
  std::uint16_t block = 0;  // index of the sixteen places; of an extra piece only
};
inline constexpr std::size_t kPlaces = 16;
/// The addresses of values and places of the first frame, and the strides to the next frames.
struct PlacedFrames {
  const float* from;
  std::size_t from_stride;
  float* to;
  std::size_t to_stride;
  std::size_t count;
};

/// A convention of Euler angles: the axis of each turn, half a unit of its angle in radians with
/// the sign of its direction, and +1 for the cyclic orders xyz, yzx, zxy, -1 for the others.
struct EulerTurns {
  std::uint8_t order[3] = {0, 1, 2};
  float half_units[3] = {0.5f, 0.5f, 0.5f};
  float parity = 1;
};

/// Consecutive vertices in groups of kSkinGroup (the last group may be smaller). Each vertex has
/// `fours` times four influences.
struct SkinRun {
  std::uint32_t vertices = 0, fours = 0;
};
inline constexpr std::size_t kSkinGroup = 4;
/// Floats of a bone's matrix as `skin_rows` writes it; it begins on a cache line.
inline constexpr std::size_t kSkinRow = 16;
/// Some vertices of a skin, run after run. A group of a run lists four influences of its first
/// vertex, of its second .. fourth, then the next four of each. Missing influences have weight 0
/// and a bone whose row is 0.
struct SkinPart {
  const SkinRun* runs = nullptr;
  std::size_t run_count = 0;
  const std::uint16_t* vertices = nullptr;  // index of each vertex's point, ascending in a run
  const std::uint16_t* bones = nullptr;
  const float* weights = nullptr;
};

/// With fewer columns per group than this, add_columns in the order of memory is fastest; with
/// more, a list for `columns` is. Measured for each instruction set.
struct FewColumns {
  static constexpr std::uint32_t kAny = 0xffffffff;  // add_columns is always used
  std::uint32_t floats = kAny, halves = 64;
};

/// All sums follow the order of the columns, so that a frame of a batch has the same bits as the
/// frame alone.
struct Kernels {
  const char* name;

  /// out[r] = sum over i of weights[columns[i].weight] * values[columns[i].offset + r].
  /// In:   values   of all matrices
  ///       n        number of columns
  /// Out:  out      float32[rounded_up(rows)], overwritten; undefined beyond rows
  void (*columns)(const float* values, const Column* columns, std::size_t n, const float* weights,
                  float* out, std::size_t rows);
  /// The same for finite IEEE half floats.
  void (*half_columns)(const std::uint16_t* values, const Column* columns, std::size_t n,
                       const float* weights, float* out, std::size_t rows);
  /// sums.values[begin + r] += weight * values[offset + r] for each row r of each column's run, one
  /// column after the other, up to the first column of a group without rows. Other sums are
  /// unchanged.
  /// In: columns  by ascending group
  void (*add_columns)(const float* values, const Addend* columns, std::size_t n, float weight,
                      const Sums& sums);
  void (*add_half_columns)(const std::uint16_t* values, const Addend* columns, std::size_t n,
                           float weight, const Sums& sums);
  /// Like columns, for kFrames frames: weights float32[.., kFrames], frame f at out + f * stride.
  void (*batch_columns)(const float* values, const Column* columns, std::size_t n,
                        const float* weights, float* out, std::size_t stride, std::size_t rows);
  void (*batch_half_columns)(const std::uint16_t* values, const Column* columns, std::size_t n,
                             const float* weights, float* out, std::size_t stride,
                             std::size_t rows);
  /// Fills n blocks of kPlaces with their pieces, and their other places with 0, in each frame.
  /// In: from  kPlaces values are readable from the first value of any piece on
  void (*place)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// The same for extra pieces, which leave the other places of their blocks unchanged. These
  /// places may be read and rewritten.
  void (*place_more)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// Converts Euler angles x y z to quaternions x y z w in place, with an error below 2e-7 and the
  /// same bits on every CPU.
  /// In:   which      n indices of rotations
  ///       rotations  the angles of rotation i are at i * stride, followed by room for w
  void (*quaternions)(const EulerTurns& turns, const std::uint16_t* which, std::size_t n,
                      float* rotations, std::size_t stride);

  /// Packs matrices of bones for `skin` of the same table.
  /// In:  matrices  float32[n, 3, 4], rows
  /// Out: rows      float32[n, kSkinRow], each minus the identity, so that a bone at rest adds
  ///                nothing
  void (*skin_rows)(const float* matrices, std::size_t n, float* rows);
  /// out[v] = points[v] + (sum of weight * (M - 1)) points[v]; without influences out[v] =
  /// points[v]. Influences are added in their order, each vertex independently.
  /// In:  rows    from skin_rows, aligned to a cache line
  ///      points  float32[.., 3]
  /// Out: out     float32[.., 3]: only the vertices of the part are written; may be points
  void (*skin)(const float* rows, const SkinPart& part, const float* points, float* out);

  /// Converts n big-endian numbers of a file to the machine's byte order.
  /// In:   from  the bytes of the numbers, of any alignment
  /// Out:  to    the numbers, overwritten
  void (*native_u16)(const std::uint8_t* from, std::uint16_t* to, std::size_t n);
  /// The same. Out: the largest number, 0 if n is 0
  std::uint32_t (*native_u32)(const std::uint8_t* from, std::uint32_t* to, std::size_t n);
  /// The same. Out: whether all numbers are finite.
  bool (*native_f32)(const std::uint8_t* from, float* to, std::size_t n);

  FewColumns few = {};
};

/// No fused operations and a fixed order of sums: the bits are the same on every machine.
const Kernels& scalar_kernels();
/// nullptr if the build or the CPU lacks the instructions. SSE4 gives the bits of the scalar path.
const Kernels* sse4_kernels();
const Kernels* avx2_kernels();    // with FMA and F16C
const Kernels* avx512_kernels();  // F, BW, DQ, VL
const Kernels* neon_kernels();

/// Whether CPU and operating system support the instructions.
bool cpu_has_sse4();    // 4.1
bool cpu_has_avx2();    // with FMA and F16C
bool cpu_has_avx512();  // F, BW, DQ, VL

/// The table of that name ("scalar", "sse4", "avx2", "avx512", "neon"), or nullptr. An empty name
/// means the environment variable RISORIUS_SIMD if it is set, otherwise the best table that this
/// CPU supports.
const Kernels* find_kernels(const char* name);
/// find_kernels(""), or the scalar table if RISORIUS_SIMD names a table that this CPU lacks: for
/// callers that cannot report an error.
const Kernels& usual_kernels();
/// The tables that this CPU supports, for an error message: "scalar, sse4, avx2".
const char* available_kernels();

}  // namespace risorius::simd
