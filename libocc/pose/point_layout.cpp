// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/point_layout.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::pose {
namespace {

// Share of the widest extent. The direction across a thinner layout is rounding.
constexpr double min_thickness = 1e-10;

bool contains(const Triple& triple, int i) {
  return std::find(triple.begin(), triple.end(), i) != triple.end();
}

// Index of the highest score.
template <class Score>
int argmax(Eigen::Index count, const Score& score) {
  int best = 0;
  double highest = -1;
  for (int i = 0; i < count; ++i) {
    const double s = score(i);
    if (s > highest) {
      highest = s;
      best = i;
    }
  }
  return best;
}

// All four, the one of largest area first.
std::vector<Triple> triples_of_four(const Eigen::Matrix3Xd& points) {
  std::vector<Triple> triples{{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
  std::array<double, 4> area2;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d a = points.col(triples[i][1]) - points.col(triples[i][0]);
    const Eigen::Vector3d b = points.col(triples[i][2]) - points.col(triples[i][0]);
    area2[i] = a.cross(b).squaredNorm();
  }
  const auto largest = std::max_element(area2.begin(), area2.end()) - area2.begin();
  std::swap(triples[0], triples[largest]);
  return triples;
}

}  // namespace

PointLayout point_layout(const Eigen::Matrix3Xd& points) {
  PointLayout layout;
  layout.centroid = points.rowwise().mean();
  const Eigen::Matrix3Xd about_centroid = points.colwise() - layout.centroid;
  const auto svd = core::jacobi_svd<Eigen::MatrixXd>(about_centroid, Eigen::ComputeFullU);
  layout.axes = svd.matrixU();
  if (layout.axes.determinant() < 0) layout.axes.col(2) *= -1;
  layout.extent.setZero();
  const Eigen::Index count = std::min<Eigen::Index>(3, svd.singularValues().size());
  layout.extent.head(count) = svd.singularValues().head(count);
  return layout;
}

bool spans_plane(const PointLayout& layout) {
  return layout.extent[1] > min_thickness * layout.extent[0];
}

bool spans_space(const PointLayout& layout) {
  return layout.extent[2] > min_thickness * layout.extent[0];
}

Triple spread_triple(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  const Eigen::Index n = points.cols();
  const Eigen::Vector3d middle = points.rowwise().mean();
  const int a = argmax(n, [&](int i) { return (points.col(i) - middle).squaredNorm(); });
  const Eigen::Vector3d from = points.col(a);
  const int b = argmax(n, [&](int i) { return (points.col(i) - from).squaredNorm(); });
  const Eigen::Vector3d along = points.col(b) - from;
  const int c = argmax(
      n, [&](int i) { return along.cross(Eigen::Vector3d(points.col(i) - from)).squaredNorm(); });
  return {a, b, c};
}

bool on_a_line(const Eigen::Matrix3Xd& points, const Triple& chosen, double offset) {
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  const Eigen::Vector3d a = points.col(chosen[1]) - points.col(chosen[0]);
  const Eigen::Vector3d b = points.col(chosen[2]) - points.col(chosen[0]);
  const double size = std::sqrt(std::max(a.squaredNorm(), b.squaredNorm()));
  return !(a.cross(b).norm() > size * std::max(min_thickness * size, rounding * offset));
}

double height_over_line(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d middle = points.rowwise().mean();
  const Eigen::Matrix3Xd about = points.colwise() - middle;
  const Eigen::Matrix3d scatter = about * about.transpose();
  const auto eigen = core::symmetric_eigen<Eigen::Matrix3d>(scatter, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues().head<2>().sum()));
}

std::vector<Triple> triples_to_try(const Eigen::Matrix3Xd& points,
                                   const Eigen::Matrix3Xd& bearings) {
  const int n = static_cast<int>(points.cols());
  if (n == 3) return {{0, 1, 2}};
  if (n == 4) return triples_of_four(points);
  std::vector<Triple> triples{spread_triple(points), spread_triple(bearings)};
  if (n < 6) return triples;
  std::vector<int> index;
  for (int i = 0; i < n; ++i)
    if (!contains(triples[0], i)) index.push_back(i);
  Eigen::Matrix3Xd rest(3, static_cast<Eigen::Index>(index.size()));
  for (std::size_t i = 0; i < index.size(); ++i)
    rest.col(static_cast<Eigen::Index>(i)) = points.col(index[i]);
  Triple third = spread_triple(rest);
  for (int& i : third) i = index[i];
  triples.push_back(third);
  return triples;
}

}  // namespace occ::internal::pose
