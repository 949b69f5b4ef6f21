#pragma once

#include <cstddef>
#include <vector>

namespace octosurf::geometry {

/// Breadth-first traversal: calls visit(element) for each of `reached`, while `visit` appends elements
/// reached from there.
template <class T, class Visit>
void breadth_first(std::vector<T>& reached, Visit&& visit) {
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const T from = reached[next];  // a copy: appending moves the elements
    visit(from);
  }
}

}  // namespace octosurf::geometry
