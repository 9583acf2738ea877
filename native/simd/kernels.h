// SPDX-License-Identifier: MIT
// Kernels: the inner loops of the evaluator and of the file reader, one table of functions per
// instruction set. A vector is a CPU register of several floats; a batch is several frames that are
// evaluated together.
#pragma once

#include <cstddef>
#include <cstdint>

namespace risorius::simd {

/// Number of floats in the widest vector. Kernels compute whole vectors. The columns of a matrix
/// need no padding: at the end of a column, a kernel also reads the first values of the next
/// column, and its caller ignores the results behind the last row. Therefore kWidest values after
/// the last value of a matrix must be readable, and results need room for rounded_up(rows) floats.
inline constexpr std::size_t kWidest = 16;
template <class T>
constexpr T rounded_up(T rows) {
  return (rows + kWidest - 1) / kWidest * kWidest;
}
/// Number of frames that a batch kernel evaluates together.
inline constexpr std::size_t kFrames = 8;

/// A column of a matrix and the index of its weight.
struct Column {
  std::uint32_t offset = 0;  // index of the column's first value among the values of all matrices
  std::uint32_t weight = 0;  // index into the weights
};

/// A column of a matrix and the index of the rows to which it is added.
struct Addend {
  std::uint32_t offset = 0;  // index of the column's first value among the values of all matrices
  std::uint32_t group = 0;   // index into Sums::runs
};
/// A run of rows in Sums::values. If count is a multiple of kWidest, columns are added by whole
/// vectors.
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

/// Tells how values are copied to a block of kPlaces (16) places. Each place p whose bit p of mask
/// is set, in ascending order, gets the next value, beginning with the value at index `from`.
struct Piece {
  std::uint32_t from = 0;
  std::uint16_t mask = 0;
  std::uint16_t block = 0;  // index of the block of places; only place_more reads it
};
inline constexpr std::size_t kPlaces = 16;
/// The arrays between which `place` copies floats, for several frames.
struct PlacedFrames {
  const float* from;        // the values of the first frame
  std::size_t from_stride;  // floats from the values of a frame to the next frame's
  float* to;                // the places of the first frame
  std::size_t to_stride;    // floats from the places of a frame to the next frame's
  std::size_t count;        // number of frames
};

/// A convention of Euler angles. order: the axes in the order of rotation; half_units: for each
/// rotation, in the same order, the factor from its angle to half of the angle in radians, negative
/// if the direction is reversed; parity: +1 for the cyclic orders xyz, yzx, zxy, -1 for the others.
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
/// influences, also those of the missing vertices of a smaller group, have weight 0 and a bone
/// whose row is 0. Runs with `fours` 0 have no influences.
struct SkinPart {
  const SkinRun* runs = nullptr;
  std::size_t run_count = 0;
  const std::uint16_t* vertices = nullptr;  // index of each vertex's point, ascending in a run
  const std::uint16_t* bones = nullptr;     // of each influence: index of the bone's row
  const float* weights = nullptr;           // of each influence
};

/// Average number of columns per group of rows below which add_columns in the order of memory is
/// the fastest way; with more columns, `columns` with a list is faster. Measured for each
/// instruction set, for matrices of float32 (floats) and float16 (halves).
struct FewColumns {
  static constexpr std::uint32_t kAny = 0xffffffff;  // add_columns is always used
  std::uint32_t floats = kAny, halves = 64;
};

/// The functions of one instruction set. All sums have the order of the columns, so that a frame in
/// a batch has the same bits as the frame alone.
struct Kernels {
  const char* name;

  /// out[r] = sum over i of weights[columns[i].weight] * values[columns[i].offset + r].
  /// In:   values   float32, the values of all matrices
  ///       n        number of columns
  ///       weights  float32, in which Column::weight is an index
  /// Out:  out      float32[rounded_up(rows)], overwritten; values after `rows` are undefined
  void (*columns)(const float* values, const Column* columns, std::size_t n, const float* weights,
                  float* out, std::size_t rows);
  /// Like columns, for matrices of finite IEEE half floats.
  void (*half_columns)(const std::uint16_t* values, const Column* columns, std::size_t n,
                       const float* weights, float* out, std::size_t rows);
  /// sums.values[begin + r] += weight * values[offset + r] for each row r of a column's run of
  /// rows, where begin is Rows::begin. Columns are added one after the other, up to the first
  /// column whose group is not below sums.groups. Other sums do not change.
  /// In: columns  sorted by ascending group
  void (*add_columns)(const float* values, const Addend* columns, std::size_t n, float weight,
                      const Sums& sums);
  void (*add_half_columns)(const std::uint16_t* values, const Addend* columns, std::size_t n,
                           float weight, const Sums& sums);
  /// Like columns, for kFrames frames: weights are float32[.., kFrames], and the results of frame f
  /// begin at out + f * stride.
  void (*batch_columns)(const float* values, const Column* columns, std::size_t n,
                        const float* weights, float* out, std::size_t stride, std::size_t rows);
  void (*batch_half_columns)(const std::uint16_t* values, const Column* columns, std::size_t n,
                             const float* weights, float* out, std::size_t stride,
                             std::size_t rows);
  /// Fills n consecutive blocks of kPlaces places in each frame, block i as pieces[i] tells: places
  /// whose bit is set in the mask get values, all others get 0.
  /// In: frames.from  from the first value of each piece on, kPlaces values must be readable
  void (*place)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// Like place, but piece i goes to block pieces[i].block, and the places whose bit is not set
  /// keep their values; they may be read and rewritten.
  void (*place_more)(const Piece* pieces, std::size_t n, const PlacedFrames& frames);
  /// Converts Euler angles x y z to quaternions x y z w in place, with an error below 2e-7 and the
  /// same bits on every CPU. Half angles above 8,192 radians use the C library's sine and cosine,
  /// whose bits may differ between systems.
  /// In:   which      n different indices of rotations
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
  /// Out: out     float32[.., 3]: only the vertices of the part are written; may be the same array
  ///              as points
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
/// Each of these four functions returns null if the build or the CPU does not have the
/// instructions. SSE4 gives the same bits as the scalar functions.
const Kernels* sse4_kernels();
const Kernels* avx2_kernels();    // with FMA and F16C
const Kernels* avx512_kernels();  // F, BW, DQ, VL
const Kernels* neon_kernels();

/// Whether CPU and operating system support the instruction set in the name of the function.
bool cpu_has_sse4();    // 4.1
bool cpu_has_avx2();    // with FMA and F16C
bool cpu_has_avx512();  // F, BW, DQ, VL

/// The table with a name ("scalar", "sse4", "avx2", "avx512", "neon"); null if this CPU does not
/// support it or no table has the name. An empty name or null means the name in the environment
/// variable RISORIUS_SIMD if it is set and not empty, otherwise the best table that this CPU
/// supports.
const Kernels* find_kernels(const char* name);
/// Like find_kernels(""), but returns the scalar table if RISORIUS_SIMD has an unknown name or
/// names a table that this CPU does not support. For callers that cannot report an error.
const Kernels& usual_kernels();
/// The names of the tables that this CPU supports, for an error message: "scalar, sse4, avx2".
const char* available_kernels();

}  // namespace risorius::simd
