# Installs the build into a folder of its own and builds tests/package against it.
#   cmake -DBUILD=... -DSOURCE=... -DFLAGS=... -DCOMPILER=... -P package_test.cmake
set(prefix "${BUILD}/package_test/prefix")
set(consumer "${BUILD}/package_test/build")
file(REMOVE_RECURSE "${BUILD}/package_test")
execute_process(COMMAND "${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${prefix}" OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${CMAKE_COMMAND}" -G Ninja -S "${SOURCE}/tests/package" -B "${consumer}"
                        "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_FLAGS=${FLAGS}"
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${CMAKE_COMMAND}" --build "${consumer}" COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${consumer}/uses_nms" COMMAND_ERROR_IS_FATAL ANY)
if(NOT EXISTS "${prefix}/bin/nmsc")
  message(FATAL_ERROR "the command was not installed")
endif()

# A lexicon as assets, with the installed function: built once, then only when what it uses changes.
set(assets "${BUILD}/package_test/assets")
file(COPY "${SOURCE}/examples/lexicon_assets" DESTINATION "${BUILD}/package_test")
execute_process(COMMAND "${CMAKE_COMMAND}" -G Ninja -S "${BUILD}/package_test/lexicon_assets" -B "${assets}"
                        "-DCMAKE_PREFIX_PATH=${prefix}" COMMAND_ERROR_IS_FATAL ANY)
function(build_assets wanted)
  execute_process(COMMAND "${CMAKE_COMMAND}" --build "${assets}" OUTPUT_VARIABLE said ERROR_VARIABLE said
                  COMMAND_ERROR_IS_FATAL ANY)
  if(NOT said MATCHES "${wanted}")
    message(FATAL_ERROR "building the lexicon said\n${said}\nand not ${wanted}")
  endif()
endfunction()
build_assets("2 of 2 entries made anew")
build_assets("no work to do")
if(NOT EXISTS "${assets}/house/ask.glb" OR NOT EXISTS "${assets}/house/manifest.json")
  message(FATAL_ERROR "the lexicon's files are not there")
endif()
file(READ "${BUILD}/package_test/lexicon_assets/poses.nms" poses)
string(REPLACE "50% AU4" "40% AU4" poses "${poses}")
file(WRITE "${BUILD}/package_test/lexicon_assets/poses.nms" "${poses}")
build_assets("1 of 2 entries made anew")
