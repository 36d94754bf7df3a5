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
      {"brown_forward",
       Camera::brown_forward(640, 480, 410, 425, 322.25, 236.5,
                             {-0.02, 0.003, 1e-4, 1.2e-3, -0.8e-3, 2e-3, -1e-3}, 300, 0.5, 0.7)},
      {"brown_backward",
       Camera::brown_backward(640, 480, 410, 425, 322.25, 236.5,
                              {0.05, 0.01, 1e-3, 1.2e-3, -0.8e-3, 2e-3, -1e-3}, 300, 0.5, 0.7)},
      {"undistorted_brown", Camera::brown_backward(640, 480, 410, 425, 322.25, 236.5, {}, 300)},
      {"equirectangular",
       Camera::equirectangular(2000, 1000, 2 * pi / 1993.7, 318.5, 998.3, 501.2)},
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

// brown_forward with OpenCV's coefficients: b1 = p2, b2 = p1, r0 = 0, and units of f pixels.
TEST(Brown, ForwardFormProjectsLikeAPinholeWithOpenCvsDistortion) {
  const double k1 = -0.2, k2 = 0.06, p1 = 1.2e-3, p2 = -0.8e-3, k3 = -0.006;
  const Camera opencv =
      Camera::pinhole(640, 480, 410, 425, 322.25, 236.5, {k1, k2, p1, p2, k3}, 0.7);
  const Camera brown = Camera::brown_forward(640, 480, 410, 425, 322.25, 236.5,
                                             {k1, k2, k3, p2, p1, 0, 0}, 410, 0, 0.7);
  const double s = 410 / 100.0;  // other units of the coefficients
  const Camera scaled = Camera::brown_forward(
      640, 480, 410, 425, 322.25, 236.5,
      {k1 / (s * s), k2 / std::pow(s, 4), k3 / std::pow(s, 6), p2 / s, p1 / s, 0, 0}, 100, 0, 0.7);
  EXPECT_NEAR(brown.max_angle_rad(), opencv.max_angle_rad(), 1e-12);
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 2));
    const auto expected = opencv.project(p), found = brown.project(p);
    ASSERT_EQ(found.has_value(), expected.has_value()) << p.transpose();
    if (!found) continue;
    EXPECT_LT((*found - *expected).norm(), 1e-10);
    EXPECT_LT((*scaled.project(p) - *expected).norm(), 1e-9);
  }
}

// The polynomial at one pixel, computed by hand: x = (u - cx) / unit_px, y = (v - cy) / unit_px.
TEST(Brown, BackwardFormEvaluatesThePolynomialAtTheMeasuredPoint) {
  const double f = 2000, unit = 250, r0 = 3, a1 = 2e-3, a2 = -1e-5, a3 = 4e-8, b1 = 3e-5,
               b2 = -5e-5, c1 = 2e-4, c2 = -1e-4;
  const Camera camera = Camera::brown_backward(4000, 3000, f, f, 2003.5, 1490.25,
                                               {a1, a2, a3, b1, b2, c1, c2}, unit, r0);
  const Eigen::Vector2d pixel(3103, 401);
  const double x = (pixel.x() - 2003.5) / unit, y = (pixel.y() - 1490.25) / unit, t = x * x + y * y;
  const double g =
      a1 * (t - r0 * r0) + a2 * (t * t - std::pow(r0, 4)) + a3 * (t * t * t - std::pow(r0, 6));
  const double xc = x + x * g + b1 * (t + 2 * x * x) + 2 * b2 * x * y + c1 * x + c2 * y;
  const double yc = y + y * g + 2 * b1 * x * y + b2 * (t + 2 * y * y);
  const Eigen::Vector3d expected = Eigen::Vector3d(xc * unit / f, yc * unit / f, 1).normalized();
  EXPECT_LT((camera.unproject(pixel).value() - expected).norm(), 1e-14);
}

TEST(Brown, DomainEndsWhereTheRadialPartStopsGrowing) {
  const double edge = std::sqrt(1 / 0.3);  // of r (1 - 0.1 r^2)
  const Camera forward =
      Camera::brown_forward(800, 800, 250, 250, 400, 400, {-0.1, 0, 0, 0, 0, 0, 0}, 250);
  EXPECT_NEAR(forward.max_angle_rad(), std::atan(edge), 1e-12);
  EXPECT_TRUE(forward.project({edge - 1e-6, 0, 1}));
  EXPECT_FALSE(forward.project({edge + 1e-6, 0, 1}));
  const Camera backward =
      Camera::brown_backward(800, 800, 250, 250, 400, 400, {-0.1, 0, 0, 0, 0, 0, 0}, 250);
  const double farthest = edge * (1 - 0.1 * edge * edge);
  EXPECT_NEAR(backward.max_angle_rad(), std::atan(farthest), 1e-12);
  const auto near_edge = backward.project({farthest - 1e-6, 0, 1});
  ASSERT_TRUE(near_edge);
  EXPECT_LT(
      (backward.unproject(*near_edge)->hnormalized() - Eigen::Vector2d(farthest - 1e-6, 0)).norm(),
      1e-12);
  EXPECT_FALSE(backward.project({farthest + 1e-6, 0, 1}));
  EXPECT_FALSE(backward.unproject({400 + 250 * (edge + 1e-6), 400}));
  EXPECT_FALSE(backward.project({0.1, 0.1, -1}));
}

TEST(Brown, InvalidValuesAreNamed) {
  const std::vector<double> none;
  const auto complaint = [](const std::vector<double>& distortion, double unit, double r0) {
    return test::complaint([&] { Camera::brown_backward(9, 9, 1, 1, 1, 1, distortion, unit, r0); });
  };
  EXPECT_NE(complaint({1, 2}, 1, 0).find("distortion's length must be 0 or 7"), std::string::npos);
  EXPECT_NE(complaint(none, 0, 0).find("unit_px"), std::string::npos);
  EXPECT_NE(complaint(none, 1, -1).find("r0"), std::string::npos);
  EXPECT_NE(complaint({1, 0, 0, 0, 0, 0, 0}, 1, 2).find("scale at the centre"), std::string::npos);
}

TEST(Brown, ConstantsAndDistortionAreKept) {
  const Camera camera = Camera::brown_backward(9, 9, 5, 6, 1, 2, {}, 3, 0.5);
  ASSERT_EQ(camera.constants().size(), 2U);
  EXPECT_EQ(camera.constants()[0].value, 3);
  EXPECT_EQ(camera.constants()[1].value, 0.5);
  EXPECT_TRUE(test::vga_camera().constants().empty());
  const Camera uncertain = camera.with_parameter_sigmas({{"a1", 0.1}});
  EXPECT_EQ(uncertain.kind(), CameraKind::brown_backward);
  EXPECT_EQ(uncertain.distortion().size(), 7U);
  EXPECT_EQ(uncertain.constants()[1].value, 0.5);
  EXPECT_TRUE(uncertain.without_distortion().distortion().empty());
}

TEST(Equirectangular, ColumnsAreLongitudesAndRowsLatitudes) {
  const Camera camera =
      Camera::equirectangular(3600, 1800, 2 * pi / 3600, 1800 / pi, 1799.5, 899.5);
  EXPECT_LT((camera.project({0, 0, 2}).value() - Eigen::Vector2d(1799.5, 899.5)).norm(), 1e-9);
  const Eigen::Vector2d px = camera.project({1, std::sqrt(2.0), 1}).value();
  EXPECT_LT((px - Eigen::Vector2d(1799.5 + 450, 899.5 + 450)).norm(), 1e-9);
  EXPECT_FALSE(camera.project({0, 1, 0}));  // the pole
  EXPECT_FALSE(camera.unproject({100, -1}));
  EXPECT_NE(test::complaint([] { Camera::equirectangular(9, 9, 2, 1, 1, 1); }).find("angle_per_px"),
            std::string::npos);
}

TEST(Equirectangular, IsContinuousAcrossTheSeam) {
  const Camera camera = Camera::equirectangular(2000, 1000, 2 * pi / 1990, 300, 995, 500);
  const auto at = [&](double column) { return camera.unproject({column, 420}).value(); };
  const Eigen::Vector2d before = camera.project(at(-1)).value();
  const Eigen::Vector2d after = camera.project(at(1)).value();
  EXPECT_NEAR(before.x(), 1989, 1e-9);
  EXPECT_NEAR(after.x(), 1, 1e-9);
  EXPECT_NEAR(camera.difference_px(after, before).x(), 2, 1e-9);
  EXPECT_NEAR(camera.with_seam_at(-100).project(at(-1))->x(), -1, 1e-9);
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
