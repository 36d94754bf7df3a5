// SPDX-License-Identifier: Apache-2.0
// The refinement seen from outside: exactness, invariance, robustness, statuses, bad input.
#include "libocc/refine/refine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "tests/support/measured_blobs.hpp"

namespace occ {
namespace {

using test::in_order;
using test::Measurement;

const std::vector<double> bent = {-0.22, 0.06, 1e-3, -8e-4};

Rigid3 truth() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

/// 2 cm and a degree away.
Rigid3 start() {
  Vector6 off;
  off << 0.01, -0.012, 0.008, 0.01, 0.012, -0.01;
  return perturb(truth(), off);
}

Scene bent_room() {
  Scene scene = test::irregular_room();
  scene.camera = Camera::pinhole(640, 480, 422.5, 420, 319.5, 239.5, bent);
  return scene;
}

void make_rectangle(Lamp& lamp) {
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.3, 0.12};
}

/// Discs, rectangles and points of which two are tilted.
Scene mixed_room() {
  Scene scene = bent_room();
  make_rectangle(scene.lamps[0]);
  make_rectangle(scene.lamps[1]);
  scene.lamps[2].shape = LampShape::point;
  scene.lamps[0].normal = Eigen::Vector3d(0.3, 0.2, -1);
  scene.lamps[3].normal = Eigen::Vector3d(-0.2, 0.3, -1);
  scene.validate();
  return scene;
}

RefineOptions to_the_end() {
  RefineOptions options;
  options.tolerance_px = 1e-11;
  options.max_iterations = 50;
  return options;
}

/// Blobs of one image; without noise if `random` is null.
std::vector<Blob> measured_blobs(const Scene& scene, const Rigid3& pose, const Measurement& m,
                                 Random* random) {
  const std::vector<Blob> exact = test::exact_blobs(scene, pose, m);
  return random ? test::noisy(exact, scene, m, *random) : exact;
}

double distance(const Rigid3& a, const Rigid3& b) { return difference(a, b).norm(); }

TEST(Refine, IsExactWithoutNoise) {
  Scene discs = test::irregular_room(), rectangles = discs, points = discs;
  for (Lamp& lamp : rectangles.lamps) make_rectangle(lamp);
  for (Lamp& lamp : points.lamps) lamp.shape = LampShape::point;
  for (const Scene& scene : {discs, rectangles, points, bent_room(), mixed_room()}) {
    for (const int rim_points : {0, 48}) {
      const auto blobs = measured_blobs(scene, truth(), {rim_points}, nullptr);
      const auto refined = refine(start(), in_order(scene), blobs, scene);
      ASSERT_TRUE(refined.ok()) << refined.message;
      // the chord that stands for a rim's tangent is good to 1e-4 rad; points on the rim are exact
      EXPECT_LT(distance(refined->cam_from_world, truth()), 1e-9);
      EXPECT_LT(refined->rms_px, 1e-6);
      EXPECT_LT(refined->chi2, 1e-7);
      ASSERT_EQ(refined->lamps.size(), scene.lamps.size());
      for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
        EXPECT_LT(refined->lamps[i].rms_px, 1e-6);
        EXPECT_LT((refined->lamps[i].centre_px - blobs[i].centroid_px).norm(), 1e-6);
      }
      EXPECT_FALSE(refined->rim_growth_px);
      EXPECT_FALSE(refined->flux_factor);
    }
  }
}

TEST(Refine, AgreesWithOpenCvOnPoints) {
  Scene scene = bent_room();
  for (Lamp& lamp : scene.lamps) lamp.shape = LampShape::point;
  Random random(3);
  const auto blobs = measured_blobs(scene, truth(), {0, 0, 0.1}, &random);
  RefineOptions options = to_the_end();
  options.huber_sigma = std::numeric_limits<double>::infinity();
  const auto refined = refine(start(), in_order(scene), blobs, scene, options);
  ASSERT_TRUE(refined.ok());

  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> image;
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    const Eigen::Vector3d& p = scene.lamps[i].centre_m;
    world.emplace_back(p.x(), p.y(), p.z());
    image.emplace_back(blobs[i].centroid_px.x(), blobs[i].centroid_px.y());
  }
  const Eigen::Vector3d w = so3_log(start().rotation), t = start().translation;
  cv::Mat rotation = (cv::Mat_<double>(3, 1) << w.x(), w.y(), w.z());
  cv::Mat translation = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
  const cv::Matx33d k(422.5, 0, 319.5, 0, 420, 239.5, 0, 0, 1);
  cv::solvePnPRefineLM(
      world, image, k, bent, rotation, translation,
      cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-14));
  const Rigid3 theirs{
      so3_exp({rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2)}),
      {translation.at<double>(0), translation.at<double>(1), translation.at<double>(2)}};
  EXPECT_LT(distance(refined->cam_from_world, theirs), 1e-6);
  EXPECT_GT(distance(refined->cam_from_world, truth()), 1e-5);  // the noise moved both
}

TEST(Refine, DoesNotDependOnTheWorldsFrame) {
  const Scene scene = mixed_room();
  Random random(4);
  const auto blobs = measured_blobs(scene, truth(), {40}, &random);
  const Rigid3 new_from_world = {so3_exp({0.4, -1.1, 2.0}), {5, -7, 11}};
  Scene moved = scene;
  for (Lamp& lamp : moved.lamps) {
    lamp.centre_m = new_from_world * lamp.centre_m;
    lamp.normal = new_from_world.rotation * lamp.normal;
    lamp.x_axis = new_from_world.rotation * lamp.x_axis;
  }
  const auto here = refine(start(), in_order(scene), blobs, scene, to_the_end());
  const auto there =
      refine(start() * new_from_world.inverse(), in_order(scene), blobs, moved, to_the_end());
  ASSERT_TRUE(here.ok() && there.ok());
  EXPECT_LT(distance(there->cam_from_world * new_from_world, here->cam_from_world), 1e-9);
  // the perturbation is on the camera's side: the 6x6 stays, the position's covariance turns
  EXPECT_LT((there->covariance - here->covariance).norm(), 1e-6 * here->covariance.norm());
  const Eigen::Matrix3d& turn = new_from_world.rotation;
  EXPECT_LT((position_covariance(there->cam_from_world, there->covariance) -
             turn * position_covariance(here->cam_from_world, here->covariance) * turn.transpose())
                .norm(),
            1e-6 * here->covariance.norm());
  EXPECT_NEAR(there->chi2, here->chi2, 1e-6 * here->chi2);
}

TEST(Refine, DoesNotDependOnTheOrder) {
  const Scene scene = mixed_room();
  Random random(5);
  const auto blobs = measured_blobs(scene, truth(), {40}, &random);
  auto matches = in_order(scene);
  const auto forward = refine(start(), matches, blobs, scene, to_the_end());
  std::reverse(matches.begin(), matches.end());
  const auto backward = refine(start(), matches, blobs, scene, to_the_end());
  ASSERT_TRUE(forward.ok() && backward.ok());
  EXPECT_LT(distance(forward->cam_from_world, backward->cam_from_world), 1e-11);
  EXPECT_LT((forward->covariance - backward->covariance).norm(), 1e-9 * forward->covariance.norm());
  EXPECT_EQ(backward->lamps.front().match.lamp, 5);
}

TEST(Refine, ConvergesFromAPoseThatIsAsBadAsP3P) {
  Random random(6);
  const Scene scene = mixed_room();
  for (int trial = 0; trial < 50; ++trial) {
    const auto blobs = measured_blobs(scene, truth(), {40}, &random);
    Vector6 off;
    off << 0.03 * test::random_vector(random), 0.06 * test::random_vector(random);
    const auto refined = refine(perturb(truth(), off), in_order(scene), blobs, scene);
    ASSERT_TRUE(refined.ok()) << trial << ": " << refined.message;
    EXPECT_LT((refined->cam_from_world.origin_in_source() - truth().origin_in_source()).norm(),
              2e-3);
  }
}

TEST(Refine, RimsBeatCentroidsOfBigDiscsAndTheirImageIsNoPoint) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.radius_m = 0.3;
  Scene as_points = scene;
  for (Lamp& lamp : as_points.lamps) lamp.shape = LampShape::point;
  const Rigid3 tilted = look_at({1.2, 1.0, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  const auto blobs = measured_blobs(scene, tilted, {}, nullptr);
  const auto discs = refine(tilted, in_order(scene), blobs, scene);
  const auto points = refine(tilted, in_order(scene), blobs, as_points);
  EXPECT_LT(distance(discs->cam_from_world, tilted), 1e-9);
  EXPECT_GT(distance(points->cam_from_world, tilted), 1e-3);
}

Scene eight_lamps() {
  Scene scene = test::irregular_room();
  scene.lamps.push_back(test::disc_lamp(6, {2.6, 1.9, 3}));
  scene.lamps.push_back(test::disc_lamp(7, {1.9, 2.7, 2.8}));
  return scene;
}

TEST(Refine, OneWrongLampAmongEightIsFoundAndLeftOut) {
  const Scene scene = eight_lamps();
  for (const int rim_points : {0, 48}) {
    for (int wrong = 0; wrong < 8; ++wrong) {
      Random random(7);
      auto blobs = measured_blobs(scene, truth(), {rim_points}, &random);
      auto others = in_order(scene);
      others.erase(others.begin() + wrong);
      const auto clean = refine(start(), others, blobs, scene);
      for (const double error_px : {1.0, 40.0}) {
        auto spoilt = blobs;
        const Eigen::Vector2d shift = error_px * Eigen::Vector2d(0.6, -0.8);
        const auto k = static_cast<std::size_t>(wrong);
        spoilt[k].centroid_px += shift;
        for (RimPoint& point : spoilt[k].rim) point.px += shift;
        const auto robust = refine(start(), in_order(scene), spoilt, scene);
        ASSERT_TRUE(robust.ok()) << robust.message;
        EXPECT_LT(distance(robust->cam_from_world, clean->cam_from_world), 1e-6);
        EXPECT_GT(robust->chi2, clean->chi2 + 50);
        EXPECT_EQ(robust->dof, clean->dof);
        for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(robust->lamps[i].contradicts, i == k);

        RefineOptions plain;
        plain.huber_sigma = std::numeric_limits<double>::infinity();
        const auto fragile = refine(start(), in_order(scene), spoilt, scene, plain);
        EXPECT_GT(distance(fragile->cam_from_world, clean->cam_from_world), 1e-3);
      }
    }
  }
}

// Without the lamp that is far from three others, these fit although one of them is wrong.
TEST(Refine, OneWrongLampAmongFourIsNotAnotherOne) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 310, 310, 319.5, 239.5);
  const Eigen::Vector3d centres_m[] = {
      {1.81, 3.35, 2.85}, {2.18, 4.10, 2.82}, {0.04, 3.56, 2.83}, {2.46, 3.96, 2.99}};
  for (const Eigen::Vector3d& centre_m : centres_m)
    scene.lamps.push_back(test::disc_lamp(static_cast<int>(scene.lamps.size()), centre_m, 0.036));
  const Eigen::Vector3d position(0.812, 4.005, 1.07);
  const Eigen::Matrix3d rotation = nearest_rotation(
      (Eigen::Matrix3d() << 0.7, -0.7, 0.143, 0.71, 0.702, -0.044, -0.07, 0.132, 0.989).finished());
  const Rigid3 pose{rotation, -rotation * position};
  RefineOptions options;
  options.prior = Prior{};
  options.prior->gravity_in_cam = -pose.rotation.col(2);
  options.prior->gravity_sigma_rad = 0.01;
  options.prior->heading_rad = heading_rad(pose);
  options.prior->heading_sigma_rad = 0.2;
  for (const int rim_points : {0, 36}) {
    Random random(9);
    auto blobs = measured_blobs(scene, pose, {rim_points, 0.05, 0.01}, &random);
    blobs[0].rim.clear();
    blobs[0].centroid_px += Eigen::Vector2d(0.18, -0.15);
    const auto refined = refine(pose, in_order(scene), blobs, scene, options);
    for (const std::size_t right : {1, 2, 3}) EXPECT_FALSE(refined->lamps[right].contradicts);
  }
}

TEST(Refine, LampsThatAllDisagreeALittleAreAllKept) {
  const Scene scene = eight_lamps();
  Random random(8);
  for (int trial = 0; trial < 30; ++trial) {
    // a lens or map worse than anybody said: every lamp is off by 30 sigma
    const auto blobs = measured_blobs(scene, truth(), {40, 0.05, 0.03, 1.0}, &random);
    const auto refined = refine(start(), in_order(scene), blobs, scene);
    ASSERT_TRUE(refined.ok()) << refined.message;
    EXPECT_GT(refined->chi2, 10 * refined->dof);
    for (const LampResidual& lamp : refined->lamps) EXPECT_FALSE(lamp.contradicts);
  }
}

TEST(Refine, StrayRimPointsHardlyMatter) {
  const Scene scene = test::irregular_room();
  Random random(8);
  auto blobs = measured_blobs(scene, truth(), {48}, &random);
  const auto clean = refine(start(), in_order(scene), blobs, scene);
  for (Blob& blob : blobs) {
    for (std::size_t i = 0; i < 4; ++i) blob.rim[i].px += 4 * blob.rim[i].normal;  // a beam
    blob.rim[20].normal = -blob.rim[20].normal;                                    // undefined
  }
  const auto robust = refine(start(), in_order(scene), blobs, scene);
  ASSERT_TRUE(robust.ok()) << robust.message;
  RefineOptions plain;
  plain.huber_sigma = std::numeric_limits<double>::infinity();
  const auto fragile = refine(start(), in_order(scene), blobs, scene, plain);
  const double moved = distance(robust->cam_from_world, clean->cam_from_world);
  EXPECT_LT(moved, 0.1 * distance(fragile->cam_from_world, clean->cam_from_world));
}

TEST(Refine, CutLampsCountByTheirVisibleRimOnly) {
  const Scene scene = test::irregular_room();
  auto blobs = measured_blobs(scene, truth(), {48}, nullptr);
  blobs[0].cut_by_border = true;
  blobs[0].rim.resize(20);
  blobs[0].centroid_px += Eigen::Vector2d(5, 3);  // of the visible part
  const auto refined = refine(start(), in_order(scene), blobs, scene);
  ASSERT_TRUE(refined.ok());
  EXPECT_LT(distance(refined->cam_from_world, truth()), 1e-9);
  EXPECT_LT(refined->rms_px, 1e-6);

  blobs[0].rim.clear();  // then it says nothing at all
  const auto without = refine(start(), in_order(scene), blobs, scene);
  ASSERT_TRUE(without.ok());
  EXPECT_LT(distance(without->cam_from_world, truth()), 1e-9);
  EXPECT_EQ(without->dof, refined->dof - 20);
}

TEST(Refine, PriorPullsAndFillsIn) {
  Scene scene = test::irregular_room();
  scene.lamps.resize(2);
  const auto blobs = measured_blobs(scene, truth(), {}, nullptr);
  RefineOptions options;
  EXPECT_EQ(refine(start(), in_order(scene), blobs, scene, options).status, Status::too_few_lamps);
  options.prior.emplace();
  options.prior->gravity_in_cam = -truth().rotation.col(2);
  const auto refined = refine(start(), in_order(scene), blobs, scene, options);
  ASSERT_TRUE(refined.ok()) << refined.message;
  EXPECT_LT(distance(refined->cam_from_world, truth()), 1e-9);
  EXPECT_EQ(refined->dof, 0);

  options.prior = Prior{};
  options.prior->heading_rad = heading_rad(truth()) + 6.283185307179586;  // wraps
  options.prior->position_m = truth().origin_in_source();
  const auto by_place = refine(start(), in_order(scene), blobs, scene, options);
  ASSERT_TRUE(by_place.ok()) << by_place.message;
  EXPECT_LT(distance(by_place->cam_from_world, truth()), 1e-9);
  EXPECT_LT(by_place->chi2, 1e-7);
  EXPECT_NEAR(by_place->chi2, options.prior->chi2(by_place->cam_from_world), 1e-7);

  options.prior->position_sigma_m = 1e-7;  // a certain prior wins over the image
  *options.prior->position_m += Eigen::Vector3d(0.01, 0, 0);
  const auto pinned = refine(start(), in_order(scene), blobs, scene, options);
  EXPECT_LT((pinned->cam_from_world.origin_in_source() - *options.prior->position_m).norm(), 1e-6);
}

TEST(RefineStatus, TooFewLamps) {
  const Scene scene = test::irregular_room();
  const auto blobs = measured_blobs(scene, truth(), {}, nullptr);
  for (const auto& matches : {std::vector<Match>{}, {{0, 0}}, {{0, 0}, {1, 1}}}) {
    const auto refined = refine(start(), matches, blobs, scene);
    EXPECT_EQ(refined.status, Status::too_few_lamps);
    EXPECT_FALSE(refined.message.empty());
    EXPECT_TRUE(std::isfinite(refined->rms_px));
    EXPECT_EQ(refined->cam_from_world.matrix(), start().matrix());
    EXPECT_EQ(refined->lamps.size(), matches.size());
  }
  EXPECT_TRUE(refine(start(), {{0, 0}, {1, 1}, {2, 2}}, blobs, scene).ok());
}

TEST(RefineStatus, CollinearPointsAreDegenerateDiscsWithRimsAreNot) {
  Scene scene = test::irregular_room();
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    scene.lamps[i].centre_m = {1 + 0.4 * static_cast<double>(i), 2, 3};
  }
  const auto discs = measured_blobs(scene, truth(), {40}, nullptr);
  EXPECT_TRUE(refine(start(), in_order(scene), discs, scene).ok());
  for (Lamp& lamp : scene.lamps) lamp.shape = LampShape::point;
  const auto points = measured_blobs(scene, truth(), {}, nullptr);
  EXPECT_EQ(refine(start(), in_order(scene), points, scene).status, Status::degenerate);
  const auto same_lamp = std::vector<Match>{{0, 0}, {0, 0}, {0, 0}, {0, 0}};
  EXPECT_EQ(refine(start(), same_lamp, points, scene).status, Status::degenerate);
}

TEST(RefineStatus, NotConverged) {
  const Scene scene = test::irregular_room();
  Random random(9);
  const auto blobs = measured_blobs(scene, truth(), {40}, &random);
  RefineOptions options;
  options.max_iterations = 1;
  const auto refined = refine(start(), in_order(scene), blobs, scene, options);
  EXPECT_EQ(refined.status, Status::not_converged);
  EXPECT_EQ(refined->iterations, 1);
  EXPECT_LT(distance(refined->cam_from_world, truth()), distance(start(), truth()));
  EXPECT_GT(refined->covariance.trace(), 0);

  Rigid3 turned_away = start();
  turned_away.rotation = so3_exp({3.14, 0, 0}) * turned_away.rotation;
  const auto unseen = refine(turned_away, in_order(scene), blobs, scene);
  EXPECT_EQ(unseen.status, Status::not_converged);
  EXPECT_TRUE(std::isfinite(unseen->rms_px));
  EXPECT_EQ(unseen->cam_from_world.matrix(), turned_away.matrix());
}

/// Runs and returns the message of the std::invalid_argument that must come.
std::string refused(const std::function<void()>& run) {
  try {
    run();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "not refused";
}

TEST(RefineInput, BadArgumentsAreNamed) {
  const Scene scene = test::irregular_room();
  const auto blobs = measured_blobs(scene, truth(), {40}, nullptr);
  const auto says = [&](const std::string& name, const std::function<void()>& run) {
    EXPECT_NE(refused(run).find(name), std::string::npos) << name << ": " << refused(run);
  };
  const auto with = [&](const RefineOptions& o) {
    refine(start(), in_order(scene), blobs, scene, o);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  says("model_sigma_px", [&] {
    RefineOptions o;
    o.model_sigma_px = -1;
    with(o);
  });
  says("model_sigma_px", [&] {
    RefineOptions o;
    o.model_sigma_px = nan;
    with(o);
  });
  says("huber_sigma", [&] {
    RefineOptions o;
    o.huber_sigma = 0;
    with(o);
  });
  says("max_iterations", [&] {
    RefineOptions o;
    o.max_iterations = 0;
    with(o);
  });
  says("tolerance_px", [&] {
    RefineOptions o;
    o.tolerance_px = nan;
    with(o);
  });
  says("prior.heading_sigma_rad", [&] {
    RefineOptions o;
    o.prior.emplace().heading_sigma_rad = 0;
    with(o);
  });
  says("match.lamp", [&] { refine(start(), {{6, 0}}, blobs, scene); });
  says("match.lamp", [&] { refine(start(), {{-1, 0}}, blobs, scene); });
  says("match.blob", [&] { refine(start(), {{0, 6}}, blobs, scene); });
  says("start", [&] {
    Rigid3 bad = start();
    bad.translation.x() = nan;
    refine(bad, in_order(scene), blobs, scene);
  });
  says("covariance_px2", [&] {
    auto bad = blobs;
    bad[1].covariance_px2.setZero();
    refine(start(), in_order(scene), bad, scene);
  });
  says("rim.sigma_px", [&] {
    auto bad = blobs;
    bad[1].rim[3].sigma_px = 0;
    refine(start(), in_order(scene), bad, scene);
  });
  says("lamp 2: normal", [&] {
    Scene bad = scene;
    bad.lamps[2].normal *= 2;
    refine(start(), in_order(scene), blobs, bad);
  });
}

// The border cuts a lamp, and a beam cuts its rim short: it is measured elsewhere.
TEST(Refine, AFalseRimOfACutLampIsLeftOut) {
  const Scene scene = test::irregular_room();
  const Measurement measurement{40, 0.05, 0.03};
  for (const double off_px : {0.0, 15.0}) {
    std::vector<Blob> blobs = test::exact_blobs(scene, truth(), measurement);
    blobs.back().cut_by_border = true;
    for (RimPoint& point : blobs.back().rim) point.px += Eigen::Vector2d(off_px, -off_px);
    const auto refined = refine(start(), in_order(scene), blobs, scene, to_the_end());
    ASSERT_TRUE(refined.ok()) << refined.message;
    EXPECT_EQ(refined->lamps.back().contradicts, off_px > 0);
    EXPECT_LT(difference(refined->cam_from_world, truth()).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace occ
