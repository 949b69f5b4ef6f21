#include "picture_eye.hpp"

#include <CLI/CLI.hpp>
#include <vector>

namespace octosurf {

std::pair<CLI::Option*, CLI::Option*> add_eye_options(CLI::App& verb, CLI::Option* png,
                                                      PictureOptions& picture) {
  const auto add = [&](const char* name, const char* help, std::optional<Eigen::Vector3d>& to) {
    const auto take = [&to](const std::vector<double>& xyz) { to = Eigen::Vector3d(xyz.data()); };
    return verb.add_option_function<std::vector<double>>(name, take, help)->expected(3)->needs(png);
  };
  return {add("--eye", "X Y Z: draw the picture as seen from here [from one side above]", picture.eye),
          add("--target", "X Y Z: look at this [the map's middle]", picture.target)};
}

}  // namespace octosurf
