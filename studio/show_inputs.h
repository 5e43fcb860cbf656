// What a show takes from its set as it stands, before any frame: plate, lens, track, scene.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "calibrate/lens.h"
#include "calibrate/track.h"
#include "render/scene.h"
#include "studio/person_feed.h"
#include "studio/set.h"
#include "studio/set_scene.h"
#include "studio/source.h"

namespace studio {

// Throws SetError if it cannot be opened, or is not of the show's size or the lens's.
std::unique_ptr<Source> open_plate(const Set& set);
// Whether a plate that is open serves another set as well.
bool same_plate(const Set& a, const Set& b);
// Throws std::invalid_argument if a show of `before` cannot change to `after` on air, since its
// picture or plate would be another.
void require_same_plate(const Set& before, const Set& after);

// Of the show's picture; a set without objects needs none, and has a pinhole.
calibrate::Lens lens_of(const Set& set);
// With the lens's vignetting.
std::shared_ptr<const calibrate::DirectionTable> directions_of(const Set& set);
// Nothing where the camera is fixed. Throws SetError if the file cannot be read.
std::optional<calibrate::Track> track_of(const Set& set);

// The scene with nobody in the persons' pictures yet; `described` becomes of that version. Throws
// SetError.
std::shared_ptr<render::Scene> compile(const Set& set,
                                       const PersonFeed& persons,
                                       SetScene& described,
                                       std::uint64_t version);

}  // namespace studio
