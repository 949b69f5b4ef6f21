# Warnings for our own code only: a user who adds octosurf as a subdirectory does not inherit them.
add_library(octosurf_warnings INTERFACE)
target_compile_options(octosurf_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual
  $<$<BOOL:${OCTOSURF_WERROR}>:-Werror>)

# octosurf_room(NAME SOURCES… [USES library…] [USES_INSIDE library…]): the objects of one folder of src/. Rooms see the
# public headers and, as "room/header.hpp", one another's; what may include what is docs/design.md §2.
# USES_INSIDE: libraries whose compile flags must not reach other rooms (CGAL's -frounding-math).
function(octosurf_room name)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES;USES_INSIDE" ${ARGN})
  add_library(octosurf_${name} OBJECT ${ARG_SOURCES})
  target_include_directories(octosurf_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>)
  target_link_libraries(octosurf_${name} PUBLIC ${ARG_USES} Eigen3::Eigen
                        PRIVATE ${ARG_USES_INSIDE} $<BUILD_INTERFACE:octosurf_warnings>)
endfunction()

# What keeps a map, and what makes one: the rooms that a program links.
set(OCTOSURF_MAP_ROOMS octosurf_surfaces octosurf_occupancy octosurf_sensing octosurf_geometry)
set(OCTOSURF_MAPPER_ROOMS octosurf_mapper octosurf_diagnosis octosurf_cylinders octosurf_detection octosurf_upkeep
  octosurf_alignment ${OCTOSURF_MAP_ROOMS})
