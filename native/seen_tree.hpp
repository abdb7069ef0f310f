// What a search leaves behind to look at: its tree, as rows.
#pragma once

#include <vector>

namespace mmp {

template <class T>
struct SeenTree {
  std::vector<T> positions;  // [vertices][dof]
  std::vector<int> links;    // [vertices][2]: the step of arrival, and the vertex before it or -1
};

}  // namespace mmp
