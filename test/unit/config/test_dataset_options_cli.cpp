#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "pocd/config/dataset_options_cli.hpp"

namespace pocd {
namespace {

DatasetOptions parse(const std::string& arguments) {
  CLI::App app;
  DatasetOptions options;
  add_dataset_options(app, options);
  app.parse(arguments);
  return options;
}

TEST(DatasetOptionsCli, DefaultsAreThoseOfTheStruct) {
  const DatasetOptions parsed = parse("--dataset rgbd --input a");
  const DatasetOptions defaults;
  EXPECT_EQ(parsed.format, "rgbd");
  EXPECT_EQ(parsed.inputs, std::vector<std::filesystem::path>{"a"});
  EXPECT_EQ(parsed.repeat, defaults.repeat);
  EXPECT_EQ(parsed.frame_rate_hz, defaults.frame_rate_hz);
  EXPECT_EQ(parsed.gravity_W, defaults.gravity_W);
  EXPECT_EQ(parsed.seed, defaults.seed);
}

TEST(DatasetOptionsCli, ReadsAllFlags) {
  const DatasetOptions parsed = parse(
      "--dataset pcd --input b --input a --repeat 10 --rate 5 --gravity=-0.00887,0.90443,0.42654 "
      "--seed 18446744073709551615");
  EXPECT_EQ(parsed.inputs, (std::vector<std::filesystem::path>{"b", "a"}));
  EXPECT_EQ(parsed.repeat, 10);
  EXPECT_EQ(parsed.frame_rate_hz, 5.0);
  EXPECT_EQ(parsed.seed, 18446744073709551615ull);
  EXPECT_NEAR(parsed.gravity_W.norm(), 1.0, 1e-12);  // rounding of one division
  EXPECT_NEAR(parsed.gravity_W.y(), 0.90443, 1e-4);  // the text's digits
}

TEST(DatasetOptionsCli, RefusesWhatIsNoDirection) {
  const std::string input = "--dataset rgbd --input a --gravity=";
  for (const char* bad : {"0,0", "0,0,-9.81", "0,0,0", "0,0,nan", "a,b,c", "0,0,-1,", "0,0,-1,0"}) {
    EXPECT_THROW(parse(input + bad), CLI::ParseError) << bad;
  }
}

TEST(DatasetOptionsCli, RefusesMissingAndOutOfRange) {
  EXPECT_THROW(parse("--input a"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd --input a --repeat 0"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd --input a --rate 0"), CLI::ParseError);
  EXPECT_THROW(parse("--dataset rgbd --input a --seed -1"), CLI::ParseError);
}

}  // namespace
}  // namespace pocd
