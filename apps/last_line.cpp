#include "last_line.hpp"

#include <cstdarg>
#include <cstring>
#include <new>

namespace octosurf {

void LastLine::add(const char* format, ...) {
  const std::size_t used = std::strlen(text_.data());
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text_.data() + used, text_.size() - used, format, arguments);
  va_end(arguments);
}

void LastLine::add_last_of(const Checkpoints& checkpoints) {
  if (checkpoints.any())
    add("the last complete checkpoint is %s with %zu scans of this run", checkpoints.stem().c_str(),
        checkpoints.scans());
  else
    add("no checkpoint of this run was complete");
}

const char* reason_of(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ? "out of memory" : error.what();
}

}  // namespace octosurf
