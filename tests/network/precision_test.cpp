// SPDX-License-Identifier: Apache-2.0
// Covariances of networks compared with the inverse of the whole normal matrix, which is built from
// finite differences of the residuals.
#include "libocc/network/precision.hpp"

#include "tests/network/network_support.hpp"

namespace occ {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Vector of a network's unknowns: free parameters of camera 0, stations, points, bodies.
struct Whole {
  Network network;
  Index parameters, stations, points, bodies, size;

  explicit Whole(const Network& from) : network(from) {
    parameters = static_cast<Index>(from.cameras[0].free_parameters.size());
    stations = parameters;
    points = stations + 6 * static_cast<Index>(from.stations.size());
    bodies = points + 3 * static_cast<Index>(from.points.size());
    size = bodies + 6 * static_cast<Index>(from.bodies.size());
  }
  Network moved(const VectorXd& x) const {
    Network n = network;
    const auto all = n.cameras[0].camera.parameters();
    VectorXd v(static_cast<Index>(all.size()));
    for (std::size_t k = 0; k < all.size(); ++k) {
      v[static_cast<Index>(k)] = all[k].value;
      for (Index f = 0; f < parameters; ++f)
        if (n.cameras[0].free_parameters[f] == all[k].name) v[static_cast<Index>(k)] += x[f];
    }
    n.cameras[0].camera = n.cameras[0].camera.with_parameters(v);
    for (std::size_t i = 0; i < n.stations.size(); ++i)
      n.stations[i].station_from_world = perturb(
          n.stations[i].station_from_world, x.segment<6>(stations + 6 * static_cast<Index>(i)));
    for (std::size_t i = 0; i < n.points.size(); ++i)
      n.points[i].position_m += x.segment<3>(points + 3 * static_cast<Index>(i));
    for (std::size_t i = 0; i < n.bodies.size(); ++i)
      n.bodies[i].world_from_body =
          perturb(n.bodies[i].world_from_body, x.segment<6>(bodies + 6 * static_cast<Index>(i)));
    return n;
  }
  VectorXd residuals(const VectorXd& x) const {
    const Network n = moved(x);
    const auto px = image_residuals_px(n);
    VectorXd r(static_cast<Index>(2 * px.size() + n.distances.size()));
    for (std::size_t i = 0; i < px.size(); ++i)
      r.segment<2>(static_cast<Index>(2 * i)) = px[i].cwiseQuotient(n.observations[i].sigma_px);
    for (std::size_t i = 0; i < n.distances.size(); ++i)
      r[static_cast<Index>(2 * px.size() + i)] =
          ((n.position_m(n.distances[i].to) - n.position_m(n.distances[i].from)).norm() -
           n.distances[i].length_m) /
          n.distances[i].sigma_m;
    return r;
  }
  /// Covariance with inner constraints over points: block of the inverse of the bordered normal
  /// matrix. The scaling by the diagonal handles the different units.
  MatrixXd covariance(bool scale_open) const {
    MatrixXd j(residuals(VectorXd::Zero(size)).size(), size);
    for (Index k = 0; k < size; ++k) {
      // Step that changes pixels by about 0.01.
      VectorXd x = VectorXd::Zero(size);
      x[k] = 1e-7;
      const double slope = (residuals(x) - residuals(-x)).norm() / 2e-7;
      const double h = std::min(1e-2, 0.05 / std::max(1e-9, slope));
      x[k] = h;
      const VectorXd a = residuals(x), b = residuals(-x);
      x[k] = 2 * h;
      j.col(k) = (8 * (a - b) - (residuals(x) - residuals(-x))) / (12 * h);
    }
    const VectorXd scale = j.colwise().norm().cwiseInverse();
    const MatrixXd scaled = j * scale.asDiagonal();
    MatrixXd border = MatrixXd::Zero(size, scale_open ? 7 : 6);
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const NetworkPoint& p : network.points)
      middle += p.position_m / static_cast<double>(network.points.size());
    for (std::size_t i = 0; i < network.points.size(); ++i) {
      const Index row = points + 3 * static_cast<Index>(i);
      const Eigen::Vector3d arm = network.points[i].position_m - middle;
      border.block<3, 3>(row, 0) = -skew(arm);
      border.block<3, 3>(row, 3).setIdentity();
      if (scale_open) border.block<3, 1>(row, 6) = arm;
    }
    const Index d = border.cols();
    MatrixXd whole = MatrixXd::Zero(size + d, size + d);
    whole.topLeftCorner(size, size) = scaled.transpose() * scaled;
    whole.topRightCorner(size, d) = scale.asDiagonal() * border;
    whole.bottomLeftCorner(d, size) = whole.topRightCorner(size, d).transpose();
    const MatrixXd inverse = whole.fullPivLu().inverse();
    return scale.asDiagonal() * inverse.topLeftCorner(size, size) * scale.asDiagonal();
  }
};

double apart(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

void expect_as_whole(const Network& network, bool scale_open) {
  const Whole whole(network);
  const MatrixXd q = whole.covariance(scale_open);
  // Inner constraints over the points only, not over the bodies.
  Datum datum;
  for (int k = 0; k < static_cast<int>(network.points.size()); ++k)
    datum.targets.push_back(Target::of_point(k));
  const auto p = precision(network, datum);
  ASSERT_TRUE(p.ok()) << p.message;
  EXPECT_EQ(p->unknowns(), whole.size);
  EXPECT_EQ(p->defect(), scale_open ? 7 : 6);
  constexpr double near = 2e-5;  // error of finite differences
  const std::vector<Eigen::Matrix3d> points = p->points();
  for (std::size_t i = 0; i < network.points.size(); ++i) {
    const Index row = whole.points + 3 * static_cast<Index>(i);
    EXPECT_LT(apart(points[i], q.block(row, row, 3, 3)), near) << i;
    EXPECT_LT(apart(p->point(static_cast<int>(i)), points[i]), 1e-9) << i;
  }
  EXPECT_LT(apart(p->parameters(0), q.topLeftCorner(whole.parameters, whole.parameters)), near);
  for (int i = 0; i < 3; ++i) {
    const Index row = whole.stations + 6 * i;
    EXPECT_LT(apart(p->station(i), q.block(row, row, 6, 6)), near) << i;
  }
  for (int i = 0; i < static_cast<int>(network.bodies.size()); ++i) {
    const Index row = whole.bodies + 6 * i;
    EXPECT_LT(apart(p->body(i), q.block(row, row, 6, 6)), near) << i;
  }
  Matrix6 joint;
  const Index a = whole.points + 3, b = whole.points + 21;
  joint << q.block(a, a, 3, 3), q.block(a, b, 3, 3), q.block(b, a, 3, 3), q.block(b, b, 3, 3);
  EXPECT_LT(apart(p->positions(Target::of_point(1), Target::of_point(7)), joint), near);
}

TEST(Precision, EqualsTheInverseOfTheWholeMatrix) {
  {
    SCOPED_TRACE("pinhole");
    expect_as_whole(test::pinhole_network(5, 14), true);
  }
  {
    SCOPED_TRACE("line");
    expect_as_whole(test::line_network(5, 16), true);
  }
  {
    SCOPED_TRACE("distance");
    Network network = test::line_network(5, 16);
    test::add_distance(network, 1, 7, 1e-3);
    expect_as_whole(network, false);
  }
  {
    SCOPED_TRACE("tag");
    Network network = test::pinhole_network(5, 14);
    test::add_tag(network, {so3_exp({0.3, 0.1, 0}), {1.2, 2, 3.1}}, 0.4);
    expect_as_whole(network, false);
  }
}

TEST(Precision, EqualsItForSparseNetworks) {
  // A long row of stations that observe only their neighbourhood: many batches.
  Random random(3, 0);
  Network network;
  network.cameras.push_back({"camera", test::small_pinhole(), {"fx_px", "fy_px"}});
  for (int i = 0; i < 60; ++i)
    network.points.push_back({"", {0.4 * i, random.uniform(-1, 1), random.uniform(-1, 1)}, false});
  for (int i = 0; i < 14; ++i) {
    const Eigen::Vector3d from(1.7 * i, -4 + 0.5 * (i % 2), 0.6 * (i % 3));
    network.add_image("", 0, look_at(from, {1.7 * i + 0.3, 0, 0}, {0, 0, 1}));
  }
  for (int image = 0; image < 14; ++image)
    for (int k = 0; k < 60; ++k) {
      const auto pixel = network.cameras[0].camera.project(network.cam_from_world(image) *
                                                           network.points[k].position_m);
      if (pixel && network.cameras[0].camera.contains(*pixel))
        network.observations.push_back({image, Target::of_point(k), *pixel, {0.3, 0.3}, true});
    }
  expect_as_whole(network, true);
}

TEST(Precision, JointCovarianceHasTheBlocksOfAllPairs) {
  Network network = test::pinhole_network(5, 14);
  test::add_tag(network, {so3_exp({0.3, 0.1, 0}), {1.2, 2, 3.1}}, 0.4);
  network.points[2].fixed = true;
  network.points.push_back({"unseen", {0, 0, 0}, false});
  test::add_distance(network, 4, 5, 1e-3);  // point 4 is not eliminated
  const auto p = precision(network);
  ASSERT_TRUE(p.ok()) << p.message;
  const Precision scaled = p->scaled(2.5);
  const std::vector<Target> targets{Target::of_point(4),     Target::of_corner(0, 1),
                                    Target::of_point(2),     Target::of_point(7),
                                    Target::of_corner(0, 3), Target::of_point(8)};
  const MatrixXd joint = scaled.joint(targets);
  ASSERT_EQ(joint.rows(), 18);
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) {
      const MatrixXd pair = scaled.positions(targets[i], targets[k]).topRightCorner<3, 3>();
      EXPECT_LT((joint.block(3 * i, 3 * k, 3, 3) - pair).norm(), 1e-9 * joint.norm())
          << i << " " << k;
    }
  const MatrixXd with_unknown = p->joint({Target::of_point(14), Target::of_point(7)});
  EXPECT_TRUE(std::isinf(with_unknown(1, 1)));
  EXPECT_EQ(with_unknown(1, 4), 0);
  EXPECT_LT(apart(with_unknown.bottomRightCorner(3, 3), p->point(7)), 1e-9);
  EXPECT_THROW(p->joint({Target::of_point(99)}), std::invalid_argument);
}

TEST(Precision, DistancesAndVarianceFactor) {
  const Network network = test::line_network();
  const auto p = precision(network);
  const Target a = Target::of_point(1), b = Target::of_point(7);
  const Eigen::Vector3d along = (network.position_m(b) - network.position_m(a)).normalized();
  Vector6 row;
  row << -along, along;
  EXPECT_NEAR(p->distance_sigma_m(a, b), std::sqrt(row.dot(p->positions(a, b) * row)), 1e-15);
  EXPECT_LT(apart(p->scaled(4).point(1), 4 * p->point(1)), 1e-12);
}

TEST(Precision, FixedIsExactAndLeftOutIsUnknown) {
  Network network = test::line_network();
  network.points[0].fixed = network.stations[0].fixed = true;
  network.points.push_back({"unseen", {0, 0, 0}, false});
  const auto p = precision(network);
  ASSERT_TRUE(p.ok()) << p.message;
  EXPECT_EQ(p->point(0).norm(), 0);
  EXPECT_EQ(p->station(0).norm(), 0);
  EXPECT_TRUE(std::isinf(p->points().back()(1, 1)));
  EXPECT_TRUE(std::isinf(p->point(40)(2, 2)));
  EXPECT_THROW(p->point(41), std::invalid_argument);
  EXPECT_THROW(p->station(-1), std::invalid_argument);
  EXPECT_THROW(precision(network, {}, 0), std::invalid_argument);
  EXPECT_EQ(Precision().unknowns(), 0);
}

TEST(Precision, ReportsUndeterminedParameters) {
  Network network = test::pinhole_network(2, 5);
  network.cameras[0].free_parameters = test::pinhole_parameters();
  const auto p = precision(network);
  EXPECT_EQ(p.status, Status::degenerate);
  EXPECT_NE(p.message.find("of camera camera"), std::string::npos) << p.message;
}

TEST(Precision, SameBitsForAnyNumberOfThreads) {
  const Network network = test::line_network(6, 200);
  const auto one = precision(network, {}, 1), two = precision(network, {}, 2);
  const auto a = one->points(), b = two->points();
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i], b[i]);
}

}  // namespace
}  // namespace occ
