# SPDX-License-Identifier: Apache-2.0
# Errors of one line for what a build lacks: a compiler, or a library with its package.

# The space before the text prevents CMake from breaking the line.
function(libocc_fail what package)
  message(FATAL_ERROR " libocc: ${what} (Debian, Ubuntu: apt install ${package})")
endfunction()

# Enables C and C++ unless the including project has done so. Called after project(... LANGUAGES NONE),
# because project() alone reports a missing compiler in ten lines.
macro(libocc_enable_languages)
  include(CheckLanguage)
  foreach(language CXX C)
    if(NOT CMAKE_${language}_COMPILER_LOADED)
      check_language(${language})
      if(NOT CMAKE_${language}_COMPILER)
        if(language STREQUAL CXX AND DEFINED ENV{CXX})
          set(libocc_given " named by CXX=$ENV{CXX}")
        elseif(language STREQUAL C AND DEFINED ENV{CC})
          set(libocc_given " named by CC=$ENV{CC}")
        endif()
        string(REPLACE CXX C++ libocc_language ${language})
        libocc_fail("no working ${libocc_language} compiler${libocc_given}" g++)
      endif()
      enable_language(${language})
    endif()
  endforeach()
  if(NOT cxx_std_17 IN_LIST CMAKE_CXX_COMPILE_FEATURES)
    libocc_fail("${CMAKE_CXX_COMPILER} ${CMAKE_CXX_COMPILER_VERSION} does not support C++17" g++)
  endif()
endmacro()

# libocc_find(NAME MIN_VERSION DEBIAN_PACKAGE [arguments of find_package ...])
# finds a library; MIN_VERSION "" accepts any version. libocc_require_found() then reports all that are
# missing or too old, with their packages. Macros, because find_package() sets variables.
macro(libocc_find name min_version package)
  find_package(${name} ${min_version} QUIET ${ARGN})
  if(NOT ${name}_FOUND)
    string(JOIN ", " libocc_found ${${name}_CONSIDERED_VERSIONS} ${${name}_VERSION_STRING})
    if("${min_version}" STREQUAL "" OR libocc_found STREQUAL "")
      string(JOIN " " libocc_message ${name} ${min_version} "not found")
    else()
      set(libocc_message "${name} ${min_version} or newer is needed, found ${libocc_found}")
    endif()
    list(APPEND LIBOCC_MISSING "${libocc_message}")
    list(APPEND LIBOCC_MISSING_PACKAGES ${package})
  endif()
endmacro()

macro(libocc_require_found)
  if(LIBOCC_MISSING)
    list(JOIN LIBOCC_MISSING "; " libocc_message)
    list(JOIN LIBOCC_MISSING_PACKAGES " " libocc_packages)
    libocc_fail("${libocc_message}" "${libocc_packages}")
  endif()
endmacro()
