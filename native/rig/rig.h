// SPDX-License-Identifier: MIT
// Rig: the compiled, immutable form of a face's behavior. Knows nothing of the file it came from;
// may be shared by any number of threads and faces.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/aligned.h"
#include "core/result.h"
#include "rig/arrays.h"
#include "simd/kernels.h"

namespace risorius::rig {

/// Views into one block of bytes that any number of Rigs may share.
class Rig : public RigHeader, public RigArrays<View> {
 public:
  const simd::Kernels* kernels = nullptr;

  std::vector<std::string> raw_control_names() const { return texts(0, raw_count); }
  std::vector<std::string> gui_control_names() const { return texts(raw_count, gui_count); }
  /// Behavior in the file that is not evaluated.
  std::vector<std::string> ignored_layers() const {
    return texts(raw_count + gui_count, text_ends.size() - raw_count - gui_count);
  }
  std::span<const std::uint32_t> steps_of(std::uint32_t lod, StepList list) const {
    const std::uint32_t* begin = step_begins.data() + std::size_t{lod} * kStepLists + list;
    return steps.subspan(begin[0], begin[1] - begin[0]);
  }
  bool is_half() const { return !joint_halves.empty(); }
  /// The whole Rig as bytes: a header with version and hash, then the arrays. Written to a file it
  /// is a cache, for machines of the same byte order.
  std::span<const std::uint8_t> block() const { return block_; }
  std::size_t memory_bytes() const { return sizeof(Rig) + block_.size(); }

 private:
  friend struct BlockReader;
  std::vector<std::string> texts(std::size_t first, std::size_t count) const;
  std::span<const std::uint8_t> block_;
  std::shared_ptr<const void> owner_;
};

enum class BlockCheck {
  kHeader,  // version, sizes and places of the arrays: for bytes that this process wrote
  kHash,    // and the hash, which finds every changed bit: for bytes that this program once wrote
  kFull,    // and every index against its space: for bytes from anywhere, forged ones as well
};

/// In: data that compile() made. Fails: kLimitExceeded (more than 4 GiB of matrices).
core::Result<Rig> make_rig(const RigData& data, const simd::Kernels& kernels);

/// A Rig from the bytes of Rig::block(). Copies nothing: they stay where owner keeps them.
/// In:    bytes  aligned to 64
/// Fails: kInvalidValue, kInvalidIndex (bytes that are no Rig of this version and machine),
///        kInvalidArgument (alignment)
core::Result<Rig> open_rig(std::span<const std::uint8_t> bytes, std::shared_ptr<const void> owner,
                           BlockCheck check, const simd::Kernels& kernels);

/// Blocks of other versions are refused.
std::uint32_t block_version();

/// Puts the hash of a block's bytes into its header. In: at least a header's size.
void seal_block(std::span<std::uint8_t> bytes);

/// The output of one evaluation. Joint values are deltas from neutral in the file's units and axes:
/// tx ty tz rx ry rz sx sy sz, or tx ty tz qx qy qz qw sx sy sz; a scale of 0 is no scale.
struct Pose {
  std::vector<float> joints;         // [joints, stride]
  std::vector<float> blend_shapes;   // [channels]
  std::vector<float> animated_maps;  // [maps], in [0, 1]
  std::vector<float> controls;       // [controls]
};

/// Where a pose is written.
struct PoseView {
  float* joints = nullptr;
  float* blend_shapes = nullptr;
  float* animated_maps = nullptr;
  float* controls = nullptr;
};
inline PoseView view(Pose& pose) {
  return {pose.joints.data(), pose.blend_shapes.data(), pose.animated_maps.data(),
          pose.controls.data()};
}

/// Scratch memory of one thread; alone in its cache lines, so that threads side by side do not wait
/// for each other.
struct alignas(128) Workspace {
  std::vector<std::uint16_t> active;  // controls that are not 0, ascending
  std::size_t active_count = 0;
  std::uint32_t touched = 0;                 // nothing: keeps reads that only fetch
  std::size_t raw_active = 0;                // how many of them are raw
  std::vector<std::uint16_t> candidates;     // correctives that may not be 0
  std::vector<std::uint64_t> psd_bits;       // correctives that are not 0, by output
  std::vector<std::uint32_t> column_begins;  // [groups + 1], in columns
  std::vector<simd::Column> columns;         // active, by group
  core::AlignedVector<float> rows;           // of all groups
  std::vector<float> last_controls;
  std::vector<Quaternion> products;            // [quaternion joints]
  std::vector<std::uint64_t> quaternion_bits;  // columns that are not at rest; 0 between calls
  std::vector<double> solver;                  // a solver's inputs, then two rows of its poses
  std::vector<float> masks;                    // [regions]; 0: its networks rest
  core::AlignedVector<float> operation_values, layers[2];
  std::vector<simd::Column> layer_columns;
  // Of a batch: [kFrames] of each.
  std::vector<std::uint64_t> union_bits;      // controls that any frame uses; 0 between calls
  std::vector<float> frame_weights;           // [controls, kFrames]; 0 between calls
  std::vector<std::uint32_t> column_offsets;  // as columns
  std::vector<float> column_weights;          // [.., kFrames]
};

Pose make_pose(const Rig& rig);
Workspace make_workspace(const Rig& rig);
/// For evaluate_frames as well.
Workspace make_batch_workspace(const Rig& rig);

/// Raw controls from GUI controls by the conditional table; results are clamped to [0, 1], inputs
/// outside every row's range give nothing.
/// In: gui float32[G]. Out: raw float32[R].
void gui_to_raw(const Rig& rig, const float* gui, float* raw) noexcept;

/// GUI controls from raw controls, where the table can be reversed: of each GUI control's ranges
/// (rows of equal bounds) the one that most raw controls other than 0 reverse into decides by its
/// first row that reverses into it; the others are 0.
/// In: raw float32[R]. Out: gui float32[G].
void raw_to_gui(const Rig& rig, const float* raw, float* gui) noexcept;

/// Turns raw controls into a pose. Allocates nothing.
/// In:   raw     float32[R]. Any value is taken. Outside [0, 1] joints and shapes follow beyond,
///               correctives clamp their factors, maps rest outside their intervals. NaN or
///               infinity spoils every row of the joint groups that have it as a column, its
///               shapes, maps, networks, setups and the correctives of which no other factor is 0,
///               and nothing else; check_finite finds it
///       lod     clamped to the last LOD
///       settle  true: networks, solvers and correctives are evaluated in the order of their
///               dependency, so that the pose is a function of raw alone; false: networks, then
///               solvers, then correctives, each reading the rest of those after it, as on the
///               reference's first call
/// Out:  pose    every field overwritten
/// From: RigLogic; dna-format 12
void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle, Workspace& work,
              const PoseView& pose) noexcept;
inline void evaluate(const Rig& rig, const float* raw, std::uint32_t lod, bool settle,
                     Workspace& work, Pose& pose) noexcept {
  evaluate(rig, raw, lod, settle, work, view(pose));
}

/// The same for count frames or faces, as a small product of matrices that reads each value of the
/// rig once for several of them. Frame n has the bits of evaluate alone.
/// In:  raw   float32[count, R]
///      work  of make_batch_workspace
/// Out: pose  the first frame; the others follow, [count, ...] each
void evaluate_frames(const Rig& rig, const float* raw, std::size_t count, std::uint32_t lod,
                     bool settle, Workspace& work, const PoseView& pose) noexcept;

/// How near a solver's inputs are to each of its poses. For people who ask why; evaluate() does the
/// same on its way.
/// In:  index     below the number of solvers
///      controls  float32[controls] of an evaluated pose
///      work      of make_workspace
/// Out: distances, weights  [poses of the solver]: distances in radians where they are angles;
///      weights as they are written, 0 for what is not above the threshold
void solver_poses(const Rig& rig, std::uint32_t index, const float* controls, Workspace& work,
                  double* distances, float* weights) noexcept;

/// A raw control that is NaN or infinite.
struct NonFinite {
  std::size_t frame = 0;
  std::uint32_t control = 0;
  float value = 0;
};

/// The raw controls that are NaN or infinite, frame after frame. evaluate() does not look: see
/// there for what such a control spoils.
/// In:   raw   float32[count, R]
///       most  of them that are returned
/// Cost: one pass over raw; allocates only where something is found.
std::vector<NonFinite> find_non_finite(const Rig& rig, const float* raw, std::size_t count,
                                       std::size_t most = SIZE_MAX);

/// Fails: kInvalidValue, naming the first control that is not finite, its frame and its value, and
/// how many there are.
core::Status check_finite(const Rig& rig, const float* raw, std::size_t count);

/// One face through time, with the reference's latency: networks, then solvers, then correctives
/// are evaluated, and each reads what comes after it as the previous evaluation left it.
class Instance {
 public:
  explicit Instance(const Rig& rig);
  std::uint32_t lod() const { return lod_; }
  /// Another level puts all but the raw controls to rest, as in the reference. Clamped to the last
  /// LOD.
  void set_lod(std::uint32_t lod) noexcept;
  const Pose& evaluate(const float* raw) noexcept;
  /// One value per region of each mesh, mesh after mesh. At 0 the region's networks are not
  /// evaluated and what they write rests; other values have no effect.
  std::span<const float> masks() const { return work_.masks; }
  /// In: index below the number of masks.
  void set_mask(std::size_t index, float value) noexcept;

 private:
  void rest() noexcept;

  const Rig* rig_;
  std::uint32_t lod_ = 0;
  bool at_rest_ = false;  // the pose is what raw, still in its controls, gives
  Workspace work_;
  Pose pose_;
  std::vector<float> before_;  // the controls of the frame before
};

}  // namespace risorius::rig
