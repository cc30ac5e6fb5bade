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
  if (compressed && parts.back() != "compressedDepth" && parts.back() != "compressed") return false;
  if (has_any(info.topic, {"confidence", "disparity", "theora", "mask", "/infra"})) return false;
  return has(info.topic, "depth") || is_stereo_depth(parts);
}

bool is_mask(const TopicInfo& info) {
  if (info.type != kImage && info.type != kCompressedImage) return false;
  if (info.type == kCompressedImage && !is_compressed_name(info.topic)) return false;
  return has_any(info.topic, {"segmentation", "semantic", "mask", "label"}) &&
         !has_any(info.topic, {"colored", "overlay", "visual"});
}

/// On /compressed depth can be a PNG, but is a JPEG as often, of which nothing can be used.
int rank_of_depth(const TopicInfo& info) {
  const int form = info.type == kImage ? 4 : parts_of(info.topic).back() == "compressed" ? -8 : 0;
  return form + (has_any(info.topic, {"aligned", "registered"}) ? 2 : 0) +
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

/// "rt/a/b" -> "rt/{robot}/b" for robot a; without such a part the topic itself.
std::string pattern_for(const std::string& topic, const std::string& robot) {
  const bool ros = topic.compare(0, 3, "rt/") == 0;
  std::string pattern = ros ? "rt" : "";
  bool found = false;
  for (const std::string& part : parts_of(topic)) {
    pattern += pattern.empty() ? "" : "/";
    pattern += part == robot && !found ? "{robot}" : part;
    found = found || part == robot;
  }
  return found ? pattern : topic;
}

bool has_place_for_robot(const std::string& pattern) { return has(pattern, "{robot}"); }

/// As it is pasted: text that begins with a brace would be a group of keys in YAML.
std::string set_option(const std::string& key, const std::string& pattern) {
  const std::string quote = pattern[0] == '{' ? "\"" : "";
  return " --set 'node.topics." + key + "=" + quote + pattern + quote + "'";
}

/// Key in node.topics and pattern, of what was found for a robot.
using Patterns = std::vector<std::pair<std::string, std::string>>;
Patterns patterns_of(const RobotConfig& robot, const std::string& name) {
  const TopicPatterns usual;
  Patterns patterns;
  const auto add = [&](const char* key, const std::string& topic, const std::string& unless) {
    const std::string pattern = pattern_for(topic, name);
    if (!topic.empty() && pattern != unless) patterns.emplace_back(key, pattern);
  };
  add("depth", robot.depth_topic, "");
  add("camera_info", robot.camera_info_topic, "");
  add("segmentation", robot.segmentation_topic, usual.segmentation);
  add("odometry", robot.odometry_topic, usual.odometry);
  add("tf", robot.tf_topic, usual.tf);
  add("tf_static", robot.tf_static_topic, usual.tf_static);
  return patterns;
}

/// The parts in which the depth topics of the cameras differ, one each; else their names.
std::vector<std::string> names_of(const std::vector<RobotConfig>& robots) {
  std::vector<std::string> names, parts;
  const Parts first = parts_of(robots[0].depth_topic);
  for (const RobotConfig& robot : robots) {
    names.push_back(robot.name);
    const Parts other = parts_of(robots.size() > 1 && &robot == &robots[0] ? robots[1].depth_topic
                                                                           : robot.depth_topic);
    const std::size_t at = common(first, other);
    const Parts own = parts_of(robot.depth_topic);
    if (at < own.size()) parts.push_back(own[at]);
  }
  return robots.size() > 1 && parts.size() == robots.size() ? parts : names;
}

/// Options that name the topics of all these cameras; "" when none do.
std::string options_for(const std::vector<RobotConfig>& robots) {
  const std::vector<std::string> names = names_of(robots);
  const Patterns patterns = patterns_of(robots[0], names[0]);
  for (std::size_t i = 1; i < robots.size(); ++i) {
    if (patterns_of(robots[i], names[i]) != patterns) return "";
  }
  std::string sets, whom;
  bool shared = false;
  for (const auto& [key, pattern] : patterns) {
    shared = shared || !has_place_for_robot(pattern);
    sets += set_option(key, pattern);
  }
  // A robot is found by its name in the topics; where that is not in all of them, it is named.
  for (const std::string& name : names) whom += shared ? " --robot " + name : "";
  return (whom + sets).substr(1);
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kMostListed); ++i) {
    list += (list.empty() ? "" : ", ") + names[i];
  }
  if (names.size() > kMostListed) {
    list += " and " + std::to_string(names.size() - kMostListed) + " more";
  }
  return list;
}

/// Each once, in the given order.
std::vector<std::string> names_if(const std::vector<TopicInfo>& topics,
                                  const std::function<bool(const TopicInfo&)>& fits, bool types) {
  std::vector<std::string> names;
  std::set<std::string> told;
  for (const TopicInfo& info : topics) {
    if (!fits(info) || !told.insert(info.topic).second) continue;
    names.push_back(info.topic + (types ? " (" + info.type + ")" : ""));
  }
  return names;
}

std::string joined(const Parts& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "_") + part;
  return text;
}

}  // namespace

std::string ros_type_name(const std::string& type) {
  const std::size_t at = type.find("::dds_::");
  if (at != std::string::npos && type.back() == '_') {
    std::string name = type.substr(0, at + 2) + type.substr(at + 8, type.size() - at - 9);
    for (std::size_t colons = 0; (colons = name.find("::")) != std::string::npos;) {
      name.replace(colons, 2, "/");
    }
    return name;
  }
  const std::size_t slash = type.find('/');
  if (slash == std::string::npos || type.find('/', slash + 1) != std::string::npos) return type;
  return type.substr(0, slash) + "/msg" + type.substr(slash);
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
  const auto is_image = [](const TopicInfo& info) {
    return info.type == kImage || info.type == kCompressedImage;
  };
  const std::vector<std::string> images = names_if(topics, is_image, false);
  if (images.empty()) {
    const auto all = names_if(
        topics, [](const TopicInfo&) { return true; }, true);
    return all.empty() ? "there is no topic at all"
                       : "there is no image topic; topics are: " + listed(all);
  }
  const std::string text = "image topics are: " + listed(images);
  const std::vector<RobotConfig> robots = suggest_robots(topics);
  if (robots.empty()) return text;
  if (const std::string options = options_for(robots); !options.empty()) {
    return text + "; try " + options;
  }
  return text + "; for the first try " + options_for({robots[0]}) +
         "; a configuration for all is printed by pocd_info --suggest FILE, and on the bus by "
         "pocd_doctor --suggest";
}

std::string instead_of(InputStream stream, const RobotConfig& robot, const InputConfig& input,
                       const std::vector<TopicInfo>& topics) {
  const bool pose = stream != InputStream::kCameraInfo && stream != InputStream::kSegmentation;
  const InputTopics used(input);  // and so no news, whoever's they are
  const auto is_of_another = [&](const std::string& topic) {
    const Parts parts = parts_of(topic);
    return std::any_of(input.robots.begin(), input.robots.end(), [&](const RobotConfig& other) {
      return other.name != robot.name &&
             std::find(parts.begin(), parts.end(), other.name) != parts.end();
    });
  };
  const auto is = [](const TopicInfo& info, InputStream of) { return info.type == ros_type(of); };
  const auto fits = [&](const TopicInfo& info) {
    if (!used.find(info.topic).empty() || is_of_another(info.topic)) return false;
    if (stream == InputStream::kSegmentation) return is_mask(info);
    return is(info, stream) || (pose && is(info, InputStream::kTf));
  };
  const std::vector<std::string> names = names_if(topics, fits, pose);
  if (names.empty()) return "";
  const Parts depth = parts_of(topic_of(input, robot, InputStream::kDepth));
  std::string best = nearest(topics, depth, false, [&](const TopicInfo& info) {
    return fits(info) && (!pose || is(info, InputStream::kOdometry));
  });
  Patterns patterns;
  const auto add = [&](const char* key, const std::string& topic) {
    if (!topic.empty()) patterns.emplace_back(key, pattern_for(topic, robot.name));
  };
  add(stream == InputStream::kCameraInfo     ? "camera_info"
      : stream == InputStream::kSegmentation ? "segmentation"
                                             : "odometry",
      best);
  if (pose && best.empty()) {
    best = nearest(topics, depth, false, [&](const TopicInfo& info) {
      return fits(info) && parts_of(info.topic).back() == "tf";
    });
    add("tf", best);
    if (!best.empty()) add("tf_static", best + "_static");
  }
  const bool named = std::any_of(input.robots.begin(), input.robots.end(),
                                 [&](const RobotConfig& r) { return r.name == robot.name; });
  std::string options;
  for (const auto& [key, pattern] : patterns) {
    if (!named && options.empty() && !has_place_for_robot(pattern)) {
      options += " --robot " + robot.name;
    }
    options += set_option(key, pattern);
  }
  return "there is " + listed(names) + (options.empty() ? "" : "; try" + options);
}

}  // namespace pocd
