// SPDX-License-Identifier: Apache-2.0
// Results of the filters and of the prediction of lamps, compared with those of an earlier version.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "libocc/track/internal/expected_lamps.hpp"
#include "libocc/track/planar_filter.hpp"
#include "libocc/track/pose_filter.hpp"
#include "tests/identify/reference_support.hpp"
#include "tests/locate/reference_support.hpp"

namespace occ::test {
namespace {

using namespace internal::track;

void add_matrix(std::vector<double>& numbers, const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  for (const double value : matrix.reshaped()) numbers.push_back(value);
}

/// A room with blinking lamps, and the prediction of a moving camera.
struct PredictedCase {
  Scene scene;
  PredictedCamera predicted;
  View view;

  PredictedCase(int i, Random& random) {
    scene = varied_room(random, 5 + i % 6, i);
    for (Lamp& lamp : scene.lamps) {
      lamp.frequency_hz.reset();
      if (i % 4 == 1 && lamp.id % 2) lamp.frequency_hz = 30 + 500 * (lamp.id % 3), lamp.duty = 0.4;
      if (i % 8 == 5 && lamp.id % 3 == 0) {
        lamp.frequency_hz = 100;
        lamp.waveform = {0, 0, 1, 0, 1, 1, 0, 0};
      }
    }
    scene.sensor.exposure_s = i % 3 ? 4e-3 : 2e-4;
    scene.sensor.row_time_s = i % 5 == 4 ? 0 : 5e-5;
    if (i % 7 == 3) scene.sensor.readout = Readout::columns;
    scene.validate();
    const Rigid3 truth = random_room_pose(random, 0.3);
    predicted.cam_from_world = truth;
    predicted.after_s = i % 2 ? 0.01 : 0.03;
    const double size =
        std::array<double, 4>{1e-3, 5e-3, 0.02, 0.1}[static_cast<std::size_t>(i % 4)];
    predicted.covariance.setZero();
    for (int k = 0; k < 6; ++k) {
      predicted.covariance(k, k) = square(size * (1 + 0.1 * k));
      if (i % 6) predicted.velocity[k] = 0.3 * random.normal();
      predicted.velocity_covariance(k, k) = square(i % 4 == 2 ? 1.0 : 0.02);
    }
    predicted.covariance(0, 4) = predicted.covariance(4, 0) = 0.3 * square(size);
    Look look;
    look.sigma_px = std::array<double, 4>{0.1, 1, 4, 10}[static_cast<std::size_t>(i % 4)];
    look.sized = i % 2;
    look.cut = look.merged = 0.1;
    look.saturated = i % 3 == 2 ? 0.3 : 0;
    look.coloured = i % 6 == 4;
    look.read_frequencies = look.read_ids = i % 5 == 1 ? 0.5 : 0;
    view = look_at_lamps(scene, truth, look, random, i % 6);
    for (Blob& blob : view.blobs) {
      blob.peak_dn = std::exp(random.uniform(1, 5));
      blob.background_dn = 2;
      if (blob.frequency_hz && random.uniform() < 0.5) *blob.frequency_hz *= 1.03;
    }
  }
};

std::vector<double> numbers_of(const std::vector<ExpectedLamp>& expected) {
  std::vector<double> numbers;
  for (const ExpectedLamp& lamp : expected) {
    add_matrix(numbers, lamp.px);
    add_matrix(numbers, lamp.covariance_px2);
    for (const double value : {1.0 * lamp.lamp, lamp.radius_px, lamp.lines_px, lamp.smear_px,
                               10.0 * lamp.sure + 100.0 * lamp.dark + 1000.0 * lamp.cut})
      numbers.push_back(value);
    if (!lamp.before) continue;
    numbers.push_back(lamp.before->contrast_dn);
    numbers.push_back(lamp.before->area_px);
  }
  return numbers;
}

TEST(References, PredictedLamps) {
  References references("track/predicted_lamps");
  for (int i = 0; i < 300; ++i) {
    Random random(701, static_cast<std::uint64_t>(i));
    PredictedCase c(i, random);
    const double gate = i % 3 ? 4 : 2;
    std::vector<ExpectedLamp> expected =
        expected_lamps(c.scene, c.predicted, gate, i % 2 ? 0.5 : 2);
    CaseResults results;
    results.summarise("expected", numbers_of(expected));
    std::vector<double> windows;
    for (const PixelWindow& w : windows_of(expected, c.scene.camera, gate))
      for (const int side : {w.x0, w.y0, w.x1, w.y1}) windows.push_back(side);
    results.summarise("windows", windows);
    for (ExpectedLamp& lamp : expected)
      if (random.uniform() < 0.7)
        lamp.before = LampLook{0, std::exp(random.uniform(1, 5)), std::exp(random.uniform(2, 7))};
    adapt_looks(expected, c.view.blobs, c.scene, gate);
    results.summarise("adapted", numbers_of(expected));
    const std::vector<Match> matches = match_expected(expected, c.view.blobs, c.scene, gate);
    std::vector<double> numbers;
    for (const Match& m : matches) numbers.push_back(m.lamp + 0.01 * m.blob);
    results.summarise("matches", numbers);
    results.add("delay", mean_delay_s(c.scene.sensor, matches, c.view.blobs));
    to_time_of(c.predicted, c.scene, matches, c.view.blobs);
    std::vector<double> places, covariances;
    for (const Blob& blob : c.view.blobs) {
      add_matrix(places, blob.centroid_px);
      for (const RimPoint& point : blob.rim) add_matrix(places, point.px);
      add_matrix(covariances, blob.covariance_px2);
      add_matrix(covariances, blob.rim_covariance_px2);
    }
    results.summarise("moved", places);
    results.summarise("covariances", covariances);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

void add_update(std::vector<double>& numbers, const FilterUpdate& update) {
  for (const double value : {static_cast<double>(update.outcome), update.nis, 1.0 * update.nis_dof})
    numbers.push_back(value);
}

/// An observation with some systematic errors of a moving camera.
PoseObservation observation_at(double time_s, const Rigid3& body_from_world, int i,
                               Random& random) {
  const Rigid3 mount = look_at({0.1, -0.05, 0.3}, {0.1, -0.05, 1}, {0, 1, 0});
  const double sigma = i % 4 == 3 ? 0.05 : 5e-3;
  Vector6 off;
  for (double& value : off) value = sigma * random.normal();
  if (i % 9 == 8) off *= 30;
  PoseObservation seen = PoseObservation::of_pose(time_s, perturb(mount * body_from_world, off),
                                                  sigma * sigma * Matrix6::Identity(), mount);
  if (i % 5 == 2) seen.information.topRows<2>().setZero(), seen.information.leftCols<2>().setZero();
  if (i % 3 == 1) {
    seen.systematic = {i % 4, 7, 9 + i % 3};
    seen.gradient_by_systematic.resize(6, 3);
    for (Eigen::Index k = 0; k < 18; ++k)
      seen.gradient_by_systematic(k) = 0.3 / sigma * random.normal();
    if (i % 5 == 2) seen.gradient_by_systematic.topRows<2>().setZero();
    seen.uncertain_systematic = i % 6 == 1 ? 1 : 0;
  }
  return seen;
}

ImuSample sample_at(double time_s, Random& random) {
  return {time_s, 0.3 * random_vector(random),
          Eigen::Vector3d(0, 0, 9.80665) + 0.2 * random_vector(random)};
}

TEST(References, FiltersInSpace) {
  References references("track/filters_in_space");
  for (int i = 0; i < 200; ++i) {
    Random random(702, static_cast<std::uint64_t>(i));
    PoseFilterOptions options;
    if (i % 5 == 1) options.acceleration_noise = 2, options.turn_acceleration_noise = 0.3;
    if (i % 5 == 2) options.gyro_noise = 0.02, options.accelerometer_noise = 0.3;
    if (i % 5 == 3) options.gyro_bias_walk = 0.01, options.accelerometer_bias_walk = 0.05;
    if (i % 5 == 4) options.use_accelerometer = false, options.start_speed_sigma_m_s = 0.2;
    if (i % 7 == 2) options.imu_hold_s = 0.2;
    if (i % 7 == 3) options.history_s = 0.5;
    options.gate_sigma = i % 4 == 3 ? 3 : 5;
    PoseFilter filter(options);
    Rigid3 body = Rigid3{so3_exp(0.2 * random_vector(random)), random_vector(random)};
    filter.start(0, body, 1e-3 * Matrix6::Identity());
    std::vector<double> updates, poses, velocities, biases, covariances;
    for (int k = 1; k <= 12; ++k) {
      const double now_s = 0.1 * k + (k > 8 && i % 6 == 5 ? 3 : 0);
      const Rigid3 step{so3_exp({0.01, 0, 0.03}), {0.04, 0.01, 0}};
      if (i % 3 == 0)
        add_update(updates,
                   filter.add(Odometry{now_s - 0.1, now_s, step, 1e-5 * Matrix6::Identity()}));
      if (i % 3 == 1 || i % 6 == 3)
        for (int s = 0; s < 3; ++s)
          add_update(updates, filter.add(sample_at(now_s - 0.1 + 0.03 * s, random)));
      body = step * body;
      const double late_s = k % 5 == 4 ? 0.13 : 0;
      add_update(updates, filter.add(observation_at(now_s - late_s, body, i + k, random)));
      const auto found = filter.at(now_s + (k % 3 ? 0.02 : 0.3));
      if (!found) continue;
      append(poses, found->body_from_world);
      append(covariances, found->covariance);
      append(covariances, found->velocity_covariance);
      add_matrix(velocities, found->velocity);
      add_matrix(biases, found->gyro_bias_rad_s);
      add_matrix(biases, found->accelerometer_bias_m_s2);
      add_matrix(biases, found->by_systematic);
    }
    CaseResults results;
    results.summarise("updates", updates);
    results.summarise("poses", poses);
    results.summarise("velocities", velocities);
    results.summarise("biases", biases);
    results.summarise("covariances", covariances);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, FiltersOnAFloor) {
  References references("track/filters_on_a_floor");
  for (int i = 0; i < 200; ++i) {
    Random random(703, static_cast<std::uint64_t>(i));
    PlanarFilterOptions options;
    options.height_m = 0.2;
    if (i % 5 == 1) options.acceleration_noise = 2, options.turn_acceleration_noise = 0.3;
    if (i % 5 == 2) options.gyro_noise = 0.02, options.lateral_noise = 0.5;
    if (i % 5 == 3) options.gyro_bias_walk = 0.01, options.tilt_sigma_rad = 0.02;
    if (i % 5 == 4) options.height_sigma_m = 0.03, options.start_turn_sigma_rad_s = 0.2;
    if (i % 7 == 2) options.imu_hold_s = 0.2;
    if (i % 7 == 3) options.history_s = 0.5;
    options.gate_sigma = i % 4 == 3 ? 3 : 5;
    PlanarFilter filter(options);
    PlanarPose pose{1, 1, 0.3};
    filter.start(0, pose, 1e-3 * Eigen::Matrix3d::Identity());
    std::vector<double> updates, poses, covariances;
    for (int k = 1; k <= 12; ++k) {
      const double now_s = 0.1 * k + (k > 8 && i % 6 == 5 ? 3 : 0);
      const PlanarPose step = arc(0.05, 0.06 * std::sin(0.3 * k));
      if (i % 3 == 0)
        add_update(updates, filter.add(PlanarOdometry{now_s - 0.1, now_s, step,
                                                      4e-6 * Eigen::Matrix3d::Identity()}));
      if (i % 3 == 1 || i % 6 == 3)
        for (int s = 0; s < 3; ++s)
          add_update(updates, filter.add(sample_at(now_s - 0.1 + 0.03 * s, random)));
      pose = pose * step;
      const double late_s = k % 5 == 4 ? 0.13 : 0;
      add_update(updates, filter.add(observation_at(now_s - late_s, body_from_world(pose, 0.2),
                                                    i + k, random)));
      const double then_s = now_s + (k % 3 ? 0.02 : 0.3);
      const auto found = filter.at(then_s);
      if (!found) continue;
      for (const double value :
           {found->pose.x_m, found->pose.y_m, found->pose.heading_rad, found->gyro_bias_rad_s})
        poses.push_back(value);
      add_matrix(poses, found->velocity);
      add_matrix(covariances, (1e3 * found->covariance).eval());
      add_matrix(covariances, found->velocity_covariance);
      const auto in_space = filter.predict(then_s);
      append(covariances, in_space->covariance);
      append(poses, in_space->body_from_world);
      add_matrix(poses, in_space->velocity);
      add_matrix(poses, in_space->by_systematic);
    }
    CaseResults results;
    results.summarise("updates", updates);
    results.summarise("poses", poses);
    results.summarise("covariances", covariances);
    references.add(std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
