// The core inside another program: frames in, changes out; no middleware, no files.
#include <cstdio>
#include <opencv2/core.hpp>

#include "pocd/pipeline/pocd_pipeline.hpp"

int main() {
  pocd::PipelineConfig config;
  config.classes.list = {{1, "floor", "ground"}, {7, "box", "object", 0}};
  config.map.max_depth_m = 4.0;
  pocd::PocdPipeline pipeline(config);

  // A camera 1 m above the floor that looks along +y: z forward, x right, y down.
  pocd::Pose T_map_camera = pocd::Pose::Identity();
  T_map_camera.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  T_map_camera.translation().z() = 1.0;
  const pocd::CameraModel camera{320, 240, 260.0, 260.0, 159.5, 119.5};

  for (int i = 0; i < 60; ++i) {  // a wall 3 m ahead; a box stands before it for the first two seconds
    cv::Mat depth_m(240, 320, CV_32FC1, cv::Scalar(3.0)), classes(240, 320, CV_16UC1, cv::Scalar(0));
    if (i < 30) {
      const cv::Rect box(120, 90, 80, 90);
      depth_m(box).setTo(2.0);
      classes(box).setTo(7);
    }
    const pocd::Frame frame = pocd::make_frame(1'000'000'000 + i * 66'666'667LL, camera, T_map_camera,
                                               depth_m, classes, cv::Mat(), "camera");
    const pocd::FrameResult result = pipeline.process_frame(frame);
    for (const pocd::ObjectEvent& event : result.events) {
      std::printf("%s object %u at %.2f %.2f\n", to_string(event.kind), to_index(event.object),
                  event.box.pose.position_W.x(), event.box.pose.position_W.y());
    }
  }
  std::printf("map: %zu blocks\n", pipeline.map().block_count());
}
