// SPDX-License-Identifier: Apache-2.0
// The free parameter f_px: both focal lengths in their given ratio.
#include <cmath>

#include "libocc/network/adjust.hpp"
#include "libocc/network/network_statistics.hpp"
#include "libocc/network/precision.hpp"
#include "tests/network/network_support.hpp"

namespace occ {
namespace {

const std::vector<std::string> free_names{"cx_px", "f_px", "k1", "k2", "cy_px"};

Network common_focal_length_network() {
  return test::cloud_network(test::small_pinhole(), free_names, 8, 40);
}

double ratio(const Camera& camera) { return camera.fy_px() / camera.fx_px(); }

TEST(FreeParameter, ScalesBothFocalLengths) {
  const Camera camera = test::small_pinhole();  // 1000 and 1010 px
  EXPECT_EQ(free_parameter(camera, "f_px").value, 1000);
  EXPECT_EQ(free_parameter(camera, "f_px").name, "f_px");
  EXPECT_EQ(free_parameter(camera, "f_px").unit, "px");
  EXPECT_EQ(free_parameter(camera, "fy_px").value, 1010);
  const Camera moved = with_free_parameter(camera, "f_px", 1100);
  EXPECT_EQ(moved.fx_px(), 1100);
  EXPECT_NEAR(moved.fy_px(), 1111, 1e-12);
  EXPECT_EQ(with_free_parameter(camera, "k1", 0.25).distortion()[0], 0.25);
  const Eigen::MatrixXd directions = free_parameter_directions(camera, {"cx_px", "f_px"});
  ASSERT_EQ(directions.rows(), 10);
  EXPECT_EQ(directions.cwiseAbs().sum(), 1 + 1 + 1.01);
  EXPECT_EQ(directions(2, 0), 1);
  EXPECT_EQ(directions(0, 1), 1);
  EXPECT_EQ(directions(1, 1), 1.01);
}

TEST(FreeParameter, UnknownNamesAndBothFocalLengthsAreErrors) {
  const Camera panorama = Camera::rotating_line(test::small_line());
  EXPECT_NE(test::complaint([&] { free_parameter(panorama, "f_px"); }).find("f_px"),
            std::string::npos);
  EXPECT_NE(test::complaint([&] { free_parameter_directions(panorama, {"k3"}); }).find("k3"),
            std::string::npos);
  Network network = common_focal_length_network();
  network.cameras[0].free_parameters = {"f_px", "k1", "fy_px"};
  const std::string text = test::complaint([&] { adjust(network); });
  EXPECT_NE(text.find("cameras[0].free_parameters must be omitted if f_px"), std::string::npos)
      << text;
  EXPECT_NE(text.find("fy_px"), std::string::npos) << text;
}

TEST(FreeParameter, AdjustmentRecoversTheFocalLengthAndKeepsTheRatio) {
  const Network truth = common_focal_length_network();
  Network start = noisy_network(truth, 3, 0.03);
  for (std::size_t i = 0; i < start.observations.size(); ++i)
    start.observations[i].pixel = truth.observations[i].pixel;
  start.cameras[0].camera = with_free_parameter(start.cameras[0].camera, "f_px", 1040);
  const auto found = adjust(start, test::plain());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(found->cost, 1e-12);
  EXPECT_NEAR(found->network.cameras[0].camera.fx_px(), 1000, 1e-4);
  EXPECT_NEAR(ratio(found->network.cameras[0].camera), 1.01, 1e-12);
  EXPECT_EQ(found->unknowns, 5 + 6 * 8 + 3 * 40);
}

// A network with fx_px and fy_px and a tight prior of one of them agrees only in the limit; here
// the reference is the inverse of the normal matrix of finite differences with respect to f_px.
TEST(FreeParameter, PrecisionIsThatOfTheFocalLengths) {
  Network both = common_focal_length_network();
  both.cameras[0].free_parameters = {"cx_px", "fx_px", "fy_px", "k1", "k2", "cy_px"};
  const auto unconstrained = precision(both);
  ASSERT_TRUE(unconstrained.ok()) << unconstrained.message;
  // Conditioning on fy - (fy / fx) fx = 0 (linear): C - C b b^T C / (b^T C b).
  const Eigen::MatrixXd c = unconstrained->parameters(0);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(6);
  b[1] = -1.01;
  b[2] = 1;
  const Eigen::MatrixXd conditioned = c - c * b * b.transpose() * c / b.dot(c * b);
  const auto constrained = precision(common_focal_length_network());
  ASSERT_TRUE(constrained.ok()) << constrained.message;
  const Eigen::MatrixXd found = constrained->parameters(0);
  const int kept[] = {0, 1, 3, 4, 5};
  for (int i = 0; i < 5; ++i)
    for (int k = 0; k < 5; ++k)
      EXPECT_NEAR(found(i, k), conditioned(kept[i], kept[k]),
                  1e-6 * std::sqrt(found(i, i) * found(k, k)))
          << free_names[i] << " " << free_names[k];
}

TEST(FreeParameter, PriorsStatisticsAndUncertaintyUseIt) {
  Network network = noisy_network(common_focal_length_network(), 4, 0.01);
  network.parameter_priors.push_back({0, "f_px", 1003.0, 1e-7});
  const auto found = adjust(network, test::plain());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_NEAR(found->network.cameras[0].camera.fx_px(), 1003, 1e-5);
  EXPECT_NEAR(ratio(found->network.cameras[0].camera), ratio(network.cameras[0].camera), 1e-12);

  network.parameter_priors.clear();
  const auto free = adjust(network, test::plain());
  ASSERT_TRUE(free.ok()) << free.message;
  const auto known = precision(free->network);
  ASSERT_TRUE(known.ok());
  const auto statistics = parameter_statistics(free->network, network, *known);
  ASSERT_EQ(statistics.size(), 5U);
  EXPECT_EQ(statistics[1].name, "f_px");
  EXPECT_EQ(statistics[1].value, free->network.cameras[0].camera.fx_px());
  EXPECT_EQ(statistics[1].nominal, network.cameras[0].camera.fx_px());
  const Camera& camera = free->network.cameras[0].camera;
  const Eigen::MatrixXd covariance = known->parameters(0);
  const Eigen::MatrixXd directions = free_parameter_directions(camera, free_names);
  std::vector<std::string> all;
  for (const CameraParameter& parameter : camera.parameters()) all.push_back(parameter.name);
  const auto by_free = projection_uncertainty(camera, free_names, covariance, 6, 5);
  const auto by_all =
      projection_uncertainty(camera, all, directions * covariance * directions.transpose(), 6, 5);
  EXPECT_NEAR(by_free.mean_px, by_all.mean_px, 1e-9 * by_all.mean_px);
}

TEST(FreeParameter, SelectionFixesItAtItsNominalValue) {
  Network network = noisy_network(common_focal_length_network(), 5, 0.0);
  network.cameras[0].free_parameters = {"f_px", "cx_px", "k1", "p1"};
  network.cameras[0].camera = with_free_parameter(network.cameras[0].camera, "p1", 1e-3);
  SelectOptions options;
  options.keep = {"cx_px", "k1"};
  options.adjust = test::plain();
  const auto chosen = select_parameters(network, options);
  ASSERT_TRUE(chosen.ok()) << chosen.message;
  const Camera& camera = chosen->adjustment.network.cameras[0].camera;
  EXPECT_NEAR(ratio(camera), 1.01, 1e-12);
  const auto& kept = chosen->adjustment.network.cameras[0].free_parameters;
  if (std::find(kept.begin(), kept.end(), "f_px") == kept.end()) {
    EXPECT_EQ(camera.fx_px(), network.cameras[0].camera.fx_px());
  }
}

}  // namespace
}  // namespace occ
