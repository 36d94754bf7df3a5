// SPDX-License-Identifier: Apache-2.0
// Pinhole camera: comparison with OpenCV, round trips, derivatives, edges of the domain.
#include "libocc/camera/camera.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/calib3d.hpp>

#include "libocc/camera/fisheye.hpp"
#include "libocc/camera/pinhole.hpp"
#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// The first n coefficients of a lens with every kind of distortion.
std::vector<double> lens(std::size_t n) {
  const std::vector<double> all{-0.2,  0.06, 1.2e-3, -0.8e-3, -0.006, 0.02, 0.01,
                                -2e-3, 1e-3, -4e-4,  -1.5e-3, 3e-4,   0.03, -0.02};
  return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n)};
}

Camera camera_with(const std::vector<double>& distortion, double skew_px = 0) {
  return Camera::pinhole(640, 480, 410, 425, 322.25, 236.5, distortion, skew_px);
}

class EveryLens : public ::testing::TestWithParam<std::size_t> {
 protected:
  Camera camera_ = camera_with(lens(GetParam()), 0.7);
  Random random_{GetParam()};

  Eigen::Vector2d random_pixel() {
    return {random_.uniform(-0.5, 639.5), random_.uniform(-0.5, 479.5)};
  }
};

INSTANTIATE_TEST_SUITE_P(Coefficients, EveryLens, ::testing::Values(0, 4, 5, 8, 12, 14));

TEST_P(EveryLens, ProjectsLikeOpenCv) {
  const Camera camera = camera_with(lens(GetParam()));  // OpenCV has no skew
  const cv::Matx33d k(410, 0, 322.25, 0, 425, 236.5, 0, 0, 1);
  for (int i = 0; i < 500; ++i) {
    const double z = random_.uniform(0.1, 20);
    const Eigen::Vector3d p(random_.uniform(-0.8, 0.8) * z, random_.uniform(-0.6, 0.6) * z, z);
    std::vector<cv::Point2d> theirs;
    cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, cv::Vec3d(), cv::Vec3d(), k,
                      camera.distortion(), theirs);
    const auto ours = camera.project(p);
    ASSERT_TRUE(ours);
    EXPECT_LT((*ours - Eigen::Vector2d(theirs[0].x, theirs[0].y)).norm(), 1e-10);
  }
}

TEST_P(EveryLens, UnprojectIsTheInverseOfProject) {
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d pixel = random_pixel();
    const auto bearing = camera_.unproject(pixel);
    ASSERT_TRUE(bearing) << pixel.transpose();
    EXPECT_NEAR(bearing->norm(), 1, 1e-15);
    const auto back = camera_.project(random_.uniform(0.1, 50) * *bearing);
    ASSERT_TRUE(back);
    EXPECT_LT((*back - pixel).norm(), 1e-9);
    const auto again = camera_.unproject(*back);
    ASSERT_TRUE(again);
    EXPECT_LT((*again - *bearing).norm(), 1e-12);
  }
}

TEST_P(EveryLens, JacobiansAgreeWithCentralDifferences) {
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d pixel = random_pixel();
    Eigen::Matrix<double, 3, 2> d_pixel;
    const Eigen::Vector3d bearing = camera_.unproject(pixel, &d_pixel).value();
    const Eigen::MatrixXd numeric_d_pixel = test::numerical_jacobian(
        [&](const Eigen::VectorXd& p) -> Eigen::VectorXd { return camera_.unproject(p).value(); },
        pixel);
    EXPECT_TRUE(test::jacobian_agrees(d_pixel, numeric_d_pixel));

    Eigen::Matrix<double, 2, 3> d_point;
    const Eigen::Vector3d point = random_.uniform(0.5, 5) * bearing;
    const Eigen::Vector2d projected = camera_.project(point, &d_point).value();
    EXPECT_EQ(projected, camera_.project(point).value());
    const Eigen::MatrixXd numeric_d_point = test::numerical_jacobian(
        [&](const Eigen::VectorXd& p) -> Eigen::VectorXd { return camera_.project(p).value(); },
        point);
    EXPECT_TRUE(test::jacobian_agrees(d_point, numeric_d_point));

    Eigen::Matrix<double, 2, 3> wrong = d_point;
    wrong(1, 0) += 1e-4 * d_point.cwiseAbs().maxCoeff();
    EXPECT_FALSE(test::jacobian_agrees(wrong, numeric_d_point));
  }
}

TEST_P(EveryLens, ReturnsNothingForNaNAndInfinity) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d point(0.1, 0.2, 1);
      point[i] = bad;
      const bool straight_ahead =
          i == 2 && bad > 0;  // an infinitely distant point on the axis has a pixel
      EXPECT_EQ(camera_.project(point).has_value(), straight_ahead) << point.transpose();
    }
    EXPECT_FALSE(camera_.unproject({bad, 10}));
    EXPECT_FALSE(camera_.unproject({10, bad}));
    EXPECT_FALSE(camera_.contains({bad, 10}));
  }
}

TEST_P(EveryLens, ReturnsNothingBehindTheCamera) {
  EXPECT_TRUE(camera_.project({0, 0, 1e-9}));
  EXPECT_FALSE(camera_.project({0, 0, 0}));
  EXPECT_FALSE(camera_.project({0.1, 0, -1}));
}

TEST(Camera, WithoutDistortionProjectsByItsMatrix) {
  const Camera camera = camera_with({}, 0.7);
  const Eigen::Vector3d point(0.4, -0.3, 2);
  const Eigen::Vector2d expected = (camera.matrix() * point).hnormalized();
  EXPECT_LT((camera.project(point).value() - expected).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(camera.max_angle_rad(), pi / 2);
  const auto grazing = camera.project({1e6, 0, 1});
  ASSERT_TRUE(grazing);
  EXPECT_TRUE(camera.unproject(*grazing));
  EXPECT_FALSE(camera.project({1e300, 0, 1e-300}));  // no finite pixel
}

TEST(Camera, PixelZeroIsThePixelsCentre) {
  const Camera camera = camera_with({});
  EXPECT_TRUE(camera.contains({-0.5, -0.5}));
  EXPECT_TRUE(camera.contains({639.49, 479.49}));
  EXPECT_FALSE(camera.contains({639.5, 10}));
  EXPECT_FALSE(camera.contains({10, 479.5}));
  EXPECT_FALSE(camera.contains({-0.51, 10}));
  EXPECT_FALSE(camera.contains({10, -0.51}));
}

/// A barrel whose distorted radius r (1 + k1 r^2) folds back at r = 1 / sqrt(-3 k1).
TEST(Domain, EndsWhereABarrelDistortionFolds) {
  const Camera camera = camera_with({-0.3, 0, 0, 0});
  const double edge = 1 / std::sqrt(0.9);
  EXPECT_NEAR(camera.max_angle_rad(), std::atan(edge), 1e-14);
  EXPECT_TRUE(camera.project({edge * (1 - 1e-9), 0, 1}));
  EXPECT_FALSE(camera.project({edge * (1 + 1e-9), 0, 1}));
  EXPECT_FALSE(
      camera.project({0, -3 * edge, 1}));  // its formula yields a pixel inside the image again
  // The folded radius is the largest a pixel can have.
  const double largest = edge * (1 - 0.3 * edge * edge);
  EXPECT_TRUE(camera.unproject({322.25 + 410 * largest * (1 - 1e-9), 236.5}));
  EXPECT_FALSE(camera.unproject({322.25 + 410 * largest * (1 + 1e-9), 236.5}));
  EXPECT_FALSE(camera.unproject({1e5, 1e5}));
}

TEST(Domain, RoundTripsHoldUpToTheEdge) {
  for (const std::vector<double>& distortion :
       {std::vector<double>{-0.3, 0, 0, 0}, std::vector<double>{-0.3, 0.02, 0, 0, -0.01}}) {
    const Camera camera = camera_with(distortion);
    const double edge = std::tan(camera.max_angle_rad());
    for (int i = 0; i < 1000; ++i) {
      const double angle = 0.017 * i, r = edge * (1 - std::pow(10, -0.01 * i));
      const Eigen::Vector3d point(r * std::cos(angle), r * std::sin(angle), 1);
      const Eigen::Vector2d pixel = camera.project(point).value();
      const auto bearing = camera.unproject(pixel);
      ASSERT_TRUE(bearing) << "1 - r / edge = 1e" << -0.01 * i;
      EXPECT_LT((camera.project(*bearing).value() - pixel).norm(), 1e-9);
    }
  }
}

TEST(Domain, IsUnlimitedForAPincushionDistortion) {
  const Camera camera = camera_with({0.3, 0.1, 0, 0});
  EXPECT_DOUBLE_EQ(camera.max_angle_rad(), pi / 2);
  for (const double r : {0.1, 1.0, 10.0, 1e3}) {
    const Eigen::Vector2d pixel = camera.project({r, r, 1}).value();
    const Eigen::Vector3d bearing = camera.unproject(pixel).value();
    EXPECT_NEAR(bearing.x() / bearing.z(), r, 1e-12 * r);
  }
}

/// The distorted radius folds at the first root of several, not at the largest.
TEST(Domain, EndsAtTheFirstRootOfSeveral) {
  // d(r radial)/dr = 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 = (1 - s/0.5) (1 - s/2) (1 - s/4)
  const double e1 = 1 / 0.5 + 1 / 2.0 + 1 / 4.0, e2 = 1 / 1.0 + 1 / 2.0 + 1 / 8.0, e3 = 1 / 4.0;
  const Camera camera = camera_with({-e1 / 3, e2 / 5, 0, 0, -e3 / 7});
  EXPECT_NEAR(camera.max_angle_rad(), std::atan(std::sqrt(0.5)), 1e-12);
}

TEST(Domain, EndsBeforeAPoleOfTheRationalModel) {
  const Camera camera = camera_with({0, 0, 0, 0, 0, -0.5, 0, 0});  // radial = 1 / (1 - s/2)
  EXPECT_NEAR(camera.max_angle_rad(), std::atan(std::sqrt(2)), 1e-12);
  EXPECT_TRUE(camera.project({1.41, 0, 1}));
  EXPECT_FALSE(camera.project({1.42, 0, 1}));
  for (const double x : {400.0, 1000.0, 1e5}) {  // every pixel has a ray, however near the pole
    const auto bearing = camera.unproject({x, 236.5});
    ASSERT_TRUE(bearing) << x;
    EXPECT_LT((camera.project(*bearing).value() - Eigen::Vector2d(x, 236.5)).norm(), 1e-9 * x);
  }
}

TEST(Domain, EndsAtTheHorizonOfATiltedSensor) {
  std::vector<double> tilt(14, 0.0);
  tilt[13] = 1.2;
  const Camera camera = camera_with(tilt);
  int seen = 0, unseen = 0;
  for (int i = -20; i <= 20; ++i) {
    const auto pixel = camera.project({0.1 * i, 0, 1});
    (pixel ? seen : unseen)++;
    if (!pixel) continue;
    const auto bearing = camera.unproject(*pixel);
    ASSERT_TRUE(bearing);
    EXPECT_NEAR(bearing->x() / bearing->z(), 0.1 * i, 1e-10);
  }
  EXPECT_GT(seen, 20);
  EXPECT_GT(unseen, 5);
}

TEST(Camera, RejectsInvalidArgumentsByName) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  const auto rejects = [](const std::string& name, auto make) {
    try {
      make();
      ADD_FAILURE() << name << " accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(std::string(error.what()).find(name), 0u) << error.what();
    }
  };
  rejects("width", [] { Camera::pinhole(0, 480, 1, 1, 0, 0); });
  rejects("height", [] { Camera::pinhole(640, -1, 1, 1, 0, 0); });
  for (const double bad : {0.0, -1.0, nan, infinity}) {
    rejects("fx_px", [&] { Camera::pinhole(640, 480, bad, 1, 0, 0); });
    rejects("fy_px", [&] { Camera::pinhole(640, 480, 1, bad, 0, 0); });
  }
  for (const double bad : {nan, infinity}) {
    rejects("cx_px", [&] { Camera::pinhole(640, 480, 1, 1, bad, 0); });
    rejects("cy_px", [&] { Camera::pinhole(640, 480, 1, 1, 0, bad); });
    rejects("skew_px", [&] { Camera::pinhole(640, 480, 1, 1, 0, 0, {}, bad); });
    rejects("distortion[2]", [&] { camera_with({0, 0, bad, 0}); });
  }
  for (const std::size_t n : {1u, 2u, 3u, 6u, 7u, 9u, 13u, 15u}) {
    rejects("distortion's length", [&] { camera_with(std::vector<double>(n, 0.0)); });
  }
  std::vector<double> flat(14, 0.0);
  flat[12] = pi / 2;
  rejects("distortion[12]", [&] { camera_with(flat); });
}

// The library must export the type information of its classes.
TEST(CameraModels, CanBeCast) {
  const std::unique_ptr<const CameraModel> model = std::make_unique<FisheyeModel>(
      640, 480, CameraMatrix{300, 300, 319.5, 239.5, 0}, std::vector<double>{});
  EXPECT_NE(dynamic_cast<const FisheyeModel*>(model.get()), nullptr);
  EXPECT_EQ(dynamic_cast<const PinholeModel*>(model.get()), nullptr);
}

}  // namespace
}  // namespace occ
