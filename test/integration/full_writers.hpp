// Writers that refuse, or wait, because a reader has no room.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "pocd_dds/entities/topic_table.hpp"

namespace pocd {

/// XML profiles by which the writers of these topics keep one sample until it is acknowledged, wait
/// for that as long as it says, and then refuse the next one.
inline void write_one_sample_profiles(const std::filesystem::path& file,
                                      const std::vector<std::string>& topics, int blocking_s = 0) {
  std::ofstream out(file);
  out << R"(<?xml version="1.0" encoding="UTF-8" ?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">)";
  for (const std::string& topic : topics) {
    out << "<data_writer profile_name=\"" << topic << R"("><topic>
  <historyQos><kind>KEEP_ALL</kind></historyQos><resourceLimitsQos><max_samples>1</max_samples>
  <max_instances>1</max_instances><max_samples_per_instance>1</max_samples_per_instance>
  <allocated_samples>0</allocated_samples></resourceLimitsQos></topic>
  <qos><reliability><kind>RELIABLE</kind><max_blocking_time><sec>)"
        << blocking_s << R"(</sec><nanosec>1000000</nanosec>
  </max_blocking_time></reliability><durability><kind>TRANSIENT_LOCAL</kind></durability></qos>
  <times><heartbeatPeriod><nanosec>20000000</nanosec></heartbeatPeriod></times>
  <historyMemoryPolicy>DYNAMIC</historyMemoryPolicy></data_writer>)";
  }
  out << "</profiles>";
}

/// How a reader that has room for one sample, and keeps it, is set up.
inline constexpr dds::Delivery kRoomForOne{true, false, 0, 1, 0, false, 0};

}  // namespace pocd
