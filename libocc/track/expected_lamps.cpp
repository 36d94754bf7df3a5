// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/internal/expected_lamps.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/internal/derivative_by_pose.hpp"
#include "libocc/geometry/motion.hpp"
#include "libocc/scene/internal/lamp_colours.hpp"
#include "libocc/scene/view.hpp"

namespace occ::internal::track {
namespace {

/// Margin of a window around a lamp's image and gate, for blur and background.
constexpr double margin_px = 16;
/// Minimum width of a window over that of the lamp, so that it contains background.
constexpr double widths = 2.5;
/// Minimum cosine of the angle from its normal at which a lamp must be detected.
constexpr double sure_cos = 0.1;

double max_sigma(const Eigen::Matrix2d& covariance) {
  const double half = covariance.trace() / 2, d = covariance.determinant();
  return std::sqrt(half + std::sqrt(std::max(0.0, half * half - d)));
}

/// Returns the longest time for which a lamp is dark; 0 for one that does not blink.
double longest_dark_s(const Lamp& lamp) {
  if (!lamp.frequency_hz) return 0;
  if (lamp.waveform.empty()) return (1 - lamp.duty) / *lamp.frequency_hz;
  const std::size_t n = lamp.waveform.size();
  std::size_t run = 0, longest = 0;
  for (std::size_t i = 0; i < 2 * n; ++i) {  // twice, because the waveform is periodic
    run = lamp.waveform[i % n] > 0 ? 0 : run + 1;
    longest = std::max(longest, run);
  }
  return static_cast<double>(std::min(longest, n)) / (static_cast<double>(n) * *lamp.frequency_hz);
}

/// Returns half the extent of a disc's image along an image axis; d_axis: derivative of that image
/// coordinate by the disc's centre.
double reach_px(const Eigen::Vector3d& d_axis, const Eigen::Vector3d& normal, double radius_m) {
  const double across = d_axis.dot(normal);
  return radius_m * std::sqrt(std::max(0.0, d_axis.squaredNorm() - across * across));
}

/// Returns true if a blob has fewer lines than its lamp, which was switched while it was read out.
bool lacks_lines(const ExpectedLamp& lamp, const Blob& blob, Readout readout) {
  constexpr double blur_px = 2.5, share = 0.1;
  if (!lamp.cut) return false;
  const int lines = readout == Readout::columns ? blob.x1 - blob.x0 + 1 : blob.y1 - blob.y0 + 1;
  return lines < lamp.lines_px * (1 - share) - blur_px;
}

/// Standard deviation of the shear of a rim that follows from the error of the velocity.
double shear_px(const Blob& blob, const Sensor& sensor, const Eigen::Matrix2d& per_s2) {
  const bool columns = sensor.readout == Readout::columns;
  const int lines = columns ? blob.x1 - blob.x0 + 1 : blob.y1 - blob.y0 + 1;
  return max_sigma(per_s2) * sensor.row_time_s * lines / 2;
}

/// Standard deviation of the shape of a rim, averaged over its points.
double rim_noise_px(const Blob& blob) {
  double information = 0;
  for (const RimPoint& point : blob.rim) information += 1 / (point.sigma_px * point.sigma_px);
  return information > 0 ? std::sqrt(2 / information) : 0;
}

std::optional<ExpectedLamp> expect(const Scene& scene, const Lamp& lamp,
                                   const PredictedCamera& predicted, double model_sigma_px) {
  const Eigen::Vector3d eye = predicted.cam_from_world.origin_in_source();
  const Eigen::Vector3d to_camera = eye - lamp.centre_m;
  if (!lamp.shows_lit_side(eye) || hidden_by_box(scene.boxes, lamp.centre_m, eye))
    return std::nullopt;
  Eigen::Vector3d point = predicted.cam_from_world * lamp.centre_m;
  Eigen::Matrix<double, 2, 3> d_point;
  std::optional<Eigen::Vector2d> px = scene.camera.project(point, &d_point);
  if (!px) return std::nullopt;
  const double delay_s = readout_delay_s(scene.sensor, *px);
  if (delay_s > 0 && !predicted.velocity.isZero(0)) {
    point = moved_pose(predicted.cam_from_world, predicted.velocity, delay_s) * lamp.centre_m;
    px = scene.camera.project(point, &d_point);
    if (!px) return std::nullopt;
  }
  const Eigen::Matrix<double, 2, 6> d_pose = geometry::derivative_by_pose(d_point, point);
  ExpectedLamp out;
  out.px = *px;
  out.covariance_px2 = d_pose * predicted.covariance * d_pose.transpose();
  out.covariance_px2.diagonal().array() += model_sigma_px * model_sigma_px;
  out.radius_px = lamp.reach_m() * d_point.norm();
  const bool by_columns = scene.sensor.readout == Readout::columns;
  out.lines_px = 2 * reach_px(d_point.row(by_columns ? 0 : 1),
                              predicted.cam_from_world.rotation * lamp.normal, lamp.reach_m());
  const double dark_s = longest_dark_s(lamp);
  const double read_s = scene.sensor.exposure_s + out.lines_px * scene.sensor.row_time_s;
  out.dark = dark_s >= read_s;
  out.cut = dark_s > scene.sensor.exposure_s && scene.sensor.row_time_s > 0;
  out.smear_px = (d_pose * predicted.velocity).norm() * scene.sensor.exposure_s;
  out.sure = lamp.normal.dot(to_camera) > sure_cos * to_camera.norm() && !out.dark;
  return out;
}

bool frequencies_agree(const Lamp& lamp, const Blob& blob) {
  if (!lamp.frequency_hz || !blob.frequency_hz) return true;
  constexpr double tolerance = 0.02, sigmas = 4;  // those of identify()
  return std::abs(*blob.frequency_hz - *lamp.frequency_hz) <=
         tolerance * *lamp.frequency_hz + sigmas * blob.frequency_sigma_hz;
}

/// True if a blob may be the lamp, as it was in the images before.
bool is_alike(const ExpectedLamp& lamp, const Blob& blob) {
  // Within a second a lamp's distance and angle change its contrast by less: 1 m/s towards a lamp
  // at 2 m by four. A faint step of the background has a fiftieth.
  constexpr double max_fading = 8, max_growth = 16;
  if (!lamp.before || blob.cut_by_border) return true;
  const LampLook now = look_of(blob, 0);
  const double width_px = std::sqrt(std::max(1.0, lamp.before->area_px));
  const double smeared = 1 + lamp.smear_px / width_px;
  return now.contrast_dn * max_fading * smeared >= lamp.before->contrast_dn &&
         (blob.saturated || now.area_px <= max_growth * smeared * lamp.before->area_px);
}

struct Pair {
  double chi2;
  int expected, blob;
};

std::vector<Pair> pairs_within(const std::vector<ExpectedLamp>& expected,
                               const std::vector<Blob>& blobs, const Scene& scene,
                               double gate_sigma, bool any_look = false) {
  std::vector<Pair> pairs;
  const scene::ColourTest colours(scene.lamps);
  for (std::size_t e = 0; e < expected.size(); ++e) {
    const Lamp& lamp = scene.lamps[expected[e].lamp];
    for (std::size_t b = 0; b < blobs.size(); ++b) {
      const Blob& blob = blobs[b];
      if (blob.lamp_id ? *blob.lamp_id != lamp.id : !frequencies_agree(lamp, blob)) continue;
      if (!any_look && !is_alike(expected[e], blob)) continue;
      if (colours.contradicts(expected[e].lamp, blob)) continue;
      const Eigen::Vector2d off = scene.camera.difference_px(blob.centroid_px, expected[e].px);
      const Eigen::Matrix2d covariance = expected[e].covariance_px2 + blob.covariance_px2;
      const double chi2 = off.dot(core::solve_llt(covariance, off));
      // The centroid of a lamp that the border cuts is displaced by up to its radius.
      const double slack = blob.cut_by_border ? expected[e].radius_px / max_sigma(covariance) : 0;
      if (std::sqrt(chi2) <= gate_sigma + slack)
        pairs.push_back({chi2, static_cast<int>(e), static_cast<int>(b)});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tie(a.chi2, a.expected, a.blob) < std::tie(b.chi2, b.expected, b.blob);
  });
  return pairs;
}

}  // namespace

double readout_delay_s(const Sensor& sensor, const Eigen::Vector2d& px) {
  const double line = sensor.readout == Readout::columns ? px.x() : px.y();
  return sensor.exposure_s / 2 + std::max(0.0, line) * sensor.row_time_s;
}

std::vector<ExpectedLamp> expected_lamps(const Scene& scene, const PredictedCamera& predicted,
                                         double gate_sigma, double model_sigma_px) {
  std::vector<ExpectedLamp> out;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    std::optional<ExpectedLamp> lamp = expect(scene, scene.lamps[i], predicted, model_sigma_px);
    if (!lamp) continue;
    const double reach = lamp->radius_px + gate_sigma * max_sigma(lamp->covariance_px2);
    const double inside = border_distance_px(scene.camera, lamp->px);
    if (inside < -reach) continue;
    lamp->sure = lamp->sure && inside > reach;
    lamp->lamp = static_cast<int>(i);
    out.push_back(*lamp);
  }
  return out;
}

std::vector<PixelWindow> windows_of(const std::vector<ExpectedLamp>& expected, const Camera& camera,
                                    double gate_sigma) {
  const Eigen::Array2d last(camera.width() - 1, camera.height() - 1);
  std::vector<PixelWindow> windows;
  for (const ExpectedLamp& lamp : expected) {
    const double gate = gate_sigma * max_sigma(lamp.covariance_px2);
    const double half = std::max(lamp.radius_px + gate + margin_px, widths * lamp.radius_px);
    const Eigen::Array2d low = (lamp.px.array() - half).floor().max(0);
    const Eigen::Array2d high = (lamp.px.array() + half).ceil().min(last);
    windows.push_back({static_cast<int>(low.x()), static_cast<int>(low.y()),
                       static_cast<int>(high.x()), static_cast<int>(high.y())});
  }
  return windows;
}

LampLook look_of(const Blob& blob, double time_s) {
  return {time_s, blob.peak_dn - blob.background_dn, static_cast<double>(blob.area_px)};
}

void adapt_looks(std::vector<ExpectedLamp>& expected, const std::vector<Blob>& blobs,
                 const Scene& scene, double gate_sigma) {
  constexpr std::size_t min_lamps = 3;
  std::vector<double> ratios;
  std::vector<char> done(expected.size());
  for (std::size_t e = 0; e < expected.size(); ++e)
    if (scene.lamps[expected[e].lamp].frequency_hz) expected[e].before.reset();
  for (const Pair& pair : pairs_within(expected, blobs, scene, gate_sigma, true)) {
    const auto e = static_cast<std::size_t>(pair.expected);
    if (std::exchange(done[e], 1) || !expected[e].before) continue;
    const double contrast_dn = look_of(blobs[static_cast<std::size_t>(pair.blob)], 0).contrast_dn;
    ratios.push_back(contrast_dn / expected[e].before->contrast_dn);
  }
  if (ratios.size() < min_lamps) return;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  for (ExpectedLamp& lamp : expected) {
    if (!lamp.before) continue;
    lamp.before->contrast_dn *= *middle;
    lamp.before->area_px *= std::max(1.0, *middle);  // more of its edge is above the threshold
  }
}

std::vector<Match> match_expected(const std::vector<ExpectedLamp>& expected,
                                  const std::vector<Blob>& blobs, const Scene& scene,
                                  double gate_sigma) {
  constexpr double unlike = 4;  // chi-square by which the second blob must be worse
  const std::vector<Pair> pairs = pairs_within(expected, blobs, scene, gate_sigma);
  std::vector<char> taken(expected.size()), used(blobs.size());
  std::vector<Match> matches;
  for (const Pair& pair : pairs) {
    const auto e = static_cast<std::size_t>(pair.expected), b = static_cast<std::size_t>(pair.blob);
    if (taken[e] || used[b]) continue;
    taken[e] = 1;
    const bool undecided = std::any_of(pairs.begin(), pairs.end(), [&](const Pair& other) {
      return other.expected == pair.expected && other.blob != pair.blob && !used[other.blob] &&
             other.chi2 < pair.chi2 + unlike;
    });
    if (undecided || blobs[b].merged) continue;
    if (lacks_lines(expected[e], blobs[b], scene.sensor.readout)) continue;
    used[b] = 1;
    matches.push_back({expected[e].lamp, pair.blob});
  }
  std::sort(matches.begin(), matches.end(),
            [](const Match& a, const Match& b) { return a.lamp < b.lamp; });
  return matches;
}

double mean_delay_s(const Sensor& sensor, const std::vector<Match>& matches,
                    const std::vector<Blob>& blobs) {
  double sum_s = 0;
  for (const Match& match : matches)
    sum_s += readout_delay_s(sensor, blobs[match.blob].centroid_px);
  return matches.empty() ? 0 : sum_s / static_cast<double>(matches.size());
}

void to_time_of(const PredictedCamera& predicted, const Scene& scene,
                const std::vector<Match>& matches, std::vector<Blob>& blobs) {
  if (scene.sensor.row_time_s == 0) return;
  for (const Match& match : matches) {
    const Eigen::Vector3d& lamp = scene.lamps[match.lamp].centre_m;
    Blob& blob = blobs[match.blob];
    const double late_s = readout_delay_s(scene.sensor, blob.centroid_px) - predicted.after_s;
    const Eigen::Vector3d point = predicted.cam_from_world * lamp;
    Eigen::Matrix<double, 2, 3> d_point;
    const auto then = scene.camera.project(point, &d_point);
    const auto seen = scene.camera.project(
        moved_pose(predicted.cam_from_world, predicted.velocity, late_s) * lamp);
    if (!then || !seen) continue;
    const Eigen::Matrix<double, 2, 6> d_pose = geometry::derivative_by_pose(d_point, point);
    const Eigen::Vector2d by = scene.camera.difference_px(*then, *seen);
    // The lines of a rim are read before or after the middle, which shears a moving disc's image.
    const Eigen::Vector2d px_per_s = d_pose * predicted.velocity;
    for (RimPoint& on_rim : blob.rim) {
      const double later_s = readout_delay_s(scene.sensor, on_rim.px) -
                             readout_delay_s(scene.sensor, blob.centroid_px);
      on_rim.px += by - later_s * px_per_s;
    }
    blob.centroid_px += by;
    blob.ellipse.centre_px += by;
    const Eigen::Matrix2d per_s2 = d_pose * predicted.velocity_covariance * d_pose.transpose();
    const Eigen::Matrix2d error = late_s * late_s * per_s2;
    blob.covariance_px2 += error;
    blob.rim_covariance_px2.block<2, 2>(1, 1) += error;
    if (shear_px(blob, scene.sensor, per_s2) > rim_noise_px(blob)) blob.rim.clear();
  }
}

}  // namespace occ::internal::track
