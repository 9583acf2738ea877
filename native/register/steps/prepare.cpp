// SPDX-License-Identifier: MIT
// Checks the surfaces of a registration, scales them to millimetres, and prepares the search for
// matches.
#include "register/steps/prepare.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "core/parallel_for.h"

namespace risorius::registering::steps {

using core::ErrorCode;
using core::fail;

namespace {

constexpr double kAround = 60.0;                    // mm around the start: used part of the target
constexpr std::size_t kSamples = 40000;             // largest number of samples of the target
constexpr double kCloser = 1.2;                     // mm, least spacing of samples
constexpr double kLeastSize = 10, kMostSize = 1e5;  // mm, RMS radius of a template
constexpr int kRays = 16;                           // per vertex, to find out if it is hidden
constexpr double kHidden = 0.12, kShown = 0.3;      // shares of free rays: belief 0 and belief 1
constexpr int kRounds = 12;                         // of robust alignment

std::string place(const char* name, std::size_t i) {
  return std::string(name) + "[" + std::to_string(i) + "]";
}

core::Status check_points(const std::vector<Vector3>& points, const char* name) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto finite = [](double x) { return std::abs(x) < 1e12; };
    if (std::all_of(points[i].begin(), points[i].end(), finite)) continue;
    return fail(ErrorCode::kInvalidValue, place(name, i),
                "finite numbers below 1e12 were expected");
  }
  return core::ok();
}

core::Status check_mesh(const Mesh& mesh, const std::string& name, std::size_t most) {
  if (mesh.points.size() > most) {
    return fail(ErrorCode::kLimitExceeded, name,
                "at most " + std::to_string(most) + " vertices were expected, found " +
                    std::to_string(mesh.points.size()) + ": decimate the mesh");
  }
  if (mesh.triangles.size() > RegisterOptions::kMostTriangles) {
    return fail(ErrorCode::kLimitExceeded, name,
                "at most " + std::to_string(RegisterOptions::kMostTriangles) +
                    " triangles were expected, found " + std::to_string(mesh.triangles.size()) +
                    ": decimate the mesh");
  }
  if (mesh.triangles.size() < RegisterOptions::kLeast) {
    return fail(ErrorCode::kInvalidArgument, name,
                "at least " + std::to_string(RegisterOptions::kLeast) +
                    " triangles were expected, found " + std::to_string(mesh.triangles.size()));
  }
  RISORIUS_TRY(check_points(mesh.points, (name + ".points").c_str()));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t corner : mesh.triangles[t]) {
      if (corner < mesh.points.size()) continue;
      return fail(ErrorCode::kInvalidIndex, place((name + ".triangles").c_str(), t),
                  "a vertex below " + std::to_string(mesh.points.size()) + " was expected, found " +
                      std::to_string(corner));
    }
  }
  return core::ok();
}

core::Status check_lengths(const Mesh& templ, const std::vector<Pair>& pairs,
                           const std::vector<Vector3>& start, const RegisterOptions& options) {
  const std::size_t count = templ.points.size();
  const auto check_one = [&](std::size_t length, const char* name) -> core::Status {
    if (length == 0 || length == count) return core::ok();
    return fail(ErrorCode::kInvalidLength, name,
                "one entry for each of " + std::to_string(count) +
                    " vertices of the template was expected, found " + std::to_string(length));
  };
  RISORIUS_TRY(check_one(start.size(), "start"));
  RISORIUS_TRY(check_one(options.trusted.size(), "trusted"));
  RISORIUS_TRY(check_one(options.mirrored.size(), "mirrored"));
  for (std::size_t v = 0; v < options.mirrored.size(); ++v) {
    if (options.mirrored[v] < count) continue;
    return fail(ErrorCode::kInvalidIndex, place("mirrored", v),
                "a vertex below " + std::to_string(count) + " was expected, found " +
                    std::to_string(options.mirrored[v]));
  }
  if (!start.empty() || pairs.size() >= 3) return core::ok();
  return fail(ErrorCode::kInvalidArgument, "pairs",
              "a start or at least 3 pairs were expected, found " + std::to_string(pairs.size()));
}

core::Status check_options(const RegisterOptions& options) {
  const auto inside = [](double x, double low, double high) { return x >= low && x <= high; };
  if (!inside(options.mm, 1e-9, 1e9)) {
    return fail(ErrorCode::kInvalidArgument, "mm", "a number from 1e-9 to 1e9 was expected");
  }
  if (!inside(options.symmetry, 0, 1000)) {
    return fail(ErrorCode::kInvalidArgument, "symmetry", "a number from 0 to 1000 was expected");
  }
  if (!inside(options.noise, 0, 1000)) {
    return fail(ErrorCode::kInvalidArgument, "noise", "a number from 0 to 1000 was expected");
  }
  if (options.nodes < 10 || options.nodes > 20000) {
    return fail(ErrorCode::kInvalidArgument, "nodes", "a number from 10 to 20000 was expected");
  }
  return core::ok();
}

/// The least-squares similarity transform between weighted points (Umeyama 1991). False: the points
/// lie on a line.
/// Out: turn, shift  p becomes turn * p + shift; turn contains the scale
bool similarity(const std::vector<Vec3>& from, const std::vector<Vec3>& to,
                const std::vector<double>& weights, Eigen::Matrix3d& turn, Vec3& shift) {
  Vec3 middle = Vec3::Zero(), there = Vec3::Zero();
  double all = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    middle += weights[i] * from[i];
    there += weights[i] * to[i];
    all += weights[i];
  }
  middle /= all;
  there /= all;
  Eigen::Matrix3d both = Eigen::Matrix3d::Zero(), own = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    both += weights[i] * (to[i] - there) * (from[i] - middle).transpose();
    own += weights[i] * (from[i] - middle) * (from[i] - middle).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(both, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()[1] > 1e-9 * svd.singularValues()[0])) return false;
  Vec3 signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1.0 : 1.0);
  const double scale = svd.singularValues().dot(signs) / own.trace();
  if (!(scale > 0) || !std::isfinite(scale)) return false;
  turn = scale * svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  shift = there - turn * middle;
  return true;
}

Vec3 vec(const Vector3& p) { return {p[0], p[1], p[2]}; }

/// The triangles with only one vertex index for each position, so that a texture seam is not a
/// border.
std::vector<Triangle> welded(const Mesh& mesh) {
  std::vector<std::uint32_t> order(mesh.points.size()), first(mesh.points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return mesh.points[a] != mesh.points[b] ? mesh.points[a] < mesh.points[b] : a < b;
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && mesh.points[order[i]] == mesh.points[order[i - 1]];
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  std::vector<Triangle> out = mesh.triangles;
  for (Triangle& t : out) t = {first[t[0]], first[t[1]], first[t[2]]};
  return out;
}

/// The share, 0 to 1, of rays into the half space above a vertex that the surface itself does not
/// block; 1 for a vertex without a normal. In: own  search tree of the surface
double openness(const author::detail::Nearest& own, const Vec3& point, const Vec3& normal) {
  if (normal.squaredNorm() < 0.5) return 1.0;
  const Vec3 side = normal.unitOrthogonal(), other = normal.cross(side);
  int open = 0;
  for (int i = 0; i < kRays; ++i) {
    // The directions of the rays are on a spiral and are denser near the normal.
    const double share = (i + 0.5) / kRays, radius = std::sqrt(share), turn = 2.399963 * i;
    const Vec3 way =
        radius * (std::cos(turn) * side + std::sin(turn) * other) + std::sqrt(1 - share) * normal;
    open += own.is_blocked(point + 0.2 * normal, way) ? 0 : 1;
  }
  return static_cast<double>(open) / kRays;
}

}  // namespace

core::Status check(const Mesh& templ, const Mesh& target, const std::vector<Pair>& pairs,
                   const std::vector<Vector3>& start, const RegisterOptions& options) {
  RISORIUS_TRY(check_options(options));
  RISORIUS_TRY(check_mesh(templ, "template", RegisterOptions::kMostTemplate));
  RISORIUS_TRY(check_mesh(target, "target", RegisterOptions::kMostTarget));
  RISORIUS_TRY(check_lengths(templ, pairs, start, options));
  RISORIUS_TRY(check_points(start, "start"));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pairs[i].vertex >= templ.points.size()) {
      return fail(ErrorCode::kInvalidIndex, place("pairs", i),
                  "a vertex below " + std::to_string(templ.points.size()) +
                      " was expected, found " + std::to_string(pairs[i].vertex));
    }
    RISORIUS_TRY(check_points({pairs[i].point}, place("pairs", i).c_str()));
    if (!(pairs[i].weight >= 0) || !(pairs[i].weight <= 1e6)) {
      return fail(ErrorCode::kInvalidValue, place("pairs", i),
                  "a weight from 0 to 1e6 was expected");
    }
  }
  return core::ok();
}

core::Result<std::vector<Vector3>> aligned(const Mesh& templ, const std::vector<Pair>& pairs) {
  std::vector<Vec3> from, to;
  std::vector<double> weights, given;
  for (const Pair& pair : pairs) {
    from.push_back(vec(templ.points[pair.vertex]));
    to.push_back(vec(pair.point));
    given.push_back(pair.weight);
  }
  weights = given;
  Eigen::Matrix3d turn;
  Vec3 shift;
  for (int round = 0; round < kRounds; ++round) {
    if (!similarity(from, to, weights, turn, shift)) {
      return fail(ErrorCode::kInvalidArgument, "pairs",
                  "at least 3 pairs that do not lie on one line were expected");
    }
    std::vector<double> away;
    for (std::size_t i = 0; i < from.size(); ++i)
      away.push_back((turn * from[i] + shift - to[i]).norm());
    std::vector<double> sorted = away;
    std::sort(sorted.begin(), sorted.end());
    const double robust = std::max(2.5 * sorted[sorted.size() / 2], 1e-12);
    for (std::size_t i = 0; i < from.size(); ++i) {
      const double t = away[i] / robust;
      weights[i] = given[i] / (1 + t * t);
    }
  }
  std::vector<Vector3> out;
  out.reserve(templ.points.size());
  for (const Vector3& p : templ.points) {
    const Vec3 there = turn * vec(p) + shift;
    out.push_back({there[0], there[1], there[2]});
  }
  return out;
}

core::Result<Scale> scale_of(const Mesh& templ, const std::vector<Vector3>& start, double mm) {
  const auto spread = [](const std::vector<Vector3>& points, Vec3& middle) {
    middle.setZero();
    for (const Vector3& p : points) middle += vec(p);
    middle /= static_cast<double>(points.size());
    double sum = 0;
    for (const Vector3& p : points) sum += (vec(p) - middle).squaredNorm();
    return std::sqrt(sum / static_cast<double>(points.size()));
  };
  Scale scale;
  Vec3 own;
  const double before = spread(templ.points, own), after = spread(start, scale.origin);
  if (!(before * mm > kLeastSize) || !(before * mm < kMostSize)) {
    return fail(ErrorCode::kInvalidArgument, "mm",
                "a template of 10 mm to 100 m was expected, found one whose vertices lie " +
                    std::to_string(before * mm) + " mm from their middle");
  }
  if (!(after > 0)) {
    return fail(ErrorCode::kInvalidArgument, "start",
                "vertices at more than one place were expected");
  }
  scale.mm = mm * before / after;
  return scale;
}

core::Result<Target> near_target(const Mesh& target, const Points& start, const Scale& scale,
                                 std::size_t threads, std::vector<std::int32_t>& whole) {
  Vec3 low = start[0], high = low;
  for (const Vec3& p : start) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  low.array() -= kAround;
  high.array() += kAround;
  const std::vector<Triangle> corners = welded(target);
  const std::vector<std::uint8_t> borders = border_edges(corners);
  Target out;
  std::vector<std::uint32_t> moved(target.points.size(), UINT32_MAX);
  whole.clear();
  for (std::size_t t = 0; t < target.triangles.size(); ++t) {
    const Triangle& c = corners[t];
    const std::array<Vec3, 3> p{scale.in(target.points[c[0]]), scale.in(target.points[c[1]]),
                                scale.in(target.points[c[2]])};
    const Vec3 middle = (p[0] + p[1] + p[2]) / 3;
    if ((middle.array() < low.array()).any() || (middle.array() > high.array()).any()) continue;
    const double longest = std::max(
        {(p[1] - p[0]).squaredNorm(), (p[2] - p[1]).squaredNorm(), (p[0] - p[2]).squaredNorm()});
    if (!((p[1] - p[0]).cross(p[2] - p[0]).norm() > 1e-9 * longest)) continue;
    Triangle here{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (moved[c[k]] == UINT32_MAX) {
        moved[c[k]] = static_cast<std::uint32_t>(out.form.points.size());
        out.form.points.push_back(p[k]);
      }
      here[k] = moved[c[k]];
    }
    out.form.triangles.push_back(here);
    out.borders.push_back(borders[t]);
    whole.push_back(static_cast<std::int32_t>(t));
  }
  if (out.form.triangles.size() < RegisterOptions::kLeast) {
    return fail(ErrorCode::kInvalidArgument, "target",
                "at least " + std::to_string(RegisterOptions::kLeast) +
                    " triangles with an area were expected near the start, found " +
                    std::to_string(out.form.triangles.size()));
  }
  out.form.normals = vertex_normals(out.form.points, out.form.triangles);
  double area = 0;
  for (const Triangle& t : out.form.triangles) {
    const Points& p = out.form.points;
    area += (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).norm() / 2;
  }
  const double most = std::min(area / (kCloser * kCloser) + 1, static_cast<double>(kSamples));
  out.samples = sample(out.form, out.borders, static_cast<std::size_t>(most));
  out.samples.bends = bends(out.samples.points, out.samples.normals, out.samples, threads);
  return out;
}

Looks looks_of(const Form& start, const std::vector<std::uint8_t>& trusted, double spacing,
               std::size_t threads) {
  Looks looks;
  const std::vector<std::uint8_t> borders = border_edges(start.triangles);
  double area = 0;
  looks.border.assign(start.points.size(), 0);
  for (std::size_t i = 0; i < start.triangles.size(); ++i) {
    const Triangle& t = start.triangles[i];
    const Points& p = start.points;
    area += (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).norm() / 2;
    for (std::size_t k = 0; k < 3; ++k) {
      if ((borders[i] >> k & 1) != 0) looks.border[t[k]] = looks.border[t[(k + 1) % 3]] = 1;
    }
  }
  looks.rim = rim_edges(start, borders);
  const auto count = static_cast<std::size_t>(
      std::clamp(area / (spacing * spacing), 100.0, 2.0 * static_cast<double>(kSamples)));
  looks.bends = bends(start.points, start.normals, sample(start, borders, count), threads);
  looks.belief.assign(start.points.size(), 1.0);
  looks.inside.assign(start.points.size(), 0.0);
  if (!trusted.empty()) {
    for (std::size_t v = 0; v < trusted.size(); ++v) looks.belief[v] = trusted[v] != 0 ? 1.0 : 0.0;
    return looks;
  }
  const author::detail::Nearest own(start.triangles, start.points);
  core::parallel_for(
      start.points.size(), threads,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
          const double open = openness(own, start.points[v], start.normals[v]);
          looks.belief[v] = std::clamp((open - kHidden) / (kShown - kHidden), 0.0, 1.0);
          looks.inside[v] = 1 - looks.belief[v];
        }
      },
      8);
  return looks;
}

}  // namespace risorius::registering::steps
