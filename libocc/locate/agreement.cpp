// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/agreement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::locate {

using namespace internal::pose;
namespace {

// Number of pixels of other points within the radius, averaged over the first inliers.
double neighbours(const Eigen::Matrix2Xd& pixels, double radius_px,
                  const std::vector<Agreement>& inliers, std::size_t count) {
  constexpr std::size_t enough = 64;
  const std::size_t stride = count / enough + 1;
  const double radius2 = radius_px * radius_px;
  int within = 0, places = 0;
  for (std::size_t k = 0; k < count; k += stride, ++places) {
    const Eigen::Vector2d place = pixels.col(inliers[k].point);
    for (Eigen::Index i = 0; i < pixels.cols(); ++i) {
      const double dx = pixels(0, i) - place.x(), dy = pixels(1, i) - place.y();
      within += dx * dx + dy * dy < radius2;
    }
  }
  return std::max(0.0, static_cast<double>(within) / places - 1);  // without itself
}

// Radius of `count` inliers, sorted by residual. Least squares over k points leaves the share
// (2 k - 6) / (2 k) of their variance. Residuals below sigma do not add to the significance: few
// wrong points fit some of many poses that well.
double radius_of(const std::vector<Agreement>& inliers, std::size_t count, double sigma_px) {
  const auto k = static_cast<double>(count);
  const double unbiased = std::sqrt(k / std::max(k - 3, 0.5));
  return std::max(sigma_px, unbiased * inliers[count - 1].residual_px);
}

// Point without which the others are nearest to a line. Its distance from the line through all
// points does not show it: a point beyond the ends of a row turns that line towards itself.
Eigen::Index point_off_line(const Eigen::Matrix3Xd& points) {
  const auto count = static_cast<double>(points.cols());
  const Eigen::Vector3d middle = points.rowwise().mean();
  const Eigen::Matrix3Xd centred = points.colwise() - middle;
  const Eigen::Matrix3d scatter = centred * centred.transpose();
  Eigen::Index best = 0;
  double smallest = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d arm = centred.col(i);
    const Eigen::Matrix3d rest = scatter - count / (count - 1) * arm * arm.transpose();
    const auto eigen = core::symmetric_eigen<Eigen::Matrix3d>(rest, Eigen::EigenvaluesOnly);
    const double height2 = eigen.eigenvalues().head<2>().sum();
    if (height2 < smallest) {
      smallest = height2;
      best = i;
    }
  }
  return best;
}

}  // namespace

FalseAlarmModel chance_anywhere(const Eigen::Matrix2Xd& pixels, double radius_px, int sample,
                                int poses) {
  const Eigen::Vector2d size = pixels.rowwise().maxCoeff() - pixels.rowwise().minCoeff();
  const double area = std::max(size.x(), 2 * radius_px) * std::max(size.y(), 2 * radius_px);
  return {static_cast<int>(pixels.cols()), sample, poses, pi * radius_px * radius_px / area};
}

Significance significance(const Eigen::Matrix2Xd& pixels, std::vector<Agreement> inliers,
                          double sigma_px, int sample, int poses) {
  constexpr double next_radius = 0.5;
  std::sort(inliers.begin(), inliers.end(), [](const Agreement& a, const Agreement& b) {
    return a.residual_px != b.residual_px ? a.residual_px < b.residual_px : a.point < b.point;
  });
  Significance best{std::numeric_limits<double>::infinity(), 0};
  for (std::size_t count = inliers.size(); static_cast<int>(count) > sample;) {
    const double radius_px = radius_of(inliers, count, sigma_px);
    FalseAlarmModel chance = chance_anywhere(pixels, radius_px, sample, poses);
    const double close = neighbours(pixels, radius_px, inliers, count);
    chance.probability = std::max(chance.probability, close / (chance.points - 1));
    chance.points = static_cast<int>(std::ceil(chance.points / (1 + close)));
    const auto agree = static_cast<int>(static_cast<double>(count) / (1 + close));
    const double log_alarms = log_false_alarms(chance, agree);
    best.log_false_alarms = std::min(best.log_false_alarms, log_alarms);
    if (count == inliers.size()) best.radius_px = radius_px;
    const double limit_px = next_radius * inliers[count - 1].residual_px;
    while (count > 0 && !(inliers[count - 1].residual_px < limit_px)) --count;
  }
  return best;
}

bool rests_on_a_line(const Eigen::Matrix3Xd& points, const std::vector<int>& inliers, double sigmas,
                     const FalseAlarmModel& chance, double most) {
  constexpr int sample = 1, poses = 2;  // one point determines two rotations about the line
  Eigen::Matrix3Xd left = points(Eigen::all, inliers);
  const auto agree = static_cast<int>(inliers.size());
  for (int off = 0; off < agree - 2; ++off) {
    const FalseAlarmModel turns{chance.points - (agree - off), sample, poses, chance.probability};
    if (log_false_alarms(turns, off) <= std::log(most)) return false;
    if (sigmas * height_over_line(left) < min_seen_height) return true;
    left.col(point_off_line(left)) = left.rightCols<1>();
    left.conservativeResize(Eigen::NoChange, left.cols() - 1);
  }
  return false;
}

}  // namespace occ::internal::locate
