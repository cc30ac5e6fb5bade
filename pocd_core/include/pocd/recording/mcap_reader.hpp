// Reads MCAP files, whole or damaged.
#pragma once

#include <optional>
#include <queue>
#include <set>

#include "pocd/recording/byte_source.hpp"
#include "pocd/recording/mcap_records.hpp"
#include "pocd/recording/recording_reader.hpp"

namespace pocd::recording {

/// With a summary that lists all chunks only those that are due are read. Without, or with one that
/// is damaged (which is said), the file is read through once; after a damaged record it goes on with the next chunk that looks like
/// one. A chunk whose CRC does not fit is left out as a whole.
class McapReader : public RecordingReader {
 public:
  /// `name` begins every problem. Throws InputError when the source does not begin like MCAP.
  McapReader(std::unique_ptr<ByteSource> source, std::string name, const ReaderLimits& limits = {});

  const RecordingInfo& info() const override { return info_; }
  const std::vector<RecordedChannel>& channels() const override { return channels_; }
  bool next(RecordedMessage& message) override;
  void seek(std::uint64_t log_time_ns) override;

  /// Reads every chunk and reports the damaged ones.
  void verify();

 private:
  /// A chunk, or a run of messages that stand in the file without one.
  struct Block {
    std::uint64_t start_ns = 0, end_ns = 0;
    std::uint64_t offset = 0, length = 0;  // of the whole record, or of the run
    bool is_chunk = true;
  };
  struct Entry {
    std::uint64_t log_time_ns = 0;
    std::size_t offset = 0, size = 0;  // of the message's content within the block's bytes
  };
  struct Loaded {
    Bytes bytes;
    std::vector<Entry> entries;  // by log time
    std::size_t next = 0;
    std::uint64_t memory() const { return bytes.size() + entries.size() * sizeof(Entry); }
  };
  /// The next message of a loaded block; the earliest comes first.
  struct Due {
    std::uint64_t log_time_ns;
    std::uint64_t block_offset;
    std::size_t slot;
    bool operator<(const Due& o) const {
      return log_time_ns != o.log_time_ns ? log_time_ns > o.log_time_ns
                                          : block_offset > o.block_offset;
    }
  };

  void check_start();
  bool read_summary();
  /// False: it is whole, but does not say where all messages are. Throws DamagedData.
  bool read_summary_records(const FooterRecord& footer, std::uint64_t footer_offset);
  bool lists_channels_of(const StatisticsRecord& statistics,
                         const std::set<std::uint16_t>& indexed) const;
  void scan();
  void scan_record(Opcode opcode, std::uint64_t offset, std::uint64_t length);
  std::uint64_t find_chunk(std::uint64_t from) const;
  bool looks_like_chunk(std::uint64_t offset, const std::uint8_t* bytes) const;
  void count_definition(std::size_t bytes);
  void define(const SchemaRecord& schema, std::uint64_t offset);
  void define(const ChannelRecord& channel, std::uint64_t offset);
  Bytes block_bytes(const Block& block) const;
  /// Entries of the selected channels at or after `from_`, or all of them while scanning.
  std::vector<Entry> entries_of(const Bytes& bytes, const Block& block, bool scanning);
  void load(const Block& block);
  bool next_in_order(RecordedMessage& message);
  void note(std::uint64_t offset, const std::string& problem);

  std::unique_ptr<ByteSource> source_;
  std::string name_;
  ReaderLimits limits_;
  RecordingInfo info_;
  std::vector<RecordedChannel> channels_;
  std::map<std::uint16_t, SchemaRecord> schemas_;
  std::map<std::uint16_t, ChannelRecord> channel_records_;
  std::map<std::uint16_t, std::size_t> channel_index_;
  std::vector<Block> blocks_;  // by start

  std::uint64_t from_ = 0;
  std::size_t next_block_ = 0;
  std::vector<Loaded> loaded_;
  std::vector<std::size_t> free_slots_;
  std::uint64_t loaded_bytes_ = 0;
  std::priority_queue<Due> due_;
  std::optional<std::size_t> current_slot_;  // of the message handed out last
  std::uint64_t definition_bytes_ = 0;
  bool told_overlap_ = false;
  std::map<std::uint64_t, bool> told_;  // damaged blocks by offset: told once, not in every loop
};

}  // namespace pocd::recording
