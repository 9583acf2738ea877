// SPDX-License-Identifier: MIT
// A skin with the data that are computed from it only once, for all poses. Private to
// native/author.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "author/correct.h"
#include "author/correctives/nearest.h"

namespace risorius::author::detail {

/// Two faces and the edge that they share.
struct Hinge {
  std::array<std::uint32_t, 2> faces;
  std::array<std::uint32_t, 2> edge;
};

/// The vertices of a skin that are checked, and the triangles that they may touch.
struct Region {
  std::vector<std::uint32_t> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> numbers;  // of the triangles, in Topology::triangles
};

struct Topology {
  Skin skin;
  std::vector<Vec3> neutral;           // [V] mm
  std::vector<Triangle> triangles;     // fans of the faces
  std::vector<std::uint32_t> face_of;  // [triangles] index of the face of a triangle
  std::vector<Hinge> hinges;           // inner edges
  std::vector<double> face_areas;      // [F] mm2, neutral
  std::vector<double> vertex_areas;    // [V] mm2, neutral
  std::vector<Vec3> triangle_normals;  // [triangles], neutral
  Region whole;                        // all shown vertices, all triangles
  std::vector<bool> shown;             // [V] can be seen from outside; false inside the mouth
  std::vector<std::uint32_t> first_neighbour, neighbours;  // of vertices, rows of a CSR matrix
  std::vector<std::vector<std::uint32_t>> around;  // [V] vertices up to three edges away, sorted

  std::size_t face_count() const { return skin.face_offsets.size() - 1; }
};

Topology make_topology(Skin skin);

/// A vertex that lies inside a solid or inside the skin. It has to move by `depth` along `normal`;
/// skin that it touches has to move the other way.
struct Contact {
  std::uint32_t vertex = 0;
  float depth = 0.0f;  // mm
  Vec3 normal = Vec3::Zero();
  bool is_skin = false;       // inside the skin, not inside a solid
  Triangle other{};           // if is_skin: vertices of the touched triangle of the skin
  Vec3 share = Vec3::Zero();  // if is_skin: barycentric coordinates of the touched point
};

/// The positions of a skin and its solids in one pose, in mm.
struct Placed {
  std::vector<Vec3> skin;
  std::vector<std::vector<Vec3>> solids;
};

/// The solids of a pose, each with a search tree. The trees refer to `topology` and `pose`; both
/// must outlive this object.
class SolidSurfaces {
 public:
  SolidSurfaces(const Topology& topology, const Placed& pose);
  std::vector<std::vector<Vec3>> normals;  // [solids][vertices]
  std::vector<Nearest> trees;              // [solids]
};

/// The region of all vertices that can be seen, and all triangles.
Region whole_region(const Topology& topology);
/// The region around vertices: those of the vertices that can be seen, and the triangles with a
/// corner in the bounding box of the vertices or at most 12 mm outside of it. Box and corners are
/// in the pose.
Region region_around(const Topology& topology, const Placed& pose,
                     const std::vector<std::uint32_t>& vertices);

/// The vertices of a region that lie inside a solid or the skin, each with its deepest contact.
std::vector<Contact> find_contacts(const Topology& topology, const Region& region,
                                   const SolidSurfaces& solids, const std::vector<Vec3>& skin);

/// Computes the areas and normals of all faces.
/// Out: areas [F] in mm2, normals [F]
void face_shapes(const Topology& topology, const std::vector<Vec3>& positions,
                 std::vector<double>& areas, std::vector<Vec3>& normals);

SkinFaults find_faults(const Topology& topology, const std::vector<Vec3>& skin,
                       const std::vector<Contact>& contacts);

FaultSums sum_faults(const Topology& topology, const SkinFaults& faults, const SkinFaults& allowed);

/// Whether vertex v is deeper than allowed by more than SkinChecker::kDepth.
inline bool is_deep(const SkinFaults& f, const SkinFaults& allowed, std::size_t v) {
  return f.depth[v] > allowed.depth[v] + SkinChecker::kDepth;
}
/// Whether a face is large enough to be seen, and is stretched more than SkinChecker::kStretch and
/// more than allowed.
inline bool is_stretched(const Topology& t, const SkinFaults& f, const SkinFaults& allowed,
                         std::size_t face) {
  constexpr double kSmallest = 0.5;  // mm2: a smaller face cannot be seen
  return f.stretch[face] > SkinChecker::kStretch && f.stretch[face] > allowed.stretch[face] &&
         t.face_areas[face] > kSmallest;
}
/// Whether the two faces at an edge lie on each other (the cosine between their normals is below
/// SkinChecker::kFold) in `f`, but not in `allowed`.
inline bool is_folded(const SkinFaults& f, const SkinFaults& allowed, std::size_t hinge) {
  return f.fold[hinge] < SkinChecker::kFold && allowed.fold[hinge] >= SkinChecker::kFold;
}

/// Finds a displacement of the vertices that removes the faults of a pose beyond `allowed`, or as
/// many as possible; see SkinChecker::repair.
/// In: without  [parts][V] mm, the positions of the skin without each of the pose's parts
Repair repair_pose(const Topology& topology, const Placed& pose, const SkinFaults& allowed,
                   const std::vector<std::vector<Vec3>>& without);

}  // namespace risorius::author::detail
