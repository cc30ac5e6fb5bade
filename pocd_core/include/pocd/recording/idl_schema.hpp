// Schema texts for recordings, made of the IDL that the types are generated from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pocd::recording {

struct SchemaText {
  std::string name;      ///< "sensor_msgs/msg/Image", or "pocd_msgs::msg::ObjectState"
  std::string encoding;  ///< "ros2msg" or "omgidl"
  std::string text;
};

/// The part of IDL that ROS types are written in: modules, structs with fields of primitive, string
/// and struct types, sequences and arrays of them, @final and @key, line comments, #include of each
/// other.
class IdlLibrary {
 public:
  /// By file name ("sensor_msgs.idl"). Throws InputError naming file, line and word for anything
  /// else.
  explicit IdlLibrary(const std::map<std::string, std::string>& files);

  bool has(const std::string& scoped_name) const { return structs_.count(scoped_name) > 0; }

  /// ROS message definition of "sensor_msgs::msg::Image": its fields, and after lines of 80 "="
  /// those of every type it needs. Throws InputError when it is not there.
  SchemaText ros2msg(const std::string& scoped_name) const;
  /// Instance that a CDR payload of a keyed type belongs to, as its handle on the bus: the key
  /// fields in big endian CDR, filled up with zeros. Nothing when the type's keys are not its first
  /// fields, are not numbers, take more than 16 bytes, or the payload is too short.
  std::optional<std::array<std::uint8_t, 16>> key_of(const std::string& scoped_name,
                                                     const std::uint8_t* payload,
                                                     std::size_t size) const;

  /// IDL of the type and all that it needs, each once, without preprocessor lines.
  SchemaText omgidl(const std::string& scoped_name) const;

 private:
  struct Field {
    std::string type;  // "uint32", "string", or a scoped name
    bool is_struct = false;
    std::string suffix;  // "", "[]" or "[36]"
    std::string name;
    bool key = false;
  };
  const std::vector<Field>& fields_of(const std::string& scoped_name) const;
  /// The types that a type needs, each after those it needs itself.
  void needed_by(const std::string& scoped_name, std::vector<std::string>& names) const;

  std::map<std::string, std::vector<Field>> structs_;
  friend class IdlParser;
};

}  // namespace pocd::recording
