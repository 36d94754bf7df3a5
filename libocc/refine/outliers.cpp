// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/outliers.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"

namespace occ::internal::refine {
namespace {

constexpr double chance = 1e-3;
const double chi2_limit = -2 * std::log(chance);  // two degrees of freedom

/// Smallest eigenvalue of C - J S J^T, relative to C, at which the other lamps still check a lamp.
constexpr double min_redundancy = 1e-6;

/// Decrease of chi-square without the lamp; 0 if the other lamps cannot check it.
double drop_without(const RefineProblem::CentroidResidual& centroid,
                    const core::Ldlt<Matrix8>& information) {
  const Eigen::Matrix2d covariance = centroid.covariance_px2();
  const Eigen::Matrix<double, 8, 2> by_pose = centroid.jacobian.transpose();
  const Eigen::Matrix2d left = covariance - centroid.jacobian * information.solve(by_pose);
  if (!(left.determinant() > min_redundancy * covariance.determinant())) return 0;
  return centroid.residual_px.dot(left.inverse() * centroid.residual_px);
}

}  // namespace

std::optional<std::size_t> contradicting_lamp(const Observations& observations,
                                              const RefineProblem& problem, const Minimum& minimum,
                                              int degrees_of_freedom) {
  const double chi2 = minimum.normal.chi2;
  if (!(chi2 > chi2_limit) || degrees_of_freedom <= 2) return std::nullopt;
  const core::Ldlt<Matrix8> information(minimum.normal.information);
  double largest = 0, second = 0;
  std::size_t worst = 0;
  for (std::size_t i = 0; i < observations.lamps.size(); ++i) {
    const LampObservation& lamp = observations.lamps[i];
    if (lamp.contradicts || !lamp.has_centroid) continue;
    const std::optional<RefineProblem::CentroidResidual> centroid =
        problem.centroid_residual(lamp, minimum.state, minimum.pivot);
    const double drop = centroid ? drop_without(*centroid, information) : 0;
    second = std::max(second, std::min(drop, largest));
    if (drop > largest) {
      largest = drop;
      worst = i;
    }
  }
  const double rest = std::max(chi2 - largest, 1e-12 * chi2);
  const int dof = degrees_of_freedom - 2;
  const double by_chance = std::pow(1 + largest / rest, -dof / 2.0);
  if (!(largest > chi2_limit && by_chance < chance)) return std::nullopt;
  // Another lamp explains the contradiction as well, as in four lamps where any one may be wrong.
  if (largest - second < chi2_limit * std::max(1.0, rest / dof)) return std::nullopt;
  return worst;
}

void leave_out_false_rims(const State& state, Observations& observations) {
  constexpr double far_px = 4, far = 0.1;  // over the size of the image
  if (observations.shared_errors.count() > 0) return;
  for (LampObservation& lamp : observations.lamps) {
    if (lamp.has_centroid || !lamp.has_rim() || lamp.errors) continue;
    const LampInCam in_cam = lamp_in_cam(*lamp.lamp, state.cam_from_world);
    const std::vector<double> distances = rim_distances_px(in_cam, lamp, observations);
    double squares = 0;
    for (const double distance : distances) squares += square(distance);
    const auto points = static_cast<double>(lamp.rim_end - lamp.rim_begin);
    const double limit_px = far_px + far * lamp.blob->ellipse.semi_major_px;
    lamp.contradicts =
        static_cast<double>(distances.size()) < points || !(std::sqrt(squares / points) < limit_px);
  }
}

}  // namespace occ::internal::refine
