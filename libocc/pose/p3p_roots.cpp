// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/p3p_roots.hpp"

#include <Eigen/Dense>

#include "libocc/pose/internal/conic_pencil.hpp"

namespace occ::internal::pose {
namespace {

// Misfit that rounding alone causes [rad], for equal distances.
constexpr double root_converged = 4e-15;
// Misfit of an accepted root [rad].
constexpr double max_misfit = 3e-12;

// A start slightly behind the camera may move in front of it during polishing.
constexpr double slightly_behind = 1e-6;

// Below this return value of Linearised::newton_step a root is treated as one of a close pair.
constexpr double weakly_separated = 1e-4;

// Limit of that value for the real part of a complex pair.
constexpr double complex_pair = 1e-2;

double smallest(const double d[3]) { return std::min(std::min(d[0], d[1]), d[2]); }
double largest(const double d[3]) { return std::max(std::max(d[0], d[1]), d[2]); }

// Misfit of an exact root due to rounding.
double depth_rounding(const double depth[3]) {
  return root_converged * largest(depth) / smallest(depth);
}

struct Starts {
  double depth[3][4];
  bool real[4];
  int count = 0;
};

void add_starts(const Triangle& t, const double points[2][3], double inverse_zoom, bool real,
                bool take, Starts& starts) {
  for (int i = 0; i < 2; ++i) {
    const double u = points[i][0], v = points[i][1], w = points[i][2] * inverse_zoom;
    const double d0 = w + u, d1 = w + v, d2 = w, uv = u - v;
    const double sides2 = uv * uv + v * v + u * u + t.chord2[0] * d0 * d1 + t.chord2[1] * d1 * d2 +
                          t.chord2[2] * d2 * d0;
    const double low = std::min(std::min(d0, d1), d2), high = std::max(std::max(d0, d1), d2);
    const bool forward = high > -low;
    const double scale = (forward ? 1 : -1) / std::sqrt(sides2);
    const int n = starts.count;
    starts.depth[0][n] = d0 * scale;
    starts.depth[1][n] = d1 * scale;
    starts.depth[2][n] = d2 * scale;
    starts.real[n] = real;
    // Without a branch, because it would be unpredictable.
    const bool in_front = (forward ? low : -high) > -slightly_behind * std::abs(high - low);
    starts.count += static_cast<int>(take) & static_cast<int>(in_front);
  }
}

// `keep_complex`: returns the real parts of complex pairs as well.
Starts find_starts(const Triangle& t, bool keep_complex) {
  Starts starts;
  const double zoom = std::sqrt(t.chord2[0] + t.chord2[1] + t.chord2[2]);
  const double inverse_zoom = 1 / zoom, inverse_zoom2 = inverse_zoom * inverse_zoom;
  const double c0 = t.chord2[0], c1 = t.chord2[1], c2 = t.chord2[2];
  const double s1 = t.side2[1], s2 = t.side2[2], half = 0.5 * inverse_zoom;
  // Q_0 + Q_1 + Q_2 is (2, 2, 1, uv, uw, vw).
  const double uv = 0.5 * c0 - 1, uw = half * (c2 + c0), vw = half * (c1 + c0);
  const Conic a{1 - 2 * s2,          -2 * s2, c2 * inverse_zoom2 - s2, -s2 * uv,
                half * c2 - s2 * uw, -s2 * vw};
  const Conic b{-2 * s1,  1 - 2 * s1, c1 * inverse_zoom2 - s1,
                -s1 * uv, -s1 * uw,   half * c1 - s1 * vw};
  const Member member = degenerate_member(a, b);
  LinePair lines;
  if (!split(combined(member.x, a, member.y, b), lines)) return starts;
  const Conic& o = std::abs(member.x) < std::abs(member.y) ? a : b;  // less similar to the member
  const double other[3][3] = {{o.uu, o.uv, o.uw}, {o.uv, o.vv, o.vw}, {o.uw, o.vw, o.ww}};
  double points[2][3];
  for (const double* line : {lines.first, lines.second}) {
    const bool real = intersect(other, line, points);
    add_starts(t, points, inverse_zoom, real, real || keep_complex, starts);
  }
  return starts;
}

// At a double root Newton's method only halves the error in each step, hence the high limit of
// steps. At the root its steps are dominated by rounding, hence the stop when the misfit no longer
// falls.
void polish(const Triangle& t, Root& root) {
  constexpr int max_steps = 40;
  root.misfit = angular_misfit(t, root.depth);
  for (int i = 0; i < max_steps && !(root.misfit < depth_rounding(root.depth)); ++i) {
    double depth[3] = {root.depth[0], root.depth[1], root.depth[2]};
    Linearised<double>(t, depth).newton_step(depth);
    const double misfit = angular_misfit(t, depth);
    if (!(misfit < root.misfit)) return;
    std::copy(depth, depth + 3, root.depth);
    root.misfit = misfit;
  }
}

bool is_root(const Root& root) {
  return smallest(root.depth) > 0 &&
         root.misfit < std::max(max_misfit, 4 * depth_rounding(root.depth));
}

// Two roots are indistinguishable if rounding of the input moves a double root by as much as their
// distance, or if the point between them fits as well as they do.
bool same(const Triangle& t, const Root& a, const Root& b) {
  constexpr double double_root = 1e-7;  // a few square roots of rounding
  constexpr double far_apart = 1e-2;
  double middle[3], apart = 0;
  for (int k = 0; k < 3; ++k) {
    middle[k] = 0.5 * (a.depth[k] + b.depth[k]);
    apart = std::max(apart, std::abs(a.depth[k] - b.depth[k]));
  }
  if (apart > far_apart * largest(middle)) return false;
  return apart < double_root * std::min(1.0, largest(middle)) ||
         angular_misfit(t, middle) < 2 * std::max({depth_rounding(middle), a.misfit, b.misfit});
}

struct Roots {
  Root* list;
  bool keep_close;
  int count = 0;

  // Returns false if `root` is none.
  bool add(const Triangle& t, const Root& root) {
    if (!is_root(root)) return false;
    for (int i = 0; i < count && !keep_close; ++i) {
      if (!same(t, root, list[i])) continue;
      if (root.misfit < list[i].misfit) list[i] = root;
      return true;
    }
    if (count < max_roots) list[count++] = root;
    return true;
  }
};

// Right null vector n and left null vector l of a nearly singular Jacobian.
struct NullVectors {
  Eigen::Vector3d n, l;
};

Eigen::Matrix3d jacobian(const Linearised<double>& e) {
  Eigen::Matrix3d j = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    j(k, k) = e.p[k];
    j(k, next(k)) = e.q[k];
  }
  return j;
}

// Taken from the largest column and row of the adjugate.
NullVectors null_vectors(const Linearised<double>& e) {
  Eigen::Matrix3d adjugate;
  for (int k = 0; k < 3; ++k) {
    const int l = next(k), m = next(l);
    adjugate(k, k) = e.p[l] * e.p[m];
    adjugate(k, l) = -e.q[k] * e.p[m];
    adjugate(k, m) = e.q[k] * e.q[l];
  }
  Eigen::Index row, column;
  adjugate.cwiseAbs().maxCoeff(&row, &column);
  return {adjugate.col(column).normalized(), adjugate.row(row).normalized()};
}

// Adds two roots that are close to each other, from a start close to both. Along n the equations
// change by e J n + e^2 Q(n), exactly. Newton's method across n is followed by a quadratic equation
// along n. If rounding has made its roots complex, their real part is used. Where the quadratic
// equation itself is lost in rounding, the start remains.
void add_pair(const Triangle& t, const Eigen::Vector3d& start, Roots& roots) {
  constexpr int steps_across = 4;
  Eigen::Vector3d depth = start;
  double constant = 0, linear = 0, quadratic = 0;
  Eigen::Vector3d n;
  for (int i = 0; i <= steps_across; ++i) {
    const Linearised<double> e(t, depth.data());
    const NullVectors v = null_vectors(e);
    const Eigen::Map<const Eigen::Vector3d> residual(e.residual);
    n = v.n;
    if (i < steps_across) {
      Eigen::Matrix4d bordered = Eigen::Matrix4d::Zero();
      bordered.topLeftCorner<3, 3>() = jacobian(e);
      bordered.topRightCorner<3, 1>() = v.l;
      bordered.bottomLeftCorner<1, 3>() = v.n.transpose();
      const Eigen::Vector4d right(-residual[0], -residual[1], -residual[2], 0);
      depth += bordered.partialPivLu().solve(right).head<3>();
      continue;
    }
    constant = v.l.dot(residual);
    linear = v.l.dot(jacobian(e) * n);
    quadratic = 0;
    for (int k = 0; k < 3; ++k) {
      const double step = n[k] - n[next(k)];
      quadratic += v.l[k] * (step * step + t.chord2[k] * n[k] * n[next(k)]);
    }
  }
  const double root = std::sqrt(std::max(0.0, linear * linear - 4 * quadratic * constant));
  const auto add = [&](const Eigen::Vector3d& d) {
    Root one{{d[0], d[1], d[2]}, 0};
    polish(t, one);
    return roots.add(t, one);
  };
  const bool first = add(depth + n * ((-linear - root) / (2 * quadratic)));
  const bool second = add(depth + n * ((-linear + root) / (2 * quadratic)));
  if (!first && !second) add(start);
}

}  // namespace

int find_roots(const Triangle& triangle, bool keep_close, Root list[max_roots]) {
  using Two = Eigen::Array<double, 2, 1>;
  // Rounding can turn a double root into a complex pair, whose real part is close to both.
  const Starts starts = find_starts(triangle, true);
  Roots roots{list, keep_close};
  for (int first = 0; first < starts.count; first += 2) {
    const int second = std::min(first + 1, starts.count - 1);
    Two depth[3];
    for (int k = 0; k < 3; ++k) depth[k] = {starts.depth[k][first], starts.depth[k][second]};
    const Two separation = Linearised<Two>(triangle, depth).newton_step(depth);
    const Two shift = displacement(triangle, depth, 0)
                          .max(displacement(triangle, depth, 1))
                          .max(displacement(triangle, depth, 2));
    for (int i = 0; i <= second - first; ++i) {
      const int n = i == 0 ? first : second;
      bool is_pair = separation[i] < (starts.real[n] ? weakly_separated : complex_pair);
      if (!is_pair && starts.real[n]) {
        Root root{{depth[0][i], depth[1][i], depth[2][i]}, root_converged};
        if (!(shift[i] < 2.5 * root_converged * smallest(root.depth))) polish(triangle, root);
        roots.add(triangle, root);
        is_pair = !is_root(root);
      }
      if (is_pair) {
        add_pair(triangle, {starts.depth[0][n], starts.depth[1][n], starts.depth[2][n]}, roots);
      }
    }
  }
  return roots.count;
}

int find_real_parts(const Triangle& triangle, Root roots[4]) {
  const Starts starts = find_starts(triangle, true);
  for (int i = 0; i < starts.count; ++i) {
    for (int k = 0; k < 3; ++k) roots[i].depth[k] = starts.depth[k][i];
    roots[i].real = starts.real[i];
  }
  return starts.count;
}

}  // namespace occ::internal::pose
