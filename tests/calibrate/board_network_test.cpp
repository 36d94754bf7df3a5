// SPDX-License-Identifier: Apache-2.0
// Calibration from images with known size of the tags or of the board's squares: rendered tags seen
// by a pinhole camera and by a rotating line camera, and OpenCV's example chessboards, where
// cv::calibrateCamera is the oracle.
#include "libocc/calibrate/board_network.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>

#include "libocc/calibrate/lamp_network.hpp"
#include "libocc/calibrate/resection.hpp"
#include "libocc/calibrate/start_network.hpp"
#include "libocc/camera/rotating_line.hpp"
#include "libocc/core/image_file.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/landmarks/chessboard.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/precision.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"
#include "tests/support/target_fields.hpp"

namespace occ::test {
namespace {

std::vector<Image> photographed(const TargetField& field, const Camera& camera,
                                const std::vector<Rigid3>& poses, double noise_dn = 2,
                                std::uint64_t seed = 0) {
  std::vector<Image> images;
  for (const Rigid3& pose : poses) {
    TargetImageOptions options;
    options.noise_dn = noise_dn;
    options.seed = seed;
    options.frame = static_cast<std::uint32_t>(images.size());
    images.push_back(render_targets(field, camera, pose, options));
  }
  return images;
}

std::vector<TagImage> tags_in(const std::vector<Image>& images,
                              const AprilTagOptions& options = {}) {
  std::vector<TagImage> found;
  for (const Image& image : images)
    found.push_back({"picture " + std::to_string(found.size() + 1), 0,
                     detect_april_tags(image.view(), options)});
  return found;
}

std::vector<PlaneView> views_of(const std::vector<TagImage>& images) {
  std::vector<PlaneView> views;
  for (const TagImage& image : images)
    for (const AprilTag& tag : image.tags) views.push_back(plane_view(tag));
  return views;
}

// Adjusts a network from its start values.
Adjustment calibrated(const NetworkCamera& camera, const std::vector<TagImage>& images,
                      double tag_size_m) {
  StartOptions options;
  options.tag_size_m = tag_size_m;
  const Result<NetworkStart> start = start_network({camera}, images, options);
  EXPECT_TRUE(start.ok()) << start.message;
  EXPECT_EQ(start->network.images.size(), images.size());
  const Result<Adjustment> adjusted = adjust(start->network);
  EXPECT_TRUE(adjusted.ok()) << adjusted.message;
  return *adjusted;
}

// Repeats the adjustment with corners measured again by the calibrated lens.
Adjustment calibrated_again(const Adjustment& first, const std::vector<Image>& images,
                            double tag_size_m) {
  const NetworkCamera& camera = first.network.cameras[0];
  AprilTagOptions known;
  known.bends_px = side_bends(camera.camera);
  return calibrated(camera, tags_in(images, known), tag_size_m);
}

double sigma_of(const Adjustment& adjusted, int parameter) {
  const Result<Precision> precise = precision(adjusted.network);
  EXPECT_TRUE(precise.ok()) << precise.message;
  return std::sqrt(precise->parameters(0)(parameter, parameter));
}

struct Errors {
  Eigen::VectorXd off;
  Eigen::MatrixXd covariance;
};

Errors errors_of(const Adjustment& adjusted, const Camera& truth) {
  const Result<Precision> precise = precision(adjusted.network);
  EXPECT_TRUE(precise.ok()) << precise.message;
  const NetworkCamera& camera = adjusted.network.cameras[0];
  const std::vector<CameraParameter> found = camera.camera.parameters(), right = truth.parameters();
  Errors errors;
  errors.covariance = precise->parameters(0);
  errors.off.resize(errors.covariance.rows());
  for (std::size_t i = 0; i < camera.free_parameters.size(); ++i)
    for (std::size_t k = 0; k < right.size(); ++k)
      if (right[k].name == camera.free_parameters[i])
        errors.off[static_cast<Eigen::Index>(i)] = found[k].value - right[k].value;
  return errors;
}

// Expects every free parameter within four sigmas of the truth.
void expect_camera(const Adjustment& adjusted, const Camera& truth) {
  EXPECT_GT(adjusted.sigma0, 0.4);
  EXPECT_LT(adjusted.sigma0, 1.5);
  const Errors e = errors_of(adjusted, truth);
  for (Eigen::Index i = 0; i < e.off.size(); ++i)
    EXPECT_LT(std::abs(e.off[i]), 4 * std::sqrt(e.covariance(i, i)))
        << adjusted.network.cameras[0].free_parameters[i] << " off by " << e.off[i];
  const auto n = static_cast<double>(e.off.size());
  EXPECT_LT(test::nees(e.off, e.covariance), n + 4 * std::sqrt(2 * n));
}

TEST(CalibrateImages, APinholeFromTwelveImagesOfFifteenTags) {
  const Camera truth = Camera::pinhole(1000, 800, 905, 902, 503, 394, {-0.12, 0.05, 4e-4, -3e-4});
  const TargetField field = tags_on_a_wall(5, 3);
  std::vector<Rigid3> poses;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * pi * i / 12;
    poses.push_back(towards_wall(
        {1.3 * std::cos(angle), -1.5 - 0.2 * (i % 3), 0.9 * std::sin(angle)}, 0.5 * pi * (i % 4)));
  }
  const std::vector<Image> pictures = photographed(field, truth, poses);
  const std::vector<TagImage> images = tags_in(pictures);
  const Result<Camera> about = start_pinhole(views_of(images), truth.width(), truth.height());
  ASSERT_TRUE(about.ok()) << about.message;
  const Camera camera =
      Camera::pinhole(truth.width(), truth.height(), about->fx_px(), about->fx_px(), about->cx_px(),
                      about->cy_px(), {0, 0, 0, 0});
  const Adjustment first =
      calibrated({"camera", camera, {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2"}},
                 images, 0.16);
  EXPECT_EQ(first.network.bodies.size(), 15u);
  expect_camera(first, truth);
  const Adjustment second = calibrated_again(first, pictures, 0.16);
  expect_camera(second, truth);
  for (const int k : {0, 1, 2, 3}) EXPECT_LT(sigma_of(second, k), 0.8 * sigma_of(first, k)) << k;
}

// Twelve cameras with an approximately known lens: their errors match the predicted sigmas.
TEST(SlowCalibrateImages, ErrorsOfCamerasMatchTheirSigmas) {
  const Camera truth = Camera::pinhole(1000, 800, 905, 902, 503, 394, {-0.12, 0.05, 4e-4, -3e-4});
  std::vector<Rigid3> poses;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * pi * i / 12;
    poses.push_back(towards_wall(
        {1.3 * std::cos(angle), -1.5 - 0.2 * (i % 3), 0.9 * std::sin(angle)}, 0.5 * pi * (i % 4)));
  }
  AprilTagOptions known;
  known.bends_px = side_bends(truth);
  constexpr int trials = 12;
  double normalised = 0;
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    const auto pictures = photographed(tags_on_a_wall(5, 3), truth, poses, 6, seed);
    const Errors e = errors_of(
        calibrated({"camera", truth, {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2"}},
                   tags_in(pictures, known), 0.16),
        truth);
    normalised += test::nees(e.off, e.covariance);
  }
  normalised /= 8 * trials;
  EXPECT_GT(normalised, 0.55);
  EXPECT_LT(normalised, 1.45);
}

TEST(CalibrateImages, AFisheyeFromTwelveImages) {
  const Camera truth =
      Camera::fisheye(1000, 1000, 380, 381.5, 503, 494, {0.03, -0.006, 0.001, -2e-4});
  std::vector<Rigid3> poses;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * pi * i / 12;
    poses.push_back(towards_wall(
        {0.9 * std::cos(angle), -0.85 - 0.1 * (i % 3), 0.6 * std::sin(angle)}, 0.5 * pi * (i % 4)));
  }
  const std::vector<TagImage> images = tags_in(photographed(tags_on_a_wall(5, 3), truth, poses));
  const Result<Camera> about = start_focal_length(
      views_of(images), Camera::fisheye(1000, 1000, 318, 318, 499.5, 499.5, {0, 0, 0, 0}));
  ASSERT_TRUE(about.ok()) << about.message;
  expect_camera(
      calibrated({"camera", *about, {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "k3", "k4"}},
                 images, 0.16),
      truth);
}

// Printed discs, detected as blobs and assigned by their approximate positions. Centres are
// corrected for the perspective shift of ellipse centres. The map has errors of a centimetre and is
// estimated.
TEST(CalibrateImages, APinholeAndAMapFromCircularTargets) {
  const Camera truth = Camera::pinhole(1000, 800, 905, 902, 503, 394, {-0.12, 0.05, 4e-4, -3e-4});
  TargetField field;
  Scene about;
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    CircularTarget disc;
    disc.id = i;
    disc.radius_m = 0.035;
    disc.centre_m = {0.28 * (i % 5 - 2), i % 3 == 0 ? -0.12 : 0, 0.28 * (i / 5 - 1.5)};
    disc.normal = -Eigen::Vector3d::UnitY();
    field.circles.push_back(disc);
    Lamp lamp = disc_lamp(i, disc.centre_m + 0.01 * random_vector(random), disc.radius_m);
    lamp.normal = disc.normal;
    lamp.x_axis = Eigen::Vector3d::UnitX();
    about.lamps.push_back(lamp);
  }
  std::vector<SurveyImage> images;
  for (int i = 0; i < 10; ++i) {
    const double angle = 2 * pi * i / 10;
    const Rigid3 pose = towards_wall(
        {1.1 * std::cos(angle), -1.3 - 0.2 * (i % 3), 0.8 * std::sin(angle)}, 0.5 * pi * (i % 4));
    TargetImageOptions options;
    options.noise_dn = 2;
    options.ground_dn = options.black_dn;
    options.frame = static_cast<std::uint32_t>(i);
    const TargetRenderer renderer(field, truth, pose, options);
    const Image picture = renderer.window({0, 0, truth.width(), truth.height()});
    SurveyImage image;
    image.name = "picture " + std::to_string(i + 1);
    for (const Blob& blob : detect(picture.view()))
      for (const CircleTruth& disc : renderer.truth().circles)
        if (disc.whole && (blob.centroid_px - disc.image_centre_px).norm() < 5)
          image.lamps.push_back({disc.id, blob.centroid_px, blob.covariance_px2});
    images.push_back(image);
  }
  NetworkCamera camera{"camera",
                       Camera::pinhole(1000, 800, 880, 880, 499.5, 399.5, {0, 0, 0, 0}),
                       {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2"}};
  Adjustment adjusted;
  for (int pass = 0; pass < 2;
       ++pass) {  // the second pass corrects ellipses with the estimated camera and map
    const Result<NetworkStart> start = lamp_network({camera}, about, images);
    ASSERT_TRUE(start.ok()) << start.message;
    EXPECT_EQ(start->network.points.size(), 20u);
    const Result<Adjustment> found = adjust(start->network);
    ASSERT_TRUE(found.ok()) << found.message;
    adjusted = *found;
    camera.camera = adjusted.network.cameras[0].camera;
    for (const NetworkPoint& point : adjusted.network.points)
      about.lamps[std::stoul(point.name.substr(5))].centre_m = point.position_m;
  }
  expect_camera(adjusted, truth);
}

// Five panoramas of a room; the start camera assumes only square pixels.
void calibrate_line(const RotatingLine& line, double tag_size_m, bool again) {
  const Camera truth = Camera::rotating_line(line);
  const TargetField field = tags_in_a_room(tag_size_m, 8);
  std::vector<Rigid3> poses;
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(2, 2, 1.4),
                                    {4.2, 1.8, 1.2},
                                    {3.8, 3.4, 1.6},
                                    {1.9, 3.3, 1.5},
                                    {3, 2.5, 1.3}})
    poses.push_back(upright_line(at, 1.3 * at.x(), 0.03 * std::sin(5 * at.y())));
  const std::vector<Image> pictures = photographed(field, truth, poses);
  RotatingLine ideal;
  ideal.width = line.width;
  ideal.height = line.height;
  ideal.c_px = line.width / (2 * pi);  // square pixels at the horizon
  ideal.cy_px = 0.5 * (line.height - 1);
  std::vector<std::string> free;
  const Camera start_camera = Camera::rotating_line(ideal);
  for (const CameraParameter& parameter : start_camera.parameters())
    if (parameter.name != "ez_m" && parameter.name.find("tumbling") == std::string::npos &&
        parameter.name[0] != 'T')
      free.push_back(parameter.name);
  const Adjustment first =
      calibrated({"camera", start_camera, free}, tags_in(pictures), tag_size_m);
  EXPECT_GE(first.network.bodies.size(), 25u);
  expect_camera(first, truth);
  if (again) expect_camera(calibrated_again(first, pictures, tag_size_m), truth);
}

TEST(CalibrateImages, ARotatingLineFromFivePanoramas) {
  calibrate_line(small_line(3000, 800), 0.3, false);
}

TEST(SlowCalibrateImages, ARotatingLineFromFiveLargePanoramas) {
  calibrate_line(small_line(6000, 1500), 0.25, true);
}

// Images of Debian's package opencv-doc: a 9 x 6 chessboard, left01 to left14 without 10.
std::vector<std::string> example_pictures() {
  std::vector<std::string> names;
  for (int i = 1; i <= 14; ++i) {
    const std::string name = std::string("/usr/share/doc/opencv-doc/examples/data/left") +
                             (i < 10 ? "0" : "") + std::to_string(i) + ".jpg";
    if (std::ifstream(name).good()) names.push_back(name);
  }
  return names;
}

TEST(CalibrateImages, OpencvsExampleChessboardsAsOpencvDoes) {
  const std::vector<std::string> names = example_pictures();
  if (names.size() != 13) GTEST_SKIP() << "package opencv-doc is not installed";
  constexpr double square_m = 0.025;
  const Eigen::Matrix3Xd board = chessboard_points(9, 6, square_m);
  std::vector<BoardImage> images;
  std::vector<std::vector<cv::Point3f>> object_points;
  std::vector<std::vector<cv::Point2f>> image_points;
  int width = 0, height = 0;
  for (const std::string& name : names) {
    const Image image = read_image(name);
    width = image.width;
    height = image.height;
    const auto corners = find_chessboard(image.view());
    ASSERT_TRUE(corners) << name;
    BoardImage board_image;
    board_image.name = name.substr(name.rfind('/') + 1);
    object_points.emplace_back();
    image_points.emplace_back();
    // The oracle computes in single precision, so both get pixels rounded to it.
    board_image.px = corners->px.cast<float>().cast<double>();
    for (Eigen::Index k = 0; k < board.cols(); ++k) {
      object_points.back().emplace_back(static_cast<float>(board(0, k)),
                                        static_cast<float>(board(1, k)), 0.F);
      image_points.back().emplace_back(static_cast<float>(board_image.px(0, k)),
                                       static_cast<float>(board_image.px(1, k)));
    }
    images.push_back(board_image);
  }
  cv::Mat matrix, distortion;
  std::vector<cv::Mat> turns, shifts;
  const double rms = cv::calibrateCamera(
      object_points, image_points, {width, height}, matrix, distortion, turns, shifts, 0,
      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 500, 1e-14));
  const Result<Camera> about = start_pinhole(board, images, width, height);
  ASSERT_TRUE(about.ok()) << about.message;
  const Camera camera = Camera::pinhole(width, height, about->fx_px(), about->fx_px(),
                                        about->cx_px(), about->cy_px(), {0, 0, 0, 0, 0});
  const std::vector<std::string> free{"fx_px", "fy_px", "cx_px", "cy_px", "k1",
                                      "k2",    "p1",    "p2",    "k3"};
  const Result<NetworkStart> start = board_network({{"left", camera, free}}, board, images, 0.2);
  ASSERT_TRUE(start.ok()) << start.message;
  AdjustOptions plain;  // as the oracle: no rejection of gross errors
  plain.robust = plain.snooping = false;
  const Result<Adjustment> adjusted = adjust(start->network, plain);
  ASSERT_TRUE(adjusted.ok()) << adjusted.message;
  const Result<Precision> precise = precision(adjusted->network);
  ASSERT_TRUE(precise.ok()) << precise.message;
  const Eigen::MatrixXd covariance =
      precise->scaled(adjusted->sigma0 * adjusted->sigma0).parameters(0);
  const double oracle[9] = {
      matrix.at<double>(0, 0),  matrix.at<double>(1, 1),  matrix.at<double>(0, 2),
      matrix.at<double>(1, 2),  distortion.at<double>(0), distortion.at<double>(1),
      distortion.at<double>(2), distortion.at<double>(3), distortion.at<double>(4)};
  const std::vector<CameraParameter> found = adjusted->network.cameras[0].camera.parameters();
  for (int i = 0; i < 9; ++i)
    for (const CameraParameter& parameter : found) {
      if (parameter.name != free[i]) continue;
      EXPECT_NEAR(parameter.value, oracle[i], 0.1 * std::sqrt(covariance(i, i))) << parameter.name;
    }
  const double residual_px =
      adjusted->sigma0 * 0.2 *
      std::sqrt(2.0 * adjusted->redundancy / static_cast<double>(adjusted->observations));
  EXPECT_NEAR(residual_px, rms, 1e-4);
}

}  // namespace
}  // namespace occ::test
