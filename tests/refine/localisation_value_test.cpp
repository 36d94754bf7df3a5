// SPDX-License-Identifier: Apache-2.0
// Value of the points of an object for localisation: against the determinant's own formula, and in
// layouts where the answer is plain.
#include "libocc/refine/localisation_value.hpp"

#include "libocc/core/math.hpp"
#include "libocc/refine/bound.hpp"
#include "tests/support/random_objects.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

// Without a point of Jacobian J the information loses J^T J / s^2, so that the covariance's
// determinant grows by 1 / det(1 - J C J^T / s^2).
TEST(LocalisationValue, GrowthIsThatOfTheInformation) {
  Random random(1);
  const Camera& camera = bodies::camera();
  constexpr double sigma_px = 0.3;
  for (int i = 0; i < 20; ++i) {
    const Object object = bodies::random_object(random, 7, pi);
    const Rigid3 pose = bodies::random_pose(random, 2.5);
    const LocalisationValue value = localisation_value(object, camera, {pose}, sigma_px);
    EXPECT_EQ(value.determined, 1);
    std::vector<Vector3d> places;
    for (const ObjectPoint& p : object.points) places.push_back(p.position_m);
    const auto bound = pose_bound(places, camera, pose, sigma_px);
    EXPECT_NEAR(value.sigma_m, std::sqrt(bound->position_covariance_m2.trace()), 1e-12);
    for (std::size_t k = 0; k < places.size(); ++k) {
      const MatrixXd j = test::numerical_jacobian(
          [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
            return *camera.project(perturb(pose, Vector6(d)) * places[k]);
          },
          Eigen::VectorXd::Zero(6));
      const Matrix2d left =
          Matrix2d::Identity() - j * bound->covariance * j.transpose() / (sigma_px * sigma_px);
      EXPECT_NEAR(value.points[k].growth, std::pow(left.determinant(), -1.0 / 12), 1e-4);
      EXPECT_EQ(value.points[k].seen, 1);
      EXPECT_EQ(value.points[k].needed, 0);
    }
  }
}

TEST(LocalisationValue, OfThreePointsEachIsNeeded) {
  Random random(2);
  Object object = bodies::random_object(random, 3, pi);
  const auto value =
      localisation_value(object, bodies::camera(), views_around(object, {2.0, 3.0}, 20), 0.2);
  EXPECT_GT(value.determined, 0.9);
  for (const PointValue& p : value.points) {
    EXPECT_NEAR(p.seen, 1, 1e-12);
    EXPECT_NEAR(p.needed, value.determined, 1e-12);
    EXPECT_EQ(p.growth, 1);
  }
}

// Seen from all sides a half space shows half of the views; a point that is off the plane of the
// others is worth more than one beside another.
TEST(LocalisationValue, RanksPoints) {
  Object object{"mast", {}};
  for (const Vector3d& place : {Vector3d(0.3, 0, 0), Vector3d(-0.2, 0.25, 0), Vector3d(0, -0.3, 0),
                                Vector3d(0.32, 0.02, 0), Vector3d(0.05, 0.02, 0.4)}) {
    ObjectPoint p;
    p.id = static_cast<int>(object.points.size());
    p.position_m = place;
    object.points.push_back(p);
  }
  const std::vector<Rigid3> views = views_around(object, {3.0}, 400);
  const auto value = localisation_value(object, bodies::camera(), views, 0.2);
  for (const PointValue& p : value.points) EXPECT_NEAR(p.seen, 0.5, 0.05);
  EXPECT_GT(value.points[4].growth - 1, 2 * (value.points[3].growth - 1));
  EXPECT_GT(value.points[3].growth, 1);
  const auto near = localisation_value(object, bodies::camera(), views_around(object, {1.5}), 0.2);
  EXPECT_LT(near.sigma_m, value.sigma_m);
}

TEST(LocalisationValue, ViewsAreOfTheMiddleFromAllSides) {
  Random random(3);
  Object object = bodies::random_object(random, 9);
  for (ObjectPoint& p : object.points) p.position_m += Vector3d(5, -3, 2);
  Vector3d sum = Vector3d::Zero();
  const std::vector<Rigid3> views = views_around(object, {2.0}, 100);
  ASSERT_EQ(views.size(), 100u);
  const Vector3d ahead(0, 0, 2);
  const Vector3d middle = views[0].inverse() * ahead;
  for (const Rigid3& view : views) {
    EXPECT_LT((view.inverse() * ahead - middle).norm(), 1e-9);
    sum += view.origin_in_source() - middle;
  }
  EXPECT_LT(sum.norm() / 100, 0.02);
  Vector3d low = object.points[0].position_m, high = low;
  for (const ObjectPoint& p : object.points) {
    low = low.cwiseMin(p.position_m);
    high = high.cwiseMax(p.position_m);
  }
  EXPECT_LT((middle - 0.5 * (low + high)).norm(), 1e-9);
}

TEST(LocalisationValue, ViewsAreSpreadEvenly) {
  Random random(3);
  const std::vector<Rigid3> views = views_around(bodies::random_object(random, 9), {1.0}, 100);
  double nearest = 10;
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      nearest =
          std::min(nearest, (views[i].origin_in_source() - views[k].origin_in_source()).norm());
  // A hundred discs of this diameter cover 60 % of the unit sphere; the densest packing 90 %.
  EXPECT_GT(nearest, 0.3);
}

TEST(LocalisationValue, SaysWhatIsWrong) {
  Random random(4);
  const Object object = bodies::random_object(random, 5);
  const auto& camera = bodies::camera();
  EXPECT_THROW(localisation_value(object, camera, {}, 1), std::invalid_argument);
  for (const double sigma_px : {0.0, -1.0, std::nan("")})
    EXPECT_THROW(localisation_value(object, camera, {Rigid3{}}, sigma_px), std::invalid_argument);
  EXPECT_THROW(views_around(object, {-1}), std::invalid_argument);
  EXPECT_THROW(views_around(object, {}), std::invalid_argument);
  EXPECT_THROW(views_around(object, {1}, 0), std::invalid_argument);
  // A view without any visible point: no pose, but a valid result.
  const auto inside = localisation_value(object, camera, {Rigid3{}}, 1);
  EXPECT_EQ(inside.determined, 0);
}

}  // namespace
}  // namespace occ
