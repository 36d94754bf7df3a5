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
#include "libocc/simulate/internal/target_outline.hpp"

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

// A plane figure with its layers from the lowest to the uppermost.
struct Figure {
  Rigid3 cam_from_plane;
  std::vector<PlaneOutline> outlines;
  std::vector<double> levels_dn;
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

Rigid3 world_from_circle(const CircularTarget& circle) {
  Rigid3 pose;
  const Eigen::Vector3d x = circle.normal.unitOrthogonal();
  pose.rotation << x, circle.normal.cross(x), circle.normal;
  pose.translation = circle.centre_m;
  return pose;
}

Figure tag_figure(const Tag& tag, const Rigid3& cam_from_world, const TargetImageOptions& o) {
  const TagPrint print = tag_print(tag.family, tag.id);
  const double half_m = 0.5 * tag.size_m;
  PlaneOutline black;
  for (const PrintEdge& edge : print.black)
    black.edges.push_back({half_m * edge.from, half_m * edge.to});
  return {cam_from_world * tag.world_from_tag(),
          {square_outline(half_m * (print.half_width + o.margin_cells * print.cell)), black},
          {o.white_dn, o.black_dn}};
}

Figure circle_figure(const CircularTarget& circle, const Rigid3& cam_from_world,
                     const TargetImageOptions& o) {
  const double sheet_m = circle.sheet_m > 0 ? circle.sheet_m : 4 * circle.radius_m;
  PlaneOutline disc;
  disc.circle_radius_m = circle.radius_m;
  disc.circle_centres_m = {Eigen::Vector2d::Zero()};
  return {cam_from_world * world_from_circle(circle),
          {square_outline(0.5 * sheet_m), disc},
          {circle.dark ? o.white_dn : o.black_dn, circle.dark ? o.black_dn : o.white_dn}};
}

Figure board_figure(const ChessboardTarget& board, const Rigid3& cam_from_world,
                    const TargetImageOptions& o) {
  Rigid3 board_from_plane;  // z axis towards the viewer instead of away
  board_from_plane.rotation.diagonal() << 1, -1, -1;
  const int columns = board.columns + 1, rows = board.rows + 1;
  board_from_plane.translation =
      board.square_m * Eigen::Vector3d(0.5 * columns - 1, 0.5 * rows - 1, 0);
  const Eigen::Vector2d middle(0.5 * columns, -0.5 * rows);
  PlaneOutline black;
  for (const PrintEdge& edge :
       cell_outline(columns, rows, [](int x, int y) { return (x + y) % 2 == 0; }))
    black.edges.push_back(
        {board.square_m * (edge.from - middle), board.square_m * (edge.to - middle)});
  const Eigen::Vector2d half =
      board.square_m * Eigen::Vector2d(0.5 * columns + o.margin_cells, 0.5 * rows + o.margin_cells);
  return {cam_from_world * board.world_from_board * board_from_plane,
          {rectangle_outline(half), black},
          {o.white_dn, o.black_dn}};
}

Figure grid_figure(const CircleGridTarget& grid, const Rigid3& cam_from_world,
                   const TargetImageOptions& o) {
  const Eigen::Matrix3Xd centres = grid.centres_m();
  const Eigen::Vector2d low = centres.topRows<2>().rowwise().minCoeff();
  const Eigen::Vector2d high = centres.topRows<2>().rowwise().maxCoeff();
  const Eigen::Vector2d middle = 0.5 * (low + high);
  Rigid3 board_from_plane;  // z axis towards the viewer instead of away
  board_from_plane.rotation.diagonal() << 1, -1, -1;
  board_from_plane.translation << middle, 0;
  PlaneOutline discs;
  discs.circle_radius_m = grid.radius_m;
  for (Eigen::Index i = 0; i < centres.cols(); ++i) {
    const Eigen::Vector2d off = centres.col(i).head<2>() - middle;
    discs.circle_centres_m.emplace_back(off.x(), -off.y());
  }
  const Eigen::Vector2d half = 0.5 * (high - low) + Eigen::Vector2d::Constant(grid.radius_m) +
                               Eigen::Vector2d::Constant(o.margin_cells * grid.spacing_m);
  return {cam_from_world * grid.world_from_board * board_from_plane,
          {rectangle_outline(half), discs},
          {grid.dark ? o.white_dn : o.black_dn, grid.dark ? o.black_dn : o.white_dn}};
}

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
  Seen add(const Figure& figure);

  // Projections of points of a figure that is drawn, continuous across the seam.
  Eigen::Matrix2Xd near_centre(const Figure& figure, const Rigid3& cam_from_points,
                               const Eigen::Matrix3Xd& points) const;

 private:
  bool add_copy(const Figure& figure, const Seen& seen, const Bounds& bounds, double shift_px);
};

TargetRenderer::Impl::Seen TargetRenderer::Impl::add(const Figure& figure) {
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

Eigen::Matrix2Xd TargetRenderer::Impl::near_centre(const Figure& figure,
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

bool TargetRenderer::Impl::add_copy(const Figure& figure, const Seen& seen, const Bounds& bounds,
                                    double shift_px) {
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

void CircularTarget::validate() {
  const std::string name = "circle " + std::to_string(id) + ": ";
  require(radius_m > 0 && std::isfinite(radius_m), name + "radius_m", radius_m, "positive");
  require(sheet_m == 0 || (sheet_m > 2 * radius_m && std::isfinite(sheet_m)), name + "sheet_m",
          sheet_m, "0 or more than the disc's diameter");
  require(centre_m.allFinite(), name + "centre_m", centre_m.transpose(), "finite");
  require(normal.allFinite() && normal.norm() > 0, name + "normal", normal.transpose(),
          "a direction");
  normal.normalize();
}

void ChessboardTarget::validate() const {
  require(columns >= 2 && columns <= 1000, "board: columns", columns, "between 2 and 1000");
  require(rows >= 2 && rows <= 1000, "board: rows", rows, "between 2 and 1000");
  require(square_m > 0 && std::isfinite(square_m), "board: square_m", square_m, "positive");
  Rigid3::from_matrix(world_from_board.matrix(), "world_from_board");
}

Eigen::Matrix3Xd ChessboardTarget::corners_m() const {
  Eigen::Matrix3Xd corners(3, columns * rows);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      corners.col(row * columns + column) = square_m * Eigen::Vector3d(column, row, 0);
  return corners;
}

void CircleGridTarget::validate() const {
  require(columns >= 2 && columns <= 1000, "grid: columns", columns, "between 2 and 1000");
  require(rows >= 2 && rows <= 1000, "grid: rows", rows, "between 2 and 1000");
  require(spacing_m > 0 && std::isfinite(spacing_m), "grid: spacing_m", spacing_m, "positive");
  const double nearest_m = asymmetric ? std::sqrt(2) * spacing_m : spacing_m;
  require(radius_m > 0 && 2 * radius_m < nearest_m, "grid: radius_m", radius_m,
          "positive, less than half the distance of neighbouring discs");
  Rigid3::from_matrix(world_from_board.matrix(), "world_from_board");
}

Eigen::Matrix3Xd CircleGridTarget::centres_m() const {
  Eigen::Matrix3Xd centres(3, columns * rows);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      centres.col(row * columns + column) =
          spacing_m * Eigen::Vector3d(asymmetric ? 2 * column + row % 2 : column, row, 0);
  return centres;
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
    const Figure figure = tag_figure(tag, cam_from_world, options);
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
    const Figure figure = circle_figure(circle, cam_from_world, options);
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
    const Figure figure = board_figure(board, cam_from_world, options);
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
    const Figure figure = grid_figure(grid, cam_from_world, options);
    const Impl::Seen seen = impl_->add(figure);
    CircleGridTruth truth;
    truth.in_view = seen.in_view;
    truth.whole = seen.whole;
    if (!seen.contours.empty())
      truth.centres_px =
          impl_->near_centre(figure, cam_from_world * grid.world_from_board, grid.centres_m());
    impl_->truth.grids.push_back(truth);
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
