# One room of the house: a library nms::<name>, its headers in a file set, its tests beside its sources.
include(GNUInstallDirs)

# What holds for every target of the project.
function(nms_settings target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  # No contraction to FMA: the same bits on every processor.
  target_compile_options(${target} PRIVATE -ffp-contract=off -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                           -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast)
  # g++ 12 sees overlapping copies in std::string's own operator+ (GCC bug 105651).
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  if(NMS_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# The headers that nearly every source includes, read once (NMS_PRECOMPILE). It saves the sanitizers' build a third; the
# other builds do without, so that a source that forgets an include is seen. `kind` is rooms or tests.
function(nms_precompiled target kind)
  if(NOT NMS_PRECOMPILE)
    return()
  endif()
  if(NOT TARGET nms_headers_of_${kind})
    set(source "${PROJECT_BINARY_DIR}/nms_headers_of_${kind}.cpp")
    file(CONFIGURE OUTPUT "${source}" CONTENT "")
    add_library(nms_headers_of_${kind} OBJECT "${source}")
    nms_settings(nms_headers_of_${kind})
    set(headers <algorithm> <array> <cmath> <cstdint> <cstring> <map> <memory> <optional> <set> <span> <string>
                <string_view> <unordered_map> <utility> <vector> <fmt/format.h>)
    if(kind STREQUAL "tests")
      list(APPEND headers <filesystem> <fstream> <random> <sstream> <gtest/gtest.h>)
      target_link_libraries(nms_headers_of_tests PRIVATE GTest::gtest)
    endif()
    target_link_libraries(nms_headers_of_${kind} PRIVATE fmt::fmt)
    target_precompile_headers(nms_headers_of_${kind} PRIVATE ${headers})
  endif()
  target_precompile_headers(${target} REUSE_FROM nms_headers_of_${kind})
endfunction()

# nms_room(<name> SOURCES ... HEADERS ... LINK ...)
function(nms_room name)
  cmake_parse_arguments(arg "" "" "SOURCES;HEADERS;LINK;PRIVATE_LINK" ${ARGN})
  add_library(nms_${name} STATIC ${arg_SOURCES})
  add_library(nms::${name} ALIAS nms_${name})
  nms_settings(nms_${name})
  set_target_properties(nms_${name} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON)
  target_sources(nms_${name} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${arg_HEADERS})
  target_link_libraries(nms_${name} PUBLIC ${arg_LINK} PRIVATE ${arg_PRIVATE_LINK})
  target_include_directories(nms_${name} PRIVATE src)
  if(fmt::fmt IN_LIST arg_LINK)
    nms_precompiled(nms_${name} rooms)
  endif()
endfunction()

# nms_test(<name> SOURCES ... LINK ... [COST n]): one GoogleTest program. Its tests begin before those of less cost: the
# long ones first, so that none is left to run alone at the end.
function(nms_test name)
  if(NOT NMS_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(arg "" "COST" "SOURCES;LINK" ${ARGN})
  if(NOT arg_COST)
    set(arg_COST 0)
  endif()
  add_executable(${name} ${arg_SOURCES})
  nms_settings(${name})
  # A test's own code is run once: the compiler's work on it is worth more than its speed.
  target_compile_options(${name} PRIVATE -Wno-sign-compare $<$<CONFIG:Release>:-O1>)
  target_link_libraries(${name} PRIVATE ${arg_LINK} GTest::gtest_main)
  target_include_directories(${name} PRIVATE src)
  target_compile_definitions(${name} PRIVATE NMS_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  # Sweeps of many alike cases take fewer of them there: tests/under_sanitizers.h.
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=[a-z,]*address")
    target_compile_definitions(${name} PRIVATE NMS_UNDER_SANITIZERS=1)
  endif()
  nms_precompiled(${name} tests)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES COST ${arg_COST})
endfunction()

# nms_fuzz(<name> SOURCES ... LINK ...): one libFuzzer program.
function(nms_fuzz name)
  if(NOT NMS_BUILD_FUZZ)
    return()
  endif()
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  nms_settings(${name})
  target_link_libraries(${name} PRIVATE ${arg_LINK} -fsanitize=fuzzer)
  target_include_directories(${name} PRIVATE src)
  nms_precompiled(${name} rooms)
endfunction()
