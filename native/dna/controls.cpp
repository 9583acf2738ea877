// SPDX-License-Identifier: MIT
#include "dna/controls.h"

#include <algorithm>

#include "dna/index_map.h"
#include "dna/layers.h"

namespace risorius::dna {

ControlCounts control_counts(const Dna& dna) {
  const auto size = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
  ControlCounts n;
  n.raw = size(dna.definition.raw_control_names);
  n.psd = dna.behavior.psd_count + dna.unread_controls.psd;
  n.ml = size(dna.machine_learned_behavior.ml_control_names) + dna.unread_controls.ml;
  n.rbf_pose = size(dna.rbf_behavior_ext.pose_control_names);
  if (n.rbf_pose == 0 && dna.rbf_behavior_ext.poses.empty()) {
    n.rbf_pose = size(dna.rbf_behavior.poses);
  }
  n.rbf_pose += dna.unread_controls.rbf_pose;
  return n;
}

std::uint16_t ml_joint_stride(const MlJoints& joints) {
  const std::size_t n = std::min(joints.parameter_keys.size(), joints.parameter_values.size());
  for (std::size_t i = 0; i < n; ++i) {
    if (joints.parameter_keys[i] == 1 && joints.parameter_values[i] == 1) return 10;
  }
  return 9;
}

namespace detail {

namespace {

using core::Array;
using core::ErrorCode;
using core::fail;
using core::List;
using Indices = std::vector<std::uint16_t>;

std::vector<bool> controls_that_stay(const Dna& dna) {
  const ControlCounts n = control_counts(dna);
  std::vector<bool> keep;
  const auto part = [&](std::uint32_t count, std::uint32_t unread) {
    keep.resize(keep.size() + count - unread, true);
    keep.resize(keep.size() + unread, false);
  };
  part(n.raw, 0);
  part(n.psd, dna.unread_controls.psd);
  part(n.ml, dna.unread_controls.ml);
  part(n.rbf_pose, dna.unread_controls.rbf_pose);
  return keep;
}

std::vector<bool> kept_entries(const IndexMap& map, const Array<std::uint16_t>& indices) {
  std::vector<bool> keep(indices.size());
  for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = map.keeps(indices[i]);
  return keep;
}

template <class T>
Array<T> only(const Array<T>& values, const std::vector<bool>& keep) {
  std::vector<T> out;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (keep[i % keep.size()])
      out.push_back(values[i]);  // keep: [columns]; values: rows of columns
  }
  return out;
}

template <class T>
Array<T> renumbered(const IndexMap& map, const Array<T>& indices) {
  std::vector<T> out;
  for (const T i : indices) out.push_back(map[i]);
  return out;
}

class Forgetting {
 public:
  Forgetting(const IndexMap& map, Dna& dna) : map_(map), dna_(dna) {}

  core::Result<std::size_t> run() {
    psds();
    for (JointGroup& g : dna_.behavior.joint_groups) {
      const std::vector<bool> keep = entries(g.input_indices);
      if (!keep.empty()) g.values = only(g.values, keep);
      inputs(keep, g.input_indices);
    }
    channels();
    maps();
    networks();
    for (RbfPoseControls& p : dna_.rbf_behavior_ext.poses) {
      all("rbf_behavior_ext.poses", p.input_control_indices);
      all("rbf_behavior_ext.poses", p.output_control_indices);
    }
    for (List<TwistSwingSetup>* setups :
         {&dna_.twist_swing_behavior.twists, &dna_.twist_swing_behavior.swings}) {
      for (TwistSwingSetup& s : *setups) all("twist_swing_behavior", s.input_control_indices);
    }
    for (RbfSolver& s : dna_.rbf_behavior.solvers) {
      all("rbf_behavior.solvers", s.raw_control_indices);
    }
    if (!lost_.empty()) {
      return fail(ErrorCode::kInvalidArgument, lost_,
                  "it needs a control of a layer that was not loaded or that the version lacks");
    }
    return dropped_;
  }

 private:
  std::vector<bool> entries(const Array<std::uint16_t>& indices) {
    std::vector<bool> keep = kept_entries(map_, indices);
    dropped_ += static_cast<std::size_t>(std::ranges::count(keep, false));
    return keep;
  }
  void inputs(const std::vector<bool>& keep, Array<std::uint16_t>& indices) {
    if (!keep.empty()) indices = renumbered(map_, only(indices, keep));
  }
  // Removes all factors of each corrective that is itself removed or has a removed factor. A
  // corrective is a product, and a removed control counts as 0, so that the product is 0.
  void psds() {
    Psds& p = dna_.behavior.psds;
    std::vector<bool> is_lost(map_.size(), false);
    for (std::size_t i = 0; i < p.rows.size(); ++i) {
      if (!map_.keeps(p.columns[i]) && p.rows[i] < is_lost.size()) is_lost[p.rows[i]] = true;
    }
    std::vector<bool> keep(p.rows.size());
    for (std::size_t i = 0; i < keep.size(); ++i) {
      keep[i] = map_.keeps(p.rows[i]) && !is_lost[p.rows[i]];
    }
    if (keep.empty()) return;
    dropped_ += static_cast<std::size_t>(std::ranges::count(is_lost, true));
    inputs(keep, p.rows);
    inputs(keep, p.columns);
    p.values = only(p.values, keep);
  }
  void channels() {
    BlendShapeChannels& c = dna_.behavior.blend_shape_channels;
    const std::vector<bool> keep = entries(c.input_indices);
    if (keep.empty()) return;
    drop_rows(keep, c.lods);
    c.output_indices = only(c.output_indices, keep);
    inputs(keep, c.input_indices);
  }
  void maps() {
    Conditionals& t = dna_.behavior.animated_maps.conditionals;
    const std::vector<bool> keep = entries(t.input_indices);
    if (keep.empty()) return;
    drop_rows(keep, dna_.behavior.animated_maps.lods);
    t.output_indices = only(t.output_indices, keep);
    for (Array<float>* values : {&t.from_values, &t.to_values, &t.slope_values, &t.cut_values}) {
      *values = only(*values, keep);
    }
    inputs(keep, t.input_indices);
  }
  void networks() {
    constexpr std::uint16_t kGather = 1, kScatter = 2;
    for (NeuralNetwork& n : dna_.machine_learned_behavior.neural_networks) {
      all("machine_learned_behavior.neural_networks", n.input_indices);
      all("machine_learned_behavior.neural_networks", n.output_indices);
    }
    MachineLearnedBehaviorExt& ext = dna_.machine_learned_behavior_ext;
    for (MlType& type : ext.types) {
      for (auto& set : type.operations) {
        for (MlOperation& op : set) {
          if (op.operation_type != kGather && op.operation_type != kScatter) continue;
          all("machine_learned_behavior_ext.types", op.parameters);
        }
      }
    }
    all("machine_learned_behavior_ext.joints", ext.joints.input_indices);
  }
  template <class T>
  void all(const char* where, Array<T>& indices) {
    for (const T i : indices) {
      if (!map_.keeps(i) && lost_.empty()) lost_ = where;
    }
    if (lost_.empty()) indices = renumbered(map_, indices);
  }

  const IndexMap& map_;
  Dna& dna_;
  std::size_t dropped_ = 0;
  std::string lost_;
};

}  // namespace

void drop_layer(std::string_view id, Dna& dna) {
  const ControlCounts before = control_counts(dna);
  for_each_layer(dna, [&](std::string_view layer, const char*, auto& value) {
    if (layer == id) value = {};
  });
  dna.unread_controls = {};
  const ControlCounts after = control_counts(dna);
  // The difference of the pose controls is limited to 0 and more: without layer rbfe each pose is
  // a control, so that the number of pose controls may grow when that layer is removed.
  dna.unread_controls = {before.psd - after.psd, before.ml - after.ml,
                         before.rbf_pose - std::min(before.rbf_pose, after.rbf_pose)};
}

core::Result<std::size_t> forget_unread_controls(Dna& dna) {
  if (dna.unread_controls == UnreadControls{}) return std::size_t{0};
  const std::vector<bool> keep = controls_that_stay(dna);
  dna.unread_controls = {};
  return forget_controls(keep, dna);
}

core::Result<std::size_t> forget_controls(const std::vector<bool>& keep, Dna& dna) {
  const IndexMap map(keep);
  return Forgetting(map, dna).run();
}

}  // namespace detail

}  // namespace risorius::dna
