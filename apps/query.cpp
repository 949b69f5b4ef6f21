// `octosurf query`: a planner's questions from the shell.
#include "open_map.hpp"
#include "questions.hpp"
#include "readable.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace octosurf {
namespace {

constexpr const char* query_description = R"(Answers questions about a map.

Examples:
  octosurf query maps/office --nearest 1.2 0.4 0.9
  octosurf query maps/office --nearest 1.2 0.4 0.9 --max-slope 30   of what slopes by 30 degrees at most
  octosurf query maps/office --below 1.2 0.4 0.9 --json             what a foot lowered there meets
  octosurf query maps/office --ray 0 0 1.5 1 0 -0.2                 what a camera at 1.5 m looks at
  octosurf query maps/office --box 0 0 0 2 2 1 --json               ids of the surfaces in there; --sphere X Y Z R
  octosurf query maps/office --voxel 1.2 0.4 0.9                    occupied, free or unknown, and its surface
  octosurf query maps/office --foothold 1.2 0.4 0.0 90 --foot 0.22x0.11 --clearance 0.15 --edge-margin 0.02
  octosurf query maps/office --stair 1.2 0.4 0.0 --json             the stair nearest to that place
  octosurf query maps/office --patch 1.2 0.4 0.6 90                 heights around a robot's base, as its controller reads
  octosurf query maps/office --regions 1 --foot 0.03 --pieces 12 --json   where a ball foot may be on surface 1
  octosurf query maps/office --regions 1 --foot 0.03 --about 1.2 0.4 0.0 --reach 1   likewise, within a metre of a place
)";

struct QueryArguments {
  std::string map, up;
  const Question* question = nullptr;
  std::vector<double> numbers;  ///< of the question
  Request asked;
  bool json = false;
};

void run_query(QueryArguments& arguments) {
  const LoadedMap loaded = open_map(arguments.map);
  const planning::AskedMap map(arguments.map, loaded.map.snapshot(), loaded.map.octree(),
                               up_in_force(loaded.map, arguments.up).direction);
  const Question& question = *arguments.question;
  auto number = arguments.numbers.begin();
  for (const QuestionField& field : question.fields(arguments.asked))
    if (field.required) {
      const auto first = std::exchange(number, number + static_cast<std::ptrdiff_t>(field.numbers));
      field.put({first, number}, std::string("--") + question.flag);
    }
  if (!arguments.json && question.print != nullptr) return question.print(map, arguments.asked);
  const nlohmann::ordered_json answer = question.answer(map, arguments.asked);
  if (!arguments.json) return print_readable(answer);
  std::printf("%s\n", answer.dump().c_str());
}

}  // namespace

void add_query(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("query", query_description);
  const auto arguments = std::make_shared<QueryArguments>();
  verb->add_option("map", arguments->map, "map to ask: name without ending, as given to map -o")->required();
  CLI::Option_group* group = verb->add_option_group("question", "question; one of");
  for (const Question& question : questions()) {
    std::size_t numbers = 0;
    for (const QuestionField& field : question.fields(arguments->asked))
      if (field.required) numbers += field.numbers;
    const auto take = [arguments, &question](const std::vector<double>& v) {
      arguments->question = &question;
      arguments->numbers = v;
    };
    group
        ->add_option_function<std::vector<double>>(std::string("--") + question.flag, take,
                                                   question.takes + std::string(": ") + question.summary)
        ->expected(static_cast<int>(numbers));
  }
  group->require_option(1);
  add_options(*verb, region_fields(arguments->asked.contact));
  add_up_option(*verb, arguments->up);
  verb->add_flag("--json", arguments->json, "print JSON");
  verb->callback([arguments] { run_query(*arguments); });
}

}  // namespace octosurf
