// Frames in, changes out, in one process and without a bus: a camera looks at a box before a wall,
// and after a while the box is gone.
#include <pocd/pipeline/pocd_pipeline.hpp>

#include <iostream>
#include <opencv2/core.hpp>

int main() {
  pocd::PipelineConfig config;  // every field is described in docs/parameters.md
  config.classes.list = {{0, "wall", pocd::ClassRole::kBackground, 1},
                         {1, "box", pocd::ClassRole::kObject, 0}};
  pocd::PocdPipeline pipeline(config);

  const pocd::CameraModel camera{320, 240, 240.0, 240.0, 159.5, 119.5};
  pocd::Pose T_W_C = pocd::Pose::Identity();  // the camera looks along +x of the map, 1 m above 0
  T_W_C.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T_W_C.translation().z() = 1.0;

  for (int i = 0; i < 80; ++i) {
    cv::Mat depth_m(camera.height, camera.width, CV_32FC1, cv::Scalar(2.5));
    cv::Mat labels(camera.height, camera.width, CV_16UC1, cv::Scalar(0));
    if (i < 40) {
      const cv::Rect box(110, 70, 100, 100);  // 0.75 m wide and high at 1.8 m
      depth_m(box).setTo(1.8);
      labels(box).setTo(1);
    }
    const pocd::StampNs stamp_ns = 1'000'000'000LL + i * 100'000'000LL;
    const pocd::FrameResult result = pipeline.process_frame(
        pocd::make_frame(stamp_ns, camera, T_W_C, depth_m, labels, cv::Mat(), "example"));
    for (const pocd::ObjectEvent& event : result.events) {
      std::cout << pocd::to_string(event.kind) << " " << config.classes.name(event.class_id)
                << " at x = " << event.box.pose.position_W.x() << " m, E[v] "
                << event.evidence.after.stationarity() << "\n";
    }
    for (const std::string& warning : result.warnings) std::cerr << warning << "\n";
  }
  std::cout << pipeline.objects().size() << " objects are left\n";
}
