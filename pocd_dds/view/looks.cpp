#include "view/looks.hpp"

#include "view/json_text.hpp"

namespace pocd::view {
namespace {

constexpr int kSectorShift = 3;
static_assert(kChunkTiles * kTileSide == 64, "a chunk of the page is a region of the looks");

}  // namespace

std::size_t Looks::tell(const std::vector<MirrorRegion>& regions) {
  std::map<ChunkKey, Json> sectors;
  for (const auto& entry : told_) sectors[entry.first] = Json::array();
  std::size_t count = 0;
  for (const auto& [region, stamp_ns, in_run] : regions) {
    const ChunkKey sector{region.x >> kSectorShift, region.y >> kSectorShift,
                          region.z >> kSectorShift};
    Json& list = sectors.try_emplace(sector, Json::array()).first->second;
    if (in_run) continue;
    ++count;
    list.push_back(Json::array({region.x, region.y, region.z, seconds(stamp_ns)}));
  }
  for (const auto& [key, list] : sectors) {
    const std::string name =
        std::to_string(key.x) + '/' + std::to_string(key.y) + '/' + std::to_string(key.z);
    std::string text = text_of({{"type", "looks"}, {"sector", name}, {"not_looked_at", list}});
    std::string& before = told_[key];
    if (before == text || (before.empty() && list.empty())) continue;
    board_.put_notice("looks/" + name, text);
    before = std::move(text);
  }
  return count;
}

}  // namespace pocd::view
