// Writes a recording of camera images for record_rate.sh: usage make_image_recording FILE SECONDS
// MB_PER_S.
#include <cstdlib>
#include <iostream>
#include <opencv2/core/mat.hpp>

#include "pocd/common/random.hpp"
#include "pocd/recording/mcap_writer.hpp"
#include "ros_payloads.hpp"

int main(int argc, char** argv) {
  using namespace pocd::recording;  // NOLINT
  if (argc != 4) {
    std::cerr << "usage: make_image_recording FILE SECONDS MB_PER_S\n";
    return 2;
  }
  const double seconds = std::atof(argv[2]), bytes_per_s = 1e6 * std::atof(argv[3]);
  McapWriterOptions options;
  options.compression = ChunkCompression::kNone;  // the player's time is not what is measured
  McapWriter writer(argv[1], options);
  const auto schema = writer.add_schema("sensor_msgs/msg/Image", "", "");
  std::vector<std::uint16_t> channels;
  for (const char* topic :
       {"/cam1/color/image_raw", "/cam2/color/image_raw", "/cam3/color/image_raw"}) {
    channels.push_back(writer.add_channel(
        schema, topic, "cdr",
        {{"qos", "reliability: true\ndurability: false\nownership: false\nkeyed: false"}}));
  }
  // Slopes with two bits of noise: about as hard to compress as what a camera sees.
  cv::Mat image(480, 640, CV_8UC3);
  pocd::Random random(1);
  for (int row = 0; row < image.rows; ++row) {
    auto* pixel = image.ptr<std::uint8_t>(row);
    for (int col = 0; col < image.cols * 3; ++col) {
      pixel[col] = static_cast<std::uint8_t>((row + col / 9) / 4 + random.below(4));
    }
  }
  const double period_s = 3.0 * 640 * 480 / bytes_per_s;
  for (double time_s = 0.0; time_s < seconds; time_s += period_s) {
    const auto number = static_cast<std::uint32_t>(time_s / period_s + 0.5);
    const auto stamp_ns = static_cast<pocd::StampNs>(1e9 + 1e9 * time_s);
    const Bytes payload = image_payload(stamp_ns, "camera", "rgb8", image);
    const auto time_ns = static_cast<std::uint64_t>(stamp_ns);
    writer.write({channels[number % 3], number, time_ns, time_ns}, payload.data(), payload.size());
  }
  writer.close();
}
