#include <cstring>
#include <fstream>

#include "bytes.hpp"
#include "pocd/common/check.hpp"
#include "pocd/map/mesh.hpp"

namespace pocd {
namespace {

void put_float(std::vector<std::uint8_t>& out, float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  put(out, bits);
}

}  // namespace

void write_ply(const Mesh& mesh, const AppearanceOf& appearance,
               const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\ncomment metres, map frame\nelement vertex "
      << mesh.vertices_W.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
         "property uchar green\nproperty uchar blue\nproperty ushort class\nproperty uint object\n"
         "element face "
      << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::vector<std::uint8_t> bytes;
  bytes.reserve(mesh.vertices_W.size() * 21 + mesh.triangles.size() * 13);
  std::map<std::uint32_t, OwnerAppearance> looks;
  for (std::size_t i = 0; i < mesh.vertices_W.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) put_float(bytes, mesh.vertices_W[i][axis]);
    auto look = looks.find(mesh.owner[i]);
    if (look == looks.end()) look = looks.emplace(mesh.owner[i], appearance(mesh.owner[i])).first;
    for (const std::uint8_t c : look->second.rgb) bytes.push_back(c);
    put(bytes, look->second.class_id);
    put(bytes, mesh.owner[i]);
  }
  for (const auto& triangle : mesh.triangles) {
    bytes.push_back(3);
    for (const std::uint32_t v : triangle) put(bytes, v);
  }
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw InputError(file.string() + ": cannot be written");
}

}  // namespace pocd
