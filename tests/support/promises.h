// SPDX-License-Identifier: MIT
// Promises of the native code about any bytes, as functions that fuzz targets and tests of hostile
// files share. Each returns the broken promise, or an empty text.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "dna/convert/coordinates.h"
#include "dna/file/parse.h"

namespace risorius::promises {

using Bytes = std::vector<std::uint8_t>;
using View = std::span<const std::uint8_t>;

core::Result<dna::Dna> parse(View bytes, const dna::ParseOptions& options = {});

/// Parsing gives a Dna, or an error with a field and an offset inside the file.
std::string reading(View bytes, const core::Result<dna::Dna>& dna);

/// check finds an error exactly if parse fails, and gives a place for every finding.
std::string checking(View bytes, bool is_good);

/// A file written for a version is read again and written without a change.
std::string rewriting(const dna::Dna& dna, std::uint16_t minor);

/// A conversion to JSON and back gives the same file and the same JSON.
std::string json(const dna::Dna& dna);

/// A Dna from JSON text can be written to a file, and its JSON is stable.
std::string json_text(std::string_view text);

/// Compiles and evaluates in every way, with controls, options and a second instruction set drawn
/// from seed. Results are finite if the file's numbers and the controls are moderate, the
/// instruction sets agree, a frame of a batch equals the frame alone, and the bytes of the rig can
/// be opened.
std::string evaluation(const dna::Dna& dna, std::uint32_t seed);

/// Bytes of a compiled rig with a corrected hash: open_rig refuses them, or they can be evaluated.
std::string opening(View bytes, std::uint32_t seed);

/// Number of bytes at the beginning of a fuzz input that select options; the rest is the file.
inline constexpr std::size_t kOptionBytes = 8;

/// A load of some layers and LODs equals the full load, filtered and without the other layers.
std::string filtering(View bytes);

/// A converted Dna can be written, and a second conversion changes nothing.
std::string conversion(const dna::Dna& dna, View options);

/// Checks the promises of a file in one call. A file that can be parsed is written for its own
/// version and for one of 2.1 to 2.8, evaluated, filtered and converted. turn selects the second
/// version and the options.
std::string everything(View bytes, std::size_t turn);

}  // namespace risorius::promises
