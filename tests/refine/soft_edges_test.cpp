// SPDX-License-Identifier: Apache-2.0
// Lamps with soft edges. They seem to be smaller than they are, all by about as much.
#include <cmath>

#include "libocc/refine/internal/lamp_sizes.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

struct Errors {
  double nees = 0;     ///< mean of that of the position, 3 expected
  double error_m = 0;  ///< root mean square
};

/// Poses from lamps whose edges seem to lie 10 % farther inside or outside (one sigma). `stated`:
/// so the blobs say.
Errors with_soft_edges(Rung rung, bool stated) {
  constexpr int images = 200;
  constexpr double size_sigma = 0.1;
  const test::Measurement measurement{40, 0.05, 0.008};
  const Rigid3 truth = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.radius_m = 0.2;
  RefineOptions options;
  options.rung = rung;
  Random random(7);
  Errors errors;
  double squares_m2 = 0;
  for (int i = 0; i < images; ++i) {
    Scene seen = scene;
    const double size_error = size_sigma * random.normal();
    for (Lamp& lamp : seen.lamps) lamp.radius_m *= 1 + size_error;
    std::vector<Blob> blobs =
        test::noisy(test::exact_blobs(seen, truth, measurement), seen, measurement, random);
    for (Blob& blob : blobs) {
      double radius_px = 0;
      for (const RimPoint& point : blob.rim)
        radius_px += (point.px - blob.centroid_px).norm() / static_cast<double>(blob.rim.size());
      blob.ellipse.semi_major_px = blob.ellipse.semi_minor_px = radius_px;
      if (stated) blob.rim_covariance_px2(0, 0) = std::pow(size_sigma * radius_px, 2);
    }
    const auto refined = refine(truth, test::in_order(scene), blobs, scene, options);
    EXPECT_TRUE(refined.ok()) << refined.message;
    const Eigen::Vector3d off =
        refined->cam_from_world.origin_in_source() - truth.origin_in_source();
    errors.nees +=
        test::nees(off, position_covariance(refined->cam_from_world, refined->covariance)) / images;
    squares_m2 += off.squaredNorm() / images;
  }
  errors.error_m = std::sqrt(squares_m2);
  return errors;
}

TEST(SoftEdges, ChangeTheSizeOfALampAndTheCentreOfItsImage) {
  const Errors rims = with_soft_edges(Rung::rims, true);
  EXPECT_GT(rims.nees, 2.0);
  EXPECT_LT(rims.nees, 4.0);
  EXPECT_LT(rims.error_m, 0.001);
}

TEST(SoftEdges, MakeCentresUncertain) {
  EXPECT_LT(with_soft_edges(Rung::centres, true).nees, 4.5);
  EXPECT_GT(with_soft_edges(Rung::centres, false).nees, 10);  // the test sees it
}

// A light that dims from its middle on has the moments of a smaller disc, and its centre.
TEST(SoftEdges, OfDiscsWithoutRimsShiftTheirCentroids) {
  const Rigid3 truth = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.radius_m = 0.2;
  Scene seen = scene;
  for (Lamp& lamp : seen.lamps) lamp.radius_m = 0.13;
  std::vector<Blob> blobs = test::exact_blobs(seen, truth, {0, 0, 0.01});
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    const auto axes_px =
        internal::refine::predicted_axes_px(seen.lamps[i], truth, seen.camera).value();
    blobs[i].ellipse.semi_minor_px = std::hypot(axes_px[0], 2 * scene.sensor.psf_sigma_px);
    blobs[i].ellipse.semi_major_px = std::hypot(axes_px[1], 2 * scene.sensor.psf_sigma_px);
  }
  const auto refined = refine(truth, test::in_order(scene), blobs, scene);
  ASSERT_TRUE(refined.ok()) << refined.message;
  EXPECT_LT((refined->cam_from_world.origin_in_source() - truth.origin_in_source()).norm(), 2e-4);
}

}  // namespace
}  // namespace occ
