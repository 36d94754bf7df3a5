// SPDX-License-Identifier: Apache-2.0
// Input of the search and the account of lamps without a blob, compared with their definitions.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/assignment_problem.hpp"
#include "libocc/identify/internal/size_consistency.hpp"
#include "libocc/identify/internal/verdict.hpp"
#include "tests/identify/identify_support.hpp"

namespace occ {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using internal::identify::AssignmentProblem;
using internal::identify::BearingObservation;
using internal::identify::hypothesis_at;
using internal::identify::make_problem;
using test::upright;
using test::View;

/// Blob of a disc with its rim.
Blob disc_blob(const Vector2d& px, double major_px, double minor_px, double angle_rad) {
  Blob blob = test::spot(px, 0.1, 1e4);
  blob.flux_sigma_dn = 100;
  blob.ellipse = {px, major_px, minor_px, angle_rad};
  blob.rim = {RimPoint{px + Vector2d(major_px, 0), {1, 0}, 0.1}};
  blob.area_px = static_cast<int>(3.14159 * major_px * minor_px);
  return blob;
}

BearingObservation observation_of(const Blob& blob, const Scene& scene,
                                  const IdentifyOptions& options = {}) {
  const std::vector<Blob> blobs{blob};
  const AssignmentProblem problem = make_problem(blobs, scene, options);
  EXPECT_EQ(problem.observations.size(), 1u);
  return problem.observations.empty() ? BearingObservation{} : problem.observation(0);
}

TEST(IdentifyProblem, AnObservationHasTheBearingAndItsCovariance) {
  Scene scene = test::irregular_room();
  scene.camera = Camera::pinhole(640, 480, 380, 405, 322, 236, {-0.2, 0.05, 0, 0});
  IdentifyOptions options;
  options.model_sigma_px = 0.3;
  Blob blob = test::spot({120, 390}, 0.5, 1e4);
  blob.covariance_px2 << 0.5, 0.2, 0.2, 0.3;
  const BearingObservation s = observation_of(blob, scene, options);
  EXPECT_LT((s.bearing - *scene.camera.unproject(blob.centroid_px)).norm(), 1e-12);
  // Offsets in the tangent plane, by differences of bearings.
  Matrix2d by_pixel;
  for (int k = 0; k < 2; ++k) {
    const Vector2d step = 0.01 * Vector2d::Unit(k);
    by_pixel.col(k) = s.tangent *
                      (*scene.camera.unproject(blob.centroid_px + step) -
                       *scene.camera.unproject(blob.centroid_px - step)) /
                      0.02;
  }
  const Matrix2d total = blob.covariance_px2 + square(0.3) * Matrix2d::Identity();
  const Matrix2d expected = by_pixel * total * by_pixel.transpose();
  EXPECT_LT((s.covariance - expected).norm(), 1e-4 * expected.norm());
  EXPECT_NEAR(s.sigma_rad, std::sqrt(expected.trace()), 1e-3 * s.sigma_rad);
  // Errors of the map: of a lamp at the distance that the smallest lamp has for its size.
  scene.map_sigma_m = PerAxis(0.02);
  blob.ellipse.semi_major_px = 30;
  const BearingObservation unsure = observation_of(blob, scene, options);
  const double px_rad = by_pixel.norm() / std::sqrt(2.0);
  const double distance_m =
      std::min(make_problem({}, scene, options).size_m, 0.085 / (30 * px_rad));
  EXPECT_NEAR((unsure.covariance - s.covariance).trace() / 2, square(0.02 / distance_m),
              0.02 * square(0.02 / distance_m));
}

TEST(IdentifyProblem, SizesContainTheTrueAngle) {
  const Scene scene = test::irregular_room();
  for (const double angle : {0.0, 0.7, 1.5, -1.0})
    for (const bool saturated : {false, true}) {
      // A disc of 0.04 rad near the optical axis, seen at 50 degrees.
      const double major_px = 0.04 * 422.5, minor_px = major_px * 0.64;
      Blob blob = disc_blob({310, 250}, major_px, minor_px, angle);
      blob.saturated = saturated;
      const BearingObservation s = observation_of(blob, scene);
      EXPECT_LT(s.min_radius_rad, saturated ? 0.022 : 0.034);
      EXPECT_GT(s.min_radius_rad, saturated ? 0.01 : 0.024);
      EXPECT_GT(s.max_radius_rad, 0.046);
      EXPECT_LT(s.max_radius_rad, 0.062);
      if (saturated) {  // its rim may lie 5 px outside the true one
        EXPECT_EQ(s.radius_rad, 0);
        continue;
      }
      EXPECT_NEAR(s.radius_rad, 0.04, 2e-4);
      EXPECT_NEAR(s.flatness, 0.64, 1e-9);
      EXPECT_GT(s.radius_sigma, 1 / minor_px);
      EXPECT_LT(s.radius_sigma, 2 / minor_px);
    }
  for (bool Blob::*reason : {&Blob::striped, &Blob::cut_by_border}) {
    Blob blob = disc_blob({310, 250}, 9, 8, 0);
    blob.*reason = true;
    const BearingObservation s = observation_of(blob, scene);
    EXPECT_EQ(s.radius_rad, 0);
    EXPECT_GT(s.max_radius_rad, 0.02);
  }
  Blob blob = disc_blob({310, 250}, 9, 8, 0);
  blob.rim.clear();
  EXPECT_EQ(observation_of(blob, scene).max_radius_rad, 0);
}

TEST(IdentifyProblem, FluxesAreThoseBeforeVignetting) {
  Scene scene = test::irregular_room();
  scene.lens.vignetting = {-0.4};
  Blob blob = test::spot({60, 400}, 0.1, 1e4);
  EXPECT_EQ(observation_of(blob, scene).flux, 0) << "without a sigma it is no measurement";
  blob.flux_sigma_dn = 200;
  const BearingObservation s = observation_of(blob, scene);
  const double corner2 = square(319.5 + 0.5) + square(239.5 + 0.5);
  const double q2 = (square(60 - 319.5) + square(400 - 239.5)) / corner2;
  EXPECT_NEAR(s.flux, 1e4 / (1 - 0.4 * q2), 30);
  EXPECT_NEAR(s.flux_sigma, 0.02, 1e-9);
  EXPECT_FALSE(s.flux_is_bound);
  for (bool Blob::*reason : {&Blob::saturated, &Blob::striped}) {
    Blob bound = blob;
    bound.*reason = true;
    EXPECT_TRUE(observation_of(bound, scene).flux_is_bound);
  }
}

TEST(IdentifyProblem, LampsAtOnePlaceThatShineTheSameWayAreOne) {
  Scene scene = test::irregular_room();
  const auto duplicates = [&](double apart_m, const Vector3d& normal) {
    Scene changed = scene;
    Lamp lamp = scene.lamps[3];
    lamp.id = 9;
    lamp.centre_m += Vector3d(0, apart_m, 0);
    lamp.normal = normal;
    changed.lamps.insert(changed.lamps.begin(), lamp);
    changed.validate();
    const AssignmentProblem problem = make_problem({}, changed, {});
    EXPECT_FALSE(problem.map_point(0).duplicate);
    int count = 0;
    for (const auto& point : problem.map_points) count += point.duplicate;
    EXPECT_EQ(count > 0, problem.map_point(4).duplicate);
    EXPECT_EQ(count > 0, problem.map_point(4).power_w == 0);
    EXPECT_EQ(count > 0, problem.map_point(0).power_w == 0);
    return count;
  };
  EXPECT_EQ(duplicates(0, {0, 0, -1}), 1);
  EXPECT_EQ(duplicates(2e-5, {0.5, 0, -1}), 1);
  EXPECT_EQ(duplicates(0.002, {0, 0, -1}), 0);
  EXPECT_EQ(duplicates(0, {1, 0, 0.1}), 0);
}

TEST(IdentifyProblem, PartialBlobsAreKeptApart) {
  const Scene scene = test::irregular_room();
  std::vector<Blob> blobs;
  for (int i = 0; i < 5; ++i) blobs.push_back(disc_blob({100.0 + 90 * i, 200}, 12, 10, 0));
  blobs[1].merged = true;
  blobs[2].cut_by_border = true;
  blobs[2].area_px = static_cast<int>(0.8 * 3.14159 * 120);  // nearly whole
  blobs[3].cut_by_border = true;
  blobs[3].area_px = static_cast<int>(0.55 * 3.14159 * 120);
  EXPECT_EQ(make_problem(blobs, scene, {}).partial_blobs, (std::vector<int>{1, 3}));
  // With a prior a merged blob serves if fewer than three are whole.
  IdentifyOptions options;
  options.prior = Prior{};
  options.prior->gravity_in_cam = Vector3d(0, 0, -1);
  EXPECT_EQ(make_problem(blobs, scene, options).partial_blobs, (std::vector<int>{1, 3}));
  blobs[4].merged = true;
  EXPECT_EQ(make_problem(blobs, scene, options).partial_blobs, (std::vector<int>{3}));
  EXPECT_EQ(make_problem(blobs, scene, {}).partial_blobs, (std::vector<int>{1, 3, 4}));
  blobs[4].frequency_hz = 1000;
  EXPECT_EQ(make_problem(blobs, scene, {}).partial_blobs, (std::vector<int>{1, 3}));
}

// Distances within the limits of two sizes that have the separation of the map must be permitted.
// Assignments that are far from it for all distances must be excluded.
TEST(IdentifyProblem, SizesExcludeWhatNoDistanceCanExplain) {
  Random random(1);
  int permitted = 0, excluded = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Scene scene = test::random_room(random, 5, 1.5);
    for (Lamp& lamp : scene.lamps) lamp.radius_m = random.uniform(0.04, 0.2);
    std::vector<Blob> blobs;
    for (int i = 0; i < 3; ++i) {
      const double radius_px = std::exp(random.uniform(-0.3, 4.1));
      blobs.push_back(disc_blob({random.uniform(50, 590), random.uniform(50, 430)}, radius_px,
                                0.9 * radius_px, 0));
    }
    const IdentifyOptions options;
    const AssignmentProblem problem = make_problem(blobs, scene, options);
    internal::identify::SizeConsistency sizes(problem);
    for (int a = 0; a < 5; ++a)
      for (int b = 0; b < 5; ++b) {
        if (a == b) continue;
        const BearingObservation &s = problem.observation(0), &t = problem.observation(1);
        const double cosine = s.bearing.dot(t.bearing);
        const double length_m = (scene.lamps[a].centre_m - scene.lamps[b].centre_m).norm();
        // Between the limits of the size; a small one has no upper limit.
        const auto at = [](const BearingObservation& o, const Lamp& lamp, double share) {
          const double low_m = lamp.radius_m / o.max_radius_rad;
          const double high_m = o.min_radius_rad > 0 ? lamp.radius_m / o.min_radius_rad : 60;
          return low_m * std::pow(high_m / low_m, share);
        };
        double nearest_m = 1e9, error_m = 0;
        for (int i = 0; i <= 40; ++i)
          for (int k = 0; k <= 40; ++k) {
            const double d = at(s, scene.lamps[a], i / 40.0), e = at(t, scene.lamps[b], k / 40.0);
            const double apart_m = std::sqrt(d * d + e * e - 2 * d * e * cosine);
            nearest_m = std::min(nearest_m, std::abs(apart_m - length_m));
            error_m = std::max(error_m, 4 * (s.sigma_rad * d + t.sigma_rad * e));
          }
        const bool permits = sizes.permits({0, a}, {1, b});
        EXPECT_EQ(permits, sizes.permits({1, b}, {0, a}));
        if (nearest_m < 0.005 * length_m) {
          ++permitted;
          EXPECT_TRUE(permits) << nearest_m << ' ' << length_m;
        }
        if (nearest_m > 0.06 * length_m + 1.2 * error_m) {
          ++excluded;
          EXPECT_FALSE(permits) << nearest_m << ' ' << length_m;
        }
      }
  }
  EXPECT_GT(permitted, 30);
  EXPECT_GT(excluded, 100);
}

/// A lamp in the middle of the image and four around it, of which the first is not seen.
struct Missing {
  Scene scene = test::irregular_room();
  Rigid3 pose = upright({2, 2, 0.5}, 0.2);
  std::vector<Blob> blobs;
  std::vector<Match> matches;
  IdentifyOptions options;

  Missing() {
    const Vector3d places[] = {
        {2, 2, 3}, {1.2, 1.3, 3}, {2.9, 1.5, 3}, {1.5, 2.6, 3}, {2.7, 2.8, 3}};
    scene.lamps.clear();
    for (const Vector3d& place : places)
      scene.lamps.push_back(test::disc_lamp(static_cast<int>(scene.lamps.size()), place));
    for (int lamp = 1; lamp < 5; ++lamp) {
      blobs.push_back(test::spot(image_of(lamp), 0.1, 1e4));
      matches.push_back({lamp, lamp - 1});
    }
  }
  Vector2d image_of(int lamp) const {
    return *scene.camera.project(pose * scene.lamps[lamp].centre_m);
  }
  std::optional<Hypothesis> assigned() const {
    return hypothesis_at(make_problem(blobs, scene, options), matches, pose);
  }
  int missed() const {
    const std::optional<Hypothesis> found = assigned();
    return found ? found->missed : -1;
  }
};

TEST(IdentifyMissed, IsALampThatMustBeSeen) {
  Missing given;
  EXPECT_EQ(given.missed(), 1);
  EXPECT_NEAR(given.assigned()->chi2, given.options.miss_penalty, 1e-6);
  Missing away = given;
  away.scene.lamps[0].normal = Vector3d(0, 0, 1);
  EXPECT_EQ(away.missed(), 0);
  // Seen at 87 and at 70 degrees from its normal.
  Missing flat = given;
  flat.scene.lamps[0].normal = Vector3d(1, 0, -0.05).normalized();
  EXPECT_EQ(flat.missed(), 0);
  flat.scene.lamps[0].normal = Vector3d(1, 0, -0.36).normalized();
  EXPECT_EQ(flat.missed(), 1);
  Missing boxed = given;
  boxed.scene.boxes = {{{1.9, 1.9, 1.5}, {2.1, 2.1, 1.6}}};
  EXPECT_EQ(boxed.missed(), 0);
  // The lamp is 14 px wide in radius: whole in the image, or cut by its border.
  for (const auto& [x_m, missed] : {std::pair{2 + 1.75, 1}, {2 + 1.85, 0}, {2 + 2.5, 0}}) {
    Missing aside = given;
    aside.pose = upright({2, 2, 0.5}, 0);
    for (int lamp = 1; lamp < 5; ++lamp) aside.blobs[lamp - 1].centroid_px = aside.image_of(lamp);
    aside.scene.lamps[0].centre_m.x() = x_m;
    EXPECT_EQ(aside.missed(), missed) << x_m;
  }
}

TEST(IdentifyMissed, IsNoLampThatAnotherBlobCoversOrShowsInPart) {
  for (const double aside_px : {0.0, 16.0, 40.0}) {
    Missing covered;  // by a blob of another light, 20 px wide
    Blob other = test::spot(covered.image_of(0) + Vector2d(aside_px, 0), 0.1, 1e4);
    other.x0 -= 6, other.x1 += 6, other.y0 -= 6, other.y1 += 6;
    covered.blobs.push_back(other);
    EXPECT_EQ(covered.missed(), aside_px < 10 + 4 ? 0 : 1) << aside_px;
    // A merged blob there shows the lamp.
    covered.blobs.back().merged = true;
    covered.blobs.back().area_px = 300;
    const auto found = covered.assigned();
    EXPECT_EQ(found->missed, aside_px < 10 + 4 ? 0 : 1) << aside_px;
    const bool attached = std::any_of(found->matches.begin(), found->matches.end(),
                                      [](const Match& m) { return m.lamp == 0 && m.blob == 4; });
    EXPECT_EQ(attached, aside_px < 10 + 4) << aside_px;
    // Too large for a few lamps: a window or a lit wall, which covers the lamp.
    covered.blobs.back().area_px = 20000;
    const auto wide = covered.assigned();
    EXPECT_EQ(wide->matches.size(), 4u);
    EXPECT_EQ(wide->missed, aside_px < 10 + 4 ? 0 : 1) << aside_px;
  }
  // The nearer of two partial blobs shows it.
  Missing given;
  for (const double aside_px : {5.0, -2.0, 7.0}) {
    Blob part = test::spot(given.image_of(0) + Vector2d(aside_px, 0), 0.1, 1e4);
    part.merged = true;
    part.x0 -= 6, part.x1 += 6;
    given.blobs.push_back(part);
  }
  const auto found = given.assigned();
  ASSERT_EQ(found->matches.size(), 5u);
  EXPECT_EQ(found->matches.front().blob, 5);
}

TEST(IdentifyMissed, APoseThatContradictsLampOrPriorIsNone) {
  Missing given;
  ASSERT_TRUE(given.assigned());
  Missing away = given;
  away.scene.lamps[2].normal = Vector3d(0, 0, 1);
  EXPECT_FALSE(away.assigned());
  Missing small = given;
  small.blobs[1] = disc_blob(small.blobs[1].centroid_px, 14, 14, 0);
  EXPECT_TRUE(small.assigned());
  small.blobs[1].ellipse.semi_major_px = small.blobs[1].ellipse.semi_minor_px = 5;
  EXPECT_FALSE(small.assigned());
  // The prior may be off by twice the gate of four sigmas.
  for (const auto& [off_m, allowed] : {std::pair{0.0, true}, {0.65, true}, {0.9, false}}) {
    Missing prior = given;
    prior.options.prior = Prior{};
    prior.options.prior->position_m = Vector3d(2, 2 + off_m, 0.5);
    prior.options.prior->position_sigma_m = 0.1;
    EXPECT_EQ(prior.assigned().has_value(), allowed) << off_m;
  }
}

TEST(IdentifyVerdictMessage, NamesTheDoubt) {
  using internal::identify::doubt_message;
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  const std::string rivals = doubt_message(3, 0.4, 0.1, "a turn");
  EXPECT_TRUE(has(rivals,
                  "3 poses match the image: a turn; the best is right with a probability of "
                  "0.4"))
      << rivals;
  EXPECT_TRUE(has(doubt_message(2, 0.5, 0.1), "2 poses match the image; the best")) << rivals;
  EXPECT_TRUE(has(doubt_message(3, 0.1, 0.8), "accidental with a probability of 0.8"));
  EXPECT_TRUE(has(doubt_message(1, 0.9, 0.1), "the only pose found may be accidental"));
  // Other lights are the larger doubt although there are rivals.
  EXPECT_TRUE(has(doubt_message(2, 0.7, 0.25), "the only pose found may be accidental"));
}

}  // namespace
}  // namespace occ
