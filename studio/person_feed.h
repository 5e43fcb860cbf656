// The persons of a set, frame by frame: from their videos to what their billboards show and where
// they stand.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/pool.h"
#include "compositing/feet.h"
#include "compositing/keyer.h"
#include "render/live_picture.h"
#include "render/video_texture.h"
#include "studio/set.h"
#include "studio/timed_source.h"

namespace studio {

// How a person is keyed and where it stands, for people.
struct PersonStatus {
  std::string name;
  float confidence = 1;         // of the key, 0..1
  std::string key = "none";     // what lowers it most: compositing::name_of; "none" = no key
  std::string feet = "placed";  // compositing::name_of, or "placed" by the set
  bool held = false;            // stands where the feet were seen last
  calibrate::Vec3 position;     // of the feet in the set
  double sigma_m = 0;           // of it, by the matte
  double view_angle_deg = 0;    // between the person's camera and the show's
  bool shallow = false;         // more than the billboard turns
};

struct PersonFrame {
  std::shared_ptr<const render::LivePicture> picture;                         // never null
  std::array<float, 12> set_from_object{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  // of its billboard
  PersonStatus status;
};

// One thread uses it. A source that ends or stalls holds its last picture.
class PersonFeed {
 public:
  // Opens the sources, reads plates and masks. Files begin at `start` of the show's time, or at the
  // next time that is asked for; `live` as of TimedSource. Throws SetError with all faults.
  PersonFeed(const Set& set, std::optional<capture::Time> start, bool live);

  bool empty() const { return persons_.empty(); }
  // What a scene shows before its first frame: one for each person.
  std::vector<std::shared_ptr<const render::LivePicture>> nothing_yet() const;

  // One for each of the set's persons, as the show's camera stands. Times must not fall.
  std::vector<PersonFrame> at(capture::Time time, const calibrate::Pose& cam_from_set);

  // What went wrong since the last call, in words.
  std::vector<std::string> take_notes();

 private:
  struct Person;

  void update(Person& person, capture::Time time);
  void show(Person& person, const capture::Image& image, capture::Time time);
  void key(Person& person, const capture::Image& image);
  static void find_feet(Person& person, const capture::Image& rgba);
  void stand(Person& person, capture::Time time);
  void place(Person& person, const calibrate::Pose& cam_from_set);

  std::vector<std::shared_ptr<Person>> persons_;
  capture::Pool<render::VideoTexture> textures_;
  std::vector<std::string> notes_;
};

}  // namespace studio
