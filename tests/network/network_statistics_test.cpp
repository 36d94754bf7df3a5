// SPDX-License-Identifier: Apache-2.0
// Statistics of adjusted networks: redundancy, tests, reliability, parameters, variance components.
#include "libocc/network/network_statistics.hpp"

#include <algorithm>

#include "tests/network/network_support.hpp"

namespace occ {
namespace {

Network adjusted(const Network& truth, std::uint64_t seed) {
  const auto found = adjust(noisy_network(truth, seed, 0.01), test::plain());
  EXPECT_TRUE(found.ok()) << found.message;
  return found->network;
}

TEST(NetworkStatistics, RedundancyNumbersSumToTheRedundancy) {
  Network tags = test::pinhole_network();
  test::add_tag(tags, {so3_exp({0.3, 0.1, 0}), {1, 2, 3}}, 0.4, true);
  Network fixed = test::pinhole_network();
  fixed.stations[0].fixed = fixed.stations[1].fixed = fixed.points[3].fixed = true;
  for (const Network& truth : {test::line_network(), test::pinhole_network(), tags, fixed}) {
    const auto s = network_statistics(adjusted(truth, 3));
    ASSERT_TRUE(s.ok()) << s.message;
    EXPECT_GT(s->redundancy, 50);
    EXPECT_NEAR(s->image_redundancy, s->redundancy, 1e-6 * s->redundancy);
    for (const ObservationStatistics& one : s->image_observations) {
      EXPECT_GE(one.redundancy.minCoeff(), 0);
      EXPECT_LE(one.redundancy.maxCoeff(), 1);
    }
    EXPECT_LT(s->sigma0_low, 1);
    EXPECT_GT(s->sigma0_high, 1);
  }
  // A distance has a redundancy number, too.
  Network network = test::line_network();
  test::add_distance(network, 1, 7, 1e-3);
  test::add_distance(network, 2, 5, 1e-3);
  const auto s = network_statistics(adjusted(network, 3));
  EXPECT_LT(s->image_redundancy, s->redundancy);
  EXPECT_GT(s->image_redundancy, s->redundancy - 2);
  double sum = s->image_redundancy;
  for (const DistanceStatistics& one : s->distances) {
    EXPECT_TRUE(one.used);
    EXPECT_NEAR(one.detectable_m, 4.13e-3 / std::sqrt(one.redundancy), 1e-12);
    sum += one.redundancy;
  }
  EXPECT_NEAR(sum, s->redundancy, 1e-6 * s->redundancy);
}

TEST(NetworkStatistics, RedundancyIsThePartOfAnErrorInItsResidual) {
  const Network before = adjusted(test::line_network(), 3);
  const auto s = network_statistics(before);
  for (const std::size_t i : {5U, 60U, 131U}) {
    for (int axis = 0; axis < 2; ++axis) {
      Network wrong = before;
      constexpr double error_px = 1e-3;
      wrong.observations[i].pixel[axis] += error_px;
      const auto again = adjust(wrong, test::plain());
      const double stays =
          image_residuals_px(again->network)[i][axis] - image_residuals_px(before)[i][axis];
      EXPECT_NEAR(stays / error_px, s->image_observations[i].redundancy[axis], 1e-4);
    }
  }
}

TEST(NetworkStatistics, AWrongTagSizeAppearsInTheDistanceResidual) {
  Network network = test::line_network(6, 40);
  for (int k = 0; k < 4; ++k)
    test::add_tag(network, {so3_exp({0.3 * k, 0.2, 0.1}), {0.5 + 0.4 * k, 2, 3}}, 0.4);
  test::add_distance(network, 1, 7, 1e-3);
  Network wrong = noisy_network(network, 3, 0.01);
  EXPECT_LT(std::abs(network_statistics(adjust(wrong, test::plain())->network)->distances[0].w), 4);
  for (NetworkBody& tag : wrong.bodies) tag.corners_m *= 1.1;
  const auto s = network_statistics(adjust(wrong, test::plain())->network);
  EXPECT_GT(std::abs(s->distances[0].w), 6);
}

TEST(NetworkStatistics, ReliabilityFollowsFromRedundancy) {
  const auto s = network_statistics(adjusted(test::pinhole_network(), 3));
  const ObservationStatistics& one = s->image_observations[4];
  const double r = one.redundancy.x();
  EXPECT_NEAR(one.detectable_px.x(), 4.13 * 0.3 / std::sqrt(r), 1e-12);
  EXPECT_NEAR(one.external.x(), 4.13 * std::sqrt((1 - r) / r), 1e-12);
  EXPECT_NEAR(one.w.x(), one.residual_px.x() / (0.3 * std::sqrt(r)), 1e-12);
  EXPECT_NEAR(one.tau.x(), one.w.x() / s->sigma0, 1e-12);
  EXPECT_GT(s->w_critical, 4);
  EXPECT_LT(s->w_critical, 5);
  EXPECT_NEAR(s->tau_critical, s->w_critical, 0.2) << "for hundreds of observations the same";
}

TEST(NetworkStatistics, NormalisedResidualsAreNormal) {
  std::vector<double> all;
  const Network truth = test::pinhole_network();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto s = network_statistics(adjusted(truth, seed));
    for (const ObservationStatistics& one : s->image_observations)
      for (int k = 0; k < 2; ++k)
        if (one.redundancy[k] > 0.01) all.push_back(one.w[k]);
  }
  double squares = 0, beyond = 0;
  for (const double w : all) {
    squares += w * w;
    beyond += std::abs(w) > 1.96;
  }
  const double n = static_cast<double>(all.size());
  EXPECT_GT(n, 5000);
  EXPECT_NEAR(squares / n, 1, 0.05);
  EXPECT_NEAR(beyond / n, 0.05, 0.01);
}

TEST(NetworkStatistics, TestsTheSignificanceOfParameters) {
  Network truth = test::line_network(8, 60);
  truth.cameras[0].free_parameters.push_back("tumbling1_rad");  // absent in the data
  Network nominal = truth;
  RotatingLine ideal = test::small_line();
  ideal.tilt_x_rad = ideal.tilt_y_rad = ideal.k1 = ideal.k2 = 0;
  ideal.eccentricity_m.setZero();
  nominal.cameras[0].camera = Camera::rotating_line(ideal);
  Network start = noisy_network(truth, 4, 0.01);
  start.cameras[0].camera = nominal.cameras[0].camera;
  const auto found = adjust(start, test::plain());
  ASSERT_TRUE(found.ok()) << found.message;
  const auto p = precision(found->network);
  const auto parameters = parameter_statistics(found->network, nominal, *p);
  ASSERT_EQ(parameters.size(), 10U);
  for (const ParameterStatistics& one : parameters) {
    const bool there = one.name == "ex_m" || one.name == "tilt_x_rad";
    EXPECT_TRUE(one.significant || !there) << one.name;
    EXPECT_TRUE(one.t < 4 || one.name != "tumbling1_rad");
    EXPECT_GT(one.sigma, 0);
    EXPECT_LE(std::abs(one.correlation), 1);
    EXPECT_FALSE(one.correlated_with.empty());
    EXPECT_EQ(one.highly_correlated, std::abs(one.correlation) > 0.9) << one.name;
    EXPECT_TRUE(one.name != "k1" || one.correlated_with == "k2");
  }
  EXPECT_THROW(parameter_statistics(found->network, Network{}, *p), std::invalid_argument);
}

TEST(NetworkStatistics, SelectionKeepsSignificantParameters) {
  RotatingLine line = test::small_line();
  line.k2 = line.eccentricity_m.y() = 0;
  Network truth =
      test::cloud_network(Camera::rotating_line(line), paper_additional_parameters(), 8, 80);
  for (const char* name : {"tumbling1_rad", "tumbling2_rad", "tumbling5_rad"})
    truth.cameras[0].free_parameters.push_back(name);
  Network start = noisy_network(truth, 6, 0.01);
  RotatingLine ideal;
  ideal.width = line.width;
  ideal.height = line.height;
  ideal.c_px = line.c_px;
  ideal.cy_px = line.cy_px;
  start.cameras[0].camera = Camera::rotating_line(ideal);
  SelectOptions options;
  options.keep = {"c_px", "cy_px"};
  const auto chosen = select_parameters(start, options);
  ASSERT_TRUE(chosen.ok()) << chosen.message;
  const auto& kept = chosen->adjustment.network.cameras[0].free_parameters;
  const auto has = [&](const char* name) {
    return std::find(kept.begin(), kept.end(), name) != kept.end();
  };
  for (const char* name : {"c_px", "cy_px", "tilt_x_rad", "tilt_y_rad", "ex_m", "k1"})
    EXPECT_TRUE(has(name)) << name;
  EXPECT_FALSE(has("tumbling1_rad") && has("tumbling2_rad") && has("tumbling5_rad"));
  EXPECT_GE(chosen->steps.size(), 4U);
  EXPECT_TRUE(chosen->steps[0].dropped.empty());
  EXPECT_EQ(chosen->steps[1].reason, "not significant");
  EXPECT_LT(chosen->steps.back().bic, chosen->steps[0].bic);
  EXPECT_NEAR(chosen->adjustment.sigma0, 1, 0.15);
}

TEST(NetworkStatistics, SelectionComparesWithTheNominalCamera) {
  const Network truth = test::pinhole_network(8, 60);
  Network start = noisy_network(truth, 6, 0.01);
  start.cameras[0].camera = adjust(start)->network.cameras[0].camera;
  const auto has_focal_length = [](const Result<Selection>& chosen) {
    const auto& kept = chosen->adjustment.network.cameras[0].free_parameters;
    return std::count(kept.begin(), kept.end(), "fx_px") == 1;
  };
  EXPECT_FALSE(has_focal_length(select_parameters(start, {})))
      << "an estimate equals itself, which is why there are nominal cameras";
  SelectOptions options;
  options.nominal = {Camera::pinhole(1280, 960, 960, 960, 639.5, 479.5, {0, 0, 0, 0, 0})};
  const auto chosen = select_parameters(start, options);
  ASSERT_TRUE(chosen.ok()) << chosen.message;
  EXPECT_TRUE(has_focal_length(chosen));
  options.nominal.push_back(options.nominal[0]);
  EXPECT_NE(test::complaint([&] { select_parameters(start, options); }).find("nominal"),
            std::string::npos);
  options.nominal = {Camera::rotating_line(test::small_line())};
  EXPECT_NE(test::complaint([&] { select_parameters(start, options); }).find("nominal"),
            std::string::npos);
}

TEST(NetworkStatistics, SelectionDropsUndeterminedParameters) {
  TestFieldDesign design;
  design.camera = paper_panorama_camera();
  design.free_parameters = {"ex_m", "ez_m", "cy_px"};  // e_z is equivalent to the station's height
  design.targets = 80;
  const auto chosen = select_parameters(simulate_test_field(design).network, {});
  ASSERT_TRUE(chosen.ok()) << chosen.message;
  const auto& kept = chosen->adjustment.network.cameras[0].free_parameters;
  EXPECT_EQ(std::count(kept.begin(), kept.end(), "ez_m"), 0);
}

TEST(NetworkStatistics, VarianceComponentsFindEachAxis) {
  Network truth = test::line_network(8, 80);
  for (ImageObservation& seen : truth.observations) seen.sigma_px = {0.5, 0.19};
  Network start = noisy_network(truth, 8, 0.01);
  for (ImageObservation& seen : start.observations) seen.sigma_px = {0.3, 0.3};
  const auto found = variance_components(start, test::plain());
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->components.size(), 2U);
  EXPECT_NEAR(0.3 * found->components[0].factor, 0.5, 0.05);
  EXPECT_NEAR(0.3 * found->components[1].factor, 0.19, 0.02);
  EXPECT_NEAR(found->adjustment.network.observations[0].sigma_px.x(),
              0.3 * found->components[0].factor, 1e-9);
  EXPECT_NEAR(found->adjustment.sigma0, 1, 0.01);
}

TEST(NetworkStatistics, CheckPointsAgreeWithPrediction) {
  const Network truth = test::line_network(8, 120);
  const Network found = adjusted(truth, 5);
  std::vector<CheckPoint> points;
  for (int k = 0; k < 120; ++k) points.push_back({Target::of_point(k), truth.points[k].position_m});
  const auto check = check_points(found, *precision(found), points);
  ASSERT_TRUE(check.ok()) << check.message;
  EXPECT_NEAR(check->rmse_3d_m / check->predicted_3d_m, 1, 0.2);
  EXPECT_EQ(check->errors_m.size(), 120U);
  EXPECT_THROW(check_points(found, *precision(found), {}), std::invalid_argument);
  points.resize(2);
  EXPECT_EQ(check_points(found, *precision(found), points).status, Status::degenerate);
}

TEST(NetworkStatistics, ProjectionUncertaintyIgnoresASmallRotation) {
  const Camera camera = test::small_pinhole();
  // An uncertain principal point is nearly equivalent to a rotation.
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(1, 1);
  const auto centre = projection_uncertainty(camera, {"cx_px"}, one, 24, 18);
  EXPECT_LT(centre.mean_px, 0.25);
  const auto focal = projection_uncertainty(camera, {"fx_px"}, one, 24, 18);
  EXPECT_GT(focal.worst_px, 0.5) << "640 px from the middle over 1000 px";
  EXPECT_LT(focal.sigma_px(9, 12), 0.1);
  EXPECT_EQ(focal.sigma_px.rows(), 18);
  // At a finite range, a translation compensates another part.
  EXPECT_LE(projection_uncertainty(camera, {"fx_px"}, one, 24, 18, 3.0).mean_px, focal.mean_px);
  EXPECT_THROW(projection_uncertainty(camera, {"fq"}, one, 24, 18), std::invalid_argument);
  EXPECT_THROW(projection_uncertainty(camera, {"fx_px"}, one, 1, 18), std::invalid_argument);
  EXPECT_THROW(projection_uncertainty(camera, {}, one, 10, 18), std::invalid_argument);
}

TEST(NetworkStatistics, ReportsUndeterminedParameters) {
  const auto none = network_statistics(Network{});
  EXPECT_EQ(none.status, Status::too_few_lamps);
  EXPECT_THROW(network_statistics(test::line_network(), 0), std::invalid_argument);
}

}  // namespace
}  // namespace occ
