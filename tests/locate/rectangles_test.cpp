// SPDX-License-Identifier: Apache-2.0
// Rectangular luminaires and tubes: several of them, and a single one, whose corners give all
// poses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Lamp rectangle(int id, const Eigen::Vector3d& centre_m, const Eigen::Vector2d& size_m) {
  Lamp lamp;
  lamp.id = id;
  lamp.shape = LampShape::rectangle;
  lamp.centre_m = centre_m;
  lamp.size_m = size_m;
  lamp.power_w = 60 * size_m.prod();
  return lamp;
}

Scene room_of(const Eigen::Vector2d& size_m, const std::vector<Eigen::Vector3d>& centres_m) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  for (const Eigen::Vector3d& centre_m : centres_m)
    scene.lamps.push_back(rectangle(static_cast<int>(scene.lamps.size()), centre_m, size_m));
  scene.validate();
  return scene;
}

/// A camera under the lamps, tilted by up to 14 degrees.
Rigid3 random_view(Random& random, const Eigen::Vector3d& position_m, double reach_m) {
  const Eigen::Vector3d at = position_m + Eigen::Vector3d(random.uniform(-reach_m, reach_m),
                                                          random.uniform(-reach_m, reach_m), 0);
  Rigid3 pose;
  pose.rotation =
      so3_exp(Eigen::Vector3d(0, 0, random.uniform(-pi, pi))) *
      so3_exp(Eigen::Vector3d(random.uniform(-0.25, 0.25), random.uniform(-0.25, 0.25), 0));
  pose.translation = -(pose.rotation * at);
  return pose;
}

struct Errors {
  double nees = 0, worst_m = 0;
  int images = 0, candidates = 0;
};

/// Errors of the candidate that is nearest to the truth.
void add(const Fix& fix, const Rigid3& truth, Errors& errors) {
  const Eigen::Vector3d position_m = truth.origin_in_source();
  const Candidate* nearest = nullptr;
  for (const Candidate& c : fix.candidates)
    if (!nearest || (c.position_m - position_m).norm() < (nearest->position_m - position_m).norm())
      nearest = &c;
  ASSERT_NE(nearest, nullptr);
  const Vector6 error = difference(nearest->cam_from_world, truth);
  errors.nees += error.dot(nearest->covariance.inverse() * error) / 6;
  errors.worst_m = std::max(errors.worst_m, (nearest->position_m - position_m).norm());
  ++errors.images;
  errors.candidates += static_cast<int>(fix.candidates.size());
}

const std::vector<Eigen::Vector3d> irregular = {
    {1, 1, 3}, {2.8, 1.2, 3}, {1.2, 2.9, 3}, {2.6, 2.7, 3}, {1.9, 1.9, 3}};

TEST(LocateRectangles, PanelsAndTubesAreFoundWithTrueCovariances) {
  for (const Eigen::Vector2d& size_m : {Eigen::Vector2d(0.45, 0.45), Eigen::Vector2d(0.7, 0.06)}) {
    SCOPED_TRACE(size_m.transpose());
    const Scene scene = room_of(size_m, irregular);
    Random random(4);
    Errors errors;
    for (int trial = 0; trial < 40; ++trial) {
      SimulateOptions simulation;
      simulation.seed = static_cast<std::uint64_t>(trial);
      const Rigid3 truth = random_view(random, {1.9, 1.9, 0}, 0.15);
      const Rendered rendered = simulate(scene, truth, simulation);
      const Result<Fix> fix = locate(rendered.image.view(), scene);
      ASSERT_EQ(fix.status, Status::ok) << trial << ": " << fix.message;
      add(*fix, truth, errors);
    }
    EXPECT_LT(errors.worst_m, 1e-3);
    // The error of the edge model is stated for a single panel; those of several average.
    EXPECT_NEAR(errors.nees / errors.images, 0.8, 0.35);
  }
}

// The cathodes of a tube are dark: its ends are dimmer than its middle, and end where the map says.
TEST(LocateRectangles, DimEndsOfTubesAreAllowedFor) {
  const double length_m = 0.7, width_m = 0.06;
  const Scene scene = room_of({length_m, width_m}, irregular);
  for (const double dim_m : {0.03, 0.1}) {
    SCOPED_TRACE(dim_m);
    Scene real = scene;
    real.lamps.clear();
    const auto add_part = [&](const Lamp& tube, double middle_m, double part_m, double light) {
      Lamp part = tube;
      part.id = static_cast<int>(real.lamps.size());
      part.centre_m += middle_m * tube.x_axis;
      part.size_m.x() = part_m;
      part.power_w *= light * part_m / length_m;
      real.lamps.push_back(part);
    };
    for (const Lamp& tube : scene.lamps) {
      add_part(tube, 0, length_m - 2 * dim_m, 1);
      for (const double side : {-1, 1}) add_part(tube, side * (length_m - dim_m) / 2, dim_m, 0.35);
    }
    Random random(4);
    Errors errors;
    int found = 0;
    for (int i = 0; i < 30; ++i) {
      const Rigid3 pose = random_view(random, {1.9, 1.9, 0.4}, 0.5);
      SimulateOptions options;
      options.seed = static_cast<std::uint64_t>(i);
      const Result<Fix> fix = locate(simulate(real, pose, options).image.view(), scene);
      found += fix.ok() ? 1 : 0;
      if (fix.ok() || fix.status == Status::ambiguous) add(*fix, pose, errors);
      if (fix.ok()) {
        const Vector6 error = difference(fix->cam_from_world, pose);
        EXPECT_LT(error.dot(fix->covariance.inverse() * error), 27.9) << i;  // 1e-4
        EXPECT_LT((fix->position_m - pose.origin_in_source()).norm(), 0.05);
      }
    }
    EXPECT_LT(errors.nees / errors.images, 1.3);
    EXPECT_GE(found, dim_m < 0.05 ? 28 : 1);
  }
}

// Panels that cover half of each background mesh around them.
TEST(LocateRectangles, LargePanelsAreNoBackground) {
  Scene scene = room_of({0.6, 0.6},
                        {{1, 1.1, 3}, {2.9, 1.2, 3}, {1.2, 2.8, 3}, {2.6, 2.7, 3}, {1.9, 1.7, 3}});
  for (Lamp& lamp : scene.lamps) {
    const double angle = 0.55 * lamp.id;
    lamp.x_axis = {std::cos(angle), std::sin(angle), 0};
  }
  Random random(6);
  for (int i = 0; i < 60; ++i) {
    const Rigid3 pose = random_view(random, {2, 2, 0.5}, 0.5);
    SimulateOptions options;
    options.seed = static_cast<std::uint64_t>(i);
    const Rendered rendered = simulate(scene, pose, options);
    for (const LampTruth& lamp : rendered.lamps) {
      if (!lamp.whole) continue;
      const std::vector<Blob> blobs = detect(rendered.image.view());
      const bool is_found = std::any_of(blobs.begin(), blobs.end(), [&](const Blob& blob) {
        return blob.corners_px.size() == 4 &&
               (blob.centroid_px - lamp.image_centre_px).norm() < 0.3;
      });
      EXPECT_TRUE(is_found) << "view " << i << ", lamp " << lamp.id;
    }
  }
}

TEST(LocateRectangles, OneGivesAllItsPoses) {
  for (const auto& [size_m, poses] :
       {std::pair{Eigen::Vector2d(0.6, 0.6), 4}, {Eigen::Vector2d(0.6, 0.3), 2}}) {
    SCOPED_TRACE(size_m.transpose());
    const Scene scene = room_of(size_m, {{2, 2, 3}});
    Random random(7);
    Errors errors;
    for (int trial = 0; trial < 60; ++trial) {
      SimulateOptions simulation;
      simulation.seed = static_cast<std::uint64_t>(trial);
      const Rigid3 truth = random_view(random, {2, 2, 0.5}, 0.4);
      const Rendered rendered = simulate(scene, truth, simulation);
      if (!rendered.lamps[0].whole) continue;
      const Result<Fix> fix = locate(rendered.image.view(), scene);
      ASSERT_EQ(fix.status, Status::ambiguous) << trial << ": " << fix.message;
      EXPECT_EQ(fix->candidates.size(), static_cast<std::size_t>(poses)) << trial;
      add(*fix, truth, errors);

      LocateOptions options;
      options.prior.emplace();
      options.prior->heading_rad = heading_rad(truth);
      options.prior->heading_sigma_rad = 0.05;
      const Result<Fix> by_heading = locate(rendered.image.view(), scene, options);
      EXPECT_EQ(by_heading->candidates.size(), 1u) << trial;
      EXPECT_EQ(by_heading.status, Status::ambiguous);  // a window of its shape fits as well
      options.prior->height_m = 0.5;
      EXPECT_EQ(locate(rendered.image.view(), scene, options).status, Status::ok) << trial;
    }
    EXPECT_GT(errors.images, 30);
    EXPECT_LT(errors.worst_m, 0.01);
    EXPECT_NEAR(errors.nees / errors.images, 1, 0.25);
  }
}

// Another rectangle, larger and farther, as a window: its size contradicts the height.
TEST(LocateRectangles, ARectangleOfAnotherSizeIsNotOkWhereTheHeightIsKnown) {
  const Scene seen = room_of({0.7, 0.35}, {{2, 2, 3}}), map = room_of({0.6, 0.3}, {{2, 2, 3}});
  Random random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const Rigid3 truth = random_view(random, {2, 2, 0.5}, 0.3);
    const Rendered rendered = simulate(seen, truth);
    if (!rendered.lamps[0].whole) continue;
    LocateOptions options;
    options.prior.emplace();
    options.prior->heading_rad = heading_rad(truth);
    EXPECT_NE(locate(rendered.image.view(), map, options).status, Status::ok);
    options.prior->height_m = 0.5;
    EXPECT_NE(locate(rendered.image.view(), map, options).status, Status::ok);
  }
}

/// Sixteen equal panels at random places of a ceiling.
Scene random_panels(Random& random) {
  std::vector<Eigen::Vector3d> places_m;
  while (places_m.size() < 16) {
    const Eigen::Vector3d place_m(random.uniform(-5, 5), random.uniform(-2.6, 2.6), 3);
    if (std::all_of(places_m.begin(), places_m.end(), [&](const Eigen::Vector3d& other_m) {
          return (other_m - place_m).norm() > 0.8;
        }))
      places_m.push_back(place_m);
  }
  return room_of({0.4, 0.3}, places_m);
}

/// The panels as trapezoids or as Lame curves.
Scene as_trapezoids(Scene map) {
  for (Lamp& lamp : map.lamps) {
    lamp.shape = LampShape::polygon;
    lamp.size_m.setZero();
    lamp.corners_m = {{-0.2, -0.15}, {0.2, -0.15}, {0.12, 0.15}, {-0.12, 0.15}};
  }
  map.validate();
  return map;
}

Scene as_curves(Scene map) {
  for (Lamp& lamp : map.lamps) {
    lamp.shape = LampShape::lame;
    lamp.exponent = 4;
  }
  map.validate();
  return map;
}

/// A picture in a random room.
struct RoomPicture {
  Scene map;
  Rigid3 truth;
  Rendered rendered;

  RoomPicture(Random& random, Scene (*as_other)(Scene), int seed)
      : map(as_other(random_panels(random))), truth(random_view(random, {0, 0, 0.5}, 1)) {
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(seed);
    rendered = simulate(map, truth, simulation);
  }

  std::ptrdiff_t whole_lamps() const {
    return std::count_if(rendered.lamps.begin(), rendered.lamps.end(),
                         [](const LampTruth& lamp) { return lamp.whole; });
  }
  double error_m(const Eigen::Vector3d& position_m) const {
    return (position_m - truth.origin_in_source()).norm();
  }
};

Scene as_panels(Scene map) { return map; }

void expect_three_are_named(Scene (*as_other)(Scene)) {
  Random random(8);
  int images = 0;
  for (int room = 0; room < 40; ++room) {
    const RoomPicture picture(random, as_other, room);
    if (picture.whole_lamps() != 3) continue;
    ++images;
    const Result<Fix> fix = locate(picture.rendered.image.view(), picture.map);
    EXPECT_EQ(fix.status, Status::ok) << fix.message;
    if (fix.ok()) {
      EXPECT_LT(picture.error_m(fix->position_m), 2e-3);
    }
  }
  EXPECT_GE(images, 8);
}

/// Any three panels fit some pose by their centres: their outlines select it.
TEST(LocateRectangles, ThreeOfSixteenEqualPanelsAreNamed) { expect_three_are_named(as_panels); }

TEST(LocateRectangles, ThreeOfSixteenEqualPolygonsOrCurvesAreNamed) {
  expect_three_are_named(as_trapezoids);
  expect_three_are_named(as_curves);
}

/// The visible sides of two lamps that the border cuts are as good as a second whole lamp.
TEST(LocateRectangles, AWholeTrapezoidBesideCutOnesIsNamed) {
  Random random(10);
  int images = 0, located = 0;
  for (int room = 0; room < 300; ++room) {
    const RoomPicture picture(random, as_trapezoids, room);
    if (picture.whole_lamps() != 1) continue;
    const std::vector<Blob> blobs = detect(picture.rendered.image.view(), {});
    if (std::count_if(blobs.begin(), blobs.end(), [](const Blob& blob) {
          return blob.cut_by_border && blob.rim.size() > 60;
        }) < 2)
      continue;
    SCOPED_TRACE(room);
    ++images;
    const Result<Fix> fix = locate(picture.rendered.image.view(), picture.map);
    located += fix.ok();
    if (fix.ok()) {
      EXPECT_LT(picture.error_m(fix->position_m), 5e-3);
    }
  }
  EXPECT_GE(images, 8);
  EXPECT_GE(located, images * 9 / 10);
}

/// Many pairs of panels have nearly the place and the outlines of the two whole ones. The visible
/// parts of those that the border cuts select the pose.
TEST(LocateRectangles, TwoOfSixteenEqualPanelsAreNamedByThoseThatTheBorderCuts) {
  Random random(9);
  int images = 0, located = 0;
  for (int room = 0; room < 120; ++room) {
    const RoomPicture picture(random, as_panels, room);
    if (picture.whole_lamps() != 2) continue;
    SCOPED_TRACE(room);
    ++images;
    const Result<Fix> fix = locate(picture.rendered.image.view(), picture.map);
    ASSERT_TRUE(fix.ok() || fix.status == Status::ambiguous) << fix.message;
    located += fix.ok();
    EXPECT_LT(identify(fix->blobs, picture.map)->hypotheses.size(), 80u);
    const auto is_right = [&](const Candidate& candidate) {
      return picture.error_m(candidate.position_m) < 5e-3;
    };
    EXPECT_TRUE(fix.ok() ? is_right(fix->candidates.front())
                         : std::any_of(fix->candidates.begin(), fix->candidates.end(), is_right));
  }
  EXPECT_GE(images, 25);
  EXPECT_GE(located, 2 * images / 3);
}

}  // namespace
}  // namespace occ
