// SPDX-License-Identifier: MIT
// Measures one frame of a mixer: mixer_bench [Google Benchmark's options]. 260 controls, clips of
// ten minutes at 60 frames per second, sampled at times between frames.
#include <benchmark/benchmark.h>

#include <random>

#include "clip/mixer/mixer.h"

namespace {

using namespace risorius;

constexpr std::size_t kControls = 260, kFrames = 36000;

std::vector<std::string> control_names() {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < kControls; ++i) out.push_back("c" + std::to_string(i));
  return out;
}

// A layer whose clip moves every `step`-th region of eight consecutive controls. The mask of the
// controls in the other regions is 0.
clip::Layer make_layer(std::size_t step, clip::Blend blend, unsigned seed) {
  const std::vector<std::string> names = control_names();
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0.0f, 0.4f);
  std::vector<float> values(kControls * kFrames), mask(kControls, 1.0f);
  for (std::size_t c = 0; c < kControls; ++c) {
    const bool moves = c / 8 % step == 0;  // eight consecutive controls form a region
    for (std::size_t f = 0; f < kFrames; ++f) {
      values[c * kFrames + f] = moves ? value(random) : 0.0f;
    }
    if (!moves && step > 1) mask[c] = 0.0f;
  }
  clip::CurvesView view;
  view.names = names;
  view.values = values;
  view.frame_count = kFrames;
  clip::Layer layer;
  layer.curves = *clip::LayerCurves::make(names, view, mask);
  layer.start = layer.first = layer.curves->first_time();
  layer.last = layer.curves->last_time();
  layer.blend = blend;
  layer.weight = {{0.0, 100.0, 400.0}, {0.5, 1.0, 0.7}};
  return layer;
}

clip::Mixer make_mixer(std::vector<clip::Layer> layers) {
  auto mixer = std::move(clip::Mixer::make(control_names(), std::vector<float>(kControls, 0.0f),
                                           std::vector<float>(kControls, 1.0f)))
                   .value();
  if (!mixer.set_layers(std::move(layers))) std::abort();
  return mixer;
}

void play(benchmark::State& state, clip::Mixer mixer) {
  std::vector<float> out(kControls);
  double time = 1.0;
  for (auto _ : state) {
    mixer.evaluate(time, nullptr, out.data());
    benchmark::DoNotOptimize(out.data());
    time += 1.0 / 47.0;
    if (time > 590.0) time = 1.0;
  }
}

void one_clip(benchmark::State& state) {
  play(state, make_mixer({make_layer(1, clip::Blend::kOverride, 1)}));
}
void four_masked(benchmark::State& state) {
  using clip::Blend;
  play(state, make_mixer({make_layer(1, Blend::kOverride, 1), make_layer(4, Blend::kOverride, 2),
                          make_layer(4, Blend::kAdditive, 3), make_layer(4, Blend::kMax, 4)}));
}
void four_whole(benchmark::State& state) {
  using clip::Blend;
  play(state, make_mixer({make_layer(1, Blend::kOverride, 1), make_layer(1, Blend::kOverride, 2),
                          make_layer(1, Blend::kAdditive, 3), make_layer(1, Blend::kMax, 4)}));
}
void reactions(benchmark::State& state) {
  clip::Mixer mixer = make_mixer({make_layer(1, clip::Blend::kOverride, 1)});
  if (!mixer.set_reactions({{{{1, 2, 3, 4, 5, 6}, std::vector<float>(6, 0.5f), 0, 1, 1e6, 1}}})) {
    std::abort();
  }
  for (int i = 0; i < 16; ++i) mixer.fire(0, 0.0, 0.5f);
  play(state, std::move(mixer));
}

BENCHMARK(one_clip);
BENCHMARK(four_masked);
BENCHMARK(four_whole);
BENCHMARK(reactions);

}  // namespace

BENCHMARK_MAIN();
