// SPDX-License-Identifier: Apache-2.0
// Pose from points in an image: exactness, agreement with OpenCV, every status and refusal.
#include "libocc/locate/solve_pose.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <opencv2/calib3d.hpp>
#include <string>

#include "libocc/pose/candidates.hpp"
#include "tests/locate/solve_pose_support.hpp"
#include "tests/support/nees.hpp"

namespace occ::test {
namespace {

Result<Fix> solved(const SeenScene& scene, const SolvePoseOptions& options = {}) {
  return solve_pose(scene.points, scene.pixels, scene.camera, options);
}

SolvePoseOptions with_sigma(double sigma_px) {
  SolvePoseOptions options;
  options.sigma_px = sigma_px;
  return options;
}

TEST(SolvePose, IsExactWithoutNoise) {
  for (const Camera& camera : {plain_camera(), bent_camera()})
    for (const int count : {4, 5, 6, 20, 100, 333})
      for (const bool flat : {false, true})
        for (int i = 0; i < 40; ++i) {
          Random random(41, static_cast<std::uint64_t>(i));
          const SeenScene scene = random_scene(random, count, flat, camera);
          const Result<Fix> fix = solved(scene, with_sigma(1e-6));
          ASSERT_FALSE(fix->candidates.empty()) << count << flat << i << fix.message;
          if (fix.ok()) {
            EXPECT_LT(pose_error(fix->cam_from_world, scene.truth), 1e-9) << count << flat << i;
          }
          EXPECT_LT(best_error(poses_of(*fix), scene.truth), 1e-9) << count << flat << i;
          EXPECT_TRUE(fix.ok() || fix.status == Status::ambiguous) << fix.message;
          EXPECT_LT(fix->rms_px, 1e-7);
        }
}

TEST(SolvePose, OfThreePointsReturnsEveryPose) {
  int one = 0, several = 0;
  for (int i = 0; i < 300; ++i) {
    Random random(42, static_cast<std::uint64_t>(i));
    const SeenScene scene = random_scene(random, 3, true, plain_camera());
    const Result<Fix> fix = solved(scene, with_sigma(1e-6));
    PoseProblem problem;
    problem.points = scene.points;
    problem.bearings.resize(3, 3);
    for (int k = 0; k < 3; ++k)
      problem.bearings.col(k) = *scene.camera.unproject(Eigen::Vector2d(scene.pixels.col(k)));
    const auto all = pose_candidates(problem);
    EXPECT_EQ(fix->candidates.size(), all->size()) << i;
    for (const PoseCandidate& c : *all) {
      EXPECT_LT(best_error(poses_of(*fix), c.cam_from_world), 1e-7) << i;
    }
    EXPECT_LT(best_error(poses_of(*fix), scene.truth), 1e-7) << i;
    EXPECT_EQ(fix.status, all->size() == 1 ? Status::ok : Status::ambiguous);
    (all->size() == 1 ? one : several)++;
  }
  EXPECT_GT(one, 3);
  EXPECT_GT(several, 100);
}

TEST(SolvePose, FixIsItsBestCandidate) {
  for (const int count : {3, 4, 9}) {
    Random random(43);
    SeenScene scene = random_scene(random, count, true, plain_camera());
    scene.pixels = noisy_pixels(scene, 0.5, random);
    const Result<Fix> fix = solved(scene, with_sigma(0.5));
    ASSERT_FALSE(fix->candidates.empty());
    const Candidate& best = fix->candidates.front();
    EXPECT_EQ(best.dof, 2 * count - 6);
    EXPECT_EQ(fix->covariance, best.covariance);
    EXPECT_EQ(fix->covariance, fix->covariance.transpose());
    EXPECT_EQ(fix->rms_px, best.rms_px);
    EXPECT_LT((fix->position_m - fix->cam_from_world.origin_in_source()).norm(), 1e-12);
    EXPECT_TRUE(jacobian_agrees(fix->position_covariance_m2,
                                position_covariance(fix->cam_from_world, fix->covariance), 1e-9));
    double chi2 = 0;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d x = best.cam_from_world * Eigen::Vector3d(scene.points.col(i));
      chi2 += (*scene.camera.project(x) - scene.pixels.col(i)).squaredNorm() / 0.25;
    }
    EXPECT_NEAR(best.chi2, chi2, 1e-9 + 1e-6 * chi2);
    EXPECT_NEAR(best.rms_px, 0.5 * std::sqrt(chi2 / count), 1e-9 + 1e-6 * best.rms_px);
    for (std::size_t k = 1; k < fix->candidates.size(); ++k) {
      EXPECT_GE(fix->candidates[k].chi2, fix->candidates[k - 1].chi2);
    }
  }
}

// World moved far away and in another unit, points in another order.
TEST(SolvePose, DoesNotDependOnTheWorld) {
  for (int i = 0; i < 60; ++i) {
    Random random(44, static_cast<std::uint64_t>(i));
    SeenScene scene = random_scene(random, 5 + i % 30, i % 2 == 1, plain_camera());
    scene.pixels = noisy_pixels(scene, 0.5, random);
    const Result<Fix> plain = solved(scene, with_sigma(0.5));
    const double unit = std::pow(10, random.uniform(-6, 6)), far = i % 3 ? 1e5 : 0;
    const Eigen::Vector3d shift = far * Eigen::Vector3d(0.4, 0.7, -0.6);
    SeenScene moved = scene;
    moved.points = unit * (scene.points.colwise() + shift).rowwise().reverse().eval();
    moved.pixels = scene.pixels.rowwise().reverse().eval();
    const Result<Fix> fix = solved(moved, with_sigma(0.5));
    ASSERT_EQ(fix.status, plain.status);
    ASSERT_EQ(fix->candidates.size(), plain->candidates.size());
    const Rigid3& pose = fix->cam_from_world;
    const Rigid3 back{pose.rotation, pose.translation / unit + pose.rotation * shift};
    const double sigma = std::sqrt(plain->position_covariance_m2.trace());
    EXPECT_LT((back.origin_in_source() - plain->position_m).norm(), 1e-2 * sigma) << i;
    EXPECT_NEAR(std::sqrt(fix->position_covariance_m2.trace()) / unit, sigma, 0.01 * sigma) << i;
  }
}

// A chessboard's corners row by row, whose every tenth may be one column.
TEST(SolvePose, TakesGridsInAnyOrder) {
  for (const int columns : {2, 3, 4, 6, 8, 12, 13, 20})
    for (const int rows : {2, 3, 9, 12, 24}) {
      Random random(45, static_cast<std::uint64_t>(100 * columns + rows));
      SeenScene scene;
      scene.camera = plain_camera();
      scene.points.resize(3, columns * rows);
      for (int i = 0; i < columns * rows; ++i)
        scene.points.col(i) << 0.1 * (i % columns), 0.1 * (i / columns), 0;
      scene.truth.rotation = so3_exp({0.5, -0.4, 0.2});
      scene.truth.translation << -0.3, -0.2, 3;
      ASSERT_TRUE(see(scene));
      scene.pixels = noisy_pixels(scene, 0.1, random);
      const Result<Fix> fix = solved(scene, with_sigma(0.1));
      ASSERT_TRUE(fix.ok() || fix.status == Status::ambiguous)
          << columns << " x " << rows << ": " << fix.message;
      EXPECT_LT(min_squared_error(*fix, scene), 30) << columns << " x " << rows;  // 6 degrees: 4e-5
    }
}

TEST(SolvePose, EverySolverLeadsToTheSameAnswer) {
  for (const Solver& solver : solvers()) {
    const std::string name = solver.name;
    if (solver.needs_up || name == "gpnp") continue;  // not of one camera
    int same = 0, judged = 0;
    for (int i = 0; i < 40; ++i) {
      Random random(46, static_cast<std::uint64_t>(i));
      const bool flat = solver.layout == Layout::coplanar;
      SeenScene scene = random_scene(random, 12, flat, plain_camera(), 4);
      scene.pixels = noisy_pixels(scene, 0.3, random);
      SolvePoseOptions options = with_sigma(0.3);
      const Result<Fix> expected = solved(scene, options);
      options.solver = name;
      const Result<Fix> fix = solved(scene, options);
      if (!expected.ok()) continue;
      ++judged;
      if (!fix.ok()) continue;
      ++same;
      const Vector6 apart = difference(fix->cam_from_world, expected->cam_from_world);
      EXPECT_LT(test::nees(apart, expected->covariance), 1e-4) << name << i;
    }
    EXPECT_GT(judged, 30);
    EXPECT_GE(same, 0.9 * judged) << name;
  }
}

TEST(SolvePose, AgreesWithOpenCv) {
  for (int i = 0; i < 60; ++i) {
    Random random(47, static_cast<std::uint64_t>(i));
    SeenScene scene =
        random_scene(random, 6 + i % 20, false, i % 2 ? plain_camera() : bent_camera());
    scene.pixels = noisy_pixels(scene, 0.3, random);
    const Result<Fix> fix = solved(scene, with_sigma(0.3));
    ASSERT_TRUE(fix.ok()) << fix.message;
    // OpenCV knows no skew: the pixels as they would be without it
    std::vector<cv::Point3d> points;
    std::vector<cv::Point2d> pixels;
    const Camera& camera = scene.camera;
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k) {
      const Eigen::Vector2d p = scene.pixels.col(k);
      const double y = (p.y() - camera.cy_px()) / camera.fy_px();
      points.emplace_back(scene.points(0, k), scene.points(1, k), scene.points(2, k));
      pixels.emplace_back(p.x() - camera.skew_px() * y, p.y());
    }
    const cv::Matx33d matrix(camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(),
                             0, 0, 1);
    cv::Vec3d turn, shift;
    ASSERT_TRUE(cv::solvePnP(points, pixels, matrix, camera.distortion(), turn, shift, false,
                             cv::SOLVEPNP_ITERATIVE));
    cv::solvePnPRefineLM(points, pixels, matrix, camera.distortion(), turn, shift,
                         {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-14});
    const Rigid3 theirs{so3_exp({turn[0], turn[1], turn[2]}), {shift[0], shift[1], shift[2]}};
    const Vector6 apart = difference(fix->cam_from_world, theirs);
    // the skew, 1.5 of 800 px, couples the axes' residuals that little
    EXPECT_LT(test::nees(apart, fix->covariance), i % 2 ? 1e-4 : 1e-3) << i;
  }
}

TEST(SolvePose, AmbiguousWhereAPlaneHasTwoPoses) {
  for (int i = 0; i < 60; ++i) {
    Random random(48, static_cast<std::uint64_t>(i));
    SeenScene scene;
    scene.camera = plain_camera();
    scene.points =
        (Eigen::Matrix3Xd(3, 4) << -.05, .05, .05, -.05, -.05, -.05, .05, .05, 0, 0, 0, 0)
            .finished();
    const double towards = random.uniform(0, 6.28);
    scene.truth.rotation = so3_exp({0.6 * std::cos(towards), 0.6 * std::sin(towards), 0});
    scene.truth.translation << 0.2, -0.1, 10;
    ASSERT_TRUE(see(scene));
    scene.pixels = noisy_pixels(scene, 0.05, random);
    const Result<Fix> fix = solved(scene, with_sigma(0.05));
    EXPECT_EQ(fix.status, Status::ambiguous) << i << fix.message;
    ASSERT_EQ(fix->candidates.size(), 2u) << i;
    EXPECT_LT(min_squared_error(*fix, scene), 40) << i;
    EXPECT_FALSE(fix.message.empty());
  }
}

TEST(SolvePose, PointsThatDetermineNothingAreRefused) {
  Random random(49);
  SeenScene scene = random_scene(random, 5, false, plain_camera());
  SeenScene two = scene;
  two.points.conservativeResize(3, 2);
  two.pixels.conservativeResize(2, 2);
  EXPECT_EQ(solved(two).status, Status::too_few_lamps);
  two.points.resize(3, 0);
  two.pixels.resize(2, 0);
  EXPECT_EQ(solved(two).status, Status::too_few_lamps);
  for (const double offset : {0.0, 1e4, 1e7}) {
    const Eigen::Vector3d at(offset + 0.1, offset - 0.3, 0.7), along(0.3, 0.1, -0.5);
    scene.points = at.replicate(1, 5);
    EXPECT_EQ(solved(scene).status, Status::degenerate) << offset;
    for (int i = 0; i < 5; ++i) scene.points.col(i) += i * i * along;
    const Result<Fix> fix = solved(scene);
    EXPECT_EQ(fix.status, Status::degenerate) << offset;
    EXPECT_TRUE(fix->candidates.empty());
    EXPECT_FALSE(fix.message.empty());
  }
}

// Points nearer and nearer to a line: a covariance that says so, or a refusal; never nonsense.
TEST(SolvePose, NearALineTheCovarianceIsTrueOrThereIsNone) {
  for (const double height : {1e-2, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-11})
    for (int i = 0; i < 40; ++i) {
      Random random(50, static_cast<std::uint64_t>(i));
      SeenScene scene = random_scene(random, 4 + i % 3, true, plain_camera());
      for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
        scene.points.col(k) << random.normal(), height * random.normal(), height * random.normal();
      if (!see(scene)) continue;
      const Result<Fix> fix = solved(scene, with_sigma(0.3));
      if (height < 1e-10) {
        EXPECT_EQ(fix.status, Status::degenerate);
      }
      if (!fix.ok() && fix.status != Status::ambiguous) continue;
      const Eigen::VectorXd scale = fix->covariance.diagonal().cwiseSqrt();
      ASSERT_TRUE((scale.array() > 0).all()) << height << " " << i;
      const Matrix6 correlation =
          scale.cwiseInverse().asDiagonal() * fix->covariance * scale.cwiseInverse().asDiagonal();
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(correlation).eigenvalues()[0], -1e-9)
          << height << " " << i;
    }
}

TEST(SolvePose, WrongMatchesFitNoPose) {
  for (const int count : {5, 6, 20, 100})
    for (int i = 0; i < 20; ++i) {
      Random random(51, static_cast<std::uint64_t>(i));
      SeenScene scene = random_scene(random, count, i % 2 == 1, plain_camera());
      scene.pixels.col(0).swap(scene.pixels.col(2));
      scene.pixels.col(1).swap(scene.pixels.col(4));
      scene.pixels.col(0).swap(scene.pixels.col(3));
      const Result<Fix> fix = solved(scene, with_sigma(0.5));
      EXPECT_EQ(fix.status, Status::no_pose) << count;
      EXPECT_FALSE(fix.message.empty());
    }
}

TEST(SolvePose, OneGrossOutlierIsToldByTheResiduals) {
  for (int i = 0; i < 20; ++i) {
    Random random(52, static_cast<std::uint64_t>(i));
    SeenScene scene = random_scene(random, 20, false, plain_camera());
    scene.pixels = noisy_pixels(scene, 0.5, random);
    scene.pixels(i % 2, i) += 100;
    const Result<Fix> fix = solved(scene, with_sigma(0.5));
    EXPECT_EQ(fix.status, Status::no_pose);
    EXPECT_NE(fix.message.find("px r.m.s. with sigma_px = 0.5"), std::string::npos) << fix.message;
    EXPECT_GT(fix->rms_px, 5);
    EXPECT_FALSE(fix->candidates.empty());  // the best that was found
  }
}

TEST(SolvePose, SaysWhenItStoppedEarly) {
  int stopped = 0;
  for (int i = 0; i < 400; ++i) {
    Random random(53, static_cast<std::uint64_t>(i));
    SeenScene scene = random_scene(random, 6, false, plain_camera());
    scene.pixels = noisy_pixels(scene, 3, random);
    SolvePoseOptions options = with_sigma(3);
    EXPECT_NE(solved(scene, options).status, Status::not_converged);
    options.max_iterations = 1;
    const Result<Fix> fix = solved(scene, options);

    if (fix.status != Status::not_converged) continue;
    ++stopped;
    EXPECT_NE(fix.message.find("max_iterations = 1"), std::string::npos);
    EXPECT_LT(pose_error(fix->cam_from_world, scene.truth), 0.2);
  }
  EXPECT_GT(stopped, 3);
}

TEST(SolvePose, SigmaStatedTooSmallEnlargesTheCovariance) {
  Random random(54);
  SeenScene scene = random_scene(random, 20, false, plain_camera());
  scene.pixels = noisy_pixels(scene, 1, random);
  const Result<Fix> honest = solved(scene, with_sigma(1));
  const Result<Fix> proud = solved(scene, with_sigma(0.5));
  ASSERT_TRUE(honest.ok() && proud.ok());
  const double said = honest->candidates[0].chi2 / honest->candidates[0].dof;
  EXPECT_NEAR(proud->covariance.trace() / honest->covariance.trace(), said, 0.01 * said);
  const Result<Fix> humble = solved(scene, with_sigma(2));  // never made smaller
  EXPECT_NEAR(humble->covariance.trace() / honest->covariance.trace(), 4, 0.01);
}

TEST(SolvePose, SolversOfOtherLayoutsSaySo) {
  Random random(55);
  const SeenScene deep = random_scene(random, 8, false, plain_camera());
  const SeenScene flat = random_scene(random, 8, true, plain_camera());
  SolvePoseOptions options;
  options.solver = "homography";
  EXPECT_EQ(solved(deep, options).status, Status::degenerate);
  EXPECT_NE(solved(deep, options).message.find("homography"), std::string::npos);
  options.solver = "dlt";
  EXPECT_EQ(solved(flat, options).status, Status::degenerate);
  SeenScene five = deep;
  five.points.conservativeResize(3, 5);
  five.pixels.conservativeResize(2, 5);
  EXPECT_EQ(solved(five, options).status, Status::too_few_lamps);
  if (!missing_solvers().empty()) GTEST_SKIP() << "gpnp may be missing in this build";
  options.solver = "gpnp";  // of several cameras
  EXPECT_EQ(solved(deep, options).status, Status::no_pose);
}

std::string refusal(const SeenScene& scene, const SolvePoseOptions& options = {}) {
  return complaint([&] { solved(scene, options); });
}

void expect_said(const std::string& said, const char* what) {
  EXPECT_NE(said.find(what), std::string::npos) << "said: " << said << ", expected: " << what;
}

TEST(SolvePose, CallersMistakesThrow) {
  Random random(56);
  const SeenScene good = random_scene(random, 6, false, bent_camera());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity}) {
    SeenScene scene = good;
    scene.points(0, 5) = bad;
    expect_said(refusal(scene), "points_in_world[5]");
    scene = good;
    scene.pixels(1, 2) = bad;
    expect_said(refusal(scene), "points_px[2]");
  }
  SeenScene scene = good;
  scene.pixels.conservativeResize(2, 5);
  expect_said(refusal(scene), "points_px");
  scene = good;
  scene.pixels.col(3) << 1e5, 1e5;  // beyond what the lens maps
  expect_said(refusal(scene), "points_px[3]");
  SolvePoseOptions options;
  options.solver = "p4p";
  expect_said(refusal(good, options), "p3p_triples, ");
  options.solver = "upright_p2p";
  expect_said(refusal(good, options), "up_in_cam");
  for (const double bad : {0.0, -1.0, nan, infinity})
    expect_said(refusal(good, with_sigma(bad)), "sigma_px");
  options = {};
  options.max_iterations = 0;
  expect_said(refusal(good, options), "max_iterations");
  options = {};
  options.max_misfit = nan;
  expect_said(refusal(good, options), "max_misfit");
}

}  // namespace
}  // namespace occ::test
