// SPDX-License-Identifier: MIT
// Compiles a Dna (a face in the form of its file) to a Rig (the form for evaluation): runs the
// steps that fill the arrays of the Rig, within a budget of memory and steps, and copies the arrays
// into one block of bytes.
#include "compile/compile.h"

#include <span>
#include <string>

#include "compile/kept_matrices.h"
#include "compile/parts.h"
#include "dna/controls.h"
#include "dna/size.h"
#include "dna/validate.h"
#include "rig/block.h"

namespace risorius::compile {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::ok;
using core::Result;
using core::Status;
using detail::Groups;
using detail::KeptMatrices;
using detail::Used;
using rig::RigData;

// Runs the steps of compile().
// In:  finite  all numbers of the file are known to be finite
// Out: kept  the joint matrices; with float16 they are also in `out`, as joint_halves
Result<RigData> compile_parts(const dna::Dna& dna, bool finite, const CompileOptions& options,
                              core::Budget& budget, KeptMatrices& kept) {
  RigData out;
  out.joint_stride = options.rotation == Rotation::kQuaternion ? 10 : 9;
  if (const std::uint32_t controls = dna::control_counts(dna).total(); controls > 65536) {
    return fail(ErrorCode::kLimitExceeded, "behavior.psd_count",
                std::to_string(controls) + " controls, the format's indices reach 65536");
  }
  RISORIUS_TRY(detail::compile_frame(dna, budget, out));
  detail::StepLods lods;
  Used used(out.lod_count, std::vector<bool>(out.control_count, false));
  const Groups groups = detail::list_groups(dna);
  RISORIUS_TRY(detail::compile_joint_groups(dna, groups, out));
  detail::compile_quaternion_joints(dna, groups, out);
  RISORIUS_TRY(detail::compile_solvers(dna, budget, out, lods));
  RISORIUS_TRY(detail::compile_networks(dna, budget, out, lods));
  RISORIUS_TRY(detail::compile_ml_joints(dna, out));
  detail::compile_twist_and_swing(dna, out);
  RISORIUS_TRY(detail::compile_channels_and_maps(dna, out));
  RISORIUS_TRY(detail::compile_psds(dna, out));
  detail::list_joints_written(out);
  RISORIUS_TRY(detail::compile_columns(groups, finite, out, kept, used));
  detail::mark_channels_and_maps(out, used);
  detail::mark_ml_joints(out, used);
  RISORIUS_TRY(detail::schedule(used, lods, budget, out));
  if (out.joint_stride == 10) {
    RISORIUS_TRY(detail::widen_joint_rows(out));
  }
  detail::compile_pieces(groups, out);
  if (options.precision == Precision::kFloat16) {
    RISORIUS_TRY(detail::narrow(kept, out));
  }
  return out;
}

}  // namespace

Status detail::check_controls(const Array<std::uint16_t>& indices, std::uint32_t limit,
                              const std::string& where) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < limit) continue;
    return fail(
        ErrorCode::kInvalidIndex, where + "[" + std::to_string(i) + "]",
        "control " + std::to_string(indices[i]) + ", but there are " + std::to_string(limit));
  }
  return ok();
}

Status detail::check_lods(const Array<std::uint16_t>& lods, std::uint32_t lod_count,
                          const std::string& where) {
  if (lods.size() >= lod_count) return ok();
  return fail(ErrorCode::kInvalidLength, where + ".lods",
              std::to_string(lods.size()) + " entries, but there are " + std::to_string(lod_count) +
                  " LODs");
}

core::Budget budget_for(const dna::Dna& dna) {
  const std::uint64_t size = dna::size_in_bytes(dna);
  return {"compiling this face", (std::uint64_t{1} << 20) + 64 * size,
          (std::uint64_t{1} << 28) + 256 * size};
}

Result<rig::Rig> compile(const dna::Dna& dna, const CompileOptions& options) {
  std::vector<dna::Warning> warnings;
  RISORIUS_TRY(dna::validate_behavior(dna, warnings));
  const simd::Kernels* kernels =
      options.kernels != nullptr ? options.kernels : simd::find_kernels(nullptr);
  if (kernels == nullptr) {
    return fail(ErrorCode::kInvalidArgument, "RISORIUS_SIMD",
                std::string("this instruction set is not available; there are: ") +
                    simd::available_kernels());
  }
  core::Budget own = budget_for(dna);
  KeptMatrices kept;
  const bool finite = warnings.empty();  // each list with a value that is not finite has a warning
  core::Budget& budget = options.budget != nullptr ? *options.budget : own;
  auto out = compile_parts(dna, finite, options, budget, kept);
  if (!out) return core::Unexpected{out.error()};
  if (options.precision == Precision::kFloat16) return rig::make_rig(*out, *kernels);
  return rig::make_rig(*out, *kernels,
                       {kept.size, [&](std::span<float> values) { kept.write(values); }});
}

}  // namespace risorius::compile
