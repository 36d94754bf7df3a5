// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/relative_orientation.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/random.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Matrix10 = Eigen::Matrix<double, 10, 10>;

constexpr Index min_points = 4;         // five pairs determine the orientation, up to ten solutions
constexpr int samples = 60;             // a third of gross errors: one is free of them with 0.9997
constexpr std::size_t max_poses = 4;    // two for points of a plane, each perhaps twice with noise
constexpr double max_error_ratio = 3;   // of poses that are worth a try, to the best one
constexpr double min_error_rad = 1e-7;  // rounding of pixels in a file with three decimals
constexpr double same_pose = 0.05;      // norm of the difference of two poses that are one
constexpr double min_angle_rad = 0.035;  // of rays that count as an intersection: 2 degrees

/// Index of a monomial of three factors, each 0 to 3 for x, y, z, 1: ten of the third degree, then
/// x^2 xy xz y^2 yz z^2 x y z 1.
std::array<int, 64> monomial_indices() {
  std::array<int, 64> index{};
  int next = 0;
  for (int ones = 0; ones <= 3; ++ones)
    for (int i = 0; i < 4; ++i)
      for (int j = i; j < 4; ++j)
        for (int k = j; k < 4; ++k) {
          if ((i == 3) + (j == 3) + (k == 3) != ones) continue;
          std::array<int, 3> factors{i, j, k};
          do {
            index[static_cast<std::size_t>(16 * factors[0] + 4 * factors[1] + factors[2])] = next;
          } while (std::next_permutation(factors.begin(), factors.end()));
          ++next;
        }
  return index;
}

/// The equations det E = 0 and 2 E E^T E - tr(E E^T) E = 0, one per row, in the monomials.
Eigen::Matrix<double, 10, 20> cubic_equations(const std::array<Matrix3d, 4>& basis) {
  static const std::array<int, 64> monomials = monomial_indices();
  Eigen::Matrix<double, 10, 20> equations = Eigen::Matrix<double, 10, 20>::Zero();
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      const Matrix3d product = basis[i] * basis[j].transpose();
      const Vector3d cross = basis[i].col(0).cross(basis[j].col(1));
      for (std::size_t k = 0; k < 4; ++k) {
        const Matrix3d cubic = 2 * product * basis[k] - product.trace() * basis[k];
        auto column = equations.col(monomials[16 * i + 4 * j + k]);
        column.head<9>() += Eigen::Map<const Eigen::Matrix<double, 9, 1>>(cubic.data());
        column[9] += cross.dot(basis[k].col(2));
      }
    }
  return equations;
}

/// Angles between the bearings b and the epipolar planes of a, and the other way round: the larger.
std::vector<double> epipolar_errors(const Matrix3d& essential, const Matrix3Xd& a,
                                    const Matrix3Xd& b) {
  std::vector<double> errors;
  for (Index i = 0; i < a.cols(); ++i) {
    const Vector3d in_b = essential * a.col(i), in_a = essential.transpose() * b.col(i);
    const double product = std::abs(in_b.dot(b.col(i)));
    constexpr double tiny = 1e-300;
    errors.push_back(product / std::max(tiny, std::min(in_b.norm(), in_a.norm())));
  }
  return errors;
}

/// The four poses of an essential matrix.
std::array<Rigid3, 4> poses_of(const Matrix3d& essential) {
  const Eigen::JacobiSVD<Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix3d u = svd.matrixU() * svd.matrixU().determinant();
  const Matrix3d v = svd.matrixV() * svd.matrixV().determinant();
  Matrix3d turn;
  turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Matrix3d first = u * turn * v.transpose(), second = u * turn.transpose() * v.transpose();
  const Vector3d shift = u.col(2);
  return {Rigid3{first, shift}, Rigid3{first, -shift}, Rigid3{second, shift},
          Rigid3{second, -shift}};
}

/// The pose with the number of points in front of both images; sets intersected and angle_rad.
std::pair<RelativePose, int> with_points(const Rigid3& pose, double error_rad, const Matrix3Xd& a,
                                         const Matrix3Xd& b) {
  RelativePose one{pose, error_rad};
  std::vector<double> angles;
  for (Index i = 0; i < a.cols(); ++i) {
    const Vector3d turned = pose.rotation * a.col(i), other = b.col(i);
    const double cosine = turned.dot(other);
    // Distances s and r of the nearest points of both rays: s turned + t = r other.
    const double along_a = -turned.dot(pose.translation), along_b = other.dot(pose.translation);
    if (!(along_a + cosine * along_b > 0 && along_b + cosine * along_a > 0)) continue;
    angles.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)));
    if (angles.back() > min_angle_rad) ++one.intersected;
  }
  const int front = static_cast<int>(angles.size());
  one.angle_rad = median(std::move(angles));
  return {one, front};
}

/// Samples of five points: all of them for up to seven points.
std::vector<std::vector<Index>> samples_of(Index count, std::uint64_t seed) {
  std::vector<std::vector<Index>> chosen;
  if (count <= 7) {
    std::vector<bool> in(static_cast<std::size_t>(count), false);
    std::fill(in.begin(), in.begin() + 5, true);
    do {
      chosen.emplace_back();
      for (Index i = 0; i < count; ++i)
        if (in[static_cast<std::size_t>(i)]) chosen.back().push_back(i);
    } while (std::prev_permutation(in.begin(), in.end()));
    return chosen;
  }
  Random random(seed);
  std::vector<Index> order(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
  for (int s = 0; s < samples; ++s) {
    for (std::size_t i = 0; i < 5; ++i) {
      const auto left = static_cast<double>(order.size() - i);
      std::swap(order[i], order[i + static_cast<std::size_t>(random.uniform() * left)]);
    }
    chosen.emplace_back(order.begin(), order.begin() + 5);
  }
  return chosen;
}

}  // namespace

std::vector<Matrix3d> essential_matrices(const Matrix3Xd& first, const Matrix3Xd& second) {
  require(first.cols() == 5 && second.cols() == 5, "first, second", first.cols(), "3 x 5");
  Eigen::MatrixXd conditions(9, 5);  // of the elements of E, column by column
  for (Index i = 0; i < 5; ++i) {
    const Matrix3d product = second.col(i) * first.col(i).transpose();
    conditions.col(i) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(product.data());
  }
  const Eigen::MatrixXd q = internal::core::householder_q(conditions, 9);
  std::array<Matrix3d, 4> basis;
  for (std::size_t k = 0; k < 4; ++k)
    basis[k] = Eigen::Map<const Matrix3d>(q.col(5 + static_cast<Index>(k)).data());
  const Eigen::Matrix<double, 10, 20> equations = cubic_equations(basis);
  const auto qr = internal::core::pivoted_qr(equations.leftCols<10>());
  if (qr.rank() < 10) return {};
  const Eigen::MatrixXd reduced = qr.solve(Eigen::MatrixXd(equations.rightCols<10>()));
  if (!reduced.allFinite()) return {};
  Matrix10 action = Matrix10::Zero();
  action.topRows<6>() = -reduced.topRows<6>();  // x times x^2 xy xz y^2 yz z^2
  action(6, 0) = action(7, 1) = action(8, 2) = action(9, 6) = 1;
  const Eigen::EigenSolver<Matrix10> eigen(action);
  if (eigen.info() != Eigen::Success) return {};
  std::vector<Matrix3d> found;
  for (Index k = 0; k < 10; ++k) {
    const std::complex<double> value = eigen.eigenvalues()[k];
    const Eigen::Matrix<std::complex<double>, 10, 1> vector = eigen.eigenvectors().col(k);
    constexpr double max_imaginary = 1e-8,
                     min_last = 1e-12;  // relative; the eigenvector has norm 1
    if (std::abs(value.imag()) > max_imaginary * (1 + std::abs(value)) ||
        std::abs(vector[9]) < min_last)
      continue;
    const Matrix3d matrix = (vector[6] / vector[9]).real() * basis[0] +
                            (vector[7] / vector[9]).real() * basis[1] +
                            (vector[8] / vector[9]).real() * basis[2] + basis[3];
    found.push_back(matrix / matrix.norm());
  }
  return found;
}

std::vector<RelativePose> planar_orientations(const Matrix3Xd& first, const Matrix3Xd& second) {
  const Index count = first.cols();
  require(second.cols() == count, "second", second.cols(), "of the size of first");
  require(count >= 4, "first", count, "at least four points");
  Eigen::MatrixXd conditions(3 * count, 9);  // b x H a = 0, in the elements of H column by column
  for (Index i = 0; i < count; ++i)
    conditions.middleRows<3>(3 * i) << first(0, i) * skew(second.col(i)),
        first(1, i) * skew(second.col(i)), first(2, i) * skew(second.col(i));
  const auto eigen = internal::core::symmetric_eigen<Eigen::MatrixXd>(
      conditions.transpose() * conditions, Eigen::ComputeEigenvectors);
  constexpr double min_second = 1e-10;  // of the eigenvalues, for a unique homography
  if (!(eigen.eigenvalues()[1] > min_second * eigen.eigenvalues()[8])) return {};
  Matrix3d h = Eigen::Map<const Matrix3d>(eigen.eigenvectors().col(0).data());
  const auto svd = internal::core::jacobi_svd<Matrix3d>(h, Eigen::ComputeFullV);
  h /= svd.singularValues()[1];
  if ((h * first.col(0)).dot(second.col(0)) < 0) h = -h;
  if (!h.allFinite()) return {};
  const double s1 = svd.singularValues()[0] / svd.singularValues()[1];
  const double s3 = svd.singularValues()[2] / svd.singularValues()[1];
  constexpr double min_stretch = 1e-6;  // s1 - s3; it is zero for images that are only turned
  if (!(s1 - s3 > min_stretch)) return {};
  Matrix3d v = svd.matrixV();
  v *= v.determinant();
  const Vector3d along = std::sqrt(std::max(0.0, 1 - s3 * s3)) * v.col(0);
  const Vector3d across = std::sqrt(std::max(0.0, s1 * s1 - 1)) * v.col(2);
  std::vector<RelativePose> found;
  for (const double sign : {1.0, -1.0}) {
    const Vector3d u = (along + sign * across) / std::sqrt(s1 * s1 - s3 * s3);
    const Vector3d normal = v.col(1).cross(u);
    Matrix3d in_first, in_second;
    in_first << v.col(1), u, normal;
    in_second << h * v.col(1), h * u, (h * v.col(1)).cross(h * u);
    const Matrix3d rotation = nearest_rotation(in_second * in_first.transpose());
    const Vector3d shift = ((h - rotation) * normal).normalized();
    for (const Rigid3& one : {Rigid3{rotation, shift}, Rigid3{rotation, -shift}}) {
      const double error = median(epipolar_errors(skew(one.translation) * rotation, first, second));
      const auto [relative, front] = with_points(one, error, first, second);
      if (front == count) found.push_back(relative);
    }
  }
  return found;
}

std::vector<RelativePose> relative_orientation(const Matrix3Xd& first, const Matrix3Xd& second,
                                               std::uint64_t seed) {
  require(first.cols() == second.cols(), "second", second.cols(), "of the size of first");
  const Index count = first.cols();
  if (count < min_points) return {};
  if (count == 4) return planar_orientations(first, second);
  std::vector<std::pair<double, Matrix3d>> scored;
  // Five errors are zero by construction; of five points, all are.
  const Index rank = std::min(count - 1, 5 + (count - 4) / 2 - 1);
  for (const std::vector<Index>& sample : samples_of(count, seed))
    for (const Matrix3d& essential :
         essential_matrices(first(Eigen::all, sample), second(Eigen::all, sample))) {
      std::vector<double> errors = epipolar_errors(essential, first, second);
      std::nth_element(errors.begin(), errors.begin() + rank, errors.end());
      scored.emplace_back(errors[static_cast<std::size_t>(rank)], essential);
    }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const std::size_t max_found = count == 5 ? 4 * scored.size() + 2 : max_poses;
  std::vector<RelativePose> found;
  if (count == 5) found = planar_orientations(first, second);
  for (const auto& [error, essential] : scored) {
    if (error > max_error_ratio * std::max(scored[0].first, min_error_rad)) break;
    for (const Rigid3& pose : poses_of(essential)) {
      const auto [relative, front] = with_points(pose, error, first, second);
      const bool is_new = std::none_of(found.begin(), found.end(), [&](const RelativePose& other) {
        return std::hypot((pose.rotation - other.second_from_first.rotation).norm(),
                          (pose.translation - other.second_from_first.translation).norm()) <=
               same_pose;
      });
      if (2 * front >= count && is_new) found.push_back(relative);
      if (found.size() >= max_found) return found;
    }
  }
  return found;
}

}  // namespace occ
