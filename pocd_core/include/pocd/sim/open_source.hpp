// Data sets and the simulator by the name of their format.
#pragma once

#include <memory>

#include "pocd/datasets/dataset_reader.hpp"

namespace pocd {

/// "sim": SimReader of the scenario files; every other format as open_dataset. Throws InputError.
std::unique_ptr<DatasetReader> open_source(const DatasetOptions& options);

}  // namespace pocd
