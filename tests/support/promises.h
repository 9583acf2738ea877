// SPDX-License-Identifier: MIT
// Promises of the native code about any bytes, as functions that fuzz targets and tests of hostile
// files share. Each function that returns a text returns the broken promise, or an empty text.
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

/// Checks that parsing gave a Dna, or an error with a field and an offset inside the file; the
/// error of an invalid argument needs neither.
std::string reading(View bytes, const core::Result<dna::Dna>& dna);

/// Checks that check() finds an error exactly if parse() fails (is_good is false), and that each
/// finding has a field and an offset inside the file.
std::string checking(View bytes, bool is_good);

/// Checks that a file written for version 2.`minor` can be read and written again without a change.
std::string rewriting(const dna::Dna& dna, std::uint16_t minor);

/// Checks that a conversion to JSON and back gives the same file and the same JSON.
std::string json(const dna::Dna& dna);

/// Checks that JSON text is refused with a field or an offset, or gives a Dna that does not change
/// when it is written and read again, as JSON and as a file of version 2.8.
std::string json_text(std::string_view text);

/// Compiles and evaluates in every way, with controls, options and a second instruction set drawn
/// from seed. Checks that results are finite if the numbers and controls are moderate, that the
/// instruction sets agree, that a frame of a batch equals the frame alone, and that the bytes of
/// the rig can be opened. A face that compile() refuses is accepted if the error has a field. The
/// meshes and the GUI controls must be safe to evaluate.
std::string evaluation(const dna::Dna& dna, std::uint32_t seed);

/// Corrects the hash of the bytes of a rig that a test changed, and checks that open_rig refuses
/// them or that they can be evaluated safely.
std::string opening(View bytes, std::uint32_t seed);

/// Number of bytes at the beginning of a fuzz input that select options; the rest is the file.
inline constexpr std::size_t kOptionBytes = 8;

/// Checks that loading some layers and LODs of a file gives the same Dna as loading everything and
/// then removing the other LODs and layers. Loading with limits, or from a source whose bytes
/// change, must only be safe.
/// In:  bytes  kOptionBytes bytes that select the layers, LODs, limits and source; then the file
std::string filtering(View bytes);

/// Checks that a conversion to the coordinates of the Dna changes no bit, that a Dna converted to
/// other coordinates can be written, and that a second conversion changes nothing. A refused
/// conversion must name a field.
/// In:  options  at least 7 bytes that select the axes, rotations, winding and units
std::string conversion(const dna::Dna& dna, View options);

/// Checks the promises of a file in one call. A file that can be parsed is written for its own
/// version and for one of 2.1 to 2.8, written as JSON, evaluated, filtered and converted; of any
/// other file the errors are checked. `turn` selects the second version and the options.
std::string everything(View bytes, std::size_t turn);

}  // namespace risorius::promises
