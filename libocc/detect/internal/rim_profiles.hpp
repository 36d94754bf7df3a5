// SPDX-License-Identifier: Apache-2.0
// Internal: rim points from the profiles of image rows and columns across a rim, see subpixel.hpp.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/normal_table.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/plateau.hpp"

namespace occ::internal::detect {

inline constexpr double min_blur_px = 0.3, max_blur_px = 4;
/// Max root mean square residual of the profiles beyond noise, over the plateau.
inline constexpr double max_misfit = 0.05;

/// Model of a rim's profile.
struct RimModel {
  Plateau plateau;
  Noise noise;
  double blur_px = 0;
  bool own_level = false;  ///< estimate the level of each profile: the plateau is textured
};

/// Fits one rim point on each line, and sums the residuals of all profiles.
class RimProfiles {
 public:
  /// `glow`: the light just outside the rim is measured on each line, such as that of a bezel or a
  /// halo. Otherwise a line with light there is left out: another source is too close.
  RimProfiles(const Patch& patch, const RimModel& model, const Eigen::Vector2d& centre,
              bool glow = false)
      : patch_(patch),
        model_(model),
        centre_(centre),
        glow_(glow),
        dim_(std::max(5 * std::sqrt(model.noise.floor), 0.05 * model.plateau.level())) {}

  void add(const RimLine& line) {
    add(line, [](double) { return EdgeShare(); });
  }

  /// `share(along)`: the EdgeShare that other edges nearby leave at a place on the line.
  template <typename Share>
  void add(const RimLine& line, const Share& share) {
    // Along the line the edge is wider by 1 / cosine, and displaced by the rim's curvature.
    const double blur = model_.blur_px / line.cosine();
    const double edge = line.edge + displacement(line);
    const int low = static_cast<int>(std::ceil(edge - window_sigmas * blur));
    const int high = static_cast<int>(std::floor(edge + window_sigmas * blur));
    if (!line.inside(patch_, low, high)) return;
    const double chord = line.outward * (line.edge - line.opposite);
    const bool both_edges = chord < 2 * window_sigmas * blur;
    double outside = 0;
    if (glow_) {
      const std::optional<double> level = level_outside(line, edge, blur);
      if (!level) return;
      outside = *level;
    }
    const float* pixel = line.pixel(patch_, low);
    const std::ptrdiff_t step = line.step(patch_);
    const Eigen::Vector2d normal = line.normal();
    const Eigen::Vector2d rim = line.point(line.edge);
    // Blur also transports light along the plateau's slope.
    const double carried = share(line.edge).share * model_.blur_px *
                           model_.plateau.gradient(rim.x(), rim.y()).dot(normal);
    Sums sums;
    for (int along = low; along <= high; ++along, pixel += step) {
      const double z = line.outward * (along - edge) / blur;
      if (z > 2 && *pixel - outside > dim_) {  // another light source is too close
        ++dazzled;
        return;
      }
      const NormalTable::Value at_z = table_(z);
      double cover = 1 - at_z.below;
      if (both_edges) cover -= 1 - table_(z + chord / blur).below;
      const Eigen::Vector2d at = line.point(along);
      const EdgeShare beside = share(along);
      const double plateau = model_.plateau(at.x(), at.y());
      const double level = beside.share * plateau - outside;
      const double model = level * cover + (beside.mixed * plateau - carried) * at_z.density;
      sums.add(*pixel - outside, level, model, z, at_z.density, model_.noise);
      if (model_.own_level)
        sums.add_level(*pixel - outside, level, model, z, at_z.density, model_.noise);
      sums.by_level += at_z.density * cover;
    }
    if (model_.own_level) sums.remove_level();
    if (!(sums.weight > 0)) return;
    const double shift = blur * sums.shift / sums.weight;
    const double sigma = blur * std::sqrt(sums.variance) / sums.weight;
    points.push_back({line.point(line.edge + line.outward * shift), normal, sigma * line.cosine()});
    const double by_own_level = -model_.blur_px * sums.by_level / sums.weight;
    by_gradient.push_back(by_own_level * (rim - level_depth * model_.blur_px * normal - centre_) +
                          square(model_.blur_px) / model_.plateau.level() * normal);
    by_level += by_own_level;
    slopes2 += square(carried / model_.plateau(rim.x(), rim.y()));
    total_ += sums;
  }

  /// Relative change of the blur that minimises the residuals.
  double blur_change() const { return total_.blur / total_.blur_weight; }

  /// Root mean square residual of the profiles beyond noise, relative to the plateau.
  double misfit() const {
    return std::sqrt(std::max(0.0, total_.misfit - total_.expected) / total_.light);
  }

  std::vector<RimPoint> points;
  std::vector<Eigen::Vector2d>
      by_gradient;      ///< d shift / d gradient of the plateau, for each point
  double by_level = 0;  ///< sum of d shift / d level of the plateau
  double slopes2 = 0;   ///< sum of squares of the plateau's change across the blur, over its level
  int dazzled = 0;      ///< lines that were left out because of light outside the rim

 private:
  struct Sums {
    double shift = 0, weight = 0, variance = 0, by_level = 0;  // weighted by the edge's derivative
    double blur = 0, blur_weight = 0;
    double misfit = 0, expected = 0, light = 0;
    // Products with the model, for a level of its own.
    double model_residual = 0, model_density = 0, model_slope = 0, model2 = 0, model_blur = 0;
    double variance_mixed = 0, variance_model = 0;

    void add(double signal, double level, double model, double z, double density,
             const Noise& noise) {
      const double residual = signal - model;
      const double pixel_variance = noise.variance(model);
      shift += density * residual;
      weight += density * density * level;
      variance += density * density * pixel_variance;
      const double by_blur = level * density * z;
      blur += by_blur * residual;
      blur_weight += by_blur * by_blur;
      misfit += residual * residual;
      expected += pixel_variance;
      light += level * level;
    }

    /// Adds what remove_level() needs.
    void add_level(double signal, double level, double model, double z, double density,
                   const Noise& noise) {
      const double pixel_variance = noise.variance(model);
      model_residual += model * (signal - model);
      model_density += model * density;
      model_slope += model * density * level;
      model2 += model * model;
      model_blur += level * density * z * model;
      variance_mixed += density * model * pixel_variance;
      variance_model += model * model * pixel_variance;
    }

    /// Makes shift, blur and misfit independent of a factor of the model.
    void remove_level() {
      if (!(model2 > 0)) return;
      const double share = model_density / model2;
      shift -= share * model_residual;
      weight -= share * model_slope;
      variance += share * (share * variance_model - 2 * variance_mixed);
      by_level = 0;
      const double factor = model_residual / model2;
      misfit = std::max(0.0, misfit - factor * model_residual);
      blur -= factor * model_blur;
      blur_weight -= square(model_blur) / model2;
    }

    Sums& operator+=(const Sums& other) {
      blur += other.blur;
      blur_weight += other.blur_weight;
      misfit += other.misfit;
      expected += other.expected;
      light += other.light;
      return *this;
    }
  };

  /// Displacement of the blurred edge of a curved rim. The offsets that blur of sigma s adds have
  /// mean bend s^2/2 and third moment 3 slope^2 bend s^4. Under a weight as wide as the edge
  /// itself, the third moment shifts the edge by minus a sixth of it over the sum of both
  /// variances.
  double displacement(const RimLine& line) const {
    const double slope2 = square(line.slope);
    return 0.5 * line.bend * square(model_.blur_px) * (1 - slope2 / (2 * (1 + slope2)));
  }

  /// Mean level from 2.5 to 5 sigmas outside the edge; empty if it varies by more than a quarter of
  /// the plateau, or if there are no pixels.
  std::optional<double> level_outside(const RimLine& line, double edge, double blur) const {
    constexpr double from_sigmas = 2.5, to_sigmas = 5, max_variation = 0.25;
    const double a = edge + line.outward * from_sigmas * blur;
    const double b = edge + line.outward * to_sigmas * blur;
    const int low = static_cast<int>(std::ceil(std::min(a, b)));
    const int high = static_cast<int>(std::floor(std::max(a, b)));
    if (low > high || !line.inside(patch_, low, high)) return std::nullopt;
    const float* pixel = line.pixel(patch_, low);
    double sum = 0, darkest = infinity, brightest = -infinity;
    for (int along = low; along <= high; ++along, pixel += line.step(patch_)) {
      sum += *pixel;
      darkest = std::min<double>(darkest, *pixel);
      brightest = std::max<double>(brightest, *pixel);
    }
    if (brightest - darkest > max_variation * model_.plateau.level()) return std::nullopt;
    return sum / (high - low + 1);
  }

  const Patch& patch_;
  const RimModel& model_;
  const Eigen::Vector2d centre_;
  const bool glow_;
  const double dim_;  ///< max signal on the dark side of an edge
  const NormalTable& table_ = NormalTable::get();
  Sums total_;
};

/// Noise of the patch. The shot noise is estimated from the plateau's scatter if no sensor is
/// given, or if the scatter is more than twice that of the sensor (texture).
inline Noise noise_of(const Patch& patch, const Plateau& plateau) {
  Noise noise = patch.noise();
  const double measured = (plateau.variance() - noise.floor) / plateau.level();
  if (!noise.known || measured > 2 * noise.per_dn) noise.per_dn = std::max(0.0, measured);
  return noise;
}

/// Adds the errors of rim and centre by a brightness that falls towards the rim, as of a lamp with
/// a bright middle. A slope there changes the profile of an edge in second order, which the model
/// of the profile ignores.
inline void add_uneven_light(const RimModel& model, const RimProfiles& profiles,
                             RimErrorCovariance& rim_px2, Eigen::Matrix2d& centre_px2) {
  const double slope2 = profiles.slopes2 / static_cast<double>(profiles.points.size());
  const double variance = square(model.blur_px * slope2);
  rim_px2.diagonal().array() += variance;
  centre_px2.diagonal().array() += variance;
}

/// The shift s that fits moves m_i of the points along their normals best, for a unit gradient in
/// x and y: minimises the sum of (n_i . s - m_i)^2.
inline Eigen::Matrix2d shift_response(const std::vector<RimPoint>& points,
                                      const std::vector<Eigen::Vector2d>& moves) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero(), right = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    normal += points[i].normal * points[i].normal.transpose();
    right += points[i].normal * moves[i].transpose();
  }
  normal.diagonal().array() += 1e-9 * normal.trace();  // all sides parallel
  return normal.inverse() * right;
}

/// Standard deviation of the growth of a rim whose edge is softer than the lens makes it, by the
/// growth of its blur. A diffuser or a bezel that dims towards the rim moves the edge inwards by
/// about as much; defocus does not, but looks the same.
inline double soft_growth_px(double blur_px, double lens_blur_px) {
  constexpr double certain = 1.2;  // times the lens' blur; it is not known better
  return std::sqrt(std::max(0.0, square(blur_px) - square(certain * lens_blur_px)));
}

/// Adds the errors of a soft edge: its growth, a stretch, and a shift. Blur of sigma s moves the
/// edge of a disc of radius R by s^2 / 2 R, and that of a motion differs between directions. A
/// gradient of the light, of a few percent across the lamp, moves soft edges of opposite sides
/// alike.
inline void add_softness(double growth_px, double size_px, RimErrorCovariance& rim_px2,
                         Eigen::Matrix2d& centre_px2) {
  constexpr double shift = 0.01;
  const double variance_px2 = square(shift * growth_px);
  rim_px2.diagonal().segment<2>(1).array() += variance_px2;
  centre_px2.diagonal().array() += variance_px2;
  rim_px2(0, 0) += square(growth_px);
  rim_px2.diagonal().tail<2>().array() += square(square(growth_px) / size_px);
}

/// Errors of a rim by those of the plateau. An error of its level enlarges the whole rim, an error
/// of its gradient shifts the points of opposite sides in the same direction, and an error of its
/// curvature stretches the rim. `growth`: of the rim per grey level; `response`: its shift per
/// gradient.
inline RimErrorCovariance plateau_errors(const RimModel& model, double growth,
                                         const Eigen::Matrix2d& response) {
  const double pixel_variance = model.noise.variance(model.plateau.level());
  RimErrorCovariance errors = RimErrorCovariance::Zero();
  errors(0, 0) = growth * growth * pixel_variance * model.plateau.rim_level_variance();
  errors.block<2, 2>(1, 1) =
      pixel_variance * response * model.plateau.gradient_covariance() * response.transpose();
  errors.bottomRightCorner<2, 2>() =
      growth * growth * pixel_variance * model.plateau.rim_stretch_covariance();
  return errors;
}

}  // namespace occ::internal::detect
