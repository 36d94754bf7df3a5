// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/april_tags.hpp"
//
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>

#include "libocc/core/require.hpp"
#include "libocc/detect/tag_corners.hpp"

namespace occ {
namespace {

struct Family {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

constexpr Family families[] = {
    {"tag36h11", tag36h11_create, tag36h11_destroy},
    {"tag25h9", tag25h9_create, tag25h9_destroy},
    {"tag16h5", tag16h5_create, tag16h5_destroy},
    {"tagStandard41h12", tagStandard41h12_create, tagStandard41h12_destroy},
    {"tagStandard52h13", tagStandard52h13_create, tagStandard52h13_destroy}};

const Family* family_named(const std::string& name) {
  const auto found = std::find_if(std::begin(families), std::end(families),
                                  [&](const Family& family) { return name == family.name; });
  return found == std::end(families) ? nullptr : found;
}

using FamilyPointer = std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)>;
using Detector = std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)>;
using Detections = std::unique_ptr<zarray_t, void (*)(zarray_t*)>;

Detector make_detector(const AprilTagOptions& options, apriltag_family_t* family) {
  Detector detector(apriltag_detector_create(), apriltag_detector_destroy);
  detector->nthreads = options.threads;
  detector->quad_decimate = static_cast<float>(options.decimate);
  apriltag_detector_add_family_bits(detector.get(), family, options.max_hamming);
  return detector;
}

// Eight bits a pixel, the brightest at full scale when there were more.
std::vector<std::uint8_t> eight_bits(const Image& grey) {
  if (grey.type == PixelType::u8) return grey.u8;
  const unsigned brightest =
      std::max<unsigned>(1, *std::max_element(grey.u16.begin(), grey.u16.end()));
  std::vector<std::uint8_t> pixels;
  pixels.reserve(grey.u16.size());
  for (const unsigned value : grey.u16)
    pixels.push_back(static_cast<std::uint8_t>(255 * value / brightest));
  return pixels;
}

// From (-1, -1), (1, -1), (1, 1), (-1, 1) to the corners.
Eigen::Matrix3d homography_to(const std::array<Eigen::Vector2d, 4>& corners) {
  constexpr double x[4] = {-1, 1, 1, -1}, y[4] = {-1, -1, 1, 1};
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d& c = corners[static_cast<std::size_t>(k)];
    a.row(2 * k) << x[k], y[k], 1, 0, 0, 0, -c.x() * x[k], -c.x() * y[k];
    a.row(2 * k + 1) << 0, 0, 0, x[k], y[k], 1, -c.y() * x[k], -c.y() * y[k];
    b.segment<2>(2 * k) = c;
  }
  const Eigen::Matrix<double, 8, 1> h = a.partialPivLu().solve(b);
  Eigen::Matrix3d homography;
  homography << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return homography;
}

AprilTag tag_of(const apriltag_detection_t& found, const Image& grey,
                const AprilTagOptions& options) {
  constexpr double corner_is_origin_px = 0.5, unrefined_px = 0.1;
  AprilTag tag;
  tag.id = found.id;
  tag.family = options.family;
  tag.hamming = found.hamming;
  tag.decision_margin = static_cast<double>(found.decision_margin);
  TagCorners corners;
  for (std::size_t k = 0; k < 4; ++k) {
    corners.px[k] = Eigen::Vector2d(found.p[k][0], found.p[k][1]).array() - corner_is_origin_px;
    corners.covariance_px2[k] = unrefined_px * unrefined_px * Eigen::Matrix2d::Identity();
  }
  TagCorners better = corners;
  tag.refined = options.refine && refine_corners(grey, 1.0 / found.family->width_at_border, better);
  tag.corners_px = tag.refined ? better.px : corners.px;
  tag.covariance_px2 = tag.refined ? better.covariance_px2 : corners.covariance_px2;
  tag.homography = homography_to(tag.corners_px);
  tag.centre_px = tag.homography.col(2).hnormalized();
  return tag;
}

}  // namespace

void AprilTagOptions::validate() const {
  std::string names;
  for (const Family& known : families)
    names += (names.empty() ? "" : ", ") + std::string(known.name);
  require(family_named(family), "family", family, "one of " + names);
  require(decimate >= 1 && decimate <= 8, "decimate", decimate, "between 1 and 8");
  require(threads >= 1, "threads", threads, "at least 1");
  require(max_hamming >= 0 && max_hamming <= 2, "max_hamming", max_hamming, "0, 1 or 2");
  require(min_decision_margin >= 0, "min_decision_margin", min_decision_margin, "zero or positive");
}

std::vector<std::string> april_tag_families() {
  std::vector<std::string> names;
  for (const Family& family : families) names.emplace_back(family.name);
  return names;
}

std::vector<AprilTag> detect_april_tags(const ImageView& image, const AprilTagOptions& options) {
  options.validate();
  image.validate();
  constexpr double least_size_px = 16;  // libapriltag divides the image into tiles
  std::vector<AprilTag> tags;
  if (std::min(image.width, image.height) < least_size_px * options.decimate) return tags;
  const Image grey = to_grey(image);
  std::vector<std::uint8_t> pixels = eight_bits(grey);
  image_u8_t view{grey.width, grey.height, grey.width, pixels.data()};
  const Family& known = *family_named(options.family);
  const FamilyPointer family(known.create(), known.destroy);
  const Detector detector = make_detector(options, family.get());
  const Detections found(apriltag_detector_detect(detector.get(), &view),
                         apriltag_detections_destroy);
  for (int i = 0; i < zarray_size(found.get()); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(found.get(), i, static_cast<void*>(&detection));
    if (static_cast<double>(detection->decision_margin) >= options.min_decision_margin)
      tags.push_back(tag_of(*detection, grey, options));
  }
  std::stable_sort(tags.begin(), tags.end(),
                   [](const AprilTag& a, const AprilTag& b) { return a.id < b.id; });
  return tags;
}

}  // namespace occ
