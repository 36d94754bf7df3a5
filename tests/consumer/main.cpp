// SPDX-License-Identifier: Apache-2.0
// A program as a user would write it: a room, a picture of its lamps, and where it was taken.
#include <cstdio>
#include <libocc/geometry/rigid.hpp>
#include <libocc/locate/locate.hpp>
#include <libocc/simulate/simulate.hpp>

namespace {

occ::Lamp lamp(int id, double x_m, double y_m, double z_m) {
  occ::Lamp lamp;
  lamp.id = id;
  lamp.centre_m = {x_m, y_m, z_m};
  lamp.radius_m = 0.085;
  lamp.power_w = 1.5;
  return lamp;
}

}  // namespace

int main() {
  occ::Scene scene;
  scene.camera = occ::Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  scene.lamps = {lamp(0, 0.9, 1.0, 3), lamp(1, 3.1, 1.2, 3),   lamp(2, 1.2, 3.2, 3),
                 lamp(3, 2.8, 2.7, 3), lamp(4, 2.05, 1.85, 3), lamp(5, 1.5, 2.3, 2.6)};
  const Eigen::Vector3d position_m(1.9, 2.1, 0.4);
  const occ::Rigid3 pose = occ::look_at(position_m, {2.1, 2.2, 3}, {0, 1, 0});

  const occ::Rendered rendered = occ::simulate(scene, pose);
  const occ::Result<occ::Fix> fix = occ::locate(rendered.image.view(), scene);
  const double error_m = (fix->position_m - position_m).norm();
  std::printf("%s, %zu lamps, %.3f mm from the truth\n", occ::to_string(fix.status),
              fix->lamps.size(), 1e3 * error_m);
  return fix.ok() && error_m < 0.01 ? 0 : 1;
}
