#include "pocd_dds/doctor/finding.hpp"

#include <algorithm>

namespace pocd::dds {

const char* to_string(Severity severity) {
  switch (severity) {
    case Severity::kNote:
      return "note";
    case Severity::kWarning:
      return "warning";
    case Severity::kError:
      return "error";
  }
  return "";
}

std::string line_of(const Finding& finding) {
  std::string line =
      std::string(to_string(finding.severity)) + ": " + finding.where + ": " + finding.what;
  if (!finding.advice.empty()) line += "; " + finding.advice;
  std::replace(line.begin(), line.end(), '\n', ' ');
  return line;
}

}  // namespace pocd::dds
