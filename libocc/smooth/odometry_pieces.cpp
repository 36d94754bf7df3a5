// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/internal/odometry_pieces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/core/internal/covariance.hpp"
#include "libocc/core/require.hpp"

namespace occ::internal::smooth {
namespace {

constexpr std::size_t max_pieces = 4096;

}  // namespace

template <class Body>
void OdometryPieces<Body>::validate(const Piece& piece, const std::string& name) {
  require(std::isfinite(piece.from_s), name + ".from_s", piece.from_s, "finite");
  require(std::isfinite(piece.to_s) && piece.to_s > piece.from_s, name + ".to_s", piece.to_s,
          "finite and after from_s");
  const Step step = Body::step_of(piece);
  require(Body::finite(step.motion), name, "a number that is not", "finite");
  core::require_semidefinite(step.covariance, name + ".covariance");
}

template <class Body>
double OdometryPieces<Body>::end_s() const {
  return pieces_.empty() ? -std::numeric_limits<double>::infinity() : pieces_.back().to_s;
}

template <class Body>
void OdometryPieces<Body>::add(const Piece& piece) {
  if (bounded_ && pieces_.size() >= max_pieces) pair_up();
  pieces_.push_back(piece);
}

template <class Body>
void OdometryPieces<Body>::pair_up() {
  std::deque<Piece> paired;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    const bool joins =
        i + 1 < pieces_.size() && pieces_[i + 1].from_s <= pieces_[i].to_s + same_time_s;
    if (!joins) {
      paired.push_back(pieces_[i]);
      continue;
    }
    const Step both = Body::chained(Body::step_of(pieces_[i]), Body::step_of(pieces_[i + 1]));
    paired.push_back(Body::piece_of(both, pieces_[i].from_s, pieces_[i + 1].to_s));
    ++i;
  }
  while (paired.size() >= max_pieces) paired.pop_front();  // only gaps, nothing to join
  pieces_ = std::move(paired);
}

template <class Body>
void OdometryPieces<Body>::forget_before(double time_s) {
  while (!pieces_.empty() && pieces_.front().to_s <= time_s) pieces_.pop_front();
}

template <class Body>
std::optional<typename Body::Step> OdometryPieces<Body>::between(double from_s, double to_s) const {
  auto piece = std::upper_bound(
      pieces_.begin(), pieces_.end(), from_s + same_time_s,
      [](double time_s, const Piece& candidate) { return time_s < candidate.to_s; });
  std::optional<Step> sum;
  double reached_s = from_s;
  for (; piece != pieces_.end() && reached_s < to_s - same_time_s; ++piece) {
    if (piece->from_s > reached_s + same_time_s) return std::nullopt;
    const double duration_s = piece->to_s - piece->from_s;
    const double start = std::max(0.0, (reached_s - piece->from_s) / duration_s);
    const double end = std::min(1.0, (to_s - piece->from_s) / duration_s);
    const double slack = same_time_s / duration_s;
    const Step part =
        Body::cut(Body::step_of(*piece), start < slack ? 0 : start, end > 1 - slack ? 1 : end);
    sum = sum ? Body::chained(*sum, part) : part;
    reached_s = piece->to_s;
  }
  if (reached_s < to_s - same_time_s) return std::nullopt;
  return sum;
}

template class OdometryPieces<SpatialBody>;
template class OdometryPieces<PlanarBody>;

}  // namespace occ::internal::smooth
