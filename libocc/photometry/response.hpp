// SPDX-License-Identifier: Apache-2.0
// A camera's response curve from photographs of the same still scene with several exposure times.
//
//     g(Z_ij) = ln E_i + ln t_j        Z: stored level, E: light on place i, t: exposure time
//
// with g = ln f^-1, f the response (Debevec, Malik, "Recovering high dynamic range radiance maps
// from photographs", SIGGRAPH 1997, eq (2), (3)). Light has no scale here: g is 0 at the middle
// level.
//
// `levels`: g at every level of 8-bit images; at 256 levels of deeper ones, every one near black
// and at distances that grow with the square root of the signal. Between them, and for the mean of
// a place's pixels, g is linear in u = ln(Z - black), which is exact for power laws. Least squares
// first by eq (3)'s hat weights, then by the noise that the pixels show. Smoothness is
//     lambda^2 integral (w(Z) d^2 g / du^2)^2 du,       w: the hat,
// that of eq (3) but for u: it leaves power laws as they are, and says of others that their
// exponent changes by about 1/lambda in an e-fold of signal. As a prior it is part of the
// covariance, which is why sigmas grow where nothing was seen.
//
// `basis`: f is the mean curve plus a few functions (radiometry/response_basis.hpp): for two or
// three exposures. That f is one of these curves is not part of the covariance; where it is not,
// the variance factor shows it.
//
// Places are squares of 5 x 5 pixels that are flat but for noise, none of their pixels black or
// clipped, spread over light and image; the same images give the same places.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ {

enum class ResponseMethod {
  levels,  ///< any curve; takes three exposure times
  basis,   ///< a curve of a few coefficients; takes two
};

struct LIBOCC_API ResponseOptions {
  ResponseMethod method = ResponseMethod::levels;
  double black_level_dn = 0;  ///< stored level without light
  int bit_depth = 0;          ///< 8 to 16; 0: 8 for 8-bit images, which deeper ones do not know
  double smoothness = 1;      ///< lambda, at least 1: softer curves follow the noise
  int basis_functions = 3;    ///< 1 to 8
  int max_places = 1000;      ///< per channel, at least 16

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// One place in one image: what is left of its equation.
struct ResponseResidual {
  int exposure = 0;                              ///< index of the image
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< middle of the place
  double level_dn = 0;                           ///< mean of its pixels
  double log_exposure = 0;                       ///< ln E + ln t, in the scale of the curve
  double residual = 0;                           ///< g(level) - log_exposure
  double sigma = 0;                              ///< of the residual, by the pixels' noise
};

/// The curve of one channel.
struct LIBOCC_API ChannelResponse {
  double black_level_dn = 0, full_scale_dn = 255;
  Eigen::VectorXd level_dn;      ///< (n) rising, from above black to full scale
  Eigen::VectorXd log_exposure;  ///< (n) g; not falling: where noise made it fall it was projected
  Eigen::MatrixXd covariance;    ///< (n, n) of log_exposure before that; contains variance_factor
  int projected = 0;             ///< levels that the projection moved; of a basis, 1 for any
  double lowest_dn = 0, highest_dn = 0;    ///< levels seen; beyond them the curve is extrapolated
  std::vector<double> coefficients;        ///< of the basis; empty for `levels`
  Eigen::MatrixXd coefficient_covariance;  ///< theirs
  double chi2 = 0;                         ///< of the residuals
  int dof = 0;
  double variance_factor = 1;  ///< 1 unless chi2 is too large to be chance
  std::vector<ResponseResidual> residuals;

  Eigen::VectorXd sigma() const;  ///< of log_exposure

  /// Stored values, 0 (black) to 1 (full scale), at evenly spaced linear ones: strictly rising, for
  /// Sensor::response_table. 2 <= samples <= 65536.
  std::vector<double> table(int samples = 1024) const;
};

struct RecoveredResponse {
  std::vector<ChannelResponse> channels;  ///< in the order of the images' (a fourth is left out)
};

/// Status: ok, also when the residuals are larger than their sigmas allow (exposure times that are
/// wrong, a scene that moved), which the message and the variance factor say; degenerate when the
/// series does not determine the curve of every channel: too few different exposure times, too few
/// places that are flat and neither black nor clipped in two images, levels that no place bridges;
/// not_converged when the steps come to no end, or `basis` in a curve that falls among the levels
/// seen. The message says which, the value holds the
/// channels before. Throws std::invalid_argument for fewer than two images, images that differ in
/// size, channels or type, another number of exposure times, one that is not positive, 16-bit
/// images without a bit depth, pixels beyond it, or options that do not validate.
LIBOCC_API Result<RecoveredResponse> recover_response(const std::vector<ImageView>& images,
                                                      const std::vector<double>& exposures_s,
                                                      const ResponseOptions& options = {});

/// The sensor with the recovered response, as simulate() and detect() take it: of one channel as
/// its response_table; of three (blue, green, red, as read_image() has them) as its channels',
/// which takes a sensor with a mosaic. Black level and bit depth are the response's. Throws
/// std::invalid_argument for another number of channels or when a mosaic is missing.
LIBOCC_API Sensor with_response(Sensor sensor, const RecoveredResponse& response,
                                int samples = 1024);

}  // namespace occ
