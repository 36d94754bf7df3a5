// SPDX-License-Identifier: Apache-2.0
// A camera's response curve from photographs of the same still scene with several exposure times.
//
//     g(Z_ij) = ln E_i + ln t_j        Z: stored level, E: light on patch i, t: exposure time
//
// with g = ln f^-1 and f the response (Debevec, Malik, "Recovering high dynamic range radiance maps
// from photographs", SIGGRAPH 1997, eq (2), (3)). The scale of light is arbitrary: g is 0 at the
// middle level.
//
// `levels`: g at every level of 8-bit images, or at 256 levels of deeper images: every level near
// black, then at intervals that grow with the square root of the signal. Between these levels, g is
// linear in u = ln(Z - black), which is exact for power laws. Least squares with the hat weights of
// eq (3) first, then with the noise estimated from the pixels. The smoothness term is
//     lambda^2 integral (w(Z) d^2 g / du^2)^2 du,       w: the hat,
// as in eq (3), but in u. It is zero for power laws; for other curves, the prior expects the
// exponent to change by about 1/lambda while the signal changes by a factor e. The prior is part of
// the covariance, so sigmas grow where no level was observed.
//
// `basis`: f is a mean curve plus a few functions (radiometry/response_basis.hpp), for two or three
// exposures. The covariance assumes that f is such a curve; if not, the variance factor exceeds 1.
//
// i runs over patches of 5 x 5 pixels that are uniform up to noise, without black or clipped
// pixels, distributed over brightness and image area. The same images give the same patches.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ {

/// Models of the curve.
enum class ResponseMethod {
  levels,  ///< any curve; requires three exposure times
  basis,   ///< curve with a few coefficients; requires two exposure times
};

/// Options of recover_response().
struct LIBOCC_API ResponseOptions {
  ResponseMethod method = ResponseMethod::levels;  ///< `basis` for two exposure times
  double black_level_dn = 0;                       ///< stored level without light
  int bit_depth = 0;                               ///< 8 to 16; 0: 8, only for 8-bit images
  double smoothness = 1;    ///< lambda, at least 1: with less, the curve follows the noise
  int basis_functions = 3;  ///< 1 to 8
  int max_patches = 1000;   ///< flat patches per channel, at least 16

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Residual of one patch in one image.
struct ResponseResidual {
  int exposure = 0;                              ///< index of the image
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< centre of the patch
  double level_dn = 0;                           ///< mean of its pixels
  double log_exposure = 0;                       ///< ln E + ln t, in the scale of the curve
  double residual = 0;                           ///< g(level) - log_exposure
  double sigma = 0;  ///< standard deviation of the residual, from the pixels' noise
};

/// The curve of one channel.
struct LIBOCC_API ChannelResponse {
  /// Stored levels without light and at saturation.
  double black_level_dn = 0, full_scale_dn = 255;
  Eigen::VectorXd level_dn;  ///< (n) ascending, from above black to full scale
  Eigen::VectorXd
      log_exposure;  ///< (n) g, made non-decreasing by projection where noise requires it
  Eigen::MatrixXd
      covariance;     ///< (n, n) of log_exposure before the projection; includes variance_factor
  int projected = 0;  ///< number of levels that the projection changed; basis: 1 for any
  double lowest_dn = 0, highest_dn = 0;     ///< observed levels; extrapolated beyond
  std::vector<double> coefficients;         ///< basis; empty for `levels`
  Eigen::MatrixXd coefficient_covariance;   ///< covariance of the coefficients
  double chi2 = 0;                          ///< sum of squared normalised residuals
  int dof = 0;                              ///< observations less unknowns
  double variance_factor = 1;               ///< 1 unless chi2 exceeds its 99.9 % quantile
  std::vector<ResponseResidual> residuals;  ///< one for each used patch and image

  Eigen::VectorXd sigma() const;  ///< (n) standard deviation of log_exposure

  /// Stored values, 0 (black) to 1 (full scale), at evenly spaced linear values; strictly rising,
  /// for Sensor::response_table. Throws std::invalid_argument unless 2 <= samples <= 65536.
  std::vector<double> table(int samples = 1024) const;
};

/// Response of a camera.
struct RecoveredResponse {
  std::vector<ChannelResponse> channels;  ///< in the images' order; a fourth channel is ignored
};

/// Recovers the response of each channel. Status:
/// - ok; if the residuals exceed their sigmas (wrong exposure times, a moving scene), the message
/// and
///   the variance factor report it.
/// - degenerate: two images show different scenes, or a channel's curve is not determined (too few
/// different exposure times, too few flat
///   patches that are neither black nor clipped in two images, or a gap in the observed levels).
/// - not_converged: no convergence, or a `basis` curve that decreases between observed levels.
/// The message names the cause; the value holds the channels before the failed one. Throws
/// std::invalid_argument for fewer than two images, images that differ in size, channels or type,
/// another number of exposure times, a time that is not positive, 16-bit images without a bit
/// depth, pixel values above it, or invalid options.
LIBOCC_API Result<RecoveredResponse> recover_response(const std::vector<ImageView>& images,
                                                      const std::vector<double>& exposures_s,
                                                      const ResponseOptions& options = {});

/// Sensor with the recovered response, black level and bit depth, for simulate() and detect(). One
/// channel becomes the sensor's response_table. Three channels (red, green, blue, the order of
/// read_image()) become those of its colour channels; the sensor must have a mosaic. Throws
/// std::invalid_argument for another number of channels or a missing mosaic.
LIBOCC_API Sensor with_response(Sensor sensor, const RecoveredResponse& response,
                                int samples = 1024);

}  // namespace occ
