# SPDX-License-Identifier: Apache-2.0
# The library as a package. Installed: a project that finds it by CMake or pkg-config builds and runs,
# with and without AVX2; a build whose Eigen would not match the library's is refused; only occ's
# symbols show. As sources: a project that includes them configures, and its settings stay as they are.
set(prefix ${CMAKE_CURRENT_BINARY_DIR}/package/prefix)
add_test(NAME Package.Installs
         COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${prefix})
set_tests_properties(Package.Installs PROPERTIES FIXTURES_SETUP installed LABELS fast)

function(add_consumer_test name flags run)
  set(build ${CMAKE_CURRENT_BINARY_DIR}/package/${name})
  if(run)
    set(run_it --test-command ${build}/consumer)
  endif()
  add_test(NAME Package.${name}
           COMMAND ${CMAKE_CTEST_COMMAND} --build-and-test
                   ${CMAKE_CURRENT_SOURCE_DIR}/consumer ${build}
                   --build-generator ${CMAKE_GENERATOR} --build-options
                   -Dlibocc_DIR=${prefix}/${CMAKE_INSTALL_LIBDIR}/cmake/libocc
                   -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
                   -DCMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
                   -DCMAKE_CXX_FLAGS=${flags} ${run_it})
  set_tests_properties(Package.${name} PROPERTIES FIXTURES_REQUIRED installed LABELS fast)
endfunction()

file(STRINGS /proc/cpuinfo has_avx2 REGEX avx2 LIMIT_COUNT 1)
add_consumer_test(ConsumerRuns "" TRUE)
add_consumer_test(ConsumerRunsWithAvx2 -march=x86-64-v3 "${has_avx2}")

get_target_property(eigen_include Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
add_test(NAME Package.RefusesAnotherEigenLayout
         COMMAND ${CMAKE_CXX_COMPILER} -std=c++17 -march=x86-64-v3 -fsyntax-only -I${prefix}/include
                 -I${eigen_include} ${CMAKE_CURRENT_SOURCE_DIR}/consumer/main.cpp)
set_tests_properties(Package.RefusesAnotherEigenLayout PROPERTIES
  FIXTURES_REQUIRED installed LABELS fast PASS_REGULAR_EXPRESSION "error.*libocc: compile with")

# Symbols beside occ's would clash with another Ceres, OpenCV or yaml-cpp in the same process.
set(only_ours "/ occ::/ {ours = 1} !/ occ::/ {print; foreign = 1} END {exit foreign || !ours}")
add_test(NAME Package.ExportsItsOwnSymbolsOnly
         COMMAND sh -c "'${CMAKE_NM}' -DC --defined-only '$<TARGET_FILE:libocc>' | awk '${only_ours}'")
set_tests_properties(Package.ExportsItsOwnSymbolsOnly PROPERTIES LABELS fast)

# The install tree lies elsewhere than CMAKE_INSTALL_PREFIX: libocc.pc has no absolute paths.
find_program(PKG_CONFIG pkg-config)
if(PKG_CONFIG)
  set(libdir ${prefix}/${CMAKE_INSTALL_LIBDIR})
  set(program ${CMAKE_CURRENT_BINARY_DIR}/package/pkg_config_consumer)
  set(march "")
  if(has_avx2)
    set(march -march=x86-64-v3)
  endif()
  string(CONCAT compile "flags=$(PKG_CONFIG_PATH='${libdir}/pkgconfig' '${PKG_CONFIG}' --cflags --libs libocc)"
         " && ${CMAKE_CXX_COMPILER_LAUNCHER} '${CMAKE_CXX_COMPILER}' -std=c++17 ${march} -c -o '${program}.o'"
         " '${CMAKE_CURRENT_SOURCE_DIR}/consumer/main.cpp' $flags"
         " && '${CMAKE_CXX_COMPILER}' -o '${program}' '${program}.o' $flags -Wl,-rpath,'${libdir}' && '${program}'")
  add_test(NAME Package.PkgConfigConsumerRuns COMMAND sh -c "${compile}")
  set_tests_properties(Package.PkgConfigConsumerRuns PROPERTIES
    FIXTURES_REQUIRED installed LABELS fast SKIP_REGULAR_EXPRESSION "eigen3.*not found")
endif()

# One object file shows that a user of the sources gets include directories, definitions and C++17. The
# library itself is not built, which would take minutes.
foreach(fetch OFF ON)
  set(name AddSubdirectory)
  if(fetch)
    set(name FetchContent)
  endif()
  set(build ${CMAKE_CURRENT_BINARY_DIR}/package/${name})
  add_test(NAME Package.${name}LeavesTheProjectAsItIs
           COMMAND ${CMAKE_CTEST_COMMAND} --build-and-test
                   ${CMAKE_CURRENT_SOURCE_DIR}/subproject ${build} --build-generator Ninja
                   --build-target CMakeFiles/consumer.dir/main.cpp.o --build-options
                   -DLIBOCC_SOURCE=${PROJECT_SOURCE_DIR} -DFETCH=${fetch}
                   -DLIBOCC_OPENCV=${LIBOCC_OPENCV} -DLIBOCC_OPENGV=${LIBOCC_OPENGV}
                   -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER})
  set_tests_properties(Package.${name}LeavesTheProjectAsItIs PROPERTIES LABELS fast)
endforeach()

# Configuring without OpenCV and OpenGV needs neither; what a build lacks is an error of one line.
function(add_configure_test name)
  add_test(NAME Build.${name}
           COMMAND ${CMAKE_COMMAND} -G Ninja -S ${PROJECT_SOURCE_DIR}
                   -B ${CMAKE_CURRENT_BINARY_DIR}/package/${name} ${ARGN})
  set_tests_properties(Build.${name} PROPERTIES LABELS fast)
endfunction()

add_configure_test(WithoutOpencvAndOpengv -DLIBOCC_OPENCV=OFF -DLIBOCC_OPENGV=OFF
                   -DCMAKE_DISABLE_FIND_PACKAGE_OpenCV=ON -DCMAKE_DISABLE_FIND_PACKAGE_opengv=ON)
add_configure_test(MissingLibrariesNameTheirPackages -DCMAKE_DISABLE_FIND_PACKAGE_apriltag=ON
                   -DCMAKE_DISABLE_FIND_PACKAGE_TIFF=ON)
set_tests_properties(Build.MissingLibrariesNameTheirPackages PROPERTIES PASS_REGULAR_EXPRESSION
  "libocc: apriltag 3.3 not found; TIFF 4.5 not found \\(Debian, Ubuntu: apt install libapriltag-dev libtiff-dev\\)")
add_configure_test(MissingCompilerIsNamed)
set_tests_properties(Build.MissingCompilerIsNamed PROPERTIES
  ENVIRONMENT CXX=/nosuch/c++
  PASS_REGULAR_EXPRESSION "libocc: no working C\\+\\+ compiler named by CXX=/nosuch/c\\+\\+")
