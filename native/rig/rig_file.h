// SPDX-License-Identifier: MIT
// A compiled face in a file: a cache that saves compiling it again.
#pragma once

#include <filesystem>

#include "bytes/file_read.h"
#include "rig/rig.h"

namespace risorius::rig {

/// Who vouches for the bytes of a file. The evaluator follows its offsets and indices without a
/// check.
enum class Trust {
  /// The user's own files get the check of the hash, all others the full check. A file is the
  /// user's own if the user owns it and nobody else may write to it: anyone who could change it
  /// could also change the program. Use kNobody for downloaded or unpacked files, because their
  /// owner is the user as well. The hash finds damage, not forgery: anybody can compute it.
  kOwner,
  kNobody,  // the full check
  kCaller,  // only the check of the header: one changed bit may crash the process
};

/// Writes the block of a Rig to a file. The old file stays whole until the new one is.
/// Fails: kIoWrite
core::Status save_rig(const Rig& rig, const std::filesystem::path& path);

/// Opens a Rig from a file of save_rig. Error messages begin with the path.
/// In:    by  kMap opens a large file without reading it, if its bytes are trusted. Other files are
///            copied, because whoever can write to a mapped file can change it after the check.
/// Fails: kIoOpen, kIoRead, and as open_rig
core::Result<Rig> open_rig_file(const std::filesystem::path& path, Trust trust, bytes::ReadBy by,
                                const simd::Kernels& kernels);

}  // namespace risorius::rig
