#include "pocd/common/check.hpp"

namespace pocd {

void check_failed(const char* condition, const char* file, int line) {
  throw std::logic_error(std::string("broken invariant: ") + condition + " at " + file + ":" +
                         std::to_string(line));
}

}  // namespace pocd
