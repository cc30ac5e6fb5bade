#include "db3_reader.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <limits>

#include "pocd/common/check.hpp"

namespace pocd::recording {
namespace {

struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  void operator()(sqlite3* database) const { sqlite3_close_v2(database); }
};
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

std::string text(sqlite3_stmt* row, int column) {
  const auto* value = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return value == nullptr
             ? std::string()
             : std::string(value, static_cast<std::size_t>(sqlite3_column_bytes(row, column)));
}

/// Whether SQLite keeps what was written last in a file beside this one (write-ahead log), and that
/// is not there.
bool lacks_log(const std::filesystem::path& file) {
  char header[20] = {};
  std::ifstream(file, std::ios::binary).read(header, sizeof header);
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file.string() + "-wal", error);
  return header[18] == 2 && (error || bytes == 0);
}

/// A file that SQLite takes as it is. rosbag2 leaves its files in the mode of a log, for which
/// SQLite otherwise makes files beside them, and cannot where nothing may be written.
std::string as_it_is(const std::filesystem::path& file) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '-' || c == '_') {
      uri += c;
    } else {
      uri += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return uri + "?immutable=1";
}

class Db3Reader : public RecordingReader {
 public:
  Db3Reader(const std::filesystem::path& file, const std::string& name, const ReaderLimits& limits)
      : name_(name) {
    sqlite3* raw = nullptr;
    lacks_log_ = lacks_log(file);
    const std::string target = lacks_log_ ? as_it_is(file) : file.string();
    const int flags = SQLITE_OPEN_READONLY | (lacks_log_ ? SQLITE_OPEN_URI : 0);
    const int result = sqlite3_open_v2(target.c_str(), &raw, flags, nullptr);
    database_.reset(raw);
    if (result != SQLITE_OK)
      throw InputError(name_ + ": cannot be opened: " + sqlite3_errstr(result));
    sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, static_cast<int>(limits.chunk_bytes));
    sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    std::error_code error;
    info_.format = "db3";
    info_.profile = "ros2";
    info_.library = "rosbag2";
    info_.bytes = std::filesystem::file_size(file, error);
    read_topics();
    read_counts();
    seek(0);
  }

  const RecordingInfo& info() const override { return info_; }
  const std::vector<RecordedChannel>& channels() const override { return channels_; }

  bool next(RecordedMessage& message) override {
    while (messages_) {
      const int result = sqlite3_step(messages_.get());
      if (result != SQLITE_ROW) {
        if (result != SQLITE_DONE) problem("messages end before their time");
        messages_.reset();
        return false;
      }
      const auto channel = channel_index_.find(sqlite3_column_int64(messages_.get(), 0));
      const sqlite3_int64 time_ns = sqlite3_column_int64(messages_.get(), 1);
      if (channel == channel_index_.end() || time_ns < 0) {
        add_problem(name_ + ": a message has " +
                    (time_ns < 0 ? "a negative time" : "a topic that is not listed"));
        continue;
      }
      if (!wanted(channel->second)) continue;
      message.channel = channel->second;
      message.sequence = 0;
      message.log_time_ns = static_cast<std::uint64_t>(time_ns);
      message.publish_time_ns = message.log_time_ns;
      message.data = static_cast<const std::uint8_t*>(sqlite3_column_blob(messages_.get(), 2));
      message.size = static_cast<std::size_t>(sqlite3_column_bytes(messages_.get(), 2));
      if (unpack(message, name_)) return true;
    }
    return false;
  }

  void seek(std::uint64_t log_time_ns) override {
    messages_ = prepare(
        "SELECT topic_id, timestamp, data FROM messages WHERE timestamp >= ?1 ORDER BY timestamp, "
        "id");
    const auto most = static_cast<std::uint64_t>(std::numeric_limits<sqlite3_int64>::max());
    sqlite3_bind_int64(messages_.get(), 1, static_cast<sqlite3_int64>(std::min(log_time_ns, most)));
  }

 private:
  Statement prepare(const char* query) const {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), query, -1, &statement, nullptr) != SQLITE_OK) {
      const std::string why = sqlite3_errmsg(database_.get());
      const int code = sqlite3_errcode(database_.get());
      if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB) {
        throw InputError(name_ + ": is damaged or cut off: " + why +
                         "; sqlite3's .recover may get back what is left");
      }
      throw InputError(name_ + ": is no rosbag2 file: " + why +
                       (lacks_log_ ? "; its recorder was not ended in order: the file of the same "
                                     "name with -wal belongs to it and must be beside it"
                                   : ""));
    }
    return Statement(statement);
  }

  void problem(const char* what) {
    add_problem(name_ + ": " + what + ": " + sqlite3_errmsg(database_.get()));
  }

  /// The oldest files have no column for the quality of service.
  bool has_qos() const {
    const Statement columns = prepare("PRAGMA table_info(topics)");
    while (sqlite3_step(columns.get()) == SQLITE_ROW) {
      if (text(columns.get(), 1) == "offered_qos_profiles") return true;
    }
    return false;
  }

  void read_topics() {
    const bool qos = has_qos();
    const Statement topics = prepare(
        qos ? "SELECT id, name, type, serialization_format, offered_qos_profiles FROM topics "
              "ORDER BY id"
            : "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    int result = sqlite3_step(topics.get());
    for (; result == SQLITE_ROW; result = sqlite3_step(topics.get())) {
      RecordedChannel channel;
      channel.topic = text(topics.get(), 1);
      channel.type = text(topics.get(), 2);
      channel.message_encoding = text(topics.get(), 3);
      if (qos) channel.metadata["offered_qos_profiles"] = text(topics.get(), 4);
      channel_index_[sqlite3_column_int64(topics.get(), 0)] = channels_.size();
      channels_.push_back(std::move(channel));
    }
    if (result != SQLITE_DONE) problem("topics cannot all be read");
  }

  void read_counts() {
    const Statement counts = prepare(
        "SELECT topic_id, COUNT(*), MIN(timestamp), MAX(timestamp) FROM messages GROUP BY 1");
    int result = sqlite3_step(counts.get());
    for (; result == SQLITE_ROW; result = sqlite3_step(counts.get())) {
      const auto count = static_cast<std::uint64_t>(sqlite3_column_int64(counts.get(), 1));
      const auto first = static_cast<std::uint64_t>(sqlite3_column_int64(counts.get(), 2));
      const auto last = static_cast<std::uint64_t>(sqlite3_column_int64(counts.get(), 3));
      info_.start_ns = info_.messages == 0 ? first : std::min(info_.start_ns, first);
      info_.end_ns = std::max(info_.end_ns, last);
      info_.messages += count;
      const auto channel = channel_index_.find(sqlite3_column_int64(counts.get(), 0));
      if (channel != channel_index_.end()) channels_[channel->second].messages = count;
    }
    if (result != SQLITE_DONE) problem("messages cannot all be counted");
  }

  std::string name_;
  std::unique_ptr<sqlite3, Finalize> database_;
  bool lacks_log_ = false;
  RecordingInfo info_;
  std::vector<RecordedChannel> channels_;
  std::map<sqlite3_int64, std::size_t> channel_index_;
  Statement messages_;
};

}  // namespace

std::unique_ptr<RecordingReader> open_db3(const std::filesystem::path& file,
                                          const std::string& name, const ReaderLimits& limits) {
  return std::make_unique<Db3Reader>(file, name, limits);
}

}  // namespace pocd::recording
