// Errors. InputError: the user's data or configuration is at fault, and the text says where.
// POCD_CHECK: a broken invariant of our own; always on, throws std::logic_error with the place.
#pragma once

#include <stdexcept>
#include <string>

namespace pocd {

/// Bad input. `what()` names file or topic, field and value in one line.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

[[noreturn]] void check_failed(const char* condition, const char* file, int line);

}  // namespace pocd

#define POCD_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::pocd::check_failed(#condition, __FILE__, __LINE__))
