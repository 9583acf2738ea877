// SPDX-License-Identifier: MIT
// The inner loops of the evaluator and of the file reader: one table of functions per instruction
// set.
#pragma once

#include <cstddef>
#include <cstdint>

namespace risorius::simd {

/// Floats in the widest vector. Kernels round the number of results up to a multiple of kWidest,
/// and a matrix must have kWidest readable values after its last one: rows are not padded, so that
/// a kernel also reads values of the next column, and its caller ignores the additional results.
inline constexpr std::size_t kWidest = 16;
template <class T>
constexpr T rounded_up(T rows) {
  return (rows + kWidest - 1) / kWidest * kWidest;
}
/// Number of frames that a batch kernel evaluates together.
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
/// A run of rows. If count is a multiple of kWidest, columns are added by whole vectors.
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

/// Tells which of sixteen attributes are copied. The places with a set bit in mask get consecutive
/// values, beginning with the value at index `from`.
struct Piece {
  std::uint32_t from = 0;
  std::uint16_t mask = 0;
  std::uint16_t block = 0;  // index of the sixteen places; of an extra piece only
};
inline constexpr std::size_t kPlaces = 16;
/// The addresses of values and places of the first frame, the strides to the next frames, and the
/// number of frames.
struct PlacedFrames {
  const float* from;
  std::size_t from_stride;
  float* to;
  std::size_t to_stride;
  std::size_t count;
};

/// A convention of Euler angles. order: the axis of each rotation; half_units: for each rotation
/// half a unit of its angle in radians, with the sign of its direction; parity: +1 for the cyclic
/// orders xyz, yzx, zxy, -1 for the others.
struct EulerTurns {
  std::uint8_t order[3] = {0, 1, 2};
  float half_units[3] = {0.5f, 0.5f, 0.5f};
  float parity = 1;
};

/// Vertices of a skin with 4 * fours influences each. They are in groups of kSkinGroup; the last
/// group may be smaller.
struct SkinRun {
  std::uint32_t vertices = 0, fours = 0;
};
inline constexpr std::size_t kSkinGroup = 4;
/// Number of floats that `skin_rows` writes for the matrix of a bone. Each matrix begins on a cache
/// line.
inline constexpr std::size_t kSkinRow = 16;
/// Some vertices of a skin, run after run. Each group of a run first lists four influences of its
/// first vertex, then four of its second, and so on, then the next four of each vertex. Missing
/// influences have weight 0 and a bone whose row is 0.
struct SkinPart {
  const SkinRun* runs = nullptr;
  std::size_t run_count = 0;
  const std::uint16_t* vertices = nullptr;  // index of each vertex's point, ascending in a run
  const std::uint16_t* bones = nullptr;
  const float* weights = nullptr;
};

/// Columns per group below which add_columns in the order of memory is the fastest way; with more
/// columns, `columns` with a list is faster. Measured for each instruction set.
struct FewColumns {
  static constexpr std::uint32_t kAny = 0xffffffff;  // add_columns is always used
  std::uint32_t floats = kAny, halves = 64;
};

/// The functions of one instruction set. All sums have the order of the columns, so that a frame in
/// a batch has the same bits as the frame alone.
struct Kernels {
  const char* name;

  /// out[r] = sum over i of weights[columns[i].weight] * values[columns[i].offset + r].
  /// In:   values   of all matrices
  ///       n        number of columns
  /// Out:  out      float32[rounded_up(rows)], overwritten; values after `rows` are undefined
  void (*columns)(const float* values, const Column* columns, std::size_t n, const float* weights,
                  float* out, std::size_t rows);
  /// Like columns, for matrices of finite IEEE half floats.
  void (*half_columns)(const std::uint16_t* values, const Column* columns, std::size_t n,
                       const float* weights, float* out, std::size_t rows);
  /// sums.values[begin + r] += weight * values[offset + r] for each row r of a column's run of
  /// rows. Columns are added one after the other, up to the first column of a group without rows.
  /// Other sums do not change.
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
  /// Fills n blocks of kPlaces attributes in each frame: places of the block's piece get values,
  /// all others get 0.
  /// In: from  kPlaces values are readable from the first value of any piece on
  void (*place)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// Like place for extra pieces: the other places of their blocks keep their values, but may be
  /// read and rewritten.
  void (*place_more)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// Converts Euler angles x y z to quaternions x y z w in place, with an error below 2e-7 and the
  /// same bits on every CPU.
  /// In:   which      n indices of rotations
  ///       rotations  the angles of rotation i are at i * stride, followed by room for w
  void (*quaternions)(const EulerTurns& turns, const std::uint16_t* which, std::size_t n,
                      float* rotations, std::size_t stride);

  /// Packs matrices of bones for the `skin` function of the same table.
  /// In:  matrices  float32[n, 3, 4], by rows
  /// Out: rows      float32[n, kSkinRow], each minus the identity, so that a bone in its rest
  ///                pose adds nothing
  void (*skin_rows)(const float* matrices, std::size_t n, float* rows);
  /// out[v] = points[v] + (sum of weight * (M - 1)) points[v]; a vertex without influences does not
  /// move. Influences are added in their order, for each vertex independently.
  /// In:  rows    from skin_rows, aligned to a cache line
  ///      points  float32[.., 3]
  /// Out: out     float32[.., 3]: only the vertices of the part are written; may be points
  void (*skin)(const float* rows, const SkinPart& part, const float* points, float* out);

  /// Converts n big-endian numbers of a file to the machine's byte order.
  /// In:   from  the bytes of the numbers, of any alignment
  /// Out:  to    the numbers, overwritten
  void (*native_u16)(const std::uint8_t* from, std::uint16_t* to, std::size_t n);
  /// Like native_u16 for uint32. Out: the largest number, 0 if n is 0
  std::uint32_t (*native_u32)(const std::uint8_t* from, std::uint32_t* to, std::size_t n);
  /// Like native_u16 for float32. Out: whether all numbers are finite
  bool (*native_f32)(const std::uint8_t* from, float* to, std::size_t n);

  FewColumns few = {};
};

/// Functions in plain C++ without fused operations and with a fixed order of sums: the bits are the
/// same on every machine.
const Kernels& scalar_kernels();
/// Null if the build or the CPU does not have the instructions. SSE4 gives the same bits as the
/// scalar functions.
const Kernels* sse4_kernels();
const Kernels* avx2_kernels();    // with FMA and F16C
const Kernels* avx512_kernels();  // F, BW, DQ, VL
const Kernels* neon_kernels();

/// Whether CPU and operating system support the instructions.
bool cpu_has_sse4();    // 4.1
bool cpu_has_avx2();    // with FMA and F16C
bool cpu_has_avx512();  // F, BW, DQ, VL

/// The table with a name ("scalar", "sse4", "avx2", "avx512", "neon"); null if this CPU does not
/// support it or no table has the name. An empty name or null means the name in the environment
/// variable RISORIUS_SIMD if it is set, otherwise the best table that this CPU supports.
const Kernels* find_kernels(const char* name);
/// Like find_kernels(""), but returns the scalar table if RISORIUS_SIMD names a table that this CPU
/// does not support. For callers that cannot report an error.
const Kernels& usual_kernels();
/// The names of the tables that this CPU supports, for an error message: "scalar, sse4, avx2".
const char* available_kernels();

}  // namespace risorius::simd
