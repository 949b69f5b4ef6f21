# Debian/Ubuntu packages only; each with what it is used for and where. What makes the wheel: pyproject.toml and
# test/peers/requirements-wheel.txt.
find_package(Eigen3 REQUIRED NO_MODULE)                # everywhere: vectors and poses
find_package(Threads REQUIRED)                         # src/core, src/check, apps
set(CMAKE_POLICY_DEFAULT_CMP0167 NEW)                  # CGAL finds Boost by a module that CMake gives up
# src/core/geometry: triangulation, polyline simplification; lab: arrangements; test: Boolean operations, the twin of
# outlines; bench: detection of shapes (GPL parts)
find_package(CGAL REQUIRED)
# Headers. src/core: container, crc, string algorithms; src/planning: container, polygon; src/footsteps: container; src/io:
# archive iterators, mp11; apps/serve: asio and beast, for HTTP; lab, test: geometry; bindings: preprocessor
find_package(Boost REQUIRED CONFIG)
find_package(tsl-robin-map REQUIRED)                   # src/core, src/footsteps: hash maps
if(OCTOSURF_BUILD_IO)
  find_package(nlohmann_json REQUIRED)                   # src/io, apps, lab: JSON
  find_package(Protobuf REQUIRED)                        # src/io: the .surfaces schema, messages in .mcap
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(lzf REQUIRED IMPORTED_TARGET liblzf)  # src/io: compressed PCD
  pkg_check_modules(spng REQUIRED IMPORTED_TARGET spng)  # src/io, lab: PNG
  pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd)  # src/io: .surfaces, .mcap, bags
  find_package(ZLIB REQUIRED)                            # src/io: maps inside a page, check sums
  pkg_check_modules(lz4 REQUIRED IMPORTED_TARGET liblz4)  # src/io: bags
  find_package(BZip2 REQUIRED)                           # src/io: bags of ROS 1
  find_package(SQLite3 REQUIRED)                         # src/io: bags of ROS 2
endif()
if(OCTOSURF_BUILD_APPS OR OCTOSURF_BUILD_TESTS)
  find_package(assimp REQUIRED)                        # lab: terrain meshes; test/io: what export wrote
  find_package(embree 4 QUIET)                         # lab: ray casting
  if(NOT embree_FOUND)
    find_package(embree 3 REQUIRED)
  endif()
endif()
if(OCTOSURF_BUILD_APPS)
  find_package(CLI11 REQUIRED)                         # apps, lab: command lines
endif()
find_package(octomap QUIET)
if(OCTOSURF_BUILD_OCTOMAP STREQUAL AUTO)
  set(OCTOSURF_BUILD_OCTOMAP OFF)  # hides the cache's
  if(octomap_FOUND AND OCTOSURF_BUILD_IO)
    set(OCTOSURF_BUILD_OCTOMAP ON)
  endif()
endif()
if(OCTOSURF_BUILD_OCTOMAP)
  # src/octomap, adapters, apps: octomap::OcTree; test: the twin of the octree. OctoMap hands out variables; as a target its
  # headers are system headers.
  find_package(octomap REQUIRED)
  add_library(octosurf_liboctomap INTERFACE)
  target_include_directories(octosurf_liboctomap SYSTEM INTERFACE ${OCTOMAP_INCLUDE_DIRS})
  target_link_libraries(octosurf_liboctomap INTERFACE ${OCTOMAP_LIBRARIES})
  target_compile_definitions(octosurf_liboctomap INTERFACE OCTOMAP_NODEBUGOUT)  # the library does not print
endif()
# src/pcl: the paper's detector; adapters; bench: planes. Not by find_package(PCL): that one pulls in VTK, Qt and MPI,
# which none of the parts used here needs.
find_path(PCL_INCLUDE_DIR pcl/point_types.h PATH_SUFFIXES pcl-1.15 pcl-1.14 pcl-1.13 pcl-1.12)
if(OCTOSURF_BUILD_PCL STREQUAL AUTO)
  set(OCTOSURF_BUILD_PCL OFF)
  find_library(PCL_segmentation_LIBRARY pcl_segmentation)
  if(PCL_INCLUDE_DIR AND PCL_segmentation_LIBRARY)
    set(OCTOSURF_BUILD_PCL ON)
  endif()
endif()
if(OCTOSURF_BUILD_OCTOMAP AND NOT OCTOSURF_BUILD_IO)
  message(FATAL_ERROR "octosurf::octomap reads and writes .ot files by octosurf::io: set OCTOSURF_BUILD_IO to ON.")
endif()
if(NOT (OCTOSURF_BUILD_IO AND OCTOSURF_BUILD_OCTOMAP AND OCTOSURF_BUILD_PCL) AND
   (OCTOSURF_BUILD_APPS OR OCTOSURF_BUILD_TESTS))
  message(FATAL_ERROR "The command, the node and the tests take OctoMap (liboctomap-dev) and PCL (libpcl-dev); without "
    "them set OCTOSURF_BUILD_APPS, OCTOSURF_BUILD_TESTS and OCTOSURF_BUILD_BENCH to OFF.")
endif()
if(OCTOSURF_BUILD_PCL OR OCTOSURF_BUILD_TESTS)
  function(octosurf_pcl_target target)
    add_library(${target} INTERFACE)
    target_include_directories(${target} SYSTEM INTERFACE ${PCL_INCLUDE_DIR})
    target_link_libraries(${target} INTERFACE Eigen3::Eigen Boost::headers)
    foreach(part ${ARGN})
      find_library(PCL_${part}_LIBRARY pcl_${part} REQUIRED)
      target_link_libraries(${target} INTERFACE ${PCL_${part}_LIBRARY})
    endforeach()
  endfunction()
  octosurf_pcl_target(octosurf_pcl_parts common search kdtree octree filters features sample_consensus segmentation)
  find_library(octosurf_lz4 lz4 REQUIRED)  # src/pcl: FLANN's headers, which PCL's include
  target_link_libraries(octosurf_pcl_parts INTERFACE ${octosurf_lz4})
endif()
if(OCTOSURF_BUILD_TESTS)
  find_package(GTest REQUIRED)                         # test
  octosurf_pcl_target(octosurf_pcl_io common io)       # test, lab/test: PCD and PLY files, adapters/pcl.hpp
endif()
if(OCTOSURF_BUILD_EXAMPLES)
  pkg_check_modules(cbc IMPORTED_TARGET cbc)           # examples: mixed-integer programmes
endif()
