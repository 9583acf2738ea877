// SPDX-License-Identifier: MIT
// A compiled face in a file: a cache that saves compiling it again.
#pragma once

#include <filesystem>

#include "bytes/file_read.h"
#include "rig/rig.h"

namespace risorius::rig {

/// Who answers for the bytes of a file. They are offsets and indices that the evaluator follows
/// without a look, so somebody must.
enum class Trust {
  /// The user's own files get the check of the hash, all others the full one. Own is what this
  /// user owns and nobody else may write: whoever could change it could as well change the program.
  /// The owner does not say where the bytes came from: for what was downloaded or unpacked,
  /// kNobody. The hash finds damage; anybody can put a right one on bytes of his own.
  kOwner,
  kNobody,  // the full check
  kCaller,  // the check of the header: one flipped bit may end the process
};

/// Writes the block of a Rig so that an old file is whole until the new one is.
/// Fails: kIoWrite
core::Status save_rig(const Rig& rig, const std::filesystem::path& path);

/// A Rig from a file of save_rig. Messages begin with the path.
/// In:    by  kMap opens a large file at once where its bytes are trusted; others are copied,
///            since whoever can write to a mapped file can change it after the check
/// Fails: kIoOpen, kIoRead, and as open_rig
core::Result<Rig> open_rig_file(const std::filesystem::path& path, Trust trust, bytes::ReadBy by,
                                const simd::Kernels& kernels);

}  // namespace risorius::rig
