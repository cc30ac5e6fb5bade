// The command line flags that say which frames to read: the same in every command that reads them.
#pragma once

#include "pocd/datasets/dataset_reader.hpp"

namespace CLI {
class App;
}

namespace pocd {

/// Adds --dataset, --input, --repeat, --rate, --gravity, --camera, --camera-pose, --mount, --seed and
/// --sensor to `app`; parsing it fills
/// `options`, which must outlive the parse. A bad value is a CLI::ParseError.
void add_dataset_options(CLI::App& app, DatasetOptions& options);

}  // namespace pocd
