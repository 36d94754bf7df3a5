// SPDX-License-Identifier: Apache-2.0
// Datum of a network: the defect, and estimates and covariances that are consistent between datums
// and units of length.
#include "libocc/network/datum.hpp"

#include "tests/network/network_support.hpp"

namespace occ {
namespace {

int defect(const std::function<void(Network&)>& change) {
  Network network = test::line_network();
  change(network);
  return datum_defect(network).total();
}

TEST(Datum, DefectIsFoundFromTheObservations) {
  using N = Network&;
  EXPECT_EQ(defect([](N) {}), 7);
  EXPECT_EQ(defect([](N n) { test::add_distance(n, 0, 1); }), 6);
  EXPECT_EQ(defect([](N n) {
              test::add_tag(n, {}, 0.3);
              for (ImageObservation& seen : n.observations) seen.used = seen.target.body < 0;
            }),
            7)
      << "a tag that nobody sees";
  const auto tag = [](N n, bool free) {
    test::add_tag(n, {so3_exp({0.3, 0, 0}), {1, 2, 3}}, 0.3, free);
  };
  EXPECT_EQ(defect([&](N n) { tag(n, false); }), 6);
  EXPECT_EQ(defect([&](N n) { tag(n, true); }), 7);
  const auto control = [](N n, int point) {
    n.control.push_back(
        {Target::of_point(point), n.points[point].position_m, 1e-6 * Eigen::Matrix3d::Identity()});
  };
  EXPECT_EQ(defect([&](N n) { control(n, 0); }), 4) << "turns and scale about the point";
  EXPECT_EQ(defect([&](N n) {
              control(n, 0);
              control(n, 1);
            }),
            1)
      << "a turn about their line";
  EXPECT_EQ(defect([&](N n) {
              control(n, 0);
              control(n, 1);
              control(n, 2);
            }),
            0);
  EXPECT_EQ(defect([](N n) { n.points[0].fixed = n.points[1].fixed = true; }), 1);
  EXPECT_EQ(defect([](N n) { n.stations[0].fixed = true; }), 1) << "scale";
  EXPECT_EQ(defect([](N n) { n.stations[0].fixed = n.stations[1].fixed = true; }), 0);
  EXPECT_EQ(defect([](N n) {
              n.pose_priors.push_back({0, n.stations[0].station_from_world, Matrix6::Identity()});
            }),
            1);
  EXPECT_EQ(defect([](N n) { n.cameras[0].free_parameters = {"c_px"}; }), 6)
      << "a known eccentricity has a length";
  EXPECT_EQ(defect([](N n) { n.parameter_priors.push_back({0, "ex_m", 0.02, 1e-4}); }), 6);
}

TEST(Datum, AKnownLengthCompensatedByAStationDeterminesNoScale) {
  // The height of the centre above the turntable; a camera on a known lever arm.
  for (const bool arm : {false, true}) {
    SCOPED_TRACE(arm);
    RotatingLine line = test::small_line();
    if (!arm) line.eccentricity_m.z() = 0.25;
    Network truth =
        test::cloud_network(Camera::rotating_line(line), paper_additional_parameters(), 6, 40);
    if (arm) {
      const Rigid3 mount{so3_exp({0.1, -0.2, 0.3}), {0.3, 0.1, -0.2}};
      truth.mounts.push_back({"arm", mount, true});
      for (NetworkImage& image : truth.images) image.mount = 0;
      for (NetworkStation& station : truth.stations)
        station.station_from_world = mount.inverse() * station.station_from_world;
    }
    EXPECT_EQ(datum_defect(truth).total(), 7);
    const auto p = precision(truth);
    ASSERT_TRUE(p.ok()) << p.message;
    const Network start = noisy_network(truth, 3, 0.02);
    AdjustOptions options = test::plain();
    const auto found = adjust(start, options);
    ASSERT_TRUE(found.ok()) << found.message;
    options.datum.kind = DatumKind::minimal;
    const auto other = adjust(start, options);
    ASSERT_TRUE(other.ok()) << other.message;
    const auto back = in_datum(other->network, start);
    EXPECT_LT(test::worst_distance(*back, found->network), 1e-9);
    EXPECT_EQ(test::parameter(*back, "ez_m"), line.eccentricity_m.z());
    const auto one = image_residuals_px(found->network), two = image_residuals_px(other->network);
    for (std::size_t i = 0; i < one.size(); ++i) EXPECT_LT((one[i] - two[i]).norm(), 1e-7) << i;
    Datum minimal;
    minimal.kind = DatumKind::minimal;
    EXPECT_LT((precision(truth, minimal)->in_datum({})->point(4) - p->point(4)).norm(),
              1e-9 * p->point(4).norm());
  }
}

TEST(Datum, TwoCamerasOnAKnownBarDetermineTheScale) {
  Network network = test::pinhole_network();
  network.mounts.push_back({"right", {Eigen::Matrix3d::Identity(), {-0.3, 0, 0}}, true});
  network.images.push_back({"right 0", 0, 0, 0});
  EXPECT_EQ(datum_defect(network).total(), 6);
  network.mounts[0].fixed = false;
  EXPECT_EQ(datum_defect(network).total(), 7);
}

TEST(Datum, DefectIsSplitIntoTranslationRotationAndScale) {
  const DatumDefect all = datum_defect(test::line_network());
  EXPECT_EQ(all.translation, 3);
  EXPECT_EQ(all.rotation, 3);
  EXPECT_EQ(all.scale, 1);
  Network network = test::line_network();
  network.stations[0].fixed = true;
  const DatumDefect scale = datum_defect(network);
  EXPECT_EQ(scale.translation + scale.rotation, 0);
  EXPECT_EQ(scale.scale, 1);
}

TEST(Datum, ASimilarityLeavesImagesUnchanged) {
  Network network = test::line_network();
  test::add_tag(network, {so3_exp({0.3, 0.1, 0}), {1, 2, 3}}, 0.3, true);
  network.mounts.push_back({"mount", {so3_exp({0.1, 0, 0.02}), {0.3, 0, 0.1}}, false});
  network.images[0].mount = 0;
  Similarity similarity;
  similarity.scale = 1.7;
  similarity.rotation = so3_exp({0.4, -1, 2});
  similarity.translation = {3, -8, 1};
  const Network other = transformed(network, similarity);
  EXPECT_LT((other.points[4].position_m - similarity * network.points[4].position_m).norm(), 1e-12);
  EXPECT_NEAR(test::parameter(other, "ex_m"), 1.7 * test::parameter(network, "ex_m"), 1e-15);
  const auto before = image_residuals_px(network), after = image_residuals_px(other);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_LT((before[i] - after[i]).norm(), 1e-8) << i;
  similarity.scale = 0;
  EXPECT_THROW(transformed(network, similarity), std::invalid_argument);
}

TEST(Datum, IsReachedFromAnyScale) {
  const Network network = test::pinhole_network();
  for (const double scale : {1e-4, 1e-2, 0.1, 10.0, 1e2, 1e4}) {
    Similarity similarity;
    similarity.scale = scale;
    similarity.rotation = so3_exp({0.4, -1, 2});
    similarity.translation = {3, -8, 1};
    const auto back = in_datum(transformed(network, similarity), network);
    ASSERT_TRUE(back.ok()) << scale << ": " << back.message;
    EXPECT_LT(test::worst_distance(*back, network), 1e-6) << scale;
  }
}

std::vector<Datum> all_datums() {
  const auto point = [](int k) { return Target::of_point(k); };
  return {
      {DatumKind::inner, {}},      {DatumKind::inner, {point(1), point(4), point(9), point(17)}},
      {DatumKind::minimal, {}},    {DatumKind::minimal, {point(3), point(8), point(12)}},
      {DatumKind::scale_only, {}}, {DatumKind::scale_only, {point(0), point(5)}}};
}

/// Difference of two covariances, relative to the largest element of both.
double apart(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / std::max(1e-300, a.cwiseAbs().maxCoeff());
}

class EveryNetwork : public ::testing::TestWithParam<int> {
 protected:
  static Network network() {
    Network made = GetParam() == 0 ? test::pinhole_network() : test::line_network();
    if (GetParam() == 2) test::add_distance(made, 2, 7);
    if (GetParam() == 3) test::add_tag(made, {so3_exp({0.3, 0.1, 0}), {1, 2, 3}}, 0.3);
    if (GetParam() == 4) made.points[0].fixed = made.points[9].fixed = true;
    return noisy_network(made, 4, 0.01);
  }
};

TEST_P(EveryNetwork, EstimatesAgreeInEveryDatum) {
  const Network start = network();
  AdjustOptions options = test::plain();
  const auto reference = adjust(start, options);
  ASSERT_TRUE(reference.ok()) << reference.message;
  for (const Datum& datum : all_datums()) {
    options.datum = datum;
    const auto other = adjust(start, options);
    ASSERT_TRUE(other.ok()) << other.message;
    EXPECT_NEAR(other->sigma0, reference->sigma0, 1e-10);
    const auto back = in_datum(other->network, start, {});
    ASSERT_TRUE(back.ok());
    EXPECT_LT(test::worst_distance(*back, reference->network), 1e-9);
    for (const std::string& name : start.cameras[0].free_parameters)
      EXPECT_NEAR(test::parameter(*back, name), test::parameter(reference->network, name),
                  1e-9 * std::max(1.0, std::abs(test::parameter(*back, name))));
  }
}

TEST_P(EveryNetwork, CovariancesAgreeInEveryDatumAfterTransformation) {
  const auto adjusted = adjust(network(), test::plain());
  const Network& at = adjusted->network;
  const auto reference = precision(at);
  ASSERT_TRUE(reference.ok()) << reference.message;
  for (const Datum& datum : all_datums()) {
    const auto direct = precision(at, datum);
    ASSERT_TRUE(direct.ok()) << direct.message;
    const auto there = reference->in_datum(datum);
    const auto back = direct->in_datum({});
    ASSERT_TRUE(there.ok() && back.ok());
    for (const int k : {0, 5, 12}) {
      EXPECT_LT(apart(there->point(k), direct->point(k)), 1e-9);
      EXPECT_LT(apart(back->point(k), reference->point(k)), 1e-9);
    }
    EXPECT_LT(apart(there->parameters(0), direct->parameters(0)), 1e-9);
    EXPECT_LT(apart(there->station(1), direct->station(1)), 1e-9);
    // Ratios of distances, and parameters that are not lengths, are the same in every datum.
    const Eigen::MatrixXd here = direct->parameters(0), first = reference->parameters(0);
    for (Eigen::Index k = 0; k < here.rows(); ++k) {
      const std::string& name = at.cameras[0].free_parameters[k];
      if (name == "ex_m" || name == "ey_m") continue;
      EXPECT_NEAR(here(k, k) / first(k, k), 1, 1e-8) << name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Datum, EveryNetwork, ::testing::Range(0, 5));

TEST(Datum, InnerConstraintsHaveTheLeastTrace) {
  const Network network = test::line_network();
  const auto inner = precision(network);
  const auto trace = [](const Precision& p) {
    double sum = 0;
    for (const Eigen::Matrix3d& q : p.points()) sum += q.trace();
    return sum;
  };
  for (const Datum& datum : all_datums()) {
    if (datum.targets.empty() && datum.kind == DatumKind::inner) continue;
    EXPECT_GT(trace(*precision(network, datum)), 1.001 * trace(*inner));
  }
}

TEST(Datum, MinimalFixesSevenCoordinates) {
  const Datum datum{DatumKind::minimal,
                    {Target::of_point(3), Target::of_point(8), Target::of_point(12)}};
  const auto p = precision(test::line_network(), datum);
  ASSERT_TRUE(p.ok());
  int held = 0;
  for (const Target& target : datum.targets) {
    const Eigen::Matrix3d q = p->position(target);
    for (int k = 0; k < 3; ++k) held += q(k, k) < 1e-14 ? 1 : 0;
  }
  EXPECT_EQ(held, 7);
  const Datum scale{DatumKind::scale_only, {Target::of_point(0), Target::of_point(5)}};
  EXPECT_LT(precision(test::line_network(), scale)
                ->distance_sigma_m(Target::of_point(0), Target::of_point(5)),
            1e-9);
}

TEST(Datum, ResultsAreTheSameInMillimetres) {
  Network metres = test::line_network();
  test::add_distance(metres, 0, 7);
  metres = noisy_network(metres, 5, 0.01);
  Similarity enlarge;
  enlarge.scale = 1000;
  Network millimetres = transformed(metres, enlarge);
  for (DistanceObservation& known : millimetres.distances) {
    known.length_m *= 1000;
    known.sigma_m *= 1000;
  }
  const auto a = adjust(metres, test::plain()), b = adjust(millimetres, test::plain());
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_NEAR(a->cost, b->cost, 1e-9 * a->cost);
  EXPECT_NEAR(test::parameter(a->network, "c_px"), test::parameter(b->network, "c_px"), 1e-6);
  const auto pa = precision(a->network), pb = precision(b->network);
  EXPECT_LT(apart(1e6 * pa->point(4), pb->point(4)), 1e-8);
  EXPECT_LT(apart(pa->parameter_correlation(0), pb->parameter_correlation(0)), 1e-8);
}

TEST(Datum, RejectsTargetsThatDoNotDetermineTheDatum) {
  const Network network = test::line_network();
  const auto control = precision(network, {DatumKind::control, {}});
  EXPECT_EQ(control.status, Status::degenerate);
  EXPECT_NE(control.message.find("control"), std::string::npos);
  const auto two =
      precision(network, {DatumKind::inner, {Target::of_point(0), Target::of_point(1)}});
  EXPECT_EQ(two.status, Status::degenerate);
  AdjustOptions options = test::plain();
  options.datum.kind = DatumKind::control;
  EXPECT_EQ(adjust(network, options).status, Status::degenerate);
  EXPECT_THROW(precision(network, {DatumKind::inner, {Target::of_point(77)}}),
               std::invalid_argument);
  EXPECT_THROW(precision(network, {DatumKind::scale_only, {Target::of_point(1)}}),
               std::invalid_argument);
  EXPECT_THROW(precision(network, {DatumKind::control, {Target::of_point(1)}}),
               std::invalid_argument);
}

}  // namespace
}  // namespace occ
