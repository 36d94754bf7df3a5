// SPDX-License-Identifier: Apache-2.0
// Every camera model: round trips, derivatives, edges of the domain; the seam of rotating lines.
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "libocc/camera/camera.hpp"
#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

RotatingLine line() {
  RotatingLine l;
  l.width = 6000;
  l.height = 1500;
  l.angle_per_px_rad = 2 * pi / 5990.3;  // a full rotation ends before the last column
  l.c_px = 980;
  l.cy_px = 752.4;
  l.tilt_x_rad = 0.004;
  l.tilt_y_rad = -0.006;
  l.eccentricity_m = {0.012, -0.007, 0.003};
  l.k1 = 0.03;
  l.k2 = -0.012;
  return l;
}

RotatingLine tumbling_line() {
  RotatingLine l = line();
  l.tumbling_rad = {2e-4, -3e-4, 1e-4, 4e-4, -2e-4, 1.5e-4};
  return l;
}

struct Case {
  const char* name;
  Camera camera;
};

std::vector<Case> cases() {
  RotatingLine pure;
  pure.width = 2000;
  pure.height = 500;
  pure.c_px = 400;
  pure.cy_px = 249.5;
  return {
      {"pinhole", Camera::pinhole(640, 480, 410, 425, 322.25, 236.5,
                                  {-0.2, 0.06, 1.2e-3, -0.8e-3, -0.006, 0.02, 0.01, -2e-3, 1e-3,
                                   -4e-4, -1.5e-3, 3e-4, 0.03, -0.02},
                                  0.7)},
      {"equidistant", Camera::fisheye(800, 800, 250, 252, 401, 397)},
      {"fisheye", Camera::fisheye(800, 800, 250, 252, 401, 397, {0.05, -0.01, 0.004, -0.001}, 0.4)},
      {"double_sphere", Camera::double_sphere(752, 480, 350, 352, 366, 249, -0.2, 0.6)},
      {"wide_double_sphere", Camera::double_sphere(752, 480, 180, 181, 366, 249, 0.05, 0.62)},
      {"ideal_line", Camera::rotating_line(pure)},
      {"line", Camera::rotating_line(line())},
      {"tumbling_line", Camera::rotating_line(tumbling_line())},
      {"first_order_line", Camera::rotating_line_first_order(line())}};
}

class EveryCamera : public ::testing::TestWithParam<Case> {
 protected:
  const Camera& camera_ = GetParam().camera;
  Random random_{7};

  Eigen::Vector2d random_pixel() {
    const double columns = std::min<double>(camera_.width(), camera_.period_px());
    return {random_.uniform(-0.5, columns - 0.5), random_.uniform(-0.5, camera_.height() - 0.5)};
  }
  bool is_first_order() const { return camera_.kind() == CameraKind::rotating_line_first_order; }
};

INSTANTIATE_TEST_SUITE_P(Models, EveryCamera, ::testing::ValuesIn(cases()),
                         [](const auto& info) { return info.param.name; });

TEST_P(EveryCamera, PointsOnThePixelsRayProjectToThePixel) {
  int seen = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d pixel = random_pixel();
    const auto ray = camera_.ray(pixel);
    if (!ray) continue;
    ++seen;
    EXPECT_NEAR(ray->direction.norm(), 1, 1e-14);
    EXPECT_EQ(ray->origin.isZero(0), camera_.is_central());
    const auto back = camera_.project(ray->origin + random_.uniform(0.5, 50) * ray->direction);
    ASSERT_TRUE(back) << pixel.transpose();
    const double allowed = is_first_order() ? 2 : 1e-9;
    EXPECT_LT(camera_.difference_px(*back, pixel).norm(), allowed) << pixel.transpose();
  }
  EXPECT_GT(seen, 1500);
}

TEST_P(EveryCamera, JacobiansAgreeWithCentralDifferences) {
  const std::vector<CameraParameter> parameters = camera_.parameters();
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i)
    values[static_cast<Eigen::Index>(i)] = parameters[i].value;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d pixel = random_pixel();
    const auto ray = camera_.ray(pixel);
    if (!ray) continue;
    const Eigen::Vector3d point = ray->origin + random_.uniform(0.5, 5) * ray->direction;
    Eigen::Matrix<double, 2, 3> d_point;
    Camera::ParameterJacobian d_parameters;
    const Eigen::Vector2d px = camera_.project(point, &d_point, &d_parameters).value();
    EXPECT_EQ(px, camera_.project(point).value());
    const auto off = [&](const std::optional<Eigen::Vector2d>& p) -> Eigen::VectorXd {
      return camera_.difference_px(p.value(), px);
    };
    const Eigen::MatrixXd by_point = test::numerical_jacobian(
        [&](const Eigen::VectorXd& p) { return off(camera_.project(p)); }, point, 1e-5);
    EXPECT_TRUE(test::jacobian_agrees(d_point, by_point)) << GetParam().name << pixel.transpose();
    ASSERT_EQ(d_parameters.cols(), values.size());
    const Eigen::Index free = is_first_order() ? 10 : values.size();  // it has no tumbling
    for (Eigen::Index k = 0; k < free; ++k) {
      const double step = k == 0 && std::isfinite(camera_.period_px()) ? 1e-9 : 1e-5;
      Eigen::VectorXd above = values, below = values;
      above[k] += step;
      below[k] -= step;
      const Eigen::VectorXd numeric = (off(camera_.with_parameters(above).project(point)) -
                                       off(camera_.with_parameters(below).project(point))) /
                                      (2 * step);
      const double scale = std::max(numeric.norm(), 1e-2);
      EXPECT_LT((d_parameters.col(k) - numeric).norm() / scale, 2e-6)
          << GetParam().name << " " << parameters[k].name;
    }
    Eigen::Matrix<double, 3, 2> d_pixel;
    camera_.unproject(pixel, &d_pixel);
    const Eigen::MatrixXd by_pixel = test::numerical_jacobian(
        [&](const Eigen::VectorXd& p) -> Eigen::VectorXd { return camera_.unproject(p).value(); },
        pixel, 1e-6);
    EXPECT_TRUE(test::jacobian_agrees(d_pixel, by_pixel)) << GetParam().name;
  }
}

TEST_P(EveryCamera, ParametersSurviveARoundTripAndHaveUnits) {
  const std::vector<CameraParameter> parameters = camera_.parameters();
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = parameters[i].value;
    EXPECT_EQ(parameters[i].is_length, parameters[i].unit == "m");
  }
  const Camera same = camera_.with_parameters(values);
  EXPECT_EQ(same.kind(), camera_.kind());
  const Eigen::Vector3d point(1.3, 0.2, 0.9);
  EXPECT_EQ(same.project(point).value(), camera_.project(point).value());
  EXPECT_NE(test::complaint([&] {
              camera_.with_parameters(Eigen::VectorXd::Zero(3));
            }).find("values' length"),
            std::string::npos);
}

TEST_P(EveryCamera, ReturnsNothingForValuesThatAreNotFinite) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()})
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d point(1.1, 0.2, 1);
      point[i] = bad;
      const auto px = camera_.project(point);
      EXPECT_TRUE(!px || px->allFinite());
      EXPECT_FALSE(camera_.unproject({10, bad}));
    }
  EXPECT_FALSE(camera_.project({0, 0, 0}));
}

TEST(Fisheye, ProjectsLikeOpenCv) {
  const std::vector<double> k{0.05, -0.01, 0.004, -0.001};
  const Camera camera = Camera::fisheye(800, 800, 250, 252, 401, 397, k);
  const cv::Matx33d matrix(250, 0, 401, 0, 252, 397, 0, 0, 1);
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(0.1, 2));
    std::vector<cv::Point2d> theirs;
    cv::fisheye::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, theirs, cv::Vec3d(),
                               cv::Vec3d(), matrix, k);
    const auto ours = camera.project(p);
    ASSERT_TRUE(ours);
    EXPECT_LT((*ours - Eigen::Vector2d(theirs[0].x, theirs[0].y)).norm(), 1e-10);
  }
}

TEST(Fisheye, CoversPointsBehindUpToTheEdgeOfItsDomain) {
  const Camera camera = Camera::fisheye(800, 800, 250, 250, 400, 400);
  EXPECT_TRUE(camera.project({1, 0, -2}));
  EXPECT_FALSE(camera.project({0, 0, -1}));
  const Camera folds = Camera::fisheye(800, 800, 250, 250, 400, 400, {-0.1});
  const double edge = std::sqrt(1 / 0.3);
  EXPECT_NEAR(folds.max_angle_rad(), edge, 1e-12);
  EXPECT_TRUE(folds.project({std::sin(edge - 1e-6), 0, std::cos(edge - 1e-6)}));
  EXPECT_FALSE(folds.project({std::sin(edge + 1e-6), 0, std::cos(edge + 1e-6)}));
}

TEST(DoubleSphere, IsAPinholeIfItsParametersAreZero) {
  const Camera camera = Camera::double_sphere(640, 480, 400, 410, 320, 240, 0, 0);
  const Camera pinhole = Camera::pinhole(640, 480, 400, 410, 320, 240);
  const Eigen::Vector3d point(0.4, -0.3, 2);
  EXPECT_LT((camera.project(point).value() - pinhole.project(point).value()).norm(), 1e-12);
}

TEST(RotatingLine, IdealIsAzimuthAndTangent) {
  RotatingLine l;
  l.width = 3600;
  l.height = 1000;
  l.c_px = 600;
  l.cy_px = 500;
  const Camera camera = Camera::rotating_line(l);
  const Eigen::Vector3d point(-2, 1, 0.7);
  const Eigen::Vector2d px = camera.project(point).value();
  EXPECT_NEAR(px.x(), std::atan2(1, -2) * 3600 / (2 * pi), 1e-9);
  EXPECT_NEAR(px.y(), 500 + 600 * 0.7 / std::sqrt(5.0), 1e-9);
  EXPECT_FALSE(camera.project({0, 0, 1}));  // the pole
}

// Single terms of the model, each exact if the others are zero.
TEST(RotatingLine, SingleTermsHaveTheirClosedForms) {
  RotatingLine l;
  l.width = 36000;
  l.height = 8000;
  l.c_px = 7500;
  l.cy_px = 4000;
  const Eigen::Vector3d point(3, 2, -1.5);
  const Eigen::Vector2d ideal = Camera::rotating_line(l).project(point).value();
  const double lx = 0.01, ly = -0.02;
  RotatingLine tilted = l;
  tilted.tilt_x_rad = lx;
  const Eigen::Vector2d by_lx = Camera::rotating_line(tilted).project(point).value();
  const double y = by_lx.y() - l.cy_px;
  EXPECT_NEAR((by_lx.x() - ideal.x()) * 2 * pi / l.width, std::atan(y / l.c_px * std::sin(lx)),
              1e-12);
  EXPECT_NEAR(y - (ideal.y() - l.cy_px),
              y * (1 - l.c_px * std::cos(lx) / std::hypot(l.c_px, y * std::sin(lx))), 1e-8);
  tilted = l;
  tilted.tilt_y_rad = ly;
  const Eigen::Vector2d by_ly = Camera::rotating_line(tilted).project(point).value();
  const double z = by_ly.y() - l.cy_px;
  EXPECT_NEAR(z - (ideal.y() - l.cy_px),
              std::sin(ly) * (z * z + l.c_px * l.c_px) / (l.c_px * std::cos(ly) + z * std::sin(ly)),
              1e-8);
  EXPECT_NEAR(by_ly.x(), ideal.x(), 1e-9);
}

TEST(RotatingLine, FirstOrderFormIsWrongByAFewTenthsOfAPixel) {
  RotatingLine l;  // 60 mm lens, 8 um pixels, tilts of half a degree
  l.width = 47124;
  l.height = 10200;
  l.c_px = 7500;
  l.cy_px = 5100;
  l.tilt_x_rad = l.tilt_y_rad = 0.5 * pi / 180;
  const Camera exact = Camera::rotating_line(l), first = Camera::rotating_line_first_order(l);
  double sum2 = 0, worst = 0;
  int count = 0;
  for (double row = 0; row < l.height; row += 10, ++count) {
    const Eigen::Vector3d point = 10 * exact.unproject({1000, row}).value();
    const double off =
        exact.difference_px(first.project(point).value(), exact.project(point).value()).norm();
    sum2 += off * off;
    worst = std::max(worst, off);
  }
  const double rms = std::sqrt(sum2 / count);
  EXPECT_GT(rms, 0.03);
  EXPECT_LT(rms, 0.3);
  EXPECT_LT(worst, 0.6);
}

TEST(RotatingLine, IsContinuousAcrossTheSeam) {
  const Camera camera = Camera::rotating_line(line());
  const double period = camera.period_px();
  const auto at = [&](double column) {
    const Ray ray = camera.ray({column, 700}).value();
    return Eigen::Vector3d(ray.origin + 4 * ray.direction);
  };
  const Eigen::Vector2d before = camera.project(at(-1)).value();
  const Eigen::Vector2d after = camera.project(at(1)).value();
  EXPECT_NEAR(before.x(), period - 1, 1e-8);
  EXPECT_NEAR(after.x(), 1, 1e-8);
  EXPECT_NEAR(camera.difference_px(after, before).x(), 2, 1e-8);
  const Camera moved = camera.with_seam_at(-100);
  EXPECT_NEAR(moved.project(at(-1))->x(), -1, 1e-8);
  EXPECT_EQ(moved.period_px(), period);
}

/// Compares d pixel / d point with central differences. The step must be small compared with the
/// distance from the axis.
void expect_derivative(const Camera& camera, const Eigen::Vector3d& point, double step) {
  Eigen::Matrix<double, 2, 3> d_point, numeric;
  const Eigen::Vector2d px = camera.project(point, &d_point).value();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d h = step * Eigen::Vector3d::Unit(k);
    const Eigen::Vector2d above = camera.difference_px(camera.project(point + h).value(), px);
    const Eigen::Vector2d below = camera.difference_px(camera.project(point - h).value(), px);
    numeric.col(k) = (above - below) / (2 * step);
  }
  EXPECT_TRUE(test::jacobian_agrees(d_point, numeric)) << point.transpose();
}

TEST(RotatingLine, DerivativesHoldAtTheSeamAndNearThePoles) {
  for (const Camera& camera :
       {Camera::rotating_line(line()), Camera::rotating_line(tumbling_line())}) {
    for (const double theta : {-1e-7, 0.0, 1e-7, pi, -pi + 1e-9})
      for (const double elevation : {0.0, 0.8, -0.8, 1.3, -1.3, 1.5, -1.5}) {
        const double rho = 0.5;
        const Eigen::Vector3d point(rho * std::cos(theta), rho * std::sin(theta),
                                    rho * std::tan(elevation));
        expect_derivative(camera, point, 2e-5 * rho);
      }
  }
}

TEST(Fisheye, DerivativesHoldOnTheAxisAndAtTheRim) {
  const Camera camera = Camera::fisheye(800, 800, 250, 252, 401, 397, {0.05, -0.01, 0.004, -0.001});
  const double rim = std::min(camera.max_angle_rad(), pi) - 1e-3;
  for (const double angle : {0.0, 1e-13, 1e-9, 1e-5, 1.0, pi / 2, rim})
    expect_derivative(camera, {2 * std::sin(angle), 0, 2 * std::cos(angle)}, 1e-6);
}

TEST(RotatingLine, InvalidValuesAreNamed) {
  RotatingLine l = line();
  l.c_px = -1;
  EXPECT_NE(test::complaint([&] { Camera::rotating_line(l); }).find("c_px"), std::string::npos);
  l = line();
  l.tilt_x_rad = 2;
  EXPECT_NE(test::complaint([&] { Camera::rotating_line(l); }).find("tilt_x_rad"),
            std::string::npos);
  EXPECT_NE(
      test::complaint([&] { Camera::rotating_line_first_order(tumbling_line()); }).find("tumbling"),
      std::string::npos);
  EXPECT_NE(test::complaint([] { Camera::double_sphere(9, 9, 1, 1, 1, 1, 0, 2); }).find("alpha"),
            std::string::npos);
  EXPECT_NE(test::complaint([] {
              Camera::fisheye(9, 9, 1, 1, 1, 1, {1, 2, 3, 4, 5});
            }).find("distortion's length"),
            std::string::npos);
}

TEST(AnyCamera, DepthIsAlongTheAperturesDirectionOfView) {
  Eigen::Vector3d by_point;
  const Eigen::Vector3d point(3, 4, 12);
  EXPECT_EQ(test::vga_camera().depth_m(point, &by_point), 12);
  EXPECT_EQ(Camera::fisheye(8, 8, 2, 2, 3, 3).depth_m(point, &by_point), 13);
  EXPECT_LT((by_point - point / 13).norm(), 1e-15);
  EXPECT_EQ(Camera::rotating_line(line()).depth_m(point, &by_point), 5);
  EXPECT_LT((by_point - Eigen::Vector3d(0.6, 0.8, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace occ
