// SPDX-License-Identifier: Apache-2.0
// The results of an adjustment do not depend on the number of threads.
#include <gtest/gtest.h>

#include "libocc/network/adjust.hpp"
#include "libocc/network/internal/noisy_network.hpp"
#include "libocc/network/network_statistics.hpp"
#include "libocc/network/precision.hpp"
#include "tests/network/network_support.hpp"

namespace occ {
namespace {

using internal::network::noisy_network;

TEST(Adjust, SameBitsForAnyNumberOfThreads) {
  // Eight partial sums and more: 1500 points in some 24 batches.
  Network network = noisy_network(
      test::cloud_network(test::small_pinhole(), {"fx_px", "fy_px"}, 6, 1500), 4, 0.03);
  network.observations[7].pixel.y() += 40;
  AdjustOptions options;
  options.threads = 1;
  const auto one = adjust(network, options);
  ASSERT_TRUE(one.ok()) << one.message;
  const auto points = precision(one->network, {}, 1)->points();
  const auto statistics = network_statistics(one->network, 1);
  for (const int threads : {2, 3, 8}) {
    options.threads = threads;
    const auto other = adjust(network, options);
    ASSERT_TRUE(other.ok()) << other.message;
    EXPECT_EQ(one->cost, other->cost) << threads;
    for (std::size_t i = 0; i < network.points.size(); ++i)
      EXPECT_EQ(one->network.points[i].position_m, other->network.points[i].position_m) << threads;
    EXPECT_TRUE(points == precision(one->network, {}, threads)->points()) << threads;
    const auto again = network_statistics(one->network, threads);
    for (std::size_t i = 0; i < network.observations.size(); ++i)
      EXPECT_EQ(statistics->image_observations[i].redundancy,
                again->image_observations[i].redundancy);
  }
}

}  // namespace
}  // namespace occ
