// SPDX-License-Identifier: MIT
#include "register/steps/mirroring.h"

#include <Eigen/Eigenvalues>

namespace risorius::registering::steps {

void add_mirrored(const std::vector<std::uint32_t>& mirrored, const Points& points, double share,
                  bool missing, std::vector<Match>& matches) {
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  Vec3 middle = Vec3::Zero();
  for (std::size_t v = 0; v < mirrored.size(); ++v) {
    const Vec3 way = points[v] - points[mirrored[v]];
    across += way * way.transpose();
    middle += (points[v] + points[mirrored[v]]) / 2;
  }
  middle /= static_cast<double>(mirrored.size());
  const Vec3 plane = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(across).eigenvectors().col(2);
  const auto turned = [&](const Vec3& way) -> Vec3 { return way - 2 * plane * plane.dot(way); };
  const std::vector<Match> own = matches;
  for (std::size_t v = 0; v < mirrored.size(); ++v) {
    const Match& other = own[mirrored[v]];
    const double weight = share * other.weight;
    if (weight <= 0 || (missing && own[v].weight > 0)) continue;
    const Vec3 point = middle + turned(other.point - middle), normal = turned(other.normal);
    Match& match = matches[v];
    const double all = match.weight + weight;
    match.along = (match.weight * match.along + weight * other.along) / all;
    match.point = (match.weight * match.point + weight * point) / all;
    match.normal = (match.weight * match.normal + weight * normal).stableNormalized();
    match.weight = all;
  }
}

}  // namespace risorius::registering::steps
