// One description of every parameter, used to load, check, dump and document it.
//
// A stage's Config struct gives its fields once, with default, unit, range and meaning:
//
//   struct TsdfConfig {
//     double voxel_size_m = 0.05;
//     template <class Visitor>
//     void describe(Visitor& visit) {
//       visit("voxel_size_m", voxel_size_m, Range{0.002, 1.0}, "Edge of a voxel [m].");
//     }
//   };
//
// A Visitor has operator() for: double, int, std::uint64_t with a Range; bool; std::string;
// an enum that has words (enum_words.hpp); std::vector of structs or strings; and group(name,
// nested, doc) for a nested struct. Visitors live in src/config (strict YAML load, dump, Markdown
// page).
#pragma once

#include "pocd/common/enum_words.hpp"

namespace pocd {

/// Closed interval of allowed values.
struct Range {
  double low;
  double high;
};

}  // namespace pocd
