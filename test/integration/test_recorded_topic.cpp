// How a topic is played, by what different recorders wrote of it.
#include "pocd_dds/recording/recorded_topic.hpp"

#include <gtest/gtest.h>

namespace pocd::dds {
namespace {

RecordedTopic played(const std::string& topic, const std::string& type,
                     const std::string& offered = "") {
  recording::RecordedChannel channel;
  channel.topic = topic;
  channel.type = type;
  channel.message_encoding = "cdr";
  if (!offered.empty()) channel.metadata["offered_qos_profiles"] = offered;
  return topic_of(channel).value();
}

TEST(RecordedTopic, TypesHaveTheirNamesOnTheBus) {
  for (const char* type :
       {"sensor_msgs/msg/Image", "sensor_msgs/Image", "sensor_msgs::msg::dds_::Image_"}) {
    EXPECT_EQ(played("/a", type).type, "sensor_msgs::msg::dds_::Image_") << type;
    EXPECT_EQ(played("/a", type).name, "rt/a");
    EXPECT_EQ(played("rt/a", type).name, "rt/a");
  }
  EXPECT_EQ(played("/a", "HelloWorld").type, "HelloWorld");
}

TEST(RecordedTopic, WhatIsLatchedIsReadInEveryForm) {
  constexpr char kTf[] = "tf2_msgs/msg/TFMessage";
  const auto latched = [&](const std::string& topic, const std::string& durability) {
    return played(topic, kTf, durability.empty() ? "" : "- durability: " + durability + "\n")
        .transient_local;
  };
  for (const char* yes : {"1", "transient_local", "TRANSIENT_LOCAL", "\"transient_local\""}) {
    EXPECT_TRUE(latched("/a", yes)) << yes;
  }
  for (const char* no : {"2", "volatile", "Volatile"}) {
    EXPECT_FALSE(latched("/tf_static", no)) << no << ": as it was";
  }
  // What says nothing leaves it to custom.
  for (const char* nothing : {"", "0", "system_default", "best_available", "unknown", "99"}) {
    EXPECT_TRUE(latched("/r1/tf_static", nothing)) << nothing;
    EXPECT_FALSE(latched("/a", nothing)) << nothing;
  }
  // Of several writers one is enough.
  EXPECT_TRUE(played("/a", kTf, "- durability: 2\n- durability: 1\n").transient_local);
  EXPECT_FALSE(played("/a", kTf, "- reliability: BEST_EFFORT\n").reliable);
  EXPECT_TRUE(played("/a", kTf, "- reliability: system_default\n").reliable);
}

}  // namespace
}  // namespace pocd::dds
