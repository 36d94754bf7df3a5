// SPDX-License-Identifier: Apache-2.0
// Check of the binary interface; every public header includes it.
//
// Eigen's alignment and allocation must be the same in the library, in the packaged OpenGV that it
// links, and in your code. With other settings (for example -march=x86-64-v3 without the two
// definitions below) heap memory is freed by the wrong function and the program crashes.
// CMake and pkg-config set both definitions. The check tests the values that Eigen uses, so the
// order of includes does not matter.
#pragma once

#include <Eigen/Core>

#if EIGEN_MAX_ALIGN_BYTES != 16 || EIGEN_MALLOC_ALREADY_ALIGNED != 1
#error \
    "libocc: compile with -DEIGEN_MAX_ALIGN_BYTES=16 -DEIGEN_MALLOC_ALREADY_ALIGNED=1 \
(find_package(libocc) and libocc::libocc do); any other Eigen layout would crash at run time"
#endif

#if defined(_WIN32)
#error "libocc: only ELF platforms are supported"
#elif defined(LIBOCC_BUILDING)
#define LIBOCC_API __attribute__((visibility("default")))
#else
#define LIBOCC_API
#endif
