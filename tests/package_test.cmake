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
