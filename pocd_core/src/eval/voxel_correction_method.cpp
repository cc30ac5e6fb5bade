// Voxel-level correction, after Fehr, Furrer, Dryanovski, Sturm, Gilitschenski, Siegwart, Cadena:
// "TSDF-based change detection for consistent long-term dense reconstruction and dynamic object
// discovery" (ICRA 2017): where a new observation contradicts the map, it wins, voxel by voxel;
// there are no objects, so what is not seen again stays. Uses our own map, whose integration
// corrects a contradicted voxel within a few frames whatever its weight.
#include "pocd/eval/mapping_method.hpp"
#include "pocd/eval/surface_points.hpp"

namespace pocd {
namespace {

class VoxelCorrectionMethod final : public MappingMethod {
 public:
  VoxelCorrectionMethod(const TsdfConfig& config, const VoxelCorrectionConfig& own)
      : pool_(1), map_(with(config, own)) {}

  FrameResult process(const Frame& frame) override {
    IntegrationInput input;
    input.frame = &frame;
    map_.integrate(input, pool_);
    return {};
  }
  Points surface() const override { return surface_points(map_, map_.config().min_publish_weight); }

 private:
  static TsdfConfig with(TsdfConfig config, const VoxelCorrectionConfig& own) {
    config.max_weight = own.max_weight;
    config.min_publish_weight = own.min_weight;
    config.clear_beyond_limit = own.clear_beyond_limit;
    return config;
  }

  ThreadPool pool_;
  TsdfMap map_;
};

}  // namespace

std::unique_ptr<MappingMethod> make_voxel_correction_method(const PipelineConfig& config,
                                                            const VoxelCorrectionConfig& own) {
  return std::make_unique<VoxelCorrectionMethod>(config.map, own);
}

}  // namespace pocd
