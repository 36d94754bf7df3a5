// SPDX-License-Identifier: Apache-2.0
// Three and four lamps by their centres. Up to four poses fit three centres, and two of them can be
// centimetres apart: each must reach the verdict, and an ok fix must be the right one. The blobs
// are those of this file: images of discs as polygons, with noise.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

constexpr double focal_px = 420, width_px = 640, height_px = 480;
constexpr double rim_sigma_px = 0.05;

struct View {
  Scene scene;
  Rigid3 truth;
  std::vector<Blob> blobs;
};

Eigen::Vector2d pixel_of(const Eigen::Vector3d& point_in_cam) {
  return focal_px * point_in_cam.head<2>() / point_in_cam.z() +
         0.5 * Eigen::Vector2d(width_px - 1, height_px - 1);
}

/// Outline of a disc that faces down, as seen by the camera.
std::vector<Eigen::Vector2d> outline(const Lamp& lamp, const Rigid3& pose, int count) {
  std::vector<Eigen::Vector2d> px;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * pi * i / count;
    const Eigen::Vector3d arm(std::cos(angle), std::sin(angle), 0);
    px.push_back(pixel_of(pose * (lamp.centre_m + lamp.radius_m * arm)));
  }
  return px;
}

/// Area, centroid and covariance of a polygon (Green's theorem).
struct Moments {
  double area = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

Moments moments_of(const std::vector<Eigen::Vector2d>& polygon) {
  Moments m;
  const Eigen::Vector2d origin = polygon.front();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i] - origin;
    const Eigen::Vector2d b = polygon[(i + 1) % polygon.size()] - origin;
    const double twice = a.x() * b.y() - a.y() * b.x();
    m.area += twice / 2;
    m.centroid += twice * (a + b) / 6;
    m.covariance +=
        twice * ((a + b) * (a + b).transpose() + a * a.transpose() + b * b.transpose()) / 24;
  }
  m.centroid /= m.area;
  m.covariance = (m.covariance / m.area - m.centroid * m.centroid.transpose()).eval();
  m.centroid += origin;
  m.area = std::abs(m.area);
  return m;
}

/// Without a rim the blob has a centroid and its second moments only.
Blob blob_of(const Lamp& lamp, const Rigid3& pose, bool has_rim, Random& random) {
  constexpr int points = 48;
  const auto noise = [&](double sigma) { return sigma * random.normal(); };
  const std::vector<Eigen::Vector2d> polygon = outline(lamp, pose, 4 * points);
  const Moments m = moments_of(polygon);
  const double sigma_px = rim_sigma_px * std::sqrt(2.0 / points);
  Blob blob;
  blob.centroid_px = m.centroid + Eigen::Vector2d(noise(sigma_px), noise(sigma_px));
  blob.covariance_px2 = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
  blob.flux_dn = 100 * m.area;
  blob.area_px = static_cast<int>(std::ceil(m.area));
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(m.covariance);
  blob.ellipse.centre_px = blob.centroid_px;
  blob.ellipse.semi_minor_px = 2 * std::sqrt(eigen.eigenvalues()[0]) + noise(sigma_px);
  blob.ellipse.semi_major_px = 2 * std::sqrt(eigen.eigenvalues()[1]) + noise(sigma_px);
  const Eigen::Vector2d axis = eigen.eigenvectors().col(1);
  blob.ellipse.angle_rad = std::atan(axis.y() / axis.x());
  const double reach_px = blob.ellipse.semi_major_px + 1;
  blob.x0 = static_cast<int>(blob.centroid_px.x() - reach_px);
  blob.x1 = static_cast<int>(blob.centroid_px.x() + reach_px);
  blob.y0 = static_cast<int>(blob.centroid_px.y() - reach_px);
  blob.y1 = static_cast<int>(blob.centroid_px.y() + reach_px);
  for (int i = 0; has_rim && i < points; ++i) {
    const Eigen::Vector2d along =
        polygon[4 * i + 1] - polygon[(4 * i + 4 * points - 1) % (4 * points)];
    Eigen::Vector2d normal = Eigen::Vector2d(along.y(), -along.x()).normalized();
    if (normal.dot(polygon[4 * i] - m.centroid) < 0) normal = -normal;
    blob.rim.push_back({polygon[4 * i] + noise(rim_sigma_px) * normal, normal, rim_sigma_px});
  }
  return blob;
}

bool is_inside(const Blob& blob) {
  return blob.x0 > 0 && blob.y0 > 0 && blob.x1 < width_px - 1 && blob.y1 < height_px - 1;
}

double min_distance(const std::vector<Lamp>& lamps) {
  double shortest = infinity;
  for (std::size_t i = 0; i < lamps.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      shortest = std::min(shortest, (lamps[i].centre_m - lamps[k].centre_m).norm());
  return shortest;
}

/// A camera under lamps that hang at one height or at several, all of them in view.
View draw_view(int lamps, double radius_m, Random& random) {
  while (true) {
    View view;
    view.scene.camera = Camera::pinhole(640, 480, focal_px, focal_px, 319.5, 239.5);
    const double uneven_m = random.uniform() < 0.4 ? 0 : 0.25;
    for (int i = 0; i < lamps; ++i) {
      Lamp lamp;
      lamp.id = i;
      lamp.radius_m = radius_m;
      lamp.normal = -Eigen::Vector3d::UnitZ();
      lamp.centre_m = {random.uniform(-1, 1), random.uniform(-0.8, 0.8),
                       2.2 + uneven_m * random.uniform(-1, 1)};
      view.scene.lamps.push_back(lamp);
    }
    if (min_distance(view.scene.lamps) < 0.4) continue;
    const Eigen::Vector3d position(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4),
                                   random.uniform(-0.3, 0.3));
    const Eigen::Vector3d tilt(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0);
    const Eigen::Matrix3d rotation = so3_exp(tilt) * so3_exp({0, 0, random.uniform(-3, 3)});
    view.truth = {rotation, -rotation * position};
    bool in_view = true;
    for (const Lamp& lamp : view.scene.lamps) {
      view.blobs.push_back(blob_of(lamp, view.truth, radius_m >= 0.02, random));
      in_view = in_view && is_inside(view.blobs.back());
    }
    if (in_view) return view;
  }
}

/// Squared Mahalanobis distance of the truth.
double nees(const Candidate& candidate, const Rigid3& truth) {
  const Vector6 off = difference(truth, candidate.cam_from_world);
  return test::nees(off, candidate.covariance);
}

constexpr double max_nees = 150;  // five sigmas in each of six unknowns

struct Tally {
  int ok = 0, wrong = 0;
  int lost = 0;  ///< ambiguous without the right pose
};

Tally locate_views(int views, int lamps, Rung rung, std::uint64_t seed) {
  constexpr double radii_m[] = {0.02, 0.04, 0.085};
  Tally tally;
  for (int i = 0; i < views; ++i) {
    Random random(seed, static_cast<std::uint64_t>(i));
    const View view = draw_view(lamps, radii_m[i % 3], random);
    LocateOptions options;
    options.refine.rung = rung;
    const Result<Fix> fix = locate(view.blobs, view.scene, options);
    const auto is_right = [&](const Candidate& c) { return nees(c, view.truth) < max_nees; };
    tally.ok += fix.ok();
    if (fix.ok() && !is_right(fix->candidates.front())) {
      ++tally.wrong;
      ADD_FAILURE() << "view " << i << " of seed " << seed << ": ok, but "
                    << (fix->position_m - view.truth.origin_in_source()).norm() << " m off";
    }
    tally.lost += fix.status == Status::ambiguous &&
                  std::none_of(fix->candidates.begin(), fix->candidates.end(), is_right);
  }
  return tally;
}

void expect_right(int views, int lamps, Rung rung, std::uint64_t seed) {
  const Tally tally = locate_views(views, lamps, rung, seed);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_EQ(tally.lost, 0);
  EXPECT_GT(tally.ok, views / 2);
}

TEST(Branches, AnOkFixOfThreeLampsIsRight) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) expect_right(100, 3, Rung::centres, seed);
}

TEST(Branches, AnOkFixOfFourLampsIsRight) {
  for (std::uint64_t seed = 4; seed <= 6; ++seed) expect_right(100, 4, Rung::centres, seed);
}

TEST(SlowBranches, AnOkFixOfFewLampsIsRight) {
  expect_right(1000, 3, Rung::centres, 7);
  expect_right(1000, 4, Rung::centres, 8);
  expect_right(500, 3, Rung::rims, 9);
}

/// Spots have no size that could tell the poses apart, so each pose that fits must be a candidate.
TEST(Branches, ThreeSpotsListEveryPoseThatFits) {
  int pairs = 0;
  for (int i = 0; i < 150; ++i) {
    Random random(10, static_cast<std::uint64_t>(i));
    const View view = draw_view(3, 0.003, random);
    Eigen::Matrix3d bearings, points;
    for (int k = 0; k < 3; ++k) {
      const auto bearing = view.scene.camera.unproject(view.blobs[k].centroid_px);
      ASSERT_TRUE(bearing);
      bearings.col(k) = *bearing;
      points.col(k) = view.scene.lamps[k].centre_m;
    }
    LocateOptions options;
    options.refine.rung = Rung::centres;
    const Result<Fix> fix = locate(view.blobs, view.scene, options);
    const std::vector<Rigid3> poses = p3p(bearings, points);
    int near = 0;
    for (const Rigid3& pose : poses) {
      if ((pose.origin_in_source() - view.truth.origin_in_source()).norm() > 0.4) continue;
      ++near;
      const bool listed = std::any_of(fix->candidates.begin(), fix->candidates.end(),
                                      [&](const Candidate& c) { return nees(c, pose) < 9; });
      EXPECT_TRUE(listed) << "view " << i << ", " << pose.origin_in_source().transpose();
    }
    pairs += near > 1;
    EXPECT_FALSE(fix.ok() && near > 1) << "view " << i;
  }
  EXPECT_GT(pairs, 10);
}

}  // namespace
}  // namespace occ
