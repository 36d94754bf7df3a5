// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/normal_table.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/plateau.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr double window_sigmas = 3;  // half width of a profile [sigma of the blur]
constexpr int max_rim_passes = 6;
constexpr double settled_px = 0.005;  // convergence limit for centre, size and blur
constexpr double min_blur_px = 0.3, max_blur_px = 4;
constexpr double max_misfit = 0.05;  // rms residual of the profiles beyond noise, over the plateau
constexpr double min_minor_px = 3;   // as min_rim_px in measure.cpp

/// Geometric mean of the semi-axes.
double size_of(const FittedConic& conic) { return std::pow(conic.shape.determinant(), -0.25); }

/// Model of the rim's profile.
struct Model {
  Plateau plateau;
  Noise noise;
  double blur_px = 0;
};

/// Fits one rim point on each line, and sums the residuals of all profiles.
class Profiles {
 public:
  Profiles(const Patch& patch, const Model& model, const Eigen::Vector2d& centre)
      : patch_(patch),
        model_(model),
        centre_(centre),
        dim_(std::max(5 * std::sqrt(model.noise.floor), 0.05 * model.plateau.level())) {}

  void add(const RimLine& line) {
    // Along the line the edge is wider by 1 / cosine, and displaced by the rim's curvature.
    const double blur = model_.blur_px / line.cosine();
    const double edge = line.edge + displacement(line);
    const int low = static_cast<int>(std::ceil(edge - window_sigmas * blur));
    const int high = static_cast<int>(std::floor(edge + window_sigmas * blur));
    if (!line.inside(patch_, low, high)) return;
    const double chord = line.outward * (line.edge - line.opposite);
    const bool both_edges = chord < 2 * window_sigmas * blur;
    const float* pixel = line.pixel(patch_, low);
    const std::ptrdiff_t step = line.step(patch_);
    const Eigen::Vector2d normal = line.normal();
    const Eigen::Vector2d rim = line.point(line.edge);
    // Blur also transports light along the plateau's slope.
    const double carried = model_.blur_px * model_.plateau.gradient(rim.x(), rim.y()).dot(normal);
    Sums sums;
    for (int along = low; along <= high; ++along, pixel += step) {
      const double z = line.outward * (along - edge) / blur;
      if (z > 2 && *pixel > dim_) return;  // another light source is too close
      const NormalTable::Value at_z = table_(z);
      double cover = 1 - at_z.below;
      if (both_edges) cover -= 1 - table_(z + chord / blur).below;
      const Eigen::Vector2d at = line.point(along);
      const double level = model_.plateau(at.x(), at.y());
      sums.add(*pixel, level, level * cover - carried * at_z.density, z, at_z.density,
               model_.noise);
      sums.by_level += at_z.density * cover;
    }
    if (!(sums.weight > 0)) return;
    const double shift = blur * sums.shift / sums.weight;
    const double sigma = blur * std::sqrt(sums.variance) / sums.weight;
    points.push_back({line.point(line.edge + line.outward * shift), normal, sigma * line.cosine()});
    const double by_own_level = -model_.blur_px * sums.by_level / sums.weight;
    by_gradient.push_back(by_own_level * (rim - level_depth * model_.blur_px * normal - centre_) +
                          square(model_.blur_px) / model_.plateau.level() * normal);
    by_level += by_own_level;
    total += sums;
  }

  /// Relative change of the blur that minimises the residuals.
  double blur_change() const { return total.blur / total.blur_weight; }

  /// Root mean square residual of the profiles beyond noise, relative to the plateau.
  double misfit() const {
    return std::sqrt(std::max(0.0, total.misfit - total.expected) / total.light);
  }

  std::vector<RimPoint> points;
  std::vector<Eigen::Vector2d>
      by_gradient;      ///< d shift / d gradient of the plateau, for each point
  double by_level = 0;  ///< sum of d shift / d level of the plateau

 private:
  struct Sums {
    double shift = 0, weight = 0, variance = 0, by_level = 0;  // weighted by the edge's derivative
    double blur = 0, blur_weight = 0;
    double misfit = 0, expected = 0, light = 0;

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

  const Patch& patch_;
  const Model& model_;
  const Eigen::Vector2d centre_;
  const double dim_;  ///< max signal on the dark side of an edge
  const NormalTable& table_ = NormalTable::get();
  Sums total;
};

/// Noise of the patch. The shot noise is estimated from the plateau's scatter if no sensor is
/// given, or if the scatter is more than twice that of the sensor (texture).
Noise noise_of(const Patch& patch, const Plateau& plateau) {
  Noise noise = patch.noise();
  const double measured = (plateau.variance() - noise.floor) / plateau.level();
  if (!noise.known || measured > 2 * noise.per_dn) noise.per_dn = std::max(0.0, measured);
  return noise;
}

/// Adds the errors of the estimated plateau. An error of its level enlarges the whole rim, an error
/// of its gradient shifts the points of opposite sides in the same direction, and an error of its
/// curvature stretches the rim.
void add_plateau_noise(const Model& model, const Profiles& profiles, Rim& rim) {
  const double pixel_variance = model.noise.variance(model.plateau.level());
  const Eigen::Matrix2d response = centre_response(rim.points, rim.fit.conic, profiles.by_gradient);
  const double growth = profiles.by_level / static_cast<double>(rim.points.size());
  if (model.plateau.uniform()) rim.light_response_px2 = -model.plateau.level() * response;
  rim.common_covariance_px2(0, 0) =
      growth * growth * pixel_variance * model.plateau.rim_level_variance();
  const Eigen::Matrix2d shift =
      pixel_variance * response * model.plateau.gradient_covariance() * response.transpose();
  rim.common_covariance_px2.block<2, 2>(1, 1) = shift;
  rim.common_covariance_px2.bottomRightCorner<2, 2>() =
      growth * growth * pixel_variance * model.plateau.rim_stretch_covariance();
  rim.fit.centre_covariance_px2 += shift;
}

}  // namespace

void align_normals(Rim& rim) {
  for (RimPoint& point : rim.points)
    point.normal = (rim.fit.conic.shape * (point.px - rim.fit.conic.centre)).normalized();
}

void inflate_sigmas(Rim& rim) {
  const double dof = std::max(1, rim.fit.dof);
  const double excess = rim.fit.chi2 / dof - std::sqrt(2 / dof);
  if (!(excess > 1)) return;
  for (RimPoint& point : rim.points) point.sigma_px *= std::sqrt(excess);
  rim.fit.centre_covariance_px2 *= excess;
  rim.common_covariance_px2 *= excess;
  rim.fit.chi2 /= excess;
}

std::optional<Rim> measure_rim(const Patch& patch, const Component& component, double blur_px) {
  const std::optional<Outline> outline =
      find_outline(patch, component, 0.5 * weighted_mean_signal(patch, component));
  if (!outline) return std::nullopt;
  Rim rim;
  rim.merged = outline->merged;
  if (rim.merged) return rim;
  FittedConic conic = outline->conic;
  rim.blur_px = blur_px;
  for (int pass = 0; pass < max_rim_passes; ++pass) {
    if (conic.ellipse().semi_minor_px < min_minor_px) return std::nullopt;
    const std::optional<Plateau> plateau = Plateau::fit(patch, conic, rim.blur_px);
    if (!plateau || !(plateau->level() > 0)) return std::nullopt;
    const Model model{*plateau, noise_of(patch, *plateau), rim.blur_px};
    Profiles profiles(patch, model, conic.centre);
    for_each_rim_line(conic, [&](const RimLine& line) { profiles.add(line); });
    const std::optional<EllipseFit> fit = fit_ellipse(profiles.points, conic);
    if (!fit) return std::nullopt;
    const double blur = rim.blur_px * (1 + std::clamp(profiles.blur_change(), -0.4, 0.6));
    const bool settled = (fit->conic.centre - conic.centre).norm() < settled_px &&
                         std::abs(size_of(fit->conic) - size_of(conic)) < settled_px &&
                         std::abs(blur - rim.blur_px) < settled_px;
    conic = fit->conic;
    rim.fit = *fit;
    rim.points = std::move(profiles.points);
    if (settled) {
      if (profiles.misfit() > max_misfit) return std::nullopt;
      align_normals(rim);
      add_plateau_noise(model, profiles, rim);
      inflate_sigmas(rim);
      return rim;
    }
    rim.blur_px = std::clamp(blur, min_blur_px, max_blur_px);
  }
  return std::nullopt;
}

}  // namespace occ::internal::detect
