#pragma once

#include <cstddef>
#include <vector>

namespace octosurf::geometry {

/// Calls visit(element) from the first of `reached` to its last, while `visit` appends what can be reached
/// from there: growth outward, breadth first.
template <class T, class Visit>
void breadth_first(std::vector<T>& reached, Visit&& visit) {
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const T from = reached[next];  // a copy: appending moves the elements
    visit(from);
  }
}

}  // namespace octosurf::geometry
