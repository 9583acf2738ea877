// SPDX-License-Identifier: MIT
// Tests that playing a mixer allocates nothing and throws nothing. Invalid layers, reactions and
// rules are refused when they are set.
#include "clip/mixer/mixer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>

#include "support/counted_new.h"

namespace risorius::clip {
namespace {

static_assert(
    std::is_nothrow_invocable_v<decltype(&Mixer::evaluate), Mixer&, double, const float*, float*>);
static_assert(
    std::is_nothrow_invocable_v<decltype(&Mixer::fire), Mixer&, std::size_t, double, float>);

const std::vector<std::string> kNames = {"a", "b", "c", "d"};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::shared_ptr<const LayerCurves> curves(std::vector<std::string> names, std::vector<float> values,
                                          std::size_t frames, std::vector<float> mask = {}) {
  CurvesView view;
  view.names = names;
  view.values = values;
  view.frame_count = frames;
  view.rate = 10.0;
  auto made = LayerCurves::make(kNames, view, mask);
  EXPECT_TRUE(made) << made.error().describe();
  return *made;
}

Layer layer(std::shared_ptr<const LayerCurves> played) {
  Layer out;
  out.first = out.start = played->first_time();
  out.last = played->last_time();
  out.curves = std::move(played);
  return out;
}

Mixer mixer(std::size_t max_fired = 8) {
  auto made = Mixer::make(kNames, {0, 0, 0, -1}, {1, 1, 1, 1}, max_fired);
  EXPECT_TRUE(made) << made.error().describe();
  return std::move(made).value();
}

std::vector<float> frame(Mixer& mixer, double time, const float* base = nullptr) {
  std::vector<float> out(kNames.size());
  mixer.evaluate(time, base, out.data());
  return out;
}

// A mixer with layers at different times, a reaction, and rules that apply.
Mixer full_mixer() {
  Mixer m = mixer();
  std::vector<Layer> layers;
  layers.push_back(layer(curves({"d", "a", "c"}, {0, 0.5f, 1, 1, 0, 1, 0.3f, 0.3f, 0.3f}, 3)));
  layers.push_back(layer(curves({"b", "x"}, {0.2f, 0.8f, 0, 1}, 2, {1, 0.5f, 0, 1})));
  layers[1].blend = Blend::kAdditive;
  layers[1].extend = Extend::kRepeat;
  layers[1].weight = {{0.0, 0.1}, {0.4, 1.0}};
  layers.push_back(layer(curves({"a", "b"}, {0.1f, 0.6f, 0, 0.2f}, 2)));
  layers[2].blend = Blend::kMax;
  layers[2].warp = {{0.05, 0.3, 0.9}, {0.0, 0.1, 0.02}};
  layers[2].fade_in = layers[2].fade_out = 0.1;
  EXPECT_TRUE(m.set_layers(layers));
  EXPECT_TRUE(m.set_reactions({{{{0, 2}, {1.0f, 0.5f}, 0.0, 0.1, 0.1, 0.3}}}));
  EXPECT_TRUE(m.set_rules({{{0}, {1}, Yield::Measure::kMean, 0.5f}}, {{2, 3}}));
  return m;
}

TEST(Mixer, CounterSeesAnAllocation) {
  const long before = allocations;
  const std::vector<float> some(10);
  EXPECT_GT(allocations, before);
}

TEST(Mixer, EvaluateAndFireTakeNoMemory) {
  Mixer m = full_mixer();
  float out[4];
  const float base[4] = {0.5f, 0.1f, kNaN, 2.0f};
  const long before = allocations;
  for (int n = -20; n < 400; ++n) {
    m.fire(0, n / 50.0, 0.5f);
    m.evaluate(n / 50.0, n % 2 ? base : nullptr, out);
  }
  m.evaluate(kNaN, base, out);
  m.evaluate(std::numeric_limits<double>::infinity(), base, out);
  EXPECT_EQ(allocations, before);
}

TEST(Mixer, EveryTimeGivesNumbersInRange) {
  Mixer m = full_mixer();
  m.fire(0, 0.0, 1.0f);
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const float base[4] = {static_cast<float>(kNaN), 9.0f, static_cast<float>(-kInf), -9.0f};
  for (const double time : {-kInf, -1e300, -1.0, 0.0, 0.1, 0.15, 1e300, kInf, kNaN}) {
    for (const float value : frame(m, time, base)) {
      EXPECT_GE(value, -1.0f) << time;
      EXPECT_LE(value, 1.0f) << time;
    }
  }
}

TEST(Mixer, PlaysAClipOfAnyOrderAndLeavesTheRest) {
  Mixer m = mixer();
  ASSERT_TRUE(m.set_layers({layer(curves({"c", "x", "a"}, {0, 1, 9, 9, 1, 0.5f}, 2))}));
  const float base[4] = {0.0f, 0.25f, 0.0f, -0.5f};
  EXPECT_EQ(frame(m, 0.0, base), (std::vector<float>{1.0f, 0.25f, 0.0f, -0.5f}));
  EXPECT_EQ(frame(m, 0.05, base), (std::vector<float>{0.75f, 0.25f, 0.5f, -0.5f}));
  EXPECT_EQ(frame(m, 7.0, base), (std::vector<float>{0.5f, 0.25f, 1.0f, -0.5f}));
}

TEST(Mixer, ASoundingReactionIsNeverCutOff) {
  Mixer m = mixer(1);
  ASSERT_TRUE(m.set_reactions({{{{0}, {1.0f}, 0.0, 0.1, 0.0, 0.1}}}));
  EXPECT_TRUE(m.fire(0, 0.0, 1.0f));
  EXPECT_FALSE(m.fire(0, 0.19, 1.0f));
  EXPECT_TRUE(m.fire(0, 0.21, 1.0f));
  EXPECT_EQ(frame(m, 0.31)[0], 1.0f);
  Mixer none = mixer(0);
  ASSERT_TRUE(none.set_reactions({{{{0}, {1.0f}, 0.0, 0.1, 0.0, 0.1}}}));
  EXPECT_FALSE(none.fire(0, 0.0, 1.0f));
}

TEST(Mixer, SoloLeavesTheOthersOut) {
  Mixer m = mixer();
  const Layer one = layer(curves({"a"}, {0.5f}, 1));
  Layer two = layer(curves({"b"}, {0.5f}, 1));
  two.solo = true;
  ASSERT_TRUE(m.set_layers({one, two}));
  EXPECT_EQ(frame(m, 0.0), (std::vector<float>{0.0f, 0.5f, 0.0f, 0.0f}));
}

struct Bad {
  const char* where;
  void (*spoil)(Layer&);
};
constexpr Bad kBad[] = {
    {"weight", [](Layer& l) { l.weight = {{0.0, 1.0}, {0.0}}; }},
    {"weight", [](Layer& l) { l.weight = {{}, {}}; }},
    {"weight", [](Layer& l) { l.weight = {{1.0, 0.0}, {0.0, 1.0}}; }},
    {"weight", [](Layer& l) { l.weight = {{0.0}, {-0.1}}; }},
    {"weight", [](Layer& l) { l.weight = {{kNaN}, {0.5}}; }},
    {"warp", [](Layer& l) { l.warp = {{0.0, kNaN}, {0.0, 1.0}}; }},
    {"clip_range", [](Layer& l) { l.first = l.last; }},
    {"clip_range", [](Layer& l) { l.last = kNaN; }},
    {"scale", [](Layer& l) { l.scale = -1.0; }},
    {"repeat", [](Layer& l) { l.repeat = kNaN; }},
    {"start", [](Layer& l) { l.start = Layer::kAlways; }},
    {"fade_in", [](Layer& l) { l.fade_in = kNaN; }},
    {"fade_out", [](Layer& l) { l.fade_out = -1.0; }},
    {"curves", [](Layer& l) { l.curves = nullptr; }},
};

TEST(Mixer, RefusesRangesThatAreNotOneForEachControl) {
  for (const auto& [low, high] : {std::pair{3u, 4u}, std::pair{4u, 5u}}) {
    const auto made = Mixer::make(kNames, std::vector<float>(low), std::vector<float>(high), 8);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, core::ErrorCode::kInvalidLength);
    EXPECT_EQ(made.error().where, "ranges");
  }
}

TEST(Mixer, RefusesALayerThatMakesNoSenseAndKeepsTheOldOnes) {
  Mixer m = mixer();
  const Layer good = layer(curves({"a"}, {0.5f, 0.75f}, 2));
  ASSERT_TRUE(m.set_layers({good}));
  for (const Bad& bad : kBad) {
    Layer spoiled = good;
    bad.spoil(spoiled);
    const core::Status status = m.set_layers({good, spoiled});
    ASSERT_FALSE(status) << bad.where;
    EXPECT_EQ(status.error().where, std::string("layers[1].") + bad.where);
    EXPECT_EQ(frame(m, 0.0)[0], 0.5f);
  }
}

TEST(Mixer, RefusesCurvesThatDoNotFit) {
  const std::vector<std::string> names = {"a", "a"};
  const std::vector<float> values = {0, 1};
  const std::vector<double> times = {1.0, 1.0};
  CurvesView good;
  good.names = std::span(names).first(1);
  good.values = values;
  good.frame_count = 2;
  const auto where = [](const CurvesView& view, std::vector<float> mask = {}) {
    auto made = LayerCurves::make(kNames, view, mask);
    return made ? std::string() : made.error().where;
  };
  EXPECT_EQ(where(good), "");
  EXPECT_EQ(where(good, {1.0f}), "mask");
  EXPECT_EQ(where(good, {1.0f, 0.0f, 2.0f, 0.0f}), "mask");
  CurvesView bad = good;
  bad.frame_count = 3;
  EXPECT_EQ(where(bad), "values");
  bad = good;
  bad.rate = 0.0;
  EXPECT_EQ(where(bad), "rate");
  bad = good;
  bad.times = times;
  EXPECT_EQ(where(bad), "times");
  bad.times = std::span(times).first(1);
  EXPECT_EQ(where(bad), "times");
  bad = good;
  bad.names = names;
  bad.frame_count = 1;
  EXPECT_EQ(where(bad), "names");
}

TEST(Mixer, RefusesReactionsAndRulesOfUnknownControls) {
  Mixer m = mixer();
  const auto code = [](const core::Status& status) {
    return status ? "" : core::to_string(status.error().code);
  };
  EXPECT_STREQ(code(m.set_reactions({{{{4}, {1.0f}, 0, 0.1, 0, 0.1}}})), "invalid_index");
  EXPECT_STREQ(code(m.set_reactions({{{{0}, {}, 0, 0.1, 0, 0.1}}})), "invalid_length");
  EXPECT_STREQ(code(m.set_reactions({{{{0}, {1.5f}, 0, 0.1, 0, 0.1}}})), "invalid_value");
  EXPECT_STREQ(code(m.set_reactions({{{{0}, {1.0f}, 0, 0.0, 0, 0.1}}})), "invalid_value");
  EXPECT_STREQ(code(m.set_rules({{{4}, {0}}}, {})), "invalid_index");
  EXPECT_STREQ(code(m.set_rules({{{}, {0}}}, {})), "invalid_value");
  EXPECT_STREQ(code(m.set_rules({}, {{1, 1}})), "invalid_index");
}

}  // namespace
}  // namespace risorius::clip
