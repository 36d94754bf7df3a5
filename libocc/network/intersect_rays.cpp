// SPDX-License-Identifier: Apache-2.0
#include "libocc/network/internal/intersect_rays.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace occ::internal::network {

std::optional<Eigen::Vector3d> intersect_rays(const std::vector<Ray>& rays) {
  if (rays.size() < 2) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) middle += ray.origin / static_cast<double>(rays.size());
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d rhs = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    normal += across;
    rhs += across * (ray.origin - middle);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(normal);
  if (!(eigen.eigenvalues()[0] > 1e-10 * eigen.eigenvalues()[2])) return std::nullopt;
  return middle + eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                      eigen.eigenvectors().transpose() * rhs;
}

}  // namespace occ::internal::network
