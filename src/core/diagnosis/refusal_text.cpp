#include "diagnosis/refusal_text.hpp"

#include <locale>
#include <sstream>

namespace octosurf::diagnosis {
namespace {

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
