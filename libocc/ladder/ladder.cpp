// SPDX-License-Identifier: Apache-2.0
#include "libocc/ladder/ladder.hpp"

#include <time.h>

#include <cmath>
#include <tuple>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/refine/bound.hpp"
#include "libocc/refine/internal/expected_error.hpp"
#include "libocc/scene/internal/rectangle_corners.hpp"

namespace occ {

using namespace internal::refine;
namespace {

/// Maximum distance of a blob from the projected centre of its lamp: far above the noise, and below
/// the distance of any two lamps that the detection separates.
constexpr double max_assignment_distance_px = 5;

/// CPU time of this thread, which excludes other load of the machine.
double now_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Mean time of a call; the number of calls doubles until they take min_time_s. The first call,
/// which warms the caches, is not counted.
template <typename Call>
double time_of(const Call& call, double min_time_s) {
  call();
  for (long calls = 1;; calls *= 2) {
    const double begun = now_s();
    for (long i = 0; i < calls; ++i) call();
    const double took = now_s() - begun;
    if (took >= min_time_s) return took / static_cast<double>(calls);
  }
}

/// Index of the whole blob nearest to a pixel, or -1.
int blob_near(const std::vector<Blob>& blobs, const Camera& camera, const Eigen::Vector2d& px) {
  int found = -1;
  double min_distance = max_assignment_distance_px;
  for (std::size_t b = 0; b < blobs.size(); ++b) {
    if (blobs[b].cut_by_border || blobs[b].merged) continue;
    const double distance = camera.difference_px(blobs[b].centroid_px, px).norm();
    if (distance >= min_distance) continue;
    min_distance = distance;
    found = static_cast<int>(b);
  }
  return found;
}

void assign_blobs(LadderProblem& p) {
  for (std::size_t i = 0; i < p.scene.lamps.size(); ++i) {
    const auto centre = project_lamp_centre(p.scene.lamps[i], p.truth, p.scene.camera);
    const int blob = centre ? blob_near(p.blobs, p.scene.camera, *centre) : -1;
    if (blob >= 0) p.matches.push_back({static_cast<int>(i), blob});
  }
}

void fill_points(LadderProblem& p) {
  const auto n = static_cast<Eigen::Index>(p.matches.size());
  p.points_in_world.resize(3, n);
  p.points_px.resize(2, n);
  double sum = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Match& match = p.matches[i];
    p.points_in_world.col(i) = p.scene.lamps[match.lamp].centre_m;
    const Blob& blob = p.blobs[match.blob];
    p.points_px.col(i) = blob.centroid_px;
    const auto centre = p.scene.camera.project(p.truth * p.points_in_world.col(i));
    sum += blob.covariance_px2.trace();
    if (centre) sum += p.scene.camera.difference_px(blob.centroid_px, *centre).squaredNorm();
  }
  p.sigma_px = n > 0 ? std::sqrt(sum / (2 * static_cast<double>(n))) : 0;
}

/// The lamp's corners in the order of the corners of its image, which the true pose gives.
Eigen::Matrix<double, 3, 4> corners_of(const Lamp& lamp, const Blob& blob, const Rigid3& truth,
                                       const Camera& camera) {
  const Eigen::Matrix<double, 3, 4> corners =
      internal::scene::rectangle_corners(lamp).colwise() + lamp.centre_m;
  Eigen::Matrix<double, 3, 4> best = corners, tried;
  double min_sum = infinity;
  for (int first = 0; first < 4; ++first) {
    double sum = 0;
    for (int i = 0; i < 4; ++i) {
      tried.col(i) = corners.col((first + i) % 4);
      const auto px = camera.project(truth * tried.col(i));
      sum += px ? camera.difference_px(*px, blob.corners_px[static_cast<std::size_t>(i)]).norm()
                : infinity;
    }
    if (sum < min_sum) std::tie(min_sum, best) = std::make_tuple(sum, tried);
  }
  return best;
}

void fill_corners(LadderProblem& p) {
  for (const Match& match : p.matches) {
    const Lamp& lamp = p.scene.lamps[match.lamp];
    const Blob& blob = p.blobs[match.blob];
    if (lamp.shape != LampShape::rectangle || blob.corners_px.size() != 4) continue;
    const Eigen::Index at = p.corners_px.cols();
    p.corners_in_world.conservativeResize(3, at + 4);
    p.corners_px.conservativeResize(2, at + 4);
    p.corners_in_world.rightCols<4>() = corners_of(lamp, blob, p.truth, p.scene.camera);
    for (int i = 0; i < 4; ++i)
      p.corners_px.col(at + i) = blob.corners_px[static_cast<std::size_t>(i)];
  }
}

Result<PoseBound> bound_of(const LadderProblem& p, Rung rung, FluxModel flux) {
  RefineOptions options;
  options.rung = rung;
  options.flux = flux;
  return pose_bound(p.matches, p.blobs, p.scene, p.truth, options, p.image);
}

}  // namespace

LadderProblem ladder_problem(const ImageView& image, const Scene& scene,
                             const Rigid3& cam_from_world) {
  image.validate();
  const Camera& camera = scene.camera;
  const bool fits = image.width == camera.width() && image.height == camera.height();
  require(fits, "image.width", image.width, "of the camera's size");
  LadderProblem p;
  p.scene = scene;
  p.scene.validate();
  p.image = image;
  p.truth = cam_from_world;
  DetectOptions options;
  options.sensor = scene.sensor;
  options.discs = scene.has_discs();
  const double begun = now_s();
  p.blobs = detect(image, options);
  p.detect_s = now_s() - begun;
  assign_blobs(p);
  fill_points(p);
  fill_corners(p);
  return p;
}

LadderBound ladder_bound(const LadderProblem& p, Rung rung, FluxModel flux) {
  const Result<PoseBound> bound = bound_of(p, rung, flux);
  if (!bound.ok()) return {};
  Vector6 bias = Vector6::Zero();
  if (rung == Rung::points) {
    bias = bias_of_points(p.matches, p.blobs, p.scene, p.truth, bound->covariance, 0);
  }
  const ExpectedError by_noise = expected_error(p.truth, bound->covariance);
  const ExpectedError expected = expected_error(p.truth, bound->covariance, bias);
  return {by_noise.position_m, by_noise.rotation_rad, expected.position_m, expected.rotation_rad};
}

LadderOutcome run_step(const LadderProblem& problem, const LadderStep& step, double min_time_s) {
  require(min_time_s > 0, "min_time_s", min_time_s, "positive");
  require(step.suits(problem), "rung", step.name, "suited to the points and their layout");
  LadderOutcome outcome;
  outcome.name = step.name;
  Result<Rigid3> result;
  outcome.time_s = time_of([&] { result = step.run(problem); }, min_time_s);
  outcome.answered = result.ok();
  outcome.bound = ladder_bound(problem, step.observations, step.flux);
  if (!outcome.answered) return outcome;
  const Rigid3 &found = *result, &truth = problem.truth;
  outcome.cam_from_world = found;
  outcome.position_error_m = (found.origin_in_source() - truth.origin_in_source()).norm();
  outcome.rotation_error_rad = so3_log(found.rotation * truth.rotation.transpose()).norm();
  return outcome;
}

RefineTime time_refine(const LadderProblem& problem, Rung rung, double min_time_s) {
  require(min_time_s > 0, "min_time_s", min_time_s, "positive");
  Vector6 off;
  off << 0.005, -0.005, 0.005, 0.006, -0.006, 0.006;
  const Rigid3 start = perturb(problem.truth, off);
  RefineOptions options;
  options.rung = rung;
  Result<Refined> result;
  RefineTime time{work_of(problem.matches, problem.blobs)};
  const double took_s = time_of(
      [&] {
        result =
            refine(start, problem.matches, problem.blobs, problem.scene, options, problem.image);
      },
      min_time_s);
  if (result.ok()) time.time_s = took_s;
  return time;
}

}  // namespace occ
