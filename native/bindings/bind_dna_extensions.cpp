// SPDX-License-Identifier: MIT
// Binds the DNA layers of versions 2.3 to 2.6. Enumerations have the numbers of the format.
#include "bindings/fields.h"

namespace risorius::bindings {

namespace {

void bind_networks(py::module_& m) {
  auto layer =
      value_class<dna::NeuralNetworkLayer>(m, "NeuralNetworkLayer",
                                           "y = activation(W x + b); activation_function: 0 linear "
                                           "1 relu 2 leakyrelu 3 tanh 4 sigmoid.");
  numbers(layer, "biases", [](auto& s) -> auto& { return s.biases; });
  numbers(layer, "weights", [](auto& s) -> auto& { return s.weights; });
  number(layer, "activation_function", [](auto& s) -> auto& { return s.activation_function; });
  numbers(layer, "activation_parameters", [](auto& s) -> auto& { return s.activation_parameters; });

  auto network = value_class<dna::NeuralNetwork>(m, "NeuralNetwork",
                                                 "From control indices to control indices.");
  numbers(network, "output_indices", [](auto& s) -> auto& { return s.output_indices; });
  numbers(network, "input_indices", [](auto& s) -> auto& { return s.input_indices; });
  parts(network, "layers", [](auto& s) -> auto& { return s.layers; });
}

void bind_networks_behavior(py::module_& m) {
  using Behavior = dna::MachineLearnedBehavior;
  auto ml = value_class<Behavior>(m, "MachineLearnedBehavior", "Layer mlbh.");
  texts(ml, "ml_control_names", [](auto& s) -> auto& { return s.ml_control_names; });
  lod_mapping(ml, "lod_neural_network_mapping",
              [](auto& s) -> auto& { return s.lod_neural_network_mapping; });
  parts(ml, "neural_networks", [](auto& s) -> auto& { return s.neural_networks; });
  ml.def_property(
      "region_names",
      [](const Behavior& s) {
        py::list out;
        for (const auto& mesh : s.region_names) {
          py::list names;
          for (const std::string& name : mesh) names.append(to_python(name));
          out.append(names);
        }
        return out;
      },
      [](Behavior& s, const py::iterable& meshes) {
        s.region_names.clear();
        for (const py::handle& mesh : meshes) {
          auto& names = s.region_names.emplace_back();
          for (const py::handle& name : mesh) {
            names.push_back(text_from_python(name, "region_names"));
          }
        }
      },
      "[mesh][region] -> name");
  ml.def_property(
      "region_network_indices",
      [](const Behavior& s) {
        py::list out;
        for (const auto& mesh : s.region_network_indices) {
          py::list regions;
          for (const auto& networks : mesh) regions.append(to_numpy(networks));
          out.append(regions);
        }
        return out;
      },
      [](Behavior& s, const py::iterable& meshes) {
        s.region_network_indices.clear();
        for (const py::handle& mesh : meshes) {
          auto& regions = s.region_network_indices.emplace_back();
          for (const py::handle& networks : mesh) {
            regions.push_back(from_python<std::uint16_t>(
                py::reinterpret_borrow<py::object>(networks), "region_network_indices"));
          }
        }
      },
      "[mesh][region] -> uint16 network indices");
}

void bind_operations(py::module_& m) {
  auto operation = value_class<dna::MlOperation>(
      m, "MlOperation", "operation_type: 0 unspecified 1 gather 2 scatter 3 MLP 4 weighted sum.");
  numbers(operation, "parameters", [](auto& s) -> auto& { return s.parameters; });
  numbers(operation, "operation_set_dependency_indices",
          [](auto& s) -> auto& { return s.operation_set_dependency_indices; });
  numbers(operation, "operation_dependency_indices",
          [](auto& s) -> auto& { return s.operation_dependency_indices; });
  number(operation, "operation_type", [](auto& s) -> auto& { return s.operation_type; });

  auto type = value_class<dna::MlType>(
      m, "MlType", "A graph of operations: operations[set][i], lod_operation_mappings[set].");
  type.def_property(
      "lod_operation_mappings",
      [](const std::shared_ptr<dna::MlType>& self) {
        py::list out;
        for (auto& mapping : self->lod_operation_mappings) {
          out.append(std::shared_ptr<dna::LodMapping>(std::make_shared<dna::LodMapping>(mapping)));
        }
        return out;
      },
      [](dna::MlType& s, const py::iterable& mappings) {
        std::vector<dna::LodMapping> out;
        for (const py::handle& mapping : mappings) {
          out.push_back(lod_mapping_from_python(py::reinterpret_borrow<py::object>(mapping)));
        }
        s.lod_operation_mappings = std::move(out);
      });
  type.def_property(
      "operations",
      [](const dna::MlType& s) {
        py::list out;
        for (const auto& set : s.operations) {
          py::tuple operations(set.size());
          for (std::size_t i = 0; i < set.size(); ++i) operations[i] = set.element_ptr(i);
          out.append(operations);
        }
        return out;
      },
      [](dna::MlType& s, const py::iterable& sets) {
        std::vector<core::List<dna::MlOperation>> out;
        for (const py::handle& set : sets) {
          std::vector<dna::MlOperation> operations;
          for (const py::handle& op : set) operations.push_back(op.cast<const dna::MlOperation&>());
          out.emplace_back(std::move(operations));
        }
        s.operations = std::move(out);
      });
}

void bind_ml_joints(py::module_& m) {
  auto joints = value_class<dna::MlJoints>(
      m, "MlJoints", "Joints that networks move: outputs are joint * 9 (or 10) + attribute.");
  numbers(joints, "parameter_keys", [](auto& s) -> auto& { return s.parameter_keys; });
  numbers(joints, "parameter_values", [](auto& s) -> auto& { return s.parameter_values; });
  numbers(joints, "input_indices", [](auto& s) -> auto& { return s.input_indices; });
  numbers(joints, "output_indices", [](auto& s) -> auto& { return s.output_indices; });

  auto ext =
      value_class<dna::MachineLearnedBehaviorExt>(m, "MachineLearnedBehaviorExt", "Layer mlbe.");
  parts(ext, "types", [](auto& s) -> auto& { return s.types; });
  part(ext, "joints", [](auto& s) -> auto& { return s.joints; });
}

void bind_rbf(py::module_& m) {
  auto solver = value_class<dna::RbfSolver>(
      m, "RbfSolver",
      "solver_type: 0 additive 1 interpolative; automatic_radius: 0 on 1 off; distance_method: 0 "
      "euclidean 1 quaternion 2 swing angle 3 twist angle; normalize_method: 0 only above one 1 "
      "always; function_type: 0 gaussian 1 exponential 2 linear 3 cubic 4 quintic.");
  text(solver, "name", [](auto& s) -> auto& { return s.name; });
  numbers(solver, "raw_control_indices", [](auto& s) -> auto& { return s.raw_control_indices; });
  numbers(solver, "pose_indices", [](auto& s) -> auto& { return s.pose_indices; });
  numbers(solver, "raw_control_values", [](auto& s) -> auto& { return s.raw_control_values; });
  number(solver, "radius", [](auto& s) -> auto& { return s.radius; });
  number(solver, "weight_threshold", [](auto& s) -> auto& { return s.weight_threshold; });
  number(solver, "solver_type", [](auto& s) -> auto& { return s.solver_type; });
  number(solver, "automatic_radius", [](auto& s) -> auto& { return s.automatic_radius; });
  number(solver, "distance_method", [](auto& s) -> auto& { return s.distance_method; });
  number(solver, "normalize_method", [](auto& s) -> auto& { return s.normalize_method; });
  number(solver, "function_type", [](auto& s) -> auto& { return s.function_type; });
  number(solver, "twist_axis", [](auto& s) -> auto& { return s.twist_axis; });

  auto pose = value_class<dna::RbfPose>(m, "RbfPose", "A pose's name and scale.");
  text(pose, "name", [](auto& s) -> auto& { return s.name; });
  number(pose, "scale", [](auto& s) -> auto& { return s.scale; });

  auto rbf = value_class<dna::RbfBehavior>(m, "RbfBehavior", "Layer rbfb.");
  lod_mapping(rbf, "lod_solver_mapping", [](auto& s) -> auto& { return s.lod_solver_mapping; });
  parts(rbf, "solvers", [](auto& s) -> auto& { return s.solvers; });
  parts(rbf, "poses", [](auto& s) -> auto& { return s.poses; });

  auto controls = value_class<dna::RbfPoseControls>(m, "RbfPoseControls",
                                                    "The controls that a pose reads and writes.");
  numbers(controls, "input_control_indices",
          [](auto& s) -> auto& { return s.input_control_indices; });
  numbers(controls, "output_control_indices",
          [](auto& s) -> auto& { return s.output_control_indices; });
  numbers(controls, "output_control_weights",
          [](auto& s) -> auto& { return s.output_control_weights; });

  auto ext = value_class<dna::RbfBehaviorExt>(m, "RbfBehaviorExt", "Layer rbfe.");
  texts(ext, "pose_control_names", [](auto& s) -> auto& { return s.pose_control_names; });
  parts(ext, "poses", [](auto& s) -> auto& { return s.poses; });
}

// uint16[joints, 3]: how the file represents each joint's translation, rotation and scale, as the
// numbers that the DNA format defines.
py::array representations(const dna::JointBehaviorMetadata& s) {
  const auto& list = s.joint_representations;
  py::array_t<std::uint16_t> out({static_cast<py::ssize_t>(list.size()), py::ssize_t{3}});
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::array<std::uint16_t, 3> row{list[i].translation, list[i].rotation, list[i].scale};
    std::copy(row.begin(), row.end(), out.mutable_data() + 3 * i);
  }
  out.attr("flags").attr("writeable") = false;
  return out;
}

void set_representations(dna::JointBehaviorMetadata& s, const py::object& value) {
  const py::array any = py::array::ensure(value);
  if (!any || (any.size() > 0 && (any.ndim() != 2 || any.shape(1) != 3))) {
    shape_error("joint_representations", "(n, 3)", any);
  }
  const core::Array<std::uint16_t> flat =
      from_python<std::uint16_t>(any.attr("ravel")(), "joint_representations");
  std::vector<dna::JointRepresentation> list(flat.size() / 3);
  for (std::size_t i = 0; i < list.size(); ++i) {
    list[i] = {flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]};
  }
  s.joint_representations = std::move(list);
}

void bind_joints(py::module_& m) {
  auto metadata =
      value_class<dna::JointBehaviorMetadata>(m, "JointBehaviorMetadata", "Layer jbmd.");
  metadata.def_property("joint_representations", &representations, &set_representations,
                        "uint16[J, 3]: translation, rotation (0 Euler 1 quaternion), scale");

  auto setup = value_class<dna::TwistSwingSetup>(
      m, "TwistSwingSetup", "Spreads the rotation of four controls (x y z w) over joints.");
  numbers(setup, "blend_weights", [](auto& s) -> auto& { return s.blend_weights; });
  numbers(setup, "output_joint_indices", [](auto& s) -> auto& { return s.output_joint_indices; });
  numbers(setup, "input_control_indices", [](auto& s) -> auto& { return s.input_control_indices; });
  number(setup, "twist_axis", [](auto& s) -> auto& { return s.twist_axis; });

  auto twsw = value_class<dna::TwistSwingBehavior>(m, "TwistSwingBehavior", "Layer twsw.");
  parts(twsw, "twists", [](auto& s) -> auto& { return s.twists; });
  parts(twsw, "swings", [](auto& s) -> auto& { return s.swings; });
}

}  // namespace

void bind_dna_extensions(py::module_& m) {
  bind_networks(m);
  bind_networks_behavior(m);
  bind_operations(m);
  bind_ml_joints(m);
  bind_rbf(m);
  bind_joints(m);
}

void bind_dna_extension_fields(DnaClass& c) {
  part(c, "machine_learned_behavior", [](auto& s) -> auto& { return s.machine_learned_behavior; });
  part(c, "machine_learned_behavior_ext",
       [](auto& s) -> auto& { return s.machine_learned_behavior_ext; });
  part(c, "rbf_behavior", [](auto& s) -> auto& { return s.rbf_behavior; });
  part(c, "rbf_behavior_ext", [](auto& s) -> auto& { return s.rbf_behavior_ext; });
  part(c, "joint_behavior_metadata", [](auto& s) -> auto& { return s.joint_behavior_metadata; });
  part(c, "twist_swing_behavior", [](auto& s) -> auto& { return s.twist_swing_behavior; });
}

}  // namespace risorius::bindings
