// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/lamp_pixels.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/refine/internal/lamp_rim.hpp"

namespace occ::internal::refine {
namespace {

/// Prior of ln of the PSF's width: focus and field position change the width by about 10 %.
constexpr double spread_sigma = 0.1;

/// Prior of the order of emission, relative to max(1, order), before and after free_emission(). The
/// first increases the pose's sigma by less than 2 %. At 2 sigma the second includes half-power
/// angles from 30 degrees if the scene's angle is 60 degrees.
constexpr double trusted_order_sigma = 0.03, free_order_sigma = 2;

/// Without an image the PSF and the emission of the scene are exact.
constexpr double exact_sigma = 1e-6;

/// Limits of the order: half power at 89.9 degrees, and the prior's sigmas.
constexpr double min_order = 0.1, max_order_sigmas = 10;

/// With a smaller covered or uncovered fraction, a pixel does not respond to a motion of the rim.
constexpr double rim_coverage = 1e-5;

/// Distance of contour points in PSF sigmas: the image is then accurate to 2e-5 of its peak.
constexpr double spacing_sigma = 1.25;

/// Iterations that fit a lamp's light at the start pose if its flux was not measured. The light of
/// a saturated lamp follows from the flanks of its image.
constexpr int first_passes_unmeasured = 3, first_passes_saturated = 8;

/// Standard deviation of the root mean square of n rounded residuals, most of which are zero, times
/// sqrt(n). For normal residuals it is 0.7.
constexpr double misfit_scatter = 1.5;
constexpr double edge_sigmas = 3;  // larger residuals at the edge are significant
constexpr double outlying = 10;    // limit of residuals in the misfit [sigmas]

/// Squared sensitivity of a pixel to an edge that is sharper or smoother than the model: 1 on the
/// rim, 0.2 where 1 % of the light is covered or missing.
double edge_share(double coverage) {
  const double between = 4 * coverage * (1 - coverage);
  return std::sqrt(std::max(between, 0.0));
}

double inverse_square(double sigma) { return 1 / (sigma * sigma); }

}  // namespace

/// Sums over pixels away from the rim, which depend on light and background only.
struct LampPixels::Flat {
  double light_light = 0, light_background = 0, background_background = 0;
  double light_residual = 0, background_residual = 0, residual_residual = 0;
  double light_order = 0, background_order = 0, order_order = 0, order_residual = 0;
  double misfit = 0, sensed = 0;  // sums of squares at the rim: over all noise; over the sensor's
  double excess = 0, edges = 0;   // excess of these squares over 1, and sum of squared edge terms
};

LampPixels::LampPixels(const LampObservation& lamp, const Scene& scene,
                       const RefineOptions& options, const PixelNoise& noise, const PixelPsf& psf,
                       PixelScratch& scratch)
    : lamp_(lamp),
      scene_(scene),
      options_(options),
      noise_(noise),
      psf_(psf),
      scratch_(scratch),
      rendered_(*lamp.lamp),
      order_(lamp.lamp->photometry ? 1 : lamp.lamp->order()),
      order_sigma_(lamp.window.empty() || lamp.lamp->photometry
                       ? exact_sigma
                       : trusted_order_sigma * std::max(1.0, order_)),
      free_order_sigma_(lamp.lamp->photometry ? exact_sigma
                                              : free_order_sigma * std::max(1.0, order_)) {}

bool LampPixels::linearise(const State& state, const Eigen::Vector3d& pivot) {
  const Eigen::Vector3d centre = state.cam_from_world * lamp_.lamp->centre_m;
  Eigen::Matrix<double, 2, 3> d_px;
  if (!scene_.camera.project(centre, &d_px)) return false;
  if (!started_) first_pose_ = state.cam_from_world;
  linearised_order_ = own_.order;
  if (own_.order != 0) change_order(*lamp_.lamp, order_ + own_.order, first_pose_, rendered_);
  if (!render_lamp(rendered_, state.cam_from_world, scene_.camera, scene_.sensor, psf_,
                   spacing_sigma * psf_.sigma_px(), scratch_.image) ||
      scratch_.image.width() == 0) {
    return false;
  }
  d_log_light_ = scratch_.image.d_log_light;
  slope_ = slope_of_light(state.cam_from_world, centre);
  state_ = state;
  arm_ = centre - pivot;
  shift_of_px_ = d_px.transpose() * (d_px * d_px.transpose()).inverse();
  if (!started_) {
    guess(state);
  } else {
    threshold_ = options_.huber_sigma * std::max(1.0, left_);
    edge_variance_ = next_edge_variance_;
  }
  accumulate();
  weigh_down();
  return true;
}

EmissionSlope LampPixels::slope_of_light(const Rigid3& cam_from_world,
                                         const Eigen::Vector3d& centre) const {
  const auto px = scene_.camera.project(centre);
  if (!px || lamp_.window.empty() || lamp_.lamp->shape == LampShape::point ||
      lamp_.lamp->photometry) {
    return {};
  }
  const LampImage& image = scratch_.image;
  const Eigen::Vector2d reach_px(0.5 * image.width(), 0.5 * image.height());
  return {*lamp_.lamp, cam_from_world, scene_.camera, *px, reach_px};
}

void LampPixels::guess(const State& state) {
  started_ = true;
  threshold_ = std::numeric_limits<double>::infinity();
  own_ = {state.log_factor, noise_.dark_e(), 0, 0};
  if (lamp_.window.empty()) return;
  double sum = 0;
  for (const double e : scratch_.image.electrons) sum += e;
  const Blob& blob = *lamp_.blob;
  const double seen = blob.flux_dn / (scene_.sensor.gain_dn_per_e * std::max(sum, 1e-9));
  if (seen > 0) {  // a lower limit for a saturated lamp
    const double log_seen = std::log(seen);
    own_.log_light = blob.saturated ? std::max(own_.log_light, log_seen + 0.5) : log_seen;
  }
  const int passes = blob.saturated ? first_passes_saturated
                     : seen > 0     ? 0
                                    : first_passes_unmeasured;
  for (int i = 0; i < passes; ++i) {
    accumulate();
    fit_own(state);
  }
}

/// Best fit of light, background and spread at a fixed pose.
void LampPixels::fit_own(const State& state) {
  Sums all = sums();
  add_own_priors(state, all);
  const Eigen::Matrix3d information = all.block<3, 3>(own_light, own_light);
  Eigen::Vector4d step = Eigen::Vector4d::Zero();
  const Eigen::Vector3d right = all.block<3, 1>(own_light, rest);
  step.head<3>() = core::solve_ldlt(information, right);
  move_own(step);
}

void LampPixels::move_own(const Eigen::Vector4d& step) {
  if (!step.allFinite()) return;
  own_.log_light += std::clamp(step[0], -0.7, 0.7);
  own_.background_e += step[1];
  own_.log_spread += std::clamp(step[2], -0.2, 0.2);
  const double reach = max_order_sigmas * free_order_sigma_;
  own_.order = std::clamp(own_.order + step[3], std::max(-reach, min_order - order_), reach);
}

void LampPixels::accumulate() {
  const LampImage& image = scratch_.image;
  const CoverageMoments& cover = image.coverage.moments;
  auto& rows = scratch_.rows;
  const BlobWindow& window = lamp_.window;
  const bool expected = window.empty();
  const int x0 = expected ? image.x0() : window.x0, y0 = expected ? image.y0() : window.y0;
  const int width = expected ? image.width() : window.width;
  const int height = expected ? image.height() : window.height;
  rows.resize(Eigen::NoChange, std::max<Eigen::Index>(rows.cols(), width * height));
  amount_ = std::exp(own_.log_light);
  dark_ = noise_.at(own_.background_e);
  rim_count_ = 0;
  count_ = 0;
  robust_excess_ = 0;
  Flat flat;
  const float* reads = window.electrons.data();
  for (int y = y0; y < y0 + height; ++y) {
    const int row = y - image.y0();
    const bool row_inside = row >= 0 && row < image.height();
    for (int x = x0; x < x0 + width; ++x) {
      const double read = expected ? 0 : static_cast<double>(*reads++);
      if (std::isnan(read)) continue;
      const int column = x - image.x0();
      if (!row_inside || column < 0 || column >= image.width()) {
        add_flat_pixel(0, 0, 0, read, flat);
        continue;
      }
      const auto i = static_cast<std::size_t>(row * image.width() + column);
      const double c = cover.c.values[i];
      const bool at_rim = c > rim_coverage && (c < 1 - rim_coverage || cover.m_x.values.empty());
      if (at_rim) {
        add_rim_pixel(image.electrons[i], image.full[i], c, slope_.at(x, y), image.coverage.d[i],
                      read, flat);
      } else {
        add_flat_pixel(image.electrons[i], image.full[i], slope_.at(x, y), read, flat);
      }
    }
  }
  const auto rim_pixels = static_cast<double>(std::max<Eigen::Index>(1, rim_count_));
  misfit_ = rim_count_ > 0 ? std::sqrt(flat.sensed / rim_pixels) : 1;
  left_ = rim_count_ > 0 ? std::sqrt(flat.misfit / rim_pixels) : 1;
  // Only the tail of a clipped edge is visible, which the estimated width of the PSF adapts to.
  const bool by_chance = !(flat.excess > edge_sigmas * std::sqrt(2 * flat.edges));
  next_edge_variance_ = lamp_.blob->saturated || by_chance ? 0 : flat.excess / flat.edges;
  products_.setZero();
  const auto at_rim = rows.leftCols(rim_count_);
  products_ = (at_rim * at_rim.transpose()).cast<double>();
  products_(light, light) += flat.light_light;
  products_(background, background) += flat.background_background;
  products_(residual, residual) += flat.residual_residual;
  const auto add_pair = [&](int i, int j, double value) {
    products_(i, j) += value;
    products_(j, i) += value;
  };
  add_pair(light, background, flat.light_background);
  add_pair(light, residual, flat.light_residual);
  add_pair(background, residual, flat.background_residual);
  products_(order, order) += flat.order_order;
  add_pair(light, order, flat.light_order);
  add_pair(background, order, flat.background_order);
  add_pair(order, residual, flat.order_residual);
}

/// Huber's weight over the variance.
double LampPixels::precision(const PixelMoments& moments, double error, double edge_e2,
                             Flat& flat) {
  const double sensed_precision = 1 / moments.variance;
  const double precision =
      edge_variance_ > 0 ? 1 / (moments.variance + edge_variance_ * edge_e2) : sensed_precision;
  if (lamp_.window.empty()) {  // Slepian-Bangs: (1 + (var')^2 / (2 var)) / var
    return precision * (1 + 0.5 * precision);
  }
  const double square = error * error * precision;
  if (edge_e2 > 0) {
    constexpr double most = outlying * outlying;
    const double sensed = std::min(error * error * sensed_precision, most);
    flat.misfit += std::min(square, most);
    flat.sensed += sensed;
    const double share = edge_e2 * sensed_precision;  // weighted least squares of sensed - 1
    flat.excess += (sensed - 1) * share;
    flat.edges += share * share;
  }
  if (square <= threshold_ * threshold_) return precision;
  const double size = std::sqrt(square);
  robust_excess_ += threshold_ * (size - threshold_);
  return precision * threshold_ / size;
}

void LampPixels::add_flat_pixel(double signal, double full, double log_slope, double reads,
                                Flat& flat) {
  const double lit = amount_ * signal;
  const bool dark = signal < 0.5 * full || full == 0;
  const PixelMoments moments = dark ? dark_ : noise_.at(lit + own_.background_e);
  if (!moments.informative) return;
  ++count_;
  const double error = lamp_.window.empty() ? 0 : reads - moments.mean;
  const double weight = precision(moments, error, 0, flat);
  const double slope = weight * moments.slope;
  const double by_background = slope * moments.slope;
  flat.light_light += by_background * lit * lit;
  flat.light_background += by_background * lit;
  flat.background_background += by_background;
  const double by_light = by_background * lit, pull = slope * lit * error;
  flat.light_order += by_light * lit * log_slope;
  flat.background_order += by_light * log_slope;
  flat.order_order += by_light * lit * log_slope * log_slope;
  flat.light_residual += pull;
  flat.order_residual += pull * log_slope;
  flat.background_residual += slope * error;
  flat.residual_residual += weight * error * error;
}

void LampPixels::add_rim_pixel(double signal, double full, double coverage, double log_slope,
                               const CoverageDerivatives::Row& d, double reads, Flat& flat) {
  const double lit = amount_ * (signal + own_.log_spread * full * d[spread]);
  const PixelMoments moments = noise_.at(lit + own_.background_e);
  if (!moments.informative) return;
  ++count_;
  const double error = lamp_.window.empty() ? 0 : reads - moments.mean;
  const double step_e = amount_ * full * moments.slope;
  const double edge_e2 = step_e * step_e * edge_share(coverage);
  const double root = std::sqrt(precision(moments, error, edge_e2, flat));
  const double slope = root * moments.slope;
  const auto factor = static_cast<float>(slope * amount_ * full);
  float* row = scratch_.rows.data() + columns * rim_count_++;
  for (std::size_t k = 0; k <= spread; ++k) row[k] = factor * d[k];
  row[light] = static_cast<float>(slope * lit);
  row[background] = static_cast<float>(slope);
  row[order] = static_cast<float>(slope * lit * log_slope);
  row[residual] = static_cast<float>(root * error);
}

LampPixels::Sums LampPixels::sums() const {
  Eigen::Matrix<double, columns, unknowns> from = Eigen::Matrix<double, columns, unknowns>::Zero();
  from.block<6, 6>(0, 0).setIdentity();
  // A rotation w of the pose about the pivot rotates the lamp and moves its centre by w x arm.
  from.block<3, 3>(3, 0) = -skew(arm_);
  from.block<1, 6>(light, 0) = d_log_light_.transpose();
  from.block<1, 3>(light, 0) -= d_log_light_.tail<3>().transpose() * skew(arm_);
  from(light, own_light) = 1;
  from(background, own_background) = 1;
  from(spread, own_spread) = 1;
  from(order, own_order) = 1;
  from.block<3, 2>(3, own_x) = shift_of_px_;
  from(residual, rest) = 1;
  Eigen::Matrix<double, unknowns, columns> half;
  core::transposed_product(from, products_, half);
  Sums sums;
  core::product(half, from, sums);
  return sums;
}

/// Adds the rows (expected - unknown) / sigma.
void LampPixels::add_own_priors(const State& state, Sums& sums) const {
  const double spread_weight = inverse_square(lamp_.window.empty() ? exact_sigma : spread_sigma);
  sums(own_spread, own_spread) += spread_weight;
  sums(own_spread, rest) -= spread_weight * own_.log_spread;  // only the last column is used
  sums(rest, rest) += spread_weight * own_.log_spread * own_.log_spread;
  sums(own_background, own_background) += inverse_square(noise_.white_e());
  const double shift_weight = inverse_square(std::max(options_.model_sigma_px, 1e-6));
  sums(own_x, own_x) += shift_weight;
  sums(own_y, own_y) += shift_weight;
  if (!std::isfinite(lamp_.light_sigma)) {
    sums(own_light, own_light) += 1e-6;
    return;
  }
  const double weight = inverse_square(std::max(lamp_.light_sigma, 1e-6));
  const double missing = state.log_factor - own_.log_light;
  sums(own_light, own_light) += weight;
  sums(own_light, rest) += weight * missing;
  sums(rest, rest) += weight * missing * missing;
  if (options_.flux != FluxModel::common_factor) return;
  sums(log_factor, log_factor) += weight;
  sums(own_light, log_factor) -= weight;
  sums(log_factor, rest) -= weight * missing;
}

void LampPixels::add_order_prior(double weight, Sums& sums) const {
  sums(own_order, own_order) += weight;
  sums(own_order, rest) -= weight * linearised_order_;  // only the last column is used
  sums(rest, rest) += weight * linearised_order_ * linearised_order_;
}

/// Reduces the weight of a lamp whose residuals at the rim are significantly larger than the noise:
/// the scene does not describe its image completely.
void LampPixels::weigh_down() {
  const double chance =
      1 + 3 * misfit_scatter / std::sqrt(std::max(1.0, static_cast<double>(rim_count_)));
  if (lamp_.window.empty() || left_ <= chance) return;
  products_ /= left_ * left_;
  robust_excess_ /= left_ * left_;
}

void LampPixels::add_to(PoseNormalEquations& normal) {
  sums_ = sums();
  add_own_priors(state_, sums_);
  add_order_prior(inverse_square(order_sigma_), sums_);
  const Eliminated own = eliminate(sums_);
  own.add_to(normal, 1);
  normal.robust_chi2 += own.chi2 + robust_excess_;
  normal.pixels += count_ - (std::isfinite(lamp_.light_sigma) ? 1 : 2);
  if (!lamp_.window.empty()) move_own(own.step);
}

void LampPixels::exchange_emission_prior(PoseNormalEquations& normal) const {
  eliminate(sums_).add_to(normal, -1);
  Sums free = sums_;
  add_order_prior(inverse_square(free_order_sigma_) - inverse_square(order_sigma_), free);
  eliminate(free).add_to(normal, 1);
}

LampPixels::Eliminated LampPixels::eliminate(const Sums& all) {
  const Eigen::Matrix<double, 6, 6> own = all.block<6, 6>(own_light, own_light);
  const core::Ldlt<Eigen::Matrix<double, 6, 6>> solver(own);
  const Eigen::Matrix<double, 6, 7> to_pose = all.block<6, 7>(own_light, 0);
  const Eigen::Matrix<double, 6, 1> to_rest = all.block<6, 1>(own_light, rest);
  const Eigen::Matrix<double, 6, 1> step = solver.solve(to_rest);
  Eliminated result;
  result.information = all.topLeftCorner<7, 7>();
  result.information.noalias() -= to_pose.transpose() * solver.solve(to_pose);
  result.pull = all.block<7, 1>(0, rest) - to_pose.transpose() * step;
  result.chi2 = all(rest, rest) - to_rest.dot(step);
  result.step = step.head<4>();
  return result;
}

void LampPixels::Eliminated::add_to(PoseNormalEquations& normal, double sign) const {
  constexpr int factor = log_factor_index;
  normal.information.topLeftCorner<6, 6>() += sign * information.topLeftCorner<6, 6>();
  normal.information.block<6, 1>(0, factor) += sign * information.block<6, 1>(0, log_factor);
  normal.information.block<1, 6>(factor, 0) += sign * information.block<1, 6>(log_factor, 0);
  normal.information(factor, factor) += sign * information(log_factor, log_factor);
  normal.gradient.head<6>() -= sign * pull.head<6>();
  normal.gradient[factor] -= sign * pull[log_factor];
  normal.chi2 += sign * chi2;
}

Eigen::Matrix2d LampPixels::centroid_information() const {
  const Sums all = sums();
  const Eigen::Matrix2d own = all.block<2, 2>(own_light, own_light);
  const Eigen::Matrix2d mixed = all.block<2, 2>(own_light, own_x);
  return all.block<2, 2>(own_x, own_x) - mixed.transpose() * own.inverse() * mixed;
}

double LampPixels::light_information() const {
  const double mixed = products_(light, background);
  return products_(light, light) - mixed * mixed / products_(background, background);
}

}  // namespace occ::internal::refine
