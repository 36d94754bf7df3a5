// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/contour.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/internal/lame_curve.hpp"
#include "libocc/formation/internal/sharp_coverage.hpp"

namespace occ {

using namespace internal::formation;
namespace {

constexpr int min_disc_points = 24;       // for small discs, where the spacing is not the limit
constexpr double max_disc_points = 8192;  // a longer rim is mostly outside the image
constexpr int max_splits = 60;

// A curve in the camera's frame: position and tangent at a parameter.
struct CurvePoint {
  Eigen::Vector3d at, tangent;
};
using Curve = std::function<CurvePoint(double)>;

// Rim of a disc. Points at uniform angles are computed by repeated rotation.
struct Circle {
  Eigen::Vector3d centre, across, along;

  CurvePoint at(double c, double s) const {
    return {centre + c * across + s * along, c * along - s * across};
  }

  // Calls visit(point) for `count` points of the circle; stops and returns false when it does.
  template <typename Visit>
  bool visit_all(int count, Visit visit) const {
    const double step_cos = std::cos(2 * pi / count), step_sin = std::sin(2 * pi / count);
    double c = 1, s = 0;
    for (int i = 0; i < count; ++i) {
      if (!visit(at(c, s))) return false;
      const double next = step_cos * c - step_sin * s;
      s = step_sin * c + step_cos * s;
      c = next;
    }
    return true;
  }
};

// Projects one curve of a lamp's rim. All functions return nullopt or false if a point is outside
// the camera's domain.
class Projector {
 public:
  Projector(Curve curve, const Eigen::Vector3d& centre_in_cam, const Camera& camera,
            double spacing_px)
      : curve_(std::move(curve)),
        centre_(centre_in_cam),
        camera_(camera),
        spacing_px_(spacing_px) {}

  // Adds the contour point of a point of the curve; `weight` is its part of the parameter's range.
  template <typename AnyContour>
  bool add_point(const CurvePoint& curve_point, double weight, AnyContour& contour) const {
    const auto point = project(curve_point);
    if (!point) return false;
    append(*point, weight, contour);
    return true;
  }

  // Upper limit of the length of the curve's image over an interval of the parameter.
  struct Extent {
    double length_px = 0;
    bool off_image = false;  // the whole interval is far outside the image
  };
  std::optional<Extent> extent(double from, double to, int probes) const {
    Probes all;
    for (int i = 0; i < probes; ++i)
      if (!add_probe(curve_(from + (to - from) * i / (probes - 1)), all)) return std::nullopt;
    return extent(all, to - from, probes - 1);
  }
  std::optional<Extent> extent(const Circle& circle, int probes) const {
    Probes all;
    const auto add = [&](const CurvePoint& point) { return add_probe(point, all); };
    if (!circle.visit_all(probes, add)) return std::nullopt;
    return extent(all, 2 * pi, probes);
  }

  // Adds Gauss-Legendre panels of 16 nodes, at most 16 * 0.6 spacings long unless outside the
  // image.
  template <typename AnyContour>
  bool add_panels(double from, double to, int splits, AnyContour& contour) const;

  // Adds chords between two parameters, each as long as its bulge allows.
  bool add_chords(double from, double to, Chords& chords) const {
    const auto begin = project(from), end = project(to);
    return begin && end && add_chords(from, *begin, to, *end, 0, chords);
  }

 private:
  struct ImagePoint {
    Eigen::Vector2d px, tangent_px;
    Eigen::Vector3d point_in_cam, tangent;
    Eigen::Matrix<double, 2, 3> jacobian;
  };

  struct Probes {
    Eigen::Array2d low = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Array2d high = -low;
    double speed_squared = 0;
  };

  bool add_probe(const CurvePoint& curve_point, Probes& probes) const {
    const auto point = project(curve_point);
    if (!point) return false;
    probes.speed_squared = std::max(probes.speed_squared, point->tangent_px.squaredNorm());
    probes.low = probes.low.min(point->px.array());
    probes.high = probes.high.max(point->px.array());
    return true;
  }

  Extent extent(const Probes& probes, double range, int intervals) const {
    Extent extent;
    extent.length_px = std::sqrt(probes.speed_squared) * range;
    // A contour left of the image changes the coverage of pixels to its right; above, below or
    // right of the image it does not. The margin exceeds the distance between probes and any PSF.
    const double margin = camera_.width() + camera_.height() + extent.length_px / intervals;
    extent.off_image = probes.high.y() < -margin || probes.low.y() > camera_.height() + margin ||
                       probes.low.x() > camera_.width() + margin;
    return extent;
  }

  static void append(const ImagePoint& point, double weight, Contour& contour) {
    contour.push_back({point.px, point.tangent_px.y() * weight});
  }

  // motion x step = q . (rotation x arm + translation), with q the step rotated by a right angle.
  void append(const ImagePoint& point, double weight, MovingContour& contour) const {
    const Eigen::Vector2d step = weight * point.tangent_px;
    const Eigen::Vector3d q = point.jacobian.row(0) * step.y() - point.jacobian.row(1) * step.x();
    MovingContourPoint moving{point.px, step, {}};
    moving.sweep << (point.point_in_cam - centre_).cross(q), q;
    contour.push_back(moving);
  }

  static void append(const ImagePoint& point, double weight, RimContour& contour) {
    contour.push_back({point.point_in_cam, weight * point.tangent});
  }

  std::optional<ImagePoint> project(double at) const { return project(curve_(at)); }

  std::optional<ImagePoint> project(const CurvePoint& point) const {
    ImagePoint image;
    const auto px = camera_.project(point.at, &image.jacobian);
    if (!px) return std::nullopt;
    image.px = *px;
    image.tangent_px = image.jacobian * point.tangent;
    image.point_in_cam = point.at;
    image.tangent = point.tangent;
    return image;
  }

  bool add_chords(double from, const ImagePoint& begin, double to, const ImagePoint& end,
                  int splits, Chords& chords) const;
  bool is_off_image(const Eigen::Array<double, 2, 4>& hull) const;

  Curve curve_;
  Eigen::Vector3d centre_;
  const Camera& camera_;
  double spacing_px_;
};

// Positive half of the 16-point Gauss-Legendre rule on [-1, 1] (Abramowitz & Stegun, table 25.4).
constexpr std::array<double, 8> gauss_nodes = {
    0.0950125098376374, 0.2816035507792589, 0.4580167776572274, 0.6178762444026438,
    0.7554044083550030, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499};
constexpr std::array<double, 8> gauss_weights = {
    0.1894506104550685, 0.1826034150449236, 0.1691565193950025, 0.1495959888165767,
    0.1246289712555339, 0.0951585116824928, 0.0622535239386479, 0.0271524594117541};

template <typename AnyContour>
bool Projector::add_panels(double from, double to, int splits, AnyContour& contour) const {
  const auto size = extent(from, to, 5);
  if (!size || splits > max_splits) return false;
  const double middle = 0.5 * (from + to), half = 0.5 * (to - from);
  if (size->length_px > 16 * 0.6 * spacing_px_ && !size->off_image)
    return add_panels(from, middle, splits + 1, contour) &&
           add_panels(middle, to, splits + 1, contour);
  for (std::size_t i = 0; i < 8; ++i)
    for (const double side : {-half, half})
      if (!add_point(curve_(middle + side * gauss_nodes[i]), half * gauss_weights[i], contour))
        return false;
  return true;
}

// True if the hull is on one side of the image, by half of its own size.
bool Projector::is_off_image(const Eigen::Array<double, 2, 4>& hull) const {
  const Eigen::Array2d low = hull.rowwise().minCoeff(), high = hull.rowwise().maxCoeff();
  const Eigen::Array2d margin = 0.5 * (high - low) + 1;
  const Eigen::Array2d size(camera_.width(), camera_.height());
  return (high + margin < 0).any() || (low - margin > size).any();
}

// The rim is approximated by a Hermite cubic, p(s) = p0 + s d + h10(s) (m0 - d) + h11(s) (m1 - d),
// with the chord d and the tangents m0, m1. The area between cubic and chord is
//     d x (m1 - m0) / 12 - (m0 - d) x (m1 - d) / 60.
// Part of it is assigned to the wrong pixel where rim and chord cross a pixel border at different
// points. This is the whole area if the rim only touches the border. If it crosses the border at an
// angle, it is at most the triangle of that angle whose height is the largest distance between rim
// and chord, 3/2 of the mean distance.
bool Projector::add_chords(double from, const ImagePoint& begin, double to, const ImagePoint& end,
                           int splits, Chords& chords) const {
  constexpr double max_error_px2 = 3e-8;
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const Eigen::Vector2d d = end.px - begin.px;
  const Eigen::Vector2d m0 = (to - from) * begin.tangent_px, m1 = (to - from) * end.tangent_px;
  const double max_area = (std::abs(cross(d, m0)) + std::abs(cross(d, m1))) / 12;
  Eigen::Array<double, 2, 4> hull;
  hull << begin.px, begin.px + m0 / 3, end.px - m1 / 3, end.px;
  // The curve is monotone along both axes, and its speed is nearly constant.
  const bool even = (m0.array() * d.array() > 0).all() && (m1.array() * d.array() > 0).all() &&
                    std::max((m0 - d).norm(), (m1 - d).norm()) < 0.003 * d.norm();
  const double apart = 1.5 * max_area / d.norm();
  const double misplaced =
      even ? 0.5 * apart * apart * d.norm() / d.cwiseAbs().minCoeff() : max_area;
  if (std::min(max_area, misplaced) <= max_error_px2 || is_off_image(hull)) {
    chords.push_back({begin.px, end.px, cross(d, m1 - m0) / 12 - cross(m0 - d, m1 - d) / 60});
    return true;
  }
  const double middle = 0.5 * (from + to);
  const auto at_middle = project(middle);
  return at_middle && splits < max_splits &&
         add_chords(from, begin, middle, *at_middle, splits + 1, chords) &&
         add_chords(middle, *at_middle, to, end, splits + 1, chords);
}

Circle circle(const Lamp& lamp, const Rigid3& cam_from_world) {
  const Eigen::Vector3d normal = cam_from_world.rotation * lamp.normal;
  const Eigen::Vector3d across = normal.unitOrthogonal() * lamp.radius_m;
  return {cam_from_world * lamp.centre_m, across, normal.cross(across)};
}

// The circle as a function of the angle.
Curve curve_of(const Circle& circle) {
  return [=](double angle) { return circle.at(std::cos(angle), std::sin(angle)); };
}

std::vector<Curve> edges(const std::vector<Eigen::Vector3d>& corners) {
  std::vector<Curve> all;
  for (std::size_t i = 0; i < corners.size(); ++i)
    all.push_back([from = corners[i], edge = Eigen::Vector3d(corners[(i + 1) % corners.size()] -
                                                             corners[i])](double s) {
      return CurvePoint{from + s * edge, edge};
    });
  return all;
}

// Smooth pieces of a rim that is not a circle, each over [0, 1].
std::vector<Curve> pieces(const Lamp& lamp, const Rigid3& cam_from_world) {
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  const Eigen::Vector3d x_axis = cam_from_world.rotation * lamp.x_axis;
  const Eigen::Vector3d y_axis = (cam_from_world.rotation * lamp.normal).cross(x_axis);
  if (lamp.shape == LampShape::polygon) {
    std::vector<Eigen::Vector3d> corners;
    for (const Eigen::Vector2d& corner : lamp.corners_m)
      corners.push_back(centre + corner.x() * x_axis + corner.y() * y_axis);
    return edges(corners);
  }
  const Eigen::Vector3d along = 0.5 * lamp.size_m.x() * x_axis;
  const Eigen::Vector3d across = 0.5 * lamp.size_m.y() * y_axis;
  std::vector<Curve> all;
  if (lamp.shape == LampShape::lame) {
    for (int piece = 0; piece < lame_piece_count; ++piece)
      all.push_back([=, exponent = lamp.exponent](double s) {
        const LamePoint p = lame_point(exponent, piece, s);
        return CurvePoint{centre + p.at.x() * along + p.at.y() * across,
                          p.tangent.x() * along + p.tangent.y() * across};
      });
    return all;
  }
  return edges({centre - along - across, centre + along - across, centre + along + across,
                centre - along + across});
}

template <typename AnyContour>
bool add_disc(const Circle& circle, const Eigen::Vector3d& centre, const Camera& camera,
              double spacing_px, AnyContour& contour) {
  const Projector rim(curve_of(circle), centre, camera, spacing_px);
  const auto size = rim.extent(circle, 16);
  if (!size) return false;
  const double wanted = std::ceil(size->length_px / spacing_px);
  if (wanted > max_disc_points) return rim.add_panels(0, 2 * pi, 0, contour);
  const int count = std::max(min_disc_points, static_cast<int>(wanted));
  contour.reserve(static_cast<std::size_t>(count));
  return circle.visit_all(count, [&](const CurvePoint& point) {
    return rim.add_point(point, 2 * pi / count, contour);
  });
}

template <typename AnyContour>
bool any_contour(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                 double spacing_px, AnyContour& contour) {
  require(spacing_px > 0, "spacing_px", spacing_px, "positive");
  contour.clear();
  if (lamp.shape == LampShape::point) return true;
  if (!lamp.shows_lit_side(cam_from_world.origin_in_source())) return false;
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  if (lamp.shape == LampShape::disc)
    return add_disc(circle(lamp, cam_from_world), centre, camera, spacing_px, contour);
  for (const Curve& piece : pieces(lamp, cam_from_world))
    if (!Projector(piece, centre, camera, spacing_px).add_panels(0, 1, 0, contour)) return false;
  return true;
}

template <typename AnyContour>
std::optional<AnyContour> any_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                      const Camera& camera, double spacing_px) {
  std::optional<AnyContour> contour(std::in_place);
  if (!any_contour(lamp, cam_from_world, camera, spacing_px, *contour)) contour.reset();
  return contour;
}

}  // namespace

std::optional<Contour> project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                       const Camera& camera, double spacing_px) {
  return any_contour<Contour>(lamp, cam_from_world, camera, spacing_px);
}

bool project_contour(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                     double spacing_px, Contour& out) {
  return any_contour(lamp, cam_from_world, camera, spacing_px, out);
}

std::optional<MovingContour> project_moving_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                                    const Camera& camera, double spacing_px) {
  return any_contour<MovingContour>(lamp, cam_from_world, camera, spacing_px);
}

std::optional<RimContour> rim_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                      const Camera& camera, double spacing_px) {
  return any_contour<RimContour>(lamp, cam_from_world, camera, spacing_px);
}

std::optional<Chords> internal::formation::project_chords(const Lamp& lamp,
                                                          const Rigid3& cam_from_world,
                                                          const Camera& camera) {
  Chords chords;
  if (lamp.shape == LampShape::point) return chords;
  if (!lamp.shows_lit_side(cam_from_world.origin_in_source())) return std::nullopt;
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  const auto add = [&](const Curve& curve, double from, double to) {
    return Projector(curve, centre, camera, 1).add_chords(from, to, chords);
  };
  if (lamp.shape == LampShape::disc) {
    constexpr int arcs = 8;
    const Curve curve = curve_of(circle(lamp, cam_from_world));
    for (int i = 0; i < arcs; ++i)
      if (!add(curve, 2 * pi * i / arcs, 2 * pi * (i + 1) / arcs)) return std::nullopt;
    return chords;
  }
  for (const Curve& curve : pieces(lamp, cam_from_world))
    if (!add(curve, 0, 1)) return std::nullopt;
  return chords;
}

bool internal::formation::append_polygon(const std::vector<Eigen::Vector3d>& corners,
                                         const Camera& camera, Chords& chords) {
  for (const Curve& edge : edges(corners))
    if (!Projector(edge, corners[0], camera, 1).add_chords(0, 1, chords)) return false;
  return true;
}

Contour smooth_contour(const std::vector<Eigen::Vector2d>& rim_px) {
  // Central first difference of order 12 (Fornberg, "Generation of finite difference formulas on
  // arbitrarily spaced grids", Math. Comp. 51, 1988, table 1).
  constexpr std::array<double, 6> taps = {6.0 / 7,   -15.0 / 56, 5.0 / 63,
                                          -1.0 / 56, 1.0 / 385,  -1.0 / 5544};
  const std::size_t count = rim_px.size();
  require(count >= 13, "rim_px", count, "at least 13 samples long");
  Contour contour(count);
  for (std::size_t i = 0; i < count; ++i) {
    double dy = 0;
    for (std::size_t k = 0; k < taps.size(); ++k) {
      const double ahead = rim_px[(i + k + 1) % count].y();
      const double behind = rim_px[(i + count - k - 1) % count].y();
      dy += taps[k] * (ahead - behind);
    }
    contour[i] = {rim_px[i], dy};
  }
  return contour;
}

}  // namespace occ
