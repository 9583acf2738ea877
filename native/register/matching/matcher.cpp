// SPDX-License-Identifier: MIT
// Matches the vertices of a template with points of the target surface.
#include "register/matching/matcher.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/parallel_for.h"

namespace risorius::registering::steps {

namespace {

constexpr double kLeastRobust = 1.0;  // mm: least distance at which a weight is a quarter
constexpr double kOutside = 2.5;      // that distance, in median distances
constexpr double kLeastCosine = 0.2;  // between normals of a match by features
constexpr double kBackwards = 0.5;    // weight of matches from the target to the template
constexpr double kInside = 0.3;       // largest weight of a match of a hidden vertex
constexpr double kInsideReach = 2.0;  // mm
constexpr double kInsideCosine = 0.8;
constexpr double kRimReach = 25.0;  // mm, largest distance to a border of the target
constexpr std::size_t kEach = 3;    // every third sample searches for its vertex

Feature feature(const Vec3& point, const Vec3& normal, const Bend& bend, const Counting& counting) {
  Feature out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    out[k] = static_cast<float>(point[at]);
    out[3 + k] = static_cast<float>(counting.normal * normal[at]);
    out[6 + k] = static_cast<float>(counting.bend * bend[k]);
  }
  return out;
}

double trust(double distance, double robust) {
  const double t = distance / robust;
  return 1 / ((1 + t * t) * (1 + t * t));
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

bool Matcher::is_inside(const Closest& found, const Vec3& normal) {
  return found.triangle >= 0 && found.distance < kInsideReach &&
         found.normal.dot(normal) > kInsideCosine;
}

Matcher::Matcher(const Target& target, const Looks& looks, std::size_t threads)
    : target_(target),
      looks_(looks),
      threads_(threads),
      nearest_(target.form.triangles, target.form.points),
      rims_(target.form, target.borders) {}

std::vector<Match> Matcher::by_features(const Points& points, const Points& normals,
                                        const Counting& counting) const {
  const Samples& samples = target_.samples;
  std::vector<Feature> features;
  features.reserve(samples.points.size());
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    features.push_back(feature(samples.points[i], samples.normals[i], samples.bends[i], counting));
  }
  const FeatureTree tree(std::move(features));
  std::vector<std::int32_t> found(points.size(), -1);
  const auto most = static_cast<float>(counting.farthest * counting.farthest);
  core::parallel_for(
      points.size(), threads_,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
          if (looks_.belief[v] <= 0) continue;
          found[v] =
              tree.nearest(feature(points[v], normals[v], looks_.bends[v], counting), most).index;
        }
      },
      8);
  std::vector<double> distances;
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (found[v] >= 0)
      distances.push_back((samples.points[static_cast<std::size_t>(found[v])] - points[v]).norm());
  }
  const double robust = std::max(kLeastRobust, kOutside * median(std::move(distances)));
  std::vector<Match> matches(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (found[v] < 0) continue;
    const auto s = static_cast<std::size_t>(found[v]);
    const Vec3 way = samples.points[s] - points[v];
    if (samples.normals[s].dot(normals[v]) < kLeastCosine) continue;
    const double aside = (way - samples.normals[s] * samples.normals[s].dot(way)).norm();
    if (samples.border[s] != 0 && aside > samples.spacing) continue;
    matches[v] = {samples.points[s], samples.normals[s],
                  looks_.belief[v] * trust(way.norm(), robust), counting.along};
  }
  if (counting.backwards) add_backwards(points, normals, counting, robust, matches);
  rims_.match(looks_.rim, points, normals, std::min(counting.farthest, kRimReach), matches);
  return matches;
}

void Matcher::add_backwards(const Points& points, const Points& normals, const Counting& counting,
                            double robust, std::vector<Match>& matches) const {
  const Samples& samples = target_.samples;
  std::vector<Feature> features;
  features.reserve(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    features.push_back(feature(points[v], normals[v], looks_.bends[v], counting));
  }
  const FeatureTree tree(std::move(features));
  const std::size_t count = samples.points.size() / kEach;
  std::vector<std::int32_t> found(count, -1);
  const auto most = static_cast<float>(robust * robust * 4);
  core::parallel_for(
      count, threads_,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const std::size_t s = i * kEach;
          found[i] = tree.nearest(feature(samples.points[s], samples.normals[s], samples.bends[s],
                                          counting),
                                  most)
                         .index;
        }
      },
      8);
  // Each sample of the target finds a vertex. Several samples may find the same vertex, which then
  // gets the weighted mean of their points and normals.
  Points to(points.size(), Vec3::Zero()), looking = to;
  std::vector<double> weight(points.size(), 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    if (found[i] < 0) continue;
    const auto v = static_cast<std::size_t>(found[i]);
    const std::size_t s = i * kEach;
    if (looks_.belief[v] <= 0 || looks_.border[v] != 0) continue;
    if (samples.normals[s].dot(normals[v]) < kLeastCosine) continue;
    const double w = trust((samples.points[s] - points[v]).norm(), robust);
    to[v] += w * samples.points[s];
    looking[v] += w * samples.normals[s];
    weight[v] += w;
  }
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (weight[v] <= 0) continue;
    const double w = kBackwards * looks_.belief[v] * std::min(weight[v], 1.0);
    const Vec3 there = to[v] / weight[v];
    const double all = matches[v].weight + w;
    matches[v].point = (matches[v].weight * matches[v].point + w * there) / all;
    matches[v].normal = (matches[v].weight * matches[v].normal + w * looking[v].stableNormalized())
                            .stableNormalized();
    matches[v].weight = all;
    matches[v].along = counting.along;
  }
}

std::vector<Matcher::Closest> Matcher::closest(const Points& points, const Points& normals,
                                               double farthest, double least_cosine) const {
  std::vector<Closest> out(points.size());
  const Form& form = target_.form;
  const auto look = [&](std::size_t v) {
    const auto takes = [&](std::uint32_t t) {
      const Triangle& c = form.triangles[t];
      const Vec3 sum = form.normals[c[0]] + form.normals[c[1]] + form.normals[c[2]];
      return sum.dot(normals[v]) >= least_cosine * sum.norm();
    };
    const auto hit = nearest_.find(points[v], farthest, takes);
    if (!hit) return;
    Closest& found = out[v];
    const Triangle& c = form.triangles[hit->triangle];
    found.triangle = static_cast<std::int32_t>(hit->triangle);
    found.shares = hit->share;
    found.point = hit->point;
    found.distance = hit->distance;
    found.normal = (hit->share[0] * form.normals[c[0]] + hit->share[1] * form.normals[c[1]] +
                    hit->share[2] * form.normals[c[2]])
                       .stableNormalized();
    const std::uint8_t borders = target_.borders[hit->triangle];
    for (int k = 0; k < 3 && borders != 0; ++k) {
      if ((borders >> k & 1) == 0 || hit->share[(k + 2) % 3] > 1e-6) continue;
      const Vec3 way = points[v] - hit->point;
      const double aside = (way - found.normal * found.normal.dot(way)).norm();
      found.beyond_border = found.beyond_border || aside > 0.5 * way.norm();
    }
  };
  core::parallel_for(
      points.size(), threads_,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) look(v);
      },
      8);
  return out;
}

std::vector<Match> Matcher::by_distance(const Points& points, const Points& normals,
                                        double farthest, double least_cosine, double robust,
                                        double along) const {
  const std::vector<Closest> found = closest(points, normals, farthest, least_cosine);
  std::vector<Match> matches(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (found[v].triangle < 0 || found[v].beyond_border) continue;
    double belief = looks_.belief[v] * trust(found[v].distance, robust);
    if (is_inside(found[v], normals[v])) {
      belief =
          std::max(belief, kInside * looks_.inside[v] * trust(found[v].distance, kInsideReach / 2));
    }
    matches[v] = {found[v].point, found[v].normal, belief, along};
  }
  rims_.match(looks_.rim, points, normals, farthest, matches);
  return matches;
}

}  // namespace risorius::registering::steps
