#include "pocd/sim/triangle_mesh.hpp"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "pocd/common/check.hpp"

namespace pocd {
namespace {

/// One device for the process; scenes keep it alive. A fixed instruction set gives the same bits on
/// every processor, one thread the same tree.
RTCDevice device() {
#if defined(__x86_64__)
  static const RTCDevice shared = rtcNewDevice("threads=1,set_affinity=0,isa=sse4.2");
#else
  static const RTCDevice shared = rtcNewDevice("threads=1,set_affinity=0");
#endif
  POCD_CHECK(shared != nullptr);
  return shared;
}

RTCRayHit make_ray(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float t_near,
                   float t_far) {
  RTCRayHit query{};
  query.ray.org_x = origin.x(), query.ray.org_y = origin.y(), query.ray.org_z = origin.z();
  query.ray.dir_x = direction.x(), query.ray.dir_y = direction.y();
  query.ray.dir_z = direction.z();
  query.ray.tnear = t_near;
  query.ray.tfar = t_far;
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return query;
}

/// Closest point of a triangle (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
Eigen::Vector3d closest_point(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                              const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return a;
  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 - d3 > 0.0) return a + d1 / (d1 - d3) * ab;
  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 - d6 > 0.0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  const double along = (d4 - d3) + (d5 - d6);
  if (va <= 0.0 && d4 >= d3 && d5 >= d6 && along > 0.0) return b + (d4 - d3) / along * (c - b);
  const double sum = va + vb + vc;
  if (!(sum > 0.0)) return a;  // no area
  return a + vb / sum * ab + vc / sum * ac;
}

struct Nearest {
  const TriangleMesh* mesh;
  Eigen::Vector3d point;
  double best_m;
};

bool visit_triangle(RTCPointQueryFunctionArguments* args) {
  auto& nearest = *static_cast<Nearest*>(args->userPtr);
  const auto& v = nearest.mesh->vertices();
  const Eigen::Vector3i& t = nearest.mesh->triangles()[args->primID];
  const Eigen::Vector3d q = closest_point(nearest.point, v[t.x()].cast<double>(),
                                          v[t.y()].cast<double>(), v[t.z()].cast<double>());
  const double distance_m = (q - nearest.point).norm();
  if (distance_m >= nearest.best_m) return false;
  nearest.best_m = distance_m;
  // The tree is searched in single precision: a little wider, so that rounding skips nothing.
  args->query->radius = static_cast<float>(distance_m * 1.0001 + 1e-6);
  return true;
}

}  // namespace

struct TriangleMesh::Tree {
  RTCScene scene = nullptr;
  ~Tree() {
    if (scene != nullptr) rtcReleaseScene(scene);
  }
};

TriangleMesh::TriangleMesh(std::vector<Eigen::Vector3f> vertices,
                           std::vector<Eigen::Vector3i> triangles, const std::string& source)
    : vertices_(std::move(vertices)),
      triangles_(std::move(triangles)),
      tree_(std::make_unique<Tree>()) {
  if (triangles_.empty()) throw InputError(source + ": has no triangles");
  const int count = static_cast<int>(vertices_.size());
  for (const Eigen::Vector3i& triangle : triangles_) {
    if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= count) {
      throw InputError(source + ": a triangle has a vertex outside of [0, " +
                       std::to_string(count) + ")");
    }
  }
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array3f high = -low;
  for (const Eigen::Vector3f& vertex : vertices_) {
    if (!vertex.allFinite()) throw InputError(source + ": has a vertex that is not finite");
    low = low.min(vertex.array()), high = high.max(vertex.array());
  }
  const Eigen::Vector3f middle = (0.5f * (low + high)).matrix();
  Eigen::Vector3f reach = Eigen::Vector3f::Zero();
  for (Eigen::Vector3f& vertex : vertices_) {
    vertex -= middle;
    reach = reach.cwiseMax(vertex.cwiseAbs());
  }
  size_m_ = 2.0 * reach.cast<double>();
  if (!(size_m_.minCoeff() > 0.0)) {
    throw InputError(source + ": has no extent along one of its axes");
  }

  const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* points = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              3 * sizeof(float), vertices_.size()));
  auto* corners = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), triangles_.size()));
  POCD_CHECK(points != nullptr && corners != nullptr);
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    for (int k = 0; k < 3; ++k) points[3 * i + k] = vertices_[i][k];
  }
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    for (int k = 0; k < 3; ++k) corners[3 * i + k] = static_cast<unsigned>(triangles_[i][k]);
  }
  rtcCommitGeometry(geometry);
  tree_->scene = rtcNewScene(device());
  rtcSetSceneFlags(tree_->scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips through between triangles
  rtcAttachGeometry(tree_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(tree_->scene);
  POCD_CHECK(rtcGetDeviceError(device()) == RTC_ERROR_NONE);
}

TriangleMesh::~TriangleMesh() = default;

float TriangleMesh::cast(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                         float t_near, float t_far) const {
  RTCRayHit query = make_ray(origin, direction, t_near, t_far);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(tree_->scene, &context, &query);
  return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? t_far : query.ray.tfar;
}

std::optional<TriangleMesh::Hit> TriangleMesh::cast_with_normal(const Eigen::Vector3f& origin,
                                                                const Eigen::Vector3f& direction,
                                                                float t_near, float t_far) const {
  RTCRayHit query = make_ray(origin, direction, t_near, t_far);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(tree_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  Hit hit;
  hit.t = query.ray.tfar;
  hit.normal = Eigen::Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  if (hit.normal.dot(direction) > 0.0f) hit.normal = -hit.normal;
  return hit;
}

double TriangleMesh::distance_m(const Eigen::Vector3d& point, double limit_m) const {
  Nearest nearest{this, point, limit_m};
  RTCPointQuery query{};
  query.x = static_cast<float>(point.x()), query.y = static_cast<float>(point.y());
  query.z = static_cast<float>(point.z());
  query.radius = static_cast<float>(limit_m * 1.0001 + 1e-6);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(tree_->scene, &query, &context, visit_triangle, &nearest);
  return nearest.best_m;
}

double TriangleMesh::area_m2() const {
  double sum = 0.0;
  for (const Eigen::Vector3i& t : triangles_) {
    const Eigen::Vector3d a = vertices_[t.x()].cast<double>();
    sum += 0.5 * (vertices_[t.y()].cast<double>() - a)
                     .cross(vertices_[t.z()].cast<double>() - a)
                     .norm();
  }
  return sum;
}

std::vector<Eigen::Vector3f> TriangleMesh::sample(std::size_t count) const {
  std::vector<Eigen::Vector3f> out;
  out.reserve(count);
  const double step = area_m2() / static_cast<double>(std::max<std::size_t>(count, 1));
  double passed = 0.0;
  for (const Eigen::Vector3i& t : triangles_) {
    const Eigen::Vector3f a = vertices_[t.x()], b = vertices_[t.y()], c = vertices_[t.z()];
    passed += 0.5 * (b - a).cast<double>().cross((c - a).cast<double>()).norm();
    while (out.size() < count && (static_cast<double>(out.size()) + 0.5) * step <= passed) {
      // Additive recurrence of the plastic number spreads the points within their triangle.
      const double i = static_cast<double>(out.size());
      double x = std::fmod(0.5 + 0.7548776662466927 * i, 1.0);
      double y = std::fmod(0.5 + 0.5698402909980532 * i, 1.0);
      if (x + y > 1.0) x = 1.0 - x, y = 1.0 - y;
      out.push_back(a + static_cast<float>(x) * (b - a) + static_cast<float>(y) * (c - a));
    }
  }
  return out;
}

}  // namespace pocd
