# The page of `octosurf view`: web/ bundled by esbuild to one HTML text in a generated source, put into `variable`.
# What is bundled has been fetched before (npm ci in web/, which ./dev does); without it or Node.js the library has no
# page.
function(octosurf_page_template variable)
  set(web ${PROJECT_SOURCE_DIR}/web)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/page_template.cpp)
  set(${variable} ${source} PARENT_SCOPE)
  find_program(NODE NAMES node nodejs)
  if(NODE AND EXISTS ${web}/node_modules/.bin/esbuild)
    file(GLOB_RECURSE parts CONFIGURE_DEPENDS ${web}/src/*.js)
    add_custom_command(OUTPUT ${source} ${CMAKE_CURRENT_BINARY_DIR}/page.html
      COMMAND ${NODE} ${web}/bundle.mjs ${CMAKE_CURRENT_BINARY_DIR}/page.html ${source}
      DEPENDS ${web}/bundle.mjs ${web}/page.html ${web}/style.css ${web}/package-lock.json ${parts}
      COMMENT "Bundling the page of octosurf view" VERBATIM)
  else()
    message(NOTICE
      "octosurf: no Node.js or no web/node_modules (npm ci in web/): octosurf view will draw pictures only")
    file(CONFIGURE OUTPUT ${source} @ONLY CONTENT [[
#include "io/exporters/page_template.hpp"

std::string_view octosurf::io::page_template() { return {}; }
]])
  endif()
endfunction()
