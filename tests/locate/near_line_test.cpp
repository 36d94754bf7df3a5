// SPDX-License-Identifier: Apache-2.0
// Lamps and points on a line, or nearly: any turn about it explains what is seen, and evenly spaced
// ones look the same from the other end. What is said must be true.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/locate/solve_pose_support.hpp"
#include "tests/support/nees.hpp"

namespace occ::test {
namespace {

constexpr double length_m = 1.5;

struct Row {
  int count = 3;
  bool even = true;
  double height = 0;  ///< parts of the length, of the second lamp; of the others at most
};

/// Lamps on the ceiling along a row, its ends on the line.
std::vector<Eigen::Vector3d> row_of_lamps(Random& random, const Row& row) {
  const double azimuth = random.uniform(-3.14159, 3.14159);
  const Eigen::Vector3d along(std::cos(azimuth), std::sin(azimuth), 0);
  const Eigen::Vector3d aside(-along.y(), along.x(), 0);
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < row.count; ++i) {
    const bool end = i == 0 || i == row.count - 1;
    const double shift = row.even || end ? 0 : random.uniform(-0.25, 0.25);
    const double part = (i + shift) / (row.count - 1) - 0.5;
    const double off = end ? 0 : i == 1 ? 1 : random.uniform(-1, 1);
    centres.emplace_back(Eigen::Vector3d(2, 2, 3) +
                         length_m * (part * along + row.height * off * aside));
  }
  return centres;
}

struct RowView {
  Scene scene;
  Rigid3 truth;
  std::vector<Blob> blobs;
  std::vector<int> lamp;  ///< lamp index of each blob
};

/// All lamps whole and apart in a 640 x 480 image, with their discs tilted, or facing the camera:
/// then their rims do not see a turn about the row either.
RowView row_view(Random& random, const Row& row, bool facing) {
  constexpr double min_apart_px = 40, border_px = 25;
  while (true) {
    RowView view;
    view.scene = irregular_room();
    view.scene.lamps.clear();
    view.truth = random_room_pose(random);
    const Eigen::Vector3d position = view.truth.origin_in_source();
    for (const Eigen::Vector3d& centre : row_of_lamps(random, row)) {
      Lamp lamp = disc_lamp(static_cast<int>(view.scene.lamps.size()), centre, 0.05);
      if (facing) lamp.normal = (position - centre).normalized();
      view.scene.lamps.push_back(lamp);
    }
    const Rendered rendered = simulate(view.scene, view.truth);
    DetectOptions options;
    options.sensor = view.scene.sensor;
    view.blobs = detect(rendered.image.view(), options);
    for (const Blob& blob : view.blobs)
      for (const LampTruth& lamp : rendered.lamps)
        if ((lamp.image_centre_px - blob.centroid_px).norm() < 2) view.lamp.push_back(lamp.id);
    double apart_px = std::numeric_limits<double>::infinity(), inside_px = apart_px;
    for (const Blob& a : view.blobs) {
      const Eigen::Vector2d& px = a.centroid_px;
      inside_px = std::min({inside_px, px.x(), px.y(), 639 - px.x(), 479 - px.y()});
      for (const Blob& b : view.blobs)
        if (&a != &b) apart_px = std::min(apart_px, (px - b.centroid_px).norm());
    }
    if (static_cast<int>(view.blobs.size()) == row.count && view.lamp.size() == view.blobs.size() &&
        apart_px > min_apart_px && inside_px > border_px)
      return view;
  }
}

bool is_answer(const Result<Fix>& fix) { return fix.ok() || fix.status == Status::ambiguous; }

/// True if the true position is within the errors of a candidate. Rims of discs so small
/// are off by a little more than their noise.
bool holds_truth(const Fix& fix, const Rigid3& truth) {
  constexpr double too_far = 60;
  return std::any_of(fix.candidates.begin(), fix.candidates.end(), [&](const Candidate& c) {
    const Eigen::Vector3d error = c.position_m - truth.origin_in_source();
    const Eigen::Matrix3d covariance = position_covariance(c.cam_from_world, c.covariance);
    return test::nees(error, covariance) < too_far;
  });
}

template <class Check>
void for_each_row(const Check& check) {
  std::uint64_t seed = 0;
  for (const int count : {3, 4, 5, 6})
    for (const bool even : {true, false})
      for (const double height : {0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0})
        for (const bool facing : {true, false}) {
          Random random(91, ++seed);
          const Row row{count, even, height};
          SCOPED_TRACE(::testing::Message() << count << (even ? " evenly" : " unevenly")
                                            << " spaced, height " << height);
          check(row, row_view(random, row, facing), random);
        }
}

void expect_true(const Row& row, const Result<Fix>& fix, const Rigid3& truth) {
  if (is_answer(fix)) {
    EXPECT_TRUE(holds_truth(*fix, truth)) << to_string(fix.status) << " " << fix.message;
  }
  if (row.height >= 0.1) {
    EXPECT_TRUE(is_answer(fix)) << fix.message;
  }
  if (row.height < 2e-3) {  // 0.6 px in the image at most, and a map is no better
    EXPECT_TRUE(fix.status == Status::degenerate || fix.status == Status::no_pose)
        << to_string(fix.status);
  }
}

TEST(NearLine, LocateIsRightOrSaysThatATurnIsOpen) {
  int degenerate = 0, rows = 0;
  for_each_row([&](const Row& row, const RowView& view, Random&) {
    const Result<Fix> fix = locate(view.blobs, view.scene);
    expect_true(row, fix, view.truth);
    rows += row.height < 2e-3;
    degenerate += row.height < 2e-3 && fix.status == Status::degenerate;
  });
  EXPECT_GT(degenerate, 0.9 * rows);
}

TEST(NearLine, CodesTellTheLampsButNotATurnAboutThem) {
  for_each_row([&](const Row& row, RowView view, Random&) {
    for (Lamp& lamp : view.scene.lamps) lamp.frequency_hz = 1000.0 + 400 * lamp.id;
    for (std::size_t i = 0; i < view.blobs.size(); ++i) {
      const auto lamp = static_cast<std::size_t>(view.lamp[i]);
      view.blobs[i].frequency_hz = view.scene.lamps[lamp].frequency_hz;
      view.blobs[i].frequency_sigma_hz = 5;
    }
    expect_true(row, locate(view.blobs, view.scene), view.truth);
  });
}

TEST(NearLine, GravityClosesTheTurnAndLeavesTheEnds) {
  int turned_round = 0, all = 0, stopped = 0;
  for_each_row([&](const Row& row, const RowView& view, Random& random) {
    LocateOptions options;
    options.prior = Prior{};
    options.prior->gravity_in_cam =
        so3_exp(0.01 * random_vector(random)) * view.truth.rotation * Eigen::Vector3d(0, 0, -1);
    const Result<Fix> fix = locate(view.blobs, view.scene, options);
    ++all;
    stopped += fix.status == Status::not_converged;
    if (fix.status == Status::not_converged) return;
    ASSERT_TRUE(is_answer(fix)) << to_string(fix.status) << " " << fix.message;
    EXPECT_TRUE(holds_truth(*fix, view.truth)) << to_string(fix.status);
    const bool alike = row.even && row.height < 1e-5 && view.scene.lamps[0].normal.z() == -1;
    if (alike) {
      EXPECT_EQ(fix.status, Status::ambiguous);
    }
    turned_round += alike;
  });
  EXPECT_GE(turned_round, 4);
  EXPECT_LE(stopped, 0.05 * all);
}

TEST(NearLine, ThreeSeenInARowOfARoomSayThatATurnIsOpen) {
  Random random(92);
  RowView view = row_view(random, {3, true, 1e-4}, false);
  for (const double y : {-8.0, 12.0})
    view.scene.lamps.push_back(disc_lamp(static_cast<int>(view.scene.lamps.size()), {2, y, 3}));
  EXPECT_EQ(locate(view.blobs, view.scene).status, Status::degenerate);
}

/// Points nearly on a line, seen by a camera at 2.5 to 6 times half their length.
SeenScene thin_scene(Random& random, const Row& row) {
  SeenScene scene;
  scene.camera = plain_camera();
  do {
    scene.points.resize(3, row.count);
    const Eigen::Vector3d along = random_vector(random).normalized();
    for (int i = 0; i < row.count; ++i) {
      const bool end = i == 0 || i == row.count - 1;
      const double part = row.even || end ? i / (row.count - 1.0) : random.uniform(0.1, 0.9);
      const double off = end ? 0 : i == 1 ? 1 : random.uniform(-1, 1);
      const Eigen::Vector3d aside = along.cross(random_vector(random)).normalized();
      scene.points.col(i) =
          Eigen::Vector3d(1, 2, 3) + 2 * ((part - 0.5) * along + row.height * off * aside);
    }
    scene.truth.rotation = random_rotation(random);
    const double distance = random.uniform(2.5, 6);
    scene.truth.translation =
        Eigen::Vector3d(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 1) * distance -
        scene.truth.rotation * Eigen::Vector3d(1, 2, 3);
  } while (!see(scene));
  return scene;
}

double squared_error_of_position(const SeenScene& scene, const Candidate& c,
                                 const Matrix6& covariance) {
  const Eigen::Vector3d error = c.position_m - scene.truth.origin_in_source();
  return test::nees(error, position_covariance(c.cam_from_world, covariance));
}

struct Tally {
  int problems = 0, answers = 0, far = 0;
  double nees = 0;  ///< mean over those that are not far, of three degrees of freedom
};

Tally tally(const Row& row, int problems, double sigma_px) {
  constexpr double too_far = 36;
  Tally t;
  t.problems = problems;
  for (int i = 0; i < problems; ++i) {
    Random random(93, static_cast<std::uint64_t>(1000 * row.count + i));
    SeenScene scene = thin_scene(random, row);
    scene.pixels = noisy_pixels(scene, sigma_px, random);
    SolvePoseOptions options;
    options.sigma_px = sigma_px;
    const Result<Fix> fix = solve_pose(scene.points, scene.pixels, scene.camera, options);
    if (!is_answer(fix)) {
      EXPECT_EQ(fix.status, Status::degenerate) << fix.message;
      continue;
    }
    ++t.answers;
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& c : fix->candidates)
      least = std::min(least, squared_error_of_position(scene, c, c.covariance));
    t.far += least > too_far;
    if (least <= too_far) t.nees += least;
  }
  t.nees /= std::max(1, t.answers - t.far);
  return t;
}

// The camera moves on an arc, whose tails are longer than those of a Gaussian. A covariance that
// contains them is larger than the mean squared error.
TEST(NearLine, PositionsOfThinLayoutsAreAsSureAsTheySay) {
  for (const int count : {4, 6, 12})
    for (const double height : {0.03, 0.01}) {
      const Tally t = tally({count, count != 6, height}, 1500, 0.3);
      EXPECT_GT(t.answers, 0.85 * t.problems) << count << " points, height " << height;
      EXPECT_LE(t.far, 0.001 * t.answers) << count << " points, height " << height;
      EXPECT_LT(t.nees, 3.3) << count << " points, height " << height;
      EXPECT_GT(t.nees, 1.8) << count << " points, height " << height;
    }
}

TEST(NearLine, PointsOnALineAsFarAsCanBeSeenAreRefused) {
  for (const int count : {3, 4, 6, 40})
    for (const double height : {1e-4, 1e-5, 1e-6, 1e-9, 0.0})
      EXPECT_EQ(tally({count, count % 2 == 0, height}, 100, 0.3).answers, 0)
          << count << " points, height " << height;
}

TEST(NearLine, AnExactCameraSeesASmallHeight) {
  for (const int count : {4, 6})
    for (const double height : {1e-3, 1e-4}) {
      const double sigma_px = 1e-2 * height * 300;  // the height is seen by about a hundred sigmas
      const Tally t = tally({count, true, height}, 300, sigma_px);
      EXPECT_GT(t.answers, 0.98 * t.problems) << height;
      EXPECT_LE(t.far, 0.01 * t.answers) << height;
    }
}

// The residuals count as well as sigma_px.
TEST(NearLine, AnOptimisticSigmaDoesNotMakeAHeightSeen) {
  int refused = 0;
  for (int i = 0; i < 100; ++i) {
    Random random(94, static_cast<std::uint64_t>(i));
    SeenScene scene = thin_scene(random, {20, true, 5e-4});
    scene.pixels = noisy_pixels(scene, 0.6, random);
    SolvePoseOptions options;
    options.sigma_px = 0.05;
    options.max_misfit = 1000;
    refused +=
        solve_pose(scene.points, scene.pixels, scene.camera, options).status == Status::degenerate;
  }
  EXPECT_GE(refused, 95);
}

}  // namespace
}  // namespace occ::test
