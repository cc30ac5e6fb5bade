#include "pocd/input/suggest_input.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "pocd/input/input_topics.hpp"

namespace pocd {
namespace {

constexpr char kImage[] = "sensor_msgs/msg/Image";
constexpr char kCompressedImage[] = "sensor_msgs/msg/CompressedImage";
constexpr std::size_t kMostListed = 20;

using Parts = std::vector<std::string>;

/// "rt/a/b" -> a, b.
Parts parts_of(const std::string& topic) {
  Parts parts;
  const bool ros = topic.compare(0, 3, "rt/") == 0;
  for (std::size_t at = ros ? 3 : 0; at <= topic.size();) {
    const std::size_t end = std::min(topic.find('/', at), topic.size());
    if (end > at) parts.push_back(topic.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

bool has(const std::string& text, const std::string& word) {
  return text.find(word) != std::string::npos;
}
bool has_any(const std::string& text, const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& word) { return has(text, word); });
}

bool is_stereo_depth(const Parts& parts) {
  return parts.size() > 1 && parts[parts.size() - 2] == "stereo" && parts.back() == "image_raw";
}

/// What tells one camera from another: the parts before the one about depth.
Parts camera_of(const Parts& parts) {
  const auto depth = std::find_if(parts.begin(), parts.end(), [](const std::string& part) {
    return has(part, "depth") || part == "stereo";
  });
  return Parts(parts.begin(), depth);
}

bool is_depth(const TopicInfo& info) {
  const bool compressed = info.type == kCompressedImage;
  if (info.type != kImage && !compressed) return false;
  const Parts parts = parts_of(info.topic);
  if (parts.empty()) return false;
  if (compressed && parts.back() != "compressedDepth") return false;
  if (has_any(info.topic, {"confidence", "disparity", "theora", "mask", "/infra"})) return false;
  return has(info.topic, "depth") || is_stereo_depth(parts);
}

bool is_mask(const TopicInfo& info) {
  if (info.type != kImage && info.type != kCompressedImage) return false;
  if (info.type == kCompressedImage && !is_compressed_name(info.topic)) return false;
  return has_any(info.topic, {"segmentation", "semantic", "mask", "label"}) &&
         !has_any(info.topic, {"colored", "overlay", "visual"});
}

int rank_of_depth(const TopicInfo& info) {
  return (info.type == kImage ? 4 : 0) + (has_any(info.topic, {"aligned", "registered"}) ? 2 : 0) +
         (has(info.topic, "image_r") ? 1 : 0);
}

std::size_t common(const Parts& a, const Parts& b) {
  const auto ends = std::mismatch(
      a.begin(), a.begin() + static_cast<std::ptrdiff_t>(std::min(a.size(), b.size())), b.begin());
  return static_cast<std::size_t>(ends.first - a.begin());
}

/// The topic that shares most of its name with the camera's; of equal ones the shortest, then the
/// first. With several robots, it must at least be this one's.
std::string nearest(const std::vector<TopicInfo>& topics, const Parts& depth, bool several,
                    const std::function<bool(const TopicInfo&)>& fits) {
  std::string best;
  std::size_t best_common = 0;
  for (const TopicInfo& info : topics) {
    if (!fits(info)) continue;
    const std::size_t shared = common(parts_of(info.topic), depth);
    if (several && shared == 0) continue;
    const bool better = best.empty() || shared > best_common ||
                        (shared == best_common && info.topic.size() < best.size());
    if (!better) continue;
    best = info.topic;
    best_common = shared;
  }
  return best;
}

std::string joined(const Parts& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "_") + part;
  return text;
}

}  // namespace

std::string ros_type_name(const std::string& dds_type) {
  const std::size_t at = dds_type.find("::dds_::");
  if (at == std::string::npos || dds_type.back() != '_') return dds_type;
  std::string name = dds_type.substr(0, at + 2) + dds_type.substr(at + 8, dds_type.size() - at - 9);
  for (std::size_t colons = 0; (colons = name.find("::")) != std::string::npos;) {
    name.replace(colons, 2, "/");
  }
  return name;
}

std::vector<RobotConfig> suggest_robots(const std::vector<TopicInfo>& topics) {
  std::map<Parts, TopicInfo> cameras;
  for (const TopicInfo& info : topics) {
    if (!is_depth(info)) continue;
    const auto [known, fresh] = cameras.emplace(camera_of(parts_of(info.topic)), info);
    if (!fresh && rank_of_depth(info) > rank_of_depth(known->second)) known->second = info;
  }
  std::map<std::string, int> first_parts;
  for (const auto& [camera, depth] : cameras) ++first_parts[camera.empty() ? "" : camera[0]];
  const bool several = first_parts.size() > 1;
  std::vector<RobotConfig> robots;
  for (const auto& [camera, depth] : cameras) {
    RobotConfig robot;
    const std::string first = camera.empty() ? "" : camera[0];
    robot.name = camera.empty() ? "robot" : first_parts[first] > 1 ? joined(camera) : first;
    robot.depth_topic = depth.topic;
    const Parts parts = parts_of(depth.topic);
    const auto of_type = [&](const std::string& type) {
      return nearest(topics, parts, several,
                     [&](const TopicInfo& info) { return info.type == type; });
    };
    robot.camera_info_topic = of_type(ros_type(InputStream::kCameraInfo));
    robot.odometry_topic = of_type(ros_type(InputStream::kOdometry));
    robot.segmentation_topic = nearest(topics, parts, several, [&](const TopicInfo& info) {
      return is_mask(info) && info.topic != depth.topic;
    });
    const std::string own_tf = nearest(topics, parts, true, [&](const TopicInfo& info) {
      return info.type == ros_type(InputStream::kTf) && parts_of(info.topic).back() == "tf";
    });
    if (!own_tf.empty()) {
      robot.tf_topic = own_tf;
      robot.tf_static_topic = own_tf + "_static";
    }
    robots.push_back(std::move(robot));
  }
  return robots;
}

std::string suggestion_yaml(const std::vector<RobotConfig>& robots) {
  if (robots.empty()) return "";
  std::string yaml = "node:\n  robots:\n";
  for (const RobotConfig& robot : robots) {
    yaml += "    - name: " + robot.name + "\n";
    const auto add = [&](const char* key, const std::string& topic) {
      if (!topic.empty()) yaml += std::string("      ") + key + ": " + topic + "\n";
    };
    add("depth_topic", robot.depth_topic);
    add("camera_info_topic", robot.camera_info_topic);
    add("segmentation_topic", robot.segmentation_topic);
    add("odometry_topic", robot.odometry_topic);
    add("tf_topic", robot.tf_topic);
    add("tf_static_topic", robot.tf_static_topic);
  }
  return yaml;
}

std::string suggestion_text(const std::vector<TopicInfo>& topics) {
  std::string list;
  std::size_t listed = 0, more = 0;
  std::set<std::string> told;
  for (const TopicInfo& info : topics) {
    if ((info.type != kImage && info.type != kCompressedImage) || !told.insert(info.topic).second) {
      continue;
    }
    if (listed++ < kMostListed) {
      list += (list.empty() ? "" : ", ") + info.topic;
    } else {
      ++more;
    }
  }
  if (list.empty()) return "there is no image topic at all";
  if (more > 0) list += " and " + std::to_string(more) + " more";
  std::string text = "image topics are: " + list;
  const std::vector<RobotConfig> robots = suggest_robots(topics);
  if (robots.empty()) return text;
  // The first part of the name stands for the robot, where there is one.
  const auto pattern = [&](const std::string& topic) {
    const Parts parts = parts_of(topic);
    const bool ros = topic.compare(0, 3, "rt/") == 0;
    if (parts.size() < 2 || parts[0] != parts_of(robots[0].depth_topic)[0]) return topic;
    return (ros ? "rt/" : "") + std::string("{robot}") +
           topic.substr((ros ? 3 : 0) + parts[0].size());
  };
  text += "; try --set 'node.topics.depth=" + pattern(robots[0].depth_topic) + "'";
  if (!robots[0].camera_info_topic.empty()) {
    text += " --set 'node.topics.camera_info=" + pattern(robots[0].camera_info_topic) + "'";
  }
  return text;
}

}  // namespace pocd
