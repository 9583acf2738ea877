// SPDX-License-Identifier: MIT
#include "register/matching/rims.h"

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numeric>

namespace risorius::registering::steps {

namespace {

constexpr double kStep = 1.5;        // mm between places of a border
constexpr double kTurn = 15.0;       // mm that a difference of 1 of outward directions counts
constexpr double kSameWay = 0.6;     // least cosine between the outward directions
constexpr double kAlike = 1.6;       // largest ratio of the lengths of both borders
constexpr double kLeastLoop = 25.0;  // mm: shorter borders are faults of a mesh
constexpr double kAlong = 0.1;       // weight across the outward direction

Vec3 way_out(const Vec3& a, const Vec3& b, const Vec3& normal) {
  return (b - a).cross(normal).stableNormalized();
}

Feature feature_of(const Vec3& point, const Vec3& outward) {
  Feature out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    out[k] = static_cast<float>(point[at]);
    out[3 + k] = static_cast<float>(kTurn * outward[at]);
  }
  return out;
}

}  // namespace

std::vector<RimEdge> rim_edges(const Form& form, const std::vector<std::uint8_t>& borders) {
  std::vector<std::uint32_t> head(form.points.size());
  std::iota(head.begin(), head.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (head[v] != v) v = head[v] = head[head[v]];
    return v;
  };
  std::vector<RimEdge> out;
  for (std::size_t t = 0; t < form.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3 && borders[t] != 0; ++k) {
      if ((borders[t] >> k & 1) == 0) continue;
      out.push_back({form.triangles[t][k], form.triangles[t][(k + 1) % 3], 0.0});
      head[find(out.back().a)] = find(out.back().b);
    }
  }
  std::map<std::uint32_t, double> lengths;
  for (const RimEdge& edge : out) {
    lengths[find(edge.a)] += (form.points[edge.a] - form.points[edge.b]).norm();
  }
  for (RimEdge& edge : out) edge.loop = lengths[find(edge.a)];
  return out;
}

Rims::Rims(const Form& target, const std::vector<std::uint8_t>& borders) {
  std::vector<Feature> features;
  for (const RimEdge& edge : rim_edges(target, borders)) {
    if (edge.loop < kLeastLoop) continue;
    const Vec3 &a = target.points[edge.a], &b = target.points[edge.b];
    const Vec3 outward = way_out(a, b, target.normals[edge.a] + target.normals[edge.b]);
    const int steps = std::max(1, static_cast<int>((b - a).norm() / kStep));
    for (int i = 0; i < steps; ++i) {
      places_.push_back({a + (b - a) * (i + 0.5) / steps, outward, edge.loop});
      features.push_back(feature_of(places_.back().point, outward));
    }
  }
  tree_ = FeatureTree(std::move(features));
}

void Rims::match(const std::vector<RimEdge>& edges, const Points& points, const Points& normals,
                 double farthest, std::vector<Match>& matches) const {
  if (places_.empty()) return;
  std::map<std::uint32_t, std::pair<Vec3, double>> outward;  // by vertex; with length of its loop
  for (const RimEdge& edge : edges) {
    const Vec3 way = way_out(points[edge.a], points[edge.b], normals[edge.a] + normals[edge.b]);
    for (const std::uint32_t v : {edge.a, edge.b}) {
      auto& sum = outward.try_emplace(v, Vec3::Zero(), edge.loop).first->second.first;
      sum += way;
    }
  }
  for (const auto& [v, of] : outward) {
    const Vec3 way = of.first.stableNormalized();
    const auto found =
        tree_.nearest(feature_of(points[v], way), static_cast<float>(farthest * farthest));
    if (found.index < 0) continue;
    const Place& place = places_[static_cast<std::size_t>(found.index)];
    if (place.outward.dot(way) < kSameWay || place.loop > kAlike * of.second ||
        of.second > kAlike * place.loop) {
      continue;
    }
    matches[v] = {place.point, place.outward, 1.0, kAlong};
  }
}

}  // namespace risorius::registering::steps
