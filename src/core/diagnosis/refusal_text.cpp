#include "diagnosis/refusal_text.hpp"

#include <array>
#include <locale>
#include <sstream>
#include <string_view>

namespace octosurf::diagnosis {
namespace {

struct ReasonText {
  /// {measured} and {limit} are replaced by the figure's value and its lower bound, {surface} and {cylinder}
  /// by ids.
  std::string_view sentence;
  std::string_view figure{}, unit{};  // name and unit of the Figure; empty: none
};
/// By Reason.
constexpr std::array<ReasonText, reason_names.size()> reason_texts{
    {{"There is a surface here: surface {surface}."},
     {"No surface: this is in a hole of surface {surface}."},
     {"No surface: the nearest point belongs to surface {surface}, and this is outside its polygons."},
     {"No surface: this is on cylinder {cylinder}."},
     {"No surface: this is outside what the octree can hold."},
     {"No surface: nothing was ever seen here."},
     {"No surface: this is free space."},
     {"No surface: the voxel here is occupied, but no scan has put a point into it."},
     {"No surface: the point here stands alone, with fewer than two others within r."},
     {"No surface: only {measured} points on the plane here lie less than h apart, and a surface "
      "needs {limit}.",
      "points"},
     {"No surface: the patch here is {measured} m wide, and a surface needs {limit} m.", "width", "m"},
     {"No surface: the patch here was seen along its plane, at a mean cosine of {measured}; below "
      "{limit} its side is not known.",
      "cosine"},
     {"No surface: the patch here is curved, like a pillar's side."},
     {"No surface: what was seen here was seen through surface {surface} and is its noise."},
     {"No surface: no plane passes through the point here that enough others beside it agree on: an "
      "edge, something round, or clutter."},
     {"No surface: the plane through the points here explains less of what is seen around it than "
      "clutter does ({measured} nats, and a surface needs more than {limit}).",
      "explained", "nats"},
     {"Not yet a surface: a look around here would make one, but comes only once enough new points "
      "have."}}};

const ReasonText& text_of(Reason reason) { return reason_texts.at(static_cast<std::size_t>(reason)); }

template <class Value>
std::string text(const Value& value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(3);
  out << value;
  return out.str();
}

void replace_all(std::string& sentence, std::string_view placeholder, std::string_view value) {
  for (std::size_t at = 0; (at = sentence.find(placeholder, at)) != std::string::npos; at += value.size())
    sentence.replace(at, placeholder.size(), value);
}

}  // namespace

std::string sentence_of(const surfaces::Refusal& refusal) {
  std::string sentence(text_of(refusal.reason).sentence);
  replace_all(sentence, "{measured}", text(refusal.measured));
  replace_all(sentence, "{limit}", text(refusal.limit));
  replace_all(sentence, "{surface}", text(refusal.surface));
  replace_all(sentence, "{cylinder}", text(refusal.cylinder));
  return sentence;
}

std::vector<Figure> figures_of(const surfaces::Refusal& refusal) {
  const ReasonText& told = text_of(refusal.reason);
  if (told.figure.empty() || (refusal.measured == 0 && refusal.limit == 0)) return {};
  return {Figure{std::string(told.figure), refusal.measured, std::string(told.unit), refusal.limit}};
}

}  // namespace octosurf::diagnosis
