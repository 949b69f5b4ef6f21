#include "bench/speed/contestant.hpp"

#include "evaluation/evaluate.hpp"

#include <filesystem>
#include <limits>
#include <malloc.h>
#include <map>

#include <octosurf/error.hpp>

namespace octosurf::bench {

std::unique_ptr<Contestant> make_contestant(const std::string& kind, const Json& settings) {
  using Make = std::unique_ptr<Contestant> (*)(const Json&);
  static const std::map<std::string, Make> makers{{"octomap", make_octomap},
                                                  {"occupancy", make_occupancy},
                                                  {"plain", make_plain},
                                                  {"read_binary", make_read_binary},
                                                  {"load_map", make_load_map},
                                                  {"mapper", make_mapper},
                                                  {"paper", make_paper},
                                                  {"region_growing", make_region_growing},
                                                  {"ransac", make_ransac},
                                                  {"normal_field", make_normal_field},
                                                  {"mls", make_mls},
                                                  {"derive_grown", make_derive_grown},
                                                  {"derive_fresh", make_derive_fresh},
                                                  {"derive_reference", make_derive_reference}};
  const auto maker = makers.find(kind);
  if (maker == makers.end()) throw Error(Error::Kind::usage, "contestant " + kind, "is unknown");
  return maker->second(settings);
}

Parameters parameters_from(const Json& settings) {
  Parameters parameters;
  parameters.occupancy.resolution = settings.at("resolution").get<double>();
  if (const auto range = settings.find("max_range"); range != settings.end() && range->is_number())
    parameters.occupancy.max_range = range->get<double>();
  return parameters;
}

double max_range_of(const Json& settings) {
  return parameters_from(settings).occupancy.max_range.value_or(std::numeric_limits<double>::infinity());
}

Json scores(const Snapshot& snapshot, const Json& question) {
  const std::filesystem::path truth(question.at("evaluate").get<std::string>());
  const evaluation::Evaluation evaluation = evaluation::evaluate(snapshot, evaluation::load_truth(truth));
  return {{"faces", evaluation.faces},
          {"correct", evaluation.correct},
          {"noise", evaluation.noise},
          {"area_m2", evaluation.area_m2},
          {"unsafe_m2", evaluation.unsafe_m2}};
}

std::size_t heap_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace octosurf::bench
