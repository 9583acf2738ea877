// SPDX-License-Identifier: MIT
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

constexpr std::size_t kFades = 9, kSteps = 6;  // a part is undone in so many
constexpr double kUndone = 2.0;   // what all undone motion costs; all faults of a kind cost 1
constexpr double kEnough = 0.15;  // a cost at which nothing else is tried
constexpr double kWhole = 2.0;    // mm around a fault that are undone alike
constexpr std::size_t kRounds = 6;
// What an asked place, an asked edge, an asked evenness and rest weigh beside smoothness.
constexpr double kPlace = 1.0, kEdge = 1.0, kEven = 0.5, kRest = 0.002;
constexpr double kBeyond = 0.5;  // of kDepth: faults end well within what is left alone

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// What is asked of the displacement x: of vertices a place, of edges a difference, of vertices
/// that lie where their neighbours are.
struct Asked {
  std::map<std::uint32_t, Vec3> places;
  std::map<std::array<std::uint32_t, 2>, Vec3> edges;
  std::map<std::uint32_t, Vec3> even;
};

/// Everything of one repair.
struct Work {
  const Topology& topology;
  const Placed& pose;
  const SkinFaults& allowed;
  std::vector<std::uint32_t> active;  // vertices that may move
  std::vector<std::uint32_t> place;   // [V] in active, or kStill
  std::vector<Vec3> x;                // [V] mm
  Asked asked;
  Region region;  // what may change
  static constexpr std::uint32_t kStill = 0xffffffffu;

  Placed moved() const {
    Placed out = pose;
    for (std::size_t v = 0; v < x.size(); ++v) out.skin[v] += x[v];
    return out;
  }
};

/// One look: contacts, faults and their sums.
struct Look {
  std::vector<Contact> contacts;
  SkinFaults faults;
  FaultSums sums;
};

Look look_at(const Work& work, const Region& region, const Placed& pose) {
  Look out;
  out.contacts = find_contacts(work.topology, region, pose);
  out.faults = find_faults(work.topology, pose, out.contacts);
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

/// Which vertices may move: those near a fault.
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

/// Faces that are too large: their edges are to be shorter.
void ask_stretched(Work& work, const Look& look, const Placed& now) {
  const Topology& topology = work.topology;
  for (std::size_t f = 0; f < topology.face_count(); ++f) {
    if (!is_stretched(topology, look.faults, work.allowed, f)) continue;
    const double limit =
        0.97 * std::max(double{SkinChecker::kStretch}, double{work.allowed.stretch[f]});
    const double size = std::sqrt(limit / double{look.faults.stretch[f]});
    const std::uint32_t begin = topology.skin.face_offsets[f];
    const std::uint32_t end = topology.skin.face_offsets[f + 1];
    for (std::uint32_t c = begin; c < end; ++c) {
      const std::uint32_t a = topology.skin.corners[c];
      const std::uint32_t b = topology.skin.corners[c + 1 == end ? begin : c + 1];
      const Vec3 wanted = size * (now.skin[a] - now.skin[b]);
      work.asked.edges[{a, b}] = wanted - (work.pose.skin[a] - work.pose.skin[b]);
    }
  }
}

/// How a vertex lies beside the middle of those around it.
Vec3 beside(const Topology& topology, const std::vector<Vec3>& positions, std::uint32_t v) {
  const std::uint32_t first = topology.first_neighbour[v], last = topology.first_neighbour[v + 1];
  Vec3 out = positions[v];
  for (std::uint32_t n = first; n < last; ++n) {
    out -= positions[topology.neighbours[n]] / double(last - first);
  }
  return out;
}

/// A fold opens where vertices come to the middle of those around, as far as they lay there.
void ask_folded(Work& work, const Look& look, const Placed& now) {
  const Topology& topology = work.topology;
  for (std::size_t h = 0; h < topology.hinges.size(); ++h) {
    if (!is_folded(look.faults, work.allowed, h)) continue;
    for (const std::uint32_t f : topology.hinges[h].faces) {
      const std::uint32_t end = topology.skin.face_offsets[f + 1];
      for (std::uint32_t c = topology.skin.face_offsets[f]; c < end; ++c) {
        const std::uint32_t v = topology.skin.corners[c];
        const Vec3 off = beside(topology, now.skin, v);
        const double rest = beside(topology, topology.neutral, v).norm();
        const double kept = 0.5 * std::min(1.0, rest / std::max(off.norm(), 1e-9));
        work.asked.even[v] = now.skin[v] - (1.0 - kept) * off - work.pose.skin[v];
      }
    }
  }
}

/// The displacement that all that is asked agrees on, as smooth as can be.
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

bool is_no_worse(const FaultSums& a, const FaultSums& b) {
  return a.volume <= b.volume && a.deepest <= b.deepest + 0.01 && a.stretched <= b.stretched &&
         a.widest <= 1.005 * b.widest && a.folded <= b.folded;
}

/// How much of what was wrong is left; 0 where nothing is.
double share_left(const FaultSums& now, const FaultSums& before) {
  double out = before.volume > 0.0 ? now.volume / before.volume : 0.0;
  if (before.stretched > 0) out += double(now.stretched) / double(before.stretched);
  if (before.folded > 0) out += double(now.folded) / double(before.folded);
  return out;
}

/// How much of an undoing a vertex takes: all of it at a fault, none kAround away.
double fading(double distance) {
  const double t = std::clamp((distance - kWhole) / (SkinChecker::kAround - kWhole), 0.0, 1.0);
  return 1.0 - t * t * (3.0 - 2.0 * t);
}

/// The best that was found so far: few faults left, and little undone.
struct Best {
  std::vector<Vec3> x;
  FaultSums sums;
  double left = 0.0, cost = 0.0;

  void take(const Work& work, const Look& look, const FaultSums& before) {
    if (!is_no_worse(look.sums, before)) return;
    double undone = 0.0, moved = 0.0;
    for (const std::uint32_t v : work.active) {
      undone += work.x[v].squaredNorm();
      moved += (work.pose.skin[v] - work.topology.neutral[v]).squaredNorm();
    }
    const double here = share_left(look.sums, before);
    const double whole = here + kUndone * undone / std::max(moved, 1e-9);
    if (whole >= cost) return;
    cost = whole;
    left = here;
    sums = look.sums;
    x = work.x;
  }
};

/// Undoes a part where faults are, further and further until there are none.
void fade(Work& work, const Look& first, const std::vector<Vec3>& undo, Best& best) {
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
        if (away < SkinChecker::kAround) share = std::max(share, whole * fading(away));
      }
      work.x[v] = share * undo[v];
    }
    look = look_at(work, work.region, work.moved());
    best.take(work, look, first.sums);
    if (share_left(look.sums, first.sums) == 0.0) return;
  }
}

/// Ways in which parts may be undone: at each vertex those that do little there, so that what does
/// most stays; each alone; all alike.
/// In: without  where the skin lies without each of the parts
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

/// Pushes what is left out of what it is in, softly, from the best that there is.
void polish(Work& work, const Look& first, Best& best) {
  if (best.x.empty()) best.x.assign(work.x.size(), Vec3::Zero());
  work.x = best.x;
  const std::vector<Vec3> base = best.x;
  work.asked = {};
  for (std::size_t r = 0; r < kRounds; ++r) {
    const Placed now = work.moved();
    const Look look = look_at(work, work.region, now);
    if (r > 0) best.take(work, look, first.sums);
    if (best.left == 0.0) return;
    ask_contacts(work, look);
    ask_stretched(work, look, now);
    ask_folded(work, look, now);
    solve(work, base);
  }
  best.take(work, look_at(work, work.region, work.moved()), first.sums);
}

}  // namespace

Repair repair_pose(const Topology& topology, const Placed& pose, const SkinFaults& allowed,
                   const std::vector<std::vector<Vec3>>& without) {
  Work work{topology, pose, allowed, {}, {}, {}, {}, {}};
  work.x.assign(topology.neutral.size(), Vec3::Zero());
  const Look first = look_at(work, topology.whole, pose);
  Repair out;
  out.before = out.after = first.sums;
  out.displacement.assign(topology.neutral.size(), Vector3{});
  const auto faults = fault_vertices(work, first);
  if (faults.empty()) return out;
  mark(work, faults);
  work.region = region_around(topology, pose, work.active);
  Best best;
  best.left = best.cost = share_left(first.sums, first.sums);
  for (const std::vector<Vec3>& undo : ways_back(pose, without)) {
    if (best.cost > kEnough) fade(work, first, undo, best);
  }
  if (best.left > 0.0) polish(work, first, best);
  if (best.left >= share_left(first.sums, first.sums)) return out;
  out.after = best.sums;
  for (std::size_t v = 0; v < best.x.size(); ++v) {
    for (std::size_t k = 0; k < 3; ++k) {
      out.displacement[v][k] = best.x[v][static_cast<Eigen::Index>(k)] / topology.skin.mm;
    }
  }
  return out;
}

}  // namespace risorius::author::detail
