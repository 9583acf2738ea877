// SPDX-License-Identifier: MIT
// Prepares a skin for the search for faults, and finds and sums the faults of a pose.
#include "author/correctives/topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <span>

namespace risorius::author::detail {

namespace {

constexpr double kReach = 6.0;      // mm: a vertex deeper in a solid is inside for another reason
constexpr double kSkinReach = 4.0;  // mm, of the skin in itself
constexpr double kOpposed = -0.2;   // cosine: surfaces below it face each other
// mm: a vertex that is less than 0.2 mm behind a surface still counts as in front of this surface.
constexpr double kInFront = -0.2;
constexpr std::size_t kWays = 128;  // directions from which light may come
constexpr std::ptrdiff_t kLit = 6;  // open directions that make a vertex lit
constexpr std::size_t kRim = 2;     // edges: neighbours of lit vertices that are shown too
constexpr std::size_t kRings = 3;   // edges: vertices this near cannot touch each other

std::vector<Vec3> vertex_normals(std::span<const Triangle> triangles,
                                 std::span<const Vec3> positions) {
  std::vector<Vec3> out(positions.size(), Vec3::Zero());
  for (const Triangle& t : triangles) {
    const Vec3 normal =
        (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = positions[t[(k + 1) % 3]] - positions[t[k]];
      const Vec3 b = positions[t[(k + 2) % 3]] - positions[t[k]];
      out[t[k]] += std::atan2(a.cross(b).norm(), a.dot(b)) * normal;
    }
  }
  for (Vec3& n : out) n.normalize();
  return out;
}

void find_neighbours(Topology& out) {
  std::map<std::array<std::uint32_t, 2>, std::vector<std::uint32_t>> faces_of;
  std::vector<std::vector<std::uint32_t>> near(out.neutral.size());
  for (std::uint32_t f = 0; f < out.face_count(); ++f) {
    const std::uint32_t begin = out.skin.face_offsets[f], end = out.skin.face_offsets[f + 1];
    for (std::uint32_t c = begin; c < end; ++c) {
      std::uint32_t a = out.skin.corners[c], b = out.skin.corners[c + 1 == end ? begin : c + 1];
      if (a == b) continue;
      near[a].push_back(b);
      near[b].push_back(a);
      faces_of[{std::min(a, b), std::max(a, b)}].push_back(f);
    }
  }
  for (const auto& [edge, faces] : faces_of) {
    if (faces.size() == 2 && faces[0] != faces[1]) {
      out.hinges.push_back({{faces[0], faces[1]}, edge});
    }
  }
  out.first_neighbour.push_back(0);
  for (auto& row : near) {
    std::ranges::sort(row);
    row.erase(std::unique(row.begin(), row.end()), row.end());
    out.neighbours.insert(out.neighbours.end(), row.begin(), row.end());
    out.first_neighbour.push_back(static_cast<std::uint32_t>(out.neighbours.size()));
  }
}

void find_around(Topology& out) {
  out.around.resize(out.neutral.size());
  for (std::uint32_t v = 0; v < out.neutral.size(); ++v) {
    std::vector<std::uint32_t>& ring = out.around[v];
    ring.push_back(v);
    std::size_t begin = 0;
    for (std::size_t r = 0; r < kRings; ++r) {
      const std::size_t end = ring.size();
      for (std::size_t i = begin; i < end; ++i) {
        for (std::uint32_t n = out.first_neighbour[ring[i]]; n < out.first_neighbour[ring[i] + 1];
             ++n) {
          const std::uint32_t next = out.neighbours[n];
          if (std::ranges::find(ring, next) == ring.end()) ring.push_back(next);
        }
      }
      begin = end;
    }
    std::ranges::sort(ring);
  }
}

/// Sets out.shown: the vertices that light reaches in the neutral pose, and the vertices at most
/// kRim edges from them, which are the rims of lips and lids.
void find_shown(Topology& out) {
  std::vector<Vec3> ways;  // spread evenly (Fibonacci)
  for (std::size_t i = 0; i < kWays; ++i) {
    const double y = 1.0 - (2.0 * double(i) + 1.0) / double(kWays), r = std::sqrt(1.0 - y * y);
    const double turn = 2.399963229728653 * double(i) + 0.1;
    ways.emplace_back(r * std::cos(turn), y, r * std::sin(turn));
  }
  const std::vector<Vec3> normals = vertex_normals(out.triangles, out.neutral);
  const Nearest surface(out.triangles, out.neutral);
  std::vector<bool> lit(out.neutral.size(), false);
  for (std::size_t v = 0; v < lit.size(); ++v) {
    const Vec3 from = out.neutral[v] + 0.05 * normals[v];
    const auto open = std::ranges::count_if(ways, [&](const Vec3& way) {
      return way.dot(normals[v]) > 0.1 && !surface.is_blocked(from, way);
    });
    lit[v] = open >= kLit;  // a slit between closed lips lets light through
  }
  out.shown = lit;
  for (std::size_t r = 0; r < kRim; ++r) {
    const std::vector<bool> before = out.shown;
    for (std::size_t v = 0; v < lit.size(); ++v) {
      for (std::uint32_t n = out.first_neighbour[v]; n < out.first_neighbour[v + 1]; ++n) {
        if (before[out.neighbours[n]]) out.shown[v] = true;
      }
    }
  }
}

/// Stores a contact, unless `best` already has a deeper contact of the same vertex.
void keep_deeper(std::vector<Contact>& best, const Contact& found) {
  if (found.depth > best[found.vertex].depth) best[found.vertex] = found;
}

void touch_solid(const Topology& topology, const Region& region, std::size_t number,
                 const SolidSurfaces& solids, const std::vector<Vec3>& skin,
                 std::vector<Contact>& best) {
  const Skin::Solid& solid = topology.skin.solids[number];
  if (solid.triangles.empty()) return;
  const std::vector<Vec3>& normals = solids.normals[number];
  const Nearest& nearest = solids.trees[number];
  for (const std::uint32_t v : region.vertices) {
    const Vec3& p = skin[v];
    const auto hit = nearest.find(p, kReach, [](std::uint32_t) { return true; });
    if (!hit) continue;
    Vec3 normal = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      normal +=
          hit->share[static_cast<Eigen::Index>(k)] * normals[solid.triangles[hit->triangle][k]];
    }
    if ((p - hit->point).dot(normal) >= 0.0) continue;
    // The vertex has to leave the solid towards the nearest point of the solid's surface. At
    // distance 0 this direction is undefined, so the normal of the surface replaces it.
    const Vec3 out = hit->point - p;
    keep_deeper(best, {v,
                       static_cast<float>(hit->distance),
                       hit->distance > 1e-9 ? Vec3(out / hit->distance) : normal.normalized(),
                       false,
                       {},
                       Vec3::Zero()});
  }
}

/// Finds contacts of the skin with itself, for example of the upper lip with the lower lip. A
/// triangle is left out if the vertex is behind it in the neutral pose already, because the skin is
/// thin there.
void touch_skin(const Topology& topology, const Region& region, const std::vector<Vec3>& skin,
                std::vector<Contact>& best) {
  const std::vector<Vec3> normals = vertex_normals(region.triangles, skin);
  const Nearest nearest(region.triangles, skin);
  for (const std::uint32_t v : region.vertices) {
    // A vertex at its neutral position needs no check: if other skin moves into this vertex, the
    // check of the moved vertices finds the contact.
    if ((skin[v] - topology.neutral[v]).squaredNorm() < 1e-4) continue;
    const auto& near = topology.around[v];
    const auto takes = [&](std::uint32_t t) {
      const Triangle& corners = region.triangles[t];
      for (const std::uint32_t c : corners) {
        if (std::ranges::binary_search(near, c)) return false;
      }
      const Vec3 facing =
          (skin[corners[1]] - skin[corners[0]]).cross(skin[corners[2]] - skin[corners[0]]);
      if (facing.dot(normals[v]) > kOpposed * facing.norm()) return false;
      const Vec3 before = topology.neutral[v] - topology.neutral[corners[0]];
      return before.dot(topology.triangle_normals[region.numbers[t]]) > kInFront;
    };
    const auto hit = nearest.find(skin[v], kSkinReach, takes);
    if (!hit) continue;
    const Triangle& other = region.triangles[hit->triangle];
    const Vec3 normal =
        (skin[other[1]] - skin[other[0]]).cross(skin[other[2]] - skin[other[0]]).normalized();
    const double depth = (hit->point - skin[v]).dot(normal);
    // If the nearest point is on the rim of the triangle and the vertex lies to the side of the
    // triangle, the triangle's normal does not show whether the vertex is inside the skin.
    if (depth < 0.7 * hit->distance || depth <= 0.0) continue;
    keep_deeper(best, {v, static_cast<float>(depth), normal, true, other, hit->share});
  }
}

}  // namespace

Topology make_topology(Skin skin) {
  Topology out;
  out.skin = std::move(skin);
  for (const Vector3& p : out.skin.neutral) {
    out.neutral.emplace_back(out.skin.mm * Vec3(p[0], p[1], p[2]));
  }
  for (std::uint32_t f = 0; f < out.face_count(); ++f) {
    const std::uint32_t begin = out.skin.face_offsets[f], end = out.skin.face_offsets[f + 1];
    for (std::uint32_t c = begin + 2; c < end; ++c) {
      out.triangles.push_back(
          {out.skin.corners[begin], out.skin.corners[c - 1], out.skin.corners[c]});
      out.face_of.push_back(f);
    }
  }
  find_neighbours(out);
  find_around(out);
  out.vertex_areas.assign(out.neutral.size(), 0.0);
  for (const Triangle& t : out.triangles) {
    const Vec3 normal =
        (out.neutral[t[1]] - out.neutral[t[0]]).cross(out.neutral[t[2]] - out.neutral[t[0]]);
    for (const std::uint32_t corner : t) out.vertex_areas[corner] += normal.norm() / 6.0;
    out.triangle_normals.push_back(normal.normalized());
  }
  std::vector<Vec3> normals;
  face_shapes(out, out.neutral, out.face_areas, normals);
  find_shown(out);
  out.whole = whole_region(out);
  return out;
}

Region whole_region(const Topology& topology) {
  Region out;
  for (std::uint32_t v = 0; v < topology.neutral.size(); ++v) {
    if (topology.shown[v]) out.vertices.push_back(v);
  }
  out.triangles = topology.triangles;
  out.numbers.resize(out.triangles.size());
  std::iota(out.numbers.begin(), out.numbers.end(), 0u);
  return out;
}

Region region_around(const Topology& topology, const Placed& pose,
                     const std::vector<std::uint32_t>& vertices) {
  Region out;
  Eigen::AlignedBox3d box;
  for (const std::uint32_t v : vertices) {
    if (topology.shown[v]) out.vertices.push_back(v);
    box.extend(pose.skin[v]);
    box.extend(topology.neutral[v]);
  }
  const Vec3 margin = Vec3::Constant(2.0 * kReach);
  box = {box.min() - margin, box.max() + margin};
  for (std::uint32_t t = 0; t < topology.triangles.size(); ++t) {
    const Triangle& corners = topology.triangles[t];
    if (!std::ranges::any_of(corners, [&](auto c) { return box.contains(pose.skin[c]); })) continue;
    out.triangles.push_back(corners);
    out.numbers.push_back(t);
  }
  return out;
}

SolidSurfaces::SolidSurfaces(const Topology& topology, const Placed& pose) {
  for (std::size_t s = 0; s < pose.solids.size(); ++s) {
    const std::vector<Triangle>& triangles = topology.skin.solids[s].triangles;
    normals.push_back(vertex_normals(triangles, pose.solids[s]));
    trees.emplace_back(triangles, pose.solids[s]);
  }
}

std::vector<Contact> find_contacts(const Topology& topology, const Region& region,
                                   const SolidSurfaces& solids, const std::vector<Vec3>& skin) {
  std::vector<Contact> best(topology.neutral.size());
  for (std::size_t s = 0; s < solids.trees.size(); ++s) {
    touch_solid(topology, region, s, solids, skin, best);
  }
  touch_skin(topology, region, skin, best);
  std::erase_if(best, [](const Contact& c) { return !(c.depth > 0.0f); });
  return best;
}

void face_shapes(const Topology& topology, const std::vector<Vec3>& positions,
                 std::vector<double>& areas, std::vector<Vec3>& normals) {
  areas.assign(topology.face_count(), 0.0);
  normals.assign(topology.face_count(), Vec3::Zero());
  for (std::size_t i = 0; i < topology.triangles.size(); ++i) {
    const Triangle& t = topology.triangles[i];
    const Vec3 normal =
        (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]) / 2.0;
    areas[topology.face_of[i]] += normal.norm();
    normals[topology.face_of[i]] += normal;
  }
  for (Vec3& n : normals) n.normalize();
}

SkinFaults find_faults(const Topology& topology, const std::vector<Vec3>& skin,
                       const std::vector<Contact>& contacts) {
  SkinFaults out;
  out.depth.assign(topology.neutral.size(), 0.0f);
  for (const Contact& c : contacts) out.depth[c.vertex] = c.depth;
  std::vector<double> areas;
  std::vector<Vec3> normals;
  face_shapes(topology, skin, areas, normals);
  for (std::size_t f = 0; f < areas.size(); ++f) {
    const double before = std::max(topology.face_areas[f], 1e-6);
    out.stretch.push_back(static_cast<float>(areas[f] / before));
  }
  for (const Hinge& h : topology.hinges) {
    out.fold.push_back(static_cast<float>(normals[h.faces[0]].dot(normals[h.faces[1]])));
  }
  return out;
}

FaultSums sum_faults(const Topology& topology, const SkinFaults& faults,
                     const SkinFaults& allowed) {
  FaultSums out;
  for (std::size_t v = 0; v < faults.depth.size(); ++v) {
    if (!is_deep(faults, allowed, v)) continue;
    const double beyond = double{faults.depth[v]} - double{allowed.depth[v]};
    out.volume += beyond * topology.vertex_areas[v];
    out.deepest = std::max(out.deepest, beyond);
  }
  for (std::size_t f = 0; f < faults.stretch.size(); ++f) {
    if (!is_stretched(topology, faults, allowed, f)) continue;
    ++out.stretched;
    out.widest = std::max(out.widest, double{faults.stretch[f]});
  }
  for (std::size_t h = 0; h < faults.fold.size(); ++h) {
    out.folded += is_folded(faults, allowed, h);
  }
  return out;
}

}  // namespace risorius::author::detail
