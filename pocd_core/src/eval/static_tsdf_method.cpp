// The static-world baseline (Kimera in the paper's table): Voxblox's TSDF update, which knows no
// change. A surface that is gone only fades as far as the running average forgets. The cap of the
// weight decides how far.
#include "naive_tsdf.hpp"
#include "pocd/eval/mapping_method.hpp"

namespace pocd {
namespace {

class StaticTsdfMethod final : public MappingMethod {
 public:
  StaticTsdfMethod(const PipelineConfig& config, const StaticTsdfConfig& own)
      : own_(own), grid_(config.map, static_cast<float>(own.max_weight)) {}

  FrameResult process(const Frame& frame) override {
    grid_.integrate(frame, cv::Mat());
    return {};
  }
  Points surface() const override { return grid_.surface(static_cast<float>(own_.min_weight)); }

 private:
  StaticTsdfConfig own_;
  NaiveTsdf grid_;
};

}  // namespace

std::unique_ptr<MappingMethod> make_static_tsdf_method(const PipelineConfig& config,
                                                       const StaticTsdfConfig& own) {
  return std::make_unique<StaticTsdfMethod>(config, own);
}

}  // namespace pocd
