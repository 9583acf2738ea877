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
  dna::Dna dna;                  // without the layers that only the compilation needs
  std::vector<bool> gui_writes;  // [raw controls] whether a GUI control drives the raw control
};

}  // namespace risorius::api

struct risorius_face {
  std::shared_ptr<const risorius::api::Face> face;
};
