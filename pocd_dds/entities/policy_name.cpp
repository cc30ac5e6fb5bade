#include "pocd_dds/entities/policy_name.hpp"

#include <fastdds/dds/core/policy/QosPolicies.hpp>

namespace pocd::dds {

std::string policy_name(std::int32_t policy) {
  using namespace eprosima::fastdds::dds;  // NOLINT: names of the standard
  switch (policy) {
    case DURABILITY_QOS_POLICY_ID:
      return "durability";
    case PRESENTATION_QOS_POLICY_ID:
      return "presentation";
    case DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case LATENCYBUDGET_QOS_POLICY_ID:
      return "latency budget";
    case OWNERSHIP_QOS_POLICY_ID:
      return "ownership";
    case LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case DESTINATIONORDER_QOS_POLICY_ID:
      return "destination order";
    case DATAREPRESENTATION_QOS_POLICY_ID:
      return "data representation";
    case TYPECONSISTENCYENFORCEMENT_QOS_POLICY_ID:
      return "type consistency enforcement";
    default:
      return "policy " + std::to_string(policy);
  }
}

}  // namespace pocd::dds
