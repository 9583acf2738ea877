// SPDX-License-Identifier: MIT
// The order of evaluation: chooses the watched correctives, and lists the steps of each LOD. Steps
// are network operations, solvers and correctives. A watched corrective is evaluated only while one
// of its factors, its watcher, is not 0.
#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>
#include <queue>
#include <span>
#include <utility>

#include "compile/parts.h"

namespace risorius::compile {

namespace {

using core::Result;
using core::Status;
using detail::Budget;
using detail::StepLods;
using detail::Used;
using rig::MlOperation;
using rig::RigData;
using rig::StepKind;

std::span<const std::uint16_t> factors(const RigData& r, const rig::Psd& p) {
  return {r.psd_factors.data() + p.factors_begin, p.factor_count};
}

// Many lists of numbers, stored one after the other in one array.
class Lists {
 public:
  // In: lists   number of lists
  //     budget  charged 4 bytes for each entry
  //     each    each(add) must call add(list, number) for all entries. It is called twice: to count
  //             and to fill
  template <class Each>
  static Result<Lists> collect(std::size_t lists, Budget& budget, Each each) {
    Lists out;
    out.begins_.assign(lists + 1, 0);
    std::uint64_t count = 0;
    each([&](std::uint32_t list, std::uint32_t) { ++out.begins_[list + std::size_t{1}], ++count; });
    RISORIUS_TRY(budget.take_bytes(4 * count, "rbf_behavior.solvers"));
    std::partial_sum(out.begins_.begin(), out.begins_.end(), out.begins_.begin());
    out.items_.resize(static_cast<std::size_t>(count));
    std::vector<std::uint32_t> next(out.begins_.begin(), out.begins_.end() - 1);
    each([&](std::uint32_t list, std::uint32_t number) { out.items_[next[list]++] = number; });
    return out;
  }

  std::span<const std::uint32_t> of(std::uint32_t list) const {
    return std::span(items_).subspan(begins_[list], begins_[list + std::size_t{1}] - begins_[list]);
  }

 private:
  std::vector<std::uint32_t> begins_, items_;
};

// Operations, solvers and correctives as the nodes of a graph. A node that writes a control comes
// before the nodes that read it. The controls are nodes in between, so that n writers and n readers
// of one control have 2 n edges and not n * n.
class Graph {
 public:
  static Result<Graph> make(const RigData& r, Budget& budget) {
    Graph g(r);
    const auto lists = [&](std::size_t count, Lists& out, auto each) -> Status {
      auto made = Lists::collect(count, budget, each);
      if (!made) return std::move(made).propagate();
      out = std::move(made).value();
      return core::ok();
    };
    if (Status s = lists(g.size(), g.written_,
                         [&](auto add) {
                           g.for_once([&](std::uint32_t n, auto f) { g.for_writes(n, f); }, add);
                         });
        !s) {
      return std::move(s).propagate();
    }
    if (Status s = lists(r.control_count, g.readers_,
                         [&](auto add) {
                           g.for_once([&](std::uint32_t n, auto f) { g.for_reads(n, f); },
                                      [&](std::uint32_t n, std::uint32_t c) { add(c, n); });
                         });
        !s) {
      return std::move(s).propagate();
    }
    if (Status s = lists(g.size(), g.after_, [&](auto add) { g.for_edges(add); }); !s) {
      return std::move(s).propagate();
    }
    return g;
  }

  std::uint32_t size() const {
    return operations_ + solvers_ + static_cast<std::uint32_t>(r_->psds.size());
  }
  std::uint32_t control_count() const { return r_->control_count; }
  std::uint32_t operation(std::uint32_t i) const { return i; }
  std::uint32_t solver(std::uint32_t i) const { return operations_ + i; }
  std::uint32_t psd(std::uint32_t i) const { return operations_ + solvers_ + i; }
  bool is_psd(std::uint32_t n) const { return n >= operations_ + solvers_; }
  std::uint32_t step(std::uint32_t n) const {
    if (n < operations_) return rig::make_step(StepKind::kOperation, n);
    if (!is_psd(n)) return rig::make_step(StepKind::kSolver, n - operations_);
    return rig::make_step(StepKind::kPsd, n - operations_ - solvers_);
  }
  /// The controls that node n writes, each listed once.
  std::span<const std::uint32_t> written(std::uint32_t n) const { return written_.of(n); }
  /// The nodes that read the control, each listed once.
  std::span<const std::uint32_t> readers(std::uint32_t control) const {
    return readers_.of(control);
  }
  /// The nodes that must run after node n for another reason than reading a control that n writes;
  /// see for_edges.
  std::span<const std::uint32_t> after(std::uint32_t n) const { return after_.of(n); }

 private:
  explicit Graph(const RigData& r)
      : r_(&r),
        operations_(static_cast<std::uint32_t>(r.ml_operations.size())),
        solvers_(static_cast<std::uint32_t>(r.rbf_solvers.size())) {}

  // Calls f(n, control) once for each pair of a node and a control that it reads or writes.
  // In: each  each(n, g) calls g for the controls of node n
  template <class Each, class F>
  void for_once(Each each, F f) const {
    std::vector<std::uint32_t> last(r_->control_count, rig::kNone);
    for (std::uint32_t n = 0; n < size(); ++n) {
      each(n, [&](std::uint32_t c) {
        if (std::exchange(last[c], n) != n) f(n, c);
      });
    }
  }
  template <class F>
  void for_writes(std::uint32_t n, F f) const {
    if (n < operations_) {
      const MlOperation& op = r_->ml_operations[n];
      if (op.kind != MlOperation::kScatter) return;
      for (std::uint32_t i = 0; i < op.item_count; ++i) {
        const std::uint32_t control = r_->ml_controls[op.items_begin + i].control;
        if (control != rig::kNone) f(control);
      }
    } else if (!is_psd(n)) {
      const rig::RbfSolver& s = r_->rbf_solvers[n - operations_];
      for (std::uint32_t p = s.poses_begin; p < s.poses_begin + s.pose_count; ++p) {
        const rig::RbfPose& pose = r_->rbf_poses[p];
        for (std::uint32_t i = 0; i < pose.output_count; ++i) {
          f(r_->rbf_outputs[pose.outputs_begin + i].control);
        }
      }
    } else {
      f(r_->psds[n - operations_ - solvers_].output);
    }
  }
  template <class F>
  void for_reads(std::uint32_t n, F f) const {
    if (n < operations_) {
      const MlOperation& op = r_->ml_operations[n];
      if (op.kind != MlOperation::kGather) return;
      for (std::uint32_t i = 0; i < op.item_count; ++i) {
        f(r_->ml_controls[op.items_begin + i].control);
      }
    } else if (!is_psd(n)) {
      const rig::RbfSolver& s = r_->rbf_solvers[n - operations_];
      for (std::uint32_t i = 0; i < s.input_count; ++i) f(r_->rbf_inputs[s.inputs_begin + i]);
      for (std::uint32_t p = s.poses_begin; p < s.poses_begin + s.pose_count; ++p) {
        const rig::RbfPose& pose = r_->rbf_poses[p];
        for (std::uint32_t i = 0; i < pose.input_count; ++i) {
          f(r_->rbf_pose_inputs[pose.inputs_begin + i]);
        }
      }
    } else {
      for (const std::uint16_t c : factors(*r_, r_->psds[n - operations_ - solvers_])) f(c);
    }
  }

  // Calls f(before, after) for pairs of nodes whose order is fixed: nodes that write the same
  // control run in the order of the file, and operations run after the operations whose values they
  // read.
  template <class F>
  void for_edges(F f) const {
    std::vector<std::uint32_t> last(r_->control_count, rig::kNone);
    for (std::uint32_t n = 0; n < size(); ++n) {
      for (const std::uint32_t c : written_.of(n)) {
        const std::uint32_t before = std::exchange(last[c], n);
        if (before != rig::kNone) f(before, n);
      }
    }
    for (std::uint32_t n = 0; n < operations_; ++n) {
      const MlOperation& op = r_->ml_operations[n];
      const auto& all = r_->ml_operations;
      for (std::uint32_t s = 0; s < op.segment_count; ++s) {
        const rig::MlSegment& segment = r_->ml_segments[op.segments_begin + s];
        if (segment.count == 0) continue;
        const auto after =
            std::ranges::upper_bound(all, segment.begin, {}, &MlOperation::values_begin);
        f(static_cast<std::uint32_t>(after - all.begin()) - 1, n);
      }
    }
  }

  const RigData* r_;
  std::uint32_t operations_, solvers_;
  Lists written_, readers_, after_;
};

struct Order {
  std::vector<std::uint32_t> sorted;  // in the order of their dependencies; ties by number
  std::vector<std::uint32_t> cyclic;  // members of cycles, and the nodes that depend on them
};

// Counts for each node the conditions that are not met yet: controls that it reads and that a
// node must still write, and nodes that must run before it (Graph::after).
class Waiting {
 public:
  // In: nodes  the nodes to run, each once; all others count as having run
  Waiting(const Graph& g, const std::vector<std::uint32_t>& nodes)
      : g_(g), here_(g.size(), false), nodes_(g.size(), 0), controls_(g.control_count(), 0) {
    for (const std::uint32_t n : nodes) here_[n] = true;
    for (const std::uint32_t n : nodes) {
      for (const std::uint32_t c : g.written(n)) {
        if (controls_[c]++ > 0) continue;
        for (const std::uint32_t m : g.readers(c)) ++nodes_[m];
      }
      for (const std::uint32_t m : g.after(n)) ++nodes_[m];
    }
  }

  bool is_ready(std::uint32_t n) const { return nodes_[n] == 0; }

  /// Marks node n as having run. Calls f(m) for each node m whose last unmet condition this meets.
  template <class F>
  void finish(std::uint32_t n, F f) {
    const auto done = [&](std::uint32_t m) {
      if (--nodes_[m] == 0 && here_[m]) f(m);
    };
    for (const std::uint32_t c : g_.written(n)) {
      if (--controls_[c] == 0) std::ranges::for_each(g_.readers(c), done);
    }
    std::ranges::for_each(g_.after(n), done);
  }

 private:
  const Graph& g_;
  std::vector<bool> here_;
  std::vector<std::uint32_t> nodes_, controls_;
};

// Sorts nodes by their dependencies.
// In: nodes  the nodes to run, ascending; all others count as having run
Order order_of(const Graph& g, std::vector<std::uint32_t> nodes) {
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());  // a file may list one twice
  Waiting waiting(g, nodes);
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
  for (const std::uint32_t n : nodes) {
    if (waiting.is_ready(n)) ready.push(n);
  }
  Order order;
  while (!ready.empty()) {
    const std::uint32_t n = ready.top();
    ready.pop();
    order.sorted.push_back(n);
    waiting.finish(n, [&](std::uint32_t m) { ready.push(m); });
  }
  std::ranges::copy_if(nodes, std::back_inserter(order.cyclic),
                       [&](std::uint32_t n) { return !waiting.is_ready(n); });
  return order;
}

// The operations and solvers that can run before the correctives, because they depend on no
// corrective, directly or indirectly, and on no cycle.
struct Early {
  std::vector<bool> nodes;
  std::vector<bool> controls;  // true if all writers of the control are early
};

Early find_early(const Graph& g) {
  Early early{std::vector<bool>(g.size(), true), std::vector<bool>(g.control_count(), true)};
  std::vector<std::uint32_t> all(g.size());
  std::iota(all.begin(), all.end(), 0u);
  const auto delay = [&](std::uint32_t n) {
    early.nodes[n] = false;
    for (const std::uint32_t c : g.written(n)) {
      if (!early.controls[c]) continue;
      early.controls[c] = false;
      for (const std::uint32_t m : g.readers(c)) early.nodes[m] = false;
    }
    for (const std::uint32_t m : g.after(n)) early.nodes[m] = false;
  };
  const Order order = order_of(g, all);
  for (const std::uint32_t n : order.cyclic) delay(n);
  for (const std::uint32_t n : order.sorted) {
    if (g.is_psd(n) || !early.nodes[n]) delay(n);
  }
  return early;
}

// [correctives] the watcher of each corrective: the factor whose value decides whether the
// corrective is evaluated. kNone if a factor may change after the watchers are read, if the
// corrective has no factor, or if it writes a raw control.
std::vector<std::uint32_t> choose_watchers(const RigData& r, const Early& early) {
  std::vector<std::uint32_t> load(r.control_count, 0), watchers;
  const auto late = [&](std::uint16_t control) {
    return detail::is_corrective(r, control) || !early.controls[control];
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

// Renumbers the correctives in the order in which their watchers are read.
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

// The cost, in steps of the budget, of running each operation and solver once.
class Costs {
 public:
  explicit Costs(const RigData& r) : r_(r), layers_(1, 0), segments_(1, 0), poses_(1, 0) {
    for (const rig::MlLayer& l : r.ml_layers) {
      layers_.push_back(layers_.back() + (std::uint64_t{l.columns} + 1) * l.rows);
    }
    for (const rig::MlSegment& s : r.ml_segments) segments_.push_back(segments_.back() + s.count);
    for (const rig::RbfPose& p : r.rbf_poses) {
      poses_.push_back(poses_.back() + p.input_count + p.output_count);
    }
  }
  std::uint64_t of_operation(std::uint32_t i) const {
    const MlOperation& op = r_.ml_operations[i];
    const std::uint64_t layers =
        op.kind == MlOperation::kMlp ? sum(layers_, op.items_begin, op.item_count) : 0;
    return op.value_count + layers + sum(segments_, op.segments_begin, op.segment_count);
  }
  std::uint64_t of_solver(std::uint32_t i) const {
    const rig::RbfSolver& s = r_.rbf_solvers[i];
    const std::uint64_t poses = s.pose_count;
    return poses * (s.input_count + std::uint64_t{1} + (s.interpolative != 0 ? poses : 0)) +
           sum(poses_, s.poses_begin, s.pose_count);
  }

 private:
  static std::uint64_t sum(const std::vector<std::uint64_t>& ends, std::size_t begin,
                           std::size_t count) {
    return ends[begin + count] - ends[begin];
  }

  const RigData& r_;
  std::vector<std::uint64_t> layers_, segments_, poses_;  // running sums
};

// Charges the budget for the operations and solvers of all LODs. If a LOD lists an operation or a
// solver several times, it is charged each time.
Status take_steps_of_lists(const RigData& r, const StepLods& lods, Budget& budget) {
  const Costs costs(r);
  std::uint64_t operations = 0, solvers = 0;
  for (std::uint32_t lod = 0; lod < r.lod_count; ++lod) {
    for (const std::uint32_t i : lods.operations[lod]) operations += costs.of_operation(i);
    for (const std::uint32_t i : lods.solvers[lod]) solvers += costs.of_solver(i);
  }
  RISORIUS_TRY(budget.take_steps(operations, "machine_learned_behavior_ext.types"));
  return budget.take_steps(solvers, "rbf_behavior.lod_solver_mapping");
}

}  // namespace

Status detail::schedule(const Used& used, const StepLods& lods, Budget& budget, RigData& r) {
  RISORIUS_TRY(take_steps_of_lists(r, lods, budget));
  const auto graph = Graph::make(r, budget);
  if (!graph) return core::Unexpected{graph.error()};
  const Graph& g = *graph;
  const Early early = find_early(g);
  const std::vector<std::uint32_t> watchers = choose_watchers(r, early);
  r.step_begins.push_back(0);
  for (std::uint32_t lod = 0; lod < r.lod_count; ++lod) {
    add_watched(used[lod], watchers, r);
    std::vector<std::uint32_t> reference, first, rest;
    for (const std::uint32_t i : lods.operations[lod]) reference.push_back(g.operation(i));
    for (const std::uint32_t i : lods.solvers[lod]) reference.push_back(g.solver(i));
    for (const std::uint32_t n : reference) (early.nodes[n] ? first : rest).push_back(n);
    std::ranges::sort(first);
    std::ranges::sort(rest);
    for (std::uint32_t p = 0; p < r.psds.size(); ++p) {
      if (used[lod][r.psds[p].output] && watchers[p] == rig::kNone) rest.push_back(g.psd(p));
    }
    const Order order = order_of(g, std::move(rest));
    add_list(g, order_of(g, std::move(first)).sorted, r);
    add_list(g, order.sorted, r);
    add_list(g, order.cyclic, r);
    add_list(g, reference, r);
  }
  sort_correctives(r);
  return core::ok();
}

}  // namespace risorius::compile
