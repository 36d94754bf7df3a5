// SPDX-License-Identifier: Apache-2.0
// Objects: validation and its messages, cones, and round trips through files.
#include <fstream>

#include "libocc/core/math.hpp"
#include "libocc/scene/object.hpp"
#include "tests/support/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace occ {
namespace {

using Eigen::Vector3d;

Object beacon() {
  Object object{"beacon", {}};
  for (int i = 0; i < 5; ++i) {
    ObjectPoint p;
    p.id = 10 + i;
    p.position_m = {0.1 * i, 0.03 * i * i, 0.2};
    object.points.push_back(p);
  }
  return object;
}

std::string refusal(const std::function<void(Object&)>& spoil) {
  Object object = beacon();
  spoil(object);
  return test::complaint([&] { object.validate(); });
}

std::string file_refusal(const std::string& text) {
  return test::complaint<std::runtime_error>([&] { parse_object(text, "car.yaml"); });
}

TEST(Object, RejectsValuesOutOfRange) {
  EXPECT_EQ(refusal([](Object&) {}), "");
  EXPECT_NE(
      refusal([](Object& o) { o.points[1].id = 10; }).find("points: id must be unique, got 10"),
      std::string::npos);
  EXPECT_NE(refusal([](Object& o) {
              o.points[3].position_m = o.points[1].position_m;
            }).find("point 13: position_m must be different from that of point 11"),
            std::string::npos);
  EXPECT_NE(refusal([](Object& o) { o.points[0].normal.setZero(); }).find("point 10: normal"),
            std::string::npos);
  for (const double cone : {0.0, -1.0, 3.2, std::nan("")})
    EXPECT_NE(refusal([&](Object& o) { o.points[0].cone_rad = cone; }).find("(0, pi]"),
              std::string::npos);
  EXPECT_NE(refusal([](Object& o) { o.points[0].radius_m = -1; }).find("radius_m"),
            std::string::npos);
  EXPECT_NE(refusal([](Object& o) { o.points[0].position_m.x() = INFINITY; }).find("position_m"),
            std::string::npos);
  EXPECT_NE(refusal([](Object& o) { o.points.clear(); }).find("1 to 1000"), std::string::npos);
  EXPECT_NE(refusal([](Object& o) { o.name.clear(); }).find("name"), std::string::npos);
}

TEST(Object, APointIsVisibleFromInsideItsCone) {
  ObjectPoint p;
  p.position_m = {1, 0, 0};
  p.normal = Vector3d::UnitX();
  const auto from = [](double angle) {
    return Vector3d(1 + 2 * std::cos(angle), 2 * std::sin(angle), 0);
  };
  for (const double cone : {0.3, pi / 2, 2.5, pi}) {
    p.cone_rad = cone;
    EXPECT_TRUE(p.seen_from(from(cone - 1e-6)));
    EXPECT_EQ(p.seen_from(from(cone + 1e-6)), cone == pi);
  }
  EXPECT_TRUE(p.seen_from({-1, 0, 0}));  // straight from behind
}

TEST(Object, TextReadsBackToAnEqualObject) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    Object object = beacon();
    for (ObjectPoint& p : object.points) {
      p.position_m = test::random_vector(random);
      p.normal = test::random_vector(random);
      p.cone_rad = i % 2 ? random.uniform(0.1, 3.1) : pi;
      p.radius_m = random.uniform();
      p.label = "left \"" + std::to_string(i) + "\"";
    }
    object.validate();
    const Object back = parse_object(format_object(object));
    ASSERT_EQ(back.name, object.name);
    ASSERT_EQ(back.points.size(), object.points.size());
    for (std::size_t k = 0; k < back.points.size(); ++k) {
      const ObjectPoint &a = back.points[k], &b = object.points[k];
      EXPECT_EQ(a.id, b.id);
      EXPECT_EQ(a.label, b.label);
      EXPECT_EQ(a.position_m, b.position_m);
      EXPECT_EQ(a.normal, b.normal);
      EXPECT_EQ(a.cone_rad, b.cone_rad);
      EXPECT_EQ(a.radius_m, b.radius_m);
    }
    EXPECT_EQ(format_object(back), format_object(object));
  }
}

TEST(Object, WritesAndReadsFiles) {
  const test::Folder folder;
  const std::string path = (folder.path() / "beacon.yaml").string();
  write_object(path, beacon());
  EXPECT_EQ(format_object(read_object(path)), format_object(beacon()));
  EXPECT_NE(test::complaint<std::runtime_error>(
                [&] { read_object((folder.path() / "none.yaml").string()); }),
            "");
}

TEST(Object, ErrorsInFilesNameTheKey) {
  const std::string head = "schema: libocc-object/1\nname: car\npoints:\n";
  const std::string good = "  - {id: 0, position_m: [0, 0, 0]}\n";
  EXPECT_EQ(file_refusal(head + good), "");
  const std::pair<const char*, const char*> wrong[] = {
      {"  - {id: 0}\n", "car.yaml:4: key `points[0].position_m`"},
      {"  - {id: 0, position_m: [0, 0]}\n", "`points[0].position_m`"},
      {"  - {id: 0, position_m: [0, 0, 0], cone_deg: 200}\n",
       "key `points[0].cone_deg`: must be in (0, 180], got 200"},
      {"  - {id: 0, position_m: [0, 0, 0], normal: [0, 0, 0]}\n", "`points[0].normal`"},
      {"  - {id: 0, position_m: [0, 0, 0], radius_m: -1}\n", "`points[0].radius_m`"},
      {"  - {id: 0, position_mm: [0, 0, 0]}\n", "position_m"},
      {"  - {id: 0, position_m: [0, 0, 0]}\n  - {id: 0, position_m: [1, 0, 0]}\n",
       "`points[1].id`: must be unique, points[0] has the same"},
      {"  - {id: 0, position_m: [0, 0, 0]}\n  - {id: 1, position_m: [0, 0, 0]}\n",
       "point 1: position_m must be different from"},
      {"  []\n", "points"}};
  for (const auto& [text, said] : wrong)
    EXPECT_NE(file_refusal(head + text).find(said), std::string::npos) << file_refusal(head + text);
  EXPECT_NE(file_refusal("schema: libocc-scene/1\n").find("must be libocc-object/1"),
            std::string::npos);
  EXPECT_NE(file_refusal("schema: libocc-object/2\n").find("is newer"), std::string::npos);
  EXPECT_NE(file_refusal("schema: libocc-object/1\npoints: []\n").find("name"), std::string::npos);
}

TEST(Object, ShippedObjectsLoad) {
  for (const char* name : {"car", "beacon"}) {
    const Object object = read_object(std::string(LIBOCC_DATA) + "/objects/" + name + ".yaml");
    EXPECT_EQ(object.name, name);
    EXPECT_GE(object.points.size(), 6u);
  }
}

}  // namespace
}  // namespace occ
