#include "bounds.hpp"

#include <cmath>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
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

std::string text_of(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
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
  return bound(text_of(low) + " or more", [low](double value) { return value >= low; });
}

CLI::Validator more_than(double low) {
  return bound("more than " + text_of(low), [low](double value) { return value > low; });
}

CLI::Validator between(double low, double high) {
  return bound("from " + text_of(low) + " to " + text_of(high),
               [low, high](double value) { return value >= low && value <= high; });
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
