# Public headers speak Eigen and the standard library only.
foreach(header ${HEADERS})
  execute_process(COMMAND ${COMPILER} -std=c++20 -M -I ${INCLUDE} -I ${EIGEN} -x c++ ${INCLUDE}/${header}
                  OUTPUT_VARIABLE included COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[^ \\\\\n]*/(CGAL|pcl[^/]*|octomap|octomath|boost|tsl|embree[34]|assimp|google|nlohmann|CLI)/[^ \\\\\n]*"
         foreign "${included}")
  if(foreign)
    message(SEND_ERROR "${header} includes ${foreign}")
  endif()
endforeach()
