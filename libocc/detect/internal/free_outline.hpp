// SPDX-License-Identifier: Apache-2.0
// Internal: outline of a lamp of any shape, such as a Lame curve or a polygon that is not convex.
//
// The border of the pixels above a level is followed from pixel to pixel. Where it leaves a row or
// a column, the level is interpolated between two pixels. Around each of these crossings, a
// parabola through its neighbours gives the direction and the curvature of the outline. Crossings
// near corners are not used: there the blur of an edge is not that of a straight or evenly bent
// one.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

class FreeOutline {
 public:
  /// Outline at a level, of the region around the component's brightest pixel. Empty if that is
  /// small compared with the component. `blur_px`: sigma of the edges.
  static std::optional<FreeOutline> trace(const Patch& patch, const Component& component,
                                          double level, double blur_px);

  /// Rows and columns that cross the outline at a steep angle, away from corners.
  std::vector<RimLine> lines() const;

  /// Replaces the crossings of lines() by points that were measured on them, in their order; empty
  /// where nothing was measured. Fits directions and curvatures, and measures the area, anew.
  void replace(const std::vector<std::optional<RimPoint>>& points, double blur_px);

  /// The points of the last replace() with the normals of the outline, and the sum of the squares
  /// of their distances from it over their variances.
  struct Fitted {
    std::vector<RimPoint> points;
    double chi2 = 0, dof = 0;
  };
  Fitted fitted() const;

  /// Computes depth_px(), for the level of trace().
  void measure_depths(const Patch& patch, double level, double blur_px);

  /// Distance inside the nearest edge (also that of a hole), negative outside. Exact up to a few
  /// sigmas of the blur; infinite farther inside.
  double depth_px(int x, int y) const { return depth_px_[at(x, y)]; }

  double area_px2() const { return area_px2_; }
  const Eigen::Vector2d& centroid_px() const { return centroid_px_; }  ///< centroid of the area
  const Eigen::Matrix2d& second_moments_px2() const { return second_moments_px2_; }  ///< central
  double reach_px() const { return reach_px_; }  ///< distance of the farthest point from there
  /// Covariance of the centroid by the noise of the fitted points; unmeasured parts of the outline
  /// are uncertain by a part of a pixel.
  Eigen::Matrix2d centroid_covariance_px2() const;

  bool is_convex() const { return is_convex_; }

 private:
  struct Crossing {
    Eigen::Vector2d px;
    RimLine line{};
    Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // unit, out of the lamp; zero: no fit
    double curvature = 0;                              // [1/px], positive where convex
    double off_px = 0;                                 // of the fit, along the normal
    double leverage = 1;                               // of this crossing in the fit
    double sigma_px = 0;                               // zero: not measured
    bool usable = true;                                // away from corners and the patch's border
    int part = 0;                                      // corners separate the parts of the outline

    bool has_line() const;
  };

  FreeOutline(const Patch& patch, std::vector<char> inside)
      : x0_(patch.x0()), y0_(patch.y0()), width_(patch.width()), inside_(std::move(inside)) {}

  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y - y0_) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x - x0_);
  }
  bool contains(const Patch& patch, int x, int y) const {
    return patch.contains(x, y) && inside_[at(x, y)];
  }
  Crossing crossing(const Patch& patch, double level, int x, int y, int direction) const;
  void follow(const Patch& patch, double level);
  void measure_area(const std::vector<Eigen::Vector2d>& outline);
  void leave_out_corners(double blur_px);
  void fit_parabolas(double blur_px);
  bool fit_parabola(std::size_t k, double reach_px, Crossing& out) const;

  int x0_, y0_, width_;
  std::vector<char> inside_;
  std::vector<float> depth_px_;
  std::vector<Crossing> crossings_;  // clockwise in the image (y down)
  double area_px2_ = 0, perimeter_px_ = 0, reach_px_ = 0;
  Eigen::Vector2d centroid_px_ = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second_moments_px2_ = Eigen::Matrix2d::Zero();
  bool is_convex_ = true;
};

}  // namespace occ::internal::detect
