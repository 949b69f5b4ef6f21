#pragma once

#include <utility>

#include <octosurf/export.hpp>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace octosurf {

/// Adds --eye and --target, X Y Z each, to a verb whose option `png` names the picture.
std::pair<CLI::Option*, CLI::Option*> add_eye_options(CLI::App& verb, CLI::Option* png,
                                                      PictureOptions& picture);

}  // namespace octosurf
