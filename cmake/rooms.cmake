# Warnings for our own code only: a user who adds octosurf as a subdirectory does not inherit them. GCC takes a source
# inside of a unity source for a header, in which a class must not have members of types that are the source's alone.
add_library(octosurf_warnings INTERFACE)
target_compile_options(octosurf_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual
  $<$<AND:$<BOOL:${OCTOSURF_UNITY_BUILD}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage>
  $<$<BOOL:${OCTOSURF_WERROR}>:-Werror>)
# Boost.Geometry includes what Boost deprecates, and each source would say so.
target_compile_definitions(octosurf_warnings INTERFACE BOOST_ALLOW_DEPRECATED_HEADERS)

# octosurf_pieces(TARGET [MOST]): with OCTOSURF_UNITY_BUILD the target's sources are compiled in pieces of at most MOST
# (12) sources, all of nearly one size. Half of what a source takes by itself is reading Eigen's and Boost's headers;
# larger pieces save little more, and make the wait after an edit longer. A source with options of its own, or that
# says SKIP_UNITY_BUILD_INCLUSION, is compiled by itself. Not by CMake's UNITY_BUILD: that one names sources by
# absolute paths (before 3.29), and ccache would find nothing of what was compiled in another checkout.
function(octosurf_pieces target)
  if(NOT OCTOSURF_UNITY_BUILD)
    return()
  endif()
  set(most 12)
  if(ARGC GREATER 1)
    set(most ${ARGV1})
  endif()
  get_target_property(sources ${target} SOURCES)
  set(together)
  foreach(source ${sources})
    cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    set(own_options OFF)
    foreach(property COMPILE_OPTIONS SKIP_UNITY_BUILD_INCLUSION)
      get_source_file_property(value ${source} ${property})
      if(value)
        set(own_options ON)
      endif()
    endforeach()
    cmake_path(IS_PREFIX PROJECT_BINARY_DIR ${source} generated)
    if(source MATCHES "[.]cpp$" AND NOT own_options AND NOT generated)
      set_source_files_properties(${source} PROPERTIES HEADER_FILE_ONLY ON)
      cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
      list(APPEND together ${source})
    endif()
  endforeach()
  list(LENGTH together count)
  if(count EQUAL 0)
    return()
  endif()
  math(EXPR pieces "(${count} + ${most} - 1) / ${most}")
  math(EXPR size "(${count} + ${pieces} - 1) / ${pieces}")
  foreach(piece RANGE 1 ${pieces})
    math(EXPR first "(${piece} - 1) * ${size}")
    list(SUBLIST together ${first} ${size} some)
    list(TRANSFORM some REPLACE "(.+)" "#include \"\\1\"\n")
    list(JOIN some "" text)
    set(file ${CMAKE_CURRENT_BINARY_DIR}/${target}_${piece}.cpp)
    file(CONFIGURE OUTPUT ${file} CONTENT "${text}" @ONLY)
    target_sources(${target} PRIVATE ${file})
  endforeach()
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
endfunction()

# octosurf_room(NAME SOURCES… [USES library…] [USES_INSIDE library…]): the objects of one folder of src/. Rooms see the
# public headers and, as "room/header.hpp", one another's; what may include what is docs/design.md §2.
# USES_INSIDE: libraries whose compile flags must not reach other rooms (CGAL's -frounding-math).
function(octosurf_room name)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES;USES_INSIDE" ${ARGN})
  add_library(octosurf_${name} OBJECT ${ARG_SOURCES})
  target_include_directories(octosurf_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src/core>)
  target_link_libraries(octosurf_${name} PUBLIC ${ARG_USES} Eigen3::Eigen
                        PRIVATE ${ARG_USES_INSIDE} $<BUILD_INTERFACE:octosurf_warnings>)
  octosurf_pieces(octosurf_${name})
endfunction()

# What keeps a map, and what makes one: the rooms that a program links.
set(OCTOSURF_MAP_ROOMS octosurf_alignment octosurf_surfaces octosurf_occupancy octosurf_sensing octosurf_geometry)
set(OCTOSURF_MAPPER_ROOMS octosurf_mapper octosurf_judgement octosurf_diagnosis octosurf_cylinders octosurf_detection octosurf_update
  ${OCTOSURF_MAP_ROOMS})
