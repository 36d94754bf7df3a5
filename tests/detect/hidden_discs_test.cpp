// SPDX-License-Identifier: Apache-2.0
// Discs of which something in front hides a part. The visible part of the rim gives the ellipse; if
// it is too short, the centre of the visible light has an error that its covariance contains.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::Canvas;
using Outline = std::vector<Eigen::Vector2d>;

constexpr double psf_px = 0.8, level_e = 4000;

/// The part of a convex outline where normal . p > distance.
Outline part_beyond(const Outline& outline, const Eigen::Vector2d& normal, double distance) {
  Outline out;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double at_a = normal.dot(a) - distance, at_b = normal.dot(b) - distance;
    if (at_a > 0) out.push_back(a);
    if ((at_a > 0) != (at_b > 0)) out.push_back(a + at_a / (at_a - at_b) * (b - a));
  }
  return out;
}

struct Disc {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d from_circle;  // the unit circle to its rim

  explicit Disc(Random& random, double flattest = 0.6) {
    const double major_px = 16 + 34 * random.uniform();
    const double minor_px = major_px * (flattest + (1 - flattest) * random.uniform());
    const Eigen::Rotation2Dd turn(pi * random.uniform());
    centre_px = {80 + random.uniform(), 80 + random.uniform()};
    from_circle = turn.toRotationMatrix() * Eigen::Vector2d(major_px, minor_px).asDiagonal();
  }

  /// A part of the unit circle as an outline in the image, with a point at least every 0.1 px.
  Outline outline(const Outline& of_circle) const {
    constexpr double spacing_px = 0.1;
    Outline out;
    for (std::size_t i = 0; i < of_circle.size(); ++i) {
      const Eigen::Vector2d a = centre_px + from_circle * of_circle[i];
      const Eigen::Vector2d b = centre_px + from_circle * of_circle[(i + 1) % of_circle.size()];
      const int steps = 1 + static_cast<int>((b - a).norm() / spacing_px);
      for (int k = 0; k < steps; ++k) out.emplace_back(a + (b - a) * k / steps);
    }
    return out;
  }
};

Outline unit_circle() {
  constexpr int count = 1500;
  Outline circle;
  for (int i = 0; i < count; ++i) {
    const double t = 2 * pi * i / count;
    circle.emplace_back(std::cos(t), std::sin(t));
  }
  return circle;
}

/// Parts of the unit circle that remain visible, for a random direction.
using Hide = std::function<std::vector<Outline>(const Eigen::Vector2d& direction, Random& random)>;

/// Hides what is farther than `distance` from the centre in one direction.
Hide by_edge(double distance) {
  return [=](const Eigen::Vector2d& direction, Random&) -> std::vector<Outline> {
    return {part_beyond(unit_circle(), -direction, -distance)};
  };
}

/// Hides a bar of that width at a random distance from the centre.
Hide by_beam(double width) {
  return [=](const Eigen::Vector2d& direction, Random& random) -> std::vector<Outline> {
    const double from = -1 + (2 - width) * random.uniform();
    return {part_beyond(unit_circle(), -direction, -from),
            part_beyond(unit_circle(), direction, from + width)};
  };
}

struct HiddenDiscs {
  int with_rim = 0, flagged = 0, false_sigmas = 0;
  double centre = 0;      // sum of normalised squared errors of those with a rim
  double centre_px2 = 0;  // sum of squared errors of those
  std::string text;
};

/// Measures `count` discs. A polygon of more than four corners is not counted: it is never taken
/// for a disc. Neither is a part of less than a seventh of the disc, which looks like a whole spot.
HiddenDiscs measure_discs(int count, const Hide& hide, double exposure = 1) {
  constexpr double unlikely_chi2 = 18.4;  // 1e-4 at two degrees of freedom
  HiddenDiscs discs;
  Random random(7);
  for (int i = 0; i < count; ++i) {
    const Disc disc(random);
    const double angle = 2 * pi * random.uniform();
    Canvas canvas(160, 160);
    for (const Outline& part : hide({std::cos(angle), std::sin(angle)}, random))
      if (part.size() > 2) canvas.add(disc.outline(part), psf_px, exposure * level_e);
    for (const Blob& blob : detect(canvas.image({}, &random).view())) {
      if (blob.corners_px.size() > 4) continue;
      if (blob.area_px < pi * disc.from_circle.determinant() / 7) continue;
      const Eigen::Vector2d error_px = blob.centroid_px - disc.centre_px;
      const double nees = test::nees(error_px, blob.covariance_px2);
      discs.flagged += blob.hidden_in_part;
      if (blob.has_elliptical_rim()) {
        ++discs.with_rim;
        discs.centre += nees;
        discs.centre_px2 += error_px.squaredNorm();
      }
      if (nees < unlikely_chi2) continue;
      ++discs.false_sigmas;
      discs.text += "disc " + std::to_string(i) + " is " + std::to_string(error_px.norm()) +
                    " px off, " + std::to_string(std::sqrt(nees)) + " sigmas\n";
    }
  }
  return discs;
}

TEST(HiddenDiscs, TheVisibleRimGivesTheCentre) {
  for (const double distance : {0.9, 0.8, 0.7, 0.5, 0.4}) {
    SCOPED_TRACE(testing::Message() << "hidden beyond " << distance << " of the radius");
    const HiddenDiscs discs = measure_discs(40, by_edge(distance));
    EXPECT_GE(discs.with_rim, 38);
    EXPECT_GE(discs.flagged, distance > 0.85 ? 0 : 38);
    EXPECT_LT(discs.centre, test::chi2_interval(2.0 * discs.with_rim).second);
    EXPECT_LT(discs.centre_px2, discs.with_rim * square(0.05));
    EXPECT_EQ(discs.false_sigmas, 0) << discs.text;
  }
}

TEST(HiddenDiscs, TooShortARimIsNotUsed) {
  for (const double distance : {0.2, 0.0, -0.2, -0.4, -0.6}) {
    SCOPED_TRACE(testing::Message() << "hidden beyond " << distance << " of the radius");
    const HiddenDiscs discs = measure_discs(40, by_edge(distance));
    EXPECT_EQ(discs.false_sigmas, 0) << discs.text;
  }
}

TEST(HiddenDiscs, TheSigmasHoldBehindABeam) {
  for (const double width : {0.1, 0.2, 0.4, 0.8}) {
    SCOPED_TRACE(testing::Message() << "a beam of " << width << " of the radius");
    const HiddenDiscs discs = measure_discs(40, by_beam(width));
    EXPECT_EQ(discs.false_sigmas, 0) << discs.text;
  }
}

TEST(HiddenDiscs, AnOverExposedDiscHasItsVisibleRimToo) {
  for (const double distance : {0.8, 0.5}) {
    SCOPED_TRACE(testing::Message() << "hidden beyond " << distance << " of the radius");
    const HiddenDiscs discs = measure_discs(40, by_edge(distance), 3);
    EXPECT_GE(discs.with_rim, 36);
    EXPECT_LT(discs.centre_px2, discs.with_rim * square(0.1));
    EXPECT_EQ(discs.false_sigmas, 0) << discs.text;
  }
}

/// A whole disc is measured as before, without that flag.
TEST(HiddenDiscs, AWholeDiscIsNotHidden) {
  const HiddenDiscs discs = measure_discs(40, by_edge(2));
  EXPECT_EQ(discs.with_rim, 40);
  EXPECT_EQ(discs.flagged, 0);
}

}  // namespace
}  // namespace occ
