# SPDX-License-Identifier: Apache-2.0
# The library as an installed package: a project that uses it builds and runs, with and without
# AVX2; a build whose Eigen would not match the library's is refused; only occ's symbols show.
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
