// SPDX-License-Identifier: Apache-2.0
// Order of the triples of blobs, and the gate of the prior.
#include "libocc/identify/internal/triple_order.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "libocc/identify/internal/prior_gate.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::identify;
namespace {

/// Blobs at random directions, of equal flux.
struct RandomBlobs {
  std::vector<Blob> blobs;
  AssignmentProblem problem;

  explicit RandomBlobs(int count, std::uint64_t seed = 0, int lamps = 5) {
    Random random(81, seed);
    blobs.resize(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      blobs[static_cast<std::size_t>(i)].flux_dn = 100;
      BearingObservation seen;
      seen.blob = i;
      seen.bearing =
          Eigen::Vector3d(random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), 1).normalized();
      seen.axis = seen.bearing;
      seen.tangent.setZero();
      seen.covariance.setZero();
      for (int k = 0; k < lamps; ++k) seen.lamps.push_back(k);
      problem.observations.push_back(seen);
    }
    problem.blobs = &blobs;
  }
  double distance(int i, int j) const {
    return (problem.observation(i).bearing - problem.observation(j).bearing).norm();
  }
  double area(const std::array<int, 3>& s) const {
    const Eigen::Vector3d a = problem.observation(s[1]).bearing - problem.observation(s[0]).bearing;
    const Eigen::Vector3d b = problem.observation(s[2]).bearing - problem.observation(s[0]).bearing;
    return a.cross(b).norm();
  }
};

/// True if some set of `size` blobs intersects all triples.
bool some_set_hits_all(const std::vector<std::uint64_t>& triples, int blobs, int size) {
  for (std::uint64_t set = 0; set < std::uint64_t{1} << blobs; ++set) {
    if (__builtin_popcountll(set) != size) continue;
    if (std::all_of(triples.begin(), triples.end(), [&](auto t) { return (t & set) != 0; }))
      return true;
  }
  return false;
}

TEST(TripleOrder, EndsWhenNoSetOfOutliersHitsAllTriples) {
  for (const int group : {2, 3})
    for (int outliers = 0; outliers <= 4; ++outliers)
      for (std::uint64_t seed = 0; seed < 3; ++seed) {
        const RandomBlobs view(9, seed);
        TripleOrder order(view.problem, group);
        EXPECT_EQ(order.blobs(), 9);
        EXPECT_EQ(order.groups(), group == 2 ? 36 : 84);
        std::vector<std::uint64_t> tried;
        while (const auto triple = order.next(outliers)) {
          EXPECT_TRUE(tried.empty() || some_set_hits_all(tried, 9, outliers));
          tried.push_back(triple->mask());
          EXPECT_EQ(__builtin_popcountll(triple->mask()), group);
        }
        EXPECT_FALSE(some_set_hits_all(tried, 9, outliers)) << outliers;
        EXPECT_EQ(std::set<std::uint64_t>(tried.begin(), tried.end()).size(), tried.size());
        EXPECT_GT(tried.size(), static_cast<std::size_t>(outliers));
      }
}

TEST(TripleOrder, ReturnsEveryTripleOnce) {
  const RandomBlobs view(6);
  TripleOrder order(view.problem);
  std::set<std::uint64_t> masks;
  while (const auto triple = order.next(5)) masks.insert(triple->mask());
  EXPECT_EQ(masks.size(), 20u);
  EXPECT_EQ(order.groups(), 20);
}

TEST(TripleOrder, NeedsFewTriplesAgainstOneOutlier) {
  // Two disjoint triples cannot both contain one outlier.
  const RandomBlobs view(6);
  TripleOrder order(view.problem);
  const auto first = order.next(1), second = order.next(1);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->mask() & second->mask(), 0u);
  EXPECT_FALSE(order.next(1));
}

TEST(TripleOrder, BeginsWithTheLargestOfEqualLights) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const RandomBlobs view(8, seed);
    TripleOrder order(view.problem);
    double largest = 0;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < i; ++j)
        for (int k = 0; k < j; ++k) largest = std::max(largest, view.area({i, j, k}));
    EXPECT_NEAR(view.area(order.next(0)->observations), largest, 1e-12);
    // Pairs: the farthest two.
    TripleOrder pairs(view.problem, 2);
    double farthest = 0;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < i; ++j) farthest = std::max(farthest, view.distance(i, j));
    const auto pair = pairs.next(0)->observations;
    EXPECT_EQ(view.distance(pair[0], pair[1]), farthest);
    EXPECT_EQ(pair[2], -1);
  }
}

TEST(TripleOrder, PrefersBrightBlobsAndThoseWithFewLamps) {
  // Five blobs on a circle: without differences the triples have similar areas.
  RandomBlobs view(5);
  for (int i = 0; i < 5; ++i)
    view.problem.observations[static_cast<std::size_t>(i)].bearing =
        Eigen::Vector3d(0.3 * std::cos(1.2566 * i), 0.3 * std::sin(1.2566 * i), 1).normalized();
  for (int dim = 0; dim < 5; ++dim) {
    RandomBlobs changed = view;
    changed.problem.blobs = &changed.blobs;
    changed.blobs[static_cast<std::size_t>(dim)].flux_dn = 20;
    EXPECT_EQ(TripleOrder(changed.problem).next(0)->mask() >> dim & 1, 0u) << dim;
    RandomBlobs coded = view;
    coded.problem.blobs = &coded.blobs;
    coded.problem.observations[static_cast<std::size_t>(dim)].lamps = {2};
    coded.problem.observations[static_cast<std::size_t>(dim)].coded = true;
    EXPECT_EQ(TripleOrder(coded.problem).next(0)->mask() >> dim & 1, 1u) << dim;
  }
}

TEST(TripleOrder, UsesABoundedNumberOfBlobs) {
  const RandomBlobs view(30);
  TripleOrder order(view.problem);
  EXPECT_EQ(order.blobs(), 24);
  EXPECT_EQ(order.groups(), 24 * 23 * 22 / 6);
}

TEST(TripleOrder, PrefersNeighboursAroundTheirMiddle) {
  for (const int group : {2, 3})
    for (const int count : {6, 9, 22}) {
      const RandomBlobs view(count, 4);
      // Distance to the k-th nearest of the other blobs: half of them, at most eight.
      const int k = std::min((count + 1) / 2, 8);
      const auto reach = [&](int i) {
        std::vector<double> all;
        for (int j = 0; j < count; ++j)
          if (j != i) all.push_back(view.distance(i, j));
        std::sort(all.begin(), all.end());
        return all[static_cast<std::size_t>(k) - 1];
      };
      const auto excess = [&](const std::array<int, 3>& s, int first) {
        double farthest = 0;
        for (int i = 0; i < group; ++i)
          farthest = std::max(farthest, view.distance(s[static_cast<std::size_t>(first)],
                                                      s[static_cast<std::size_t>(i)]));
        return farthest / reach(s[static_cast<std::size_t>(first)]);
      };
      TripleOrder order(view.problem, group);
      order.prefer_neighbours(view.problem);
      bool far_before = false;
      int near = 0;
      for (int n = 0; n < order.groups(); ++n) {
        const auto triple = order.next(count - group + 1);
        if (!triple) break;
        double smallest = 1e9;
        for (int first = 0; first < group; ++first)
          smallest = std::min(smallest, excess(triple->observations, first));
        EXPECT_NEAR(excess(triple->observations, 0), smallest, 1e-12);
        EXPECT_EQ(triple->far, smallest > 1);
        near += !triple->far;
        far_before = far_before || triple->far;
      }
      EXPECT_GT(near, 3);
    }
}

TEST(TripleOrder, TriesNeighboursFirst) {
  const RandomBlobs view(10, 5);
  TripleOrder order(view.problem);
  order.prefer_neighbours(view.problem);
  EXPECT_FALSE(order.next(0)->far);
  TripleOrder against_one(view.problem);
  against_one.prefer_neighbours(view.problem);
  EXPECT_FALSE(against_one.next(1)->far);
  EXPECT_FALSE(against_one.next(1)->far);
}

/// An upright camera with a prior.
struct UprightCamera {
  IdentifyOptions options;
  AssignmentProblem problem;

  UprightCamera() {
    options.prior.emplace();
    options.prior->gravity_in_cam = Eigen::Vector3d(0.1, 0.9, 0.2).normalized();
    problem.options = &options;
    problem.origin = {10, 20, 3};
  }
  Prior& prior() { return *options.prior; }
  bool allows(const Eigen::Vector3d& position, double turn = 0, double distance = 2,
              double relative = 0) const {
    return PriorGate(problem, cam_from_upright(problem))
        .allows(position, std::cos(turn), std::sin(turn), distance, relative);
  }
};

TEST(PriorGate, UprightFrameHasGravityDownwards) {
  const UprightCamera camera;
  const Eigen::Vector3d down = cam_from_upright(camera.problem) * -Eigen::Vector3d::UnitZ();
  EXPECT_LT((down - *camera.options.prior->gravity_in_cam).norm(), 1e-12);
  EXPECT_TRUE(PriorGate(camera.problem, cam_from_upright(camera.problem)).is_open());
  EXPECT_TRUE(camera.allows({100, 100, 100}));
}

TEST(PriorGate, AllowsSixSigmasOfHeightAndPosition) {
  UprightCamera camera;
  camera.prior().height_m = 3.5;  // 0.5 in the local frame
  camera.prior().height_sigma_m = 0.1;
  for (const double side : {-1, 1}) {
    EXPECT_TRUE(camera.allows({7, 8, 0.5 + side * 0.59}));
    EXPECT_FALSE(camera.allows({7, 8, 0.5 + side * 0.61}));
    // The error of the pose, 2 m times 0.05 rad, has the same size.
    EXPECT_TRUE(camera.allows({7, 8, 0.5 + side * 0.84}, 0, 2, 0.05));
    EXPECT_FALSE(camera.allows({7, 8, 0.5 + side * 0.86}, 0, 2, 0.05));
  }
  camera.prior().height_m.reset();
  camera.prior().position_m = Eigen::Vector3d(11, 19, 4);
  camera.prior().position_sigmas_m = Eigen::Vector3d(0.1, 0.2, 0.3);
  for (int i = 0; i < 3; ++i)
    for (const double side : {-1, 1}) {
      Eigen::Vector3d position(1, -1, 1);
      position[i] += side * 0.1 * (i + 1) * 5.9;
      EXPECT_TRUE(camera.allows(position)) << i;
      position[i] += side * 0.1 * (i + 1) * 0.2;
      EXPECT_FALSE(camera.allows(position)) << i;
    }
}

TEST(PriorGate, AllowsSixSigmasOfTheLastPosition) {
  UprightCamera camera;
  PriorPose last;
  last.cam_from_world = look_at({11, 19, 4}, {12, 19, 4}, {0, 0, 1});
  last.covariance = 1e-6 * Matrix6::Identity();
  last.covariance.diagonal().tail<3>().setConstant(0.04);
  camera.prior().last_pose = last;
  EXPECT_FALSE(PriorGate(camera.problem, cam_from_upright(camera.problem)).is_open());
  for (const double side : {-1, 1}) {
    EXPECT_TRUE(camera.allows({1 + side * 1.15, -1, 1}));
    EXPECT_FALSE(camera.allows({1 + side * 1.25, -1, 1}));
  }
}

TEST(PriorGate, AllowsSixSigmasOfTheHeading) {
  UprightCamera camera;
  const Eigen::Matrix3d upright = cam_from_upright(camera.problem);
  // Heading of the camera after a turn of the world about the vertical.
  const double turn = 0.7;
  const Eigen::Matrix3d turned =
      upright * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  camera.prior().heading_rad = std::atan2(turned(0, 1), turned(0, 0));
  camera.prior().heading_sigma_rad = 0.05;
  const double reach = upright.row(0).head<2>().norm();
  for (const double side : {-1, 1}) {
    EXPECT_TRUE(camera.allows({0, 0, 0}, turn + side * 0.29 / reach));
    EXPECT_FALSE(camera.allows({0, 0, 0}, turn + side * 0.31 / reach));
    EXPECT_TRUE(camera.allows({0, 0, 0}, turn + side * 0.41 / reach, 2, 0.05));
    EXPECT_FALSE(camera.allows({0, 0, 0}, turn + side * 0.44 / reach, 2, 0.05));
  }
  camera.prior().heading_sigma_rad = 1;  // all headings
  EXPECT_TRUE(camera.allows({0, 0, 0}, turn + 3.14));
}

}  // namespace
}  // namespace occ
