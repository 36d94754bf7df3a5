// SPDX-License-Identifier: Apache-2.0
// Drives below a ceiling of which a frame shows a few lamps: often three, which have up to four
// poses, or none. Odometry is right.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/smooth/smoother_support.hpp"

namespace occ::test {

/// A camera that looks up moves on a random smooth path. From frame `first_cut` on, a frame loses
/// all lamps, or all but one or two, with a probability of 40 %. `max_lamps` limits the lamps of
/// all frames before `cut_until`.
struct FewLampsOptions {
  int frames = 40;
  int first_cut = 4;
  int max_lamps = 100;
  int cut_until = 0;
};

inline std::vector<Eigen::Vector3d> random_ceiling(Random& random) {
  std::vector<Eigen::Vector3d> lamps(14 + random.below(8));
  for (Eigen::Vector3d& lamp : lamps)
    lamp = {random.uniform(-1, 7), random.uniform(-1, 7), random.uniform(2.6, 3.2)};
  return lamps;
}

inline std::vector<Rigid3> random_path(Random& random, int frames, double period_s) {
  double phase[6], rate[6];
  for (int i = 0; i < 6; ++i) {
    phase[i] = random.uniform(0, 2 * pi);
    rate[i] = random.uniform(0.15, 0.5);
  }
  std::vector<Rigid3> out;
  for (int k = 0; k < frames; ++k) {
    const double t = period_s * k;
    const auto wave = [&](int i, double times) { return std::sin(times * rate[i] * t + phase[i]); };
    const Eigen::Vector3d place(3 + 1.5 * wave(0, 1), 3 + 1.5 * wave(1, 1), 0.8 + 0.3 * wave(2, 1));
    const Eigen::Matrix3d rotation = so3_exp({0.25 * wave(3, 2), 0.25 * wave(4, 2), 0}) *
                                     so3_exp({0, 0, 0.8 * rate[5] * t + phase[5]});
    out.push_back({rotation, -(rotation * place)});
  }
  return out;
}

inline Drive few_lamps_drive(std::uint64_t seed, const FewLampsOptions& options = {}) {
  constexpr double sigma_px = 0.5, sigma_m = 0.01, sigma_rad = 0.5 * pi / 180, period_s = 0.1;
  const Camera camera = Camera::pinhole(640, 480, 400, 410, 319.5, 239.5);
  Random random(seed, 11);
  const std::vector<Eigen::Vector3d> lamps = random_ceiling(random);
  Drive drive;
  drive.truth = random_path(random, options.frames, period_s);
  for (int k = 0; k < options.frames; ++k) {
    const Rigid3& pose = drive.truth[static_cast<std::size_t>(k)];
    SmootherFrame frame;
    frame.time_s = period_s * k;
    frame.camera = camera;
    for (const Eigen::Vector3d& lamp : lamps) {
      const auto px = camera.project(pose * lamp);
      if (!px || px->x() < 5 || px->x() > 635 || px->y() < 5 || px->y() > 475) continue;
      frame.sightings.push_back(sighting(camera, pose, lamp, sigma_px, &random));
    }
    const double lot = random.uniform();
    std::size_t most = k < options.cut_until ? static_cast<std::size_t>(options.max_lamps) : 100;
    if (k >= options.first_cut)
      most = std::min<std::size_t>(most, lot < 0.08 ? 0 : lot < 0.25 ? 1 : lot < 0.4 ? 2 : 100);
    if (frame.sightings.size() > most) frame.sightings.resize(most);
    drive.input.frames.push_back(frame);
    if (k == 0) continue;
    const Rigid3 step = pose * drive.truth[static_cast<std::size_t>(k) - 1].inverse();
    drive.input.odometry.push_back({period_s * (k - 1), period_s * k,
                                    perturb(step, random_part(random, sigma_rad, sigma_m)),
                                    part_covariance(sigma_rad, sigma_m)});
  }
  return drive;
}

}  // namespace occ::test
