# Installs the build to a prefix of its own and builds and runs a user's project against it.
file(REMOVE_RECURSE ${WORK})
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --config ${CONFIG} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${PROJECT} -B ${WORK}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=${CONFIG}
    -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${WORK}/build)

foreach(program floor everything)
  execute_process(COMMAND ${WORK}/build/${program} OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  message("${output}")
  # 2 m × 2 m less what the outermost voxels' centroids lack; one polygon; upward, toward the sensor.
  if(NOT output MATCHES "^surface 1: (3\\.[89][0-9]|4\\.0[0-9]) m², 1 polygons, normal z 1\\.000\n$")
    message(FATAL_ERROR "${program}: expected one horizontal surface of 4 m²")
  endif()
endforeach()
if(EXISTS ${WORK}/prefix/bin/octosurf)
  run(${WORK}/prefix/bin/octosurf --help)
endif()
