// The shapes of a set's objects that deform: from their files to a frame's meshes.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "studio/set_scene.h"
#include "studio/shape_reader.h"

namespace studio {

// One thread uses it. Each object gives the shape that is due at the show's time; where that cannot
// be had, the one that it has stays. Objects of the same files and times share them.
class ShapeFeed {
 public:
  // `scene` is the set's, of which it notes what deforms. `rate`: of the show, for objects that
  // have none. Shapes begin at `start` of the show's time, or, without one, at the next time that
  // is asked for; those that `before` has go on as they are. `live`: no shape is waited for.
  ShapeFeed(const Set& set,
            SetScene& scene,
            capture::Rational rate,
            std::optional<capture::Time> start,
            bool live,
            const ShapeFeed* before = nullptr);

  // Puts what is due at that time into the scene that it was made with; whether anything changed.
  // Times must not fall.
  bool at(capture::Time time, SetScene& scene);

  // Objects whose shape at the last time was not the one due.
  std::int64_t held() const { return held_; }
  // What went wrong since the last call, in words.
  std::vector<std::string> take_notes();

 private:
  struct Channel {
    ObjectSettings settings;
    std::string name;  // of the object, for people
    capture::Rational fps;
    std::optional<capture::Time> start;
    std::vector<std::size_t> meshes;  // of the scene, that change
    std::vector<std::size_t> parts;   // of the model, that these are
    std::unique_ptr<ShapeReader> reader;
    std::shared_ptr<const ReadShape> shape;  // shown
    std::int64_t shown = 0;                  // its number: from 0 on, without end where they loop
    std::vector<bool> told;                  // of each file, what is wrong with it
    bool begins = false;                     // anew: it may be late for a moment
    bool told_late = false;
  };

  static void open(Channel& channel, const Set& set, const SetScene& scene);
  void go_on(Channel& channel, const ShapeFeed& before, SetScene& scene);
  std::vector<std::size_t> files_from(const Channel& channel, capture::Time passed) const;
  bool update(Channel& channel, capture::Time time, SetScene& scene);
  void note_held(Channel& channel, std::size_t file, const ReadShape* due);

  bool live_;
  capture::Time period_;  // of the show's frames
  std::vector<Channel> channels_;
  bool gone_on_ = false;  // shapes were put into the scene that no frame has seen
  std::int64_t held_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace studio
