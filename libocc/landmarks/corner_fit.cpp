// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/corner_fit.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "libocc/core/internal/dense.hpp"
#include "libocc/landmarks/internal/corner_kernel.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int unknowns = corner_unknowns;
using Vector12 = Eigen::Matrix<double, unknowns, 1>;
using Matrix12 = Eigen::Matrix<double, unknowns, unknowns>;

/// Unknowns of a fit. Offsets are from the pixel in the middle of the window, gradients are per
/// half window.
struct CornerModel {
  Vector2d centre = Vector2d::Zero();  // offset of the corner
  double angles[2] = {0, 0};           // of the edges
  double blur_px = 1;
  double level = 0, step = 0;  // a_0 and b_0; their gradients follow
  Vector2d level_gradient = Vector2d::Zero(), step_gradient = Vector2d::Zero();
  double overshoot = 0;

  CornerModel moved(const Vector12& by) const {
    CornerModel next = *this;
    next.centre += by.segment<2>(0);
    next.angles[0] += by[2];
    next.angles[1] += by[3];
    next.blur_px += by[4];
    next.level += by[5];
    next.level_gradient += by.segment<2>(6);
    next.step += by[8];
    next.step_gradient += by.segment<2>(9);
    next.overshoot += by[11];
    return next;
  }

  CornerParameters parameters() const {
    const auto single = [](double value) { return static_cast<float>(value); };
    CornerParameters p;
    p.centre_x = single(centre.x());
    p.centre_y = single(centre.y());
    for (const int k : {0, 1}) {
      p.cosine[k] = single(std::cos(angles[k]));
      p.sine[k] = single(std::sin(angles[k]));
    }
    p.blur_px = single(blur_px);
    p.level = single(level);
    p.level_x = single(level_gradient.x());
    p.level_y = single(level_gradient.y());
    p.step = single(step);
    p.step_x = single(step_gradient.x());
    p.step_y = single(step_gradient.y());
    p.overshoot = single(overshoot);
    return p;
  }
};

/// True if a point is inside a convex quadrilateral, or within `margin` of its sides' lines.
bool is_within(const Vector2d& p, const std::array<Vector2d, 4>& quad, double margin) {
  const auto cross = [](const Vector2d& a, const Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const double turn = cross(quad[2] - quad[0], quad[3] - quad[1]) > 0 ? 1 : -1;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d side = quad[(k + 1) % 4] - quad[k];
    if (turn * cross(side, p - quad[k]) < -margin * side.norm()) return false;
  }
  return true;
}

/// Moves points so that bent edges become straight. The corner stays where it is.
class EdgeStraightening {
 public:
  /// `corner`: offset from the middle of the window.
  EdgeStraightening(const CornerStart& start, const Vector2d& corner)
      : is_needed_(start.bends_per_px[0] != Vector2d::Zero() ||
                   start.bends_per_px[1] != Vector2d::Zero()),
        corner_(corner),
        bends_(start.bends_per_px) {
    Matrix2d edges;
    edges << start.edges[0], start.edges[1];
    if (is_needed_) along_edges_ = edges.inverse();
  }

  Vector2d operator()(const Vector2d& p) const {
    if (!is_needed_) return p;
    const Vector2d along = along_edges_ * (p - corner_);
    return p - 0.5 * (along.x() * along.x() * bends_[0] + along.y() * along.y() * bends_[1]);
  }

 private:
  bool is_needed_;
  Vector2d corner_;
  std::array<Vector2d, 2> bends_;
  Matrix2d along_edges_ = Matrix2d::Identity();
};

/// Pixels in the circle of a window, with the rows of the model's derivatives.
class CornerPixels {
 public:
  int x = 0, y = 0, half = 0;  // middle
  double used = 0;             // number of pixels in the circle

  bool read(const GreyImage& grey, const Vector2d& centre, const CornerStart& start) {
    const double radius_px = start.radius_px;
    half = static_cast<int>(std::ceil(radius_px));
    if (!grey.holds(centre, half + 1)) return false;
    x = static_cast<int>(std::lround(centre.x()));
    y = static_cast<int>(std::lround(centre.y()));
    const auto area = static_cast<std::size_t>((2 * half + 1) * (2 * half + 1));
    for (std::vector<float>* values : {&x_, &y_, &grey_}) values->resize(area + kernel_lanes);
    offsets_.resize(area);
    std::size_t count = 0;
    const EdgeStraightening straightened(start, centre - Vector2d(x, y));
    for (int v = -half; v <= half; ++v)
      for (int u = -half; u <= half; ++u) {
        if (u * u + v * v > radius_px * radius_px) continue;
        const bool outside =
            std::any_of(start.excluded.begin(), start.excluded.end(), [&](const auto& quad) {
              return is_within(Vector2d(x + u, y + v), quad, start.margin_px);
            });
        if (outside) continue;
        const Vector2d straight = straightened(Vector2d(u, v));
        offsets_[count] = {u, v};
        x_[count] = static_cast<float>(straight.x());
        y_[count] = static_cast<float>(straight.y());
        grey_[count] = static_cast<float>(grey.pixel(x + u, y + v));
        ++count;
      }
    used = static_cast<double>(count);
    if (!(used > 2 * unknowns)) return false;
    inside_.assign(count, 1.0F);
    const std::size_t padded = (count + kernel_lanes - 1) / kernel_lanes * kernel_lanes;
    for (std::vector<float>* values : {&x_, &y_, &grey_}) values->resize(count);
    for (std::vector<float>* values : {&x_, &y_, &grey_, &inside_}) values->resize(padded, 0.0F);
    count_ = static_cast<int>(padded);
    rows_.resize((unknowns + 1) * padded);
    return true;
  }

  void evaluate(const CornerModel& model) {
    const CornerWindow window{x_.data(),      y_.data(), grey_.data(),
                              inside_.data(), count_,    1.0F / static_cast<float>(half)};
    evaluate_corner(model.parameters(), window, rows_.data());
  }

  double mean_grey() const {
    const float* inside = inside_.data();
    double sum;
    lane_dots(grey_.data(), &inside, 1, count_, &sum);
    return sum / used;
  }
  int count() const { return count_; }
  int offset_x(int i) const { return offsets_[static_cast<std::size_t>(i)].first; }
  int offset_y(int i) const { return offsets_[static_cast<std::size_t>(i)].second; }
  /// Row of the last evaluate(): a derivative, or the residuals.
  const float* row(int k) const { return rows_.data() + k * count_; }

 private:
  int count_ = 0;
  std::vector<std::pair<int, int>> offsets_;  // of the pixels, before they are straightened
  std::vector<float> x_, y_, grey_, inside_, rows_;
};

/// Normal equations of a model.
struct CornerEquations {
  Matrix12 information;
  Vector12 gradient;
  double squared = 0;

  CornerEquations(CornerPixels& pixels, const CornerModel& model) {
    pixels.evaluate(model);
    const float* rows[unknowns + 1];
    double products[unknowns + 1];
    for (int a = 0; a <= unknowns; ++a) {
      rows[a] = pixels.row(a);
      lane_dots(rows[a], rows, a + 1, pixels.count(), products);
      for (int b = 0; b <= a; ++b)
        (a < unknowns ? information(a, b) : b < unknowns ? gradient[b] : squared) = products[b];
    }
    information.triangularView<Eigen::StrictlyUpper>() = information.transpose();
  }
};

bool is_plausible(const CornerModel& model, double radius_px) {
  constexpr double min_blur_px = 0.15, min_sine = 0.2, max_overshoot = 1.5;
  return model.blur_px > min_blur_px && model.blur_px < radius_px &&
         std::abs(model.overshoot) < max_overshoot && model.centre.norm() < 0.6 * radius_px + 1 &&
         std::abs(std::sin(model.angles[1] - model.angles[0])) > min_sine;
}

// A last step of 2e-3 px leaves 1e-5 px, as Newton's steps converge quadratically. The first window
// is about the corner of the reduced image.
constexpr double coarse_px = 0.1, fine_px = 2e-3;

/// Information about the overshoot apart from the pixels. If the edges are parallel to the rows,
/// all pixels have a few distances from them, which do not determine position, blur and overshoot.
double overshoot_information(const CornerEquations& equations, double pixels) {
  constexpr double sigma = 0.15;  // sharpening of phones: up to 0.3
  return equations.squared / pixels / (sigma * sigma);
}

/// Levenberg-Marquardt until the corner moves by less than `tolerance_px`; false if it does not
/// converge.
bool adjust_model(CornerPixels& pixels, double radius_px, double tolerance_px, CornerModel& model) {
  constexpr int max_steps = 25;
  constexpr double start_damping = 1e-4, max_damping = 1e4;
  constexpr double final_damping = 1e-7;  // a larger one stops in flat valleys
  double damping = start_damping;
  CornerEquations here(pixels, model);
  for (int i = 0; i < max_steps; ++i) {
    const double of_overshoot = overshoot_information(here, pixels.used);
    const auto cost = [&](const CornerEquations& at, const CornerModel& of) {
      return at.squared + of_overshoot * of.overshoot * of.overshoot;
    };
    Matrix12 damped = here.information;
    damped.diagonal() *= 1 + damping;
    damped(unknowns - 1, unknowns - 1) += of_overshoot;
    Vector12 gradient = here.gradient;
    gradient[unknowns - 1] -= of_overshoot * model.overshoot;
    const core::Cholesky<Matrix12> factors(damped);
    if (!factors.exists()) return false;
    const Vector12 step = factors.solve(gradient);
    if (!step.allFinite()) return false;
    const CornerModel next = model.moved(step);
    if (is_plausible(next, radius_px)) {
      // The rounding of single precision hides improvements by smaller steps.
      if ((damping <= final_damping || tolerance_px > fine_px || i + 1 == max_steps) &&
          step.segment<2>(0).norm() < tolerance_px) {
        model = next;
        return true;
      }
      const CornerEquations there(pixels, next);
      if (cost(there, next) <= cost(here, model)) {
        model = next;
        here = there;
        damping = std::max(damping / 100, 1e-9);
        continue;
      }
      if (step.segment<2>(0).norm() < tolerance_px) return true;  // below the rounding
    }
    damping *= 10;
    if (damping > max_damping) return false;
  }
  return false;
}

/// The part of the residuals that changes its sign at the corner, times sqrt(2): independent noise
/// keeps its variance. The other part, for example of edges that are not blurred as the model, does
/// not move the corner, because the influences change their sign, too.
std::vector<double> odd_residuals(const CornerPixels& pixels, const Vector2d& centre) {
  const int side = 2 * pixels.half + 1, count = static_cast<int>(pixels.used);
  const float* residuals = pixels.row(unknowns);
  std::vector<int> index(static_cast<std::size_t>(side * side), -1);
  const auto at = [&](int u, int v) -> int {
    if (std::abs(u) > pixels.half || std::abs(v) > pixels.half) return -1;
    return index[static_cast<std::size_t>((v + pixels.half) * side + u + pixels.half)];
  };
  for (int i = 0; i < count; ++i)
    index[static_cast<std::size_t>((pixels.offset_y(i) + pixels.half) * side + pixels.offset_x(i) +
                                   pixels.half)] = i;
  // Mirrored pixels are pixels again if the mirror is a multiple of half a pixel.
  const int twice_x = static_cast<int>(std::lround(2 * centre.x()));
  const int twice_y = static_cast<int>(std::lround(2 * centre.y()));
  std::vector<double> odd;
  for (int i = 0; i < count; ++i) {
    const int mirrored = at(twice_x - pixels.offset_x(i), twice_y - pixels.offset_y(i));
    odd.push_back(mirrored < 0 ? residuals[i]
                               : std::sqrt(0.5) * (static_cast<double>(residuals[i]) -
                                                   static_cast<double>(residuals[mirrored])));
  }
  return odd;
}

/// Residuals, influences and variance of a fit.
bool describe_fit(CornerPixels& pixels, const CornerModel& model, CornerFit& fit) {
  const CornerEquations equations(pixels, model);
  Matrix12 information = equations.information;
  information(unknowns - 1, unknowns - 1) += overshoot_information(equations, pixels.used);
  const core::Cholesky<Matrix12> factors(information);
  if (!factors.exists() || !(pixels.used > 2 * unknowns)) return false;
  using Columns = Eigen::Matrix<double, unknowns, 2>;
  const Columns rows = factors.solve(Columns(Columns::Identity()));
  fit.raster.resize(pixels.half);
  const std::vector<double> odd = odd_residuals(pixels, model.centre);
  std::array<std::vector<double>, 2> influences;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    influences[axis].assign(odd.size(), 0);
    for (int k = 0; k < unknowns; ++k) {
      const double by_row = rows(k, static_cast<Eigen::Index>(axis));
      const float* row = pixels.row(k);
      for (std::size_t i = 0; i < odd.size(); ++i) influences[axis][i] += by_row * row[i];
    }
  }
  double squared = 0, weights = 0;
  for (std::size_t i = 0; i < odd.size(); ++i) {
    const double by_x = influences[0][i], by_y = influences[1][i];
    const double weight = by_x * by_x + by_y * by_y;
    squared += weight * odd[i] * odd[i];
    weights += weight;
    const int pixel = static_cast<int>(i);
    fit.raster.set(pixels.offset_x(pixel), pixels.offset_y(pixel), by_x, by_y, odd[i]);
  }
  constexpr double rounding = 1 / 12.0;  // variance of rounded grey levels
  fit.variance = std::max(squared / weights * pixels.used / (pixels.used - unknowns), rounding);
  fit.px = Vector2d(pixels.x, pixels.y) + model.centre;
  for (const int k : {0, 1})
    fit.edges[k] = Vector2d(std::cos(model.angles[k]), std::sin(model.angles[k]));
  fit.blur_px = model.blur_px;
  fit.contrast = 2 * std::abs(model.step);
  fit.misfit = std::sqrt(equations.squared / pixels.used) / fit.contrast;
  fit.gradient = (model.level_gradient.norm() + model.step_gradient.norm()) / fit.contrast;
  constexpr double min_significance = 3;  // contrast, in standard deviations of a pixel
  return fit.contrast * fit.contrast * pixels.used >
         min_significance * min_significance * equations.squared;
}

struct Lag {
  int du = 0, dv = 0;
};

/// No lag first, then those of half the plane.
std::array<Lag, lag_count> all_lags() {
  std::array<Lag, lag_count> lags;
  std::size_t count = 1;
  for (int dv = 0; dv <= max_lag_px; ++dv)
    for (int du = dv == 0 ? 1 : -max_lag_px; du <= max_lag_px; ++du) lags[count++] = {du, dv};
  return lags;
}

/// Weight of a lag, which keeps the covariance positive (Bartlett's window; Newey, West, "A simple,
/// positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix",
/// Econometrica 55, 1987).
double lag_weight(const Lag& lag) {
  return (1 - std::abs(lag.du) / (max_lag_px + 1.0)) * (1 - std::abs(lag.dv) / (max_lag_px + 1.0));
}

/// Correlation of the noise at each lag, pooled over all fits. Pixels have the weight of their
/// influence.
LagSums pooled_correlation(const std::vector<CornerFit>& fits) {
  LagSums products{}, weights{};
  for (const CornerFit& fit : fits) {
    const InfluenceRaster& raster = fit.raster;
    const std::vector<float> weight = raster.weights();
    std::vector<float> scaled = weight;
    const double per_sigma = 1 / std::sqrt(fit.variance);
    for (std::size_t i = 0; i < scaled.size(); ++i)
      scaled[i] *= static_cast<float>(per_sigma * raster.residual[i]);
    const LagSums of_residuals = raster.lagged_dots(scaled, scaled);
    const LagSums of_weights = raster.lagged_dots(weight, weight);
    for (std::size_t lag = 0; lag < lag_count; ++lag) {
      products[lag] += of_residuals[lag];
      weights[lag] += of_weights[lag];
    }
  }
  for (std::size_t lag = 0; lag < lag_count; ++lag)
    products[lag] = weights[lag] > 0 ? products[lag] / weights[lag] : 0;
  return products;
}

}  // namespace

void InfluenceRaster::resize(int half_px) {
  half = half_px;
  const int side = 2 * half + 1;
  stride = side + max_lag_px;  // pixels of a lag beyond the row are zero
  const int size = stride * (side + 2 * max_lag_px) + 2 * max_lag_px + 2 * kernel_lanes;
  for (std::vector<float>* values : {&x, &y, &residual})
    values->assign(static_cast<std::size_t>(size), 0.0F);
}

void InfluenceRaster::set(int u, int v, double influence_x, double influence_y, double off) {
  const std::size_t i = static_cast<std::size_t>((v + half) * stride + u + half);
  x[i] = static_cast<float>(influence_x);
  y[i] = static_cast<float>(influence_y);
  residual[i] = static_cast<float>(off);
}

std::vector<float> InfluenceRaster::weights() const {
  std::vector<float> weight(x.size());
  double sum = 0;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    weight[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
    sum += weight[i];
  }
  for (float& value : weight) value = static_cast<float>(value / sum);
  return weight;
}

LagSums InfluenceRaster::lagged_dots(const std::vector<float>& a,
                                     const std::vector<float>& b) const {
  const int count = (stride * (2 * half + 1) + kernel_lanes - 1) / kernel_lanes * kernel_lanes;
  std::array<const float*, lag_count> shifted;
  const std::array<Lag, lag_count> lags = all_lags();
  for (std::size_t lag = 0; lag < lag_count; ++lag)  // shifts of half the plane are not negative
    shifted[lag] = b.data() + lags[lag].dv * stride + lags[lag].du;
  LagSums sums;
  lane_dots(a.data(), shifted.data(), lag_count, count, sums.data());
  return sums;
}

void continue_from(const CornerFit& fit, CornerStart& start) {
  start.px = fit.px;
  for (const int k : {0, 1}) start.edges[k] = fit.edges[k];
  start.blur_px = fit.blur_px;
  start.contrast = fit.contrast;
  start.is_fitted = true;
}

bool fit_corner(const GreyImage& grey, const CornerStart& start, CornerFit& fit) {
  constexpr int max_windows = 5;
  CornerModel model;
  for (const int k : {0, 1}) model.angles[k] = std::atan2(start.edges[k].y(), start.edges[k].x());
  model.blur_px = std::min(start.blur_px, 0.5 * start.radius_px);
  model.step = -0.5 * start.contrast;  // erf erf is negative between the edges
  Vector2d px = start.px;
  CornerPixels pixels;
  for (int i = 0; i < max_windows; ++i) {
    if (!pixels.read(grey, px, start)) return false;
    const Vector2d middle(pixels.x, pixels.y);
    model.centre = px - middle;
    if (i == 0) model.level = pixels.mean_grey();
    const bool is_centred = i > 0 || start.is_fitted;
    const double tolerance_px = is_centred ? fine_px : coarse_px;
    if (!adjust_model(pixels, start.radius_px, tolerance_px, model)) return false;
    px = middle + model.centre;
    if (!((px - start.px).norm() < start.radius_px)) return false;
    constexpr double max_offset_px = 0.75;  // more: the window is not centred on the corner
    if (is_centred && model.centre.cwiseAbs().maxCoeff() < max_offset_px)
      return model.step < 0 && describe_fit(pixels, model, fit);
    // The gradients are about the middle of the next window.
    const Vector2d shift = model.centre.array().round().matrix() / pixels.half;
    model.level += model.level_gradient.dot(shift);
    model.step += model.step_gradient.dot(shift);
  }
  return false;
}

std::vector<Matrix2d> noise_covariances(const std::vector<CornerFit>& fits) {
  const LagSums correlation = pooled_correlation(fits);
  const std::array<Lag, lag_count> lags = all_lags();
  std::vector<Matrix2d> covariances;
  for (const CornerFit& fit : fits) {
    const InfluenceRaster& raster = fit.raster;
    const LagSums xx = raster.lagged_dots(raster.x, raster.x);
    const LagSums xy = raster.lagged_dots(raster.x, raster.y);
    const LagSums yx = raster.lagged_dots(raster.y, raster.x);
    const LagSums yy = raster.lagged_dots(raster.y, raster.y);
    Matrix2d independent;
    independent << xx[0], xy[0], yx[0], yy[0];
    Matrix2d correlated = independent;
    for (std::size_t lag = 1; lag < lag_count; ++lag) {
      Matrix2d products;
      products << xx[lag], xy[lag], yx[lag], yy[lag];
      products *= correlation[lag] * lag_weight(lags[lag]);
      correlated += products + products.transpose();
    }
    // Negative correlation, as of sharpened noise, is not relied upon: it is known too badly.
    if (!(correlated.trace() > independent.trace()) || !(correlated.determinant() > 0))
      correlated = independent;
    covariances.push_back(fit.variance * correlated);
  }
  return covariances;
}

}  // namespace occ::internal::landmarks
