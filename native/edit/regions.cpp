// SPDX-License-Identifier: MIT
// Groups joints that the same controls drive, so that a dense group of their rows and these
// controls holds few zeros.
#include <algorithm>
#include <bit>
#include <compare>
#include <limits>
#include <map>
#include <span>

#include "dna/controls.h"
#include "edit/positions.h"
#include "edit/units.h"

namespace risorius::edit::detail {

namespace {

// The fixed cost of a column: a column of n rows costs as much as n + kColumnOverhead coefficients.
// In evaluation time the fixed cost is about 50 coefficients (measured on a noisy face in 1 and in
// 464 groups); in file size it is 0. Any value from 8 to 64 gives a full-scale face the same
// groups.
constexpr std::int64_t kColumnOverhead = 8;
// Clusters are merged until there is at most one for each kJointsOfGroup joints; kFewGroups
// clusters are always allowed. Without this limit, joints that share few controls would end in many
// small groups, which are slow to evaluate.
constexpr std::size_t kJointsOfGroup = 14, kFewGroups = 16;
constexpr std::int64_t kMostRows = 65535;  // the format counts rows of a LOD in 16 bits

struct Cluster {
  std::vector<std::uint64_t> controls;  // bit c: control c moves a joint of the cluster
  std::int64_t rows = 0, columns = 0;
  Vector centre{};  // of the neutral positions
  std::vector<std::uint32_t> joints;
};

std::int64_t cost(std::int64_t rows, std::int64_t columns) {
  return (rows + kColumnOverhead) * columns + 1;
}

std::int64_t columns_of_both(const Cluster& a, const Cluster& b) {
  std::int64_t n = 0;
  for (std::size_t w = 0; w < a.controls.size(); ++w) {
    n += std::popcount(a.controls[w] | b.controls[w]);
  }
  return n;
}

// A merge of a cluster with cluster number `with`, and the change of the cost by it: the smallest
// is the best. Of equal changes, the one with the smaller (squared) distance of the clusters is
// better.
struct Merge {
  std::int64_t change = 0;
  double distance = 0.0;
  std::uint32_t with = 0;
  auto operator<=>(const Merge&) const = default;
};
constexpr Merge kNoMerge{std::numeric_limits<std::int64_t>::max(), 0.0, UINT32_MAX};

Merge merge_of(const Cluster& a, const Cluster& b, std::uint32_t with) {
  if (a.rows + b.rows > kMostRows) return kNoMerge;
  Merge m{0, 0.0, with};
  m.change = cost(a.rows + b.rows, columns_of_both(a, b)) - cost(a.rows, a.columns) -
             cost(b.rows, b.columns);
  for (std::size_t k = 0; k < 3; ++k) {
    m.distance += (a.centre[k] - b.centre[k]) * (a.centre[k] - b.centre[k]);
  }
  return m;
}

void join(Cluster& a, Cluster& b) {
  const auto na = static_cast<double>(a.joints.size()), nb = static_cast<double>(b.joints.size());
  for (std::size_t k = 0; k < 3; ++k) {
    a.centre[k] = (a.centre[k] * na + b.centre[k] * nb) / (na + nb);
  }
  a.columns = columns_of_both(a, b);
  for (std::size_t w = 0; w < a.controls.size(); ++w) a.controls[w] |= b.controls[w];
  a.rows += b.rows;
  a.joints.insert(a.joints.end(), b.joints.begin(), b.joints.end());
  b = {};
}

// Merges the best pair of clusters while that lowers the total cost or while there are too many
// clusters. For each cluster the best partner among the clusters after it is stored.
class Clustering {
 public:
  explicit Clustering(std::vector<Cluster>& clusters)
      : clusters_(clusters), best_(clusters.size(), kNoMerge), count_(clusters.size()) {}
  void run() {
    const std::size_t most = std::max(kFewGroups, clusters_.size() / kJointsOfGroup);
    for (std::uint32_t i = 0; i < clusters_.size(); ++i) search(i);
    while (step(count_ > most)) --count_;
  }

 private:
  bool is_gone(std::uint32_t i) const { return clusters_[i].joints.empty(); }
  void search(std::uint32_t i) {
    best_[i] = kNoMerge;
    for (std::uint32_t j = i + 1; j < clusters_.size(); ++j) {
      if (!is_gone(j)) best_[i] = std::min(best_[i], merge_of(clusters_[i], clusters_[j], j));
    }
  }
  bool step(bool too_many) {
    const auto found = std::ranges::min_element(best_);
    if (found == best_.end() || found->with == kNoMerge.with) return false;
    if (found->change >= 0 && !too_many) return false;
    const auto i = static_cast<std::uint32_t>(found - best_.begin());
    const std::uint32_t j = found->with;
    join(clusters_[i], clusters_[j]);
    best_[j] = kNoMerge;
    search(i);
    for (std::uint32_t k = 0; k < j; ++k) {
      if (k == i || is_gone(k)) continue;
      if (best_[k].with == i || best_[k].with == j) {
        search(k);
      } else if (k < i) {
        best_[k] = std::min(best_[k], merge_of(clusters_[k], clusters_[i], i));
      }
    }
    return true;
  }

  std::vector<Cluster>& clusters_;
  std::vector<Merge> best_;
  std::size_t count_;
};

// The strongest effect of each control on one joint, divided by the threshold. At a quaternion
// joint it is raised by 1, so that no control counts as weak (below 1).
using Strengths = std::map<std::uint16_t, double>;

// The strength below which a control does not count for a joint. If most controls of the joint are
// weak (a faint expression, or too high a threshold), only the stronger half of them counts.
double least_strength(const Strengths& strengths, bool significant_only) {
  if (!significant_only || strengths.empty()) return 0.0;
  std::vector<double> all;
  for (const auto& [control, strength] : strengths) all.push_back(strength);
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return std::min(1.0, *middle);
}

std::vector<Vector> neutral_positions(const dna::Dna& dna) {
  // The positions only decide between merges of equal cost. For that, angles in xyz order are exact
  // enough, even if the file has another order.
  rig::EulerConvention euler;
  if (dna.descriptor.rotation_unit != 1) euler.radians_per_unit = 0.0174532925199432958f;
  const Skeleton skeleton(dna, euler);
  const float rest[9] = {};
  std::vector<Local> locals;
  locals.reserve(skeleton.joint_count());
  for (std::size_t j = 0; j < skeleton.joint_count(); ++j) {
    locals.push_back(skeleton.local(j, rest));
  }
  std::vector<Vector> positions(locals.size());
  skeleton.place(locals, positions);
  return positions;
}

// One cluster for each joint that has units and that no region of the options lists.
std::vector<Cluster> list_clusters(const dna::Dna& dna, std::span<const Unit> units,
                                   const Effects& effects, bool significant_only,
                                   const std::vector<std::uint32_t>& of_joint) {
  const std::size_t words = (dna::control_counts(dna).total() + 63) / 64;
  const std::vector<Vector> positions = neutral_positions(dna);
  std::vector<Cluster> out;
  for (std::size_t i = 0; i < units.size();) {
    const std::uint32_t joint = units[i].joint;
    Cluster cluster{std::vector<std::uint64_t>(words), 0, 0, positions[joint], {joint}};
    Strengths strengths;
    for (; i < units.size() && units[i].joint == joint; ++i) {
      const Unit& u = units[i];
      cluster.rows += static_cast<std::int64_t>(u.rows.size());
      for (std::size_t v = 0; v < u.values.size(); ++v) {
        double& strength = strengths[u.columns[v % u.columns.size()]];
        const double effect = effects.of(u.rows[v / u.columns.size()].output, u.values[v]);
        strength = std::max(strength, u.is_quaternion ? effect + 1.0 : effect);
      }
    }
    if (of_joint[joint] != kNoRegion) continue;
    const double least = least_strength(strengths, significant_only);
    for (const auto& [control, strength] : strengths) {
      if (strength < least) continue;
      cluster.controls[control / 64] |= std::uint64_t{1} << (control % 64);
      ++cluster.columns;
    }
    out.push_back(std::move(cluster));
  }
  return out;
}

// Removes the controls that move no joint from the bit sets of the clusters' controls. Shorter bit
// sets are compared faster.
void pack_controls(std::vector<Cluster>& clusters) {
  if (clusters.empty()) return;
  const std::size_t words = clusters[0].controls.size();
  std::vector<std::uint32_t> place(words * 64, 0);
  std::uint32_t used = 0;
  for (std::size_t c = 0; c < place.size(); ++c) {
    const auto has = [&](const Cluster& k) { return (k.controls[c / 64] >> (c % 64) & 1) != 0; };
    place[c] = used;
    if (std::ranges::any_of(clusters, has)) ++used;
  }
  for (Cluster& cluster : clusters) {
    std::vector<std::uint64_t> packed((used + 63) / 64);
    for (std::size_t w = 0; w < words; ++w) {
      for (std::uint64_t bits = cluster.controls[w]; bits != 0; bits &= bits - 1) {
        const std::uint32_t to = place[w * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
        packed[to / 64] |= std::uint64_t{1} << (to % 64);
      }
    }
    cluster.controls = std::move(packed);
  }
}

}  // namespace

Regions find_regions(const dna::Dna& dna, const std::vector<Unit>& units, const Effects& effects,
                     const RegroupOptions& options, bool significant_only) {
  std::vector<std::uint32_t> wanted(dna.definition.joint_names.size(), kNoRegion);
  for (std::uint32_t r = 0; r < options.regions.size(); ++r) {
    for (const std::uint16_t joint : options.regions[r]) wanted[joint] = r;
  }
  std::vector<Cluster> clusters = list_clusters(dna, units, effects, significant_only, wanted);
  pack_controls(clusters);
  Clustering(clusters).run();
  auto next = static_cast<std::uint32_t>(options.regions.size());
  for (const Cluster& cluster : clusters) {
    if (cluster.joints.empty()) continue;
    for (const std::uint32_t joint : cluster.joints) wanted[joint] = next;
    ++next;
  }
  // Numbers the regions in the order of their first joints. Joints that no unit moves have no
  // region.
  Regions out{std::vector<std::uint32_t>(wanted.size(), kNoRegion), 0};
  std::vector<std::uint32_t> number(next, kNoRegion);
  for (const Unit& u : units) {
    std::uint32_t& n = number[wanted[u.joint]];
    if (n == kNoRegion) n = out.count++;
    out.of_joint[u.joint] = n;
  }
  return out;
}

}  // namespace risorius::edit::detail
