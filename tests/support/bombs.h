// SPDX-License-Identifier: MIT
// Small faces whose file size grows with n, but on which a careless reader spends n * n steps.
#pragma once

#include "rig/arrays.h"
#include "support/bare_face.h"

namespace risorius::testing_support {

struct Bomb {
  const char* name;
  dna::Dna (*make)(std::uint16_t n);
};

namespace bombs {

inline std::vector<std::uint16_t> same(std::size_t n, std::uint16_t value) {
  return std::vector<std::uint16_t>(n, value);
}

/// One solver that lists one pose n times. The pose has n outputs, all to control 0, so that there
/// are n * n writes.
inline dna::Dna poses(std::uint16_t n) {
  dna::Dna dna = make_face(1, 0, 1, 1);
  dna::RbfSolver solver;
  solver.pose_indices = same(n, 0);
  solver.automatic_radius = 1;
  dna.rbf_behavior.solvers = std::vector{solver};
  dna.rbf_behavior.poses = std::vector{dna::RbfPose{"p", 1.0f}};
  dna.rbf_behavior.lod_solver_mapping = {{0}, {{0}}};
  dna::RbfPoseControls controls;
  controls.output_control_indices = same(n, 0);
  controls.output_control_weights = std::vector<float>(n, 1.0f);
  dna.rbf_behavior_ext.poses = std::vector{controls};
  return dna;
}

/// n solvers that list the same pose, which reads n controls and has n outputs, all to control 0.
inline dna::Dna shared_poses(std::uint16_t n) {
  dna::Dna dna = poses(n);
  dna.behavior.psd_count = n;
  dna.rbf_behavior.solvers[0].pose_indices = {0};
  std::vector<std::uint16_t> listed(n), controls(n);
  for (std::uint16_t i = 0; i < n; ++i) {
    listed[i] = i;
    controls[i] = static_cast<std::uint16_t>(1 + i);  // correctives: readable, not writable
  }
  dna.rbf_behavior.solvers =
      std::vector<dna::RbfSolver>(n, dna::RbfSolver(dna.rbf_behavior.solvers[0]));
  dna.rbf_behavior.lod_solver_mapping.rows = {listed};
  dna.rbf_behavior_ext.poses[0].input_control_indices = controls;
  return dna;
}

/// n solvers that read and write raw control 0, and n correctives that read it.
inline dna::Dna graph(std::uint16_t n) {
  dna::Dna dna = make_face(1, n, 1, 1);
  dna::RbfSolver solver;
  solver.pose_indices = {0};
  solver.raw_control_indices = {0};
  solver.raw_control_values = {1.0f};
  solver.automatic_radius = 1;
  dna.rbf_behavior.solvers = std::vector<dna::RbfSolver>(n, solver);
  dna.rbf_behavior.poses = std::vector{dna::RbfPose{"p", 1.0f}};
  dna::RbfPoseControls controls;
  controls.output_control_indices = {0};
  controls.output_control_weights = {1.0f};
  dna.rbf_behavior_ext.poses = std::vector{controls};
  std::vector<std::uint16_t> listed(n);
  for (std::uint16_t i = 0; i < n; ++i) listed[i] = i;
  dna.rbf_behavior.lod_solver_mapping = {{0}, {listed}};
  for (std::uint16_t& i : listed) ++i;
  dna.behavior.psds = {listed, same(n, 0), std::vector<float>(n, 1.0f)};
  return dna;
}

/// A GUI table with n rows from one GUI control to one raw control, each with its own interval.
inline dna::Dna gui(std::uint16_t n) {
  dna::Dna dna = make_face(1, 0, 1, 1);
  dna.definition.gui_control_names = names("gui", 1);
  std::vector<float> from(n), to(n);
  for (std::uint16_t i = 0; i < n; ++i) {
    from[i] = static_cast<float>(i);
    to[i] = from[i] + 1.0f;
  }
  dna.behavior.gui_to_raw = {same(n, 0), same(n, 0), from, to, from, to};
  return dna;
}

/// n operations that run the same network of n layers.
inline dna::Dna networks(std::uint16_t n) {
  dna::Dna dna = make_face(1, 0, 1, 33);
  dna::NeuralNetworkLayer layer;
  layer.biases = {0.5f};
  layer.weights = {0.5f};
  dna::NeuralNetwork network;
  network.layers = std::vector<dna::NeuralNetworkLayer>(n, layer);
  dna.machine_learned_behavior.neural_networks = std::vector{network};
  dna::MlOperation run;
  run.operation_type = rig::MlOperation::kMlp;
  run.parameters = {0};
  dna::MlType type;
  type.operations =
      std::vector{core::List<dna::MlOperation>(std::vector<dna::MlOperation>(n, run))};
  type.lod_operation_mappings = {{}};
  dna.machine_learned_behavior_ext.types = std::vector{type};
  return dna;
}

}  // namespace bombs

inline const std::vector<Bomb> kBombs{{"Poses", bombs::poses},
                                      {"SharedPoses", bombs::shared_poses},
                                      {"Graph", bombs::graph},
                                      {"Gui", bombs::gui},
                                      {"Networks", bombs::networks}};

}  // namespace risorius::testing_support
