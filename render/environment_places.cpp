// Places in the environment, joined where they are many times the same.
#include "render/environment_places.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace render {
namespace {

// Slots that look at more places than this have faint ones looked up less sharply, each time that
// they are joined.
constexpr std::size_t most_places_of_slot = 256;
// By how much a slot may then change for one of them at a time, under the planned light.
constexpr float least_change = 3e-4F;
// And by how much for all of them that join wider ones at the end, each sample of it.
constexpr float most_change = 1e-3F;

}  // namespace

EnvironmentPlaces::EnvironmentPlaces() {
  // More than come together in any scene yet: what is not used of it takes no memory, and growing
  // would hold all of them twice.
  places_.reserve(std::size_t{1} << 21);
}

void EnvironmentPlaces::clear(const Environment& planned,
                              std::span<const capture::Image* const> levels) {
  aside_ = false;  // a cell may have been given up meanwhile
  planned_ = &planned;
  levels_ = levels;
  places_.clear();
  most_ = enough_terms;
}

void EnvironmentPlaces::add(const PlaceTerm& place) {
  if (!is_finite(place.weight)) return;
  places_.push_back(place);
  if (places_.size() <= most_ || aside_) return;
  join(nullptr);
  most_ = places_.size() + std::min(places_.size(), 8 * enough_terms) + enough_terms;
  longest_ = std::max(longest_, most_);
}

std::size_t EnvironmentPlaces::bytes() const {
  return longest_ * sizeof places_[0] + of_slot_.capacity() * sizeof of_slot_[0];
}

std::span<PlaceTerm> EnvironmentPlaces::join() {
  join(nullptr);
  return places_;
}

std::span<PlaceTerm> EnvironmentPlaces::join_wider(const FurtherSamples& samples) {
  join(&samples);
  return places_;
}

// Wider ones only if it is known of how many samples a slot is.
void EnvironmentPlaces::join(const FurtherSamples* samples) {
  change_slots(places_, of_slot_, [&](std::uint16_t slot) {
    join_places(of_slot_);
    if (of_slot_.size() > most_places_of_slot && halve_faint()) join_places(of_slot_);
    if (!samples) return;
    const bool of_further = slot >= cell_pixels && slot < slots;
    const int count = of_further ? samples->count(slot - cell_pixels) : 1;
    join_wider_of_slot(static_cast<float>(count));
  });
}

// The same place in texels twice as wide, if there are any. Only those of some weight are joined.
std::optional<PlaceTerm> EnvironmentPlaces::wider(const PlaceTerm& e) const {
  const std::size_t level = halved_level(*planned_, e.level);
  if (level == e.level || !(mean(e.weight) > 0)) return {};
  const capture::Image &fine = *levels_[e.level], &coarse = *levels_[level];
  if (coarse.width * 2 != fine.width || coarse.height * 2 != fine.height) return {};
  return PlaceTerm{e.weight, (e.x - 0.5F) / 2, (e.y - 0.5F) / 2, e.slot,
                   static_cast<std::uint16_t>(level)};
}

// By how much its slot changes under the planned light.
float EnvironmentPlaces::change(const PlaceTerm& from, const PlaceTerm& to) const {
  const Vec3f by = from.weight * (radiance_at(*levels_[to.level], to.x, to.y) -
                                  radiance_at(*levels_[from.level], from.x, from.y));
  return std::max({std::abs(by.x), std::abs(by.y), std::abs(by.z)});
}

// Where two places of the same texels were not joined, one takes away what the other gives (rays
// cut by chance): they stay together.
bool EnvironmentPlaces::is_alone(std::vector<KeyedPlace>::const_iterator place) const {
  const bool first = place == of_slot_.begin() || std::prev(place)->texels != place->texels;
  const auto next = std::next(place);
  return first && (next == of_slot_.end() || next->texels != place->texels);
}

// Where a slot looks at very many places, those that give it least, and show about the same in
// texels twice as wide, are looked up there, so that they can be joined. False if there are none.
bool EnvironmentPlaces::halve_faint() {
  float all = 0;
  for (const KeyedPlace& place : of_slot_) all += std::abs(mean(place.term.weight));
  const float least = all / static_cast<float>(most_places_of_slot);
  bool halved = false;
  for (auto place = of_slot_.begin(); place != of_slot_.end(); ++place) {
    if (mean(place->term.weight) >= least || !is_alone(place)) continue;
    const auto to = wider(place->term);
    if (!to || change(place->term, *to) > least_change) continue;
    *place = {texels_of(*to), *to};
    halved = true;
  }
  return halved;
}

// A place joins the one that it would be in texels twice as wide, the narrowest first.
void EnvironmentPlaces::join_wider_of_slot(float samples) {
  float left = most_change * samples;
  // They are in order of levels, and wider ones have higher numbers.
  for (auto place = of_slot_.begin(); place != of_slot_.end(); ++place) {
    const auto to = is_alone(place) ? wider(place->term) : std::nullopt;
    if (!to) continue;
    const auto other =
        std::ranges::lower_bound(place, of_slot_.end(), texels_of(*to), {}, &KeyedPlace::texels);
    if (other == of_slot_.end() || other->texels != texels_of(*to) || !is_alone(other) ||
        !(mean(other->term.weight) > 0))
      continue;
    const float by = change(place->term, *to);
    if (by > std::min(least_change * samples, left)) continue;
    left -= by;
    join_into(other->term, *to);
    place->term.weight = {};
  }
  std::erase_if(of_slot_, [](const KeyedPlace& place) { return place.term.weight == Vec3f{}; });
}

}  // namespace render
