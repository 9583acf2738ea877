// SPDX-License-Identifier: MIT
// Faults of the skin in poses that combine expressions, and the smallest motion that repairs them.
//
// Sources: Bouaziz, Martin, Liu, Kavan and Pauly, "Projective Dynamics" (2014): each round finds a
// new goal for each faulty vertex, and one sparse system joins all goals; Sorkine et al.,
// "Laplacian Surface Editing" (2004): vertices without a goal follow softly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "author/shapes.h"
#include "author/simplify.h"
#include "core/result.h"

namespace risorius::author {

/// A skin of polygons, and the solids that it must not enter, such as teeth and eyes.
struct Skin {
  struct Solid {
    std::vector<Triangle> triangles;  // outwards: counter-clockwise
    std::size_t vertices = 0;
  };
  std::vector<Vector3> neutral;             // [V]
  std::vector<std::uint32_t> face_offsets;  // [F + 1] offsets into corners
  std::vector<std::uint32_t> corners;       // vertices, counter-clockwise seen from outside
  std::vector<Solid> solids;
  double mm = 10.0;  // millimetres in one unit of the positions
};

/// The positions of a skin and its solids.
struct SkinPose {
  std::vector<Vector3> skin;                 // [V]
  std::vector<std::vector<Vector3>> solids;  // [solids][vertices]
};

/// The faults of a pose. To merge the faults of two poses, take for each vertex the larger depth,
/// for each face the larger stretch, and for each edge the smaller fold.
struct SkinFaults {
  // [V] depth of a vertex in mm inside a solid or inside the skin; 0 if it is outside, cannot be
  // seen, or is deeper than 6 mm in a solid or 4 mm in the skin.
  std::vector<float> depth;
  std::vector<float> stretch;  // [F] area divided by the neutral area
  std::vector<float> fold;     // [edges of two faces] cosine between the normals of the two faces
};

/// Sizes and numbers of the faults that are worse than the allowed faults.
struct FaultSums {
  double volume = 0.0;        // mm3: sum of depth beyond the allowed depth times the vertex's area
  double deepest = 0.0;       // mm, the largest depth beyond the allowed depth
  std::size_t stretched = 0;  // faces of more than kStretch times their neutral area
  double widest = 0.0;        // area divided by the neutral area, of the most stretched of them
  std::size_t folded = 0;     // edges whose two faces lie on each other
};

struct Repair {
  std::vector<Vector3> displacement;  // [V] to be added to the pose; all 0 if nothing helps
  FaultSums before, after;
};

class SkinChecker {
 public:
  static constexpr float kDepth = 0.1f;    // mm beyond the allowed depth that are ignored
  static constexpr float kStretch = 2.5f;  // times the neutral area
  static constexpr float kFold = -0.2f;    // cosine below which two faces lie on each other
  static constexpr double kAround = 10.0;  // mm around a fault in which vertices may move

  /// Checks a skin and prepares it for the search for faults.
  /// Fails: kInvalidIndex (a vertex of a corner or of a solid's triangle), kInvalidLength (offsets,
  ///        no face), kInvalidValue (`neutral` or `mm`)
  static core::Result<SkinChecker> make(Skin skin);
  ~SkinChecker();
  SkinChecker(SkinChecker&&) noexcept;
  SkinChecker& operator=(SkinChecker&&) noexcept;

  /// A point on the neutral skin.
  struct Place {
    Triangle corners{};
    Vector3 shares{};       // barycentric coordinates, sum 1
    double distance = 0.0;  // mm
  };
  /// The nearest points of the neutral skin.
  /// In: points   in the skin's unit
  ///     normals  of the points: only triangles with a similar normal (cosine above 0.3) are
  ///              searched, so that the upper lip is not mistaken for the lower one; all triangles
  ///              are searched if none has a similar normal, or if `normals` is empty
  /// Fails: kInvalidValue (not finite), kInvalidLength (normals)
  core::Result<std::vector<Place>> nearest(const std::vector<Vector3>& points,
                                           const std::vector<Vector3>& normals = {}) const;
  /// [V] whether a vertex can be seen. Only these vertices have to stay outside of solids.
  const std::vector<bool>& shown() const;
  /// Finds the faults of a pose.
  /// Fails: kInvalidLength (numbers of vertices or solids), kInvalidValue (not finite)
  core::Result<SkinFaults> look(const SkinPose& pose) const;
  /// Sums the faults beyond the allowed ones.
  /// In: allowed  faults of the same skin; an entry of `faults` that is no worse than the allowed
  ///              entry, or a depth that is at most kDepth worse, does not count
  /// Fails: kInvalidLength (faults of another skin)
  core::Result<FaultSums> sum(const SkinFaults& faults, const SkinFaults& allowed) const;
  /// A displacement of the vertices that removes all faults beyond `allowed`, or as many as
  /// possible. No sum of faults becomes worse. The deepest vertex becomes at most 0.1 mm deeper and
  /// the most stretched face at most 1 % wider, allowed faults included.
  ///
  /// Only vertices within kAround of a fault move. There the motion of parts of the pose is taken
  /// back: of a mix that prefers the parts that move a vertex least, of each part alone, and of the
  /// mean of all parts; the way that changes the pose least is kept. A least squares solve removes
  /// the remaining faults. Vertices without a fault keep nine tenths of their motion, unless that
  /// would cause a fault.
  /// In: without  [parts][V] the positions of the skin without each part of the pose, such as one
  ///              of its expressions
  /// Fails: as look
  core::Result<Repair> repair(const SkinPose& pose, const SkinFaults& allowed,
                              const std::vector<std::vector<Vector3>>& without) const;

 private:
  struct Impl;
  explicit SkinChecker(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace risorius::author
