// The static-world baseline (Kimera in the paper's table): Voxblox's TSDF update, which knows no
// change. A surface that is gone only fades as far as the running average forgets. The cap of the
// weight is Voxblox's default of 10000, in effect none. Not tuned.
#include "naive_tsdf.hpp"
#include "pocd/eval/mapping_method.hpp"

namespace pocd {
namespace {

constexpr float kMaxWeight = 10000.0f;
constexpr float kMinWeight = 0.5f;  // two observations at 2 m

class StaticTsdfMethod final : public MappingMethod {
 public:
  explicit StaticTsdfMethod(const PipelineConfig& config) : grid_(config.map, kMaxWeight) {}

  FrameResult process(const Frame& frame) override {
    grid_.integrate(frame, cv::Mat());
    return {};
  }
  Points surface() const override { return grid_.surface(kMinWeight); }

 private:
  NaiveTsdf grid_;
};

}  // namespace

std::unique_ptr<MappingMethod> make_static_tsdf_method(const PipelineConfig& config) {
  return std::make_unique<StaticTsdfMethod>(config);
}

}  // namespace pocd
