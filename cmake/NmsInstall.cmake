# install(): headers, libraries, the command and the CMake package `nms`.
include(CMakePackageConfigHelpers)

install(TARGETS nms_lang nms_compiler nms_program nms_runtime EXPORT nms-targets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(TARGETS nmsc RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
if(TARGET nmsc-fit)
  install(TARGETS nmsc-fit RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(DIRECTORY stdlib/ DESTINATION ${CMAKE_INSTALL_DATADIR}/nms/stdlib FILES_MATCHING PATTERN "*.nms" PATTERN "*.x3d")
# For `nmsc doc`, if scripts/viewer has been run.
install(FILES build/viewer/viewer.js build/viewer/viewer.LICENSE.txt DESTINATION ${CMAKE_INSTALL_DATADIR}/nms/viewer OPTIONAL)
install(FILES LICENSE NOTICE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(EXPORT nms-targets NAMESPACE nms:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nms)
configure_package_config_file(cmake/nms-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/nms-config.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nms
                              PATH_VARS CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/nms-config-version.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/nms-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/nms-config-version.cmake
              cmake/NmsLexicon.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nms)
