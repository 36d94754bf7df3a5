// SPDX-License-Identifier: Apache-2.0
// Internal: odometry as it comes, chained and cut to the times between which it is asked for.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_body.hpp"

namespace occ::internal::smooth {

constexpr double same_time_s = 1e-9;  // of clocks that are read in nanoseconds

template <class Body>
class OdometryPieces {
 public:
  OdometryPieces() = default;
  explicit OdometryPieces(bool bounded) : bounded_(bounded) {}

  using Step = typename Body::Step;
  using Piece = typename Body::Piece;

  /// Throws std::invalid_argument, naming the piece, for values that are not finite, a covariance
  /// that is not positive semi-definite, or an end that is not after the start.
  static void validate(const Piece& piece, const std::string& name);

  double end_s() const;  ///< of the last piece; minus infinity without
  /// When bounded: of very many, two neighbours become one, so that memory stays bounded while no
  /// frame comes.
  void add(const Piece& piece);
  void forget_before(double time_s);
  /// Nothing where the pieces leave a gap.
  std::optional<Step> between(double from_s, double to_s) const;

 private:
  void pair_up();

  bool bounded_ = false;
  std::deque<Piece> pieces_;
};

}  // namespace occ::internal::smooth
