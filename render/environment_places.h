// What a cell's slots take of places in the environment, collected while the cell is found. Private
// to the kernel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/environment_terms.h"
#include "render/further_samples.h"
#include "render/place_terms.h"

namespace render {

// Many rays through glass, or of many samples, look nearly the same way: places of a slot that lie
// between the same four texels of a level become one, in their middle. Between four texels a
// picture is all but linear, so hardly anything is lost. A cell may find millions of them: they are
// joined time and again. Once its memory has grown, nothing is allocated.
class EnvironmentPlaces {
 public:
  EnvironmentPlaces();
  // Of a cell whose places lie in the levels of that environment, levels_of(it), which decides what
  // may be looked up less sharply.
  void clear(const Environment& planned, std::span<const capture::Image* const> levels);
  // One whose weight is not finite is left out: nothing could be joined with it.
  void add(const PlaceTerm& place);
  // Places that are added in between are few, and are forgotten.
  void begin_aside() { before_ = places_.size(), aside_ = true; }
  void end_aside() { places_.resize(before_), aside_ = false; }
  bool empty() const { return places_.empty(); }
  // All of them, in the order of their slots.
  std::span<PlaceTerm> join();
  // Those too that would be the same in texels twice as wide, where next to nothing changes of a
  // slot that has so many samples: a cone looks at the two levels that it lies between, and lobes
  // at cones beside and within each other.
  std::span<PlaceTerm> join_wider(const FurtherSamples& samples);
  // Of lists as long as cells needed so far.
  std::size_t bytes() const;

 private:
  void join(const FurtherSamples* samples);
  std::optional<PlaceTerm> wider(const PlaceTerm& e) const;
  float change(const PlaceTerm& from, const PlaceTerm& to) const;
  bool is_alone(std::vector<KeyedPlace>::const_iterator place) const;
  bool halve_faint();
  void join_wider_of_slot(float samples);

  std::vector<PlaceTerm> places_;
  // More are joined, and may then be twice as many, but not by more than eight times as many as
  // `enough_terms`.
  std::size_t most_ = enough_terms, longest_ = enough_terms;
  std::size_t before_ = 0;
  bool aside_ = false;
  std::vector<KeyedPlace> of_slot_;
  const Environment* planned_ = nullptr;
  std::span<const capture::Image* const> levels_;
};

}  // namespace render
