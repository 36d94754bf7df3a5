// SPDX-License-Identifier: Apache-2.0
// Odometry steps, concatenated and cut to given time intervals.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/internal/chain_body.hpp"

namespace occ::internal::smooth {

constexpr double same_time_s = 1e-9;  // resolution of clocks that count nanoseconds

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

  double end_s() const;  ///< end of the last piece; minus infinity without pieces
  /// If bounded, neighbouring pieces are joined when there are very many, so that memory stays
  /// bounded while no frame arrives.
  void add(const Piece& piece);
  void forget_before(double time_s);
  /// Step between two times; empty if the pieces leave a gap.
  std::optional<Step> between(double from_s, double to_s) const;

 private:
  void pair_up();

  bool bounded_ = false;
  std::deque<Piece> pieces_;
};

}  // namespace occ::internal::smooth
