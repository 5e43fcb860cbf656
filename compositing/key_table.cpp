// The shipped table, packed for look-up.
#include "compositing/key_table.h"

namespace compositing {
namespace {

constexpr TableCodes shipped{
#include "compositing/key_table.inc"
};

}  // namespace

const TableCodes& shipped_key_table() { return shipped; }

KeyTable::KeyTable(const TableCodes& codes) {
  words_.reserve(static_cast<std::size_t>(2 * squares * table_hues));
  for (const PlaceCodes* places : {&codes.near, &codes.deep}) pack(*places);
}

void KeyTable::pack(const PlaceCodes& codes) {
  for (int hue = 0; hue < table_hues; ++hue) {
    for (int share = 0; share + 1 < table_shares; ++share) {
      for (int light = 0; light + 1 < table_lights; ++light) {
        std::uint64_t word = 0;
        for (int byte = 0; byte < 8; ++byte) {
          const int corner = byte % 4;
          const std::size_t at = code_at(share + corner / 2, light + corner % 2, hue) +
                                 static_cast<std::size_t>(byte / 4);
          word |= static_cast<std::uint64_t>(codes[at]) << (8 * byte);
        }
        words_.push_back(word);
      }
    }
  }
}

}  // namespace compositing
