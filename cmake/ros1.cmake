# OCTOSURF_BUILD_ROS1; AUTO is on where what it takes is there (ros1_packages of ./dev), and looks again each time, as
# the packages may be installed after a first build. By pkg-config: the CMake packages of ROS are catkin's, which would
# take over the whole build.
set(OCTOSURF_BUILD_ROS1 AUTO CACHE STRING "Build the node of ROS 1: ON, OFF, or AUTO: where there is ROS 1")
set(octosurf_ros1_modules roscpp tf2_ros dynamic_reconfigure sensor_msgs geometry_msgs std_msgs visualization_msgs
  gencpp)
pkg_get_variable(octosurf_ros1_prefix roscpp prefix)
if(NOT octosurf_ros1_prefix)
  # Debian 13's .pc files say "prefix=${roscpp_PREFIX}", which nothing defines.
  set(octosurf_ros1_prefix /usr)
  list(APPEND PKG_CONFIG_ARGN --define-variable=prefix=${octosurf_ros1_prefix})
endif()
if(OCTOSURF_BUILD_ROS1 STREQUAL AUTO)
  set(OCTOSURF_BUILD_ROS1 OFF)  # hides the cache's
  if(PROJECT_IS_TOP_LEVEL)
    pkg_check_modules(ros1 QUIET IMPORTED_TARGET ${octosurf_ros1_modules})
    if(ros1_FOUND AND OCTOSURF_BUILD_OCTOMAP AND OCTOSURF_BUILD_PCL)  # which the node links
      set(OCTOSURF_BUILD_ROS1 ON)
    endif()
  endif()
endif()
if(OCTOSURF_BUILD_ROS1)
  pkg_check_modules(ros1 REQUIRED IMPORTED_TARGET ${octosurf_ros1_modules})
  message(STATUS "octosurf: node of ROS 1 (roscpp ${ros1_roscpp_VERSION})")
elseif(PROJECT_IS_TOP_LEVEL)
  message(STATUS "octosurf: no node of ROS 1 (OCTOSURF_BUILD_ROS1; ros1_packages of ./dev say what it needs)")
endif()
