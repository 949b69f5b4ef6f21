# octosurf_ros_messages(TARGET FOLDER…): library TARGET with the C++ headers of the .msg and .srv files of packages, whose
# names are those of their FOLDERs, as gencpp writes them in a catkin workspace. The caller has set where ROS is:
# OCTOSURF_ROS_PREFIX, GENCPP_BIN and GENCPP_TEMPLATE_DIR.
find_program(OCTOSURF_ROS_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)  # Debian's, which has ROS' modules
if(NOT OCTOSURF_ROS_PYTHON)
  set(OCTOSURF_ROS_PYTHON python3)
endif()

function(octosurf_ros_messages target)
  set(root ${CMAKE_CURRENT_BINARY_DIR}/${target})
  set(paths -Istd_msgs:${OCTOSURF_ROS_PREFIX}/share/std_msgs/msg
            -Igeometry_msgs:${OCTOSURF_ROS_PREFIX}/share/geometry_msgs/msg)
  set(all_files)
  foreach(folder ${ARGN})
    get_filename_component(package ${folder} NAME)
    list(APPEND paths -I${package}:${folder}/msg)
    file(GLOB files CONFIGURE_DEPENDS ${folder}/msg/*.msg ${folder}/srv/*.srv)
    list(APPEND all_files ${files})
  endforeach()
  set(headers)
  foreach(file ${all_files})
    get_filename_component(name ${file} NAME_WE)
    get_filename_component(folder ${file} DIRECTORY)
    get_filename_component(folder ${folder} DIRECTORY)
    get_filename_component(package ${folder} NAME)
    set(header ${root}/${package}/${name}.h)
    # A message's sum depends on those that it is made of.
    add_custom_command(OUTPUT ${header} DEPENDS ${all_files} VERBATIM
      COMMAND ${OCTOSURF_ROS_PYTHON} ${GENCPP_BIN} ${file} ${paths} -p ${package} -o ${root}/${package}
              -e ${GENCPP_TEMPLATE_DIR}
      COMMENT "Generating C++ of ${package}/${name}")
    list(APPEND headers ${header})
  endforeach()
  add_custom_target(${target}_headers DEPENDS ${headers})
  add_library(${target} INTERFACE)
  add_dependencies(${target} ${target}_headers)
  target_include_directories(${target} SYSTEM INTERFACE ${root})
endfunction()
