// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/chessboard_search.hpp"

#if LIBOCC_OPENCV

#include <algorithm>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "libocc/landmarks/internal/grey_image.hpp"

namespace occ::internal::landmarks {
namespace {

/// Means of factor x factor pixels. Pixel p of the result is at factor p + (factor - 1) / 2.
std::vector<unsigned char> reduced(const std::vector<unsigned char>& bytes, int width, int height,
                                   int factor) {
  const int columns = width / factor, rows = height / factor;
  std::vector<unsigned char> means;
  means.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      int sum = 0;
      for (int v = 0; v < factor; ++v) {
        const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(y * factor + v) * width +
                           static_cast<std::ptrdiff_t>(x) * factor;
        sum = std::accumulate(begin, begin + factor, sum);
      }
      means.push_back(static_cast<unsigned char>(sum / (factor * factor)));
    }
  return means;
}

/// A search of the board in the image reduced by `factor`.
struct Search {
  int factor = 1;
  int flags = 0;
};

/// Searches by increasing time; see the header for the sizes.
std::vector<Search> searches_of(const Image& image) {
  constexpr int quick_px = 1000, thorough_px = 640;
  constexpr int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
  const int side = std::max(image.width, image.height);
  std::vector<Search> searches;
  if (side > thorough_px)
    searches.push_back({(side + quick_px - 1) / quick_px, flags | cv::CALIB_CB_FAST_CHECK});
  searches.push_back({(side + thorough_px - 1) / thorough_px, flags});
  return searches;
}

CoarseCorners run_search(const std::vector<unsigned char>& bytes, const Image& pixels,
                         const Search& search, const ChessboardOptions& options) {
  constexpr int min_size_px = 20;  // no board fits a smaller image
  const int columns = pixels.width / search.factor, rows = pixels.height / search.factor;
  if (std::min(columns, rows) < min_size_px) return {};
  std::vector<unsigned char> small = reduced(bytes, pixels.width, pixels.height, search.factor);
  const cv::Mat view(rows, columns, CV_8UC1, small.data());
  CoarseCorners found;
  found.factor = search.factor;
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(view, cv::Size(options.columns, options.rows), corners,
                                 search.flags))
    return {};
  const auto factor = static_cast<float>(search.factor);
  const float shift = 0.5F * (factor - 1);
  for (const cv::Point2f& corner : corners) {
    const cv::Point2f p = factor * corner + cv::Point2f(shift, shift);
    found.px.emplace_back(p.x, p.y);
  }
  return found;
}

}  // namespace

CoarseCorners search_board(const Image& pixels, const ChessboardOptions& options) {
  const std::vector<unsigned char> bytes = eight_bits(pixels, white_level(pixels));
  const std::vector<Search> searches = searches_of(pixels);
  const auto count = static_cast<int>(searches.size());
  for (int i = 0; i < count; ++i) {
    if (options.progress && !options.progress(i, count)) return {};
    CoarseCorners found = run_search(bytes, pixels, searches[static_cast<std::size_t>(i)], options);
    if (!found.px.empty()) return found;
  }
  return {};
}

}  // namespace occ::internal::landmarks

#else

#include <stdexcept>

namespace occ::internal::landmarks {

CoarseCorners search_board(const Image& /*pixels*/, const ChessboardOptions& /*options*/) {
  throw std::invalid_argument(
      "finding a chessboard needs OpenCV, which this build of libocc does not contain: build it "
      "with -DLIBOCC_OPENCV=ON, or use AprilTags");
}

}  // namespace occ::internal::landmarks

#endif
