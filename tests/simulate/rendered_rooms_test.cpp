// SPDX-License-Identifier: Apache-2.0
// Compares rendered lamps with images of an independent path tracer: edges and grey levels agree,
// and the residuals are noise.
#include "tests/support/rendered_rooms.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "libocc/simulate/simulate.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

// Fit of the model to the traced image of one lamp: image = background + gain * model, with the
// model shifted by `shift_px` and enlarged by `growth_px`.
struct Comparison {
  double background_dn = 0, gain = 0;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  double growth_px = 0, edge_sigma_px = 0;
  double rms_dn = 0, noise_dn = 0;  // residuals, and the part due to the sensor's noise
};

// `model_dn`: mean grey levels (x, y) above black.
Comparison compare(const Image& picture, const Eigen::MatrixXd& model_dn, const LampTruth& lamp,
                   const Sensor& sensor) {
  Eigen::Vector2d low = lamp.rim_px[0], high = low;
  for (const Eigen::Vector2d& px : lamp.rim_px) {
    low = low.cwiseMin(px);
    high = high.cwiseMax(px);
  }
  const Eigen::Array2i first = (low.array() - 8).max(1).cast<int>();
  const Eigen::Array2i last = (high.array() + 8).min(Eigen::Array2d(638, 478)).cast<int>();
  std::vector<Eigen::Matrix<double, 6, 1>> rows;
  double variance = 0;
  for (int y = first.y(); y <= last.y(); ++y)
    for (int x = first.x(); x <= last.x(); ++x) {
      const Eigen::Vector2d slope(0.5 * (model_dn(x + 1, y) - model_dn(x - 1, y)),
                                  0.5 * (model_dn(x, y + 1) - model_dn(x, y - 1)));
      const Eigen::Vector2d outwards = (Eigen::Vector2d(x, y) - lamp.image_centre_px).normalized();
      const int level = picture.u8[y * picture.width + x];
      rows.emplace_back();
      rows.back() << 1, model_dn(x, y), -slope, -slope.dot(outwards), level;
      variance += std::pow(sensor.noise_dn(model_dn(x, y) / sensor.gain_dn_per_e), 2);
    }
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd design(count, 5);
  Eigen::VectorXd levels(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    design.row(i) = rows[i].head<5>().transpose();
    levels[i] = rows[i][5];
  }
  const Eigen::VectorXd fit = design.colPivHouseholderQr().solve(levels);
  Comparison result;
  result.background_dn = fit[0];
  result.gain = fit[1];
  result.shift_px = fit.segment<2>(2);
  result.growth_px = fit[4];
  result.rms_dn = (design * fit - levels).norm() / std::sqrt(double(count));
  result.noise_dn = std::sqrt(variance / double(count));
  const Eigen::MatrixXd covariance = (design.transpose() * design).inverse();
  result.edge_sigma_px = result.rms_dn * std::sqrt(covariance(2, 2));
  return result;
}

std::vector<Comparison> compare_lamps(const RenderedRoom& room) {
  const Sensor& sensor = room.scene.sensor;
  const double peak_e = 240 / sensor.gain_dn_per_e;
  const Eigen::MatrixXd model_dn =
      sensor.gain_dn_per_e * mean_electrons(room.scene, room.cam_from_world, peak_e);
  std::vector<Comparison> comparisons;
  for (const LampTruth& lamp : simulate(room.scene, room.cam_from_world).lamps)
    if (lamp.whole) comparisons.push_back(compare(room.image, model_dn, lamp, sensor));
  return comparisons;
}

std::vector<std::filesystem::path> unsaturated_rooms() {
  auto paths = rendered_rooms("irregular6");
  for (const auto& path : rendered_rooms("square4")) paths.push_back(path);
  return paths;
}

TEST(RenderedRooms, LampsAgreeWithThePathTracer) {
  const auto paths = unsaturated_rooms();
  if (paths.empty()) GTEST_SKIP() << "rendered rooms are not installed";
  std::vector<Comparison> all;
  for (const auto& path : paths) {
    const RenderedRoom room = read_rendered_room(path);
    const std::vector<Comparison> lamps = compare_lamps(room);
    EXPECT_EQ(lamps.size(), room.whole_lamps.size()) << room.name;
    for (const Comparison& lamp : lamps) {
      // The model only lacks the light that walls reflect onto the ceiling. The traced image has
      // the path tracer's noise in addition to the sensor's.
      EXPECT_NEAR(lamp.background_dn, room.scene.sensor.black_level_dn + 0.05, 0.06) << room.name;
      EXPECT_NEAR(lamp.gain, 1, 0.004) << room.name;
      EXPECT_LT(lamp.rms_dn, 1.1 * lamp.noise_dn) << room.name;
      EXPECT_LT(lamp.shift_px.norm(), 4.5 * lamp.edge_sigma_px) << room.name;
      EXPECT_LT(std::abs(lamp.growth_px), 4.5 * lamp.edge_sigma_px) << room.name;
      EXPECT_LT(lamp.edge_sigma_px, 0.004) << room.name;
      all.push_back(lamp);
    }
  }
  // On average over all lamps, the edges agree to well below 1e-3 px.
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  double growth = 0, gain = 0;
  for (const Comparison& lamp : all) {
    shift += lamp.shift_px / double(all.size());
    growth += lamp.growth_px / double(all.size());
    gain += lamp.gain / double(all.size());
  }
  RecordProperty("mean_shift_px", std::to_string(shift.norm()));
  RecordProperty("mean_growth_px", std::to_string(growth));
  RecordProperty("mean_gain", std::to_string(gain));
  EXPECT_LT(shift.norm(), 0.0015);
  EXPECT_LT(std::abs(growth), 0.0015);
  EXPECT_NEAR(gain, 1, 0.0015);
}

TEST(RenderedRooms, TheComparisonDetectsAHundredthOfAPixel) {
  const auto paths = rendered_rooms("irregular6");
  if (paths.empty()) GTEST_SKIP() << "rendered rooms are not installed";
  RenderedRoom room = read_rendered_room(paths.front());
  const Scene scene = room.scene;
  room.scene.camera = Camera::pinhole(640, 480, scene.camera.fx_px(), scene.camera.fy_px(),
                                      scene.camera.cx_px() - 0.02, scene.camera.cy_px());
  for (const Comparison& lamp : compare_lamps(room)) EXPECT_NEAR(lamp.shift_px.x(), 0.02, 0.01);
  room.scene = scene;
  for (Lamp& lamp : room.scene.lamps) lamp.radius_m *= 0.998;
  for (const Comparison& lamp : compare_lamps(room)) EXPECT_GT(lamp.growth_px, 0.015);
}

}  // namespace
