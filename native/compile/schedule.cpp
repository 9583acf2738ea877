// SPDX-License-Identifier: MIT
// The order of evaluation: what is watched, and the lists of steps of each LOD.
#include <algorithm>
#include <functional>
#include <queue>
#include <span>

#include "compile/parts.h"

namespace risorius::compile {

namespace {

using detail::StepLods;
using detail::Used;
using rig::MlOperation;
using rig::RigData;
using rig::StepKind;

std::span<const std::uint16_t> factors(const RigData& r, const rig::Psd& p) {
  return {r.psd_factors.data() + p.factors_begin, p.factor_count};
}

// Everything that reads and writes controls, as nodes: operations, solvers, correctives.
class Graph {
 public:
  explicit Graph(const RigData& r)
      : r_(r),
        operations_(static_cast<std::uint32_t>(r.ml_operations.size())),
        solvers_(static_cast<std::uint32_t>(r.rbf_solvers.size())) {
    writers_.resize(r.control_count);
    first_.resize(size());
    for (std::uint32_t n = 0; n < size(); ++n) {
      for_writes(n, [&](std::uint32_t c) {
        if (writers_[c].empty() || writers_[c].back() != n) writers_[c].push_back(n);
      });
    }
    find_first();
  }

  std::uint32_t size() const {
    return operations_ + solvers_ + static_cast<std::uint32_t>(r_.psds.size());
  }
  std::uint32_t operation(std::uint32_t i) const { return i; }
  std::uint32_t solver(std::uint32_t i) const { return operations_ + i; }
  std::uint32_t psd(std::uint32_t i) const { return operations_ + solvers_ + i; }
  bool is_psd(std::uint32_t n) const { return n >= operations_ + solvers_; }
  std::uint32_t step(std::uint32_t n) const {
    if (n < operations_) return rig::make_step(StepKind::kOperation, n);
    if (!is_psd(n)) return rig::make_step(StepKind::kSolver, n - operations_);
    return rig::make_step(StepKind::kPsd, n - operations_ - solvers_);
  }
  const std::vector<std::uint32_t>& writers(std::uint32_t control) const {
    return writers_[control];
  }
  /// Nodes that must run before n.
  const std::vector<std::uint32_t>& before(std::uint32_t n) const { return first_[n]; }

  template <class F>
  void for_writes(std::uint32_t n, F f) const {
    if (n < operations_) {
      const MlOperation& op = r_.ml_operations[n];
      if (op.kind != MlOperation::kScatter) return;
      for (std::uint32_t i = 0; i < op.item_count; ++i) {
        const std::uint32_t control = r_.ml_controls[op.items_begin + i].control;
        if (control != rig::kNone) f(control);
      }
    } else if (!is_psd(n)) {
      const rig::RbfSolver& s = r_.rbf_solvers[n - operations_];
      for (std::uint32_t p = s.poses_begin; p < s.poses_begin + s.pose_count; ++p) {
        const rig::RbfPose& pose = r_.rbf_poses[p];
        for (std::uint32_t i = 0; i < pose.output_count; ++i) {
          f(r_.rbf_outputs[pose.outputs_begin + i].control);
        }
      }
    } else {
      f(r_.psds[n - operations_ - solvers_].output);
    }
  }

 private:
  template <class F>
  void for_reads(std::uint32_t n, F f) const {
    if (n < operations_) {
      const MlOperation& op = r_.ml_operations[n];
      if (op.kind != MlOperation::kGather) return;
      for (std::uint32_t i = 0; i < op.item_count; ++i) {
        f(r_.ml_controls[op.items_begin + i].control);
      }
    } else if (!is_psd(n)) {
      const rig::RbfSolver& s = r_.rbf_solvers[n - operations_];
      for (std::uint32_t i = 0; i < s.input_count; ++i) f(r_.rbf_inputs[s.inputs_begin + i]);
      for (std::uint32_t p = s.poses_begin; p < s.poses_begin + s.pose_count; ++p) {
        const rig::RbfPose& pose = r_.rbf_poses[p];
        for (std::uint32_t i = 0; i < pose.input_count; ++i) {
          f(r_.rbf_pose_inputs[pose.inputs_begin + i]);
        }
      }
    } else {
      for (const std::uint16_t c : factors(r_, r_.psds[n - operations_ - solvers_])) f(c);
    }
  }

  // Writers of what it reads, and of what it writes the one before it in the file.
  void find_first() {
    for (std::uint32_t n = 0; n < size(); ++n) {
      for_reads(n, [&](std::uint32_t c) {
        first_[n].insert(first_[n].end(), writers_[c].begin(), writers_[c].end());
      });
    }
    for (const auto& list : writers_) {
      for (std::size_t i = 1; i < list.size(); ++i) first_[list[i]].push_back(list[i - 1]);
    }
    for (std::uint32_t n = 0; n < operations_; ++n) add_operations_before(n);
    for (auto& list : first_) {
      std::ranges::sort(list);
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
  }
  // Operations whose values it reads.
  void add_operations_before(std::uint32_t n) {
    const MlOperation& op = r_.ml_operations[n];
    const auto& all = r_.ml_operations;
    for (std::uint32_t s = 0; s < op.segment_count; ++s) {
      const rig::MlSegment& segment = r_.ml_segments[op.segments_begin + s];
      if (segment.count == 0) continue;
      const auto after =
          std::ranges::upper_bound(all, segment.begin, {}, &MlOperation::values_begin);
      first_[n].push_back(static_cast<std::uint32_t>(after - all.begin()) - 1);
    }
  }

  const RigData& r_;
  std::uint32_t operations_, solvers_;
  std::vector<std::vector<std::uint32_t>> writers_, first_;
};

struct Order {
  std::vector<std::uint32_t> sorted;  // first what others need, ties by number
  std::vector<std::uint32_t> cyclic;  // members of cycles, and what hangs on them
};

// In: nodes  ascending; others are taken as done
Order order_of(const Graph& g, const std::vector<std::uint32_t>& nodes) {
  std::vector<bool> here(g.size(), false);
  for (const std::uint32_t n : nodes) here[n] = true;
  std::vector<std::vector<std::uint32_t>> users(g.size());
  std::vector<std::uint32_t> waiting(g.size(), 0);
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
  for (const std::uint32_t n : nodes) {
    for (const std::uint32_t m : g.before(n)) {
      if (!here[m]) continue;
      users[m].push_back(n);
      ++waiting[n];
    }
    if (waiting[n] == 0) ready.push(n);
  }
  Order order;
  while (!ready.empty()) {
    const std::uint32_t n = ready.top();
    ready.pop();
    order.sorted.push_back(n);
    for (const std::uint32_t user : users[n]) {
      if (--waiting[user] == 0) ready.push(user);
    }
  }
  for (const std::uint32_t n : nodes) {
    if (waiting[n] > 0) order.cyclic.push_back(n);
  }
  return order;
}

// Operations and solvers that need no corrective, directly or not.
std::vector<bool> early_nodes(const Graph& g) {
  std::vector<bool> early(g.size(), false);
  std::vector<std::uint32_t> all;
  for (std::uint32_t n = 0; n < g.size(); ++n) all.push_back(n);
  // In an order where all of what a node needs was looked at: a cycle is never early.
  for (const std::uint32_t n : order_of(g, all).sorted) {
    const auto& before = g.before(n);
    early[n] = !g.is_psd(n) && std::ranges::all_of(before, [&](auto m) { return early[m]; });
  }
  return early;
}

// Which factor watches each corrective; kNone where a factor may change after the watchers looked.
std::vector<std::uint32_t> choose_watchers(const RigData& r, const Graph& g,
                                           const std::vector<bool>& early) {
  std::vector<std::uint32_t> load(r.control_count, 0), watchers;
  const auto late = [&](std::uint16_t control) {
    return detail::is_corrective(r, control) ||
           std::ranges::any_of(g.writers(control), [&](auto n) { return !early[n]; });
  };
  for (const rig::Psd& p : r.psds) {
    std::uint32_t watcher = rig::kNone;
    const auto list = factors(r, p);
    if (p.output >= r.raw_count && std::ranges::none_of(list, late)) {
      for (const std::uint16_t f : list) {
        if (watcher == rig::kNone || load[f] < load[watcher]) watcher = f;
      }
    }
    if (watcher != rig::kNone) ++load[watcher];
    watchers.push_back(watcher);
  }
  return watchers;
}

std::uint16_t another_factor(const RigData& r, const rig::Psd& p, std::uint32_t watcher) {
  for (std::uint32_t f = p.factors_begin; f < p.factors_begin + p.factor_count; ++f) {
    if (r.psd_factors[f] != watcher) return r.psd_factors[f];
  }
  return static_cast<std::uint16_t>(watcher);
}

void add_watched(const std::vector<bool>& used, const std::vector<std::uint32_t>& watchers,
                 RigData& r) {
  std::vector<std::vector<rig::Watch>> watched(r.control_count);
  for (std::uint32_t p = 0; p < r.psds.size(); ++p) {
    if (!used[r.psds[p].output] || watchers[p] == rig::kNone) continue;
    watched[watchers[p]].push_back(
        {static_cast<std::uint16_t>(p), another_factor(r, r.psds[p], watchers[p])});
  }
  for (const auto& list : watched) {
    r.watch_begins.push_back(static_cast<std::uint32_t>(r.watched.size()));
    r.watched.insert(r.watched.end(), list.begin(), list.end());
  }
  r.watch_begins.push_back(static_cast<std::uint32_t>(r.watched.size()));
}

void add_list(const Graph& g, const std::vector<std::uint32_t>& nodes, RigData& r) {
  for (const std::uint32_t n : nodes) r.steps.push_back(g.step(n));
  r.step_begins.push_back(static_cast<std::uint32_t>(r.steps.size()));
}

// Correctives in the order in which their watchers look.
void sort_correctives(RigData& r) {
  std::vector<std::uint32_t> number(r.psds.size(), rig::kNone);
  std::vector<rig::Psd> psds;
  std::vector<std::uint16_t> all_factors;
  const auto add = [&](std::uint32_t p) {
    if (number[p] != rig::kNone) return;
    number[p] = static_cast<std::uint32_t>(psds.size());
    psds.push_back(r.psds[p]);
    const auto list = factors(r, r.psds[p]);
    psds.back().factors_begin = static_cast<std::uint32_t>(all_factors.size());
    all_factors.insert(all_factors.end(), list.begin(), list.end());
  };
  for (const rig::Watch& w : r.watched) add(w.psd);
  for (std::uint32_t p = 0; p < r.psds.size(); ++p) add(p);
  r.psds = std::move(psds);
  r.psd_factors = std::move(all_factors);
  for (rig::Watch& w : r.watched) w.psd = static_cast<std::uint16_t>(number[w.psd]);
  for (std::uint32_t& step : r.steps) {
    if (rig::step_kind(step) != StepKind::kPsd) continue;
    step = rig::make_step(StepKind::kPsd, number[rig::step_index(step)]);
  }
}

}  // namespace

void detail::schedule(const Used& used, const StepLods& lods, RigData& r) {
  const Graph g(r);
  const std::vector<bool> early = early_nodes(g);
  const std::vector<std::uint32_t> watchers = choose_watchers(r, g, early);
  r.step_begins.push_back(0);
  for (std::uint32_t lod = 0; lod < r.lod_count; ++lod) {
    add_watched(used[lod], watchers, r);
    std::vector<std::uint32_t> reference, first, rest;
    for (const std::uint32_t i : lods.operations[lod]) reference.push_back(g.operation(i));
    for (const std::uint32_t i : lods.solvers[lod]) reference.push_back(g.solver(i));
    for (const std::uint32_t n : reference) (early[n] ? first : rest).push_back(n);
    std::ranges::sort(first);
    std::ranges::sort(rest);
    for (std::uint32_t p = 0; p < r.psds.size(); ++p) {
      if (used[lod][r.psds[p].output] && watchers[p] == rig::kNone) rest.push_back(g.psd(p));
    }
    const Order order = order_of(g, rest);
    add_list(g, order_of(g, first).sorted, r);
    add_list(g, order.sorted, r);
    add_list(g, order.cyclic, r);
    add_list(g, reference, r);
  }
  sort_correctives(r);
}

}  // namespace risorius::compile
