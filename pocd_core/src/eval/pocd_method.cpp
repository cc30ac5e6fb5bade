#include "pocd/eval/mapping_method.hpp"
#include "pocd/eval/surface_points.hpp"
#include "pocd/pipeline/pocd_pipeline.hpp"

namespace pocd {
namespace {

class PocdMethod final : public MappingMethod {
 public:
  explicit PocdMethod(const PipelineConfig& config)
      : min_weight_(config.map.min_publish_weight), pipeline_(config) {}

  FrameResult process(const Frame& frame) override { return pipeline_.process_frame(frame); }
  Points surface() const override { return surface_points(pipeline_.map(), min_weight_); }
  std::vector<ObjectSnapshot> objects() const override { return pipeline_.objects(); }
  bool has_objects() const override { return true; }

 private:
  int min_weight_;
  PocdPipeline pipeline_;
};

}  // namespace

std::unique_ptr<MappingMethod> make_pocd_method(const PipelineConfig& config) {
  PipelineConfig one_thread = config;
  one_thread.threads = 1;
  return std::make_unique<PocdMethod>(one_thread);
}

}  // namespace pocd
