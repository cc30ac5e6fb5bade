// Part of pocd::io: OpenCV's files of pictures need far more than drawing does.
#include <opencv2/imgcodecs.hpp>

#include "pocd/common/check.hpp"
#include "pocd/output/birdseye.hpp"

namespace pocd {

void write_birdseye(const Mesh& mesh, const std::vector<ObjectSnapshot>& objects,
                    const std::filesystem::path& file, const BirdseyeOptions& options) {
  const cv::Mat picture = draw_birdseye(mesh, objects, options);
  bool written = false;
  try {
    written = cv::imwrite(file.string(), picture);
  } catch (const cv::Exception&) {
    written = false;  // an unknown extension; reported like every other failure
  }
  if (!written) throw InputError(file.string() + ": picture cannot be written");
}

}  // namespace pocd
