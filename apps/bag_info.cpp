#include "info.hpp"
#include "io/readers/bag_index.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

double seconds(std::int64_t ns) { return static_cast<double>(ns) / 1e9; }

/// 2023-11-14 22:13:20 UTC
std::string date(std::int64_t ns) {
  const auto time = static_cast<std::time_t>(ns / 1000000000);
  std::tm parts{};
  std::array<char, 40> text{};
  if (!gmtime_r(&time, &parts)) return "?";
  std::strftime(text.data(), text.size(), "%F %T UTC", &parts);
  return text.data();
}

struct Summary {
  std::vector<std::filesystem::path> files;
  std::vector<io::TopicContents> topics;
  std::uint64_t messages = 0;
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
  std::vector<std::string> damage;
};

Summary summarise(const std::filesystem::path& bag) {
  Summary summary;
  summary.files = io::files_of_bag(bag);
  summary.topics = io::summarise_bag(*io::open_bag(summary.files), summary.damage);
  std::sort(
      summary.topics.begin(), summary.topics.end(),
      [](const io::TopicContents& a, const io::TopicContents& b) { return a.topic.name < b.topic.name; });
  for (const io::TopicContents& topic : summary.topics) {
    summary.messages += topic.messages;
    if (topic.messages == 0) continue;
    summary.first_ns = std::min(summary.first_ns, topic.first_ns);
    summary.last_ns = std::max(summary.last_ns, topic.last_ns);
  }
  return summary;
}

void print_text(const Summary& summary) {
  for (const auto& file : summary.files) std::printf("%-12s %s\n", "bag", file.c_str());
  std::printf("%-12s %zu\n", "messages", static_cast<std::size_t>(summary.messages));
  if (summary.messages > 0) {
    std::printf("%-12s %s … %s\n", "time", date(summary.first_ns).c_str(), date(summary.last_ns).c_str());
    std::printf("%-12s %.3f s\n", "duration", seconds(summary.last_ns) - seconds(summary.first_ns));
  }
  if (summary.topics.empty()) return;
  std::size_t name = 5, type = 4;
  for (const io::TopicContents& topic : summary.topics) {
    name = std::max(name, topic.topic.name.size());
    type = std::max(type, topic.topic.type.size());
  }
  std::printf("\n%-*s  %-*s  %9s  %10s  %10s\n", static_cast<int>(name), "topic", static_cast<int>(type),
              "type", "messages", "first", "last");
  for (const io::TopicContents& topic : summary.topics) {
    std::printf("%-*s  %-*s  %9zu", static_cast<int>(name), topic.topic.name.c_str(), static_cast<int>(type),
                topic.topic.type.c_str(), static_cast<std::size_t>(topic.messages));
    if (topic.messages > 0)
      std::printf("  %8.3f s  %8.3f s", seconds(topic.first_ns - summary.first_ns),
                  seconds(topic.last_ns - summary.first_ns));
    std::printf("\n");
  }
}

void print_json(const Summary& summary) {
  Json json;
  json["files"] = Json::array();
  for (const auto& file : summary.files) json["files"].push_back(file.string());
  json["messages"] = summary.messages;
  const bool any = summary.messages > 0;
  json["first_s"] = any ? Json(seconds(summary.first_ns)) : Json();
  json["last_s"] = any ? Json(seconds(summary.last_ns)) : Json();
  json["duration_s"] = any ? Json(seconds(summary.last_ns - summary.first_ns)) : Json();
  json["topics"] = Json::array();
  for (const io::TopicContents& topic : summary.topics) {
    const bool heard = topic.messages > 0;
    json["topics"].push_back({{"name", topic.topic.name},
                              {"type", topic.topic.type},
                              {"messages", topic.messages},
                              {"first_s", heard ? Json(seconds(topic.first_ns)) : Json()},
                              {"last_s", heard ? Json(seconds(topic.last_ns)) : Json()}});
  }
  json["damage"] = summary.damage;
  std::printf("%s\n", json.dump(1, ' ', false, Json::error_handler_t::replace).c_str());
}

}  // namespace

void print_bag(const std::filesystem::path& bag, bool json) {
  const Summary summary = summarise(bag);
  json ? print_json(summary) : print_text(summary);
  if (!summary.damage.empty()) throw Error(Error::Kind::data, "", summary.damage.front());
}

}  // namespace octosurf
