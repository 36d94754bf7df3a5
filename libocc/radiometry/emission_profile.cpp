// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/emission_profile.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/internal/quadrature.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/radiometry/internal/hermite_grid.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::radiometry;

// Rows: theta; columns: C. Two rows before theta = 0 and two columns on either side repeat others,
// so that slopes at the borders follow from both sides.
struct EmissionProfile::Grid : HermiteGrid {};

namespace {

constexpr Eigen::Index ghosts = 2;

// Index of the plane before C, and the position between it and the next one from 0 to 1.
struct PlanePosition {
  Eigen::Index low, high;
  double fraction;
};
PlanePosition plane_position(const std::vector<double>& planes, double c) {
  const auto count = static_cast<Eigen::Index>(planes.size());
  const auto above = std::upper_bound(planes.begin(), planes.end(), c);
  const auto high = static_cast<Eigen::Index>(above - planes.begin());
  const double start = *(above - 1);
  const double end = high < count ? *above : planes.front() + 2 * pi;
  return {high - 1, high % count, (c - start) / (end - start)};
}

// Slope over the pole: the planes' slopes there, approximated by a cos C + b sin C, the only
// dependence on C that is differentiable as a function of the direction. Least squares, each plane
// weighted by its share of the circle.
Eigen::Vector2d pole_gradient(const std::vector<double>& planes, const Eigen::VectorXd& slopes) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const std::size_t count = planes.size();
  for (std::size_t j = 0; j < count; ++j) {
    const double next = j + 1 < count ? planes[j + 1] : planes[0] + 2 * pi;
    const double last = j > 0 ? planes[j - 1] : planes[count - 1] - 2 * pi;
    const Eigen::Vector2d row(std::cos(planes[j]), std::sin(planes[j]));
    normal += (next - last) * row * row.transpose();
    right += (next - last) * slopes[static_cast<Eigen::Index>(j)] * row;
  }
  // Planes that all lie in one line leave the slope across it undetermined: zero.
  normal += 1e-9 * Eigen::Matrix2d::Identity();
  const double determinant = normal(0, 0) * normal(1, 1) - normal(0, 1) * normal(1, 0);
  return {(normal(1, 1) * right.x() - normal(0, 1) * right.y()) / determinant,
          (normal(0, 0) * right.y() - normal(1, 0) * right.x()) / determinant};
}

// Adds the ghost rows of theta < 0: the point (-theta, C) is (theta, C + pi).
void set_rows(const PhotometricDistribution& d, HermiteGrid& grid) {
  const auto rows = static_cast<Eigen::Index>(d.vertical_rad.size());
  const auto planes = static_cast<Eigen::Index>(d.horizontal_rad.size());
  grid.x.clear();
  for (Eigen::Index i = std::min(ghosts, rows - 1); i >= 1; --i)
    grid.x.push_back(-d.vertical_rad[static_cast<std::size_t>(i)]);
  const auto before = static_cast<Eigen::Index>(grid.x.size());
  grid.x.insert(grid.x.end(), d.vertical_rad.begin(), d.vertical_rad.end());
  grid.f.resize(before + rows, planes);
  grid.f.bottomRows(rows) = d.intensities_cd;
  grid.f.row(before).setConstant(d.intensities_cd.row(0).mean());
  for (Eigen::Index j = 0; j < planes; ++j) {
    const double opposite = std::fmod(d.horizontal_rad[static_cast<std::size_t>(j)] + pi, 2 * pi);
    const PlanePosition at = plane_position(d.horizontal_rad, opposite);
    for (Eigen::Index i = 1; i <= before; ++i)
      grid.f(before - i, j) = (1 - at.fraction) * d.intensities_cd(i, at.low) +
                              at.fraction * d.intensities_cd(i, at.high);
  }
}

// Adds the ghost columns, which repeat planes one period away. A single plane needs none.
void set_columns(const std::vector<double>& planes_rad, HermiteGrid& grid) {
  const auto planes = static_cast<Eigen::Index>(planes_rad.size());
  grid.y = planes_rad;
  if (planes == 1) return;
  const Eigen::MatrixXd inner = grid.f;
  grid.f.resize(inner.rows(), planes + 2 * ghosts + 1);
  grid.y.clear();
  for (Eigen::Index k = -ghosts; k <= planes + ghosts; ++k) {
    const Eigen::Index turns = k < 0 ? (k + 1) / planes - 1 : k / planes;
    const Eigen::Index j = k - turns * planes;
    grid.y.push_back(planes_rad[static_cast<std::size_t>(j)] + static_cast<double>(turns) * 2 * pi);
    grid.f.col(k + ghosts) = inner.col(j);
  }
}

// Replaces the slopes on the row theta = 0.
void set_pole(const std::vector<double>& planes_rad, Eigen::Index row, HermiteGrid& grid) {
  const auto planes = static_cast<Eigen::Index>(planes_rad.size());
  const Eigen::Index first = planes == 1 ? 0 : ghosts;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  if (planes > 1)
    gradient =
        pole_gradient(planes_rad, grid.f_x.row(row).segment(first, planes).transpose().eval());
  const double step = grid.x[static_cast<std::size_t>(row) + 1];
  const double limit = 3 * grid.f(row, 0) / step;  // a steeper cubic could become negative
  if (gradient.norm() > limit) gradient *= limit / gradient.norm();
  for (Eigen::Index j = 0; j < grid.f.cols(); ++j) {
    const double c = grid.y[static_cast<std::size_t>(j)];
    grid.f_x(row, j) = gradient.x() * std::cos(c) + gradient.y() * std::sin(c);
    grid.f_xy(row, j) = gradient.y() * std::cos(c) - gradient.x() * std::sin(c);
    grid.f_y(row, j) = 0;
  }
}

// Integrals of the intensity, and of the intensity times cos(theta), over the lit hemisphere.
Eigen::Vector2d hemisphere_integrals(const HermiteGrid& grid, std::size_t planes) {
  // Exact for the cubics in C; their product with sin(theta) is exact to 1e-9 for steps up to 15
  // degrees.
  const std::vector<QuadratureNode> in_theta = gauss_legendre(6), in_c = gauss_legendre(2);
  const auto first = planes == 1 ? std::size_t{0} : static_cast<std::size_t>(ghosts);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i + 1 < grid.x.size(); ++i) {
    const double low = grid.x[i], high = std::min(grid.x[i + 1], pi / 2);
    if (low < 0 || high <= low) continue;
    for (const QuadratureNode& t : in_theta) {
      const double theta = low + t.at * (high - low);
      double ring = 0;
      if (planes == 1) ring = 2 * pi * std::max(0.0, grid.at(theta, 0).value);
      for (std::size_t j = first; planes > 1 && j < first + planes; ++j)
        for (const QuadratureNode& c : in_c) {
          const double width = grid.y[j + 1] - grid.y[j];
          ring += c.weight * width * std::max(0.0, grid.at(theta, grid.y[j] + c.at * width).value);
        }
      const double weighted = t.weight * (high - low) * std::sin(theta) * ring;
      sum += weighted * Eigen::Vector2d(1, std::cos(theta));
    }
  }
  return sum;
}

}  // namespace

EmissionProfile::EmissionProfile(PhotometricDistribution distribution)
    : distribution_(std::move(distribution)) {
  distribution_.validate();
  const auto& vertical = distribution_.vertical_rad;
  if (!(vertical.front() < 1e-9 && vertical.back() > pi / 2 - 1e-9))
    require(false, "vertical_rad",
            std::to_string(vertical.front()) + " to " + std::to_string(vertical.back()),
            "from 0 to at least pi/2: gamma = 0 is the lamp's normal");
  auto grid = std::make_shared<Grid>();
  set_rows(distribution_, *grid);
  const auto pole = static_cast<Eigen::Index>(grid->x.size() - vertical.size());
  set_columns(distribution_.horizontal_rad, *grid);
  grid->set_slopes();
  set_pole(distribution_.horizontal_rad, pole, *grid);

  const Eigen::Vector2d integrals =
      hemisphere_integrals(*grid, distribution_.horizontal_rad.size());
  // Values that differ by many orders of magnitude between close angles overflow.
  require(integrals.x() > 0 && integrals.allFinite(), "intensities_cd", integrals.x(),
          "finite and above zero for a gamma below 90 degrees");
  for (Eigen::MatrixXd* table : {&grid->f, &grid->f_x, &grid->f_y, &grid->f_xy})
    *table /= integrals.x();
  const double mean_cosine = integrals.y() / integrals.x();
  constexpr double min_order = 0.01;  // a batwing may have a mean cosine below 1/2, that of order 0
  equivalent_order_ = std::max(min_order, (2 * mean_cosine - 1) / (1 - mean_cosine));
  grid_ = std::move(grid);
}

double EmissionProfile::density(const Eigen::Vector3d& direction, Eigen::Vector3d* gradient) const {
  if (gradient) gradient->setZero();
  if (!(direction.z() > 0)) return 0;
  // At theta = 0 the direction of C is undefined. So near it, differences in C keep 1e-10 of the
  // value.
  constexpr double min_theta = 1e-6;
  const double theta =
      std::max(min_theta, std::atan2(std::hypot(direction.x(), direction.y()), direction.z()));
  double c = 0;
  if (depends_on_c()) {
    c = std::atan2(direction.y(), direction.x());
    if (c < 0) c += 2 * pi;
  }
  const SurfacePoint f = grid_->at(theta, c);
  if (!(f.value > 0)) return 0;
  if (gradient) {
    const double across = std::hypot(direction.x(), direction.y());
    const Eigen::Vector2d out = across > 0 ? Eigen::Vector2d(direction.head<2>() / across)
                                           : Eigen::Vector2d(std::cos(c), std::sin(c));
    const Eigen::Vector3d by_theta(direction.z() * out.x(), direction.z() * out.y(), -across);
    const Eigen::Vector3d by_c(-out.y(), out.x(), 0);
    *gradient = f.by_x * by_theta + f.by_y / std::sin(theta) * by_c;
  }
  return f.value;
}

}  // namespace occ
