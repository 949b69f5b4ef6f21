# Public headers speak Eigen and the standard library only.
list(TRANSFORM HEADERS PREPEND "-include;${INCLUDE}/")
execute_process(COMMAND ${COMPILER} -std=c++20 -M -I ${INCLUDE} -I ${EIGEN} -x c++ ${HEADERS} /dev/null
                OUTPUT_VARIABLE included COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^ \\\\\n]*/(CGAL|pcl[^/]*|octomap|octomath|boost|tsl|embree[34]|assimp|google|nlohmann|CLI)/[^ \\\\\n]*"
       foreign "${included}")
if(foreign)
  message(SEND_ERROR "a public header includes ${foreign}")
endif()
