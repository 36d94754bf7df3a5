// SPDX-License-Identifier: Apache-2.0
// Evidence for a pose: the logarithm of the probability of the blobs if some of them are lamps seen
// from near the pose, over their probability if all of them are false lights.
//
// Model. An image of area A has B blobs, m of which are lamps. The c = B - m others are false
// lights: independent, anywhere in the image, in a number with the probability
// P(c) = 1 / ((c + 1)(c + 2)), which leaves their rate open. n of the n + u lamps that should be
// visible are seen, and the rate of dark lamps has a Beta prior. A seen lamp's centroid is normal
// with the residual r, the stated covariance S and the derivative J by the pose x; the pose has the
// density p(x). Then
//
//     evidence = [P(c) c! / (P(B) B!)] A^m  B(a + u, b + n) / B(a, b)
//                integral of p(x) prod N(r + J x; S) dx,
//
// times the ratio of the densities of sizes, fluxes and codes. The integral is that of a Gaussian
// (Laplace's method; MacKay, "Information theory, inference, and learning algorithms", 2003, eqs.
// (28.4) to (28.10)): (2 pi)^3 |H|^(-1/2) e^(-chi2/2) at the minimum, with the information matrix
// H. Its width over that of p(x) counts the poses that were open, so three lamps alone are no
// evidence.
//
// p(x) is a wide Gaussian of the variances of a uniform rotation (or of the share of the rotations
// that show lamps) and a uniform position in a volume, times the prior and the shapes of rims,
// normalised. Shapes limit the distances and the tilt, but do not count as evidence: other lamps of
// the same kind have the same shapes. Each part of a prior may be wrong and is ignored with its own
// probability.
//
// Errors of camera and map are common and of unknown size: the evidence is the mean over several
// standard deviations of them, multiples of a typical one (model_sigma_px). From four lamps on, one
// of them contains a relative error of the sizes that all lamps share, as in a map of housings
// whose lit parts are smaller. Of three lamps, only the sizes tell the poses apart.
//
// If all blobs are false lights, the expected sum of e^evidence over all poses is one. So it
// exceeds 1 / q with a probability of at most q (Markov's inequality): the risk is honest for
// images without lamps, however many poses were tried.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::pose {

/// A lamp and its blob at a pose.
struct SeenLamp {
  Eigen::Vector2d residual_px;          ///< predicted minus measured centroid
  Eigen::Matrix2d covariance_px2;       ///< covariance of the measured centroid
  Eigen::Matrix<double, 2, 6> by_pose;  ///< derivative of the residual
  /// Derivative of the residual by a relative error of all sizes; zero for a centroid.
  Eigen::Vector2d by_size = Eigen::Vector2d::Zero();
  /// Residuals of the shape of its rim [px], their derivative, and their standard deviation without
  /// errors of camera and map; infinite without a rim.
  Eigen::Vector3d shape_residual_px = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 6> shape_by_pose = Eigen::Matrix<double, 3, 6>::Zero();
  double shape_sigma_px = infinity;
  /// Derivative of the shape's residual by a relative error of all sizes: the shape [px].
  Eigen::Vector3d shape_by_size = Eigen::Vector3d::Zero();
};

/// A part of a prior at a pose, such as a height.
struct PriorPart {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double chi2 = 0;
  double wrong = 1e-4;  ///< probability that it is wrong
  /// The camera is elsewhere if it is wrong; there no lamp counts as missed.
  bool is_place = false;
};

struct PoseEvidence {
  std::vector<SeenLamp> lamps;
  /// Corners of these lamps, relative to their centroids. log_appearance contains their density if
  /// the blobs are false lights.
  std::vector<SeenLamp> corners;
  std::vector<PriorPart> prior;
  double image_px2 = 0;         ///< area in which blobs are found
  int blobs = 0;                ///< blobs that could be lamps
  int missed = 0;               ///< lamps that should be visible but have no blob
  double volume_m3 = 0;         ///< inverse of the density of the camera's position
  double rotations = 1;         ///< share of all rotations that can show lamps in the image
  double model_sigma_px = 0.5;  ///< typical error of camera and map if they are not calibrated well
  double log_appearance = 0;    ///< ln of the density ratio of sizes, fluxes and codes
};

struct LogEvidence {
  double value = -infinity;  ///< ln of the evidence
  /// ln of the part of the evidence in which a part of the prior is wrong: the evidence of a pose
  /// that the prior excluded, if there is one. `if_place_wrong` is that of a part with is_place,
  /// `if_prior_wrong` that of any other.
  double if_prior_wrong = -infinity, if_place_wrong = -infinity;

  /// ln of the evidence of a pose that the prior excluded and that is not among the rivals.
  /// `places_listed`: those at other places are.
  double if_excluded(bool places_listed) const {
    return places_listed ? if_prior_wrong : std::max(if_prior_wrong, if_place_wrong);
  }
};

/// -infinity without lamps.
LIBOCC_API LogEvidence log_evidence(const PoseEvidence& pose);

/// Evidence of poses with the same assignment, in their order. They share one normalised p(x): a
/// pose that its shapes contradict has less evidence than one that they fit.
LIBOCC_API std::vector<LogEvidence> log_evidences(
    const std::vector<PoseEvidence>& poses_of_one_assignment);

/// ln of the determinant of a positive definite matrix.
LIBOCC_API double log_determinant(const Matrix6& matrix);

/// Probabilities of poses with these log evidences, and last of "none of these", whose log evidence
/// is `log_none` (0: the blobs are as likely false lights as not, before they are compared).
LIBOCC_API std::vector<double> probabilities(const std::vector<double>& log_evidences,
                                             double log_none = 0);

}  // namespace occ::internal::pose
