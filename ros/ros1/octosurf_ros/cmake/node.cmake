# octosurf_ros_node(TARGET): the node's program, with the messages of packages that Debian has not. What it is
# linked with is the caller's to say: octosurf, ROS and octosurf_msgs.
include(${CMAKE_CURRENT_LIST_DIR}/messages.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/cxx20_headers.cmake)
set(OCTOSURF_ROS_DIR ${CMAKE_CURRENT_LIST_DIR}/..)
get_filename_component(OCTOSURF_ROS_DIR ${OCTOSURF_ROS_DIR} ABSOLUTE)

function(octosurf_ros_node target)
  set(foreign)
  foreach(package octomap_msgs grid_map_msgs jsk_recognition_msgs convex_plane_decomposition_msgs)
    list(APPEND foreign ${OCTOSURF_ROS_DIR}/foreign_msgs/${package})
  endforeach()
  octosurf_ros_messages(${target}_foreign_messages ${foreign})
  octosurf_cxx20_headers(${target}_cxx20_headers)
  set(sources)
  foreach(name main answers mapper_node pose_lookup publisher questions scan_queue scan_intake settings surface_messages
               terrain_messages)
    list(APPEND sources ${OCTOSURF_ROS_DIR}/src/${name}.cpp)
  endforeach()
  add_executable(${target} ${sources})
  target_compile_features(${target} PRIVATE cxx_std_20)
  target_link_libraries(${target} PRIVATE ${target}_foreign_messages ${target}_cxx20_headers)
endfunction()
