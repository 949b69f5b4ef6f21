#include "picture_eye.hpp"

#include <CLI/CLI.hpp>

namespace octosurf {

EyeOptions add_eye_options(CLI::App& verb, CLI::Option* png, PictureEye& eye) {
  return {verb.add_option("--eye", eye.eye, "X Y Z: draw the picture as seen from here [from one side above]")
              ->expected(3)
              ->needs(png),
          verb.add_option("--target", eye.target, "X Y Z: look at this [the map's middle]")
              ->expected(3)
              ->needs(png)};
}

void look_from(const PictureEye& eye, PictureOptions& options) {
  const auto point = [](const std::vector<double>& xyz) { return Eigen::Vector3d(xyz[0], xyz[1], xyz[2]); };
  if (!eye.eye.empty()) options.eye = point(eye.eye);
  if (!eye.target.empty()) options.target = point(eye.target);
}

}  // namespace octosurf
