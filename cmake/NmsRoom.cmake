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
endfunction()

# nms_test(<name> SOURCES ... LINK ...): one GoogleTest program.
function(nms_test name)
  if(NOT NMS_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  nms_settings(${name})
  target_compile_options(${name} PRIVATE -Wno-sign-compare)
  target_link_libraries(${name} PRIVATE ${arg_LINK} GTest::gtest_main)
  target_include_directories(${name} PRIVATE src)
  target_compile_definitions(${name} PRIVATE NMS_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60)
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
endfunction()
