// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/line_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libocc/formation/rim.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace {

constexpr int line_rim_points = 16;

// In this file, x runs along a line and y counts the lines. Exchanges x and y if lines are columns.
Eigen::Vector2d transposed(const Eigen::Vector2d& px, bool columns) {
  return columns ? Eigen::Vector2d(px.y(), px.x()) : px;
}

// Lines that may see part of a lamp, the time in which they do, and the range of x.
struct LineRange {
  int first = std::numeric_limits<int>::max(), end = 0;
  double from_s = 0, to_s = 0;
  double low = std::numeric_limits<double>::infinity(), high = -low;
};

// Extent of the lamp's image at a time; low > high if it is not visible.
struct Extent {
  Eigen::Array2d low = Eigen::Array2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Array2d high = -low;
  void include(const Eigen::Array2d& a, const Eigen::Array2d& b) {
    low = low.min(a);
    high = high.max(b);
  }
};
Extent extent_at(const LineImageInput& input, double time_s, double reach_px) {
  Extent extent;
  const auto rim =
      project_rim(input.lamp, input.motion.pose_at(time_s), input.camera, line_rim_points);
  if (!rim) return extent;
  for (const Eigen::Vector2d& px : *rim) {
    const Eigen::Array2d at = transposed(px, input.motion.by_columns()).array();
    extent.include(at, at);
  }
  // Between two of its 16 points the rim extends farther, by 1 - cos(pi / 16) of its radius.
  const Eigen::Array2d margin = 0.02 * (extent.high - extent.low) + reach_px + 1;
  extent.low -= margin;
  extent.high += margin;
  return extent;
}

LineRange lines_that_see(const LineImageInput& input, double reach_px) {
  constexpr int samples = 64;
  const Motion& motion = input.motion;
  const double exposure = motion.exposure_s();
  const double whole = motion.line_begin_s(motion.lines() - 1) + exposure;
  std::vector<Extent> extents;
  for (int i = 0; i <= samples; ++i)
    extents.push_back(extent_at(input, whole * i / samples, reach_px));
  LineRange range;
  for (int line = 0; line < motion.lines(); ++line) {
    const double begin = motion.line_begin_s(line);
    const auto from = static_cast<std::size_t>(std::max(0.0, std::floor(begin / whole * samples)));
    const auto to = static_cast<std::size_t>(
        std::min<double>(samples, std::ceil((begin + exposure) / whole * samples)));
    Extent extent;
    for (std::size_t i = from; i <= to; ++i) extent.include(extents[i].low, extents[i].high);
    if (!(extent.low.y() <= line && line <= extent.high.y())) continue;
    if (range.end == 0) range.from_s = begin;
    range.first = std::min(range.first, line);
    range.end = line + 1;
    range.to_s = begin + exposure;
    range.low = std::min(range.low, extent.low.x());
    range.high = std::max(range.high, extent.high.x());
  }
  return range;
}

Patch empty_patch(const LineRange& range, int width) {
  const double x0 = std::max(0.0, std::floor(range.low));
  const double x1 = std::min(width - 1.0, std::ceil(range.high));
  if (range.first >= range.end || !(x0 <= x1)) return {};
  Patch patch{static_cast<int>(x0),
              range.first,
              static_cast<int>(x1 - x0) + 1,
              range.end - range.first,
              {}};
  patch.values.assign(
      static_cast<std::size_t>(patch.width) * static_cast<std::size_t>(patch.height), 0.0);
  return patch;
}

Patch transposed(const Patch& patch, bool columns) {
  if (!columns || patch.width == 0) return patch;
  Patch transposed{patch.y0, patch.x0, patch.height, patch.width, {}};
  for (int y = 0; y < transposed.height; ++y)
    for (int x = 0; x < transposed.width; ++x)
      transposed.values.push_back(patch.at(patch.x0 + y, patch.y0 + x));
  return transposed;
}

CoverageMoments transposed(const CoverageMoments& moments, bool columns) {
  if (!columns) return moments;
  return {transposed(moments.c, true), transposed(moments.m_y, true),
          transposed(moments.m_x, true)};
}

// Lagrange weights of the nodes 0, 1/3, 2/3, 1 at u.
using LagrangeWeights = std::array<double, 4>;
LagrangeWeights lagrange_weights(double u) {
  const double a = 3 * u, b = a - 1, c = a - 2, d = a - 3;
  return {-b * c * d / 6, a * c * d / 2, -a * b * d / 2, a * b * c / 6};
}

// Motion of the rim's points over the time in which lines see the lamp.
class RimTracks {
 public:
  static std::optional<RimTracks> follow(const LineImageInput& input, const LineRange& range) {
    RimTracks tracks(range);
    const Rigid3 middle = input.motion.pose_at(0.5 * (range.from_s + range.to_s));
    const auto rim = rim_contour(input.lamp, middle, input.camera, input.spacing_px);
    if (!rim) return std::nullopt;
    const bool columns = input.motion.by_columns();
    tracks.points_.resize(rim->size());
    for (std::size_t k = 0; k < 4; ++k) {
      const double time_s = range.from_s + static_cast<double>(k) / 3 * (range.to_s - range.from_s);
      const Rigid3 moved = input.motion.pose_at(time_s) * middle.inverse();
      for (std::size_t i = 0; i < rim->size(); ++i) {
        Eigen::Matrix<double, 2, 3> d_px;
        const auto px = input.camera.project(moved * (*rim)[i].point, &d_px);
        if (!px) return std::nullopt;
        const Eigen::Vector2d step = d_px * (moved.rotation * (*rim)[i].step);
        tracks.points_[i].px[k] = transposed(*px, columns);
        tracks.points_[i].dy[k] = transposed(step, columns).y();
      }
    }
    return tracks;
  }

  struct Point {
    std::array<Eigen::Vector2d, 4> px;
    std::array<double, 4> dy;

    double y(const LagrangeWeights& w) const {
      return w[0] * px[0].y() + w[1] * px[1].y() + w[2] * px[2].y() + w[3] * px[3].y();
    }
    double x(const LagrangeWeights& w) const {
      return w[0] * px[0].x() + w[1] * px[1].x() + w[2] * px[2].x() + w[3] * px[3].x();
    }
    double step_y(const LagrangeWeights& w) const {
      return w[0] * dy[0] + w[1] * dy[1] + w[2] * dy[2] + w[3] * dy[3];
    }
  };
  const std::vector<Point>& points() const { return points_; }
  LagrangeWeights at(double time_s) const {
    return lagrange_weights((time_s - from_s_) / (to_s_ - from_s_));
  }

  // Sign that makes coverage positive: a pixel right of the shape's left flank sees light.
  double orientation() const {
    double area = 0;
    for (const Point& p : points_) area += (p.px[0].x() - points_[0].px[0].x()) * p.dy[0];
    return area > 0 ? -1 : 1;
  }

 private:
  explicit RimTracks(const LineRange& range) : from_s_(range.from_s), to_s_(range.to_s) {}

  double from_s_, to_s_;
  std::vector<Point> points_;
};

// Adds the contribution of one contour point, or of one point of light, to one line.
class LinePainter {
 public:
  LinePainter(const PixelPsf& psf, CoverageMoments& steps) : psf_(psf), steps_(steps) {
    const auto size = static_cast<std::size_t>(psf.count()) + 1;
    for (auto* values : {&weights_, &moment_weights_, &across_, &moment_across_})
      values->resize(size);
  }

  bool reaches(int line, double y) const {
    const double touched = line - std::floor(y) + psf_.reach();
    return touched >= 0 && touched < psf_.count();
  }

  void paint_rim(int line, const Eigen::Vector2d& px, double dy) {
    const double y = std::floor(px.y()), x = std::floor(px.x());
    psf_.weights(px.y() - y, weights_.data());
    psf_.moment_weights(px.y() - y, moment_weights_.data());
    psf_.steps(px.x() - x, across_.data());
    psf_.moment_steps(px.x() - x, moment_across_.data());
    const auto k = static_cast<std::size_t>(line - static_cast<int>(y) + psf_.reach());
    const double weight = dy * weights_[k], moment_weight = dy * moment_weights_[k];
    // Steps left of the patch are added to its first column.
    each_column(line, x, psf_.count() + 1, true, [&](std::size_t at, std::size_t i) {
      steps_.c.values[at] += weight * across_[i];
      steps_.m_x.values[at] += weight * moment_across_[i];
      steps_.m_y.values[at] += moment_weight * across_[i];
    });
  }

  void paint_dot(int line, const Eigen::Vector2d& px, double light) {
    const double y = std::floor(px.y()), x = std::floor(px.x());
    psf_.weights(px.y() - y, weights_.data());
    psf_.weights(px.x() - x, across_.data());
    const auto k = static_cast<std::size_t>(line - static_cast<int>(y) + psf_.reach());
    const double weight = light * weights_[k];
    each_column(line, x, psf_.count(), false,
                [&](std::size_t at, std::size_t i) { steps_.c.values[at] += weight * across_[i]; });
  }

 private:
  template <typename Add>
  void each_column(int line, double floor_x, int count, bool gather_left, const Add& add) const {
    const Patch& patch = steps_.c;
    const double left = floor_x - psf_.reach() - patch.x0;
    if (!(left < patch.width)) return;
    const int first = static_cast<int>(std::max(left, -1.0 * count));
    const auto row =
        static_cast<std::size_t>(line - patch.y0) * static_cast<std::size_t>(patch.width);
    for (int i = 0; i < count; ++i) {
      const int column = first + i;
      if (column >= patch.width) break;
      if (column < 0 && !gather_left) continue;
      add(row + static_cast<std::size_t>(std::max(column, 0)), static_cast<std::size_t>(i));
    }
  }

  const PixelPsf& psf_;
  CoverageMoments& steps_;
  std::vector<double> weights_, moment_weights_, across_, moment_across_;
};

int panels_of(const LineImageInput& input, const LineRange& range) {
  const double path = path_px(input.lamp, input.motion, input.camera, range.from_s,
                              range.from_s + input.motion.exposure_s());
  return 1 + static_cast<int>(std::min(1e4, path * input.panels_per_px));
}

double reach_px(const LineImageInput& input) {
  double reach = input.psf ? input.psf->reach() + 1 : 1;
  double shift = 0;
  for (const BlurShift& s : input.shifts) shift = std::max(shift, s.px.norm());
  return reach + shift;
}

bool paint_blurred(const LineImageInput& input, const LineRange& range, CoverageMoments& moments) {
  const auto tracks = RimTracks::follow(input, range);
  if (!tracks) return false;
  const int panels = panels_of(input, range);
  const double sign = tracks->orientation();
  const bool columns = input.motion.by_columns();
  LinePainter painter(*input.psf, moments);
  for (int line = range.first; line < range.end; ++line)
    for (const LightNode& node : input.motion.nodes(input.lamp, line, panels)) {
      const LagrangeWeights at = tracks->at(node.time_s);
      const double light = sign * node.weight * input.light(node.time_s);
      for (const RimTracks::Point& point : tracks->points()) {
        const double y = point.y(at);
        for (const BlurShift& shift : input.shifts) {
          const Eigen::Vector2d by = transposed(shift.px, columns);
          if (!painter.reaches(line, y + by.y())) continue;
          painter.paint_rim(line, Eigen::Vector2d(point.x(at), y) + by,
                            light * shift.weight * point.step_y(at));
        }
      }
    }
  sum_rows(moments);
  return true;
}

// Projects the rim from every pose, which is slower than interpolating its motion.
bool paint_rims(const LineImageInput& input, const LineRange& range, CoverageMoments& moments) {
  const int panels = panels_of(input, range);
  const bool columns = input.motion.by_columns();
  LinePainter painter(*input.psf, moments);
  for (int line = range.first; line < range.end; ++line)
    for (const LightNode& node : input.motion.nodes(input.lamp, line, panels)) {
      const auto rim = input.rim(input.motion.pose_at(node.time_s));
      if (!rim) return false;
      // Counter-clockwise about a normal that points to the camera: clockwise in the image.
      const double light = (columns ? -1 : 1) * node.weight * input.light(node.time_s);
      for (const RimStep& at : *rim) {
        Eigen::Matrix<double, 2, 3> d_px;
        const auto px = input.camera.project(at.point, &d_px);
        if (!px) return false;
        const double step = transposed(d_px * at.step, columns).y();
        for (const BlurShift& shift : input.shifts) {
          const Eigen::Vector2d there = transposed(*px + shift.px, columns);
          if (painter.reaches(line, there.y()))
            painter.paint_rim(line, there, light * shift.weight * step);
        }
      }
    }
  sum_rows(moments);
  return true;
}

Chords transposed(Chords chords, bool columns) {
  if (!columns) return chords;
  for (RimChord& chord : chords)
    chord = {transposed(chord.from, true), transposed(chord.to, true), -chord.bulge_px2};
  return chords;
}

bool paint_sharp(const LineImageInput& input, const LineRange& range, CoverageMoments& moments) {
  const int panels = panels_of(input, range);
  for (int line = range.first; line < range.end; ++line)
    for (const LightNode& node : input.motion.nodes(input.lamp, line, panels)) {
      const auto chords = input.chords(input.motion.pose_at(node.time_s));
      if (!chords) return false;
      add_sharp_coverage(transposed(*chords, input.motion.by_columns()),
                         node.weight * input.light(node.time_s), line, line + 1, moments);
    }
  sum_rows(moments);
  return true;
}

// The light of a point lamp that falls into one line from one pose.
void paint_point(const LineImageInput& input, int line, const Eigen::Vector2d& px, double light,
                 LinePainter* painter, Patch& patch) {
  const Eigen::Vector2d at = transposed(px, input.motion.by_columns());
  if (painter) {
    for (const BlurShift& shift : input.shifts) {
      const Eigen::Vector2d moved = at + transposed(shift.px, input.motion.by_columns());
      if (painter->reaches(line, moved.y())) painter->paint_dot(line, moved, light * shift.weight);
    }
    return;
  }
  const double column = std::floor(at.x() + 0.5) - patch.x0;
  if (std::floor(at.y() + 0.5) != line || !(column >= 0 && column < patch.width)) return;
  patch.values[static_cast<std::size_t>(line - patch.y0) * static_cast<std::size_t>(patch.width) +
               static_cast<std::size_t>(column)] += light;
}

}  // namespace

std::optional<CoverageMoments> extended_line_image(const LineImageInput& input) {
  const LineRange range = lines_that_see(input, reach_px(input));
  const bool columns = input.motion.by_columns();
  CoverageMoments moments;
  moments.c = empty_patch(range, columns ? input.camera.height() : input.camera.width());
  moments.m_x = moments.m_y = moments.c;
  if (moments.c.width == 0) return moments;
  const auto paint = !input.psf ? paint_sharp : input.rim ? paint_rims : paint_blurred;
  const bool painted = paint(input, range, moments);
  if (!painted) return std::nullopt;
  return transposed(moments, columns);
}

std::optional<Patch> point_line_image(const LineImageInput& input) {
  const LineRange range = lines_that_see(input, reach_px(input));
  const bool columns = input.motion.by_columns();
  CoverageMoments light;
  light.c = empty_patch(range, columns ? input.camera.height() : input.camera.width());
  if (light.c.width == 0) return light.c;
  std::optional<LinePainter> painter;
  if (input.psf) painter.emplace(*input.psf, light);
  const int panels = panels_of(input, range);
  for (int line = range.first; line < range.end; ++line)
    for (const LightNode& node : input.motion.nodes(input.lamp, line, panels)) {
      const auto px = input.camera.project(input.motion.pose_at(node.time_s) * input.lamp.centre_m);
      if (!px) return std::nullopt;
      paint_point(input, line, *px, node.weight * input.light(node.time_s),
                  painter ? &*painter : nullptr, light.c);
    }
  return transposed(light.c, columns);
}

double path_px(const Lamp& lamp, const Motion& motion, const Camera& camera, double from_s,
               double to_s) {
  constexpr int steps = 4;
  double longest = 0;
  std::vector<double> lengths;
  std::vector<Eigen::Vector2d> before;
  for (int i = 0; i <= steps; ++i) {
    const double time_s = from_s + (to_s - from_s) * i / steps;
    const auto rim = project_rim(lamp, motion.pose_at(time_s), camera, line_rim_points);
    if (!rim) return 0;
    lengths.resize(rim->size());
    for (std::size_t k = 0; k < before.size(); ++k)
      longest = std::max(longest, lengths[k] += ((*rim)[k] - before[k]).norm());
    before = *rim;
  }
  return longest;
}

}  // namespace occ::internal::simulate
