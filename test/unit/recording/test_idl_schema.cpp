#include "pocd/recording/idl_schema.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "pocd/common/check.hpp"
#include "pocd/recording/cdr.hpp"

namespace pocd::recording {
namespace {

using Files = std::map<std::string, std::string>;

const char kNested[] =
    "#include \"other.idl\"\n// words { that } are no code\nmodule a { module msg {\n"
    "@final struct Inner { long x; };\n"
    "@final struct Outer {\n  @key octet id[16];\n  sequence<a::msg::Inner> list;\n"
    "  unsigned long long big;\n  double matrix[9];\n  string name;\n  boolean on;\n};\n}; };\n";

TEST(IdlSchema, RosDefinitionsHaveTheirDependenciesBehindALine) {
  const SchemaText schema = IdlLibrary(Files{{"a.idl", kNested}}).ros2msg("a::msg::Outer");
  EXPECT_EQ(schema.name, "a/msg/Outer");
  EXPECT_EQ(schema.encoding, "ros2msg");
  EXPECT_EQ(schema.text,
            "uint8[16] id\na/Inner[] list\nuint64 big\nfloat64[9] matrix\nstring name\nbool on\n" +
                std::string(80, '=') + "\nMSG: a/Inner\nint32 x\n");
}

TEST(IdlSchema, IdlIsSelfContained) {
  const SchemaText schema = IdlLibrary(Files{{"a.idl", kNested}}).omgidl("a::msg::Outer");
  EXPECT_EQ(schema.name, "a::msg::Outer");
  EXPECT_EQ(schema.text,
            "module a {\nmodule msg {\n@final\nstruct Inner {\n  long x;\n};\n};\n};\n"
            "module a {\nmodule msg {\n@final\nstruct Outer {\n  @key octet id[16];\n"
            "  sequence<a::msg::Inner> list;\n  unsigned long long big;\n  double matrix[9];\n"
            "  string name;\n  boolean on;\n};\n};\n};\n");
  // What it writes it can read.
  EXPECT_EQ(IdlLibrary(Files{{"b.idl", schema.text}}).omgidl("a::msg::Outer").text, schema.text);
}

TEST(IdlSchema, ReadsTheProjectsOwnFiles) {
  std::map<std::string, std::string> files;
  const auto folder = std::filesystem::path(POCD_SOURCE_DIR) / "pocd_msgs" / "idl";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream in(entry.path());
    files[entry.path().filename().string()] = std::string(std::istreambuf_iterator<char>(in), {});
  }
  ASSERT_FALSE(files.empty());
  const IdlLibrary library(files);
  const std::string image = library.ros2msg("sensor_msgs::msg::Image").text;
  EXPECT_EQ(image,
            "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
            "uint8 is_bigendian\nuint32 step\nuint8[] data\n" +
                std::string(80, '=') +
                "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" +
                std::string(80, '=') +
                "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n");
  EXPECT_TRUE(library.has("pocd_msgs::msg::FrameRecord"));
  EXPECT_THROW(library.ros2msg("no::such::Type"), InputError);
}

TEST(IdlSchema, KeysAreTheHandlesOnTheBus) {
  const IdlLibrary library(
      Files{{"k.idl",
             "module k { struct Tile { @key unsigned long map; @key long x; @key short y;"
             " @key octet z; double v; }; struct None { long a; }; struct Late { long a;"
             " @key long b; }; struct Long { @key octet id[17]; }; };"}});
  CdrWriter out;
  out.number(std::uint32_t{0x01020304});
  out.number(std::int32_t{-2});
  out.number(std::int16_t{0x0506});
  out.number(std::uint8_t{7});
  const Bytes& p = out.bytes();
  const std::array<std::uint8_t, 16> expected{1, 2, 3, 4, 255, 255, 255, 254, 5, 6, 7};
  EXPECT_EQ(library.key_of("k::Tile", p.data(), p.size()), expected);
  EXPECT_FALSE(library.key_of("k::Tile", p.data(), p.size() - 1));
  EXPECT_FALSE(library.key_of("k::None", p.data(), p.size()));
  EXPECT_FALSE(library.key_of("k::Late", p.data(), p.size()));
  const Bytes longer(30, 0);
  EXPECT_FALSE(library.key_of("k::Long", longer.data(), longer.size()));
}

TEST(IdlSchema, NamesFileAndLineOfWhatItDoesNotKnow) {
  const auto error_of = [](const char* text) {
    try {
      IdlLibrary(Files{{"x.idl", text}});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(error_of("module a {\nunion U {};\n};"), "x.idl:2: 'union': expected module or struct");
  EXPECT_EQ(error_of("struct S {\n  Unknown x;\n};"),
            "x.idl:2: 'Unknown': is no type (struct types are written with their modules)");
  EXPECT_EQ(error_of("struct S {"), "x.idl: ends in the middle of a definition");
}

}  // namespace
}  // namespace pocd::recording
