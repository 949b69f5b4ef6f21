#pragma once

#include <vector>

#include <octosurf/export.hpp>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace octosurf {

/// A picture's eye and target: --eye and --target, x y z each, or empty.
struct PictureEye {
  std::vector<double> eye, target;
};

struct EyeOptions {
  CLI::Option *eye, *target;
};
/// Adds both to a verb whose option `png` names the picture.
EyeOptions add_eye_options(CLI::App& verb, CLI::Option* png, PictureEye& eye);

/// Copies the given values into `options`.
void look_from(const PictureEye& eye, PictureOptions& options);

}  // namespace octosurf
