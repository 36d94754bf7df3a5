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
  set(together ${CMAKE_CURRENT_BINARY_DIR}/together/${name}.cpp)
  file(CONFIGURE OUTPUT ${together} CONTENT "${content}" @ONLY)
  set(sources ${${list}})
  list(REMOVE_ITEM sources ${ARGN})
  set(${list} ${sources} ${together} PARENT_SCOPE)
endfunction()
