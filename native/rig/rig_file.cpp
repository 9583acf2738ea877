// SPDX-License-Identifier: MIT
// Saves a Rig (a compiled face) to a file, and opens it with the check that the trust in the file's
// writer demands.
#include "rig/rig_file.h"

#include "bytes/file_write.h"
#include "bytes/path_text.h"
#include "rig/block.h"

namespace risorius::rig {

core::Status save_rig(const Rig& rig, const std::filesystem::path& path) {
  return bytes::write_file_atomically(path, rig.block());
}

core::Result<Rig> open_rig_file(const std::filesystem::path& path, Trust trust, bytes::ReadBy by,
                                const simd::Kernels& kernels) {
  if (trust == Trust::kNobody) by = bytes::ReadBy::kCopy;
  auto file = bytes::read_file(path, by);
  const auto trusted = [&] {
    return trust == Trust::kCaller || (trust == Trust::kOwner && file->is_own);
  };
  if (file && by == bytes::ReadBy::kMap && !trusted()) file = bytes::read_file(path);
  if (!file) return std::move(file).propagate();
  // A faulty disk may have changed a bit of any file. The hash is therefore skipped only if the
  // caller guarantees the bytes.
  const BlockCheck own = trust == Trust::kCaller ? BlockCheck::kHeader : BlockCheck::kHash;
  const BlockCheck check = trusted() ? own : BlockCheck::kFull;
  auto rig = open_rig(file->bytes, file->owner, check, kernels);
  if (rig) return rig;
  core::Error error = rig.error();
  error.message = bytes::utf8(path) + ": " + error.message;
  return core::Unexpected{std::move(error)};
}

}  // namespace risorius::rig
