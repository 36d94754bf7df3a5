// SPDX-License-Identifier: Apache-2.0
// Writes the camera's pose in every image of a folder as a trajectory in TUM format:
//   follow_folder SCENE.yaml FOLDER FRAMES_PER_SECOND > walk.tum
// Exit code 0: at least one image has a pose; 1: none has; 2: a file or an argument is wrong.
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <set>
#include <vector>

#include "libocc/core/image_file.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/scene/trajectory.hpp"
#include "libocc/track/tracker.hpp"

namespace {

/// Follows the images in the order of their names. A file that is not an image of the camera's size
/// is reported and skipped; its time passes.
std::vector<occ::Waypoint> follow(occ::Tracker& tracker, const char* folder, double rate_hz) {
  std::set<std::filesystem::path> files;  // sorted by name
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.insert(entry.path());
  std::vector<occ::Waypoint> walk;
  int count = 0;
  for (const auto& file : files) {
    const double time_s = count++ / rate_hz;
    try {
      const occ::Image image = occ::read_image(file.string());
      const auto frame = tracker.add_image(image.view(), time_s);
      std::cerr << time_s << " s " << to_string(frame.state) << ' ' << frame.reason << '\n';
      if (frame.state == occ::TrackerState::tracking)
        walk.push_back({time_s, frame.cam_from_world});
    } catch (const std::exception& error) {  // not an image, or of another size
      std::cerr << time_s << " s skipped " << file.filename().string() << ": " << error.what()
                << '\n';
    }
  }
  return walk;
}

}  // namespace

int main(int argc, char** argv) try {
  const double rate_hz = argc == 4 ? std::atof(argv[3]) : 0;  // 0 if it is no number
  if (!(rate_hz > 0)) {
    std::cerr << "usage: follow_folder SCENE.yaml FOLDER FRAMES_PER_SECOND\n";
    return 2;
  }
  occ::Tracker tracker(occ::read_scene(argv[1]));
  const std::vector<occ::Waypoint> walk = follow(tracker, argv[2], rate_hz);
  if (walk.empty()) return 1;
  std::cout << occ::format_trajectory(occ::Trajectory(walk));
} catch (const std::exception& error) {
  std::cerr << "error: " << error.what() << '\n';
  return 2;
}
