// SPDX-License-Identifier: MIT
// A skin with what is computed of it once. Private to native/author.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "author/correct.h"
#include "author/correctives/nearest.h"

namespace risorius::author::detail {

/// Two faces at an edge.
struct Hinge {
  std::array<std::uint32_t, 2> faces;
  std::array<std::uint32_t, 2> edge;
};

/// What of a skin is looked at, and what it may touch there.
struct Region {
  std::vector<std::uint32_t> vertices;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> numbers;  // of these triangles among all
};

struct Topology {
  Skin skin;
  std::vector<Vec3> neutral;           // [V] mm
  std::vector<Triangle> triangles;     // fans of the faces
  std::vector<std::uint32_t> face_of;  // [triangles]
  std::vector<Hinge> hinges;           // inner edges
  std::vector<double> face_areas;      // [F] mm2, neutral
  std::vector<double> vertex_areas;    // [V] mm2, neutral
  std::vector<Vec3> triangle_normals;  // [triangles], neutral
  Region whole;                        // all that is shown
  std::vector<bool> shown;             // [V] what somebody may see: no mouth from inside
  std::vector<std::uint32_t> first_neighbour, neighbours;  // of vertices, rows of a CSR matrix
  std::vector<std::vector<std::uint32_t>> around;  // [V] vertices up to three edges away, sorted

  std::size_t face_count() const { return skin.face_offsets.size() - 1; }
};

Topology make_topology(Skin skin);

/// Where the skin touches something: it is to go by `amount` along `normal`, and what it touches,
/// where that is skin too, the other way.
struct Contact {
  std::uint32_t vertex = 0;
  float depth = 0.0f;  // mm
  Vec3 normal = Vec3::Zero();
  bool is_skin = false;
  Triangle other{};  // of the skin
  Vec3 share = Vec3::Zero();
};

/// A pose in millimetres.
struct Placed {
  std::vector<Vec3> skin;
  std::vector<std::vector<Vec3>> solids;
};

/// The solids of a pose, ready to be asked what is nearest. They keep what they are made of, not a
/// copy: topology and pose live longer.
class SolidSurfaces {
 public:
  SolidSurfaces(const Topology& topology, const Placed& pose);
  std::vector<std::vector<Vec3>> normals;  // [solids][vertices]
  std::vector<Nearest> trees;              // [solids]
};

/// All that is shown.
Region whole_region(const Topology& topology);
/// Some vertices, and the triangles that lie near them in a pose.
Region region_around(const Topology& topology, const Placed& pose,
                     const std::vector<std::uint32_t>& vertices);

/// Every vertex of a region that lies inside of something, by what it is deepest in.
std::vector<Contact> find_contacts(const Topology& topology, const Region& region,
                                   const SolidSurfaces& solids, const std::vector<Vec3>& skin);

/// [F] areas, and [F] normals.
void face_shapes(const Topology& topology, const std::vector<Vec3>& positions,
                 std::vector<double>& areas, std::vector<Vec3>& normals);

SkinFaults find_faults(const Topology& topology, const std::vector<Vec3>& skin,
                       const std::vector<Contact>& contacts);

FaultSums sum_faults(const Topology& topology, const SkinFaults& faults, const SkinFaults& allowed);

/// Which of all are faults beyond what is allowed.
inline bool is_deep(const SkinFaults& f, const SkinFaults& allowed, std::size_t v) {
  return f.depth[v] > allowed.depth[v] + SkinChecker::kDepth;
}
inline bool is_stretched(const Topology& t, const SkinFaults& f, const SkinFaults& allowed,
                         std::size_t face) {
  constexpr double kSmallest = 0.5;  // mm2: what nobody sees
  return f.stretch[face] > SkinChecker::kStretch && f.stretch[face] > allowed.stretch[face] &&
         t.face_areas[face] > kSmallest;
}
inline bool is_folded(const SkinFaults& f, const SkinFaults& allowed, std::size_t hinge) {
  return f.fold[hinge] < SkinChecker::kFold && allowed.fold[hinge] >= SkinChecker::kFold;
}

/// In: without  where the skin lies without each of the pose's parts
Repair repair_pose(const Topology& topology, const Placed& pose, const SkinFaults& allowed,
                   const std::vector<std::vector<Vec3>>& without);

}  // namespace risorius::author::detail
