// The persons of a set, frame by frame: from their videos to what their billboards and hulls show,
// and where they stand.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "render/live_picture.h"
#include "studio/set.h"

namespace studio {

// How a person is keyed, where it stands and what it is shown as, for people.
struct PersonStatus {
  std::string name;
  float confidence = 1;  // of the key, 0..1; of several cameras, the least
  // What lowers it most: compositing::name_of; "none" = no key; or "its plate is being taken".
  std::string key = "none";
  std::string feet = "placed";  // compositing::name_of, or "placed" by the set
  bool held = false;            // stands where the feet were seen last
  bool stands = true;           // it has a place: by the set, or once its feet were seen
  calibrate::Vec3 position;     // of the feet in the set, if it has
  double sigma_m = 0;           // of it, by the matte
  double view_angle_deg = 0;    // between the show's camera and the person's, the nearest one's
  bool shallow = false;         // more than the billboard turns
  bool hull = false;            // shown as a hull; else as the billboard of
  int camera = 1;               // this one, counted from 1; of a hull, the nearest one
  double error_m = 0;           // of its outline, as compositing/person_shape.h states it
  bool holds = true;            // error_m is no more than the set asks for
  std::vector<int> left_out;    // cameras that see nobody or are late, counted from 1
};

// In the order that add_persons (set_scene.h) has.
struct PersonFrame {
  std::vector<std::shared_ptr<const render::LivePicture>> pictures;  // never null
  std::vector<std::array<float, 12>> places;  // set_from_object of its instances
  std::vector<std::size_t> hull_cameras;      // that the hull is to be seen by; empty = no hull
  PersonStatus status;
};

// One thread uses it. A source that ends or stalls holds its last picture. Of a person with several
// cameras, those whose picture is late by more than a frame and a half or has never come, or that
// see nobody, are left out until they have been well for half a second.
class PersonFeed {
 public:
  // Opens the sources, reads plates and masks. Files begin at `start` of the show's time, or at the
  // next time that is asked for; `live` as of TimedSource. Throws SetError with all faults. What
  // `before` has open runs on, and persons whose cameras are the same stay as they are; it may run
  // until take_over().
  PersonFeed(const Set& set,
             std::optional<capture::Time> start,
             bool live,
             const PersonFeed* before = nullptr);
  // In the place of `before`, which is of no use from here on. Comes before at().
  void take_over();

  bool empty() const { return persons_.empty(); }
  // What a scene shows before its first frame.
  std::vector<std::shared_ptr<const render::LivePicture>> nothing_yet() const;

  // One for each of the set's persons, as the show's camera stands. Times must not fall.
  std::vector<PersonFrame> at(capture::Time time, const calibrate::Pose& cam_from_set);

  // What went wrong since the last call, in words.
  std::vector<std::string> take_notes();

 private:
  struct Person;
  class Claims;
  // Of a person who is there already: what is new at take_over().
  struct Coming {
    PersonSettings settings;
    std::shared_ptr<Person> person;  // whose feet are followed on; null = it is the same person
  };

  static std::string name_of(const PersonSettings& settings, std::size_t index);
  // Persons have nothing in common: each of these may run beside those of others.
  void show_at(Person& person, capture::Time time, calibrate::Vec3 viewer);
  void update(Person& person, capture::Time time);
  void show(Person& person, std::size_t camera);
  void stand(Person& person);
  void choose(Person& person, capture::Time time, calibrate::Vec3 viewer);
  void judge(Person& person, std::size_t camera, capture::Time time);
  void tell(Person& person);
  void place(Person& person, calibrate::Vec3 viewer);
  void place_billboard(Person& person, calibrate::Vec3 viewer);

  std::vector<std::shared_ptr<Person>> persons_;
  std::vector<std::optional<Coming>> coming_;  // of each person; nothing = it is new
  std::vector<std::string> notes_;
};

}  // namespace studio
