// SPDX-License-Identifier: Apache-2.0
// Refined poses of random rooms, compared with those of an earlier version.
#include <gtest/gtest.h>

#include "libocc/refine/bound.hpp"
#include "libocc/refine/internal/expected_error.hpp"
#include "libocc/refine/internal/pose_roots.hpp"
#include "tests/refine/reference_rooms.hpp"

namespace occ::test {
namespace {

using namespace internal::refine;

TEST(References, RefinedPosesOfMeasuredBlobs) {
  References references("refine/poses");
  for (std::uint64_t i = 0; i < 450; ++i) {
    const MeasuredRoom room = random_measured_room(i);
    const Result<Refined> refined =
        refine(room.start, room.matches, room.blobs, room.scene, room.options);
    CaseResults results;
    add_refined(results, refined);
    add_conclusions(results, refined, room);
    references.add("room " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

// Three spots under a ceiling, seen from near the cylinder through their circle, where two poses
// meet. The pose is not determined well there, unlike its fit.
TEST(References, PosesNearTheDangerCylinder) {
  References references("refine/cylinder");
  for (std::uint64_t i = 0; i < 60; ++i) {
    Random random(82, i);
    MeasuredRoom room;
    room.scene.camera = vga_camera();
    constexpr double radius_m = 0.8;
    for (int k = 0; k < 3; ++k) {
      const double angle = (1.3 + 0.3 * random.uniform()) * k;
      const Eigen::Vector3d centre(radius_m * std::cos(angle), radius_m * std::sin(angle), 2.5);
      room.scene.lamps.push_back(disc_lamp(k, centre, 0.003));
    }
    const double out_m = radius_m - (i % 3 == 0 ? 0 : even_log(random, 1e-3, 0.3));
    const double angle = random.uniform(0.8, 2);
    const Eigen::Matrix3d rotation =
        so3_exp({random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0});
    room.truth = {rotation,
                  -rotation * Eigen::Vector3d(out_m * std::cos(angle), out_m * std::sin(angle), 0)};
    Measurement m;
    m.centroid_sigma_px = 0.03;
    room.blobs = noisy(exact_blobs(room.scene, room.truth, m), room.scene, m, random);
    room.matches = in_order(room.scene);
    room.options.rung = Rung::centres;
    room.options.max_iterations = i % 2 == 0 ? 200 : 20;
    const Result<Refined> refined =
        refine(room.truth, room.matches, room.blobs, room.scene, room.options);
    CaseResults results;
    results.add("status", static_cast<double>(refined.status));
    results.add("chi2", std::round(1e4 * refined->chi2));
    if (refined.ok()) {
      std::vector<double> logs;  // of the sigmas
      for (const double variance : refined->covariance.diagonal())
        logs.push_back(std::round(50 * std::log(variance)));
      results.add("sigma", logs);
      results.add("roots",
                  static_cast<double>(other_roots(*refined, room.blobs, room.scene).size()));
    }
    references.add("view " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
