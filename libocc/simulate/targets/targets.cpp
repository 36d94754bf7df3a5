// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/targets.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "libocc/core/internal/philox_blocks.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/simulate/internal/noise_key.hpp"
#include "libocc/simulate/internal/normal_variate.hpp"
#include "libocc/simulate/internal/target_figure.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::simulate;
namespace {

// Projected outlines of one sheet. They are painted again for each window, always in the frame of
// the sheet's own pixels, so that windows have the same bits.
struct Layer {
  Contour contour;
  double level_dn = 0;
};

struct Sheet {
  double distance_m = 0;
  int x0 = 0, y0 = 0, width = 0, height = 0;  // pixels of the image that it changes
  std::vector<Layer> layers;                  // in the frame with the origin (x0, y0)
};

struct Bounds {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;

  explicit Bounds(const Contour& contour) {
    for (const ContourPoint& point : contour) {
      low = low.cwiseMin(point.px);
      high = high.cwiseMax(point.px);
    }
  }
};

// Grey levels of one window; far sheets are painted first.
class Painting {
 public:
  Painting(const PixelRectangle& window, const PixelPsf& psf, double ground_dn)
      : window_(window),
        psf_(psf),
        dn_(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height),
            static_cast<float>(ground_dn)) {}

  void paint(const Sheet& sheet) {
    const int left = std::max(sheet.x0, window_.x0), top = std::max(sheet.y0, window_.y0);
    const int right = std::min(sheet.x0 + sheet.width, window_.x0 + window_.width);
    const int bottom = std::min(sheet.y0 + sheet.height, window_.y0 + window_.height);
    if (left >= right || top >= bottom) return;
    double below_dn = 0;
    for (std::size_t k = 0; k < sheet.layers.size(); ++k) {
      const Layer& layer = sheet.layers[k];
      const Patch c = coverage(layer.contour, psf_, sheet.width, sheet.height);
      const auto full = static_cast<float>(layer.level_dn - below_dn);
      const float keep = k == 0 ? 1 : 0;
      below_dn = layer.level_dn;
      const int x_end = std::min(right, sheet.x0 + c.x0 + c.width);
      const int y_end = std::min(bottom, sheet.y0 + c.y0 + c.height);
      for (int y = std::max(top, sheet.y0 + c.y0); y < y_end; ++y)
        for (int x = std::max(left, sheet.x0 + c.x0); x < x_end; ++x) {
          float& dn = at(x, y);
          const auto part = static_cast<float>(c.at(x - sheet.x0, y - sheet.y0));
          dn += part * (full - keep * dn);
        }
    }
  }

  float* row(int y) { return &at(window_.x0, y); }

 private:
  float& at(int x, int y) {
    return dn_[static_cast<std::size_t>(y - window_.y0) * static_cast<std::size_t>(window_.width) +
               static_cast<std::size_t>(x - window_.x0)];
  }

  PixelRectangle window_;
  const PixelPsf& psf_;
  std::vector<float> dn_;
};

// Adds noise to part of a row. Four pixels share a block of random words.
class Noise {
 public:
  explicit Noise(const TargetImageOptions& options)
      : key_{options.seed, options.frame}, sigma_(static_cast<float>(options.noise_dn)) {}

  void add(int x0, int y, int count, float* dn) {
    if (!(sigma_ > 0)) return;
    constexpr int per_block = 4;
    const int first = x0 / per_block, skip = x0 % per_block;
    const int blocks = (x0 + count - 1) / per_block - first + 1;
    counters_.resize(static_cast<std::size_t>(blocks) + philox_batch);
    std::iota(counters_.begin(), counters_.end(), static_cast<std::uint32_t>(first));
    words_.resize(4 * counters_.size());
    philox_blocks(widest_simd(), counters_.data(), static_cast<std::uint32_t>(blocks),
                  {target_use, static_cast<std::uint32_t>(y), key_.frame}, key_.words(),
                  words_.data());
    for (int i = 0; i < count; ++i) dn[i] += sigma_ * normal_variate(words_[skip + i]);
  }

 private:
  NoiseKey key_;
  float sigma_;
  std::vector<std::uint32_t> counters_, words_;
};

}  // namespace

struct TargetRenderer::Impl {
  Impl(const Camera& camera_of, const TargetImageOptions& options_of)
      : camera(camera_of), options(options_of), psf(options_of.psf_sigma_px) {}

  Camera camera;
  TargetImageOptions options;
  PixelPsf psf;
  TargetTruth truth;
  std::vector<Sheet> sheets;

  // Projection of a figure: contours of its outlines (empty if it is not drawn), and the visibility
  // of its sheet.
  struct Seen {
    std::vector<Contour> contours;
    bool in_view = false, whole = false;
  };
  Seen add(const TargetFigure& figure);

  // Projections of points of a figure that is drawn, continuous across the seam.
  Eigen::Matrix2Xd near_centre(const TargetFigure& figure, const Rigid3& cam_from_points,
                               const Eigen::Matrix3Xd& points) const;

 private:
  bool add_copy(const TargetFigure& figure, const Seen& seen, const Bounds& bounds,
                double shift_px);
};

TargetRenderer::Impl::Seen TargetRenderer::Impl::add(const TargetFigure& figure) {
  Seen seen;
  const auto centre = camera.project(figure.cam_from_plane.translation);
  if (!centre) return seen;
  const double max_px = 8.0 * (camera.width() + camera.height());
  for (const PlaneOutline& outline : figure.outlines) {
    auto contour =
        plane_contour(outline, figure.cam_from_plane, camera, *centre, psf.sigma_px(), max_px);
    if (!contour || (seen.contours.empty() && !(contour_area(*contour) > 0))) return {};
    seen.contours.push_back(std::move(*contour));
  }
  const Bounds bounds(seen.contours.front());
  const double period = camera.period_px();
  const auto first =
      std::isfinite(period) ? static_cast<int>(std::floor((-0.5 - bounds.high.x()) / period)) : 0;
  const auto last = std::isfinite(period)
                        ? static_cast<int>(std::ceil((camera.width() - bounds.low.x()) / period))
                        : 0;
  for (int k = first; k <= last; ++k) {
    const double shift = k == 0 ? 0 : k * period;
    seen.in_view = add_copy(figure, seen, bounds, shift) || seen.in_view;
    const bool across =
        bounds.low.x() + shift > -0.5 && bounds.high.x() + shift < camera.width() - 0.5;
    seen.whole =
        seen.whole || (across && bounds.low.y() > -0.5 && bounds.high.y() < camera.height() - 0.5);
  }
  return seen;
}

Eigen::Matrix2Xd TargetRenderer::Impl::near_centre(const TargetFigure& figure,
                                                   const Rigid3& cam_from_points,
                                                   const Eigen::Matrix3Xd& points) const {
  const Eigen::Vector2d centre = camera.project(figure.cam_from_plane.translation).value();
  Eigen::Matrix2Xd px(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto at = camera.project(cam_from_points * Eigen::Vector3d(points.col(i)));
    px.col(i) = centre + camera.difference_px(at.value_or(centre), centre);
  }
  return px;
}

bool TargetRenderer::Impl::add_copy(const TargetFigure& figure, const Seen& seen,
                                    const Bounds& bounds, double shift_px) {
  const auto clipped = [&](double low, double high, int size) {
    const double first = std::max(0.0, std::floor(low) - psf.reach());
    const double end = std::min<double>(size, std::floor(high) + psf.reach() + 2);
    return std::pair<int, int>(static_cast<int>(std::min<double>(first, size)),
                               static_cast<int>(std::max(end, 0.0)));
  };
  const auto [left, right] =
      clipped(bounds.low.x() + shift_px, bounds.high.x() + shift_px, camera.width());
  const auto [top, bottom] = clipped(bounds.low.y(), bounds.high.y(), camera.height());
  if (left >= right || top >= bottom) return false;
  Sheet sheet;
  sheet.distance_m = figure.cam_from_plane.translation.norm();
  sheet.x0 = left;
  sheet.y0 = top;
  sheet.width = right - left;
  sheet.height = bottom - top;
  const Eigen::Vector2d by(shift_px - left, -top);
  for (std::size_t k = 0; k < seen.contours.size(); ++k) {
    sheet.layers.push_back({seen.contours[k], figure.levels_dn[k]});
    for (ContourPoint& point : sheet.layers.back().contour) point.px += by;
  }
  sheets.push_back(std::move(sheet));
  return true;
}

void TargetImageOptions::validate() const {
  require(psf_sigma_px >= 0.1 && psf_sigma_px <= 20, "psf_sigma_px", psf_sigma_px,
          "between 0.1 and 20");
  const auto level = [](double dn, const char* name) {
    require(dn >= 0 && dn <= 255, name, dn, "between 0 and 255");
  };
  level(black_dn, "black_dn");
  level(white_dn, "white_dn");
  level(ground_dn, "ground_dn");
  require(margin_cells >= 0 && margin_cells <= 100, "margin_cells", margin_cells,
          "between 0 and 100");
  require(noise_dn >= 0 && std::isfinite(noise_dn), "noise_dn", noise_dn, "zero or positive");
}

TargetRenderer::TargetRenderer(TargetField field, const Camera& camera,
                               const Rigid3& cam_from_world, const TargetImageOptions& options) {
  options.validate();
  require(cam_from_world.matrix().allFinite(), "cam_from_world", cam_from_world.matrix(), "finite");
  impl_ = std::make_unique<Impl>(camera, options);
  for (Tag& tag : field.tags) {
    tag.validate();
    const TargetFigure figure = tag_figure(tag, cam_from_world, options);
    const Impl::Seen seen = impl_->add(figure);
    TagTruth truth;
    truth.id = tag.id;
    truth.in_view = seen.in_view;
    truth.whole = seen.whole;
    if (!seen.contours.empty()) {
      const Eigen::Matrix2Xd px =
          impl_->near_centre(figure, figure.cam_from_plane, tag_corners(tag.size_m));
      for (int k = 0; k < 4; ++k) truth.corners_px[k] = px.col(k);
    }
    impl_->truth.tags.push_back(truth);
  }
  for (CircularTarget& circle : field.circles) {
    circle.validate();
    const TargetFigure figure = circle_figure(circle, cam_from_world, options);
    const Impl::Seen seen = impl_->add(figure);
    CircleTruth truth;
    truth.id = circle.id;
    truth.in_view = seen.in_view;
    truth.whole = seen.whole;
    if (!seen.contours.empty()) {
      truth.centre_px = *camera.project(figure.cam_from_plane.translation);
      truth.image_centre_px = contour_centroid(seen.contours.back());
    }
    impl_->truth.circles.push_back(truth);
  }
  for (const ChessboardTarget& board : field.boards) {
    board.validate();
    const TargetFigure figure = board_figure(board, cam_from_world, options);
    const Impl::Seen seen = impl_->add(figure);
    ChessboardTruth truth;
    truth.in_view = seen.in_view;
    truth.whole = seen.whole;
    if (!seen.contours.empty()) {
      const Rigid3 cam_from_board = cam_from_world * board.world_from_board;
      truth.corners_px = impl_->near_centre(figure, cam_from_board, board.corners_m());
    }
    impl_->truth.boards.push_back(truth);
  }
  for (const CircleGridTarget& grid : field.grids) {
    grid.validate();
    const TargetFigure figure = grid_figure(grid, cam_from_world, options);
    const Impl::Seen seen = impl_->add(figure);
    CircleGridTruth truth;
    truth.in_view = seen.in_view;
    truth.whole = seen.whole;
    if (!seen.contours.empty())
      truth.centres_px =
          impl_->near_centre(figure, cam_from_world * grid.world_from_board, grid.centres_m());
    impl_->truth.grids.push_back(truth);
  }
  const auto board_truth = [&](const TargetFigure& figure, const Rigid3& world_from_board,
                               const Eigen::Matrix3Xd& points_m) {
    const Impl::Seen seen = impl_->add(figure);
    MarkerBoardTruth truth{seen.in_view, seen.whole, {}};
    if (!seen.contours.empty())
      truth.points_px = impl_->near_centre(figure, cam_from_world * world_from_board, points_m);
    return truth;
  };
  for (const AprilGridTarget& grid : field.april_grids) {
    grid.validate();
    impl_->truth.april_grids.push_back(board_truth(april_grid_figure(grid, cam_from_world, options),
                                                   grid.world_from_board, grid.board.points_m()));
  }
  for (const CharucoTarget& board : field.charucos) {
    board.validate();
    impl_->truth.charucos.push_back(board_truth(charuco_figure(board, cam_from_world, options),
                                                board.world_from_board, board.board.points_m()));
  }
  std::stable_sort(impl_->sheets.begin(), impl_->sheets.end(),
                   [](const Sheet& a, const Sheet& b) { return a.distance_m > b.distance_m; });
}

TargetRenderer::TargetRenderer(TargetRenderer&&) noexcept = default;
TargetRenderer& TargetRenderer::operator=(TargetRenderer&&) noexcept = default;
TargetRenderer::~TargetRenderer() = default;

const TargetTruth& TargetRenderer::truth() const { return impl_->truth; }

Image TargetRenderer::window(const PixelRectangle& window) const {
  require(window.width > 0 && window.x0 >= 0 && window.width <= impl_->camera.width() - window.x0,
          "window: columns", std::to_string(window.x0) + " + " + std::to_string(window.width),
          "a part of the image");
  require(
      window.height > 0 && window.y0 >= 0 && window.height <= impl_->camera.height() - window.y0,
      "window: rows", std::to_string(window.y0) + " + " + std::to_string(window.height),
      "a part of the image");
  Painting painting(window, impl_->psf, impl_->options.ground_dn);
  for (const Sheet& sheet : impl_->sheets) painting.paint(sheet);
  Image image;
  image.width = window.width;
  image.height = window.height;
  image.u8.reserve(static_cast<std::size_t>(window.width) *
                   static_cast<std::size_t>(window.height));
  Noise noise(impl_->options);
  for (int y = window.y0; y < window.y0 + window.height; ++y) {
    float* dn = painting.row(y);
    noise.add(window.x0, y, window.width, dn);
    for (int i = 0; i < window.width; ++i)
      image.u8.push_back(static_cast<std::uint8_t>(std::clamp(dn[i] + 0.5F, 0.0F, 255.0F)));
  }
  return image;
}

}  // namespace occ
