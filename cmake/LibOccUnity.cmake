# SPDX-License-Identifier: Apache-2.0
# libocc_compile_together(LIST NAME SOURCE...) replaces the sources in LIST by one that includes them.
# Unlike CMake's UNITY_BUILD it names them relative to the project, so ccache finds the object of
# another build folder or checkout.
function(libocc_compile_together list name)
  list(LENGTH ARGN count)
  if(count LESS 2)
    return()
  endif()
  set(content "")
  foreach(source ${ARGN})
    file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${source})
    string(APPEND content "#include \"${path}\"\n")
  endforeach()
  libocc_replace_sources(${list} ${name} "${content}" ${ARGN})
  set(${list} ${${list}} PARENT_SCOPE)
endfunction()

# libocc_compile_tests_together(LIST NAME SOURCE...) does the same for tests, in groups of at most six,
# since GCC's time grows with the square of the types of Eigen. Helpers may have equal names: all
# headers are included first, then each source in a namespace named after it. There, the namespaces
# that the source opens, such as occ::test, are new ones, in which the names of the real ones are visible.
function(libocc_compile_tests_together list name)
  list(LENGTH ARGN count)
  math(EXPR groups "(${count} + 5) / 6")
  math(EXPR size "(${count} + ${groups} - 1) / ${groups}")
  set(number 0)
  set(rest ${ARGN})
  while(rest)
    list(SUBLIST rest 0 ${size} group)
    list(REMOVE_ITEM rest ${group})
    set(headers "")
    set(content "")
    foreach(source ${group})
      file(STRINGS ${source} includes REGEX "^#include ")
      list(APPEND headers ${includes})
      libocc_test_in_namespace(${source} text)
      string(APPEND content "${text}")
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${source})
    endforeach()
    list(REMOVE_DUPLICATES headers)
    list(SORT headers)
    list(JOIN headers "\n" headers)
    libocc_replace_sources(${list} ${name}_${number} "${headers}\nnamespace occ::test {}\n${content}" ${group})
    math(EXPR number "${number} + 1")
  endwhile()
  set(${list} ${${list}} PARENT_SCOPE)
endfunction()

# libocc_test_in_namespace(SOURCE VARIABLE) sets VARIABLE to text that includes SOURCE in a namespace.
function(libocc_test_in_namespace source variable)
  get_filename_component(space ${source} NAME_WE)
  set(text "namespace ${space} {\n")
  file(STRINGS ${source} opened REGEX "^namespace occ[a-z0-9_:]* {")
  foreach(namespace occ::test ${opened})
    string(REGEX REPLACE "namespace | {" "" namespace ${namespace})
    while(namespace)  # occ::internal::core, then occ::internal, then occ
      string(APPEND text "namespace ${namespace} {\nusing namespace ::${namespace};\n}\n")
      string(REGEX REPLACE "(::|^)[a-z0-9_]+$" "" namespace "${namespace}")
    endwhile()
  endforeach()
  file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${source})
  set(${variable} "${text}#include \"${path}\"\n}\n" PARENT_SCOPE)
endfunction()

# libocc_replace_sources(LIST NAME CONTENT SOURCE...) replaces the sources in LIST by one with CONTENT.
function(libocc_replace_sources list name content)
  set(together ${CMAKE_CURRENT_BINARY_DIR}/together/${name}.cpp)
  file(CONFIGURE OUTPUT ${together} CONTENT "${content}" @ONLY)
  set(sources ${${list}})
  list(REMOVE_ITEM sources ${ARGN})
  set(${list} ${sources} ${together} PARENT_SCOPE)
endfunction()
