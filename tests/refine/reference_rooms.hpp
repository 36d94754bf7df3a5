// SPDX-License-Identifier: Apache-2.0
// Random rooms with measured blobs, and refined poses as lists of numbers, for the reference tests.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/refine/internal/error_gradient.hpp"
#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/internal/pose_evidence.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/refine/separation.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/photometry.hpp"
#include "tests/support/references.hpp"

namespace occ::test {

struct MeasuredRoom {
  Scene scene;  ///< as it is stated
  Rigid3 truth, start;
  std::vector<Blob> blobs;
  std::vector<Match> matches;
  RefineOptions options;
};

inline bool occurs(Random& random, double probability) { return random.uniform() < probability; }
inline double even_log(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

inline Camera random_camera(Random& random) {
  switch (random.below(5)) {
    case 0:
      return Camera::pinhole(640, 480, 422.5, 420, 319.5, 239.5, {-0.22, 0.06, 1e-3, -8e-4});
    case 1:
      return Camera::fisheye(640, 480, 300, 301, 320, 238, {0.03, -0.005});
    default:
      return Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  }
}

/// A room with lamps of all shapes under its ceiling, all of them visible from the pose.
inline Scene random_room_scene(Random& random, const Rigid3& pose, int lamps) {
  Scene scene;
  scene.camera = random_camera(random);
  const int shape = random.below(5);  // 0 to 2: all discs
  const bool flat = occurs(random, 0.3);
  while (static_cast<int>(scene.lamps.size()) < lamps) {
    const Eigen::Vector3d centre(random.uniform(0.6, 3.4), random.uniform(0.6, 3.4),
                                 flat ? 3 : random.uniform(2.2, 3));
    Lamp lamp = disc_lamp(static_cast<int>(scene.lamps.size()), centre, random.uniform(0.03, 0.16));
    lamp.normal = -Eigen::Vector3d::UnitZ();
    if (occurs(random, 0.3)) lamp.normal += 0.3 * random_vector(random);
    lamp.half_power_rad = random.uniform(0.6, 1.25);
    lamp.power_sigma = random.uniform(0.01, 0.2);
    lamp.size_m = {random.uniform(0.1, 0.5), random.uniform(0.05, 0.2)};
    lamp.x_axis = random_vector(random);
    lamp.exponent = random.uniform(1.5, 5);
    if (shape == 3 || (shape == 4 && occurs(random, 0.3))) lamp.shape = LampShape::rectangle;
    if (shape == 4 && occurs(random, 0.3)) lamp.shape = LampShape::point;
    if (shape == 4 && occurs(random, 0.2)) lamp.shape = LampShape::lame;
    lamp.validate();
    const auto px = project_lamp_centre(lamp, pose, scene.camera);
    const Eigen::Vector2d middle(320, 240), most(290, 210);
    if (!px || ((*px - middle).cwiseAbs().array() > most.array()).any()) continue;
    if (!project_rim(lamp, pose, scene.camera, 32) || !lamp.shows_lit_side(pose.origin_in_source()))
      continue;
    scene.lamps.push_back(lamp);
  }
  scene.validate();
  return scene;
}

/// Adds what the detection states about a blob.
inline void describe_blobs(MeasuredRoom& room, Random& random) {
  for (std::size_t i = 0; i < room.blobs.size(); ++i) {
    Blob& blob = room.blobs[i];
    const Lamp& lamp = room.scene.lamps[i];
    Eigen::Vector2d low = blob.centroid_px, high = blob.centroid_px;
    for (const RimPoint& point : blob.rim) {
      low = low.cwiseMin(point.px);
      high = high.cwiseMax(point.px);
    }
    if (blob.rim.empty()) {
      low.array() -= 5;
      high.array() += 5;
    }
    blob.x0 = static_cast<int>(low.x());
    blob.y0 = static_cast<int>(low.y());
    blob.x1 = static_cast<int>(high.x()) + 1;
    blob.y1 = static_cast<int>(high.y()) + 1;
    const double half = 0.25 * (high - low).sum();
    blob.ellipse.centre_px = blob.centroid_px;
    blob.ellipse.semi_major_px = 1.1 * half;
    blob.ellipse.semi_minor_px = 0.9 * half;
    blob.ellipse.angle_rad = random.uniform(-1.5, 1.5);
    if (lamp.shape == LampShape::rectangle && !blob.rim.empty()) {
      const Eigen::Vector3d a = 0.5 * lamp.size_m.x() * lamp.x_axis;
      const Eigen::Vector3d b = 0.5 * lamp.size_m.y() * lamp.normal.cross(lamp.x_axis);
      for (const Eigen::Vector3d& corner : {Eigen::Vector3d(a + b), Eigen::Vector3d(a - b),
                                            Eigen::Vector3d(-a - b), Eigen::Vector3d(b - a)})
        if (const auto px = room.scene.camera.project(room.truth * (lamp.centre_m + corner)))
          blob.corners_px.push_back(*px);
    }
    if (occurs(random, 0.1))
      blob.light_response_px2 = random.uniform(1, 9) * Eigen::Matrix2d::Identity();
    if (occurs(random, 0.1)) blob.rim_covariance_px2(0, 0) = square(random.uniform(0.1, 1));
    if (occurs(random, 0.1)) blob.rim_covariance_px2.diagonal().tail<4>().setConstant(0.01);
    if (!occurs(random, 0.15)) blob.peak_dn = 100;
  }
}

/// Gross errors: a displaced lamp, stray points of a rim, cut and merged blobs, two exchanged
/// lamps.
inline void add_gross_errors(MeasuredRoom& room, Random& random) {
  const auto any = [&] {
    return static_cast<std::size_t>(random.below(static_cast<int>(room.blobs.size())));
  };
  if (occurs(random, 0.25)) {
    Blob& blob = room.blobs[any()];
    const Eigen::Vector2d by = noise_2d(random, even_log(random, 0.2, 20));
    blob.centroid_px += by;
    for (RimPoint& point : blob.rim) point.px += by;
  }
  if (occurs(random, 0.25)) {
    Blob& blob = room.blobs[any()];
    for (std::size_t i = 0; i < blob.rim.size() / 4; ++i)
      blob.rim[i].px += random.uniform(-3, 1) * blob.rim[i].normal;
  }
  if (occurs(random, 0.25)) {
    Blob& blob = room.blobs[any()];
    blob.cut_by_border = true;
    blob.rim.resize(blob.rim.size() / (blob.corners_px.empty() ? 2 : 5));  // one side of a panel
  }
  if (occurs(random, 0.1)) room.blobs[any()].merged = true;
  if (occurs(random, 0.05)) std::swap(room.blobs[any()], room.blobs[any()]);
}

/// Errors that the scene states, or not, of a map from which the lamps differ.
inline void add_map_errors(Scene& scene, Random& random) {
  if (occurs(random, 0.15)) scene.map_sigma_m = Eigen::Vector3d(0.003, 0.004, 0.01);
  for (Lamp& lamp : scene.lamps) {
    if (occurs(random, 0.15)) lamp.position_sigma_m = Eigen::Vector3d(0.01, 0.005, 0.002);
    if (occurs(random, 0.1)) lamp.size_sigma = 0.03;
    if (occurs(random, 0.1)) lamp.tilt_sigma_rad = 0.05;
  }
  if (occurs(random, 0.12))
    for (Lamp& lamp : scene.lamps)
      lamp.shared_errors_m = {Eigen::Vector3d(0, 0, 0.01), 0.003 * lamp.centre_m};
  if (occurs(random, 0.12) && scene.camera.is_pinhole())
    scene.camera = scene.camera.with_parameter_sigmas({{"f_px", 4}, {"cx_px", 2}});
}

inline void displace_lamps(Scene& scene, double sigma_m, double size_sigma, Random& random) {
  for (Lamp& lamp : scene.lamps) {
    lamp.centre_m += sigma_m * random_vector(random);
    lamp.radius_m *= std::exp(size_sigma * random.normal());
  }
}

inline RefineOptions random_refine_options(const MeasuredRoom& room, Random& random) {
  RefineOptions options;
  const Rung rungs[] = {Rung::points, Rung::centres, Rung::rims, Rung::rims};
  options.rung = rungs[random.below(4)];
  if (occurs(random, 0.3))
    options.flux = occurs(random, 0.5) ? FluxModel::known_power : FluxModel::common_factor;
  if (occurs(random, 0.25)) {
    Prior prior;
    if (occurs(random, 0.6))
      prior.gravity_in_cam = room.truth.rotation * Eigen::Vector3d(0.01, 0, -1);
    if (occurs(random, 0.5)) prior.height_m = room.truth.origin_in_source().z() + 0.01;
    options.prior = prior;
  }
  if (occurs(random, 0.15)) options.model_sigma_px = even_log(random, 0.02, 1);
  if (occurs(random, 0.15)) options.huber_sigma = std::numeric_limits<double>::infinity();
  if (occurs(random, 0.1)) options.huber_sigma = 1.5;
  if (occurs(random, 0.1)) options.max_iterations = 1 + random.below(4);
  if (occurs(random, 0.1)) options.tolerance_px = even_log(random, 1e-6, 1);
  return options;
}

inline MeasuredRoom random_measured_room(std::uint64_t stream) {
  Random random(81, stream);
  MeasuredRoom room;
  room.truth = random_room_pose(random);
  const int lamps = occurs(random, 0.2) ? 1 + random.below(3) : 4 + random.below(5);
  room.scene = random_room_scene(random, room.truth, lamps);
  Measurement m;
  m.rim_points = occurs(random, 0.7) ? 4 + random.below(40) : 0;
  m.rim_sigma_px = even_log(random, 0.01, 0.2);
  m.centroid_sigma_px = even_log(random, 0.01, 0.5);
  m.flux_sigma = random.uniform(0, 0.05);
  if (occurs(random, 0.2)) m.growth_px = random.uniform(0.3, 3);
  room.blobs = noisy(exact_blobs(room.scene, room.truth, m), room.scene, m, random);
  room.matches = in_order(room.scene);
  describe_blobs(room, random);
  add_gross_errors(room, random);
  add_map_errors(room.scene, random);
  if (occurs(random, 0.35))
    displace_lamps(room.scene, even_log(random, 1e-4, 3e-2), occurs(random, 0.4) ? 0.05 : 0,
                   random);
  room.scene.validate();
  Vector6 off;
  for (double& value : off) value = even_log(random, 1e-3, 0.05) * random.normal();
  room.start = perturb(room.truth, off);
  room.options = random_refine_options(room, random);
  return room;
}

/// Square roots with the signs of the values: of covariances, which may be tiny.
inline std::vector<double> signed_roots(const Eigen::Ref<const Eigen::MatrixXd>& values) {
  std::vector<double> roots;
  for (const double value : values.reshaped())
    roots.push_back(std::copysign(std::sqrt(std::abs(value)), value));
  return roots;
}

/// Levels are solved to 1e-4, in steps that depend on rounding, and are compared to 1 %.
inline void add_level(CaseResults& results, const Result<ProtectionLevel>& level) {
  const auto coarse = [](double value_m) { return std::round(100 * std::log(value_m)) / 100; };
  results.add("level",
              std::vector<double>{static_cast<double>(level.status), coarse(level->horizontal_m),
                                  coarse(level->vertical_m), level->unmonitored,
                                  static_cast<double>(level->hypotheses)});
  const std::vector<int>& lamps = level->contradicting_lamps;
  results.summarise("contradicting", std::vector<double>(lamps.begin(), lamps.end()));
}

inline void add_refined(CaseResults& results, const Result<Refined>& result) {
  const Refined& r = *result;
  results.add("status", static_cast<double>(result.status));
  results.add("pose", r.cam_from_world);
  results.add("iterations", r.iterations);
  if (result.status == Status::too_few_lamps || result.status == Status::degenerate) return;
  results.add("sigma", signed_roots(r.covariance.diagonal()));
  results.summarise("covariance", signed_roots(r.covariance));
  results.summarise("information", signed_roots(r.lamp_information));
  results.add("fit",
              std::vector<double>{r.chi2, static_cast<double>(r.dof), r.variance_factor, r.rms_px,
                                  r.estimated_map_sigma_m.value_or(-1),
                                  r.estimated_size_sigma.value_or(-1), r.rim_growth_px.value_or(-1),
                                  r.psf_sigma_px.value_or(-1), r.flux_factor.value_or(-1)});
  std::vector<double> lamps, errors;
  for (const LampResidual& lamp : r.lamps) {
    lamps.insert(lamps.end(), {static_cast<double>(lamp.rung), lamp.contradicts ? 1.0 : 0.0,
                               lamp.misfit, lamp.rms_px, lamp.centre_px.x(), lamp.centre_px.y()});
    for (const double value : lamp.position_error_m) errors.push_back(100 * value);
    errors.push_back(100 * lamp.size_error);
  }
  results.summarise("lamps", lamps);
  results.summarise("errors", errors);
}

inline void add_evidence(CaseResults& results, const internal::pose::PoseEvidence& evidence) {
  results.add("evidence", std::vector<double>{static_cast<double>(evidence.blobs),
                                              static_cast<double>(evidence.missed),
                                              evidence.volume_m3, evidence.rotations,
                                              evidence.model_sigma_px, evidence.log_appearance});
  std::vector<double> places, shapes, prior;
  const auto add = [](const auto& values, std::vector<double>& to) {
    for (const double value : values.reshaped()) to.push_back(value);
  };
  for (const auto* list : {&evidence.lamps, &evidence.corners})
    for (const internal::pose::SeenLamp& lamp : *list) {
      add(lamp.residual_px, places);
      add(Eigen::MatrixXd(10 * lamp.covariance_px2), places);
      add(Eigen::MatrixXd(0.01 * lamp.by_pose), places);
      add(lamp.by_size, places);
      if (std::isinf(lamp.shape_sigma_px)) continue;
      add(lamp.shape_residual_px, shapes);
      add(lamp.shape_by_size, shapes);
      add(Eigen::MatrixXd(0.1 * lamp.shape_by_pose), shapes);
      shapes.push_back(10 * lamp.shape_sigma_px);
    }
  for (const internal::pose::PriorPart& part : evidence.prior) {
    const std::vector<double> roots = signed_roots(part.information);
    prior.insert(prior.end(), roots.begin(), roots.end());
    prior.insert(prior.end(), {part.chi2, 1e3 * part.wrong, part.is_place ? 1.0 : 0.0});
  }
  results.summarise("places", places);
  results.summarise("shapes", shapes);
  results.summarise("prior", prior);
}

/// Adds what follows from a refined pose.
inline void add_conclusions(CaseResults& results, const Result<Refined>& result,
                            const MeasuredRoom& room) {
  if (!result.ok()) return;
  add_level(results, protection_level(result->separation, 1e-4));
  const std::vector<int> separated = separated_lamps(result->separation);
  results.summarise("separated", std::vector<double>(separated.begin(), separated.end()));
  using namespace internal::refine;
  const ErrorGradient gradient = error_gradient(*result, room.blobs, room.scene, room.options);
  results.summarise("gradient", signed_roots(gradient.gradient_by_errors));
  results.add("size", size_contradiction(*result, room.blobs, room.scene).empty() ? 0 : 1);
  Hypothesis hypothesis;
  hypothesis.missed = static_cast<int>(room.blobs.size()) % 3;
  add_evidence(results,
               evidence_of(*result, hypothesis, room.blobs, room.scene, room.options.prior));
}

}  // namespace occ::test
