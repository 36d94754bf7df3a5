// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/lamp_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "libocc/identify/lamp_index.hpp"

namespace occ::internal::identify {
namespace {

constexpr double one_height_m = 0.02;  // tolerance of the common height; see LampIndex
constexpr double min_share = 0.8;      // share of the lamps at the common height

// Returns the end of the run of each key 0 ... count - 1 in a sorted range.
template <class Range, class Key>
std::vector<int> run_ends(const Range& sorted, std::size_t count, const Key& key) {
  std::vector<int> ends(count, 0);
  for (const auto& item : sorted) ++ends[key(item)];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  return ends;
}

}  // namespace

LampTable::LampTable(const std::vector<Lamp>& lamps) {
  for (const Lamp& lamp : lamps) {
    positions_.emplace_back(lamp.centre_m.x(), lamp.centre_m.y());
    heights_m_.push_back(lamp.centre_m.z());
  }
  const std::size_t at_height = find_height();
  remove_duplicates();
  applies_ = members_.size() >= 4 &&
             static_cast<double>(at_height) >= min_share * static_cast<double>(lamps.size());
  if (!applies_) return;
  build_grid();
  add_triangles();
}

bool LampTable::is_of(const std::vector<Lamp>& lamps) const {
  if (lamps.size() != positions_.size()) return false;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const Eigen::Vector3d& at = lamps[i].centre_m;
    if (at.x() != positions_[i].real() || at.y() != positions_[i].imag() || at.z() != heights_m_[i])
      return false;
  }
  return true;
}

// Finds the height that most lamps share; returns their number.
std::size_t LampTable::find_height() {
  std::vector<double> sorted = heights_m_;
  std::sort(sorted.begin(), sorted.end());
  std::size_t best = 0, first = 0, largest = 0;
  for (std::size_t last = 0; last < sorted.size(); ++last) {
    while (sorted[last] - sorted[first] > one_height_m) ++first;
    if (last + 1 - first > largest) largest = last + 1 - first, best = first;
  }
  for (std::size_t i = 0; i < largest; ++i)
    height_m_ += sorted[best + i] / static_cast<double>(largest);
  double off2 = 0;
  for (int i = 0; i < static_cast<int>(heights_m_.size()); ++i) {
    const double off = heights_m_[i] - height_m_;
    if (std::abs(off) > one_height_m) continue;
    members_.push_back(i);
    off2 += off * off;
  }
  if (largest > 0) thickness_m_ = std::sqrt(off2 / static_cast<double>(largest));
  return largest;
}

// Keeps the first of several lamps at one position (see mark_duplicates).
void LampTable::remove_duplicates() {
  const auto at = [&](int lamp) {
    return std::make_pair(position(lamp).real(), position(lamp).imag());
  };
  std::stable_sort(members_.begin(), members_.end(), [&](int a, int b) { return at(a) < at(b); });
  members_.erase(
      std::unique(members_.begin(), members_.end(), [&](int a, int b) { return at(a) == at(b); }),
      members_.end());
}

// Builds a grid whose cells contain about one lamp each.
void LampTable::build_grid() {
  double x0 = std::numeric_limits<double>::infinity(), x1 = -x0, y0 = x0, y1 = -x0;
  for (const int i : members_) {
    x0 = std::min(x0, position(i).real()), x1 = std::max(x1, position(i).real());
    y0 = std::min(y0, position(i).imag()), y1 = std::max(y1, position(i).imag());
  }
  corner_ = {x0, y0};
  const double count = static_cast<double>(members_.size()), long_side = std::max(x1 - x0, y1 - y0);
  const double area_m2 = std::max((x1 - x0) * (y1 - y0), long_side * long_side / count);
  lamps_per_m2_ = area_m2 > 0 ? count / area_m2 : 0;
  cell_m_ = area_m2 > 0 ? std::sqrt(area_m2 / count) : 1;
  cells_ = {static_cast<int>((x1 - x0) / cell_m_) + 1, static_cast<int>((y1 - y0) / cell_m_) + 1};
  const auto cell = [&](int lamp) {
    const auto [x, y] = cell_of(position(lamp));
    return x * cells_[1] + y;
  };
  std::stable_sort(members_.begin(), members_.end(),
                   [&](int a, int b) { return cell(a) < cell(b); });
  cell_ends_ = run_ends(members_, cells_[0] * cells_[1], cell);
}

std::array<int, 2> LampTable::cell_of(const Complex& position) const {
  const Complex at = (position - corner_) / cell_m_;
  return {static_cast<int>(std::clamp(at.real(), 0.0, cells_[0] - 1.0)),
          static_cast<int>(std::clamp(at.imag(), 0.0, cells_[1] - 1.0))};
}

template <class Visit>
void LampTable::visit_cell(int x, int y, const Visit& visit) const {
  if (x < 0 || y < 0 || x >= cells_[0] || y >= cells_[1]) return;
  const int cell = x * cells_[1] + y;
  for (int i = cell == 0 ? 0 : cell_ends_[cell - 1]; i < cell_ends_[cell]; ++i) visit(members_[i]);
}

int LampTable::lamp_near(const Complex& at, double distance_m) const {
  const Complex reach(distance_m, distance_m);
  const auto [x0, y0] = cell_of(at - reach);
  const auto [x1, y1] = cell_of(at + reach);
  double min_distance2 = distance_m * distance_m;
  int nearest = -1;
  for (int x = x0; x <= x1; ++x)
    for (int y = y0; y <= y1; ++y)
      visit_cell(x, y, [&](int lamp) {
        const double distance2 = std::norm(position(lamp) - at);
        if (distance2 <= min_distance2) min_distance2 = distance2, nearest = lamp;
      });
  return nearest;
}

// Visits rings of cells around the lamp until no unvisited lamp can be nearer.
std::vector<int> LampTable::nearest(int lamp) const {
  const auto [x, y] = cell_of(position(lamp));
  std::vector<std::pair<double, int>> found;
  const int widest = std::max(cells_[0], cells_[1]);
  for (int ring = 0; ring <= widest; ++ring) {
    for (int dx = -ring; dx <= ring; ++dx)
      for (int dy = -ring; dy <= ring; ++dy)
        if (std::max(std::abs(dx), std::abs(dy)) == ring)
          visit_cell(x + dx, y + dy, [&](int other) {
            if (other != lamp)
              found.push_back({std::norm(position(other) - position(lamp)), other});
          });
    const double complete_m = ring * cell_m_;
    if (std::count_if(found.begin(), found.end(), [&](const auto& f) {
          return f.first <= complete_m * complete_m;
        }) >= neighbours)
      break;
  }
  std::sort(found.begin(), found.end());
  if (found.size() > neighbours) found.resize(neighbours);
  std::vector<int> lamps;
  for (const auto& f : found) lamps.push_back(f.second);
  return lamps;
}

int LampTable::shape_cell_re(double re) {
  return static_cast<int>(std::clamp(re * 2 * cells_re, 0.0, cells_re - 1.0));
}

int LampTable::shape_cell_im(double im) {
  return static_cast<int>(std::clamp((im + 1) / 2 * cells_im, 0.0, cells_im - 1.0));
}

// Adds each lamp with every two of its neighbours; each triangle is added once.
void LampTable::add_triangles() {
  std::vector<std::array<int, 3>> triples;
  for (const int a : members_) {
    const std::vector<int> near = nearest(a);
    for (std::size_t i = 0; i < near.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        std::array<int, 3> t{a, near[i], near[j]};
        std::sort(t.begin(), t.end());
        triples.push_back(t);
      }
  }
  std::sort(triples.begin(), triples.end());
  triples.erase(std::unique(triples.begin(), triples.end()), triples.end());
  for (std::array<int, 3> t : triples) {
    const auto side2 = [&] { return std::norm(position(t[1]) - position(t[0])); };
    std::array<int, 3> longest = t;
    double longest2 = -1;
    for (int i = 0; i < 3; ++i) {
      if (side2() > longest2) longest2 = side2(), longest = t;
      std::rotate(t.begin(), t.begin() + 1, t.end());
    }
    if (!(longest2 > 0)) continue;  // three lamps at one position
    Complex shape = shape_of(position(longest[0]), position(longest[1]), position(longest[2]));
    if (shape.real() > 0.5) {
      std::swap(longest[0], longest[1]);
      shape = 1.0 - shape;
    }
    triangles_.push_back(
        {static_cast<float>(shape.real()), static_cast<float>(shape.imag()), longest});
  }
  const auto cell = [](const Triangle& t) {
    return shape_cell_re(t.re) * cells_im + shape_cell_im(t.im);
  };
  std::stable_sort(triangles_.begin(), triangles_.end(),
                   [&](const Triangle& a, const Triangle& b) { return cell(a) < cell(b); });
  shape_ends_ = run_ends(triangles_, cells_re * cells_im, cell);
}

}  // namespace occ::internal::identify

namespace occ {

LampIndex::LampIndex(const std::vector<Lamp>& lamps)
    : table_(std::make_shared<const internal::identify::LampTable>(lamps)) {}

bool LampIndex::applies() const { return table_->applies(); }

std::size_t LampIndex::triangles() const { return table_->triangles().size(); }

}  // namespace occ
