#include "pocd/objects/frame_result.hpp"

namespace pocd {

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::kAdded:
      return "ADDED";
    case EventKind::kUpdated:
      return "UPDATED";
    case EventKind::kMoved:
      return "MOVED";
    case EventKind::kRemoved:
      return "REMOVED";
    case EventKind::kOperator:
      return "OPERATOR";
  }
  return "";
}

const char* to_string(Arrival arrival) {
  switch (arrival) {
    case Arrival::kFound:
      return "found";
    case Arrival::kArrived:
      return "arrived";
    case Arrival::kUnknown:
      break;
  }
  return "unknown";
}

}  // namespace pocd
