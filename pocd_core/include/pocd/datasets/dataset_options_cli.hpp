// The command line flags that say which frames to read: the same in every command that reads them.
#pragma once

#include <string>
#include <vector>

#include "pocd/datasets/open_dataset.hpp"

namespace CLI {
class App;
}

namespace pocd {

/// Adds --dataset, --input, --repeat, --rate, --gravity, --camera, --camera-pose, --mount, --seed
/// and
/// --sensor to `app`; parsing it fills
/// `options`, which must outlive the parse. A bad value is a CLI::ParseError.
void add_dataset_options(CLI::App& app, DatasetOptions& options);

/// Adds --depth-topic and its like, which are short for settings under node.topics: each becomes
/// one of `overrides`, for load_config.
void add_topic_options(CLI::App& app, std::vector<std::string>& overrides);

}  // namespace pocd
