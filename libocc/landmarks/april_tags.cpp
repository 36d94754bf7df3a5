// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/april_tags.hpp"

#include <apriltag/apriltag.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "libocc/core/internal/april_family.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/srgb.hpp"
#include "libocc/core/require.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"
#include "libocc/landmarks/internal/tag_corners.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::landmarks;
namespace {

using Detector = std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)>;
using Detections = std::unique_ptr<zarray_t, void (*)(zarray_t*)>;

Detector make_detector(const AprilTagOptions& options, apriltag_family_t* family) {
  Detector detector(apriltag_detector_create(), apriltag_detector_destroy);
  detector->nthreads = options.threads;
  detector->quad_decimate = static_cast<float>(options.decimate);
  apriltag_detector_add_family_bits(detector.get(), family, options.max_hamming);
  return detector;
}

/// Homography that maps (-1, -1), (1, -1), (1, 1), (-1, 1) to the corners.
Eigen::Matrix3d homography_to(const std::array<Eigen::Vector2d, 4>& corners) {
  constexpr double x[4] = {-1, 1, 1, -1}, y[4] = {-1, -1, 1, 1};
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d& c = corners[k];
    a.row(2 * k) << x[k], y[k], 1, 0, 0, 0, -c.x() * x[k], -c.x() * y[k];
    a.row(2 * k + 1) << 0, 0, 0, x[k], y[k], 1, -c.y() * x[k], -c.y() * y[k];
    b.segment<2>(2 * k) = c;
  }
  const Eigen::Matrix<double, 8, 1> h = internal::core::solve_lu(a, b);
  Eigen::Matrix3d homography;
  homography << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return homography;
}

/// Converts a detection of libapriltag and refines its corners. `origin`: of the tile in the image.
AprilTag tag_of(const apriltag_detection_t& found, const Image& grey,
                const AprilTagOptions& options, const Eigen::Vector2d& origin) {
  constexpr double corner_is_origin_px = 0.5;
  AprilTag tag;
  tag.id = found.id;
  tag.family = options.family;
  tag.hamming = found.hamming;
  tag.decision_margin = static_cast<double>(found.decision_margin);
  TagCorners corners;
  // Includes the bias of bent sides, which libapriltag assumes to be straight.
  const double unrefined_px =
      0.1 + 0.01 * std::hypot(found.p[1][0] - found.p[0][0], found.p[1][1] - found.p[0][1]);
  for (std::size_t k = 0; k < 4; ++k) {
    corners.px[k] = Eigen::Vector2d(found.p[k][0], found.p[k][1]).array() - corner_is_origin_px;
    corners.covariance_px2[k] = unrefined_px * unrefined_px * Eigen::Matrix2d::Identity();
  }
  if (options.refine && options.bends_px) {
    std::array<Eigen::Vector2d, 4> in_image = corners.px;
    for (Eigen::Vector2d& corner : in_image) corner += origin;
    corners.bends_px = options.bends_px(in_image);
  }
  const double border = static_cast<double>(options.border_cells) / found.family->width_at_border;
  TagCorners better = corners;
  tag.refined = options.refine && refine_corners(grey, border, better);
  tag.corners_px = tag.refined ? better.px : corners.px;
  tag.covariance_px2 = tag.refined ? better.covariance_px2 : corners.covariance_px2;
  tag.homography = homography_to(tag.corners_px);
  tag.centre_px = tag.homography.col(2).hnormalized();
  return tag;
}

/// Difference of the rings inside and outside the tag's square, in grey levels of 255; 0 if they
/// leave the image.
double ring_contrast(const AprilTag& tag, int width_at_border, const Image& image, unsigned white) {
  constexpr double along[] = {-0.6, -0.3, 0, 0.3, 0.6};
  const double half_cell = 1.0 / width_at_border;  // a cell has 2 / width of the tag's coordinates
  const GreyImage grey(image);
  double sums[2] = {0, 0};
  int count = 0;
  for (int ring = 0; ring < 2; ++ring) {
    const double across = ring == 0 ? 1 - half_cell : 1 + half_cell;
    for (const double a : along)
      for (const Eigen::Vector2d& at : {Eigen::Vector2d(a, across), Eigen::Vector2d(a, -across),
                                        Eigen::Vector2d(across, a), Eigen::Vector2d(-across, a)}) {
        const Eigen::Vector2d px = (tag.homography * at.homogeneous()).hnormalized();
        if (!grey.holds(px)) return 0;
        sums[ring] += grey.at(px);
        ++count;
      }
  }
  return std::abs(sums[1] - sums[0]) / (0.5 * count) * 255 / white;
}

/// Probability that random bits are read as a tag of the family, in one of four rotations.
double random_tag_probability(const apriltag_family_t& family, int max_hamming) {
  double patterns = 0, choices = 1;  // bits of at most max_hamming errors
  for (int errors = 0; errors <= max_hamming; ++errors) {
    patterns += choices;
    choices *= static_cast<double>(family.nbits) - errors;
    choices /= errors + 1;
  }
  return 4 * family.ncodes * patterns / std::pow(2.0, family.nbits);
}

/// True if the decision margin is large enough. A tag of low contrast cannot reach the min. It is
/// accepted with a margin of a quarter of its contrast if random bits are practically never read as
/// a tag of its family.
bool is_distinct(const apriltag_detection_t& found, const AprilTag& tag, const Image& grey,
                 unsigned white, const AprilTagOptions& options) {
  if (tag.decision_margin >= options.min_decision_margin) return true;
  constexpr double max_probability =
      1e-5;  // with a thousand squares, 1 % of images have a false tag
  constexpr double min_part =
      0.25;  // half the margin of a blurred tag, which has half its contrast
  if (random_tag_probability(*found.family, options.max_hamming) > max_probability) return false;
  const double contrast = ring_contrast(tag, found.family->width_at_border, grey, white);
  return contrast > 0 && tag.decision_margin >= min_part * contrast;
}

}  // namespace

void AprilTagOptions::validate() const {
  std::string names;
  for (const std::string& known : april_family_names())
    names += (names.empty() ? "" : ", ") + known;
  require(make_april_family(family) != nullptr, "family", family, "one of " + names);
  const std::vector<std::string> bordered = bordered_family_names();
  require(border_cells >= 1 && border_cells <= 4, "border_cells", border_cells, "between 1 and 4");
  require(border_cells == 1 || std::count(bordered.begin(), bordered.end(), family) > 0,
          "border_cells", border_cells, "1 for the family " + family);
  require(decimate >= 1 && decimate <= 8, "decimate", decimate, "between 1 and 8");
  require(threads >= 1, "threads", threads, "at least 1");
  require(max_hamming >= 0 && max_hamming <= 2, "max_hamming", max_hamming, "0, 1 or 2");
  require(overlap_px >= 0, "overlap_px", overlap_px, "zero or positive");
  require(tile_px == 0 || (tile_px >= 64 && tile_px / 2 >= overlap_px), "tile_px", tile_px,
          "0, or at least 64 and twice overlap_px");
  require(min_decision_margin >= 0, "min_decision_margin", min_decision_margin, "zero or positive");
}

std::vector<std::string> april_tag_families() { return april_family_names(); }

namespace {

/// One detector for all tiles.
class TagFinder {
 public:
  explicit TagFinder(const AprilTagOptions& options)
      : options_(options),
        family_(make_april_family(options.family, options.border_cells)),
        detector_(make_detector(options, family_.get())) {}

  /// `light`: the same in linear light, in which corners are fitted.
  std::vector<AprilTag> find(const Image& grey, const Image& light, unsigned white,
                             const Eigen::Vector2d& origin = Eigen::Vector2d::Zero()) const {
    constexpr double min_size_px = 16;  // libapriltag divides the image into tiles of 4 x 4 pixels
    std::vector<AprilTag> tags;
    if (std::min(grey.width, grey.height) < min_size_px * options_.decimate) return tags;
    std::vector<std::uint8_t> pixels = eight_bits(grey, white);
    image_u8_t view{grey.width, grey.height, grey.width, pixels.data()};
    const Detections found(apriltag_detector_detect(detector_.get(), &view),
                           apriltag_detections_destroy);
    for (int i = 0; i < zarray_size(found.get()); ++i) {
      apriltag_detection_t* detection = nullptr;
      zarray_get(found.get(), i, static_cast<void*>(&detection));
      AprilTag tag = tag_of(*detection, light, options_, origin);
      if (is_distinct(*detection, tag, grey, white, options_)) tags.push_back(std::move(tag));
    }
    return tags;
  }

 private:
  const AprilTagOptions& options_;
  AprilFamily family_;
  Detector detector_;
};

void sort_by_id(std::vector<AprilTag>& tags) {
  std::stable_sort(tags.begin(), tags.end(),
                   [](const AprilTag& a, const AprilTag& b) { return a.id < b.id; });
}

void shift(const Eigen::Vector2d& by, AprilTag& tag) {
  for (Eigen::Vector2d& corner : tag.corners_px) corner += by;
  tag.centre_px += by;
  tag.homography.row(0) += by.x() * tag.homography.row(2);
  tag.homography.row(1) += by.y() * tag.homography.row(2);
}

/// Tile of the image: pixels x0 <= x < x0 + width, y0 <= y < y0 + height. It reports the tags with
/// centres in its middle part, which ends half the overlap from its borders (or at the image's).
struct ImageTile {
  /// Overlap of the middle parts, so that rounding cannot lose a tag on their border.
  static constexpr double tolerance_px = 1;

  int x0 = 0, y0 = 0, width = 0, height = 0;
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Zero();

  bool counts(const Eigen::Vector2d& px) const {
    return ((px - low).array() >= -tolerance_px).all() &&
           ((high - px).array() >= -tolerance_px).all();
  }
};

struct Span {
  int first, count;
  double low, high;  // middle part
};

int rounded_up(int value, int unit) { return (value + unit - 1) / unit * unit; }

std::vector<Span> spans(int size, int tile_px, int overlap_px, int unit) {
  const int overlap = rounded_up(overlap_px, unit);
  const int tile = std::max(rounded_up(tile_px, unit), 2 * overlap + unit);
  std::vector<Span> all;
  for (int first = 0;; first += tile - overlap) {
    const bool last = first + tile >= size;
    const int count = last ? size - first : tile;
    const double low = first == 0 ? -1 : first + 0.5 * overlap;
    const double high = last ? size : first + tile - 0.5 * overlap;
    all.push_back({first, count, low, high});
    if (last) return all;
  }
}

/// Tiles of about tile_px, row by row, that start at multiples of `unit`; one tile if the image is
/// not larger. Requires tile_px >= 2 overlap_px.
std::vector<ImageTile> image_tiles(int width, int height, int tile_px, int overlap_px, int unit) {
  std::vector<ImageTile> tiles;
  for (const Span& row : spans(height, tile_px, overlap_px, unit))
    for (const Span& column : spans(width, tile_px, overlap_px, unit))
      tiles.push_back({column.first, row.first, column.count, row.count,
                       Eigen::Vector2d(column.low, row.low),
                       Eigen::Vector2d(column.high, row.high)});
  return tiles;
}

/// libapriltag computes thresholds in squares of 4 x 4 pixels of the decimated image. Tiles start
/// at multiples of these, so that the squares are those of the whole image.
int tile_unit(double decimate) {
  constexpr double three_to_two = 1.5;  // special case in libapriltag: 3 pixels become 2
  return decimate == three_to_two ? 12 : 4 * static_cast<int>(decimate);
}

/// `light`: empty if `image` is in linear light.
std::vector<AprilTag> find_by_tiles(const ImageReader& image, const ImageReader& light,
                                    const AprilTagOptions& options) {
  const std::vector<ImageTile> tiles = image_tiles(image.width, image.height, options.tile_px,
                                                   options.overlap_px, tile_unit(options.decimate));
  const auto read_from = [&](const ImageReader& source, const ImageTile& tile) {
    Image part = source.read(tile.x0, tile.y0, tile.width, tile.height);
    require(part.width == tile.width && part.height == tile.height && part.channels == 1,
            "image: window", std::to_string(part.width) + " x " + std::to_string(part.height),
            "grey and of the size asked for");
    part.view().validate();
    return part;
  };
  const auto read = [&](const ImageTile& tile) { return read_from(image, tile); };
  unsigned white = 0;
  const TagFinder finder(options);
  std::vector<AprilTag> tags;
  int done = 0;
  for (const ImageTile& tile : tiles) {
    const Image part = read(tile);
    if (white == 0 && part.type == PixelType::u8) white = 255;
    if (white == 0)
      for (const ImageTile& other : tiles) white = std::max(white, white_level(read(other)));
    const Eigen::Vector2d origin(tile.x0, tile.y0);
    const std::optional<Image> linear =
        light.read ? std::optional<Image>(read_from(light, tile)) : std::nullopt;
    for (AprilTag& tag : finder.find(part, linear ? *linear : part, white, origin)) {
      shift(origin, tag);
      if (!tile.counts(tag.centre_px)) continue;
      const auto same = [&](const AprilTag& other) {
        return other.id == tag.id &&
               (other.centre_px - tag.centre_px).norm() < 2 * ImageTile::tolerance_px;
      };
      if (std::none_of(tags.begin(), tags.end(), same)) tags.push_back(std::move(tag));
    }
    if (options.progress && !options.progress(++done, static_cast<int>(tiles.size()))) break;
  }
  // Order by x, independent of the tiles.
  std::stable_sort(tags.begin(), tags.end(), [](const AprilTag& a, const AprilTag& b) {
    return a.centre_px.x() < b.centre_px.x();
  });
  sort_by_id(tags);
  return tags;
}

ImageReader reader_of(const ImageView& image) {
  const std::size_t bytes = image.type == PixelType::u8 ? 1 : 2;
  return {image.width, image.height, [=](int x0, int y0, int width, int height) {
            ImageView part = image;
            part.data =
                static_cast<const char*>(image.data) +
                static_cast<std::size_t>(y0) * image.row_bytes +
                static_cast<std::size_t>(x0) * static_cast<std::size_t>(image.channels) * bytes;
            part.width = width;
            part.height = height;
            return to_grey(part);
          }};
}

}  // namespace

std::vector<AprilTag> detect_april_tags(const ImageView& image, const AprilTagOptions& options) {
  options.validate();
  image.validate();
  const std::optional<Image> linear = internal::core::linear_grey(image);
  if (options.tile_px > 0)
    return find_by_tiles(reader_of(image), linear ? reader_of(linear->view()) : ImageReader{},
                         options);
  const Image grey = to_grey(image);
  std::vector<AprilTag> tags =
      TagFinder(options).find(grey, linear ? *linear : grey, white_level(grey));
  sort_by_id(tags);
  if (options.progress) options.progress(1, 1);
  return tags;
}

std::vector<AprilTag> detect_april_tags(const ImageReader& image, const AprilTagOptions& options) {
  constexpr int usual_tile_px = 2048;
  AprilTagOptions tiled = options;
  if (tiled.tile_px == 0) tiled.tile_px = usual_tile_px;
  tiled.validate();
  require(image.width > 0, "image: width", image.width, "positive");
  require(image.height > 0, "image: height", image.height, "positive");
  require(static_cast<bool>(image.read), "image: read", "nothing", "a function");
  return find_by_tiles(image, {}, tiled);
}

}  // namespace occ
