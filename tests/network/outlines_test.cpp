// SPDX-License-Identifier: Apache-2.0
// Outlines about points: orientation, size and growth from linearised observations.
#include "libocc/geometry/so3.hpp"
#include "tests/network/network_support.hpp"

namespace occ {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int rows_of_outline = 5;
constexpr double growth_px = 0.2;

VectorXd parameters_of(const Camera& camera) {
  const auto all = camera.parameters();
  VectorXd values(static_cast<Index>(all.size()));
  for (std::size_t k = 0; k < all.size(); ++k) values[static_cast<Index>(k)] = all[k].value;
  return values;
}

/// The unknowns u of an outline by their definition (OutlineObservation).
Eigen::Matrix<double, 8, 1> unknowns_of(const Network& network, const OutlineObservation& outline) {
  const ImageObservation& centre = network.observations[outline.observation];
  const NetworkPoint& point = network.points[centre.target.point];
  const Rigid3 pose = network.cam_from_world(centre.image);
  const Vector2d& size = point.outline->size_m;
  Eigen::Matrix<double, 8, 1> u;
  const Matrix3d rotation = pose.rotation * point.outline->world_from_outline;
  const Matrix3d& reference = outline.cam_from_outline.rotation;
  u << so3_log(point.outline->is_round ? shortest_rotation(reference.col(2), rotation.col(2))
                                       : Matrix3d(rotation * reference.transpose())),
      pose * point.position_m * std::sqrt(outline.size_m.prod() / size.prod()) -
          outline.cam_from_outline.translation,
      std::log(size[0] / size[1]) - std::log(outline.size_m[0] / outline.size_m[1]),
      network.cameras[network.images[centre.image].camera].outline_growth_px;
  return u;
}

/// Network with outlines about its first points, alternately round and not, without errors.
Network network_with_outlines(const std::vector<std::string>& free, bool with_rig = false) {
  Network network = test::cloud_network(test::small_pinhole(), free, 6, 14);
  if (with_rig) {
    network.mounts.push_back(
        {"mount", Rigid3{so3_exp(Vector3d(0.1, -0.2, 0.3)), Vector3d(0.1, 0.05, -0.1)}, false});
    for (std::size_t i = 0; i < network.images.size(); ++i) {
      network.images[i].mount = 0;
      Rigid3& pose = network.stations[i].station_from_world;
      pose = network.mounts[0].cam_from_station.inverse() * pose;
    }
  }
  network.cameras[0].outline_growth_px = growth_px;
  network.cameras[0].outline_growth_sigma_px = 0.5;
  Random random(5, 0);
  for (int i = 0; i < 6; ++i) {
    NetworkOutline outline;
    outline.world_from_outline = so3_exp(test::random_vector(random));
    outline.is_round = i % 2 == 0;
    outline.size_m = outline.is_round ? Vector2d(0.3, 0.3) : Vector2d(0.6, 0.3);
    network.points[i].outline = outline;
  }
  for (std::size_t k = 0; k < network.observations.size(); ++k) {
    const int point = network.observations[k].target.point;
    if (point >= 6) continue;
    const NetworkOutline& truth = *network.points[point].outline;
    const Rigid3 pose = network.cam_from_world(network.observations[k].image);
    OutlineObservation outline;
    outline.observation = static_cast<int>(k);
    const Vector3d turn = 0.02 * test::random_vector(random);
    const Vector3d shift = 0.02 * test::random_vector(random);
    outline.cam_from_outline.rotation = so3_exp(turn) * pose.rotation * truth.world_from_outline;
    outline.cam_from_outline.translation = pose * network.points[point].position_m + shift;
    outline.size_m = 1.03 * truth.size_m;
    outline.rows.resize(rows_of_outline, 8);
    for (Index r = 0; r < rows_of_outline; ++r) {
      for (Index c = 0; c < 8; ++c) outline.rows(r, c) = 30 * random.normal();
      outline.rows(r, 7) /= 10;
    }
    if (!free.empty()) {
      outline.camera_parameters = parameters_of(network.cameras[0].camera);
      outline.by_camera =
          0.02 * outline.rows.leftCols(1).replicate(1, outline.camera_parameters.size());
      outline.camera_parameters[0] += 2;
    }
    outline.centre_rows = 0.1 * outline.rows.topRows<2>();
    const Eigen::Matrix<double, 8, 1> u = unknowns_of(network, outline);
    outline.constant = -outline.rows * u;
    if (!free.empty())
      outline.constant -= outline.by_camera *
                          (parameters_of(network.cameras[0].camera) - outline.camera_parameters);
    network.observations[k].pixel += outline.centre_rows * u;
    network.outlines.push_back(outline);
  }
  network.stations[0].fixed = network.stations[3].fixed = true;  // the datum
  network.stations[1].fixed = with_rig;                          // the mount needs two motions
  return network;
}

/// Noise on all observations, and start values with errors.
Network with_errors(const Network& truth, std::uint64_t seed, double noise) {
  Network network = noisy_network(truth, seed, 0.01);
  if (noise == 0)
    for (std::size_t k = 0; k < network.observations.size(); ++k)
      network.observations[k].pixel = truth.observations[k].pixel;
  Random random(seed, 77);
  network.cameras[0].outline_growth_px = 0;
  for (NetworkPoint& point : network.points)
    if (point.outline) {
      const Vector3d turn = 0.03 * test::random_vector(random);
      point.outline->world_from_outline = so3_exp(turn) * point.outline->world_from_outline;
      point.outline->size_m *= 1.05;
    }
  for (OutlineObservation& outline : network.outlines)
    for (double& value : outline.constant) value += noise * random.normal();
  return network;
}

/// Errors of a point and its outline, in the order of Precision::outline().
VectorXd errors_of(const NetworkPoint& found, const NetworkPoint& truth) {
  const NetworkOutline &a = *found.outline, &b = *truth.outline;
  const Vector3d turn = so3_log(a.world_from_outline * b.world_from_outline.transpose());
  const Vector2d sizes = (a.size_m.array() / b.size_m.array()).log();
  VectorXd errors(a.is_round ? 6 : 8);
  errors.head<3>() = found.position_m - truth.position_m;
  if (a.is_round)
    errors.tail<3>() << b.world_from_outline.leftCols<2>().transpose() * turn, sizes[0];
  else
    errors.tail<5>() << turn, sizes;
  return errors;
}

void expect_recovers(const Network& truth) {
  const Result<Adjustment> adjusted = adjust(with_errors(truth, 3, 0), test::plain());
  ASSERT_EQ(adjusted.status, Status::ok) << adjusted.message;
  // Only the known growth of zero contradicts the truth.
  EXPECT_LT(adjusted->cost, 0.5 * square(growth_px / 0.5) + 1e-9);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(errors_of(adjusted->network.points[i], truth.points[i]).norm(), 0.01) << i;
  Network without_prior = truth;
  without_prior.cameras[0].outline_growth_sigma_px = 1e6;
  const Result<Adjustment> exact = adjust(with_errors(without_prior, 3, 0), test::plain());
  ASSERT_EQ(exact.status, Status::ok) << exact.message;
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(errors_of(exact->network.points[i], truth.points[i]).norm(), 1e-7) << i;
  EXPECT_NEAR(exact->network.cameras[0].outline_growth_px, growth_px, 1e-6);
}

TEST(Outlines, AreRecoveredWithoutNoise) { expect_recovers(network_with_outlines({})); }

TEST(Outlines, AreRecoveredWithACameraThatIsCalibratedAlong) {
  const Network truth = network_with_outlines({"f_px", "cx_px", "k1"});
  expect_recovers(truth);
}

TEST(Outlines, AreRecoveredOnARig) { expect_recovers(network_with_outlines({}, true)); }

/// Mean square error over its covariance per unknown, and sigma0 squared, of many trials.
TEST(Outlines, ErrorsMatchTheirCovariance) {
  Network truth = network_with_outlines({"f_px", "k1"});
  constexpr int trials = 60;
  double round = 0, other = 0, variance = 0, growth = 0;
  for (int seed = 1; seed <= trials; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), 9);
    const double shift = 0.5 * random.normal();  // growth by its prior
    Network network = with_errors(truth, static_cast<std::uint64_t>(seed), 1);
    for (OutlineObservation& outline : network.outlines) {
      outline.constant -= outline.rows.col(7) * (shift - growth_px);
      network.observations[outline.observation].pixel +=
          outline.centre_rows.col(7) * (shift - growth_px);
    }
    const Result<Adjustment> adjusted = adjust(network, test::plain());
    ASSERT_EQ(adjusted.status, Status::ok) << adjusted.message;
    const Result<Precision> precise = precision(adjusted->network);
    ASSERT_EQ(precise.status, Status::ok) << precise.message;
    for (int i = 0; i < 6; ++i) {
      const VectorXd errors = errors_of(adjusted->network.points[i], truth.points[i]);
      const double nees = errors.dot(precise->outline(i).llt().solve(errors));
      (i % 2 == 0 ? round : other) += nees / static_cast<double>(3 * trials * errors.size());
      const Matrix3d block = precise->outline(i).topLeftCorner<3, 3>();
      EXPECT_TRUE(block.isApprox(precise->points()[i], 1e-9));
      EXPECT_TRUE(block.isApprox(precise->point(i), 1e-9));
    }
    variance += square(adjusted->sigma0) / trials;
    growth += square((adjusted->network.cameras[0].outline_growth_px - shift) /
                     precise->outline_growth_sigma_px(0)) /
              trials;
  }
  EXPECT_NEAR(variance, 1, 0.05);  // redundancy of about 250 in each of 60 trials
  EXPECT_NEAR(round, 1, 0.2);
  EXPECT_NEAR(other, 1, 0.2);
  EXPECT_NEAR(growth, 1, 0.5);
}

/// Points at the ends of a distance are not eliminated; a distance without weight changes nothing.
TEST(Outlines, OfPointsWithDistancesGiveTheSame) {
  Network network = with_errors(network_with_outlines({"f_px"}), 4, 1);
  const Result<Adjustment> eliminated = adjust(network, test::plain());
  test::add_distance(network, 0, 1, 1e7);
  test::add_distance(network, 2, 12, 1e7);
  const Result<Adjustment> direct = adjust(network, test::plain());
  ASSERT_EQ(direct.status, Status::ok) << direct.message;
  const Result<Precision> a = precision(eliminated->network), b = precision(direct->network);
  for (int i = 0; i < 6; ++i) {
    EXPECT_LT(errors_of(direct->network.points[i], eliminated->network.points[i]).norm(), 1e-8);
    EXPECT_TRUE(a->outline(i).isApprox(b->outline(i), 1e-7));
  }
  EXPECT_EQ(direct->observations, eliminated->observations + 2);
  EXPECT_EQ(direct->unknowns, eliminated->unknowns);
}

TEST(Outlines, OfAFreeNetworkKeepTheDefect) {
  Network truth = network_with_outlines({});
  truth.stations[0].fixed = truth.stations[3].fixed = false;
  const Result<Adjustment> adjusted = adjust(with_errors(truth, 6, 1), test::plain());
  ASSERT_EQ(adjusted.status, Status::ok) << adjusted.message;
  EXPECT_EQ(adjusted->defect, 7);
  EXPECT_EQ(adjusted->unknowns, 6 * 6 + 14 * 3 + 3 * 3 + 3 * 5 + 1);
  // Another frame and scale change neither the residuals nor the relative precision.
  Similarity similarity;
  similarity.scale = 2;
  similarity.rotation = so3_exp(Vector3d(0.3, -0.5, 0.2));
  similarity.translation = Vector3d(1, 2, 3);
  const Network moved = transformed(adjusted->network, similarity);
  const Result<Adjustment> again = adjust(moved, test::plain());
  ASSERT_EQ(again.status, Status::ok) << again.message;
  EXPECT_NEAR(again->cost, adjusted->cost, 1e-9 * adjusted->cost);
  EXPECT_LT(test::worst_distance(again->network, moved), 1e-7);
  const Result<Precision> a = precision(adjusted->network), b = precision(moved);
  ASSERT_TRUE(a.ok() && b.ok());
  const Matrix3d expected = 4 * similarity.rotation * a->point(0) * similarity.rotation.transpose();
  EXPECT_TRUE(b->point(0).isApprox(expected, 1e-7));
  EXPECT_NEAR(a->outline(0)(5, 5), b->outline(0)(5, 5), 1e-9);
}

/// Two points leave a rotation open, which their outlines determine.
TEST(Outlines, OfTwoPointsDetermineADatum) {
  Network network = network_with_outlines({});
  network.stations[0].fixed = network.stations[3].fixed = false;
  Similarity similarity;
  similarity.scale = 1.2;
  similarity.rotation = so3_exp(Vector3d(0.1, -0.2, 0.15));
  similarity.translation = Vector3d(0.1, 0.2, -0.3);
  Network without = network;
  without.outlines.clear();
  for (const int first : {0, 1}) {  // round ones, others
    const Datum datum{DatumKind::inner, {Target::of_point(first), Target::of_point(first + 2)}};
    EXPECT_EQ(precision(without, datum).status, Status::degenerate);
    const Result<Precision> known = precision(network, datum);
    ASSERT_EQ(known.status, Status::ok) << known.message;
    EXPECT_TRUE(known->outline(first).allFinite());
    const Result<Network> back = in_datum(transformed(network, similarity), network, datum);
    ASSERT_EQ(back.status, Status::ok) << back.message;
    EXPECT_LT(test::worst_distance(*back, network), 1e-9);
  }
}

TEST(Outlines, ImproveThePoses) {
  const Network truth = network_with_outlines({});
  Network without = truth;
  without.outlines.clear();
  const Result<Precision> a = precision(truth), b = precision(without);
  ASSERT_TRUE(a.ok() && b.ok());
  for (const int station : {1, 2, 4, 5})
    EXPECT_LT(a->station(station).trace(), 0.95 * b->station(station).trace());
}

TEST(Outlines, OfARejectedCentreAreNotUsed) {
  const Network truth = network_with_outlines({});
  Network network = with_errors(truth, 8, 1);
  const Result<Adjustment> clean = adjust(network);
  ASSERT_EQ(clean.status, Status::ok) << clean.message;
  const int wrong = network.outlines[4].observation;
  network.observations[wrong].pixel += Vector2d(30, -20);
  network.outlines[4].constant.setConstant(500);
  const Result<Adjustment> adjusted = adjust(network);
  ASSERT_EQ(adjusted.status, Status::ok) << adjusted.message;
  ASSERT_EQ(adjusted->rejected.size(), 1);
  EXPECT_EQ(adjusted->rejected[0].observation, wrong);
  EXPECT_EQ(adjusted->observations, clean->observations - 2 - rows_of_outline);
  EXPECT_LT(adjusted->sigma0, 1.3);
}

TEST(Outlines, InvalidOnesThrow) {
  const Network good = network_with_outlines({"k1"});
  const auto broken = [&](const char* message, const std::function<void(Network&)>& change) {
    Network network = good;
    change(network);
    EXPECT_NE(test::complaint([&] { check_network(network); }).find(message), std::string::npos)
        << message;
  };
  broken("outlines[1].observation",
         [](Network& n) { n.outlines[1].observation = static_cast<int>(n.observations.size()); });
  broken("outlines[1].observation",
         [](Network& n) { n.outlines[1].observation = n.outlines[0].observation; });
  broken("of a point with an outline", [](Network& n) { n.points[0].outline.reset(); });
  broken("outlines[0].size_m", [](Network& n) { n.outlines[0].size_m[1] = 0; });
  broken("outlines[0].rows", [](Network& n) { n.outlines[0].rows(1, 2) = infinity; });
  broken("outlines[0].constant", [](Network& n) { n.outlines[0].constant.resize(2); });
  broken("outlines[0].by_camera", [](Network& n) { n.outlines[0].by_camera.resize(0, 0); });
  broken("outlines[0].camera_parameters",
         [](Network& n) { n.outlines[0].camera_parameters.resize(1); });
  broken("none: its camera is known", [](Network& n) { n.cameras[0].free_parameters.clear(); });
  broken("two equal sizes", [](Network& n) { n.points[0].outline->size_m[0] = 9; });
  broken("points[1].outline.size_m", [](Network& n) { n.points[1].outline->size_m[0] = -1; });
  broken("outline_growth_sigma_px", [](Network& n) { n.cameras[0].outline_growth_sigma_px = -1; });
  broken("outline_growth_px", [](Network& n) { n.cameras[0].outline_growth_px = infinity; });
}

}  // namespace
}  // namespace occ
