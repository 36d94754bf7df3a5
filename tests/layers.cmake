# SPDX-License-Identifier: Apache-2.0
# The layout of the sources holds, and the check would notice if it did not; each public header
# compiles alone.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(check_layers ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/check_layers)
add_test(NAME Layers.Hold COMMAND ${check_layers})
set_tests_properties(Layers.Hold PROPERTIES LABELS fast)

# A tree with one file of two lines, the second of which is at fault.
function(add_planted_violation name file line message)
  set(planted ${CMAKE_CURRENT_BINARY_DIR}/layers/${name})
  file(WRITE ${planted}/${file} "// a planted violation\n${line}\n")
  add_test(NAME Layers.Refuse${name} COMMAND ${check_layers} --partial ${planted})
  set_tests_properties(Layers.Refuse${name} PROPERTIES LABELS fast
    PASS_REGULAR_EXPRESSION "${file}:[12]: .*${message}")
endfunction()

add_planted_violation(Upwards detect/spot.cpp "#include \"libocc/pose/solver.hpp\""
                      "detect may include only from: radiometry core")
add_planted_violation(Neighbour simulate/render.hpp "  # include <libocc/detect/detect.hpp>"
                      "simulate may include only from")
add_planted_violation(HiddenLibrary refine/cost.hpp "#include <ceres/tiny_solver.h>"
                      "may not show this library")
add_planted_violation(HiddenImageLibrary core/image_file.hpp "#include <png.h>"
                      "may not show this library")
add_planted_violation(RelativePath camera/lens.cpp "#include \"../scene/scene.hpp\""
                      "write it as libocc/MODULE/FILE")
add_planted_violation(InternalInPublic scene/scene.hpp
                      "#include \"libocc/camera/internal/distortion.hpp\""
                      "a public header may not include an internal one")
add_planted_violation(HeaderNotInstalled detect/stripes/lines.hpp "namespace occ {"
                      "not installed: move it to detect/ or detect/internal/")
add_planted_violation(InternalInOcc detect/internal/rim.hpp "namespace occ {"
                      "the namespace of this header is occ::internal::detect")
add_planted_violation(PublicInInternal detect/detect.hpp "namespace occ::internal::detect {"
                      "the namespace of this header is occ")

file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/layers/SharedName/core/blob.hpp
     "namespace occ {\nstruct RimPoint {\n};\n}\n")
add_planted_violation(SharedName formation/internal/rim.hpp "class RimPoint final : public Point {"
                      "another type is called RimPoint: .*core/blob.hpp:2")

add_test(NAME Layers.RefuseUnusedEntry
         COMMAND ${check_layers} ${CMAKE_CURRENT_BINARY_DIR}/layers/Neighbour)
set_tests_properties(Layers.RefuseUnusedEntry PROPERTIES LABELS fast
  PASS_REGULAR_EXPRESSION "simulate does not include camera: remove it from INCLUDES")

add_test(NAME Layers.ViolationIsAFailure
         COMMAND ${check_layers} --partial ${CMAKE_CURRENT_BINARY_DIR}/layers/Upwards)
set_tests_properties(Layers.ViolationIsAFailure PROPERTIES LABELS fast WILL_FAIL TRUE)

# Comments and names are in plain English, and the check would notice if they were not.
set(check_language ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/check_language)
add_test(NAME Language.Holds COMMAND ${check_language})
set_tests_properties(Language.Holds PROPERTIES LABELS fast)

function(add_planted_text name line message)
  set(planted ${CMAKE_CURRENT_BINARY_DIR}/language/${name}.hpp)
  file(WRITE ${planted} "// Blobs of an image.\n\n${line}\n")
  add_test(NAME Language.Refuse${name} COMMAND ${check_language} ${planted})
  set_tests_properties(Language.Refuse${name} PROPERTIES LABELS fast
    PASS_REGULAR_EXPRESSION "${name}.hpp:3: .*${message}")
endfunction()

add_planted_text(Fragment "// Of these points but one." "begins with the fragment 'Of'")
add_planted_text(MemberFragment "int x = 0.  ///< of the blob" "begins with the fragment 'of'")
string(CONCAT limit "le" "ast_radius_px")
add_planted_text(Limit "double ${limit} = 1." "call the limit ${limit} max_ or min_")
string(CONCAT metaphor "Bal" "lot")
add_planted_text(Metaphor "class ${metaphor} {}." "'${metaphor}': use the field's term")

file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/language/Escaped.hpp
     "// Blobs.\n\nint most_significant = 0.  // language: ok (the most significant bit)\n")
add_test(NAME Language.EscapeIsAccepted
         COMMAND ${check_language} ${CMAKE_CURRENT_BINARY_DIR}/language/Escaped.hpp)
set_tests_properties(Language.EscapeIsAccepted PROPERTIES LABELS fast)

# Every public declaration has a comment, and the check would notice if one had not.
set(check_comments ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/check_comments)
add_test(NAME Comments.AreComplete COMMAND ${check_comments})
set_tests_properties(Comments.AreComplete PROPERTIES LABELS fast)

file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/comments/Some.hpp
"namespace occ {
/// A point.
struct Point {
  double x = 0, y = 0;  ///< [m]
  double z = 0;
  bool finite() const { return true; }
  ~Point();

 private:
  int hidden_ = 0;
};
namespace internal {
class Hidden;
}
enum class Colour {
  red,    ///< 700 nm
  green,
};
class Line {
 public:
  Line(const Line& other);
  std::vector<Point> points() const;

 private:
  int hidden_ = 0;
};
LIBOCC_API Point crossing(const Line& a,
                          const Line& b);
}  // namespace occ
")
add_test(NAME Comments.MissingOnesAreFound
         COMMAND ${check_comments} ${CMAKE_CURRENT_BINARY_DIR}/comments/Some.hpp)
string(CONCAT missing "^[^\n]*Some.hpp:5: no comment: double z[^\n]*\n"
                      "[^\n]*:6: no comment: bool finite[^\n]*\n"
                      "[^\n]*:15: no comment: enum class Colour[^\n]*\n"
                      "[^\n]*:17: no comment: green[^\n]*\n"
                      "[^\n]*:19: no comment: class Line[^\n]*\n"
                      "[^\n]*:22: no comment: std::vector[^\n]*\n"
                      "[^\n]*:27: no comment: LIBOCC_API Point crossing[^\n]*\n$")
set_tests_properties(Comments.MissingOnesAreFound PROPERTIES LABELS fast
  PASS_REGULAR_EXPRESSION "${missing}")
add_test(NAME Comments.MissingOneIsAFailure
         COMMAND ${check_comments} ${CMAKE_CURRENT_BINARY_DIR}/comments/Some.hpp)
set_tests_properties(Comments.MissingOneIsAFailure PROPERTIES LABELS fast WILL_FAIL TRUE)

# Every public header by itself, as the first include of a source. Headers that include others of the
# library get Eigen/Core by core/abi.hpp in any case, which is most of their time: it is precompiled.
file(GLOB public_headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}
     ${PROJECT_SOURCE_DIR}/libocc/*/*.hpp ${PROJECT_SOURCE_DIR}/libocc/pose/solvers/*.hpp)
set(header_sources "")
foreach(header ${public_headers})
  string(REPLACE "/" "_" name ${header})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/headers/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "#include \"${header}\"\n#include \"${header}\"\n" @ONLY)
  list(APPEND header_sources ${source})
  file(STRINGS ${PROJECT_SOURCE_DIR}/${header} includes REGEX "#include \"libocc/" LIMIT_COUNT 1)
  if(NOT includes)
    set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
  endif()
endforeach()
add_library(public_headers OBJECT ${header_sources})
target_link_libraries(public_headers PRIVATE libocc libocc_warnings)
target_compile_options(public_headers PRIVATE -O0)
target_precompile_headers(public_headers PRIVATE <Eigen/Core>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  # Without these two, ccache keeps no object that uses a precompiled header.
  target_compile_options(public_headers PRIVATE -fpch-preprocess)
  set_target_properties(public_headers PROPERTIES CXX_COMPILER_LAUNCHER
    "${CMAKE_COMMAND};-E;env;CCACHE_SLOPPINESS=pch_defines,time_macros;${CMAKE_CXX_COMPILER_LAUNCHER}")
endif()
