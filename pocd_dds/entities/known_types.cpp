#include "pocd_dds/entities/known_types.hpp"

namespace pocd::dds {

const recording::IdlLibrary& known_types() {
  static const recording::IdlLibrary library(embedded_idl());
  return library;
}

std::string plain_type(const std::string& dds_type) {
  const std::size_t at = dds_type.find("::dds_::");
  if (at == std::string::npos || dds_type.back() != '_') return dds_type;
  return dds_type.substr(0, at + 2) + dds_type.substr(at + 8, dds_type.size() - at - 9);
}

}  // namespace pocd::dds
