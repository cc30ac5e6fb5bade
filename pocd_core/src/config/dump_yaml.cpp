#include <yaml-cpp/yaml.h>

#include "../common/parameter_text.hpp"
#include "pocd/common/check.hpp"
#include "pocd/config/config_io.hpp"

namespace pocd::config_detail {
namespace {

class Dumper final : public ParameterSink {
 public:
  explicit Dumper(YAML::Emitter& out) : out_(out) {}

  void real(const char* name, double& value, const Range&, const char*) override {
    out_ << YAML::Key << name << YAML::Value << number_text(value);
  }
  void integer(const char* name, int& value, const Range&, const char*) override {
    out_ << YAML::Key << name << YAML::Value << value;
  }
  void natural(const char* name, std::uint64_t& value, const Range&, const char*) override {
    out_ << YAML::Key << name << YAML::Value << value;
  }
  void boolean(const char* name, bool& value, const char*) override {
    out_ << YAML::Key << name << YAML::Value << (value ? "true" : "false");
  }
  void text(const char* name, std::string& value, const char*) override {
    out_ << YAML::Key << name << YAML::Value << YAML::DoubleQuoted << value;
  }
  void choice(const char* name, std::string& word, const std::vector<std::string>&,
              const char*) override {
    out_ << YAML::Key << name << YAML::Value << word;
  }
  void texts(const char* name, std::vector<std::string>& values, const char*) override {
    out_ << YAML::Key << name << YAML::Value << YAML::BeginSeq;
    for (const std::string& value : values) out_ << YAML::DoubleQuoted << value;
    out_ << YAML::EndSeq;
  }
  void items(const char* name, ItemList& list, const char*) override {
    out_ << YAML::Key << name << YAML::Value << YAML::BeginSeq;
    for (std::size_t i = 0; i < list.size(); ++i) {
      out_ << YAML::BeginMap;
      list.describe_item(i, *this);
      out_ << YAML::EndMap;
    }
    out_ << YAML::EndSeq;
  }
  void begin_group(const char* name, const char*) override {
    out_ << YAML::Key << name << YAML::Value << YAML::BeginMap;
  }
  void end_group() override { out_ << YAML::EndMap; }

 private:
  YAML::Emitter& out_;
};

}  // namespace

std::string dump(const ShowTo& show) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  Dumper dumper(out);
  show(dumper);
  out << YAML::EndMap;
  POCD_CHECK(out.good());
  return std::string(out.c_str()) + "\n";
}

}  // namespace pocd::config_detail
