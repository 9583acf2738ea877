// SPDX-License-Identifier: MIT
// Registers a template onto a target: coarse steps with matches by features, then fine steps with
// matches by distance.
#include "register/register.h"

#include <array>
#include <cmath>
#include <utility>

#include "register/steps/coarse.h"
#include "register/steps/fine.h"
#include "register/steps/mirroring.h"
#include "register/steps/prepare.h"

namespace risorius::registering {

using core::ErrorCode;
using core::fail;
using steps::Points;

namespace {

/// Settings of a coarse step: stiffness of nodes, weight of a pair, number of rounds, and weights
/// of the search for features.
struct CoarseStep {
  double stiffness, landmarks;
  int rounds;
  steps::Counting counting;
};
/// Steps that rotate and stretch a template whose start comes from pairs alone.
constexpr std::array<CoarseStep, 3> kFar{{
    {300, 10, 3, {30, 150, 60, 0.7, false}},
    {100, 5, 4, {30, 150, 50, 0.5, true}},
    {30, 2, 4, {30, 150, 40, 0.4, true}},
}};
/// Steps that change a start little, because it is usually more accurate along the surface than
/// matches are: only places where the surface bends alike are matched.
constexpr std::array<CoarseStep, 5> kNear{{
    {100, 1, 4, {30, 720, 30, 0.3, true}},
    {30, 0.3, 4, {20, 480, 20, 0.2, true}},
    {10, 0.1, 4, {20, 360, 15, 0.2, true}},
    {3, 0.05, 4, {20, 240, 10, 0.1, true}},
    {1, 0.03, 4, {20, 180, 10, 0.1, true}},
}};

/// Settings of a fine step. stiffness: of the motions; farthest: largest distance of a match in mm;
/// robust: distance in mm at which a match has a quarter of its weight; along: weight of a match
/// along the surface; rounds: number of rounds.
struct FineStep {
  double stiffness, farthest, robust, along;
  int rounds;
};
constexpr std::array<FineStep, 6> kFine{{
    {100, 10, 4, 0.1, 2},
    {30, 8, 3, 0.1, 2},
    {10, 6, 2, 0.1, 2},
    {3, 5, 2, 0.1, 2},
    {0.5, 4, 2, 0.1, 2},
    {0.05, 4, 2, 0.1, 3},
}};

constexpr double kLeastCosine = 0.4;  // between the normals of a match by distance
constexpr double kFound = 0.5;        // mm, largest distance of a vertex that lies on the target
constexpr double kNoise = 2.0;        // mm, error of pairs for which the steps are tuned
constexpr double kSurest = 25.0;      // largest factor of a pair's weight, for errors near 0
constexpr double kPrepared = 0.15;    // progress at the end of the preparation
constexpr double kCoarsely = 0.65;

core::Unexpected stopped() { return fail(ErrorCode::kInvalidArgument, "", "stopped"); }

/// Runs the coarse and the fine steps, in millimetres.
class Laying {
 public:
  Laying(const Mesh& templ, const steps::Target& target, const steps::Looks& looks,
         std::vector<steps::Landmark> landmarks, const RegisterOptions& options,
         const Progress& progress)
      : templ_(templ),
        graph_(templ.points.size(), templ.triangles),
        landmarks_(std::move(landmarks)),
        matcher_(target, looks, options.threads),
        options_(options),
        progress_(progress) {}

  /// Runs the coarse steps and returns the vertices. In: far  whether the start comes from pairs
  /// alone
  core::Result<Points> coarse(const Points& start, bool far) const;
  core::Result<Points> fine(const Points& base) const;
  steps::Matcher const& matcher() const { return matcher_; }

 private:
  void mirror(const Points& points, bool missing, std::vector<steps::Match>& matches) const {
    if (options_.mirrored.empty() || options_.symmetry <= 0) return;
    steps::add_mirrored(options_.mirrored, points, options_.symmetry, missing, matches);
  }
  bool go_on(double done) const { return !progress_ || progress_(done); }

  const Mesh& templ_;
  steps::Graph graph_;
  std::vector<steps::Landmark> landmarks_;
  steps::Matcher matcher_;
  const RegisterOptions& options_;
  const Progress& progress_;
};

core::Unexpected unsolvable() {
  return fail(ErrorCode::kInvalidArgument, "",
              "the template does not fit the target: the equations have no solution");
}

core::Result<Points> Laying::coarse(const Points& start, bool far) const {
  std::vector<CoarseStep> all(kNear.begin(), kNear.end());
  if (far) all.insert(all.begin(), kFar.begin(), kFar.end());
  const steps::Nodes nodes = steps::spread(graph_, start, options_.nodes);
  steps::Coarse coarse(nodes, start);
  Points now = start;
  double done = 0;
  for (const CoarseStep& step : all) {
    for (int round = 0; round < step.rounds; ++round) {
      if (!go_on(kPrepared + (kCoarsely - kPrepared) * done / static_cast<double>(all.size()))) {
        return stopped();
      }
      const Points normals = steps::vertex_normals(now, templ_.triangles);
      auto matches = matcher_.by_features(now, normals, step.counting);
      mirror(now, false, matches);
      if (!coarse.solve(matches, landmarks_, {step.stiffness, step.landmarks})) {
        return unsolvable();
      }
      now = coarse.moved();
      done += 1.0 / step.rounds;
    }
  }
  return now;
}

core::Result<Points> Laying::fine(const Points& base) const {
  steps::Fine fine(graph_, base);
  double done = 0;
  for (const FineStep& step : kFine) {
    for (int round = 0; round < step.rounds; ++round) {
      if (!go_on(kCoarsely + (1 - kCoarsely) * done / static_cast<double>(kFine.size()))) {
        return stopped();
      }
      const Points normals = steps::vertex_normals(fine.points(), templ_.triangles);
      const auto matches = matcher_.by_distance(fine.points(), normals, step.farthest, kLeastCosine,
                                                step.robust, step.along);
      if (!fine.solve(matches, step.stiffness)) return unsolvable();
      done += 1.0 / step.rounds;
    }
  }
  return fine.points();
}

std::vector<steps::Landmark> landmarks_of(const std::vector<Pair>& pairs, const steps::Scale& scale,
                                          double noise) {
  // The weight of a pair is inversely proportional to the variance of its error. An error of kNoise
  // gives the weight 1.
  const double sure = kNoise * kNoise / std::max(noise * noise, kNoise * kNoise / kSurest);
  std::vector<steps::Landmark> out;
  for (const Pair& pair : pairs) {
    if (pair.weight > 0) out.push_back({pair.vertex, scale.in(pair.point), sure * pair.weight});
  }
  return out;
}

/// Converts the final positions of the vertices to the result.
Registered told(const Points& points, const Mesh& templ, const steps::Matcher& matcher,
                const steps::Looks& looks, const steps::Scale& scale,
                const std::vector<std::int32_t>& whole) {
  const Points normals = steps::vertex_normals(points, templ.triangles);
  const auto alike = matcher.closest(points, normals, 1e6, kLeastCosine);
  const auto any = matcher.closest(points, normals, 1e6, -2.0);
  Registered out;
  for (std::size_t v = 0; v < points.size(); ++v) {
    const bool same = alike[v].triangle >= 0 && alike[v].distance <= any[v].distance + kFound;
    const auto& found = same ? alike[v] : any[v];
    out.points.push_back(scale.out(points[v]));
    out.triangle.push_back(found.triangle < 0 ? -1
                                              : whole[static_cast<std::size_t>(found.triangle)]);
    out.shares.push_back({found.shares[0], found.shares[1], found.shares[2]});
    out.distance.push_back(found.distance / scale.mm);
    const bool has = looks.belief[v] > 0 ||
                     (looks.inside[v] > 0 && steps::Matcher::is_inside(found, normals[v]));
    out.trusted.push_back(same && has && found.distance < kFound && !found.beyond_border);
  }
  return out;
}

}  // namespace

core::Result<Registered> register_surface(const Mesh& templ, const Mesh& target,
                                          const std::vector<Pair>& pairs,
                                          const std::vector<Vector3>& start,
                                          const RegisterOptions& options,
                                          const Progress& progress) {
  RISORIUS_TRY(steps::check(templ, target, pairs, start, options));
  std::vector<Vector3> begin = start;
  if (begin.empty()) {
    auto made = steps::aligned(templ, pairs);
    if (!made) return std::move(made).propagate();
    begin = std::move(made).value();
  }
  auto measure = steps::scale_of(templ, begin, options.mm);
  if (!measure) return std::move(measure).propagate();
  const steps::Scale scale = measure.value();
  steps::Form form;
  for (const Vector3& p : begin) form.points.push_back(scale.in(p));
  form.triangles = templ.triangles;
  form.normals = steps::vertex_normals(form.points, form.triangles);
  if (progress && !progress(0.0)) return stopped();
  std::vector<std::int32_t> whole;
  auto near = steps::near_target(target, form.points, scale, options.threads, whole);
  if (!near) return std::move(near).propagate();
  if (progress && !progress(kPrepared / 2)) return stopped();
  const steps::Looks looks =
      steps::looks_of(form, options.trusted, near.value().samples.spacing, options.threads);
  const Laying laying(templ, near.value(), looks, landmarks_of(pairs, scale, options.noise),
                      options, progress);
  auto coarse = laying.coarse(form.points, start.empty());
  if (!coarse) return std::move(coarse).propagate();
  auto fine = laying.fine(coarse.value());
  if (!fine) return std::move(fine).propagate();
  if (progress && !progress(1.0)) return stopped();
  return told(fine.value(), templ, laying.matcher(), looks, scale, whole);
}

}  // namespace risorius::registering
