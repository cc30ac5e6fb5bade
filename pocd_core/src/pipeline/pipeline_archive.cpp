#include "pipeline_archive.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "archive_access.hpp"

namespace pocd {
namespace {

enum Part : std::uint64_t { kGates = 1, kGround = 2, kTracker = 3, kIgnored = 4 };
constexpr std::size_t kParts = 4;

std::string name_of(const Piece& piece) {
  static const char* const kinds[] = {"part", "object", "surface of object", "block of free space",
                                      "region"};
  return std::string(kinds[static_cast<int>(piece.kind)]) + " " + std::to_string(piece.key);
}

constexpr std::int64_t kHalf = std::int64_t{1} << 20;

}  // namespace

std::uint64_t piece_key(const BlockKey& key) {
  const auto axis = [](std::int32_t v) {
    POCD_CHECK(v >= -kHalf && v < kHalf);
    return static_cast<std::uint64_t>(v + kHalf);
  };
  return axis(key.z) << 42 | axis(key.y) << 21 | axis(key.x);
}

BlockKey block_key(std::uint64_t key) {
  const auto axis = [](std::uint64_t bits) {
    return static_cast<std::int32_t>(static_cast<std::int64_t>(bits & (2 * kHalf - 1)) - kHalf);
  };
  return {axis(key), axis(key >> 21), axis(key >> 42)};
}

void PipelineArchive::add(PieceKind kind, std::uint64_t key, std::vector<std::uint8_t> bytes,
                          std::vector<Piece>& out, std::vector<std::size_t> sections) {
  if (bytes.empty()) {
    if (hash_of_.erase({kind, key}) > 0) out.push_back({kind, key, {}, {}});
    return;
  }
  const std::uint64_t hash = XXH3_64bits(bytes.data(), bytes.size());
  const auto [known, fresh] = hash_of_.try_emplace({kind, key}, hash);
  if (!fresh && known->second == hash) return;
  known->second = hash;
  out.push_back({kind, key, std::move(bytes), std::move(sections)});
}

std::vector<Piece> PipelineArchive::take_changed(const PipelineParts& parts) {
  std::vector<Piece> out;
  SaveArchive gates;
  gates(parts.clock, parts.gate, parts.masks);
  add(PieceKind::kPart, kGates, gates.take(), out);
  add(PieceKind::kPart, kGround, archived(parts.grounds), out);
  SaveArchive tracker;
  tracker(parts.tracker);
  add(PieceKind::kPart, kTracker, tracker.take(), out, tracker.take_sections());
  add(PieceKind::kPart, kIgnored, archived(parts.ignored), out);
  ObjectLibrary& library = ArchiveAccess::library(parts.tracker);
  for (const ObjectId id : library.take_touched()) {
    const LibraryObject* object = std::as_const(library).find(id);
    SaveArchive a, surface;
    if (object) a(*object), surface(object->model);
    add(PieceKind::kObject, to_index(id), a.take(), out);
    add(PieceKind::kSurface, to_index(id), surface.take(), out, surface.take_sections());
  }
  FreeSpace& space = ArchiveAccess::free_space(parts.tracker);
  for (const BlockKey& key : space.take_changed()) {
    const auto* block = ArchiveAccess::free_block(space, key);
    add(PieceKind::kFreeSpace, piece_key(key),
        block ? archived(ArchiveAccess::differences(*block)) : std::vector<std::uint8_t>{}, out);
  }
  for (const BlockKey& key : parts.looked_at.take_changed()) {
    add(PieceKind::kRegion, piece_key(key),
        archived(ArchiveAccess::looked_ns(parts.looked_at, key)), out);
  }
  return out;
}

void PipelineArchive::restore(const PipelineParts& parts, const std::vector<Piece>& pieces,
                              double spacing_m) {
  std::set<std::uint64_t> found;
  std::size_t surfaces = 0;
  ObjectLibrary& library = ArchiveAccess::library(parts.tracker);
  for (const Piece& piece : pieces) {
    LoadArchive a(piece.bytes, name_of(piece));
    switch (piece.kind) {
      case PieceKind::kPart:
        found.insert(piece.key);
        if (piece.key == kGates) {
          a(parts.clock, parts.gate, parts.masks);
        } else if (piece.key == kGround) {
          a(parts.grounds);
        } else if (piece.key == kTracker) {
          a(parts.tracker);
        } else if (piece.key == kIgnored) {
          a(parts.ignored);
        } else {
          a.fail("is not known");
        }
        break;
      case PieceKind::kObject: {
        const auto id = static_cast<ObjectId>(piece.key);
        if (id == ObjectId::kNone || library.find(id)) a.fail("has no number of its own");
        auto object = std::make_unique<LibraryObject>(id, spacing_m);
        a(*object);
        ArchiveAccess::insert(library, std::move(object));
        break;
      }
      case PieceKind::kSurface: {
        LibraryObject* const object = library.find(static_cast<ObjectId>(piece.key));
        if (object == nullptr) a.fail("is of no object");
        a(object->model);
        ++surfaces;
        break;
      }
      case PieceKind::kFreeSpace: {
        auto& block = ArchiveAccess::make_free_block(ArchiveAccess::free_space(parts.tracker),
                                                     block_key(piece.key));
        a(block);
        ArchiveAccess::sum_up(block);
        break;
      }
      case PieceKind::kRegion:
        a(ArchiveAccess::looked_ns(parts.looked_at, block_key(piece.key)));
        break;
    }
    a.finish();
    hash_of_[{piece.kind, piece.key}] = XXH3_64bits(piece.bytes.data(), piece.bytes.size());
  }
  if (found.size() != kParts) throw InputError("pieces of a pipeline: a part is missing");
  if (surfaces != library.all().size()) {
    throw InputError("pieces of a pipeline: an object has no surface");
  }
  for (const auto& [id, object] : library.all()) {
    if (to_index(id) >= ArchiveAccess::next_id(parts.tracker)) {
      throw InputError("object " + std::to_string(to_index(id)) + ": has a number of the future");
    }
  }
  // What was just put there is as it was given.
  library.take_touched();
  ArchiveAccess::free_space(parts.tracker).take_changed();
  parts.looked_at.take_changed();
}

}  // namespace pocd
