// SPDX-License-Identifier: Apache-2.0
// Prints the position of the camera that took a picture:
//   locate_picture SCENE.yaml IMAGE
// Exit code 0: one pose; 1: no pose, or several; 2: a file is wrong.
#include <cmath>
#include <exception>
#include <iostream>

#include "libocc/core/image_file.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/scene/scene_file.hpp"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: locate_picture SCENE.yaml IMAGE\n";
    return 2;
  }
  const occ::Scene scene = occ::read_scene(argv[1]);
  const occ::Image image = occ::read_image(argv[2]);
  const occ::Result<occ::Fix> fix = occ::locate(image.view(), scene);
  std::cout << to_string(fix.status) << ' ' << fix.message << '\n';
  for (const occ::Candidate& pose : fix->candidates) {  // best first; several if ambiguous
    std::cout << "position " << pose.position_m.transpose() << " m, lamps";
    for (const auto& [id, blob] : pose.lamps) std::cout << ' ' << id;
    std::cout << ", residuals " << pose.rms_px << " px\n";
  }
  if (!fix.ok()) return 1;
  std::cout << "standard deviation " << std::sqrt(fix->position_covariance_m2.trace()) << " m\n";
} catch (const std::exception& error) {
  std::cerr << "error: " << error.what() << '\n';
  return 2;
}
