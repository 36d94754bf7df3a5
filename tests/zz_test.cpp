// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/response.hpp"
#include "response_support.hpp"
#include "libocc/core/image_file.hpp"
#include <cstdio>
#include <chrono>
namespace occ {
TEST(ZZ, look) {
  for (Response kind : {Response::linear, Response::gamma, Response::srgb}) for (auto method: {ResponseMethod::levels, ResponseMethod::basis}) {
    Scene scene = test::wall_of_lamps(kind);
    double sumnees[5] = {}; double sumchi=0, sumdof=0; int runs = 10;
    const int at[5] = {20, 60, 100, 170, 230};
    for (int run = 0; run < runs; ++run) {
      auto s = test::exposure_series(scene, 5, 2, 1 + std::uint64_t(run));
      if (run == 0) { char name[50]; std::snprintf(name, 50, "/tmp/w/resp_%d.png", int(kind)); write_image(name, s.images[3].view()); }
      ResponseOptions o; o.method = method; if (method == ResponseMethod::basis) o.basis_functions = 5;
      auto t0 = std::chrono::steady_clock::now();
      auto r = recover_response(s.views(), s.exposures_s, o);
      double ms = 1e3*std::chrono::duration<double>(std::chrono::steady_clock::now()-t0).count();
      if (r.value.channels.empty()) { std::printf("%s\n", r.message.c_str()); break; }
      auto& c = r.value.channels[0];
      sumchi += c.chi2; sumdof += c.dof;
      if (run == 0) std::printf("kind %d method %d status %d %s ms %.1f obs %zu range %g %g proj %d\n", int(kind), int(method), int(r.status), r.message.c_str(), ms, c.residuals.size(), c.lowest_dn, c.highest_dn, c.projected);
      auto sig = c.sigma();
      auto truth = [&](double z){ return std::log(scene.sensor.linear_dn(z)); };
      int mid = 126; // level 127
      if (run == 0) { for (int k=3;k<254;k+=8) std::printf("%.3f ", c.log_exposure[k]-(truth(c.level_dn[k]) - truth(c.level_dn[mid]))); std::printf("\n"); }
      for (int i = 0; i < 5; ++i) {
        int k = at[i]-1; double e = c.log_exposure[k] - (truth(c.level_dn[k]) - truth(c.level_dn[mid]));
        sumnees[i] += e*e/sig[k]/sig[k];
        if (run == 0) std::printf("   z %g e %.4f sigma %.4f\n", c.level_dn[k], e, sig[k]);
      }
      if (run == 0) { auto t = c.table(); double w = 0; for (size_t i=0;i<t.size();++i){ double lin = double(i)/double(t.size()-1); double st = scene.sensor.grey_level(lin*255/scene.sensor.gain_dn_per_e)/255; w = std::max(w, std::abs(st-t[i])); } std::printf("  table worst %.4f\n", w);}
    }
    std::printf("  chi2/dof %.3f dof %.0f  nees", sumchi/sumdof, sumdof/runs); for (double n : sumnees) std::printf(" %.2f", n/runs); std::printf("\n");
  }
}
}
