# install, export, find_package(octosurf). What was not built is left out, and named.
if(NOT OCTOSURF_INSTALL)
  return()
endif()
include(CMakePackageConfigHelpers)
set(OCTOSURF_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/octosurf)

get_property(components GLOBAL PROPERTY OCTOSURF_COMPONENTS)
foreach(component ${components})
  install(TARGETS octosurf_component_${component} EXPORT octosurf-${component}-targets OPTIONAL)
endforeach()
install(TARGETS octosurf EXPORT octosurf-octosurf-targets)
foreach(component ${components} octosurf)
  install(EXPORT octosurf-${component}-targets NAMESPACE octosurf:: DESTINATION ${OCTOSURF_CMAKE_DIR})
endforeach()
# CMake installs these files of a library that is not there, too, and who includes one fails.
foreach(component ${components})
  install(CODE "
    if(NOT EXISTS \"$<TARGET_FILE:octosurf_component_${component}>\")
      message(STATUS \"Not built, so not installed: octosurf::${component}\")
      file(GLOB targets \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${OCTOSURF_CMAKE_DIR}/octosurf-${component}-targets*.cmake\")
      file(REMOVE \${targets})
    endif()")
endforeach()
install(DIRECTORY include/octosurf DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN *.hpp)
configure_package_config_file(cmake/octosurf-config.cmake.in octosurf-config.cmake
  INSTALL_DESTINATION ${OCTOSURF_CMAKE_DIR})
# Before 1.0 a minor version may break what compiled against the one before.
write_basic_package_version_file(octosurf-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/octosurf-config.cmake ${PROJECT_BINARY_DIR}/octosurf-config-version.cmake
        DESTINATION ${OCTOSURF_CMAKE_DIR})
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

if(OCTOSURF_BUILD_APPS)
  install(TARGETS octosurf_app octosurf_lab_app OPTIONAL)
  foreach(program octosurf octosurf_lab)
    install(CODE "
      if(NOT EXISTS \"$<TARGET_FILE:${program}_app>\")
        message(STATUS \"Not built, so not installed: the command $<TARGET_FILE_NAME:${program}_app>\")
      endif()")
  endforeach()
  install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DATADIR}/octosurf USE_SOURCE_PERMISSIONS PATTERN __pycache__ EXCLUDE)
  install(DIRECTORY workflow DESTINATION ${CMAKE_INSTALL_DATADIR}/octosurf USE_SOURCE_PERMISSIONS)
endif()

# All that ./dev package packs.
add_custom_target(octosurf_package)
foreach(target octosurf_app octosurf_lab_app octosurf_python)
  if(TARGET ${target})
    add_dependencies(octosurf_package ${target})
  endif()
endforeach()
foreach(component ${components})
  add_dependencies(octosurf_package octosurf_component_${component})
endforeach()
