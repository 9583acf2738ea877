// SPDX-License-Identifier: MIT
// What the native code promises about any bytes, in functions that the fuzz targets and the tests
// of hostile files share. Each gives the promise that was broken, or an empty text.
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

/// A Dna, or an error with a field and an offset inside the file.
std::string reading(View bytes, const core::Result<dna::Dna>& dna);

/// check finds an error exactly when parse fails, and places all that it finds.
std::string checking(View bytes, bool is_good);

/// What is written for a version is read again and written as it was.
std::string rewriting(const dna::Dna& dna, std::uint16_t minor);

/// JSON and back writes the same bytes and the same JSON.
std::string json(const dna::Dna& dna);

/// Text that from_json accepts becomes the same JSON twice, and a file.
std::string json_text(std::string_view text);

/// Compiles and evaluates in every way, with controls, options and a second instruction set drawn
/// from seed: results are finite where the file's numbers and the controls are moderate, the
/// instruction sets agree, a frame of a batch is the frame alone, and the bytes of the rig are one.
std::string evaluation(const dna::Dna& dna, std::uint32_t seed);

/// Bytes that say that they are a compiled rig: open_rig refuses them, or they can be evaluated.
/// Their hash is put right first.
std::string opening(View bytes, std::uint32_t seed);

/// Options as the first 8 bytes say; the rest is the file.
inline constexpr std::size_t kOptionBytes = 8;

/// A load of some layers and LODs is the full load, filtered and without the other layers.
std::string filtering(View bytes);

/// The result can be written, and converting it once more changes nothing.
std::string conversion(const dna::Dna& dna, View options);

/// All of the above, for tests: written for its own version and for one of 2.1 to 2.8, evaluated,
/// filtered and converted with one choice; turn makes the choices.
std::string everything(View bytes, std::size_t turn);

}  // namespace risorius::promises
