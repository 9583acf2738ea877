// SPDX-License-Identifier: MIT
// A compiled face in a file: a cache that saves compiling it again.
#pragma once

#include <filesystem>

#include "bytes/file_read.h"
#include "rig/rig.h"

namespace risorius::rig {

/// How far the bytes of a file are trusted. The evaluator uses their offsets and indices without a
/// check.
enum class Trust {
  /// The hash of the user's own files is checked, and every index of all other files. A file is the
  /// user's own if the user owns it and nobody else may write to it: anyone who could change it
  /// could also change the program. Use kNobody for downloaded or unpacked files, because the user
  /// owns these as well. The hash finds damage but no forgery, because anybody can compute it.
  kOwner,
  kNobody,  // the full check
  kCaller,  // only the check of the header: one changed bit may crash the process
};

/// Writes the block of a Rig to a file. An old file is replaced only when the new one is complete.
/// Fails: kIoWrite
core::Status save_rig(const Rig& rig, const std::filesystem::path& path);

/// Opens a Rig from a file of save_rig. Error messages contain the path.
/// In:    by  kMap maps a file instead of copying it, if its bytes are trusted (kOwner reads it
///            once for the hash). Other files are copied, because anyone who can write to a mapped
///            file can change it after the check.
/// Fails: kIoOpen, kIoRead, and as open_rig
core::Result<Rig> open_rig_file(const std::filesystem::path& path, Trust trust, bytes::ReadBy by,
                                const simd::Kernels& kernels);

}  // namespace risorius::rig
