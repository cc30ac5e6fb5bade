// What pocd_doctor has to say.
#pragma once

#include <string>
#include <vector>

namespace pocd::dds {

enum class Severity { kNote, kWarning, kError };
const char* to_string(Severity severity);  ///< "note", "warning", "error"

struct Finding {
  Severity severity = Severity::kNote;
  std::string where;  ///< topic, file or setting
  std::string what;
  std::string advice;  ///< what to do; "" for a note that needs nothing
};
using Findings = std::vector<Finding>;

/// "error: WHERE: WHAT; ADVICE", on one line.
std::string line_of(const Finding& finding);

}  // namespace pocd::dds
