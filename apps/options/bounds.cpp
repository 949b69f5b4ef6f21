#include "bounds.hpp"

#include "io/text_file.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace octosurf {
namespace {

CLI::Validator bound(const std::string& rule, const std::function<bool(double)>& holds) {
  return CLI::Validator(
      [rule, holds](const std::string& text) {
        double value = 0;
        const bool good = CLI::detail::lexical_cast(text, value) && holds(value);
        return good ? std::string() : "'" + text + "' must be " + rule;
      },
      rule);
}

class OftenFormatter : public CLI::Formatter {
 public:
  std::string make_group(std::string group, bool positional,
                         std::vector<const CLI::Option*> options) const override {
    return group == rare_group ? std::string() : CLI::Formatter::make_group(group, positional, options);
  }
};

}  // namespace

CLI::Validator at_least(double low) {
  return bound(io::formatted("%g or more", low), [low](double value) { return value >= low; });
}

CLI::Validator more_than(double low) {
  return bound(io::formatted("more than %g", low), [low](double value) { return value > low; });
}

CLI::Validator between(double low, double high) {
  return bound(io::formatted("from %g to %g", low, high),
               [low, high](double value) { return value >= low && value <= high; });
}

void add_threads(CLI::App& verb, int& threads) {
  threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 256u));
  verb.add_option("--threads", threads, "number of threads; the result does not depend on it")
      ->capture_default_str();
}

void require_finite(CLI::App& app) {
  for (CLI::Option* option : app.get_options())
    if (option->get_type_name().starts_with("FLOAT"))
      option->check(
          bound("a finite number", [](double value) { return std::isfinite(value); }).description(""));
  for (CLI::App* inner : app.get_subcommands([](CLI::App*) { return true; })) require_finite(*inner);
}

void leave_out_rare(CLI::App& verb) { verb.formatter(std::make_shared<OftenFormatter>()); }

}  // namespace octosurf
