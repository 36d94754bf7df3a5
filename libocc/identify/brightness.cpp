// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/brightness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/radiometry/lambertian.hpp"

namespace occ::internal::identify {
namespace {

constexpr double max_chi2_of_one =
    9;  // bound of one term of chi-square (3 sigma): a lamp may be dirty or half hidden
// Twice the log likelihood ratio of a measured flux, between its lamp and a background that is
// uniform in log flux over three decades.
constexpr double log_ratio_of_one = 5;

struct Residual {
  double log_ratio = 0;  // logarithm of measured over predicted value
  double sigma = 0;
  bool at_most = false;  // the measured value is a lower bound of the true one
  double chi2(double log_gain) const {
    const double off = (log_ratio - log_gain) / sigma;
    return at_most && off < 0 ? 0 : std::min(off * off, max_chi2_of_one);
  }
};

// Returns nothing when the blob's flux or the lamp's power is unknown.
std::optional<Residual> flux_residual(const AssignmentProblem& problem, const Pair& pair,
                                      const Rigid3& pose) {
  const BearingObservation& s = problem.observation(pair.observation);
  const MapPoint& t = problem.map_point(pair.map_point);
  if (!(s.flux > 0)) return std::nullopt;
  const Eigen::Vector3d point = pose * t.centre;
  const double distance = point.norm();
  const double cos_emission = -(pose.rotation * t.normal).dot(point) / distance;
  const double cos_incidence = problem.camera->depth_m(point) / distance;
  const double light =
      t.measured ? t.measured->aperture_power(t.power_w, -(pose.rotation.transpose() * point),
                                              cos_emission, cos_incidence, distance, 1)
                 : aperture_power(t.power_w, t.order, cos_emission, cos_incidence, distance, 1);
  if (!(light > 0)) return std::nullopt;
  const double model = problem.options->light_sigma;
  return Residual{
      std::log(s.flux / light),
      std::sqrt(t.power_sigma * t.power_sigma + s.flux_sigma * s.flux_sigma + model * model),
      s.flux_is_bound || !t.steady};
}

// The major axis of a disc's image is radius over distance; the minor axis is shorter by the cosine
// of the viewing angle.
void add_sizes(const AssignmentProblem& problem, const Pair& pair, const Rigid3& pose,
               std::vector<Residual>& sizes) {
  constexpr double min_cosine = 0.2;
  const BearingObservation& s = problem.observation(pair.observation);
  const MapPoint& t = problem.map_point(pair.map_point);
  if (!t.disc || !(s.radius_rad > 0)) return;
  const Eigen::Vector3d point = pose * t.centre;
  const double distance = point.norm();
  const double cosine = -(pose.rotation * t.normal).dot(point) / distance;
  sizes.push_back(
      {std::log(size_ratio(s, t, distance)), std::hypot(s.radius_sigma, t.size_sigma), false});
  if (cosine > min_cosine)
    sizes.push_back({std::log(s.flatness / cosine), s.radius_sigma * (1 + 1 / cosine), false});
}

double sum(const std::vector<Residual>& residuals, double log_gain) {
  double chi2 = 0;
  for (const Residual& r : residuals) chi2 += r.chi2(log_gain);
  return chi2;
}

// Minimises the robust chi-square over the gain. Starts from the gain that makes the best single
// residual vanish, then averages the residuals that agree with it.
double common_log_gain(const std::vector<Residual>& fluxes) {
  double best = 0, min_chi2 = std::numeric_limits<double>::infinity();
  const auto consider = [&](double log_gain) {
    const double chi2 = sum(fluxes, log_gain);
    if (chi2 < min_chi2) min_chi2 = chi2, best = log_gain;
  };
  for (const Residual& r : fluxes) consider(r.log_ratio);
  for (int round = 0; round < 3; ++round) {
    double weights = 0, weighted = 0;
    for (const Residual& r : fluxes) {
      const double off = (r.log_ratio - best) / r.sigma;
      if (off * off >= max_chi2_of_one || (r.at_most && off < 0)) continue;
      weights += 1 / (r.sigma * r.sigma);
      weighted += r.log_ratio / (r.sigma * r.sigma);
    }
    if (weights > 0) consider(weighted / weights);
  }
  return best;
}

bool touches(const std::vector<Pair>& pairs, int observation) {
  return std::any_of(pairs.begin(), pairs.end(),
                     [&](const Pair& p) { return p.observation == observation; });
}

bool share_blobs(const PoseHypothesis& a, const PoseHypothesis& b) {
  return std::any_of(a.pairs.begin(), a.pairs.end(),
                     [&](const Pair& p) { return touches(b.pairs, p.observation); });
}

}  // namespace

Brightness brightness_of(const AssignmentProblem& problem, const PoseHypothesis& e) {
  std::vector<Residual> fluxes, sizes;
  for (const Pair& pair : e.pairs) {
    if (const auto flux = flux_residual(problem, pair, e.estimate.pose)) fluxes.push_back(*flux);
    add_sizes(problem, pair, e.estimate.pose, sizes);
  }
  const auto measured = static_cast<int>(
      std::count_if(fluxes.begin(), fluxes.end(), [](const Residual& r) { return !r.at_most; }));
  Brightness b;
  b.residuals = static_cast<int>(sizes.size()) + std::max(measured - 1, 0);
  if (measured > 0) {
    b.log_gain = common_log_gain(fluxes);
    double information = 0;
    for (const Residual& r : fluxes)
      if (!r.at_most && r.chi2(b.log_gain) < max_chi2_of_one)
        information += 1 / (r.sigma * r.sigma);
    b.gain_sigma = 1 / std::sqrt(information);
  } else {
    fluxes.clear();
  }
  b.chi2 = sum(fluxes, b.log_gain) + sum(sizes, 0);
  b.fits = b.residuals > 0 && variance_factor(b.chi2, b.residuals) == 1;
  return b;
}

double log_flux_ratio(const AssignmentProblem& problem, const PoseHypothesis& e) {
  constexpr double log_range = 7, of_one_kind = 0.5;
  std::vector<Residual> fluxes, equal_fluxes;
  double peak = 0, most = -std::numeric_limits<double>::infinity();
  for (const Pair& pair : e.pairs) {
    const auto flux = flux_residual(problem, pair, e.estimate.pose);
    if (!flux) continue;
    fluxes.push_back(*flux);
    equal_fluxes.push_back(*flux);
    equal_fluxes.back().log_ratio += std::log(problem.map_point(pair.map_point).power_w);
    if (flux->at_most) continue;
    const double of_one = std::log(log_range / (std::sqrt(2 * pi) * flux->sigma));
    peak += of_one;
    most = std::max(most, of_one);
  }
  if (!std::isfinite(most)) return 0;
  peak -= most;  // determines the gain
  const auto log_of = [&](const std::vector<Residual>& residuals) {
    return peak - 0.5 * sum(residuals, common_log_gain(residuals));
  };
  return log_of(fluxes) - std::log(1 - of_one_kind + of_one_kind * std::exp(log_of(equal_fluxes)));
}

void rank_by_brightness(const AssignmentProblem& problem, std::vector<PoseHypothesis>& found) {
  if (found.empty() || !problem.options->use_brightness) return;
  int max_residuals = 0;
  bool applies = false;
  for (PoseHypothesis& e : found) {
    e.brightness = brightness_of(problem, e);
    max_residuals = std::max(max_residuals, e.brightness.residuals);
    applies = applies || (e.brightness.fits && e.pairs.size() == found.front().pairs.size());
  }
  if (!applies || found.size() < 2) return;
  for (PoseHypothesis& e : found)
    e.chi2 += e.brightness.chi2 + log_ratio_of_one * (max_residuals - e.brightness.residuals);
  std::stable_sort(
      found.begin(), found.end(),
      [](const PoseHypothesis& a, const PoseHypothesis& b) { return a.chi2 < b.chi2; });
}

bool is_brighter(const Brightness& strong, const Brightness& weak) {
  constexpr double min_log_ratio = 0.1, sigmas = 3;
  return strong.fits && weak.gain_sigma > 0 &&
         strong.log_gain - weak.log_gain >
             min_log_ratio + sigmas * std::hypot(strong.gain_sigma, weak.gain_sigma);
}

int drop_reflections(const AssignmentProblem& problem, std::vector<PoseHypothesis>& found) {
  if (!problem.options->use_brightness) return 0;
  const std::vector<PoseHypothesis> all = found;
  found.erase(std::remove_if(found.begin(), found.end(),
                             [&](const PoseHypothesis& weak) {
                               return std::any_of(
                                   all.begin(), all.end(), [&](const PoseHypothesis& strong) {
                                     return !share_blobs(weak, strong) &&
                                            is_brighter(strong.brightness, weak.brightness);
                                   });
                             }),
              found.end());
  return static_cast<int>(all.size() - found.size());
}

std::optional<AssignmentProblem> brighter_remainder(const AssignmentProblem& problem,
                                                    const PoseHypothesis& e) {
  constexpr std::size_t min_blobs = 4;
  if (!problem.options->use_brightness || problem.observations.size() < e.pairs.size() + min_blobs)
    return std::nullopt;
  std::vector<double> used_fluxes, other_fluxes;
  AssignmentProblem rest = problem;
  rest.observations.clear();
  rest.allowed.clear();
  for (int s = 0; s < static_cast<int>(problem.observations.size()); ++s) {
    const double flux = problem.observation(s).flux;
    const bool used = touches(e.pairs, s);
    if (flux > 0) (used ? used_fluxes : other_fluxes).push_back(flux);
    if (used) continue;
    rest.observations.push_back(problem.observation(s));
    const auto row = problem.allowed.begin() +
                     static_cast<std::ptrdiff_t>(s * static_cast<int>(problem.map_points.size()));
    rest.allowed.insert(rest.allowed.end(), row,
                        row + static_cast<std::ptrdiff_t>(problem.map_points.size()));
  }
  if (other_fluxes.size() < min_blobs || used_fluxes.empty() ||
      median(other_fluxes) <= median(used_fluxes))
    return std::nullopt;
  return rest;
}

}  // namespace occ::internal::identify
