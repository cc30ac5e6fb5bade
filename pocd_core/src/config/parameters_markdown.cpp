// The parameter page: one table per group, the fields of list entries in a table of their own.
#include "../common/parameter_text.hpp"
#include "pocd/config/config_io.hpp"

namespace pocd::config_detail {
namespace {

/// Text for a table cell.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

std::string code(const std::string& text) {
  return text.empty() ? "(empty)" : "`" + cell(text) + "`";
}

class Page final : public ParameterSink {
 public:
  void real(const char* name, double& value, const Range& range, const char* doc) override {
    row(name, code(number_text(value)), range_text(range, doc), doc);
  }
  void integer(const char* name, int& value, const Range& range, const char* doc) override {
    row(name, code(std::to_string(value)), range_text(range, doc), doc);
  }
  void natural(const char* name, std::uint64_t& value, const Range& range,
               const char* doc) override {
    row(name, code(std::to_string(value)), range_text(range, doc), doc);
  }
  void boolean(const char* name, bool& value, const char* doc) override {
    row(name, code(value ? "true" : "false"), "true, false", doc);
  }
  void text(const char* name, std::string& value, const char* doc) override {
    row(name, code(value), "text", doc);
  }
  void choice(const char* name, std::string& word, const std::vector<std::string>& choices,
              const char* doc) override {
    row(name, code(word), join(choices, ", "), doc);
  }
  void texts(const char* name, std::vector<std::string>& values, const char* doc) override {
    row(name, code(join(values, ", ")), "list of texts", doc);
  }
  void items(const char* name, ItemList& list, const char* doc) override {
    row(name, std::to_string(list.size()) + " entries", "list, see below", doc);
    open(std::string(name) + "[]", "Each entry of `" + prefix() + name + "`.");
    list.describe_default(*this);
    end_group();
  }
  void begin_group(const char* name, const char* doc) override { open(name, doc); }
  void end_group() override {
    pages_.at(open_.back()) += rows_.back();
    open_.pop_back(), rows_.pop_back(), path_.pop_back();
  }

  std::string finish() {
    std::string text = rows_.front();
    for (const std::string& page : pages_) text += page;
    return text;
  }

 private:
  static constexpr const char* kHead =
      "| parameter | default | range | meaning |\n|---|---|---|---|\n";

  std::string prefix() const { return path_.empty() ? "" : join(path_, ".") + "."; }

  void open(const std::string& name, const std::string& doc) {
    path_.push_back(name);
    open_.push_back(pages_.size());
    rows_.emplace_back();
    pages_.push_back("\n## " + join(path_, ".") + "\n\n" + doc + "\n\n");
  }

  void row(const char* name, const std::string& value, const std::string& range, const char* doc) {
    std::string& rows = rows_.back();
    if (rows.empty()) rows = kHead;
    rows +=
        "| `" + prefix() + name + "` | " + value + " | " + cell(range) + " | " + cell(doc) + " |\n";
  }

  std::vector<std::string> path_;
  std::vector<std::string> pages_;     ///< one per group, in order of appearance
  std::vector<std::size_t> open_;      ///< pages of the groups we are in
  std::vector<std::string> rows_{""};  ///< tables of those groups; first: the top level
};

}  // namespace

std::string markdown(const ShowTo& show) {
  Page page;
  show(page);
  return page.finish();
}

}  // namespace pocd::config_detail
