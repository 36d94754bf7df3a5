// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <set>

#include "libocc/landmarks/internal/circle_blobs.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Vector2d;

/// Blobs by the cells of a raster.
class BlobRaster {
 public:
  explicit BlobRaster(const std::vector<EllipseBlob>& blobs) : blobs_(blobs) {
    low_ = high_ = blobs.front().px;
    for (const EllipseBlob& blob : blobs) {
      low_ = low_.cwiseMin(blob.px);
      high_ = high_.cwiseMax(blob.px);
    }
    const Vector2d size = high_ - low_ + Vector2d::Ones();
    cell_px_ = std::max(4.0, std::sqrt(2 * size.prod() / static_cast<double>(blobs.size())));
    columns_ = 1 + static_cast<int>(size.x() / cell_px_);
    rows_ = 1 + static_cast<int>(size.y() / cell_px_);
    cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (std::size_t i = 0; i < blobs.size(); ++i)
      cells_[index(column_of(blobs[i].px), row_of(blobs[i].px))].push_back(i);
  }

  /// The nearest blob within a radius.
  std::optional<std::size_t> nearest(const Vector2d& p, double radius_px) const {
    std::optional<std::size_t> best;
    double best2 = radius_px * radius_px;
    visit(p, radius_px, [&](std::size_t i) {
      const double d2 = (blobs_[i].px - p).squaredNorm();
      if (!(d2 < best2)) return;
      best2 = d2;
      best = i;
    });
    return best;
  }

  /// All blobs within a radius, the nearest first.
  std::vector<std::size_t> within(const Vector2d& p, double radius_px) const {
    std::vector<std::pair<double, std::size_t>> found;
    visit(p, radius_px, [&](std::size_t i) {
      const double d2 = (blobs_[i].px - p).squaredNorm();
      if (d2 < radius_px * radius_px) found.emplace_back(d2, i);
    });
    std::sort(found.begin(), found.end());
    std::vector<std::size_t> indices;
    for (const auto& [d2, i] : found) indices.push_back(i);
    return indices;
  }

 private:
  int column_of(const Vector2d& p) const {
    return static_cast<int>(std::clamp((p.x() - low_.x()) / cell_px_, 0.0, columns_ - 1.0));
  }
  int row_of(const Vector2d& p) const {
    return static_cast<int>(std::clamp((p.y() - low_.y()) / cell_px_, 0.0, rows_ - 1.0));
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(x);
  }
  template <class Visit>
  void visit(const Vector2d& p, double radius_px, const Visit& visit_one) const {
    const Vector2d r = Vector2d::Constant(radius_px);
    for (int y = row_of(p - r); y <= row_of(p + r); ++y)
      for (int x = column_of(p - r); x <= column_of(p + r); ++x)
        for (const std::size_t i : cells_[index(x, y)]) visit_one(i);
  }

  const std::vector<EllipseBlob>& blobs_;
  Vector2d low_, high_;
  double cell_px_ = 1;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<std::size_t>> cells_;
};

/// Tolerance of a predicted position, relative to the step that leads there: perspective and
/// distortion change neighbouring steps by less.
constexpr double max_shift = 0.3;
constexpr double max_area_ratio = 2;  // of neighbouring discs

bool are_alike(const EllipseBlob& a, const EllipseBlob& b) {
  return a.area_px2 < max_area_ratio * b.area_px2 && b.area_px2 < max_area_ratio * a.area_px2;
}

/// A lattice while it grows.
class GrowingLattice {
 public:
  GrowingLattice(const std::vector<EllipseBlob>& blobs, const BlobRaster& raster)
      : blobs_(blobs), raster_(raster) {}

  bool set(int u, int v, std::size_t blob) {
    if (!used_.insert(blob).second) return false;
    lattice_[{u, v}] = blob;
    open_.emplace(u, v);
    return true;
  }

  void grow() {
    constexpr int du[] = {1, 0, -1, 0}, dv[] = {0, 1, 0, -1};
    while (!open_.empty()) {
      const auto [u, v] = open_.front();
      open_.pop();
      for (int k = 0; k < 4; ++k) try_at(u, v, du[k], dv[k]);
    }
  }

  const BlobLattice& lattice() const { return lattice_; }

 private:
  const EllipseBlob* known(int u, int v) const {
    const auto at = lattice_.find({u, v});
    return at == lattice_.end() ? nullptr : &blobs_[at->second];
  }

  /// Step from (u, v) to (u + du, v + dv), from equal steps nearby.
  std::optional<Vector2d> predicted_step(int u, int v, int du, int dv) const {
    if (const EllipseBlob* back = known(u - du, v - dv)) return known(u, v)->px - back->px;
    for (const int side : {1, -1}) {
      const EllipseBlob* one = known(u + side * dv, v + side * du);
      const EllipseBlob* two = known(u + side * dv + du, v + side * du + dv);
      if (one != nullptr && two != nullptr) return two->px - one->px;
    }
    return std::nullopt;
  }

  void try_at(int u, int v, int du, int dv) {
    if (known(u + du, v + dv) != nullptr) return;
    const std::optional<Vector2d> step = predicted_step(u, v, du, dv);
    if (!step) return;
    const EllipseBlob& from = *known(u, v);
    const auto next = raster_.nearest(from.px + *step, max_shift * step->norm());
    if (next && are_alike(from, blobs_[*next])) set(u + du, v + dv, *next);
  }

  const std::vector<EllipseBlob>& blobs_;
  const BlobRaster& raster_;
  BlobLattice lattice_;
  std::set<std::size_t> used_;
  std::queue<std::pair<int, int>> open_;
};

/// True if no other blob is inside the cell that is spanned by `one` and `two`, as in a lattice of
/// every second or third disc.
bool is_primitive(const std::vector<EllipseBlob>& blobs, const std::vector<std::size_t>& near,
                  const Vector2d& origin, const Vector2d& one, const Vector2d& two) {
  constexpr double margin = 0.2, corner = 0.3;  // of the sides: perspective and distortion
  const double area = one.x() * two.y() - one.y() * two.x();
  for (const std::size_t j : near) {
    const Vector2d d = blobs[j].px - origin;
    const double a = (d.x() * two.y() - d.y() * two.x()) / area;
    const double b = (one.x() * d.y() - one.y() * d.x()) / area;
    const bool inside = a > -margin && a < 1 + margin && b > -margin && b < 1 + margin;
    const bool at_corner =
        std::abs(a - std::round(a)) < corner && std::abs(b - std::round(b)) < corner;
    if (inside && !at_corner) return false;
  }
  return true;
}

/// Pairs of neighbours of a blob that may span a cell of the lattice, right-handed.
std::vector<std::pair<std::size_t, std::size_t>> cell_pairs(const std::vector<EllipseBlob>& blobs,
                                                            const BlobRaster& raster,
                                                            std::size_t i) {
  // Neighbours are not farther than 8 diameters; a board that is tilted by 70 degrees has the
  // neighbour of the next row behind three pairs of its own row.
  constexpr double max_diameters = 8;
  constexpr std::size_t max_neighbours = 10;
  constexpr double min_sine = 0.25, max_length_ratio = 4;
  const Vector2d& origin = blobs[i].px;
  const double diameter = 2 * std::sqrt(2 * blobs[i].moments.trace());
  std::vector<std::size_t> near;
  for (const std::size_t j : raster.within(origin, max_diameters * diameter))
    if (j != i && are_alike(blobs[i], blobs[j]) && near.size() < max_neighbours) near.push_back(j);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t b = 1; b < near.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const Vector2d one = blobs[near[a]].px - origin, two = blobs[near[b]].px - origin;
      const double cross = one.x() * two.y() - one.y() * two.x();
      if (std::abs(cross) < min_sine * one.norm() * two.norm() ||
          two.norm() > max_length_ratio * one.norm())
        continue;
      const double tolerance = max_shift * std::min(one.norm(), two.norm());
      if (!raster.nearest(origin + one + two, tolerance)) continue;
      if (!is_primitive(blobs, near, origin, one, two)) continue;
      pairs.emplace_back(cross > 0 ? near[a] : near[b], cross > 0 ? near[b] : near[a]);
    }
  return pairs;
}

}  // namespace

void for_each_lattice(const std::vector<EllipseBlob>& blobs, std::size_t min_blobs,
                      const std::function<bool(const BlobLattice&)>& use) {
  if (blobs.size() < min_blobs || blobs.size() < 4) return;
  const BlobRaster raster(blobs);
  constexpr int max_lattices = 200;  // a perforated plate has a lattice from each of its holes
  int lattices = 0;
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    for (const auto& [one, two] : cell_pairs(blobs, raster, i)) {
      GrowingLattice growing(blobs, raster);
      growing.set(0, 0, i);
      growing.set(1, 0, one);
      growing.set(0, 1, two);
      growing.grow();
      if (growing.lattice().size() < min_blobs) continue;
      if (use(growing.lattice()) || ++lattices == max_lattices) return;
    }
  }
}

}  // namespace occ::internal::landmarks
