// SPDX-License-Identifier: Apache-2.0
// Which rung a budget or a target leads to, with made-up costs, bounds and clocks; and locate()
// with both.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/refine/bound.hpp"
#include "libocc/refine/rung_choice.hpp"
#include "libocc/refine/rung_costs.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace occ {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

std::vector<RungForecast> made_up() {
  return {{Rung::points, 1e-5, {}},
          {Rung::centres, 2e-5, {}},
          {Rung::rims, 2e-4, {}},
          {Rung::direct, 2e-3, {}}};
}

/// Bounds, and which of them were asked for.
struct Bounds {
  std::map<Rung, double> sigma_m = {
      {Rung::points, 5e-3}, {Rung::centres, 1e-3}, {Rung::rims, 5e-4}, {Rung::direct, 1e-4}};
  mutable std::vector<Rung> asked;

  double operator()(Rung rung) const {
    asked.push_back(rung);
    return sigma_m.at(rung);
  }
};

RungWish wish(std::optional<double> left_s, std::optional<double> target_sigma_m) {
  RungWish w;
  if (left_s) w.left_s = [left_s] { return *left_s; };
  w.target_sigma_m = target_sigma_m;
  return w;
}

TEST(ChooseRung, TakesTheCheapestThatMeetsATarget) {
  const std::pair<double, Rung> cases[] = {
      {6e-3, Rung::points}, {2e-3, Rung::centres}, {6e-4, Rung::rims}, {2e-4, Rung::direct}};
  for (const auto& [target_m, rung] : cases) {
    const Bounds bounds;
    const RungChoice choice = choose_rung(made_up(), wish({}, target_m), std::cref(bounds));
    EXPECT_EQ(choice.rung, rung);
    EXPECT_TRUE(choice.met);
    EXPECT_EQ(choice.predicted_sigma_m, bounds.sigma_m.at(rung));
    EXPECT_EQ(choice.alternatives.size(), 4u);
    EXPECT_EQ(bounds.asked.size(), static_cast<std::size_t>(rung) + 1) << "dearer ones were asked";
  }
}

TEST(ChooseRung, TakesTheMostAccurateWithinABudgetWithoutAskingForBounds) {
  const std::pair<double, Rung> cases[] = {
      {1e-5, Rung::points}, {1e-4, Rung::centres}, {1e-3, Rung::rims}, {1, Rung::direct}};
  for (const auto& [left_s, rung] : cases) {
    const Bounds bounds;
    const RungChoice choice = choose_rung(made_up(), wish(left_s, {}), std::cref(bounds));
    EXPECT_EQ(choice.rung, rung);
    EXPECT_TRUE(choice.met);
    EXPECT_TRUE(bounds.asked.empty());
  }
}

TEST(ChooseRung, WhenTheBudgetIsSpentTheCheapestIsTheBest) {
  for (const double left_s : {5e-6, 0.0, -1.0}) {
    for (const std::optional<double> target_m : {std::optional<double>(), {2e-3}}) {
      const RungChoice choice = choose_rung(made_up(), wish(left_s, target_m), Bounds());
      EXPECT_EQ(choice.rung, Rung::points);
      EXPECT_FALSE(choice.met);
      EXPECT_NE(choice.reason.find("0.01 ms"), std::string::npos) << choice.reason;
    }
  }
}

TEST(ChooseRung, WithBothTheCheapestThatMeetsTheTargetWithinTheBudget) {
  const RungChoice met = choose_rung(made_up(), wish(1e-3, 2e-3), Bounds());
  EXPECT_EQ(met.rung, Rung::centres);
  EXPECT_TRUE(met.met);

  const RungChoice dear = choose_rung(made_up(), wish(1e-3, 2e-4), Bounds());
  EXPECT_EQ(dear.rung, Rung::rims) << "the most accurate within the budget";
  EXPECT_FALSE(dear.met);
  for (const char* part : {"0.2 mm", "rims reaches 0.5 mm", "direct would take 2 ms", "1 ms"})
    EXPECT_NE(dear.reason.find(part), std::string::npos) << dear.reason;
}

TEST(ChooseRung, AnImpossibleTargetGetsTheMostAccurate) {
  Bounds bounds;
  const RungChoice choice = choose_rung(made_up(), wish({}, 1e-5), std::cref(bounds));
  EXPECT_EQ(choice.rung, Rung::direct);
  EXPECT_FALSE(choice.met);
  EXPECT_NE(choice.reason.find("direct reaches 0.1 mm"), std::string::npos) << choice.reason;

  bounds.sigma_m[Rung::direct] = never;  // nor is the last one always the best
  const RungChoice other = choose_rung(made_up(), wish({}, 1e-5), std::cref(bounds));
  EXPECT_EQ(other.rung, Rung::rims);
}

TEST(ChooseRung, LosesNoAccuracyWhenTheBudgetGrows) {
  for (const std::optional<double> target_m : {std::optional<double>(), {3e-4}}) {
    double sigma_m = never;
    for (double left_s = 1e-6; left_s < 1; left_s *= 1.3) {
      const Bounds bounds;
      const Rung rung = choose_rung(made_up(), wish(left_s, target_m), std::cref(bounds)).rung;
      EXPECT_LE(bounds.sigma_m.at(rung), sigma_m);
      sigma_m = bounds.sigma_m.at(rung);
    }
    EXPECT_EQ(sigma_m, 1e-4);
  }
}

TEST(ChooseRung, CostDecidesWhatIsCheapNotTheRungsOrder) {
  std::vector<RungForecast> forecasts = made_up();
  forecasts[0].predicted_s = 1;  // points, for once, are the dearest
  const RungChoice choice = choose_rung(forecasts, wish({}, 6e-3), Bounds());
  EXPECT_EQ(choice.rung, Rung::centres);
  EXPECT_EQ(choice.alternatives.back().rung, Rung::points);
  EXPECT_EQ(choose_rung(forecasts, wish(10, {}), Bounds()).rung, Rung::direct);
}

TEST(ChooseRung, ABoundThatTookTheRestOfTheBudgetCounts) {
  double left_s = 3e-4;
  RungWish w = wish({}, 6e-4);
  w.left_s = [&] { return left_s; };
  const Bounds bounds;
  const RungChoice choice = choose_rung(made_up(), w, [&](Rung rung) {
    left_s -= 1e-4;
    return bounds(rung);
  });
  EXPECT_EQ(choice.rung, Rung::centres) << "rims met the target, but there was no time any more";
  EXPECT_FALSE(choice.met);
}

TEST(ChooseRung, WithoutAWishTheFirstIsTaken) {
  const RungChoice choice = choose_rung({{Rung::rims, 2e-4, {}}}, {}, Bounds());
  EXPECT_EQ(choice.rung, Rung::rims);
  EXPECT_TRUE(choice.met);
  EXPECT_NE(test::complaint([] { choose_rung({}, {}, Bounds()); }).find("forecasts"),
            std::string::npos);
}

TEST(RungCosts, AddUpAndComeBackFromTheirFile) {
  const RungCost cost{1, 10, 100, 1000};
  EXPECT_EQ(cost.predicted_s({2, 3, 4}), 1 + 20 + 300 + 4000);
  RungCosts costs;
  costs.rims = {1.25e-6, 0, 3.3e-7, 1e-9};
  const test::Folder folder;
  const std::string path = (folder.path() / "costs.yaml").string();
  write_rung_costs(path, costs);
  EXPECT_TRUE(read_rung_costs(path) == costs);
  EXPECT_FALSE(RungCosts() == costs);
}

TEST(RungCosts, ComplainAboutWhatIsWrongByFileLineAndKey) {
  const std::string good = format_rung_costs({});
  const auto complaint = [](const std::string& text) {
    return test::complaint<std::runtime_error>([&] { parse_rung_costs(text, "c.yaml"); });
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  EXPECT_EQ(complaint(good), "");
  const std::pair<std::string, std::string> bad[] = {
      {with("libocc-costs/1", "libocc-costs/9"), "c.yaml:2: key `schema`"},
      {with("rims:", "rings:"), "unknown key `rings`"},
      {with("  per_lamp_s", "  per_lamp"), "c.yaml:5: unknown key `points.per_lamp`"},
      {with("fixed_s: ", "fixed_s: -"), "c.yaml:4: key `points.fixed_s`: must be zero or positive"},
      {with("fixed_s: ", "fixed_s: x"), "key `points.fixed_s`"},
      {with("fixed_s: ", "fixed_s: .inf #"), "key `points.fixed_s`"},
      {good.substr(0, good.find("direct:")), "key `direct` is missing"},
      {"schema: libocc-costs/1\npoints: 3\n", "points must be a mapping"},
      {"- 1", "the file must be a mapping"},
      {"", "the file must be a mapping"},
      {"a: [", "c.yaml"},
  };
  for (const auto& [text, part] : bad)
    EXPECT_NE(complaint(text).find(part), std::string::npos) << complaint(text) << "\n" << text;
  const std::string missing =
      test::complaint<std::runtime_error>([] { read_rung_costs("nowhere/costs.yaml"); });
  EXPECT_NE(missing.find("nowhere/costs.yaml"), std::string::npos);

  LocateOptions options;
  options.costs.direct.per_pixel_s = -1;
  EXPECT_NE(test::complaint([&] { options.validate(); }).find("costs.direct.per_pixel_s"),
            std::string::npos);
}

class LocateBudget : public ::testing::Test {
 protected:
  LocateBudget() : rendered_(simulate(scene_, truth_)) {}

  Result<Fix> located(const LocateOptions& options) const {
    return locate(rendered_.image.view(), scene_, options);
  }

  Scene scene_ = test::irregular_room();
  Rigid3 truth_ = look_at({2.1, 1.9, 0.5}, {2.3, 2.0, 3.0}, Eigen::Vector3d::UnitY());
  Rendered rendered_;
};

double sigma_m(const Fix& fix) { return std::sqrt(fix.position_covariance_m2.trace()); }

TEST_F(LocateBudget, WithoutOneTheOptionsRungIsTakenAndSaidSo) {
  for (const Rung rung : {Rung::points, Rung::centres, Rung::rims, Rung::direct}) {
    LocateOptions options;
    options.refine.rung = rung;
    const Result<Fix> fix = located(options);
    ASSERT_TRUE(fix.ok()) << fix.message;
    ASSERT_TRUE(fix->choice.has_value());
    EXPECT_EQ(fix->choice->rung, rung);
    EXPECT_GT(fix->choice->predicted_s, 0);
    EXPECT_TRUE(fix->choice->met);
    EXPECT_NE(fix->choice->reason.find(to_string(rung)), std::string::npos);
    ASSERT_TRUE(fix->choice->predicted_sigma_m.has_value());
    EXPECT_LE(*fix->choice->predicted_sigma_m, sigma_m(*fix) * (1 + 1e-9));
  }
}

TEST_F(LocateBudget, PlentyOfTimeBuysThePixels) {
  LocateOptions options;
  options.budget_s = 1e3;
  const Result<Fix> fix = located(options);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_EQ(fix->choice->rung, Rung::direct);
  LocateOptions direct;
  direct.refine.rung = Rung::direct;
  EXPECT_EQ(fix->position_m, located(direct)->position_m);
}

TEST_F(LocateBudget, TooLittleTimeGetsTheCheapestWithAStatus) {
  LocateOptions options;
  options.budget_s = 1e-9;
  // A busy machine may leave the search for poses no time at all; then the message says so.
  Result<Fix> fix = located(options);
  for (int attempt = 0; attempt < 100 && fix.status == Status::no_pose; ++attempt) {
    EXPECT_TRUE(fix->cut_short);
    EXPECT_NE(fix.message.find("the search"), std::string::npos) << fix.message;
    fix = located(options);
  }
  EXPECT_EQ(fix.status, Status::budget_not_met);
  EXPECT_EQ(fix.message.find(fix->choice->reason), 0u) << fix.message;
  EXPECT_NE(fix.message.find("the budget is spent"), std::string::npos) << fix.message;
  EXPECT_EQ(fix->choice->rung, Rung::points);
  EXPECT_LT((fix->position_m - truth_.origin_in_source()).norm(), 0.02);
}

TEST_F(LocateBudget, TheCostTableDecides) {
  LocateOptions options;
  options.budget_s = 100;
  options.costs.direct.fixed_s = 1e4;
  EXPECT_EQ(located(options)->choice->rung, Rung::rims);
  options.costs.rims.per_rim_point_s = 10;
  EXPECT_EQ(located(options)->choice->rung, Rung::centres);
}

TEST_F(LocateBudget, ATargetIsMetByTheCheapestRungThatDoes) {
  Rung before = Rung::points;
  bool changed = false;
  for (double target_m = 0.05; target_m > 1e-5; target_m /= 1.5) {
    LocateOptions options;
    options.target_sigma_m = target_m;
    const Result<Fix> fix = located(options);
    EXPECT_GE(fix->choice->rung, before) << "a harder target needs no cheaper rung";
    changed = changed || fix->choice->rung != Rung::points;
    before = fix->choice->rung;
    ASSERT_TRUE(fix->choice->predicted_sigma_m.has_value());
    if (fix.ok()) {
      EXPECT_LE(*fix->choice->predicted_sigma_m, target_m);
    } else {
      EXPECT_EQ(fix.status, Status::budget_not_met);
      EXPECT_GT(*fix->choice->predicted_sigma_m, target_m);
    }
  }
  EXPECT_TRUE(changed);
  EXPECT_EQ(before, Rung::direct);
}

TEST_F(LocateBudget, PredictsWhatTheFixThenSays) {
  for (const Rung rung : {Rung::centres, Rung::rims, Rung::direct}) {
    LocateOptions options;
    options.target_sigma_m = 1e-9;  // out of reach: all are predicted
    const Result<Fix> best = located(options);
    LocateOptions plain;
    plain.refine.rung = rung;
    const Result<Fix> fix = located(plain);
    for (const RungForecast& f : best->choice->alternatives) {
      if (f.rung != rung) continue;
      EXPECT_NEAR(*f.predicted_sigma_m / *fix->choice->predicted_sigma_m, 1, 0.1);
    }
  }
}

/// Points err by their bias mostly, which their covariance does not know.
TEST_F(LocateBudget, PredictsTheBiasOfPoints) {
  LocateOptions options;
  options.target_sigma_m = 1e-9;
  const RungForecast points = located(options)->choice->alternatives.front();
  ASSERT_EQ(points.rung, Rung::points);
  LocateOptions by_points;
  by_points.refine.rung = Rung::points;
  SimulateOptions silent;
  silent.noise = false;
  const Rendered clean = simulate(scene_, truth_, silent);
  const Result<Fix> fix = locate(clean.image.view(), scene_, by_points);
  const double error_m = (fix->position_m - truth_.origin_in_source()).norm();
  EXPECT_NEAR(*points.predicted_sigma_m / error_m, 1, 0.3);
}

TEST_F(LocateBudget, OffersNoPixelsWithoutAnImage) {
  const std::vector<Blob> blobs = located({})->blobs;
  LocateOptions options;
  options.budget_s = 1e3;
  EXPECT_EQ(locate(blobs, scene_, options)->choice->rung, Rung::rims);
  options.budget_s.reset();
  options.refine.rung = Rung::direct;
  EXPECT_EQ(locate(blobs, scene_, options)->choice->rung, Rung::rims);
}

TEST(LocateBudgetOfStripes, OffersNoPixelsOfBlinkingLamps) {
  const Scene scene = read_scene(LIBOCC_DATA "/scenes/coded_four.yaml");
  const Image image = read_image(LIBOCC_DATA "/images/coded_four_1.png");
  LocateOptions options;
  options.budget_s = 1e3;
  const Result<Fix> fix = locate(image.view(), scene, options);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_EQ(fix->choice->rung, Rung::rims);
}

TEST_F(LocateBudget, AmbiguityIsWorseThanAMissedBudget) {
  const Scene square = test::square_room();
  const Rigid3 pose = look_at({2.1, 1.9, 0.5}, {2.0, 2.0, 3.0}, Eigen::Vector3d::UnitY());
  LocateOptions options;
  options.target_sigma_m = 1e-9;
  const Result<Fix> fix = locate(simulate(square, pose).image.view(), square, options);
  EXPECT_EQ(fix.status, Status::ambiguous);
  EXPECT_FALSE(fix->choice->met);
}

TEST_F(LocateBudget, RefusesBudgetsThatAreNone) {
  for (const double bad : {0.0, -1.0, std::nan(""), never}) {
    LocateOptions budget, target;
    budget.budget_s = bad;
    target.target_sigma_m = bad;
    EXPECT_NE(test::complaint([&] { located(budget); }).find("budget_s"), std::string::npos);
    EXPECT_NE(test::complaint([&] { located(target); }).find("target_sigma_m"), std::string::npos);
  }
}

}  // namespace
}  // namespace occ
