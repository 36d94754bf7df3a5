// SPDX-License-Identifier: Apache-2.0
// Protection levels by solution separation, beside the exact bound of the linear Gaussian problem
// and over simulated images with a faulty lamp. Levels and positions are those of refine() with
// measured blobs.
#include "libocc/refine/separation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "libocc/core/statistics.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
namespace {

constexpr double risk = 1e-7, fault = 1e-3, continuity = 1e-3;
const test::Measurement centroids{0, 0.05, 0.03};

Scene points_room() {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.shape = LampShape::point;
  return scene;
}

Rigid3 truth() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

/// Pose from which all lamps are in the image.
Rigid3 pose_of_all(const Scene& scene, Random& random) {
  while (true) {
    const Rigid3 pose = test::random_room_pose(random, 0.15);
    const bool all = std::all_of(scene.lamps.begin(), scene.lamps.end(), [&](const Lamp& lamp) {
      const auto px = project_lamp_centre(lamp, pose, scene.camera);
      return px && scene.camera.contains(*px);
    });
    if (all) return pose;
  }
}

/// Linear problem of the centroids, by differences of projections: independent of the library's.
class Linear {
 public:
  using Gain = Eigen::Matrix<double, 3, Eigen::Dynamic>;

  Linear(const Scene& scene, const Rigid3& pose, double sigma_px)
      : rows_(2 * scene.lamps.size(), 6), position_(3, 6) {
    constexpr double step = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vector6 delta = step * Vector6::Unit(k);
      const Rigid3 plus = perturbed(pose, delta), minus = perturbed(pose, -delta);
      position_.col(k) = (plus.origin_in_source() - minus.origin_in_source()) / (2 * step);
      for (std::size_t i = 0; i < scene.lamps.size(); ++i)
        rows_.block<2, 1>(2 * static_cast<Eigen::Index>(i), k) =
            (*project_lamp_centre(scene.lamps[i], plus, scene.camera) -
             *project_lamp_centre(scene.lamps[i], minus, scene.camera)) /
            (2 * step * sigma_px);
    }
  }

  Eigen::Index lamps() const { return rows_.rows() / 2; }

  /// d position / d errors in units of their sigmas, without these lamps.
  Gain gain(const std::vector<Eigen::Index>& without) const {
    Eigen::MatrixXd rows = rows_;
    for (const Eigen::Index lamp : without) rows.middleRows<2>(2 * lamp).setZero();
    return position_ * (rows.transpose() * rows).inverse() * rows.transpose();
  }

 private:
  static Rigid3 perturbed(const Rigid3& pose, const Vector6& delta) {
    const Eigen::Matrix3d turn = so3_exp(delta.head<3>());
    return {turn * pose.rotation, turn * pose.translation + delta.tail<3>()};
  }

  Eigen::MatrixXd rows_, position_;
};

double tail(double x) { return 1 - normal_probability(x); }

/// Standard deviations along the largest horizontal direction u and across it.
struct Plane {
  Eigen::Vector2d u;
  double along, across;

  explicit Plane(const Eigen::Matrix3d& covariance) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(
        Eigen::Matrix2d(covariance.topLeftCorner<2, 2>()));
    u = eigen.eigenvectors().col(1);
    along = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
    across = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]));
  }
};

/// Fault hypotheses of one and two of six lamps, and the exact probabilities of undetected errors.
class Exact {
 public:
  struct Set {
    std::vector<Eigen::Index> lamps;
    double probability;
    Eigen::Matrix3d own, separation;
  };

  explicit Exact(const Linear& linear) {
    const Linear::Gain all = linear.gain({});
    full_ = all * all.transpose();
    for (Eigen::Index i = 0; i < linear.lamps(); ++i)
      for (Eigen::Index k = i; k < linear.lamps(); ++k) {
        const std::vector<Eigen::Index> lamps =
            i == k ? std::vector<Eigen::Index>{i} : std::vector<Eigen::Index>{i, k};
        const Linear::Gain others = linear.gain(lamps);
        const Eigen::Matrix3d own = others * others.transpose();
        sets_.push_back({lamps, i == k ? fault : fault * fault, own, own - full_});
      }
    const double share = continuity / (2 * static_cast<double>(sets_.size()));
    vertical_sigmas_ = -normal_quantile(share / 2);
    horizontal_sigmas_ = std::sqrt(-2 * std::log(share));
  }

  const std::vector<Set>& sets() const { return sets_; }
  double horizontal_threshold(const Set& set) const {
    return horizontal_sigmas_ * Plane(set.separation).along;
  }
  double vertical_threshold(const Set& set) const {
    return vertical_sigmas_ * std::sqrt(set.separation(2, 2));
  }

  double vertical_level() const {
    const double sigma = std::sqrt(full_(2, 2));
    return level([&](double v) {
      double sum = 2 * tail(v / sigma);
      for (const Set& set : sets_) {
        const double across = std::sqrt(set.separation(2, 2)), limit = vertical_threshold(set);
        sum += set.probability * largest(limit, across, [&](double bias) {
                 return (tail((v - bias) / sigma) + tail((v + bias) / sigma)) *
                        (normal_probability((limit - bias) / across) -
                         normal_probability((-limit - bias) / across));
               });
      }
      return sum;
    });
  }

  /// Lower bound: biases along the largest separation, and errors along it, only.
  double horizontal_level() const {
    return level([&](double h) {
      double sum = 2 * tail(h / Plane(full_).along);
      for (const Set& set : sets_) {
        const Plane plane(set.separation);
        const double sigma = std::sqrt(plane.u.dot(full_.topLeftCorner<2, 2>() * plane.u));
        const double limit = horizontal_threshold(set);
        sum += set.probability * largest(limit, plane.along, [&](double bias) {
                 return (tail((h - bias) / sigma) + tail((h + bias) / sigma)) *
                        undetected(plane, limit, bias);
               });
      }
      return sum;
    });
  }

 private:
  static double undetected(const Plane& plane, double limit, double bias) {
    constexpr int steps = 60;
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
      const double y = 5 * plane.across * ((i + 0.5) / steps * 2 - 1);
      const double x = std::sqrt(std::max(0.0, limit * limit - y * y));
      const double weight = std::exp(-0.5 * y * y / (plane.across * plane.across)) * 10 / steps /
                            std::sqrt(2 * 3.14159265358979);
      sum += weight * (normal_probability((x - bias) / plane.along) -
                       normal_probability((-x - bias) / plane.along));
    }
    return sum;
  }

  static double largest(double limit, double sigma, const std::function<double(double)>& f) {
    double best = 0;
    for (int i = 0; i <= 60; ++i) best = std::max(best, f(i / 60.0 * (limit + 6 * sigma)));
    return best;
  }

  /// Sets of three lamps are not monitored.
  double level(const std::function<double(double)>& sum) const {
    const double rest = risk - 20 * fault * fault * fault;
    double low = 0, high = 1;
    for (int i = 0; i < 30; ++i) (sum((low + high) / 2) > rest ? low : high) = (low + high) / 2;
    return high;
  }

  Eigen::Matrix3d full_;
  std::vector<Set> sets_;
  double vertical_sigmas_, horizontal_sigmas_;
};

/// A camera whose parameters are off by as much as one stated standard deviation.
Camera real_camera(const Camera& stated) {
  Eigen::VectorXd values = stated.parameter_covariance().diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < values.size(); ++i)
    values[i] += stated.parameters()[static_cast<std::size_t>(i)].value;
  return stated.with_parameters(values);
}

/// Fits with the covariance of the whitened normal equations and with that of refine().
void expect_model_of(const Scene& scene, const test::Measurement& measurement,
                     const std::optional<Prior>& prior = std::nullopt) {
  Scene real = scene;
  real.camera = real_camera(scene.camera);
  Random random(1);
  const auto blobs =
      test::noisy(test::exact_blobs(real, truth(), measurement), real, measurement, random);
  RefineOptions options;
  options.prior = prior;
  std::vector<Match> matches = test::in_order(scene);
  const auto all = refine(truth(), matches, blobs, scene, options);
  ASSERT_TRUE(all.ok());
  const SeparationModel& model = all->separation;
  ASSERT_EQ(model.lamps.size(), scene.lamps.size());
  Eigen::MatrixXd information = model.prior_information;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(information.rows());
  for (const LampEquations& lamp : model.lamps) {
    information += lamp.information;
    gradient += lamp.gradient;
  }
  const auto covariance = [&](const Eigen::MatrixXd& of) -> Eigen::Matrix3d {
    return model.variance_factor * model.position_jacobian * of.inverse() *
           model.position_jacobian.transpose();
  };
  const Eigen::Matrix3d& stated = model.position_covariance_m2;
  EXPECT_LT((covariance(information) - stated).norm(), 1e-3 * stated.norm());
  // One step without a lamp leads to the fit without it.
  matches.erase(matches.begin() + 1);
  const auto others = refine(truth(), matches, blobs, scene, options);
  ASSERT_TRUE(others.ok());
  const Eigen::MatrixXd left = information - model.lamps[1].information;
  const Eigen::Vector3d step = model.position_jacobian * left.ldlt().solve(model.lamps[1].gradient);
  const Eigen::Vector3d separation =
      others->cam_from_world.origin_in_source() - all->cam_from_world.origin_in_source();
  const double sigma_m = std::sqrt(stated.trace());
  EXPECT_GT(separation.norm(), 0.02 * sigma_m);
  EXPECT_LT((step - separation).norm(), 0.05 * sigma_m);
  const Eigen::Matrix3d of_others = others->separation.position_covariance_m2;
  EXPECT_LT((covariance(left) - of_others).norm(), 0.05 * of_others.norm());
}

TEST(Separation, TheModelIsThatOfTheFit) {
  expect_model_of(points_room(), centroids);
  expect_model_of(test::irregular_room(), {60, 0.05, 0.03});
  expect_model_of(test::irregular_room(), {60, 0.05, 0.03, 0, 2});  // saturated
  Scene loose = test::irregular_room();
  loose.map_sigma_m = 0.002;
  expect_model_of(loose, {60, 0.05, 0.03});
  Prior prior;
  prior.position_m = truth().origin_in_source();
  prior.position_sigma_m = 0.001;
  expect_model_of(points_room(), centroids, prior);
  const auto uncalibrated = [](Scene scene) {
    scene.camera = scene.camera.with_parameter_sigmas({{"fx_px", 2}, {"fy_px", 2}, {"k1", 0.005}});
    return scene;
  };
  expect_model_of(uncalibrated(points_room()), centroids);
  expect_model_of(uncalibrated(test::irregular_room()), {60, 0.05, 0.03});
}

TEST(Separation, TheLevelIsCloseToTheExactBound) {
  const Scene scene = points_room();
  Random random(2);
  for (int i = 0; i < 10; ++i) {
    const Rigid3 pose = pose_of_all(scene, random);
    const auto blobs = test::exact_blobs(scene, pose, centroids);
    const auto refined = refine(pose, test::in_order(scene), blobs, scene);
    const auto level = protection_level(refined->separation, risk, continuity);
    ASSERT_TRUE(level.ok()) << level.message;
    EXPECT_EQ(level->hypotheses, 21);
    const Exact exact(Linear(scene, pose, centroids.centroid_sigma_px));
    const double vertical = level->vertical_m / exact.vertical_level();
    const double horizontal = level->horizontal_m / exact.horizontal_level();
    EXPECT_GT(vertical, 1);
    EXPECT_LT(vertical, 1.5);
    EXPECT_GT(horizontal, 1);
    EXPECT_LT(horizontal, 1.5);
  }
}

TEST(Separation, WithoutRedundancyTheLevelIsInfinite) {
  Scene scene = points_room();
  scene.lamps.resize(4);
  const auto blobs = test::exact_blobs(scene, truth(), centroids);
  const auto refined = refine(truth(), test::in_order(scene), blobs, scene);
  const auto level = protection_level(refined->separation, risk);
  EXPECT_EQ(level.status, Status::too_few_lamps);
  EXPECT_TRUE(std::isinf(level->horizontal_m) && std::isinf(level->vertical_m));
  EXPECT_GT(level->unmonitored, 5e-6);  // six pairs
  EXPECT_NE(level.message.find("not monitored"), std::string::npos) << level.message;
  EXPECT_TRUE(protection_level(refined->separation, 1e-4).ok());
  EXPECT_FALSE(protection_level(refined->separation, 1e-4, 1e-3, 1e-3).ok());
  EXPECT_EQ(protection_level({}, risk).status, Status::too_few_lamps);
}

TEST(Separation, MonitorsManyLampsInGroups) {
  Scene scene = points_room();
  for (int i = 0; i < 34; ++i) {
    Lamp lamp = scene.lamps.front();
    lamp.id = 6 + i;
    lamp.centre_m = {1 + 0.3 * (i % 6), 1.1 + 0.33 * (i / 6), 3};
    scene.lamps.push_back(lamp);
  }
  const auto blobs = test::exact_blobs(scene, truth(), centroids);
  const auto refined = refine(truth(), test::in_order(scene), blobs, scene);
  ASSERT_TRUE(refined.ok());
  const auto level = protection_level(refined->separation, risk);
  ASSERT_TRUE(level.ok()) << level.message;
  EXPECT_LT(level->horizontal_m, 0.02);
  EXPECT_LT(level->hypotheses, 2000);
}

TEST(Separation, FollowsTheVarianceFactorAndTheRisk) {
  const Scene scene = points_room();
  const auto refined =
      refine(truth(), test::in_order(scene), test::exact_blobs(scene, truth(), centroids), scene);
  SeparationModel model = refined->separation;
  const auto level = protection_level(model, risk);
  EXPECT_GT(protection_level(model, 1e-5)->vertical_m, 0.3 * level->vertical_m);
  EXPECT_LT(protection_level(model, 1e-5)->vertical_m, level->vertical_m);
  model.variance_factor *= 4;
  model.position_covariance_m2 *= 4;
  EXPECT_NEAR(protection_level(model, risk)->vertical_m, 2 * level->vertical_m,
              1e-3 * level->vertical_m);
  for (const double wrong : {0.0, 1.0, std::nan("")}) {
    EXPECT_THROW(protection_level(model, wrong), std::invalid_argument);
    EXPECT_THROW(protection_level(model, risk, wrong), std::invalid_argument);
  }
}

TEST(Separation, NamesALampThatContradicts) {
  Scene scene = points_room();
  auto blobs = test::exact_blobs(scene, truth(), centroids);
  blobs[2].centroid_px += Eigen::Vector2d(0.3, 0.3);
  RefineOptions options;
  options.huber_sigma = std::numeric_limits<double>::infinity();  // keeps all lamps
  const auto refined = refine(truth(), test::in_order(scene), blobs, scene, options);
  SeparationModel model = refined->separation;
  model.variance_factor = 1;
  model.position_covariance_m2 /= refined->variance_factor;
  const auto level = protection_level(model, risk);
  EXPECT_EQ(level.status, Status::no_pose);
  EXPECT_TRUE(std::isinf(level->horizontal_m));
  const std::vector<int>& named = level->contradicting_lamps;
  EXPECT_NE(std::find(named.begin(), named.end(), 2), named.end()) << level.message;
  const std::vector<int> separated = separated_lamps(model);
  EXPECT_NE(std::find(separated.begin(), separated.end(), 2), separated.end());
}

/// Estimates over images with one faulty lamp, and without a fault.
struct Tally {
  double probability = 0;  ///< probability of an error beyond the level that is not detected
  int infinite = 0, detected = 0, excluded = 0, beyond = 0;
  double largest = 0;  ///< error over the level
};

/// Fault of a lamp that is moved by 1 mm to 1 m, mostly to near the threshold of its separation.
/// Returns the errors of the centroids in sigmas.
Eigen::VectorXd draw_fault(const Scene& scene, const Rigid3& pose, const Linear& linear,
                           const Exact& exact, Eigen::Index lamp, Random& random) {
  Lamp moved = scene.lamps[static_cast<std::size_t>(lamp)];
  const Eigen::Vector2d before = *project_lamp_centre(moved, pose, scene.camera);
  const Eigen::Vector3d way =
      Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
  moved.centre_m += 1e-3 * way;
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(2 * linear.lamps());
  errors.segment<2>(2 * lamp) =
      (*project_lamp_centre(moved, pose, scene.camera) - before) / centroids.centroid_sigma_px;
  const auto set = std::find_if(exact.sets().begin(), exact.sets().end(), [&](const auto& other) {
    return other.lamps.size() == 1 && other.lamps.front() == lamp;
  });
  const Eigen::Vector3d effect = linear.gain({}) * errors;
  const double over = std::max(effect.head<2>().norm() / exact.horizontal_threshold(*set),
                               std::abs(effect.z()) / exact.vertical_threshold(*set));
  const double scale =
      random.uniform() < 0.2 ? std::pow(10, random.uniform(0, 3)) : random.uniform(0.5, 1.5) / over;
  return std::min(1000.0, std::max(1.0, scale)) * errors;
}

/// Draws noise about a mean towards a large error of the position without the faulty lamp
/// (importance sampling), and counts the images by their likelihood ratio.
Tally images_of(bool with_fault, int images, std::uint64_t seed) {
  const Scene scene = points_room();
  constexpr int images_of_pose = 500;
  Tally tally;
  for (int pose_index = 0; pose_index * images_of_pose < images; ++pose_index) {
    Random random(seed, static_cast<std::uint64_t>(pose_index));
    const Rigid3 pose = pose_of_all(scene, random);
    const Linear linear(scene, pose, centroids.centroid_sigma_px);
    const Exact exact(linear);
    const std::vector<Blob> clean = test::exact_blobs(scene, pose, centroids);
    for (int i = 0; i < images_of_pose; ++i) {
      const Eigen::Index lamp = i % linear.lamps();
      Eigen::VectorXd errors = Eigen::VectorXd::Zero(2 * linear.lamps());
      if (with_fault) errors = draw_fault(scene, pose, linear, exact, lamp, random);
      const Linear::Gain gain = with_fault && i % 4 < 2 ? linear.gain({lamp}) : linear.gain({});
      Eigen::Vector3d axis = with_fault ? Eigen::Vector3d(linear.gain({}) * errors)
                                        : Eigen::Vector3d(random.normal(), random.normal(), 0);
      if (i % 2 == 0)
        axis.z() = 0;
      else
        axis.head<2>().setZero();
      if (i % 2 == 1 && !with_fault) axis.z() = 1;
      const Eigen::VectorXd direction = (gain.transpose() * axis).normalized();
      const double reach = random.uniform(3, 6);
      Eigen::VectorXd noise(errors.size());
      for (double& value : noise) value = random.normal();
      noise += reach * direction;
      const double weight = std::exp(0.5 * reach * reach - reach * direction.dot(noise));
      errors += noise;
      std::vector<Blob> blobs = clean;
      for (std::size_t k = 0; k < blobs.size(); ++k)
        blobs[k].centroid_px +=
            centroids.centroid_sigma_px * errors.segment<2>(2 * static_cast<Eigen::Index>(k));
      const auto refined = refine(pose, test::in_order(scene), blobs, scene);
      const auto level = protection_level(refined->separation, risk, continuity);
      tally.detected += level.status == Status::no_pose;
      tally.infinite += level.status == Status::too_few_lamps;
      tally.excluded += refined->separation.excluded > 0;
      if (!level.ok()) continue;
      const Eigen::Vector3d error =
          refined->cam_from_world.origin_in_source() - pose.origin_in_source();
      const double over = std::max(error.head<2>().norm() / level->horizontal_m,
                                   std::abs(error.z()) / level->vertical_m);
      tally.largest = std::max(tally.largest, over);
      if (over <= 1) continue;
      ++tally.beyond;
      tally.probability += weight / images;
    }
  }
  return tally;
}

void expect_integrity(int images, std::uint64_t seed) {
  const Tally none = images_of(false, images / 5, seed), one = images_of(true, images, seed + 1);
  const double total = none.probability + 6 * fault * one.probability;
  EXPECT_LE(total, risk) << "without a fault " << none.probability << " (" << none.beyond
                         << " beyond), of one faulty lamp " << one.probability << " (" << one.beyond
                         << " beyond)";
  EXPECT_GT(one.detected + one.excluded, images / 50);
  EXPECT_GT(one.largest, 0.3);
  EXPECT_GT(none.largest, 0.3);
  EXPECT_LT(one.infinite, images / 20);
}

TEST(Separation, UndetectedErrorsBeyondTheLevelAreRare) { expect_integrity(3000, 10); }

TEST(SlowSeparation, UndetectedErrorsBeyondTheLevelAreRare) { expect_integrity(1000000, 20); }

/// Share of the poses with six lamps whose levels are at most 5 cm.
TEST(Separation, FiveCentimetresAreAvailable) {
  const Scene scene = points_room();
  Random random(30);
  int available = 0;
  constexpr int poses = 500;
  for (int i = 0; i < poses; ++i) {
    const Rigid3 pose = pose_of_all(scene, random);
    const auto blobs =
        test::noisy(test::exact_blobs(scene, pose, centroids), scene, centroids, random);
    const auto refined = refine(pose, test::in_order(scene), blobs, scene);
    const auto level = protection_level(refined->separation, risk);
    available += level.ok() && std::max(level->horizontal_m, level->vertical_m) <= 0.05;
  }
  EXPECT_GE(available, 0.99 * poses);
}

}  // namespace
}  // namespace occ
