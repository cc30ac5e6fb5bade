#include "pocd/recording/idl_schema.hpp"

#include <algorithm>
#include <cctype>

#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

/// IDL and ROS names of the primitive types.
const std::map<std::string, std::string>& primitives() {
  static const std::map<std::string, std::string> names{{"boolean", "bool"},
                                                        {"octet", "uint8"},
                                                        {"char", "char"},
                                                        {"int8", "int8"},
                                                        {"uint8", "uint8"},
                                                        {"short", "int16"},
                                                        {"unsigned short", "uint16"},
                                                        {"long", "int32"},
                                                        {"unsigned long", "uint32"},
                                                        {"long long", "int64"},
                                                        {"unsigned long long", "uint64"},
                                                        {"float", "float32"},
                                                        {"double", "float64"},
                                                        {"string", "string"}};
  return names;
}

std::string idl_name(const std::string& ros_primitive) {
  for (const auto& [idl, ros] : primitives()) {
    if (ros == ros_primitive && idl != "uint8") return idl;  // as the files write it
  }
  return ros_primitive;
}

struct Token {
  std::string text;
  int line = 0;
};

std::vector<Token> tokens_of(const std::string& text) {
  std::vector<Token> tokens;
  int line = 1;
  const auto word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '\n') {
      ++line, ++i;
    } else if (c == '#' || text.compare(i, 2, "//") == 0) {
      i = std::min(text.find('\n', i), text.size());
    } else if (std::isspace(static_cast<unsigned char>(c))) {
      ++i;
    } else if (word(c)) {
      const std::size_t begin = i;
      // A scoped name is one word.
      while (i < text.size() && (word(text[i]) || text.compare(i, 2, "::") == 0)) {
        i += text[i] == ':' ? 2 : 1;
      }
      tokens.push_back({text.substr(begin, i - begin), line});
    } else {
      tokens.push_back({std::string(1, c), line});
      ++i;
    }
  }
  return tokens;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// "sensor_msgs::msg::Image" -> "sensor_msgs/Image", as inside of message definitions.
std::string short_ros_name(const std::string& scoped_name) {
  return replaced(replaced(scoped_name, "::msg::", "/"), "::", "/");
}

}  // namespace

class IdlParser {
 public:
  IdlParser(std::string file, const std::string& text, IdlLibrary& library)
      : file_(std::move(file)), tokens_(tokens_of(text)), library_(library) {}

  void parse() {
    while (at_ < tokens_.size()) parse_definition("");
  }

 private:
  const Token& peek() const {
    if (at_ < tokens_.size()) return tokens_[at_];
    throw InputError(file_ + ": ends in the middle of a definition");
  }
  std::string take() {
    std::string text = peek().text;
    ++at_;
    return text;
  }
  void expect(const std::string& text) {
    if (peek().text != text) fail("expected '" + text + "'");
    ++at_;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(file_ + ":" + std::to_string(peek().line) + ": '" + peek().text +
                     "': " + what);
  }

  void parse_definition(const std::string& scope) {
    if (peek().text == "@") {
      take();
      if (peek().text != "final") fail("only @final is known here");
      take();
    }
    const std::string kind = peek().text;
    if (kind == "module") {
      take();
      const std::string inner = scope + take() + "::";
      expect("{");
      while (peek().text != "}") parse_definition(inner);
    } else if (kind == "struct") {
      take();
      const std::string name = scope + take();
      expect("{");
      std::vector<IdlLibrary::Field>& fields = library_.structs_[name];
      fields.clear();
      while (peek().text != "}") fields.push_back(parse_field());
    } else {
      fail("expected module or struct");
    }
    expect("}");
    expect(";");
  }

  void parse_type(IdlLibrary::Field& field) {
    std::string type = take();
    if (type == "unsigned" || (type == "long" && peek().text == "long")) type += " " + take();
    if (type == "unsigned long" && peek().text == "long") type += " " + take();
    const auto primitive = primitives().find(type);
    field.is_struct = primitive == primitives().end();
    field.type = field.is_struct ? type : primitive->second;
    if (field.is_struct && type.find("::") == std::string::npos) {
      --at_;
      fail("is no type (struct types are written with their modules)");
    }
  }

  IdlLibrary::Field parse_field() {
    IdlLibrary::Field field;
    if (peek().text == "@") {
      take();
      if (peek().text != "key") fail("only @key is known here");
      take();
      field.key = true;
    }
    if (peek().text == "sequence") {
      take();
      expect("<");
      parse_type(field);
      expect(">");
      field.suffix = "[]";
    } else {
      parse_type(field);
    }
    field.name = take();
    if (peek().text == "[") {
      take();
      if (!field.suffix.empty()) fail("an array of sequences is not known here");
      field.suffix = "[" + take() + "]";
      expect("]");
    }
    expect(";");
    return field;
  }

  std::string file_;
  std::vector<Token> tokens_;
  IdlLibrary& library_;
  std::size_t at_ = 0;
};

IdlLibrary::IdlLibrary(const std::map<std::string, std::string>& files) {
  for (const auto& [name, text] : files) IdlParser(name, text, *this).parse();
}

const std::vector<IdlLibrary::Field>& IdlLibrary::fields_of(const std::string& scoped_name) const {
  const auto found = structs_.find(scoped_name);
  if (found == structs_.end()) throw InputError("IDL: type " + scoped_name + " is not defined");
  return found->second;
}

void IdlLibrary::needed_by(const std::string& scoped_name, std::vector<std::string>& names) const {
  for (const Field& field : fields_of(scoped_name)) {
    if (!field.is_struct) continue;
    needed_by(field.type, names);
    if (std::find(names.begin(), names.end(), field.type) == names.end()) {
      names.push_back(field.type);
    }
  }
}

SchemaText IdlLibrary::ros2msg(const std::string& scoped_name) const {
  std::vector<std::string> names;
  needed_by(scoped_name, names);
  const auto definition = [this](const std::string& name) {
    std::string text;
    for (const Field& field : fields_of(name)) {
      text += (field.is_struct ? short_ros_name(field.type) : field.type) + field.suffix + " " +
              field.name + "\n";
    }
    return text;
  };
  SchemaText schema{replaced(scoped_name, "::", "/"), "ros2msg", definition(scoped_name)};
  for (const std::string& name : names) {
    schema.text +=
        std::string(80, '=') + "\nMSG: " + short_ros_name(name) + "\n" + definition(name);
  }
  return schema;
}

std::optional<std::array<std::uint8_t, 16>> IdlLibrary::key_of(const std::string& scoped_name,
                                                               const std::uint8_t* payload,
                                                               std::size_t size) const {
  static const std::map<std::string, std::size_t> sizes{
      {"bool", 1},   {"uint8", 1}, {"int8", 1},   {"char", 1},  {"int16", 2},
      {"uint16", 2}, {"int32", 4}, {"uint32", 4}, {"int64", 8}, {"uint64", 8}};
  const std::vector<Field>& fields = fields_of(scoped_name);
  constexpr std::size_t kHeader = 4;
  if (size < kHeader || payload[0] != 0 || payload[1] > 1) return std::nullopt;
  const bool little = payload[1] == 1;
  std::array<std::uint8_t, 16> key{};
  std::size_t at = 0;
  bool keys_over = false;
  for (const Field& field : fields) {
    keys_over = keys_over || !field.key;
    if (!field.key) continue;
    const auto element = sizes.find(field.type);
    if (keys_over || element == sizes.end() || field.suffix == "[]") return std::nullopt;
    const std::size_t n = element->second;
    std::size_t count = field.suffix.empty() ? 1 : std::stoul(field.suffix.substr(1));
    for (at = (at + n - 1) / n * n; count > 0; --count, at += n) {
      if (at + n > key.size() || kHeader + at + n > size) return std::nullopt;
      for (std::size_t i = 0; i < n; ++i) {
        key[at + i] = payload[kHeader + at + (little ? n - 1 - i : i)];
      }
    }
  }
  if (at == 0) return std::nullopt;
  return key;
}

SchemaText IdlLibrary::omgidl(const std::string& scoped_name) const {
  std::vector<std::string> names;
  needed_by(scoped_name, names);
  names.push_back(scoped_name);
  SchemaText schema{scoped_name, "omgidl", ""};
  for (const std::string& name : names) {
    std::string modules = name, ends;
    for (std::size_t at; (at = modules.find("::")) != std::string::npos; ends += "};\n") {
      schema.text += "module " + modules.substr(0, at) + " {\n";
      modules.erase(0, at + 2);
    }
    schema.text += "@final\nstruct " + modules + " {\n";
    for (const Field& field : fields_of(name)) {
      const std::string type = field.is_struct ? field.type : idl_name(field.type);
      const bool sequence = field.suffix == "[]";
      schema.text += std::string(field.key ? "  @key " : "  ") +
                     (sequence ? "sequence<" + type + ">" : type) + " " + field.name +
                     (sequence ? "" : field.suffix) + ";\n";
    }
    schema.text += "};\n" + ends;
  }
  return schema;
}

}  // namespace pocd::recording
