# SPDX-License-Identifier: Apache-2.0
# Each folder includes only from the folders below it, and the check would notice if not.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(check_layers ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/check_layers)
add_test(NAME Layers.Hold COMMAND ${check_layers})
set_tests_properties(Layers.Hold PROPERTIES LABELS fast)

function(add_planted_violation name file line message)
  set(planted ${CMAKE_CURRENT_BINARY_DIR}/layers/${name})
  file(WRITE ${planted}/${file} "// a planted violation\n${line}\n")
  add_test(NAME Layers.Refuse${name} COMMAND ${check_layers} ${planted})
  set_tests_properties(Layers.Refuse${name} PROPERTIES LABELS fast
    PASS_REGULAR_EXPRESSION "${file}:2: .*${message}")
endfunction()

add_planted_violation(Upwards detect/spot.cpp "#include \"libocc/pose/p3p.hpp\""
                      "detect may include only from: codes radiometry core")
add_planted_violation(Neighbour simulate/render.hpp "  # include <libocc/detect/detect.hpp>"
                      "simulate may include only from")
add_planted_violation(HiddenLibrary refine/cost.hpp "#include <ceres/tiny_solver.h>"
                      "may not show this library")
add_planted_violation(RelativePath camera/lens.cpp "#include \"../scene/scene.hpp\""
                      "write it as libocc/FOLDER/FILE")
add_planted_violation(Internals scene/reader.cpp
                      "#include \"libocc/camera/internal/distortion.hpp\"" "internal to camera")

add_test(NAME Layers.ViolationIsAFailure
         COMMAND ${check_layers} ${CMAKE_CURRENT_BINARY_DIR}/layers/Upwards)
set_tests_properties(Layers.ViolationIsAFailure PROPERTIES LABELS fast WILL_FAIL TRUE)
