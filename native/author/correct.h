// SPDX-License-Identifier: MIT
// What goes wrong where expressions meet, and the least motion that repairs it.
//
// Sources: Bouaziz, Martin, Liu, Kavan and Pauly, "Projective Dynamics" (2014): what a vertex is
// asked for is a place that is found anew in each round, and one sparse system makes all agree;
// Sorkine et al., "Laplacian Surface Editing" (2004): what is asked for nothing goes along softly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "author/shapes.h"
#include "author/simplify.h"
#include "core/result.h"

namespace risorius::author {

/// A skin of polygons, and the surfaces that it must not go into, such as teeth and eyes.
struct Skin {
  struct Solid {
    std::vector<Triangle> triangles;  // outwards: counter-clockwise
    std::size_t vertices = 0;
  };
  std::vector<Vector3> neutral;             // [V]
  std::vector<std::uint32_t> face_offsets;  // [F + 1] of corners
  std::vector<std::uint32_t> corners;       // vertices, outwards: counter-clockwise
  std::vector<Solid> solids;
  double mm = 10.0;  // of one unit of the positions
};

/// Where a skin and its solids lie.
struct SkinPose {
  std::vector<Vector3> skin;                 // [V]
  std::vector<std::vector<Vector3>> solids;  // [solids][vertices]
};

/// What may be wrong with a pose. Of two poses the worse of each entry is what both have.
struct SkinFaults {
  std::vector<float> depth;    // [V] mm inside of a solid, or of the skin itself; 0: outside
  std::vector<float> stretch;  // [F] area beside the neutral one
  std::vector<float> fold;     // [inner edges] cosine between the normals of both faces
};

/// What is worse than allowed, in one number of each kind.
struct FaultSums {
  double volume = 0.0;        // mm3: depth times area
  double deepest = 0.0;       // mm beyond what is allowed
  std::size_t stretched = 0;  // faces of more than kStretch times their area
  double widest = 0.0;        // times its area, of the most stretched of these
  std::size_t folded = 0;     // edges whose faces lie on one another
};

struct Repair {
  std::vector<Vector3> displacement;  // [V] to be added to the pose; all 0: nothing helps
  FaultSums before, after;
};

class SkinChecker {
 public:
  static constexpr float kDepth = 0.1f;    // mm beyond what is allowed that are left alone
  static constexpr float kStretch = 2.5f;  // times the neutral area
  static constexpr float kFold = -0.2f;    // cosine of two faces that lie on one another
  static constexpr double kAround = 10.0;  // mm around a fault that belong to it

  /// Fails: kInvalidIndex (a corner), kInvalidLength (offsets), kInvalidValue (not finite)
  static core::Result<SkinChecker> make(Skin skin);
  ~SkinChecker();
  SkinChecker(SkinChecker&&) noexcept;
  SkinChecker& operator=(SkinChecker&&) noexcept;

  /// The nearest place of the neutral skin.
  struct Place {
    Triangle corners{};
    Vector3 shares{};       // of the corners, sum 1
    double distance = 0.0;  // mm
  };
  /// In: points   in the skin's unit
  ///     normals  of the points: only what looks the same way is taken, so that a lip is not the
  ///              other one; empty: anything
  /// Fails: kInvalidValue (not finite), kInvalidLength (normals)
  core::Result<std::vector<Place>> nearest(const std::vector<Vector3>& points,
                                           const std::vector<Vector3>& normals = {}) const;
  /// [V] what somebody may see: nothing else is asked to stay outside of solids.
  const std::vector<bool>& shown() const;
  /// Fails: kInvalidLength, kInvalidValue (a pose that does not fit, or is not finite)
  core::Result<SkinFaults> look(const SkinPose& pose) const;
  /// In: allowed  of the same skin; what is no worse is no fault
  /// Fails: kInvalidLength (of another skin)
  core::Result<FaultSums> sum(const SkinFaults& faults, const SkinFaults& allowed) const;
  /// A motion after which the pose has no faults beyond `allowed`, or fewer. No sum is worse
  /// afterwards, nor the deepest place of all by 0.1 mm or the widest face by 1 %, allowed ones
  /// too. Near faults alone (kAround) parts of the pose are undone, those first that do little
  /// there; what that leaves is pushed out softly. Vertices without a fault keep nine tenths of
  /// their ways, unless that would bring a fault. In: without  [parts][V] where the skin lies
  /// without each part of the pose Fails: as look
  core::Result<Repair> repair(const SkinPose& pose, const SkinFaults& allowed,
                              const std::vector<std::vector<Vector3>>& without) const;

 private:
  struct Impl;
  explicit SkinChecker(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::author
