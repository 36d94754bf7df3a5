// SPDX-License-Identifier: Apache-2.0
// The simulated test field: published precision tables, omitted camera parameters, sources of
// scale, and a Monte Carlo check of the predictions.
#include "libocc/network/test_field.hpp"

#include "tests/network/network_support.hpp"

namespace occ {
namespace {

TestFieldDesign paper_design(double column_sigma_px) {
  TestFieldDesign design;
  design.camera = paper_panorama_camera();
  design.free_parameters = paper_additional_parameters();
  design.sigma_px = {column_sigma_px, 0.19};
  return design;
}

Eigen::Vector3d mean_sigma_m(const Precision& p) {
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  const std::vector<Eigen::Matrix3d> points = p.points();
  for (const Eigen::Matrix3d& q : points)
    variance += q.diagonal() / static_cast<double>(points.size());
  return variance.cwiseSqrt();
}

TEST(TestField, ReproducesThePublishedSigmas) {
  const struct {
    double column_sigma_px;
    Eigen::Vector3d sigma_m;
    double all_m;
  } table[] = {{0.50, {.538e-3, .484e-3, .286e-3}, .778e-3},
               {0.25, {.311e-3, .278e-3, .196e-3}, .461e-3}};
  for (const auto& row : table) {
    const auto p = precision(simulate_test_field(paper_design(row.column_sigma_px)).truth);
    ASSERT_TRUE(p.ok()) << p.message;
    EXPECT_EQ(p->defect(), 7);
    const Eigen::Vector3d sigma = mean_sigma_m(*p);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(sigma[k] / row.sigma_m[k], 1, 0.05) << k;
    EXPECT_NEAR(sigma.norm() / row.all_m, 1, 0.05);
  }
}

/// The published camera with parameter values large enough for each group to be significant.
Camera crooked_camera() {
  RotatingLine line = paper_panorama_camera().line();
  line.angle_per_px_rad *= 1 + 1.883e-4;
  line.c_px += 5.706;
  line.cy_px -= 1.939;
  line.eccentricity_m = {4.324e-3, -5.474e-3, 0};
  line.tilt_x_rad = 1.203e-3;
  line.tilt_y_rad = -2.160e-4;
  line.k1 = 0.016742;
  line.k2 = -0.008762;
  return Camera::rotating_line(line);
}

TEST(TestField, OmittedParametersIncreaseTheResiduals) {
  TestFieldDesign design = paper_design(0.25);
  design.camera = crooked_camera();
  design.start_error_m = 0.01;
  Network network = simulate_test_field(design).network;
  for (ImageObservation& seen : network.observations) seen.sigma_px = {1, 1};
  network.cameras[0].camera = paper_panorama_camera();
  network.cameras[0].free_parameters.clear();
  const struct {
    std::vector<std::string> freed;
    double sigma0_px;
  } ladder[] = {{{}, 2.2},
                {{"c_px", "cy_px"}, 2.05},
                {{"ex_m", "ey_m"}, 1.35},
                {{"tilt_x_rad", "tilt_y_rad"}, 0.90},
                {{"angle_per_px_rad"}, 0.70},
                {{"k1", "k2"}, 0.22}};
  for (const auto& rung : ladder) {
    auto& free = network.cameras[0].free_parameters;
    free.insert(free.end(), rung.freed.begin(), rung.freed.end());
    const auto found = adjust(network, test::plain());
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_NEAR(found->sigma0 / rung.sigma0_px, 1, 0.06);
  }
}

TEST(TestField, ComparesSourcesOfScale) {
  std::vector<ScaleSource> sources(4);
  sources[0].name = "125 tags of 0.15 m";
  sources[0].tags = 125;
  sources[1].name = "125 tags of 0.30 m";
  sources[1].tags = 125;
  sources[1].tag_side_m = 0.30;
  sources[2].name = "bar of 2 m";
  sources[2].bars = 1;
  sources[3].name = "10 m to 0.2 mm";
  sources[3].distances = 1;
  const auto fine = compare_scale(paper_design(0.25), sources);
  const auto coarse = compare_scale(paper_design(0.50), sources);
  ASSERT_TRUE(fine.ok() && coarse.ok()) << fine.message;
  const double ppm[] = {77.5, 44, 128};
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(1e6 * fine.value[k].scale_sigma / ppm[k], 1, 0.06) << fine.value[k].name;
  EXPECT_GT(1e6 * fine.value[3].scale_sigma, 20) << "what the distance itself has";
  EXPECT_LT(1e6 * fine.value[3].scale_sigma, 39);
  EXPECT_GT(1e6 * coarse.value[3].scale_sigma, 39);
  EXPECT_LT(1e6 * coarse.value[3].scale_sigma, 58);
  EXPECT_LT(fine.value[1].at_10_m_sigma_m, 1e-3) << "1 mm at 10 m";
}

TEST(TestField, OneMillimetreAtTenMetres) {
  TestFieldDesign design = paper_design(0.25);
  design.tags = 125;
  design.tag_side_m = 0.30;
  const TestField field = simulate_test_field(design);
  const auto found = adjust(field.network, test::plain());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->defect, 6);
  double squares = 0;
  int pairs = 0;
  for (int i = 0; i < 499; ++i)
    for (int k = i + 1; k < 500; k += 7) {
      const auto length = [&](const Network& network) {
        return (network.points[i].position_m - network.points[k].position_m).norm();
      };
      if (std::abs(length(field.truth) - 10) > 1) continue;
      squares += std::pow(length(found->network) - length(field.truth), 2);
      ++pairs;
    }
  EXPECT_GT(pairs, 500);
  EXPECT_LT(std::sqrt(squares / pairs), 1e-3);
}

TEST(TestField, IsRepeatable) {
  const TestField a = simulate_test_field(paper_design(0.5)),
                  b = simulate_test_field(paper_design(0.5));
  ASSERT_EQ(a.network.observations.size(), b.network.observations.size());
  for (std::size_t i = 0; i < a.network.observations.size(); ++i)
    EXPECT_EQ(a.network.observations[i].pixel, b.network.observations[i].pixel);
  TestFieldDesign design = paper_design(0.5);
  design.stations = 0;
  EXPECT_THROW(simulate_test_field(design), std::invalid_argument);
  design = paper_design(0.5);
  design.station_ring.x() = 1;
  EXPECT_THROW(simulate_test_field(design), std::invalid_argument);
}

/// Sums over the trials of a Monte Carlo experiment.
struct Runs {
  int count = 0;
  double point_squares = 0, chi2 = 0, dof = 0, parameter_squares = 0;
  Eigen::VectorXd squares;  ///< squared normalised errors, one per parameter
};

Runs run_all(const Network& truth, const Precision& bound, int count) {
  Runs runs;
  const std::vector<std::string>& free = truth.cameras[0].free_parameters;
  runs.squares = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(free.size()));
  const Eigen::VectorXd sigma = bound.parameters(0).diagonal().cwiseSqrt();
  for (int run = 0; run < count; ++run) {
    const auto found =
        adjust(noisy_network(truth, 100 + static_cast<std::uint64_t>(run), 0.01), test::plain());
    EXPECT_TRUE(found.ok()) << found.message;
    const auto aligned = in_datum(found->network, truth);
    for (std::size_t i = 0; i < truth.points.size(); ++i)
      runs.point_squares +=
          (aligned->points[i].position_m - truth.points[i].position_m).squaredNorm();
    for (std::size_t k = 0; k < free.size(); ++k) {
      const Eigen::Index row = static_cast<Eigen::Index>(k);
      const double off =
          (test::parameter(*aligned, free[k]) - test::parameter(truth, free[k])) / sigma[row];
      runs.squares[row] += off * off / count;
    }
    runs.chi2 += 2 * found->cost;
    runs.dof += found->redundancy;
    ++runs.count;
  }
  return runs;
}

TEST(SlowTestField, ErrorsReachThePredictedBound) {
  const Network truth = simulate_test_field(paper_design(0.5)).truth;
  const auto bound = precision(truth);
  const Runs runs = run_all(truth, *bound, 200);
  const double predicted = mean_sigma_m(*bound).norm();
  const double rmse =
      std::sqrt(runs.point_squares / (runs.count * static_cast<double>(truth.points.size())));
  RecordProperty("rmse_over_bound", std::to_string(rmse / predicted));
  EXPECT_LT(rmse / predicted, 1.05);
  EXPECT_GT(rmse / predicted, 0.95);
  const auto [low, high] = test::chi2_interval(runs.dof);
  EXPECT_GT(runs.chi2, low);
  EXPECT_LT(runs.chi2, high);
  EXPECT_NEAR(std::sqrt(runs.squares.mean()), 1, 0.05) << runs.squares.transpose();
}

/// Images of a board of 9 x 6 corners in 15 poses.
Network chessboard_views() {
  Network network;
  network.cameras.push_back({"camera",
                             test::small_pinhole(),
                             {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"}});
  NetworkBody board;
  board.name = "board";
  board.fixed = true;
  board.corners_m.resize(3, 54);
  for (int k = 0; k < 54; ++k)
    board.corners_m.col(k) << 0.03 * (k % 9 - 4), 0.03 * (k / 9 - 2.5), 0;
  network.bodies.push_back(board);
  Random random(5, 0);
  while (network.images.size() < 15) {
    const Rigid3 pose{
        so3_exp({random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5)}),
        {random.uniform(-0.1, 0.1), random.uniform(-0.08, 0.08), random.uniform(0.25, 0.5)}};
    std::vector<ImageObservation> seen;
    const int image = static_cast<int>(network.images.size());
    for (int k = 0; k < 54; ++k) {
      const auto pixel =
          network.cameras[0].camera.project(pose * Eigen::Vector3d(board.corners_m.col(k)));
      if (pixel && network.cameras[0].camera.contains(*pixel))
        seen.push_back({image, Target::of_corner(0, k), *pixel, {0.2, 0.2}, true});
    }
    if (seen.size() < 54) continue;
    network.add_image("view " + std::to_string(image), 0, pose);
    network.observations.insert(network.observations.end(), seen.begin(), seen.end());
  }
  return network;
}

TEST(SlowTestField, SigmasOfAChessboardMatchTheErrors) {
  const Network truth = chessboard_views();
  const auto bound = precision(truth);
  ASSERT_TRUE(bound.ok()) << bound.message;
  const Runs runs = run_all(truth, *bound, 800);
  EXPECT_NEAR(std::sqrt(runs.squares.mean()), 1, 0.05) << runs.squares.transpose();
  for (Eigen::Index k = 0; k < runs.squares.size(); ++k)
    EXPECT_NEAR(std::sqrt(runs.squares[k]), 1, 0.1) << k;
  const auto [low, high] = test::chi2_interval(runs.dof);
  EXPECT_GT(runs.chi2, low);
  EXPECT_LT(runs.chi2, high);
}

}  // namespace
}  // namespace occ
