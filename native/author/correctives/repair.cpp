// SPDX-License-Identifier: MIT
// Repairs a posed skin: finds the displacement of its vertices that removes faults (vertices
// inside a solid or the skin itself, stretched faces, folded edges) beyond the allowed ones. A
// pose consists of parts, such as the expressions in it; undoing a part takes its motion back.
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "author/correctives/topology.h"

namespace risorius::author::detail {

namespace {

// A part of the pose is faded out in at most kFades rounds. In each round, the undone share of its
// motion grows by 1 / kSteps, up to 1, at the vertices that still have a fault. There are more
// rounds than steps, because undoing may cause faults at other vertices.
constexpr std::size_t kFades = 9, kSteps = 6;
constexpr double kUndone = 2.0;  // cost of undoing the whole motion; all faults of one kind cost 1
// A repair with at most this cost ends the search for a better repair. The cost of a repair that
// leaves any fault is raised by kEnough.
constexpr double kEnough = 0.15;
constexpr double kWhole = 2.0;   // mm around a fault in which the motion is undone completely
constexpr double kNarrow = 5.0;  // mm, the radius tried first because it undoes less of the pose
constexpr std::size_t kRounds = 6;
// Weights of the goals in the linear system; smoothness has the weight 1. kPlace: places of
// vertices; kEdge: edge vectors; kEven: flatness at folds; kRest: no displacement.
constexpr double kPlace = 1.0, kEdge = 1.0, kEven = 0.5, kRest = 0.002;
// Goal for the depth of a repaired vertex beyond the allowed depth, as a share of the tolerance
// SkinChecker::kDepth: the vertex should end well within the tolerance.
constexpr double kBeyond = 0.5;
// After a repair, vertices without a fault get back up to the share kKept of their motion. If this
// causes a fault, the motion that vertices near this fault get back is reduced by the share kLess,
// in each of at most kBacks rounds.
constexpr double kKept = 0.91, kLess = 0.2;
constexpr std::size_t kBacks = 12;
// A repair may move the deepest vertex of the skin deeper by at most kDeeper mm, and multiply the
// largest stretch of a face by at most kWider.
constexpr float kDeeper = 0.09f, kWider = 1.005f;

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Goals for the displacement Work::x, in mm. places: vertex -> its displacement; edges: the two
/// vertices of an edge -> the displacement of the first minus that of the second; even: vertex at a
/// fold -> a displacement that brings it nearer to the mean of its neighbours.
struct Asked {
  std::map<std::uint32_t, Vec3> places;
  std::map<std::array<std::uint32_t, 2>, Vec3> edges;
  std::map<std::uint32_t, Vec3> even;
};

/// The state of one repair.
struct Work {
  const Topology& topology;
  const Placed& pose;
  const SolidSurfaces& solids;
  SkinFaults allowed;
  // The largest depth in mm and the largest stretch of the pose before the repair; allowed faults
  // count too. `widest` is at least SkinChecker::kStretch.
  float deepest = 0.0f, widest = 0.0f;
  std::vector<std::uint32_t> active;  // vertices that may move
  std::vector<std::uint32_t> place;   // [V] index in active, or kStill
  std::vector<Vec3> x;                // [V] mm
  Asked asked;
  Region region;  // the vertices and triangles that are checked
  static constexpr std::uint32_t kStill = 0xffffffffu;

  std::vector<Vec3> moved() const {
    std::vector<Vec3> out = pose.skin;
    for (std::size_t v = 0; v < x.size(); ++v) out[v] += x[v];
    return out;
  }
};

/// The result of one check: contacts, faults, and the sums of the faults beyond the allowed ones.
struct Look {
  std::vector<Contact> contacts;
  SkinFaults faults;
  FaultSums sums;
};

Look look_at(const Work& work, const Region& region) {
  Look out;
  const std::vector<Vec3> skin = work.moved();
  out.contacts = find_contacts(work.topology, region, work.solids, skin);
  out.faults = find_faults(work.topology, skin, out.contacts);
  out.sums = sum_faults(work.topology, out.faults, work.allowed);
  return out;
}

std::vector<std::uint32_t> fault_vertices(const Work& work, const Look& look) {
  std::vector<std::uint32_t> out;
  const Topology& topology = work.topology;
  for (const Contact& c : look.contacts) {
    if (!is_deep(look.faults, work.allowed, c.vertex)) continue;
    out.push_back(c.vertex);
    if (c.is_skin) out.insert(out.end(), c.other.begin(), c.other.end());
  }
  for (std::size_t f = 0; f < topology.face_count(); ++f) {
    if (!is_stretched(topology, look.faults, work.allowed, f)) continue;
    const auto begin = topology.skin.corners.begin();
    out.insert(out.end(), begin + topology.skin.face_offsets[f],
               begin + topology.skin.face_offsets[f + 1]);
  }
  for (std::size_t h = 0; h < topology.hinges.size(); ++h) {
    if (!is_folded(look.faults, work.allowed, h)) continue;
    const auto& edge = topology.hinges[h].edge;
    out.insert(out.end(), edge.begin(), edge.end());
  }
  std::ranges::sort(out);
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// Lets vertices move: adds to work.active all vertices that are less than SkinChecker::kAround mm,
/// in the neutral pose, from a vertex with a fault.
/// In: faults  vertices with a fault
void mark(Work& work, const std::vector<std::uint32_t>& faults) {
  const auto& neutral = work.topology.neutral;
  work.place.assign(neutral.size(), Work::kStill);
  for (std::uint32_t v = 0; v < neutral.size(); ++v) {
    constexpr double kMost = SkinChecker::kAround * SkinChecker::kAround;
    double nearest = kMost;
    for (const std::uint32_t f : faults) {
      nearest = std::min(nearest, (neutral[v] - neutral[f]).squaredNorm());
    }
    if (nearest >= kMost) continue;
    work.place[v] = static_cast<std::uint32_t>(work.active.size());
    work.active.push_back(v);
  }
}

void ask_contacts(Work& work, const Look& look) {
  std::map<std::uint32_t, std::pair<Vec3, double>> sums;
  const auto ask = [&](std::uint32_t v, const Vec3& by, double weight) {
    if (work.place[v] == Work::kStill) return;
    auto& [sum, total] = sums.try_emplace(v, Vec3::Zero(), 0.0).first->second;
    sum += weight * by;
    total += weight;
  };
  for (const Contact& c : look.contacts) {
    if (!is_deep(look.faults, work.allowed, c.vertex)) continue;
    const double allowed =
        double{work.allowed.depth[c.vertex]} + kBeyond * double{SkinChecker::kDepth};
    const Vec3 by = (double{c.depth} - allowed) * c.normal;
    ask(c.vertex, c.is_skin ? Vec3(by / 2.0) : by, 1.0);
    if (!c.is_skin) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      ask(c.other[k], -by / 2.0, c.share[static_cast<Eigen::Index>(k)] + 1e-3);
    }
  }
  for (const auto& [v, sum] : sums) work.asked.places[v] = work.x[v] + sum.first / sum.second;
}

/// Sets shorter edges as goals for two kinds of faces: faces stretched beyond the allowed stretch,
/// and faces stretched more than every face was before the repair.
void ask_stretched(Work& work, const Look& look, const std::vector<Vec3>& now) {
  const Topology& topology = work.topology;
  for (std::size_t f = 0; f < topology.face_count(); ++f) {
    const bool is_wider = look.faults.stretch[f] > kWider * work.widest;
    if (!is_wider && !is_stretched(topology, look.faults, work.allowed, f)) continue;
    const double limit =
        0.97 * std::max(double{SkinChecker::kStretch}, double{work.allowed.stretch[f]});
    const double size = std::sqrt(limit / double{look.faults.stretch[f]});
    const std::uint32_t begin = topology.skin.face_offsets[f];
    const std::uint32_t end = topology.skin.face_offsets[f + 1];
    for (std::uint32_t c = begin; c < end; ++c) {
      const std::uint32_t a = topology.skin.corners[c];
      const std::uint32_t b = topology.skin.corners[c + 1 == end ? begin : c + 1];
      const Vec3 wanted = size * (now[a] - now[b]);
      work.asked.edges[{a, b}] = wanted - (work.pose.skin[a] - work.pose.skin[b]);
    }
  }
}

/// The vector to a vertex from the mean of its neighbours.
Vec3 beside(const Topology& topology, const std::vector<Vec3>& positions, std::uint32_t v) {
  const std::uint32_t first = topology.first_neighbour[v], last = topology.first_neighbour[v + 1];
  Vec3 out = positions[v];
  for (std::uint32_t n = first; n < last; ++n) {
    out -= positions[topology.neighbours[n]] / double(last - first);
  }
  return out;
}

/// Sets goals that open folds: each vertex of the two faces is drawn towards the mean of its
/// neighbours. The goal for its distance from this mean is half of its neutral or of its present
/// distance, whichever is smaller.
void ask_folded(Work& work, const Look& look, const std::vector<Vec3>& now) {
  const Topology& topology = work.topology;
  for (std::size_t h = 0; h < topology.hinges.size(); ++h) {
    if (!is_folded(look.faults, work.allowed, h)) continue;
    for (const std::uint32_t f : topology.hinges[h].faces) {
      const std::uint32_t end = topology.skin.face_offsets[f + 1];
      for (std::uint32_t c = topology.skin.face_offsets[f]; c < end; ++c) {
        const std::uint32_t v = topology.skin.corners[c];
        const Vec3 off = beside(topology, now, v);
        const double rest = beside(topology, topology.neutral, v).norm();
        const double kept = 0.5 * std::min(1.0, rest / std::max(off.norm(), 1e-9));
        work.asked.even[v] = now[v] - (1.0 - kept) * off - work.pose.skin[v];
      }
    }
  }
}

/// Solves one sparse linear system: the smoothest change of a displacement that meets the goals of
/// places, edges and flatness in the least squares sense.
/// In:     base    [V] the displacement in mm that is changed
/// In/out: work.x  the changed displacement; stays as it is if the system has no solution
void solve(Work& work, const std::vector<Vec3>& base) {
  const Topology& topology = work.topology;
  const auto count = static_cast<Eigen::Index>(work.active.size());
  std::vector<Eigen::Triplet<double>> smooth, asked;
  Rows right = Rows::Zero(count, 3);
  const auto at = [&](std::uint32_t v) { return static_cast<Eigen::Index>(work.place[v]); };
  const auto moves = [&](std::uint32_t v) { return work.place[v] != Work::kStill; };
  for (const std::uint32_t v : work.active) {
    smooth.emplace_back(at(v), at(v), 1.0);
    const std::uint32_t first = topology.first_neighbour[v], last = topology.first_neighbour[v + 1];
    for (std::uint32_t n = first; n < last; ++n) {
      const std::uint32_t next = topology.neighbours[n];
      if (moves(next)) smooth.emplace_back(at(v), at(next), -1.0 / double(last - first));
    }
    asked.emplace_back(at(v), at(v), kRest);
  }
  const auto ask = [&](const std::map<std::uint32_t, Vec3>& rows, double weight) {
    for (const auto& [v, goal] : rows) {
      if (!moves(v)) continue;
      asked.emplace_back(at(v), at(v), weight);
      right.row(at(v)) += weight * (goal - base[v]).transpose();
    }
  };
  ask(work.asked.places, kPlace);
  ask(work.asked.even, kEven);
  for (const auto& [edge, goal] : work.asked.edges) {
    for (const auto& [a, b, sign] :
         {std::tuple{edge[0], edge[1], 1.0}, std::tuple{edge[1], edge[0], -1.0}}) {
      if (!moves(a)) continue;
      asked.emplace_back(at(a), at(a), kEdge);
      if (moves(b)) asked.emplace_back(at(a), at(b), -kEdge);
      right.row(at(a)) += sign * kEdge * (goal - base[edge[0]] + base[edge[1]]).transpose();
    }
  }
  Eigen::SparseMatrix<double> bend(count, count), system(count, count);
  bend.setFromTriplets(smooth.begin(), smooth.end());
  system.setFromTriplets(asked.begin(), asked.end());
  system += Eigen::SparseMatrix<double>(bend.transpose() * bend);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(system);
  if (solver.info() != Eigen::Success) return;
  const Rows found = solver.solve(right);
  for (const std::uint32_t v : work.active) work.x[v] = base[v] + found.row(at(v)).transpose();
}

/// Whether a repair worsens no sum of faults, and worsens the deepest vertex and the most stretched
/// face of the skin by no more than small tolerances. The sums leave out the allowed faults, which
/// one part of the pose has alone. Without the limits on depth and stretch, undoing another part
/// could bring these faults into the pose.
bool is_no_worse(const Work& work, const Look& now, const FaultSums& before) {
  const FaultSums& a = now.sums;
  return a.volume <= before.volume && a.deepest <= before.deepest + 0.01 &&
         a.stretched <= before.stretched && a.widest <= 1.005 * before.widest &&
         a.folded <= before.folded &&
         std::ranges::max(now.faults.depth) <= work.deepest + kDeeper &&
         std::ranges::max(now.faults.stretch) <= kWider * work.widest;
}

/// The sum of three shares of the faults before a repair that are left after it: of the volume, of
/// the stretched faces and of the folded edges. 0 if no fault is left, at most 3 without repair.
double share_left(const FaultSums& now, const FaultSums& before) {
  double out = before.volume > 0.0 ? now.volume / before.volume : 0.0;
  if (before.stretched > 0) out += double(now.stretched) / double(before.stretched);
  if (before.folded > 0) out += double(now.folded) / double(before.folded);
  return out;
}

/// The share of a motion that is undone at a vertex: 1 for vertices up to kWhole from a fault, 0
/// for vertices `reach` or more from it.
/// In: distance  from the vertex to the fault, in mm
///     reach     mm
double fading(double distance, double reach) {
  const double t = std::clamp((distance - kWhole) / (reach - kWhole), 0.0, 1.0);
  return 1.0 - t * t * (3.0 - 2.0 * t);
}

/// The cheapest repair so far: displacement x, its sums of faults, the share of faults that it
/// leaves, and its cost. Faults that are left and motion that is undone add to the cost.
struct Best {
  std::vector<Vec3> x;
  FaultSums sums;
  double left = 0.0, cost = 0.0;
  // The cheapest displacement of all, even if it makes some faults worse. If these faults can be
  // removed afterwards, it may give the best repair.
  std::vector<Vec3> any;
  double any_cost = 0.0;

  void take(const Work& work, const Look& look, const FaultSums& before) {
    double undone = 0.0, moved = 0.0;
    for (const std::uint32_t v : work.active) {
      undone += work.x[v].squaredNorm();
      moved += (work.pose.skin[v] - work.topology.neutral[v]).squaredNorm();
    }
    const double here = share_left(look.sums, before);
    const double whole =
        here + (here > 0.0 ? kEnough : 0.0) + kUndone * undone / std::max(moved, 1e-9);
    if (whole < any_cost) {
      any_cost = whole;
      any = work.x;
    }
    if (whole >= cost || !is_no_worse(work, look, before)) return;
    cost = whole;
    left = here;
    sums = look.sums;
    x = work.x;
  }
};

/// Undoes a part of the pose near the pose's faults, more in each round, until no fault is left or
/// kFades rounds are done.
/// In:     undo   [V] the displacement in mm that undoes the part everywhere
///         reach  mm: vertices at least this far from every fault keep their whole motion
/// In/out: best   gets the displacement of a round if it is cheaper than the best one so far
void fade(Work& work, const Look& first, const std::vector<Vec3>& undo, double reach, Best& best) {
  const auto& neutral = work.topology.neutral;
  std::map<std::uint32_t, double> seeds;
  Look look = first;
  for (std::size_t r = 0; r < kFades; ++r) {
    for (const std::uint32_t v : fault_vertices(work, look)) {
      if (work.place[v] == Work::kStill) continue;
      double& share = seeds[v];
      share = std::min(1.0, share + 1.0 / double(kSteps));
    }
    for (const std::uint32_t v : work.active) {
      double share = 0.0;
      for (const auto& [seed, whole] : seeds) {
        const double away = (neutral[v] - neutral[seed]).norm();
        if (away < reach) share = std::max(share, whole * fading(away, reach));
      }
      work.x[v] = share * undo[v];
    }
    look = look_at(work, work.region);
    best.take(work, look, first.sums);
    if (share_left(look.sums, first.sums) == 0.0) return;
  }
}

/// The displacements that undo parts of the pose: at each vertex a mix that prefers the parts that
/// move it least, so that the main motion remains; each part alone; the mean of all parts.
/// In: without  [parts][V] mm, the positions of the skin without each of the parts
/// Out: [parts + 2][V] mm: the mix, each part, the mean
std::vector<std::vector<Vec3>> ways_back(const Placed& pose,
                                         const std::vector<std::vector<Vec3>>& without) {
  const std::size_t count = pose.skin.size();
  std::vector<std::vector<Vec3>> out(without.size() + 2, std::vector<Vec3>(count, Vec3::Zero()));
  for (std::size_t v = 0; v < count; ++v) {
    double total = 0.0;
    for (std::size_t i = 0; i < without.size(); ++i) {
      const Vec3 undo = without[i][v] - pose.skin[v];
      const double share = 1.0 / (undo.squaredNorm() + 1e-4);
      out[0][v] += share * undo;
      total += share;
      out[i + 1][v] = undo;
      out.back()[v] += undo / double(without.size());
    }
    if (total > 0.0) out[0][v] /= total;
  }
  return out;
}

/// Removes the remaining faults by rounds of least squares solves.
/// In:     first  the check of the pose before the repair
///         base   [V] mm, the displacement to start from
/// In/out: best   gets the displacement of a round if it is cheaper than the best one so far
void polish(Work& work, const Look& first, const std::vector<Vec3>& base, Best& best) {
  work.x = base;
  work.asked = {};
  for (std::size_t r = 0; r <= kRounds; ++r) {
    const Look look = look_at(work, work.region);
    if (r > 0) best.take(work, look, first.sums);
    if (best.left == 0.0 || r == kRounds) return;
    const std::vector<Vec3> now = work.moved();
    ask_contacts(work, look);
    ask_stretched(work, look, now);
    ask_folded(work, look, now);
    solve(work, base);
  }
}

/// The displacement that gives each vertex without a fault the share kKept of its motion again.
/// In: faults  vertices with a fault before the repair, sorted
///     x       [V] mm, the displacements of the repair
/// Out: [V] mm, 0 for a vertex that keeps enough motion
std::vector<Vec3> lacking(const Work& work, const std::vector<std::uint32_t>& faults,
                          const std::vector<Vec3>& x) {
  std::vector<Vec3> out(x.size(), Vec3::Zero());
  for (const std::uint32_t v : work.active) {
    if (std::ranges::binary_search(faults, v)) continue;
    const Vec3 way = work.pose.skin[v] - work.topology.neutral[v];
    const double kept = 1.0 + x[v].dot(way) / std::max(way.squaredNorm(), 1e-9);
    if (kept < kKept) out[v] = (kKept - kept) * way;
  }
  return out;
}

/// Gives vertices without a fault their motion back. A repair undoes motion around each fault, also
/// at vertices that had no fault; there it is restored, unless that causes a new fault.
void give_back(Work& work, const Look& first, const std::vector<std::uint32_t>& faults,
               Best& best) {
  const Topology& topology = work.topology;
  const std::vector<Vec3> held = best.x, more = lacking(work, faults, held);
  if (std::ranges::all_of(more, [](const Vec3& m) { return m.isZero(0.0); })) return;
  std::vector<double> share(held.size(), 1.0);
  for (std::size_t r = 0; r < kBacks; ++r) {
    for (const std::uint32_t v : work.active) work.x[v] = held[v] + share[v] * more[v];
    const Look look = look_at(work, work.region);
    if (share_left(look.sums, first.sums) <= best.left && is_no_worse(work, look, first.sums)) {
      return best.take(work, look, first.sums);
    }
    std::vector<std::uint32_t> near = fault_vertices(work, look);
    for (std::size_t i = 0, count = near.size(); i < count; ++i) {
      const auto begin = topology.neighbours.begin();
      near.insert(near.end(), begin + topology.first_neighbour[near[i]],
                  begin + topology.first_neighbour[near[i] + 1]);
    }
    std::ranges::sort(near);
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const std::uint32_t v : near) share[v] = std::max(0.0, share[v] - kLess);
  }
}

/// The best repair that fading and least squares solves find. Its faults are searched only in
/// work.region.
/// In: ways  [ways][V] mm, displacements that undo parts of the pose
/// Out: x is empty if no repair helps
Best mend(Work& work, const Look& first, const std::vector<std::uint32_t>& faults,
          const std::vector<std::vector<Vec3>>& ways) {
  Best best;
  const double whole = share_left(first.sums, first.sums);
  best.left = best.cost = best.any_cost = whole;
  best.x = best.any = std::vector<Vec3>(work.x.size(), Vec3::Zero());
  for (const double reach : {kNarrow, SkinChecker::kAround}) {
    for (const std::vector<Vec3>& undo : ways) {
      if (best.cost > kEnough) fade(work, first, undo, reach, best);
    }
  }
  const std::vector<Vec3> base = best.x, other = best.any;
  if (best.left > 0.0) polish(work, first, base, best);
  if (best.left > 0.0 && other != base) polish(work, first, other, best);
  if (best.left >= whole) return {};
  give_back(work, first, faults, best);
  return best;
}

/// Whether the best repair makes nothing worse than before the repair (see is_no_worse) in the
/// whole skin. The whole skin is checked because the moved vertices may enter skin outside of
/// work.region. If true, faults beyond the allowed ones may still be left.
/// In:     first      faults of the pose before the repair
///         allowed    the faults that the caller allows
/// In/out: best.sums  if true: the faults beyond `allowed` after the repair
bool settle(Work& work, const Look& first, const SkinFaults& allowed, Best& best) {
  work.x = best.x;
  const Look look = look_at(work, work.topology.whole);
  if (!is_no_worse(work, look, first.sums)) return false;
  best.sums = sum_faults(work.topology, look.faults, allowed);
  return true;
}

/// Sets work.deepest and work.widest to the largest depth and stretch of the pose before the
/// repair, and limits each allowed depth and stretch to them.
/// In: first  faults of the pose before the repair
void limit(Work& work, const SkinFaults& first) {
  work.deepest = std::ranges::max(first.depth);
  work.widest = std::max(SkinChecker::kStretch, std::ranges::max(first.stretch));
  for (float& depth : work.allowed.depth) depth = std::min(depth, work.deepest);
  for (float& stretch : work.allowed.stretch) stretch = std::min(stretch, work.widest);
}

}  // namespace

Repair repair_pose(const Topology& topology, const Placed& pose, const SkinFaults& allowed,
                   const std::vector<std::vector<Vec3>>& without) {
  const SolidSurfaces solids(topology, pose);
  Work work{topology, pose, solids, allowed, 0.0f, 0.0f, {}, {}, {}, {}, {}};
  work.x.assign(topology.neutral.size(), Vec3::Zero());
  const Look first = look_at(work, topology.whole);
  Repair out;
  out.before = out.after = first.sums;
  out.displacement.assign(topology.neutral.size(), Vector3{});
  const auto faults = fault_vertices(work, first);
  if (faults.empty()) return out;
  limit(work, first.faults);
  mark(work, faults);
  const auto ways = ways_back(pose, without);
  work.region = region_around(topology, pose, work.active);
  Best best = mend(work, first, faults, ways);
  if (!best.x.empty() && !settle(work, first, allowed, best)) {
    work.region = topology.whole;  // slower, and rare
    best = mend(work, first, faults, ways);
    if (!best.x.empty() && !settle(work, first, allowed, best)) best.x.clear();
  }
  if (best.x.empty()) return out;
  out.after = best.sums;
  for (std::size_t v = 0; v < best.x.size(); ++v) {
    for (std::size_t k = 0; k < 3; ++k) {
      out.displacement[v][k] = best.x[v][static_cast<Eigen::Index>(k)] / topology.skin.mm;
    }
  }
  return out;
}

}  // namespace risorius::author::detail
