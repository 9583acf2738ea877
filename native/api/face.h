// SPDX-License-Identifier: MIT
// The implementation of a risorius_face.
#pragma once

#include <memory>
#include <vector>

#include "api/risorius.h"
#include "dna/dna.h"
#include "rig/rig.h"

namespace risorius::api {

struct Face {
  rig::Rig rig;
  dna::Dna dna;                  // only descriptor, definition and geometry
  std::vector<bool> gui_writes;  // [raw controls]: whether the GUI table has a row for it
};

}  // namespace risorius::api

struct risorius_face {
  std::shared_ptr<const risorius::api::Face> face;
};
