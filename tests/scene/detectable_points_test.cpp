// SPDX-License-Identifier: Apache-2.0
// Detectable points of bodies are their corners, ranked, with cones of visibility.
#include "libocc/scene/detectable_points.hpp"

#include <algorithm>
#include <set>
#include <vector>

#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

struct Body {
  std::vector<Vector3d> vertices;
  std::vector<Vector3i> faces;

  int add(const Vector3d& v) {
    vertices.push_back(v);
    return static_cast<int>(vertices.size()) - 1;
  }
  /// A parallelogram of n x n parts with separate vertices, counterclockwise seen from outside.
  void add_wall(const Vector3d& corner, const Vector3d& a, const Vector3d& b, int n = 1) {
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const Vector3d o = corner + a * i / n + b * j / n;
        const int first = add(o);
        add(o + a / n);
        add(o + a / n + b / n);
        add(o + b / n);
        faces.push_back({first, first + 1, first + 2});
        faces.push_back({first, first + 2, first + 3});
      }
  }
  std::vector<DetectablePoint> points(const DetectableOptions& options = {}) const {
    Eigen::Matrix3Xd v(3, vertices.size());
    Eigen::Matrix3Xi f(3, faces.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) v.col(static_cast<int>(i)) = vertices[i];
    for (std::size_t i = 0; i < faces.size(); ++i) f.col(static_cast<int>(i)) = faces[i];
    return detectable_points(v, f, options);
  }
};

Body box(const Vector3d& size, int parts = 1) {
  const Vector3d x = size.x() * Vector3d::UnitX(), y = size.y() * Vector3d::UnitY(),
                 z = size.z() * Vector3d::UnitZ(), o = -0.5 * size;
  Body body;
  body.add_wall(o, y, x, parts);
  body.add_wall(o + z, x, y, parts);
  body.add_wall(o, x, z, parts);
  body.add_wall(o + y, z, x, parts);
  body.add_wall(o, z, y, parts);
  body.add_wall(o + x, y, z, parts);
  return body;
}

Body cylinder(int sides) {
  Body body;
  for (int i = 0; i < sides; ++i) {
    const auto at = [&](int k) {
      return Vector3d(std::cos(2 * pi * k / sides), std::sin(2 * pi * k / sides), 0);
    };
    const Vector3d up(0, 0, 2);
    body.add_wall(at(i), at(i + 1) - at(i), up);
    for (const double side : {0.0, 1.0}) {
      const int first = body.add(side * up);
      body.add(side * up + at(side > 0 ? i : i + 1));
      body.add(side * up + at(side > 0 ? i + 1 : i));
      body.faces.push_back({first, first + 1, first + 2});
    }
  }
  return body;
}

TEST(DetectablePoints, ABoxHasItsCorners) {
  const Vector3d size(3, 2, 1);
  for (const int parts : {1, 2, 5}) {
    const auto points = box(size, parts).points();
    ASSERT_EQ(points.size(), 8u) << parts;
    for (const DetectablePoint& p : points) {
      EXPECT_LT((p.point.position_m.cwiseAbs() - 0.5 * size).norm(), 1e-12);
      EXPECT_EQ(p.edges, 3);
      EXPECT_NEAR(p.edges_m, 6, 1e-9);  // edges count as a whole, for any number of parts
    }
  }
}

// A convex corner is visible from all directions except its inner octant. The best cone is between
// the inscribed one, 125 degrees, and the circumscribed one, 145 degrees.
TEST(DetectablePoints, TheConeOfACornerContainsAllItsFaces) {
  for (const DetectablePoint& p : box({1, 1, 1}, 2).points()) {
    EXPECT_GT(p.point.normal.dot(p.point.position_m.normalized()), 0.998);
    EXPECT_GT(p.point.cone_rad, 2.18);
    EXPECT_LT(p.point.cone_rad, 2.53);
  }
}

// An L has two inner corners, which are visible from less than a half space.
TEST(DetectablePoints, AnInnerCornerIsVisibleFromOneSide) {
  Body body;
  const Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1), o(0, 0, 0);
  body.add_wall(o, y, 2 * x);
  body.add_wall(o, 2 * z, y);
  body.add_wall(2 * x, y, z);
  body.add_wall(2 * z, x, y);
  body.add_wall(x + z, y, z);
  body.add_wall(x + z, x, y);
  for (const double side : {0.0, 1.0}) {
    const auto add = [&](const Vector3d& from, const Vector3d& a, const Vector3d& b) {
      if (side > 0)
        body.add_wall(from + y, b, a);
      else
        body.add_wall(from, a, b);
    };
    add(o, x, z);
    add(x, x, z);
    add(z, x, z);
  }
  const auto points = body.points();
  ASSERT_EQ(points.size(), 12u);
  int inner = 0;
  for (const DetectablePoint& p : points) {
    const bool is_inner = (p.point.position_m.head<1>() - x.head<1>()).norm() < 1e-9 &&
                          std::abs(p.point.position_m.z() - 1) < 1e-9;
    inner += is_inner;
    EXPECT_TRUE(is_inner ? p.point.cone_rad < 2.1 : p.point.cone_rad > 1.9) << p.point.cone_rad;
  }
  EXPECT_EQ(inner, 2);
}

TEST(DetectablePoints, ACylinderHasNone) {
  EXPECT_TRUE(cylinder(32).points().empty());
  EXPECT_EQ(cylinder(6).points().size(), 12u);  // a hexagonal prism has corners
}

// The corners of a sheet are visible from all directions.
TEST(DetectablePoints, ASheetHasFourCorners) {
  Body sheet;
  sheet.add_wall({0, 0, 0}, {2, 0, 0}, {0, 1, 0}, 3);
  const auto points = sheet.points();
  ASSERT_EQ(points.size(), 4u);
  for (const DetectablePoint& p : points) {
    EXPECT_EQ(p.edges, 2);
    EXPECT_NEAR(p.edges_m, 3, 1e-9);
    EXPECT_EQ(p.point.cone_rad, pi);
  }
}

TEST(DetectablePoints, LongEdgesComeFirstAndShortOnesDoNotCount) {
  Body body = box({2, 2, 2});
  const Body small = box({0.6, 0.6, 0.6}), tiny = box({0.05, 0.05, 0.05});
  for (const Body* part : {&small, &tiny})
    for (const Vector3i& face : part->faces) {
      Vector3i moved;
      for (int k = 0; k < 3; ++k)
        moved[k] = body.add(part->vertices[face[k]] + Vector3d(part == &small ? 3 : -3, 0, 0));
      body.faces.push_back(moved);
    }
  const auto points = body.points();
  ASSERT_EQ(points.size(), 16u);
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(points[i].point.id, static_cast<int>(i));
    EXPECT_EQ(points[i].point.position_m.x() < 2, i < 8);
  }
  DetectableOptions few;
  few.max_points = 3;
  EXPECT_EQ(body.points(few).size(), 3u);
}

// Translation, rotation and scale of the body do not change its points.
TEST(DetectablePoints, MoveWithTheBody) {
  const Body body = box({3, 2, 1}, 2);
  const auto here = body.points();
  Random random(1);
  const Rigid3 moved = test::random_pose(random);
  Body there = body;
  for (Vector3d& v : there.vertices) v = moved * Vector3d(0.01 * v);
  const auto points = there.points();
  ASSERT_EQ(points.size(), here.size());
  for (const DetectablePoint& p : here)
    EXPECT_TRUE(std::any_of(points.begin(), points.end(), [&](const DetectablePoint& q) {
      return (q.point.position_m - moved * Vector3d(0.01 * p.point.position_m)).norm() < 1e-12 &&
             (q.point.normal - moved.rotation * p.point.normal).norm() < 0.1 &&
             std::abs(q.point.cone_rad - p.point.cone_rad) < 0.1;
    }));
}

TEST(DetectablePoints, MakeAnObject) {
  Object object{"box", {}};
  for (const DetectablePoint& p : box({1, 2, 3}).points()) object.points.push_back(p.point);
  EXPECT_NO_THROW(object.validate());
}

TEST(DetectablePoints, RejectInvalidMeshes) {
  const auto said = [](const std::function<void(Body&, DetectableOptions&)>& spoil) {
    Body body = box({1, 1, 1});
    DetectableOptions options;
    spoil(body, options);
    return test::complaint([&] { body.points(options); });
  };
  using B = Body;
  using O = DetectableOptions;
  EXPECT_NE(said([](B& b, O&) { b.faces[3][1] = 99; }).find("faces[3]"), std::string::npos);
  EXPECT_NE(said([](B& b, O&) { b.faces[3][1] = -1; }).find("faces[3]"), std::string::npos);
  EXPECT_NE(said([](B& b, O&) { b.faces.clear(); }).find("faces"), std::string::npos);
  EXPECT_NE(said([](B& b, O&) { b.vertices[2].x() = NAN; }).find("vertices[2]"), std::string::npos);
  EXPECT_NE(said([](B&, O& o) { o.sharp_rad = 0; }).find("sharp_rad"), std::string::npos);
  EXPECT_NE(said([](B&, O& o) { o.straight_rad = 2; }).find("straight_rad"), std::string::npos);
  EXPECT_NE(said([](B&, O& o) { o.min_edge = 1; }).find("min_edge"), std::string::npos);
  EXPECT_NE(said([](B&, O& o) { o.max_points = 0; }).find("max_points"), std::string::npos);
  EXPECT_NE(said([](B&, O& o) { o.directions = 1; }).find("directions"), std::string::npos);
}

}  // namespace
}  // namespace occ
