// SPDX-License-Identifier: Apache-2.0
// Results of trackers on short sequences of images, compared with those of an earlier version.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/geometry/motion.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"
#include "tests/locate/reference_support.hpp"

namespace occ::test {
namespace {

constexpr double step_s = 1.0 / 30;

Scene sequence_scene(int i) {
  constexpr std::array<const char*, 4> names{"irregular_six", "ufsook_four", "kookmin_four_lamps",
                                             "square_four"};
  const std::string name = names[static_cast<std::size_t>(i / 4 % 4)];
  Scene scene = read_scene(std::string(LIBOCC_DATA) + "/scenes/" + name + ".yaml");
  if (i % 5 == 1) scene.map_sigma_m = Eigen::Vector3d(0.003, 0.003, 0.005);
  if (i % 5 == 2 || i % 10 == 1) {
    const Eigen::Index n = scene.camera.parameter_covariance().rows();
    scene.camera = scene.camera.with_parameter_covariance(0.04 * Eigen::MatrixXd::Identity(n, n));
  }
  if (i % 5 == 3) scene.lamps.front().position_sigma_m = Eigen::Vector3d(0.01, 0.01, 0.01);
  if (i % 6 == 4) scene.sensor.row_time_s = 5e-5;
  return scene;
}

/// A camera that looks up, moves along x and turns.
Rigid3 moving_camera(double time_s, bool elsewhere) {
  const Rigid3 camera = look_at({0, 0, 0.4}, {0.02, 0, 1}, {0, 1, 0});
  return camera * body_from_world({1.7 + 0.3 * time_s + (elsewhere ? 0.6 : 0), 2 + 0.1 * time_s,
                                   0.2 * time_s + (elsewhere ? 0.3 : 0)});
}

TrackerOptions sequence_options(int i) {
  TrackerOptions options;
  if (i % 3 == 1) options.floor.emplace();
  if (i % 4 == 1 || i % 5 == 0) options.locate.refine.rung = Rung::centres;
  if (i % 5 == 3) options.locate.refine.rung = Rung::points;
  if (i % 4 == 2) options.mount_sigma_rad = 2e-3, options.mount_sigma_m = 2e-3;
  if (i % 4 == 3) options.clock_sigma_s = 2e-3;
  if (i % 5 == 4 || i % 6 == 1) options.alert_limit_m = 0.05;
  if (i % 7 == 3) options.windows = false;
  if (i % 7 == 5) options.gate_sigma = 3, options.model_sigma_px = 2;
  if (i % 8 == 5 || i % 8 == 6) options.coast_s = 0.07;
  if (i % 8 == 7) options.confirmations = 1;
  if (i % 9 == 4) options.coast_sigma_m = 0.02;
  if (i % 9 == 8) options.integrity_risk = 1e-3;
  if (i % 8) {
    options.locate.prior.emplace();
    options.locate.prior->height_m = 0.4;
    if (i % 7) options.locate.prior->heading_rad = heading_rad(moving_camera(0, false));
  }
  return options;
}

/// The images of a sequence: some are dark, repeated, late, or from elsewhere.
CaseResults tracked(int i) {
  const Scene scene = sequence_scene(i);
  Scene dark = scene, one = scene;
  for (Lamp& lamp : dark.lamps) lamp.power_w = 1e-9;
  one.lamps.resize(i % 3 ? 1 : 2);
  Renderer renderer(scene), dark_renderer(dark), one_renderer(one);
  const Rigid3 mount =
      i % 3 == 1 ? moving_camera(0, false) * body_from_world(PlanarPose{1.7, 2, 0}).inverse()
                 : Rigid3{};
  Scene map = scene;
  if (i % 7 == 6) map.lamps.back().centre_m.x() += 0.06;
  Tracker tracker(map, sequence_options(i), mount);
  const Rigid3 other_mount = Rigid3{so3_exp({0, 0, 0.5 * pi}), {0.05, 0, 0}} * mount;
  const int other = i % 4 == 3 || i % 9 == 0 ? tracker.add_camera(map, other_mount) : 0;
  if (i % 4 == 3)
    tracker.start(-step_s,
                  mount.inverse() * perturb(moving_camera(0, false), 0.01 * Vector6::Ones()),
                  4e-4 * Matrix6::Identity());
  SimulateOptions simulation;
  simulation.noise_area = NoiseArea::around_lamps;
  Rendered rendered;
  std::vector<double> states, poses, covariances, levels, lamps;
  std::string reasons;
  for (int k = 0; k < 12; ++k) {
    const double time_s = k * step_s;
    const bool elsewhere = i % 4 == 0 && k >= 7;
    const bool is_dark = i % 4 == 1 && k >= 5 && k < 9;
    const bool is_one = i % 4 == 2 && k >= 4;
    const Rigid3 pose = moving_camera(time_s, elsewhere);
    simulation.frame = static_cast<std::uint32_t>(k);
    simulation.start_s = time_s;
    simulation.velocity = velocity_between(pose, moving_camera(time_s + 0.01, elsewhere), 0.01);
    (is_dark ? dark_renderer : is_one ? one_renderer : renderer).render(pose, simulation, rendered);
    const double stated_s = i % 6 == 5 && k >= 6 ? time_s - 0.17 : time_s;
    if (k > 0 && i % 3 == 1 && i % 2)
      tracker.add(PlanarOdometry{
          stated_s - step_s, stated_s, {0.01, 0.003, 0.007}, 1e-6 * Eigen::Matrix3d::Identity()});
    TrackedFrame frame = tracker.add_image(rendered.image.view(), stated_s);
    if (other > 0 && k % 3 == 2 && stated_s == time_s) {
      const double before_s = time_s - (k % 2 ? 0.01 : 0.04);  // arrives late
      renderer.render(other_mount * mount.inverse() * moving_camera(before_s, elsewhere),
                      simulation, rendered);
      frame = tracker.add_image(rendered.image.view(), before_s, {other, {}});
    }
    states.push_back(static_cast<double>(frame.state));
    for (const double value :
         {10.0 * frame.full_search, 100.0 * frame.relocated, frame.nis, 1.0 * frame.nis_dof,
          0.1 * static_cast<double>(frame.missing.size())})
      states.push_back(value);
    if (std::isfinite(frame.protection_level_m)) levels.push_back(frame.protection_level_m);
    const double later = tracker.protection_level_m(stated_s + 0.05);
    if (std::isfinite(later)) levels.push_back(later);
    for (const auto& [id, blob] : frame.lamps) lamps.push_back(id + 1e-3 * blob.centroid_px.x());
    if (!frame.reason.empty()) reasons += std::to_string(k) + "_" + joined(frame.reason) + "_";
    if (!frame.covariance.allFinite()) continue;
    append(poses, frame.cam_from_world);
    append(covariances, frame.covariance);
    append(poses, tracker.predict(stated_s + 0.02).value_or(PosePrediction{}).body_from_world);
  }
  CaseResults results;
  results.summarise("states", states);
  results.summarise("poses", poses);
  results.summarise("covariances", covariances);
  results.summarise("levels", levels);
  results.summarise("lamps", lamps);
  if (!reasons.empty()) results.add("reasons", reasons);
  return results;
}

TEST(References, TrackedSequences) {
  References references("track/sequences");
  for (int i = 0; i < 40; ++i) references.add(std::to_string(i), tracked(i));
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
