// SPDX-License-Identifier: Apache-2.0
// The adjustment of networks: exactness, parity with Ceres, gross errors, far starts, bad input.
#include "libocc/network/adjust.hpp"

#include <cstring>
#include <set>

#include "libocc/core/math.hpp"
#include "libocc/network/network_statistics.hpp"
#include "tests/network/ceres_adjust.hpp"
#include "tests/network/network_support.hpp"

namespace occ {
namespace {

using test::plain;

TEST(Adjust, RecoversANoiseFreeNetworkExactly) {
  const Network cases[] = {
      test::pinhole_network(),
      test::cloud_network(test::small_fisheye(), {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2"}),
      test::cloud_network(Camera::double_sphere(1280, 960, 700, 701, 640, 480, -0.2, 0.55),
                          {"fx_px", "fy_px", "cx_px", "cy_px"}),
      test::line_network()};
  for (const Network& truth : cases) {
    SCOPED_TRACE(name_of(truth.cameras[0].camera.kind()));
    Network start = noisy_network(truth, 3, 0.03);
    for (std::size_t i = 0; i < start.observations.size(); ++i)
      start.observations[i].pixel = truth.observations[i].pixel;
    const auto found = adjust(start, plain());
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_EQ(found->defect, 7);
    EXPECT_LT(found->cost, 1e-12);
    EXPECT_LE(found->iterations, 12);
    const auto aligned = in_datum(found->network, truth);
    ASSERT_TRUE(aligned.ok());
    EXPECT_LT(test::worst_distance(*aligned, truth), 1e-8);
    for (const std::string& name : truth.cameras[0].free_parameters)
      EXPECT_NEAR(test::parameter(*aligned, name), test::parameter(truth, name),
                  1e-7 * std::max(1.0, std::abs(test::parameter(truth, name))))
          << name;
  }
}

void expect_parity(const Network& network) {
  const auto own = adjust(network, plain());
  ASSERT_TRUE(own.ok()) << own.message;
  const test::CeresResult reference = test::ceres_adjust(network);
  ASSERT_TRUE(reference.converged);
  EXPECT_NEAR(own->cost, reference.cost, 1e-9 * reference.cost);
  const auto a = in_datum(own->network, network), b = in_datum(reference.network, network);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_LT(test::worst_distance(*a, *b), 1e-8);
  // Ceres stops where the rounding of the cost hides a smaller one, 1e-6 sigmas from the minimum,
  // by a path that depends on the addresses of its blocks.
  const auto covariances = precision(own->network);
  ASSERT_TRUE(covariances.ok()) << covariances.message;
  for (const ParameterStatistics& one : parameter_statistics(own->network, network, *covariances)) {
    const double expected = test::parameter(*b, one.name);
    EXPECT_NEAR(test::parameter(*a, one.name), expected,
                1e-8 * std::max(1.0, std::abs(expected)) + 5e-6 * one.sigma)
        << one.name;
  }
  for (std::size_t i = 0; i < network.stations.size(); ++i)
    EXPECT_LT(
        difference(a->stations[i].station_from_world, b->stations[i].station_from_world).norm(),
        1e-8);
}

TEST(Adjust, AgreesWithCeres) {
  {
    SCOPED_TRACE("pinhole");
    expect_parity(noisy_network(test::pinhole_network(), 5, 0.02));
  }
  {
    SCOPED_TRACE("rotating line");
    expect_parity(noisy_network(test::line_network(), 6, 0.02));
  }
  {
    SCOPED_TRACE("distances");
    Network network = test::line_network();
    test::add_distance(network, 0, 1);
    test::add_distance(network, 1, 5, 2e-4);
    expect_parity(noisy_network(network, 7, 0.02));
  }
  {
    SCOPED_TRACE("tags");
    Network network = test::pinhole_network();
    for (int k = 0; k < 3; ++k)
      test::add_tag(network, {so3_exp({0.3 * k, 0.2, 0.1}), {0.5 + 0.5 * k, 2, 3}}, 0.3);
    expect_parity(noisy_network(network, 8, 0.01));
  }
  {
    SCOPED_TRACE("fixed station and points");
    Network network = test::pinhole_network();
    network.stations[0].fixed = network.points[3].fixed = network.points[4].fixed = true;
    expect_parity(noisy_network(network, 9, 0.02));
  }
}

TEST(Adjust, AgreesWithCeresWithoutReducedUnknowns) {
  Network network = test::cloud_network(test::small_pinhole(), {});
  for (NetworkStation& station : network.stations) station.fixed = true;
  const Network start = noisy_network(network, 9, 0.02);
  expect_parity(start);
  const auto all = adjust(start);  // data snooping without reduced unknowns
  ASSERT_TRUE(all.ok()) << all.message;
  EXPECT_TRUE(all->rejected.empty());
  EXPECT_TRUE(precision(all->network).ok());
}

TEST(Adjust, RecoversRigsBodiesAndPriors) {
  Network truth = test::cloud_network(test::small_pinhole(), {"fx_px", "fy_px"}, 6, 25);
  truth.cameras.push_back({"right", Camera::pinhole(800, 600, 700, 700, 400, 300), {"fx_px"}});
  truth.mounts.push_back({"right", {so3_exp({0.01, 0.1, -0.02}), {-0.4, 0.02, 0.01}}, false});
  for (int i = 0; i < 6; ++i) {
    truth.images.push_back({"right " + std::to_string(i), 1, i, 0});
    const int image = static_cast<int>(truth.images.size()) - 1;
    for (int k = 0; k < 25; ++k) {
      const auto pixel =
          truth.cameras[1].camera.project(truth.cam_from_world(image) * truth.points[k].position_m);
      if (pixel && truth.cameras[1].camera.contains(*pixel))
        truth.observations.push_back({image, Target::of_point(k), *pixel, {0.2, 0.2}, true});
    }
  }
  const int tag = test::add_tag(truth, {so3_exp({0.3, 0.2, 0.1}), {1, 2, 3}}, 0.4, true);
  truth.distances.push_back(
      {Target::of_point(2), Target::of_corner(tag, 0),
       (truth.position_m(Target::of_corner(tag, 0)) - truth.points[2].position_m).norm(), 1e-4,
       true});
  truth.parameter_priors.push_back({1, "fx_px", 700, 0.5});
  truth.pose_priors.push_back(
      {0, truth.stations[0].station_from_world, 1e-6 * Matrix6::Identity()});
  truth.control.push_back(
      {Target::of_point(0), truth.points[0].position_m, 1e-8 * Eigen::Matrix3d::Identity()});
  Network start = noisy_network(truth, 2, 0.02);
  for (std::size_t i = 0; i < start.observations.size(); ++i)
    start.observations[i].pixel = truth.observations[i].pixel;
  start.distances[0].length_m = truth.distances[0].length_m;
  start.bodies[0].scale = 1.1;
  start.mounts[0].cam_from_station.translation.x() += 0.02;
  const auto found = adjust(start, plain());
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found->defect, 0);
  EXPECT_LT(found->cost, 1e-12);
  EXPECT_LT(test::worst_distance(found->network, truth), 1e-8);
  EXPECT_NEAR(found->network.bodies[0].scale, 1, 1e-8);
  EXPECT_LT(difference(found->network.mounts[0].cam_from_station, truth.mounts[0].cam_from_station)
                .norm(),
            1e-8);
}

/// Adds gross errors of 5 to 200 px to a part of the observations; returns their indices.
std::set<int> add_gross_errors(Network& network, double part, std::uint64_t seed) {
  Random random(seed, 9);
  std::set<int> faulty;
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    if (random.uniform() >= part) continue;
    const double angle = random.uniform(0, 2 * pi), far = std::exp(random.uniform(1.6, 5.3));
    network.observations[i].pixel += far * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    faulty.insert(static_cast<int>(i));
  }
  return faulty;
}

TEST(Adjust, RejectsGrossErrors) {
  for (const bool panorama : {false, true}) {
    SCOPED_TRACE(panorama);
    const Network truth = panorama ? test::line_network(8, 60) : test::pinhole_network(8, 60);
    Network network = noisy_network(truth, 1, 0.03);
    const auto clean = adjust(network, plain());
    const std::set<int> faulty = add_gross_errors(network, 0.1, 5);
    const auto found = adjust(network);
    ASSERT_TRUE(found.ok()) << found.message;
    std::set<int> rejected;
    for (const RejectedObservation& one : found->rejected) {
      rejected.insert(one.observation);
      EXPECT_FALSE(found->network.observations[one.observation].used);
      EXPECT_FALSE(one.reason.empty());
    }
    std::size_t detected = 0;
    for (const int i : faulty) detected += rejected.count(i);
    EXPECT_GE(detected, faulty.size() - 1) << "of " << faulty.size();
    EXPECT_LE(rejected.size() - detected, 2U);
    EXPECT_LT(found->sigma0, 1.2);
    const auto a = in_datum(clean->network, truth), b = in_datum(found->network, truth);
    EXPECT_LT(test::worst_distance(*b, truth), 2 * test::worst_distance(*a, truth));
  }
}

/// Panoramas of five stations: each point has five rays. With gross errors in a tenth of them, 8 %
/// of the points have two wrong rays.
TEST(Adjust, RejectsGrossErrorsWithFewRays) {
  TestFieldDesign design;
  design.camera = paper_panorama_camera();
  design.free_parameters = paper_additional_parameters();
  design.sigma_px = {0.5, 0.19};
  design.start_error_m = 0.3;
  const TestField field = simulate_test_field(design);
  const auto clean = adjust(noisy_network(field.truth, design.seed, 0), plain());
  Network network = field.network;
  const std::set<int> faulty = add_gross_errors(network, 0.1, 5);
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  std::size_t detected = 0;
  for (const RejectedObservation& one : found->rejected) detected += faulty.count(one.observation);
  EXPECT_GT(static_cast<double>(detected), 0.96 * static_cast<double>(faulty.size()));
  EXPECT_LT(static_cast<double>(found->rejected.size() - detected),
            0.1 * static_cast<double>(faulty.size()));
  EXPECT_LT(found->sigma0, 1.1);
  const auto rms = [&](const Network& from) {
    const auto aligned = in_datum(from, field.truth);
    std::vector<int> rays(from.points.size());
    for (const ImageObservation& observation : from.observations)
      rays[observation.target.point] += observation.used;
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (rays[i] < 2) continue;
      squares += (aligned->points[i].position_m - field.truth.points[i].position_m).squaredNorm();
      ++count;
    }
    return std::sqrt(squares / count);
  };
  EXPECT_LT(rms(found->network), 1.5 * rms(clean->network));
}

TEST(Adjust, IdentifiesAWrongDistanceAmongThree) {
  Network truth = test::line_network(6, 40);
  test::add_distance(truth, 0, 9, 2e-4);
  test::add_distance(truth, 3, 14, 2e-4);
  Network two = noisy_network(truth, 2, 0.01);
  two.distances[1].length_m += 0.05;
  const auto contradicting = adjust(two);
  EXPECT_EQ(contradicting.status, Status::ambiguous);
  EXPECT_NE(contradicting.message.find("contradict"), std::string::npos) << contradicting.message;
  EXPECT_TRUE(contradicting->rejected_distances.empty());
  ASSERT_EQ(contradicting->warnings.size(), 1U);
  test::add_distance(truth, 21, 33, 2e-4);
  Network three = noisy_network(truth, 2, 0.01);
  three.distances[1].length_m += 0.05;
  const auto found = adjust(three);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->rejected_distances.size(), 1U);
  EXPECT_EQ(found->rejected_distances[0].distance, 1);
  EXPECT_TRUE(found->rejected.empty());
  ASSERT_EQ(found->warnings.size(), 1U);
  EXPECT_NE(found->warnings[0].find("distance 1"), std::string::npos) << found->warnings[0];
}

TEST(Adjust, RejectsTagsWithWrongIds) {
  TestFieldDesign design;
  design.camera = paper_panorama_camera();
  design.free_parameters = paper_additional_parameters();
  design.sigma_px = {0.25, 0.19};
  design.targets = 0;
  design.tags = 80;
  design.tag_side_m = 0.3;
  const TestField field = simulate_test_field(design);
  Network network = field.network;
  Random random(3, 0);
  std::set<std::pair<int, int>> moved;  // tags (with all corners) in single images
  for (int image = 0; image < 5; ++image)
    for (int tag = 0; tag < 80; ++tag)
      if (random.uniform() < 0.1) moved.insert({image, tag});
  std::size_t faulty = 0;
  for (ImageObservation& observation : network.observations)
    if (moved.count({observation.image, observation.target.body})) {
      observation.pixel +=
          Eigen::Vector2d(300 - 5 * observation.target.body, 40 + 3 * observation.target.body);
      ++faulty;
    }
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  std::size_t detected = 0;
  for (const RejectedObservation& one : found->rejected) {
    const ImageObservation& observation = network.observations[one.observation];
    detected += moved.count({observation.image, observation.target.body});
  }
  EXPECT_EQ(detected, faulty);
  EXPECT_LT(found->rejected.size() - detected, faulty / 4);
  EXPECT_LT(found->sigma0, 1.1);
}

TEST(Adjust, PointsWithParallelRaysAreLeftOut) {
  Network truth = test::pinhole_network();
  // A point so far away that its rays are parallel up to rounding.
  truth.points.push_back({"star", {1e12, 2e12, 3e11}, false});
  const int star = static_cast<int>(truth.points.size()) - 1;
  for (int image = 0; image < 6; ++image) {
    const auto pixel = truth.cameras[0].camera.project(truth.cam_from_world(image) *
                                                       truth.points.back().position_m);
    if (pixel)
      truth.observations.push_back({image, Target::of_point(star), *pixel, {0.3, 0.3}, true});
  }
  const auto found = adjust(noisy_network(truth, 3, 0.01), plain());
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_EQ(found->warnings.size(), 1U);
  EXPECT_NE(found->warnings[0].find("star"), std::string::npos) << found->warnings[0];
  const auto p = precision(found->network);
  ASSERT_TRUE(p.ok()) << p.message;
  EXPECT_TRUE(std::isinf(p->point(star)(0, 0)));
}

TEST(Adjust, FarStartsConverge) {
  for (const bool panorama : {false, true}) {
    SCOPED_TRACE(panorama);
    const Network truth = panorama ? test::line_network() : test::pinhole_network();
    const auto near = adjust(noisy_network(truth, 1, 0.01), plain());
    const auto far = adjust(noisy_network(truth, 1, 0.5));
    ASSERT_TRUE(far.ok()) << far.message;
    EXPECT_TRUE(far->rejected.empty());
    EXPECT_NEAR(far->cost, near->cost, 1e-8 * near->cost);
  }
}

TEST(Adjust, SnoopingFindsOneSmallBlunder) {
  Network network = noisy_network(test::pinhole_network(8, 40), 1, 0.01);
  network.observations[25].pixel.x() += 0.3 * 12;
  AdjustOptions options;
  options.robust = false;
  const auto found = adjust(network, options);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->rejected.size(), 1U);
  EXPECT_EQ(found->rejected[0].observation, 25);
  EXPECT_EQ(found->rejected[0].reason, "snooping");
  EXPECT_GT(found->rejected[0].normalised, 5);
}

TEST(Adjust, ReportsInsufficientData) {
  const Network good = test::pinhole_network();
  {
    const auto found = adjust(Network{});
    EXPECT_EQ(found.status, Status::too_few_lamps);
    EXPECT_NE(found.message.find("no target"), std::string::npos) << found.message;
  }
  {
    Network network = good;  // a point that only one image observes
    network.points.push_back({"lonely", {1, 2, 3}, false});
    network.observations.push_back({0, Target::of_point(30), {640, 480}, {0.3, 0.3}, true});
    const auto found = adjust(network);
    ASSERT_TRUE(found.ok()) << found.message;
    ASSERT_EQ(found->warnings.size(), 1U);
    EXPECT_NE(found->warnings[0].find("lonely"), std::string::npos);
  }
  {
    Network network = good;
    for (ImageObservation& observation : network.observations)
      observation.used = observation.image < 2 && observation.target.point < 1 + observation.image;
    const auto found = adjust(network);
    EXPECT_EQ(found.status, Status::too_few_lamps);
    EXPECT_NE(found.message.find("s0"), std::string::npos) << found.message;
  }
  {
    Network network = good;  // stations 0 to 2 observe the first half only, 3 to 5 the second
    for (ImageObservation& observation : network.observations)
      observation.used = (observation.image < 3) == (observation.target.point < 15);
    const auto found = adjust(network);
    EXPECT_EQ(found.status, Status::degenerate);
    EXPECT_NE(found.message.find("2 blocks"), std::string::npos) << found.message;
    EXPECT_NE(found.message.find("s0, station s1, station s2"), std::string::npos) << found.message;
  }
  {
    Network network = good;  // a camera without images, determined by a prior
    network.cameras.push_back({"other", test::small_pinhole(), {"fx_px"}});
    network.parameter_priors.push_back({1, "fx_px", 1000, 1});
    EXPECT_TRUE(adjust(network).ok()) << "the prior determines it";
  }
  {
    // Upright stations: the camera constant and the points' heights are inseparable.
    TestFieldDesign design;
    design.camera = paper_panorama_camera();
    design.free_parameters = {"c_px"};
    design.station_tilt_rad = 0;
    design.targets = 60;
    const auto found = adjust(simulate_test_field(design).network, plain());
    EXPECT_FALSE(found.ok());  // the start values are tilted, so it seems determined at first
    EXPECT_NE(found.message.find("c_px"), std::string::npos) << found.message;
    const auto exact = precision(simulate_test_field(design).truth);
    EXPECT_EQ(exact.status, Status::degenerate);
    EXPECT_NE(exact.message.find("c_px"), std::string::npos) << exact.message;
  }
}

TEST(Adjust, ATagOfAnotherSizeIsRejected) {
  Network network = test::pinhole_network(8, 60);
  for (int k = 0; k < 6; ++k)
    test::add_tag(network, {so3_exp({0.2 * k, 0.2, 0.1}), {0.4 + 0.25 * k, 2, 3}}, 0.3);
  const Network truth = network;
  network = noisy_network(network, 4, 0.01);
  network.bodies[2].corners_m *= 1.15;
  const auto found = adjust(network);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_GT(found->rejected.size(), 5U);
  for (const RejectedObservation& one : found->rejected)
    EXPECT_EQ(network.observations[one.observation].target.body, 2);
  const auto aligned = in_datum(found->network, truth);
  EXPECT_LT(test::worst_distance(*aligned, truth), 6e-3);
}

TEST(Adjust, APlaneParallelToTheImageDeterminesNoFocalLength) {
  Network network;
  network.cameras.push_back(
      {"camera", Camera::pinhole(1280, 960, 1000, 1000, 640, 480), {"fx_px", "fy_px"}});
  Random random(3, 0);
  for (int k = 0; k < 40; ++k)
    network.points.push_back({"", {random.uniform(-1, 1), random.uniform(-1, 1), 0}, false});
  for (int i = 0; i < 5; ++i)
    network.add_image("i" + std::to_string(i), 0,
                      {Eigen::Vector3d(1, -1, -1).asDiagonal().toDenseMatrix(),
                       {0.3 * (i % 3 - 1), 0.2 * (i % 2), 3 + 0.3 * (i % 3)}});
  for (int image = 0; image < 5; ++image)
    for (int k = 0; k < 40; ++k) {
      const auto pixel = network.cameras[0].camera.project(network.cam_from_world(image) *
                                                           network.points[k].position_m);
      if (pixel && network.cameras[0].camera.contains(*pixel))
        network.observations.push_back({image, Target::of_point(k), *pixel, {0.3, 0.3}, true});
    }
  const auto exact = precision(network);
  EXPECT_EQ(exact.status, Status::degenerate);
  EXPECT_NE(exact.message.find("fx_px"), std::string::npos) << exact.message;
  const auto found = adjust(noisy_network(network, 1, 0), plain());
  EXPECT_FALSE(found.ok());
  EXPECT_NE(found.message.find("fx_px"), std::string::npos) << found.message;
}

TEST(Adjust, NonConvergenceKeepsTheState) {
  const Network start = noisy_network(test::pinhole_network(), 1, 0.3);
  AdjustOptions options = plain();
  options.max_iterations = 1;
  const auto found = adjust(start, options);
  EXPECT_EQ(found.status, Status::not_converged);
  EXPECT_NE(found.message.find("sigma"), std::string::npos) << found.message;
  EXPECT_EQ(found->iterations, 1);
  EXPECT_TRUE(std::isfinite(found->cost));
  EXPECT_GT(test::worst_distance(found->network, start), 0);
}

TEST(Adjust, TheCallbackReportsAndStops) {
  const Network start = noisy_network(test::pinhole_network(), 1, 0.1);
  int calls = 0;
  const auto found = adjust(start, {}, [&](const AdjustProgress& progress) {
    EXPECT_GE(progress.cost, 0);
    EXPECT_NE(std::strlen(progress.stage), 0U);
    return ++calls < 3;
  });
  EXPECT_EQ(calls, 3);
  EXPECT_EQ(found.status, Status::not_converged);
  EXPECT_NE(found.message.find("stopped"), std::string::npos);
}

TEST(Adjust, RejectsInvalidNetworks) {
  const Network good = test::pinhole_network();
  const auto error_message = [&](const std::function<void(Network&)>& change) {
    Network network = good;
    change(network);
    return test::complaint([&] { adjust(network); });
  };
  const auto names = [&](const std::string& text, const char* what) {
    return text.find(what) != std::string::npos;
  };
  EXPECT_TRUE(names(error_message([](Network& n) { n.observations[4].image = 17; }),
                    "observations[4].image"));
  EXPECT_TRUE(names(error_message([](Network& n) { n.observations[4].target.point = -3; }),
                    "observations[4].target"));
  EXPECT_TRUE(names(error_message([](Network& n) { n.observations[4].sigma_px.y() = 0; }),
                    "observations[4].sigma_px"));
  EXPECT_TRUE(names(error_message([](Network& n) { n.observations[4].pixel.x() = NAN; }),
                    "observations[4].pixel"));
  EXPECT_TRUE(
      names(error_message([](Network& n) { n.cameras[0].free_parameters = {"fz"}; }), "fz"));
  EXPECT_TRUE(names(error_message([](Network& n) {
                      n.cameras[0].free_parameters = {"k1", "k1"};
                    }),
                    "once"));
  EXPECT_TRUE(
      names(error_message([](Network& n) { n.points[2].position_m.z() = INFINITY; }), "points[2]"));
  EXPECT_TRUE(
      names(error_message([](Network& n) { n.stations[1].station_from_world.rotation *= 2; }),
            "stations[1]"));
  EXPECT_TRUE(names(error_message([](Network& n) {
                      n.distances.push_back({Target::of_point(0), Target::of_point(0), 1, 1, true});
                    }),
                    "distances[0]"));
  EXPECT_TRUE(
      names(error_message([](Network& n) {
              n.control.push_back({Target::of_point(0), {0, 0, 0}, -Eigen::Matrix3d::Identity()});
            }),
            "control[0].covariance_m2"));
  AdjustOptions options;
  options.threads = 0;
  EXPECT_TRUE(names(test::complaint([&] { adjust(good, options); }), "threads"));
  options = {};
  options.datum = {DatumKind::minimal, {Target::of_point(0)}};
  EXPECT_TRUE(names(test::complaint([&] { adjust(good, options); }), "datum.targets"));
}

}  // namespace
}  // namespace occ
