#include <charconv>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "pocd/common/check.hpp"
#include "pocd/sim/triangle_mesh.hpp"

namespace pocd {
namespace {

/// What describes no surface, or only its looks.
const std::set<std::string> kNotUsed = {"vn", "vt", "vp", "g", "o", "s", "l", "p", "usemtl",
                                        "mtllib"};

template <class T>
T parse(const std::string& word, const std::string& text, const std::string& where,
        const char* what) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw InputError(where + ": '" + word + "' is no " + what);
  }
  return value;
}

/// A corner "v", "v/t", "v//n" or "v/t/n"; negative numbers count back from the last vertex.
int corner(const std::string& word, int vertices, const std::string& where) {
  const int number = parse<int>(word, word.substr(0, word.find('/')), where, "vertex");
  const int index = number < 0 ? vertices + number : number - 1;
  if (number == 0 || index < 0 || index >= vertices) {
    throw InputError(where + ": there is no vertex '" + word + "', only " +
                     std::to_string(vertices) + " so far");
  }
  return index;
}

}  // namespace

std::shared_ptr<const TriangleMesh> load_obj(const std::filesystem::path& file, double scale) {
  std::ifstream in(file);
  if (!in || std::filesystem::is_directory(file)) {
    throw InputError(file.string() + ": cannot be read");
  }
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3i> triangles;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string where = file.string() + ":" + std::to_string(number);
    std::istringstream words(line);
    std::string key, word;
    if (!(words >> key) || key[0] == '#') continue;
    if (key == "v") {
      Eigen::Vector3f vertex;
      for (int k = 0; k < 3; ++k) {
        if (!(words >> word)) throw InputError(where + ": a vertex needs 3 coordinates");
        vertex[k] = static_cast<float>(scale * parse<double>(word, word, where, "number"));
        if (!std::isfinite(vertex[k])) throw InputError(where + ": '" + word + "' is not finite");
      }
      vertices.push_back(vertex);
    } else if (key == "f") {
      std::vector<int> corners;
      while (words >> word) {
        corners.push_back(corner(word, static_cast<int>(vertices.size()), where));
      }
      if (corners.size() < 3) throw InputError(where + ": a face needs 3 corners");
      for (std::size_t k = 2; k < corners.size(); ++k) {
        triangles.emplace_back(corners[0], corners[k - 1], corners[k]);
      }
    } else if (kNotUsed.count(key) == 0) {
      throw InputError(where + ": unknown keyword '" + key + "'");
    }
  }
  return std::make_shared<const TriangleMesh>(std::move(vertices), std::move(triangles),
                                              file.string());
}

}  // namespace pocd
