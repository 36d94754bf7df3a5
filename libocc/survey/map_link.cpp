// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/map_link.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::survey {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// With 40 % changed lamps, a pair is unchanged with 0.36; 60 pairs all fail with 2e-12.
constexpr int max_base_pairs = 60;
constexpr std::size_t max_refined = 2000;  // hypotheses with most lamps in the wide gate
constexpr double max_size_change = 0.15;   // error of a size and of the response, of a lamp kept
constexpr double gate_sigmas = 4;          // exceeded by 1 of 1000 correct matches
constexpr double wide_gate_part = 0.05;    // error of a normal (0.05 rad) over the distance
constexpr double normal_cosine = 0.5;      // matched lamps face the same half space

struct Hypothesis {
  Similarity similarity;
  std::vector<int> lamp_of;
  int count = 0;
};

class LinkSearch {
 public:
  LinkSearch(const std::vector<LinkLamp>& lamps, const std::vector<LinkLamp>& map)
      : lamps_(lamps), map_(map) {
    for (const LinkLamp& lamp : lamps) sigmas_.push_back(worst_sigma(lamp));
    for (const LinkLamp& lamp : map) map_sigmas_.push_back(worst_sigma(lamp));
    for (const LinkLamp& lamp : lamps) {  // the normals of single lamps are less accurate
      Vector3d mean = Vector3d::Zero();
      for (const LinkLamp& other : lamps)
        if (other.normal.dot(lamp.normal) > std::cos(0.2)) mean += other.normal;
      normals_.push_back(mean.normalized());
    }
    Vector3d middle = Vector3d::Zero();
    for (const LinkLamp& lamp : map) middle += lamp.position / static_cast<double>(map.size());
    Matrix3d scatter = Matrix3d::Zero();
    for (const LinkLamp& lamp : map)
      scatter += (lamp.position - middle) * (lamp.position - middle).transpose();
    const Matrix3d axes = core::symmetric_eigen<Matrix3d>(scatter).eigenvectors();
    Eigen::Array3d low = Eigen::Array3d::Constant(infinity), high = -low;
    for (const LinkLamp& lamp : map) {
      const Eigen::Array3d at = (axes.transpose() * lamp.position).array();
      low = low.min(at);
      high = high.max(at);
    }
    extent_ = high - low;
  }

  std::vector<LinkWay> run() {
    collect();
    std::stable_sort(found_.begin(), found_.end(),
                     [](const Hypothesis& a, const Hypothesis& b) { return a.count > b.count; });
    if (found_.size() > max_refined) found_.resize(max_refined);
    std::vector<LinkWay> ways;
    std::set<std::vector<int>> known;
    for (Hypothesis& hypothesis : found_) {
      if (!refine(hypothesis) || !known.insert(hypothesis.lamp_of).second) continue;
      ways.push_back(way_of(hypothesis));
    }
    std::stable_sort(ways.begin(), ways.end(), [](const LinkWay& a, const LinkWay& b) {
      return a.log10_false_alarms < b.log10_false_alarms;
    });
    std::vector<LinkWay> distinct;
    for (LinkWay& way : ways)
      if (std::none_of(distinct.begin(), distinct.end(),
                       [&](const LinkWay& other) { return is_same(way, other); }))
        distinct.push_back(std::move(way));
    return distinct;
  }

 private:
  static bool is_same(const LinkWay& way, const LinkWay& better) {
    int equal = 0;
    for (std::size_t i = 0; i < way.lamp_of.size(); ++i)
      equal += way.lamp_of[i] >= 0 && way.lamp_of[i] == better.lamp_of[i];
    return 2 * equal > way.matches;
  }

  bool sizes_agree(int lamp, int mapped, double scale) const {
    const double size = lamps_[lamp].size, known = map_[mapped].size;
    return !(size > 0 && known > 0) ||
           std::abs(std::log(scale * size / known)) < std::log1p(max_size_change);
  }

  void collect() {
    const int count = static_cast<int>(lamps_.size());
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < i; ++j) pairs.emplace_back(i, j);
    const double all = static_cast<double>(pairs.size());
    Random random(1);
    for (std::size_t i = 0; i + 1 < pairs.size(); ++i)
      std::swap(
          pairs[i],
          pairs[i + static_cast<std::size_t>(random.below(static_cast<int>(pairs.size() - i)))]);
    if (pairs.size() > max_base_pairs) pairs.resize(max_base_pairs);
    const int mapped = static_cast<int>(map_.size());
    std::set<std::vector<int>> known;
    for (const auto& [i, j] : pairs)
      for (int a = 0; a < mapped; ++a)
        for (int b = 0; b < mapped; ++b)
          if (a != b) add(i, j, a, b, known);
    tests_ *= all / static_cast<double>(pairs.size());
  }

  static Matrix3d axes(const Vector3d& along, const Vector3d& normal) {
    Matrix3d result;
    const Vector3d x = along.normalized(), y = normal.cross(x).normalized();
    result << x, y, x.cross(y);
    return result;
  }

  void add(int i, int j, int a, int b, std::set<std::vector<int>>& known) {
    const Vector3d from = lamps_[j].position - lamps_[i].position;
    const Vector3d to = map_[b].position - map_[a].position;
    if (!(from.norm() > 0) || !(to.norm() > 0)) return;
    Hypothesis next;
    next.similarity.scale = to.norm() / from.norm();
    if (!sizes_agree(i, a, next.similarity.scale) || !sizes_agree(j, b, next.similarity.scale))
      return;
    constexpr double max_off = 0.2;  // difference of the sines of both elevations
    if (std::abs(from.normalized().dot(normals_[i]) - to.normalized().dot(map_[a].normal)) >
            max_off ||
        std::abs(to.normalized().dot(map_[a].normal)) > 1 - max_off)
      return;
    ++tests_;
    next.similarity.rotation = axes(to, map_[a].normal) * axes(from, normals_[i]).transpose();
    next.similarity.translation =
        map_[a].position - next.similarity.scale * (next.similarity.rotation * lamps_[i].position);
    const double scale = next.similarity.scale;
    next.lamp_of = nearest(next.similarity, [&](int lamp, int mapped) {
      const double base = std::min((lamps_[lamp].position - lamps_[i].position).norm(),
                                   (lamps_[lamp].position - lamps_[j].position).norm());
      return gate(lamp, mapped, scale) + wide_gate_part * scale * base;
    });
    next.count = matches(next.lamp_of);
    if (next.count >= 3 && known.insert(next.lamp_of).second) found_.push_back(std::move(next));
  }

  static double worst_sigma(const LinkLamp& lamp) {
    return std::sqrt(core::symmetric_eigen<Matrix3d>(lamp.covariance).eigenvalues()[2]);
  }

  /// Distance within which a correct match is expected.
  double gate(int lamp, int mapped, double scale) const {
    return gate_sigmas * std::hypot(map_sigmas_[mapped], scale * sigmas_[lamp]);
  }

  static int matches(const std::vector<int>& lamp_of) {
    return static_cast<int>(
        std::count_if(lamp_of.begin(), lamp_of.end(), [](int lamp) { return lamp >= 0; }));
  }

  /// Nearest lamp of the map of each lamp within a gate; each is used once.
  template <class Gate>
  std::vector<int> nearest(const Similarity& similarity, const Gate& gate_of) const {
    std::vector<int> lamp_of(lamps_.size(), -1), user(map_.size(), -1);
    std::vector<double> distances(map_.size(), infinity);
    for (int i = 0; i < static_cast<int>(lamps_.size()); ++i) {
      const Vector3d at = similarity * lamps_[i].position;
      int best = -1;
      double smallest = infinity;
      for (int a = 0; a < static_cast<int>(map_.size()); ++a) {
        const double distance = (at - map_[a].position).squaredNorm();
        if (distance >= smallest) continue;
        smallest = distance;
        best = a;
      }
      if (best < 0 || smallest >= distances[best] || std::sqrt(smallest) > gate_of(i, best) ||
          (similarity.rotation * lamps_[i].normal).dot(map_[best].normal) < normal_cosine)
        continue;
      if (user[best] >= 0) lamp_of[user[best]] = -1;
      user[best] = i;
      distances[best] = smallest;
      lamp_of[i] = best;
    }
    return lamp_of;
  }

  /// Weighted least squares; false without three lamps off a line.
  bool fit(Hypothesis& hypothesis, const std::vector<double>& weights) const {
    double sum = 0;
    Vector3d from = Vector3d::Zero(), to = Vector3d::Zero();
    for (std::size_t i = 0; i < lamps_.size(); ++i) {
      if (hypothesis.lamp_of[i] < 0) continue;
      sum += weights[i];
      from += weights[i] * lamps_[i].position;
      to += weights[i] * map_[hypothesis.lamp_of[i]].position;
    }
    if (!(sum > 0)) return false;
    from /= sum;
    to /= sum;
    Matrix3d product = Matrix3d::Zero(), scatter = Matrix3d::Zero();
    for (std::size_t i = 0; i < lamps_.size(); ++i) {
      if (hypothesis.lamp_of[i] < 0) continue;
      const Vector3d arm = map_[hypothesis.lamp_of[i]].position - to;
      scatter += arm * arm.transpose();
      product += weights[i] * arm * (lamps_[i].position - from).transpose();
    }
    constexpr double min_width = 0.03;  // over the length; a line does not determine the rotation
    const Vector3d spread = core::symmetric_eigen<Matrix3d>(scatter).eigenvalues();
    if (!(spread[1] > square(min_width) * spread[2])) return false;
    Similarity& similarity = hypothesis.similarity;
    similarity.rotation = nearest_rotation(product);
    double along = 0, squares = 0;
    for (std::size_t i = 0; i < lamps_.size(); ++i) {
      if (hypothesis.lamp_of[i] < 0) continue;
      const Vector3d arm = similarity.rotation * (lamps_[i].position - from);
      along += weights[i] * arm.dot(map_[hypothesis.lamp_of[i]].position - to);
      squares += weights[i] * arm.squaredNorm();
    }
    if (!(along > 0) || !(squares > 0)) return false;
    similarity.scale = along / squares;
    similarity.translation = to - similarity.scale * (similarity.rotation * from);
    return similarity.rotation.allFinite() && similarity.translation.allFinite();
  }

  bool refine(Hypothesis& hypothesis) const {
    constexpr int shrinking = 6, rounds = 12;
    double widest = 0;
    for (std::size_t i = 0; i < lamps_.size(); ++i)
      if (hypothesis.lamp_of[i] >= 0) widest = std::max(widest, residual(hypothesis, i));
    for (int round = 0; round < rounds; ++round) {
      const double extra = round < shrinking ? widest * std::pow(0.4, round) : 0;
      std::vector<double> weights(lamps_.size(), 0);
      for (std::size_t i = 0; i < lamps_.size(); ++i) {
        if (hypothesis.lamp_of[i] < 0) continue;
        const double g =
            gate(static_cast<int>(i), hypothesis.lamp_of[i], hypothesis.similarity.scale) + extra;
        weights[i] = 1 / square(g * (1 + square(residual(hypothesis, i) / g)));
      }
      if (matches(hypothesis.lamp_of) < 3 || !fit(hypothesis, weights)) return false;
      const std::vector<int> before = std::move(hypothesis.lamp_of);
      hypothesis.lamp_of = nearest(hypothesis.similarity, [&](int lamp, int mapped) {
        return gate(lamp, mapped, hypothesis.similarity.scale) + extra;
      });
      if (round >= shrinking && hypothesis.lamp_of == before) break;
    }
    hypothesis.count = matches(hypothesis.lamp_of);
    return hypothesis.count >= 3;
  }

  double residual(const Hypothesis& hypothesis, std::size_t lamp) const {
    return (hypothesis.similarity * lamps_[lamp].position - map_[hypothesis.lamp_of[lamp]].position)
        .norm();
  }

  LinkWay way_of(const Hypothesis& hypothesis) const {
    LinkWay way;
    way.map_from_lamps = hypothesis.similarity;
    way.lamp_of = hypothesis.lamp_of;
    way.matches = hypothesis.count;
    double covered = 0;
    for (std::size_t i = 0; i < lamps_.size(); ++i) {
      if (way.lamp_of[i] < 0) continue;
      const double g = gate(static_cast<int>(i), way.lamp_of[i], hypothesis.similarity.scale);
      covered += (2 * g / (2 * g + extent_)).prod();
    }
    const double m = static_cast<double>(map_.size());
    const double p = std::min(1.0, m * covered / way.matches);
    // Each way with k matches is found from any of its pairs.
    const double pairs = 0.5 * way.matches * (way.matches - 1);
    way.log10_false_alarms = std::log10(std::max(1.0, tests_)) - std::log10(pairs) +
                             log10_tail(static_cast<int>(lamps_.size()) - 2, way.matches - 2, p);
    return way;
  }

  /// Base-10 logarithm of the probability of at least k successes of n.
  static double log10_tail(int n, int k, double p) {
    if (k <= 0 || p >= 1) return 0;
    double sum = 0;
    for (int j = k; j <= n; ++j)
      sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(j + 1.0) - std::lgamma(n - j + 1.0) +
                      j * std::log(p) + (n - j) * std::log1p(-p));
    return sum > 0 ? std::log10(sum) : -300;
  }

  const std::vector<LinkLamp>& lamps_;
  const std::vector<LinkLamp>& map_;
  std::vector<Vector3d> normals_;
  std::vector<double> sigmas_, map_sigmas_;  // along the worst direction
  Eigen::Array3d extent_;                    // of the map, along its principal axes
  double tests_ = 0;                         // pairs of lamps that agree in size and elevation
  std::vector<Hypothesis> found_;
};

}  // namespace

std::vector<LinkWay> link_ways(const std::vector<LinkLamp>& lamps,
                               const std::vector<LinkLamp>& map) {
  if (lamps.size() < 3 || map.size() < 3) return {};
  return LinkSearch(lamps, map).run();
}

}  // namespace occ::internal::survey
