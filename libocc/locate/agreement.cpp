// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/agreement.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ::internal::locate {

using namespace internal::pose;
namespace {

// Number of pixels of other points within the gate, averaged over the inliers.
double neighbours(const Eigen::Matrix2Xd& pixels, double gate_px, const std::vector<int>& inliers) {
  constexpr std::size_t enough = 64;
  const std::size_t stride = inliers.size() / enough + 1;
  const double gate2 = gate_px * gate_px;
  int within = 0, places = 0;
  for (std::size_t k = 0; k < inliers.size(); k += stride, ++places) {
    const Eigen::Vector2d place = pixels.col(inliers[k]);
    for (Eigen::Index i = 0; i < pixels.cols(); ++i) {
      const double dx = pixels(0, i) - place.x(), dy = pixels(1, i) - place.y();
      within += dx * dx + dy * dy < gate2;
    }
  }
  return static_cast<double>(within) / places - 1;  // without itself
}

// Point farthest from the best-fitting line.
Eigen::Index furthest_from_line(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d middle = points.rowwise().mean();
  const Eigen::Matrix3Xd centred = points.colwise() - middle;
  const auto axes = core::symmetric_eigen<Eigen::Matrix3d>(centred * centred.transpose());
  const Eigen::Matrix<double, 3, 2> across = axes.eigenvectors().leftCols<2>();
  Eigen::Index furthest;
  (across.transpose() * centred).colwise().squaredNorm().maxCoeff(&furthest);
  return furthest;
}

}  // namespace

FalseAlarmModel chance_anywhere(const Eigen::Matrix2Xd& pixels, double gate_px, int sample,
                                int poses) {
  const Eigen::Vector2d size = pixels.rowwise().maxCoeff() - pixels.rowwise().minCoeff();
  const double area = std::max(size.x(), 2 * gate_px) * std::max(size.y(), 2 * gate_px);
  return {static_cast<int>(pixels.cols()), sample, poses, pi * gate_px * gate_px / area};
}

double log_false_alarms(FalseAlarmModel chance, const Eigen::Matrix2Xd& pixels, double gate_px,
                        const std::vector<int>& inliers) {
  const double close = neighbours(pixels, gate_px, inliers);
  chance.probability = std::max(chance.probability, close / (chance.points - 1));
  chance.points = static_cast<int>(std::ceil(chance.points / (1 + close)));
  const double agree = static_cast<double>(inliers.size()) / (1 + close);
  return log_false_alarms(chance, static_cast<int>(agree));
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
    left.col(furthest_from_line(left)) = left.rightCols<1>();
    left.conservativeResize(Eigen::NoChange, left.cols() - 1);
  }
  return false;
}

}  // namespace occ::internal::locate
