// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/plan_route.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <sstream>
#include <tuple>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/guide/internal/route_view.hpp"

namespace occ {

using namespace internal::guide;
namespace {

constexpr int headings = 8;
constexpr int steps[headings][2] = {{1, 0},  {1, 1},   {0, 1},  {-1, 1},
                                    {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
constexpr double blind_metre_cost = 1e4;  // cost of one metre without view; exceeds any detour

double heading_of(int index) { return wrapped_rad(index * pi / 4); }

/// A node: pose of the lattice, and the number of goals reached.
struct Node {
  int x = 0, y = 0, heading = 0, goal = 0;
};

/// Motion of the lattice: straight, or round a corner to the left or right.
struct Motion {
  Node to;
  Eigen::Vector2d corner_m;
  bool turns = false;
};

class Lattice {
 public:
  Lattice(const Scene& scene, const PlanarPose& start, const std::vector<PlanGoal>& goals,
          const RoutePlanOptions& options)
      : scene_(scene),
        view_(scene, options),
        start_(start),
        goals_(goals),
        options_(options),
        corner_cells_(std::max(1, static_cast<int>(std::ceil(options.corner_radius_m *
                                                             std::tan(pi / 8) / options.cell_m)))) {
    bounds();
  }

  RoutePlan plan() {
    RoutePlan plan;
    if (blocked(start_.position(), "the start", PlanStatus::start_blocked, plan)) return plan;
    for (std::size_t i = 0; i < goals_.size(); ++i)
      if (blocked(goals_[i].position_m, "goals[" + std::to_string(i) + "]",
                  PlanStatus::goal_blocked, plan))
        return plan;
    search();
    if (end_ < 0) {
      plan.status = PlanStatus::blocked;
      std::ostringstream text;
      text << "walls and boxes block every route beyond (" << nearest_m_.x() << ", "
           << nearest_m_.y() << ") towards goals[" << furthest_goal_ << "]";
      plan.message = text.str();
      return plan;
    }
    return finished(std::move(plan));
  }

 private:
  void bounds() {
    Eigen::Vector2d low = start_.position(), high = start_.position();
    for (const PlanGoal& goal : goals_) {
      low = low.cwiseMin(goal.position_m);
      high = high.cwiseMax(goal.position_m);
    }
    // Without walls, the search area extends this far.
    low.array() -= 3;
    high.array() += 3;
    if (scene_.room) {
      low.setZero();
      high = scene_.room->size_m.head<2>();
    }
    const Eigen::Array2d below = ((start_.position() - low) / options_.cell_m).array().floor();
    const Eigen::Array2d above = ((high - start_.position()) / options_.cell_m).array().floor();
    low_x_ = -static_cast<int>(below.x());
    low_y_ = -static_cast<int>(below.y());
    width_ = static_cast<int>(below.x() + above.x()) + 1;
    height_ = static_cast<int>(below.y() + above.y()) + 1;
    require(static_cast<double>(width_) * height_ < 4e6, "cell_m", options_.cell_m,
            "large enough for at most 4 million places");
  }

  bool blocked(const Eigen::Vector2d& place, const std::string& name, PlanStatus status,
               RoutePlan& plan) const {
    std::string what;
    if (clearance_m(scene_, place, options_.vehicle_radius_m, options_.vehicle_height_m, &what) >=
        0)
      return false;
    std::ostringstream text;
    text << name << " at (" << place.x() << ", " << place.y() << ") touches " << what;
    plan.status = status;
    plan.message = text.str();
    return true;
  }

  Eigen::Vector2d place_of(int x, int y) const {
    return start_.position() + options_.cell_m * Eigen::Vector2d(x, y);
  }
  bool inside(const Node& n) const {
    return n.x >= low_x_ && n.y >= low_y_ && n.x < low_x_ + width_ && n.y < low_y_ + height_;
  }
  long index_of(const Node& n) const {
    const long place = static_cast<long>(n.y - low_y_) * width_ + (n.x - low_x_);
    return (static_cast<long>(n.goal) * width_ * height_ + place) * headings + n.heading;
  }
  Node node_of(long index) const {
    Node n;
    n.heading = static_cast<int>(index % headings);
    index /= headings;
    n.x = static_cast<int>(index % width_) + low_x_;
    index /= width_;
    n.y = static_cast<int>(index % height_) + low_y_;
    n.goal = static_cast<int>(index / height_);
    return n;
  }

  /// Returns the number of goals reached at a pose.
  Node with_goals_reached(Node n) const {
    while (n.goal < static_cast<int>(goals_.size())) {
      const PlanGoal& goal = goals_[n.goal];
      const double off_m = (place_of(n.x, n.y) - goal.position_m).norm();
      if (off_m > 0.7072 * options_.cell_m) break;
      if (goal.heading_rad &&
          std::abs(wrapped_rad(heading_of(n.heading) - *goal.heading_rad)) > pi / 8 + 1e-9)
        break;
      ++n.goal;
    }
    return n;
  }

  /// Lower bound of the remaining length: straight lines over the remaining goals.
  double left_m(const Node& n) const {
    double sum = 0;
    Eigen::Vector2d from = place_of(n.x, n.y);
    for (std::size_t i = static_cast<std::size_t>(n.goal); i < goals_.size(); ++i) {
      sum += std::max(0.0, (goals_[i].position_m - from).norm() - 1.42 * options_.cell_m);
      from = goals_[i].position_m;
    }
    return sum;
  }

  Motion motion(const Node& from, int turn) const {
    Motion m;
    m.to = from;
    m.turns = turn != 0;
    const int cells = m.turns ? corner_cells_ : 1;
    const int* ahead = steps[from.heading];
    m.to.x += cells * ahead[0];
    m.to.y += cells * ahead[1];
    m.corner_m = place_of(m.to.x, m.to.y);
    if (!m.turns) return m;
    m.to.heading = (from.heading + turn + headings) % headings;
    m.to.x += cells * steps[m.to.heading][0];
    m.to.y += cells * steps[m.to.heading][1];
    return m;
  }

  /// Route of a single motion.
  Route way(const Node& from, const Motion& m) const {
    std::vector<RouteWaypoint> waypoints = {{place_of(from.x, from.y), {}, {}}};
    if (m.turns) waypoints.push_back({m.corner_m, {}, {}});
    waypoints.push_back({place_of(m.to.x, m.to.y), {}, {}});
    return Route(waypoints, route_options());
  }

  RouteOptions route_options() const {
    RouteOptions options;
    options.corner_radius_m = options_.corner_radius_m;
    options.speed_m_s = options_.speed_m_s;
    return options;
  }

  /// Cost of a motion; empty if it touches a wall or box.
  std::optional<double> cost_of(const Node& from, const Motion& m) const {
    const Route route = way(from, m);
    const int count =
        std::max(2, static_cast<int>(std::ceil(route.length_m() / (0.25 * options_.cell_m))));
    int blind = 0;
    for (int i = 1; i <= count; ++i) {
      const PlanarPose pose = route.at(route.length_m() * i / count).pose;
      if (clearance_m(scene_, pose.position(), options_.vehicle_radius_m,
                      options_.vehicle_height_m) < 0)
        return std::nullopt;
      blind += view_.enough(pose) ? 0 : 1;
    }
    return route.length_m() * (1 + blind_metre_cost * blind / count) +
           (m.turns ? options_.turn_cost_m : 0);
  }

  void search() {
    using Entry = std::tuple<double, long>;  // estimated total cost; ties are broken by index
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    const std::size_t count = (goals_.size() + 1) * static_cast<std::size_t>(width_) *
                              static_cast<std::size_t>(height_) * headings;
    costs_.assign(count, std::numeric_limits<double>::infinity());
    parents_.assign(count, -1);
    std::vector<bool> closed(count, false);
    const auto eighths = static_cast<int>(std::lround(start_.heading_rad / (pi / 4)));
    const Node first = with_goals_reached({0, 0, ((eighths % headings) + headings) % headings, 0});
    costs_[index_of(first)] = 0;
    open.emplace(left_m(first), index_of(first));
    double nearest = std::numeric_limits<double>::infinity();
    while (!open.empty()) {
      const long index = std::get<1>(open.top());
      open.pop();
      if (closed[index]) continue;
      closed[index] = true;
      const Node node = node_of(index);
      if (left_m(node) < nearest) {
        nearest = left_m(node);
        nearest_m_ = place_of(node.x, node.y);
        furthest_goal_ = node.goal;
      }
      if (node.goal == static_cast<int>(goals_.size())) {
        end_ = index;
        return;
      }
      for (const int turn : {0, 1, -1}) {
        const Motion m = motion(node, turn);
        if (!inside(m.to)) continue;
        const auto to = static_cast<std::size_t>(index_of(with_goals_reached(m.to)));
        if (closed[to]) continue;
        const std::optional<double> cost = cost_of(node, m);
        if (!cost) continue;
        const double sum = costs_[index] + *cost;
        if (!(sum < costs_[to])) continue;
        costs_[to] = sum;
        parents_[to] = index;
        open.emplace(sum + left_m(node_of(static_cast<long>(to))), static_cast<long>(to));
      }
    }
  }

  RoutePlan finished(RoutePlan plan) const {
    std::vector<Node> nodes;
    for (long index = end_; index >= 0; index = parents_[index]) nodes.push_back(node_of(index));
    std::reverse(nodes.begin(), nodes.end());
    plan.waypoints = {{place_of(nodes[0].x, nodes[0].y), {}, {}}};
    for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
      const int turn = (nodes[i + 1].heading - nodes[i].heading + headings + 1) % headings - 1;
      if (turn != 0) plan.waypoints.push_back({motion(nodes[i], turn).corner_m, {}, {}});
    }
    const Eigen::Vector2d last = place_of(nodes.back().x, nodes.back().y);
    if (nodes.size() == 1) {  // start and goal coincide: shortest possible route
      plan.message = "all goals coincide with the start";
      plan.status = PlanStatus::ok;
      plan.seen_share = 1;
      return plan;
    }
    plan.waypoints.push_back({last, {}, {}});
    plan.route.emplace(plan.waypoints, route_options());
    plan.gaps = view_.gaps(*plan.route, 0.02);
    double blind_m = 0;
    for (const ViewGap& gap : plan.gaps) blind_m += gap.to_m - gap.from_m;
    plan.seen_share = 1 - blind_m / plan.route->length_m();
    plan.status = plan.gaps.empty() ? PlanStatus::ok : PlanStatus::blind;
    if (!plan.gaps.empty()) {
      std::ostringstream text;
      const ViewGap& gap = plan.gaps.front();
      text << "every route has sections without view: the best one has " << blind_m << " m in "
           << plan.gaps.size() << " sections, the first from (" << gap.from.x() << ", "
           << gap.from.y() << ") to (" << gap.to.x() << ", " << gap.to.y() << ")";
      plan.message = text.str();
    }
    return plan;
  }

  const Scene& scene_;
  RouteView view_;
  PlanarPose start_;
  const std::vector<PlanGoal>& goals_;
  const RoutePlanOptions& options_;
  int corner_cells_ = 1;
  int low_x_ = 0, low_y_ = 0, width_ = 0, height_ = 0;
  std::vector<double> costs_;
  std::vector<long> parents_;
  long end_ = -1;
  Eigen::Vector2d nearest_m_ = Eigen::Vector2d::Zero();
  int furthest_goal_ = 0;
};

}  // namespace

const char* to_string(PlanStatus status) {
  switch (status) {
    case PlanStatus::ok:
      return "ok";
    case PlanStatus::blind:
      return "blind";
    case PlanStatus::blocked:
      return "blocked";
    case PlanStatus::start_blocked:
      return "start_blocked";
    case PlanStatus::goal_blocked:
      return "goal_blocked";
  }
  return "unknown";
}

void RoutePlanOptions::validate() const {
  view.validate();
  const auto positive = [](double value, const char* name) {
    require(std::isfinite(value) && value > 0, name, value, "positive");
  };
  require(min_lamps >= 0, "min_lamps", min_lamps, ">= 0");
  require(max_sigma_m > 0, "max_sigma_m", max_sigma_m, "positive");
  positive(cell_m, "cell_m");
  positive(corner_radius_m, "corner_radius_m");
  require(std::isfinite(vehicle_radius_m) && vehicle_radius_m >= 0, "vehicle_radius_m",
          vehicle_radius_m, "finite and >= 0");
  positive(vehicle_height_m, "vehicle_height_m");
  positive(speed_m_s, "speed_m_s");
  require(std::isfinite(turn_cost_m) && turn_cost_m >= 0, "turn_cost_m", turn_cost_m,
          "finite and >= 0");
}

RoutePlan plan_route(const Scene& scene, const PlanarPose& start,
                     const std::vector<PlanGoal>& goals, const RoutePlanOptions& options) {
  options.validate();
  Scene checked = scene;
  checked.validate();
  require(start.finite(), "start", Eigen::RowVector3d(start.x_m, start.y_m, start.heading_rad),
          "finite");
  require(!goals.empty(), "goals", goals.size(), "at least one");
  for (std::size_t i = 0; i < goals.size(); ++i) {
    const std::string name = "goals[" + std::to_string(i) + "]";
    require(goals[i].position_m.allFinite(), name + ".position_m", goals[i].position_m.transpose(),
            "finite");
    if (goals[i].heading_rad)
      require(std::isfinite(*goals[i].heading_rad), name + ".heading_rad", *goals[i].heading_rad,
              "finite");
  }
  return Lattice(checked, start, goals, options).plan();
}

}  // namespace occ
