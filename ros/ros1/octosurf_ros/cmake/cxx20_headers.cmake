# octosurf_cxx20_headers(TARGET): ROS' headers as they have to be for C++20. Those of Debian 12, messages and roscpp's
# own, ask allocators for their rebind, which C++20 has taken from them; those of ROS Noetic do not, and are left
# alone. What is put in its place names the same types, so that the libraries fit.
function(octosurf_cxx20_headers target)
  set(from ${OCTOSURF_ROS_PREFIX}/include)
  set(root ${CMAKE_CURRENT_BINARY_DIR}/${target})
  foreach(package actionlib actionlib_msgs dynamic_reconfigure geometry_msgs ros rosgraph_msgs roscpp sensor_msgs std_msgs
                  tf2_msgs visualization_msgs)
    file(GLOB headers RELATIVE ${from} ${from}/${package}/*.h)
    foreach(header ${headers})
      file(READ ${from}/${header} text)
      string(REGEX REPLACE "typename ContainerAllocator::template rebind<([^\n]*)>::other"
             "typename std::allocator_traits<ContainerAllocator>::template rebind_alloc<\\1>" new_text "${text}")
      if(NOT new_text STREQUAL text)
        string(REGEX REPLACE "#include \"([a-z0-9_]+\\.h)\"" "#include <${package}/\\1>" new_text "${new_text}")
        file(CONFIGURE OUTPUT ${root}/${header} CONTENT "${new_text}" @ONLY)
      endif()
    endforeach()
  endforeach()
  add_library(${target} INTERFACE)
  target_include_directories(${target} SYSTEM INTERFACE ${root})
endfunction()
