// SPDX-License-Identifier: MIT
// Tests Instance, a face in a sequence of frames. A corrective or a network that reads the output
// of a later stage gets the value of the frame before.
#include "rig/stages/instance.h"

#include "rig/stages/evaluate.h"
#include "support/face.h"

namespace risorius::rig {
namespace {

using namespace testing_support;

// Corrective 1 copies the raw control, corrective 2 copies corrective 1.
Rig latency_rig() {
  dna::Dna dna = make_face(1, 2, 1);
  dna.behavior.psds.rows = {1, 2};
  dna.behavior.psds.columns = {0, 1};
  dna.behavior.psds.values = {1.0f, 1.0f};
  dna.behavior.joint_groups = std::vector{make_probe({1, 2})};
  return must_compile(dna);
}

TEST(Instance, CorrectiveOfACorrectiveComesOneFrameLate) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float half = 0.5f, zero = 0.0f;
  EXPECT_EQ(face.evaluate(&half).controls, (std::vector{0.5f, 0.5f, 0.0f}));
  EXPECT_EQ(face.evaluate(&half).controls, (std::vector{0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(face.evaluate(&zero).controls, (std::vector{0.0f, 0.0f, 0.5f}));
  EXPECT_EQ(face.evaluate(&zero).controls, (std::vector{0.0f, 0.0f, 0.0f}));
}

TEST(Instance, FirstFrameIsTheUnsettledEvaluation) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float value = 0.75f;
  EXPECT_EQ(face.evaluate(&value).joints, evaluate_once(rig, {value}, 0, false).joints);
}

TEST(Instance, ChangeOfLodForgetsTheFrameBefore) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float half = 0.5f;
  (void)face.evaluate(&half);
  face.set_lod(0);
  EXPECT_EQ(face.evaluate(&half).controls[2], 0.5f) << "the same LOD is no change";
  face.set_lod(1);
  EXPECT_EQ(face.evaluate(&half).controls[2], 0.0f);
}

TEST(Instance, RequestBeyondTheLastLodIsClampedAndForgetsEachTime) {
  const Rig rig = latency_rig();
  Instance face(rig);
  const float half = 0.5f;
  face.set_lod(7);
  EXPECT_EQ(face.lod(), 1u);
  (void)face.evaluate(&half);
  (void)face.evaluate(&half);
  face.set_lod(7);
  EXPECT_EQ(face.evaluate(&half).controls[2], 0.0f);
}

TEST(Instance, FacesOfOneRigKeepTheirOwnState) {
  const Rig rig = latency_rig();
  Instance a(rig), b(rig);
  const float half = 0.5f;
  (void)a.evaluate(&half);
  EXPECT_EQ(b.evaluate(&half).controls[2], 0.0f);
  EXPECT_EQ(a.evaluate(&half).controls[2], 0.5f);
}

// The first network copies control 0 to control 2, corrective 1 copies control 2, and the second
// network copies corrective 1 to control 3. In the list of networks the second one has index 0.
dna::Dna networks_around_a_corrective() {
  dna::Dna dna = make_face(1, 1, 1);
  dna.behavior.psds.rows = {1};
  dna.behavior.psds.columns = {2};
  dna.behavior.psds.values = {1.0f};
  dna.machine_learned_behavior.ml_control_names = {"a", "b"};
  dna::NeuralNetworkLayer layer;
  layer.biases = {0.0f};
  layer.weights = {1.0f};
  dna::NeuralNetwork first, second;
  first.layers = second.layers = std::vector{layer};
  first.input_indices = {0};
  first.output_indices = {2};
  second.input_indices = {1};
  second.output_indices = {3};
  dna.machine_learned_behavior.neural_networks = std::vector{second, first};
  dna.machine_learned_behavior.lod_neural_network_mapping.lods = {0, 0};
  dna.machine_learned_behavior.lod_neural_network_mapping.rows = {{0, 1}};
  dna.machine_learned_behavior.region_names = {{"nose", "mouth"}};
  dna.machine_learned_behavior.region_network_indices = {{{}, {1}}};
  dna.behavior.joint_groups = std::vector{make_probe({1, 3})};
  return dna;
}

TEST(Instance, NetworkReadsTheCorrectivesOfTheFrameBefore) {
  const Rig rig = must_compile(networks_around_a_corrective());
  Instance face(rig);
  const float half = 0.5f;
  EXPECT_EQ(face.evaluate(&half).controls, (std::vector{0.5f, 0.5f, 0.5f, 0.0f}));
  EXPECT_EQ(face.evaluate(&half).controls, (std::vector{0.5f, 0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(evaluate_once(rig, {half}).controls, (std::vector{0.5f, 0.5f, 0.5f, 0.5f}));
}

TEST(Instance, MaskedNetworkRests) {
  const Rig rig = must_compile(networks_around_a_corrective());
  Instance face(rig);
  ASSERT_EQ(face.masks().size(), 2u);
  const float half = 0.5f;
  (void)face.evaluate(&half);
  face.set_mask(1, 0.0f);
  EXPECT_EQ(face.evaluate(&half).controls, (std::vector{0.5f, 0.0f, 0.0f, 0.5f}));
  face.set_mask(1, 0.25f);
  EXPECT_EQ(face.evaluate(&half).controls[2], 0.5f) << "any value but 0 is all of it";
}

// A cycle: the first network reads the second network, which reads the corrective, which reads the
// first network.
TEST(Instance, CycleRestsWhenSettled) {
  dna::Dna dna = networks_around_a_corrective();
  dna.machine_learned_behavior.neural_networks[1].input_indices = {3};
  dna.machine_learned_behavior.neural_networks[1].layers[0].biases = {0.5f};
  const Rig rig = must_compile(dna);
  EXPECT_EQ(evaluate_once(rig, {0.5f}).controls, (std::vector{0.5f, 0.0f, 0.0f, 0.0f}));
}

}  // namespace
}  // namespace risorius::rig
