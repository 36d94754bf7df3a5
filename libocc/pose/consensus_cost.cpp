// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/consensus_cost.hpp"

#include <cmath>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::pose {
namespace {

constexpr int lanes = 16, fields = 7, block_size = lanes * fields;

template <Simd>
LIBOCC_INLINE void cost_body(const float* block, int blocks, const float* m, float bar,
                             float* result) {
  float total = 0;
  for (int b = 0; b < blocks && total <= bar; ++b, block += block_size) {
    float cost[lanes];
    for (int i = 0; i < lanes; ++i) {
      const float x = block[i], y = block[lanes + i], z = block[2 * lanes + i];
      const float depth = m[8] * x + m[9] * y + m[10] * z + m[11];
      const float inverse = 1.0F / depth;
      const float dx = (m[0] * x + m[1] * y + m[2] * z + m[3]) * inverse - block[3 * lanes + i];
      const float dy = (m[4] * x + m[5] * y + m[6] * z + m[7]) * inverse - block[4 * lanes + i];
      const float most = block[6 * lanes + i];
      const float squared = (dx * dx + dy * dy) * block[5 * lanes + i];
      const float in_front = depth > 0 ? squared : most;
      cost[i] = in_front < most ? in_front : most;
    }
    for (int half = lanes / 2; half > 0; half /= 2)
      for (int i = 0; i < half; ++i) cost[i] += cost[i + half];
    total += cost[0];
  }
  *result = total;
}
LIBOCC_MULTIVERSION(cost,
                    (const float* block, int blocks, const float* m, float bar, float* result),
                    (block, blocks, m, bar, result))

struct PlaneScale {
  double x, y, squared;  // observed in the plane z = 1, and (sigmas per unit there)^2
};

PlaneScale plane_scale(const SeenPoints::Block& block, int lane, const Eigen::Vector3d& bearing) {
  const double x = bearing.x() / bearing.z(), y = bearing.y() / bearing.z();
  const double along =
      block.bearing[0][lane] * x + block.bearing[1][lane] * y + block.bearing[2][lane];
  const double area = block.across[0][0][lane] * block.across[1][1][lane] -
                      block.across[0][1][lane] * block.across[1][0][lane];
  return {x, y, std::abs(area) / (along * along)};
}

}  // namespace

ConsensusCost::ConsensusCost(const SeenPoints& seen, const Eigen::Matrix3Xd& bearings,
                             double limit_sigmas, Simd simd)
    : simd_(simd), count_((seen.count() + lanes - 1) / lanes) {
  values_.assign(static_cast<std::size_t>(count_) * block_size, 0);  // empty lanes cost nothing
  for (int i = 0; i < seen.count(); ++i) {
    const SeenPoints::Block& block = seen.blocks()[i / 4];
    const PlaneScale scale = plane_scale(block, i % 4, bearings.col(i));
    const double of_point[fields] = {block.point[0][i % 4],
                                     block.point[1][i % 4],
                                     block.point[2][i % 4],
                                     scale.x,
                                     scale.y,
                                     scale.squared / (limit_sigmas * limit_sigmas),
                                     1};
    float* to = &values_[i / lanes * block_size + i % lanes];
    for (int k = 0; k < fields; ++k) to[k * lanes] = static_cast<float>(of_point[k]);
  }
}

float ConsensusCost::operator()(const Rigid3& pose, float bar) const {
  float m[12], result;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[4 * i + j] = static_cast<float>(pose.rotation(i, j));
    m[4 * i + 3] = static_cast<float>(pose.translation[i]);
  }
  cost_for(simd_)(values_.data(), count_, m, bar, &result);
  return result;
}

}  // namespace occ::internal::pose
