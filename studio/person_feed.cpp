// Persons, frame by frame.
#include "studio/person_feed.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "calibrate/angles.h"
#include "capture/parallel_loop.h"
#include "compositing/billboard_place.h"
#include "compositing/person_box.h"
#include "compositing/person_shape.h"
#include "compositing/visual_hull.h"
#include "studio/clean_plates.h"
#include "studio/person_camera.h"
#include "studio/section.h"

namespace studio {
namespace {

using namespace std::chrono_literals;
using calibrate::Vec3;
using compositing::FeetStatus;
using compositing::KeyStatus;

using calibrate::degree;
// A camera that was left out is taken back after it has been well for so long.
constexpr capture::Time trial = 500ms;

// Where what is not shown stands: too small to be met, and wherever the person was.
std::array<float, 12> hidden_at(Vec3 position) {
  constexpr float size = 1e-4F;
  const auto p = calibrate::to_float(position);
  return {size, 0, 0, p.x, 0, size, 0, p.y, 0, 0, size, p.z};
}

double azimuth(Vec3 from, Vec3 to) { return std::atan2(to.y - from.y, to.x - from.x); }

std::string words_for(const compositing::ShapeChoice& choice) {
  return choice.hull ? "the hull" : fmt::format("the billboard of camera {}", choice.camera + 1);
}

// Whether feet that are followed for one are those of the other.
bool stands_alike(const PersonSettings& a, const PersonSettings& b) {
  return a.by_feet == b.by_feet && a.floor_z == b.floor_z && a.may_be_hull() == b.may_be_hull() &&
         a.first().lens == b.first().lens && a.first().cam_from_set == b.first().cam_from_set;
}

}  // namespace

struct PersonFeed::Person {
  struct Camera {
    PersonCameraFeed feed;
    std::string_view unsure_for{};  // why its key is; "" = it is not
    bool told_clipped = false;
    bool moved = false;
    bool late = false;                     // its picture is not of this moment
    std::optional<capture::Time> well{};   // since when, of one that was left out
    std::vector<calibrate::Vec2> lower{};  // edge of the feet; held as their place is
    bool is_out() const { return out_for != nullptr; }
    const char* out_for = nullptr;  // why it is left out
  };

  PersonSettings settings;
  std::vector<Camera> cameras;
  std::optional<compositing::FeetTracker> tracker;
  std::int64_t tracked_pass = 0;  // of the clip
  std::optional<compositing::Standing> standing;
  std::optional<compositing::ShapeChoice> choice;
  std::optional<compositing::PersonBox> box;  // of the hull that is chosen
  std::string_view no_hull;                   // why there is none, where it was to be one
  std::shared_ptr<const render::LivePicture> clear = clear_picture();
  std::vector<bool> hidden;   // of its instances
  bool told = false;          // what it is shown as
  bool unplaced = false;      // told that it cannot be placed yet
  bool doubted = false;       // told that its camera looks on steeply or leans
  bool out_of_reach = false;  // told that its picture cannot be laid where it stands
  std::vector<std::string> notes;
  PersonFrame frame;

  bool has_several() const { return cameras.size() > 1; }
  std::string name_of(std::size_t camera) const {
    const std::string& name = frame.status.name;
    return has_several() ? fmt::format("{}, camera {}", name, camera + 1) : name;
  }
  // Where it is; before, angles and errors mean nothing.
  bool is_placed() const { return !settings.by_feet || standing; }
  Vec3 position() const { return standing ? standing->p_set : settings.position; }
  void hide(std::size_t instance) {
    if (!hidden[instance]) frame.places[instance] = hidden_at(position());
    hidden[instance] = true;
  }
};

// What of an earlier feed another one goes on with: each person and each source once.
class PersonFeed::Claims {
 public:
  struct Source {
    const PersonCameraFeed* feed = nullptr;  // null = there is none
    std::shared_ptr<Person> person;
  };

  explicit Claims(std::vector<std::shared_ptr<Person>> persons) : persons_(std::move(persons)) {}

  // A person who is filmed just so, of that name rather than another one.
  std::shared_ptr<Person> same_person(const PersonSettings& s, const auto& options_of) {
    const auto is_same = [&](const std::shared_ptr<Person>& person) {
      if (!stands_alike(person->settings, s)) return false;
      if (person->cameras.size() != s.cameras.size()) return false;
      for (std::size_t k = 0; k < s.cameras.size(); ++k) {
        const PersonCameraFeed& feed = person->cameras[k].feed;
        if (is_claimed(feed) || !feed.serves(s.cameras[k], options_of(s, k))) return false;
      }
      return true;
    };
    const auto found = first_of(s.name, is_same);
    if (found == nullptr) return nullptr;
    for (const Person::Camera& camera : found->cameras) claimed_.push_back(&camera.feed);
    return found;
  }

  Source source(const PersonCamera& camera) {
    for (const std::shared_ptr<Person>& person : persons_) {
      for (const Person::Camera& one : person->cameras) {
        if (is_claimed(one.feed) || !one.feed.has_source_of(camera)) continue;
        claimed_.push_back(&one.feed);
        return {&one.feed, person};
      }
    }
    return {};
  }

  // What to add to why the camera's source cannot be opened.
  std::string words_for_held(const PersonCamera& camera) const {
    for (const std::shared_ptr<Person>& person : persons_) {
      for (std::size_t k = 0; k < person->cameras.size(); ++k) {
        auto words = person->cameras[k].feed.words_for_held(camera, person->name_of(k));
        if (!words.empty()) return words;
      }
    }
    return "";
  }

 private:
  bool is_claimed(const PersonCameraFeed& feed) const {
    return std::ranges::find(claimed_, &feed) != claimed_.end();
  }
  std::shared_ptr<Person> first_of(const std::string& name, const auto& is_wanted) const {
    std::shared_ptr<Person> found;
    for (const std::shared_ptr<Person>& person : persons_) {
      if (!is_wanted(person)) continue;
      if (person->settings.name == name) return person;
      if (!found) found = person;
    }
    return found;
  }

  std::vector<std::shared_ptr<Person>> persons_;
  std::vector<const PersonCameraFeed*> claimed_;
};

std::string PersonFeed::name_of(const PersonSettings& settings, std::size_t index) {
  return settings.name.empty() ? fmt::format("person {}", index + 1) : settings.name;
}

PersonFeed::PersonFeed(const Set& set,
                       std::optional<capture::Time> start,
                       bool live,
                       const PersonFeed* before)
    : persons_(set.persons.size()), coming_(set.persons.size()) {
  Faults faults(set.path);
  const std::string base_dir = std::filesystem::absolute(set.path).parent_path().string();
  const auto options_of = [&](const PersonSettings& s, std::size_t camera) {
    const bool tells_feet = camera == 0 && s.by_feet;
    return PersonCameraFeed::Options{base_dir, start, live, tells_feet || s.may_be_hull(),
                                     s.may_be_hull()};
  };
  Claims claims(before ? before->persons_ : std::vector<std::shared_ptr<Person>>());
  for (std::size_t i = 0; i < persons_.size(); ++i) {
    const PersonSettings& s = set.persons[i];
    persons_[i] = claims.same_person(s, options_of);
    if (persons_[i]) coming_[i] = Coming{s, nullptr};
  }
  for (std::size_t i = 0; i < persons_.size(); ++i) {
    if (persons_[i]) continue;
    auto person = persons_[i] = std::make_shared<Person>();
    const PersonSettings& s = person->settings = set.persons[i];
    person->frame.status.name = name_of(s, i);
    for (std::size_t k = 0; k < s.cameras.size(); ++k) {
      const Claims::Source source = claims.source(s.cameras[k]);
      person->cameras.push_back(
          {PersonCameraFeed(s.cameras[k], options_of(s, k), faults, source.feed,
                            source.feed ? "" : claims.words_for_held(s.cameras[k]))});
      if (k == 0 && source.person && stands_alike(source.person->settings, s)) {
        coming_[i] = Coming{s, source.person};
      }
    }
    try {
      if (s.by_feet) person->tracker.emplace(*s.first().lens, s.first().cam_from_set, s.floor_z);
    } catch (const std::invalid_argument& error) {
      faults.add(s.first().place, error.what());
    }
    const std::size_t billboards = s.cameras.size(), hulls = s.may_be_hull() ? 1 : 0;
    person->frame.pictures.assign(billboards * (1 + hulls), person->clear);
    constexpr std::array<float, 12> identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    person->frame.places.assign(billboards + hulls, identity);
    person->hidden.assign(billboards + hulls, false);
  }
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
}

void PersonFeed::take_over() {
  for (std::size_t i = 0; i < persons_.size(); ++i) {
    if (!coming_[i]) continue;
    Person& person = *persons_[i];
    if (const Person* before = coming_[i]->person.get()) {
      person.tracker = before->tracker;
      person.tracked_pass = before->tracked_pass;
      person.standing = before->standing;
      person.unplaced = before->unplaced;
      person.doubted = before->doubted;
      person.frame.status.feet = before->frame.status.feet;
    }
    person.settings = std::move(coming_[i]->settings);
    person.frame.status.name = name_of(person.settings, i);
    coming_[i].reset();
  }
}

std::vector<std::shared_ptr<const render::LivePicture>> PersonFeed::nothing_yet() const {
  std::vector<std::shared_ptr<const render::LivePicture>> pictures;
  for (const auto& person : persons_) {
    pictures.insert(pictures.end(), person->frame.pictures.size(), person->clear);
  }
  return pictures;
}

// Keys the camera's newest frame, if it has not been.
void PersonFeed::show(Person& person, std::size_t index) {
  Person::Camera& camera = person.cameras[index];
  if (!camera.feed.show()) return;
  const std::string_view why =
      compositing::is_unsure(camera.feed.confidence()) ? camera.feed.key() : std::string_view();
  // How a screen is exposed is told once, and that the camera was moved below.
  const bool clipped = why == compositing::name_of(KeyStatus::clipped);
  const bool is_told =
      why == compositing::name_of(KeyStatus::moved) || (clipped && camera.told_clipped);
  if (!why.empty() && why != camera.unsure_for && !is_told) {
    const std::string more = why == compositing::name_of(KeyStatus::ghost)
                                 ? ": " + words_for_ghost(camera.feed.ghost())
                             : why == compositing::name_of(KeyStatus::thin)
                                 ? ": " + std::string(compositing::advice_if_thin)
                                 : std::string();
    person.notes.push_back(
        fmt::format("{}: the key is unsure ({}{})", person.name_of(index), why, more));
  }
  camera.unsure_for = why;
  camera.told_clipped |= clipped;
  const auto& moved = camera.feed.moved();
  if (moved && !camera.moved) {
    person.notes.push_back(fmt::format(
        "{}: its camera was moved: {}. Take the plate anew (platelight key plate, or plate = "
        "\"take\" and another number of `take`), and its pose",
        person.name_of(index), words_for_shift(*moved)));
  }
  camera.moved = moved.has_value();
  if (index == 0) stand(person);
  const compositing::Feet& feet = camera.feed.feet();
  const bool held = person.standing && person.standing->held;
  if (!held || feet.status == FeetStatus::cut_off) camera.lower = feet.lower;
}

void PersonFeed::stand(Person& person) {
  if (!person.tracker) return;
  PersonStatus& status = person.frame.status;
  const PersonCameraFeed& feed = person.cameras.front().feed;
  if (std::exchange(person.tracked_pass, feed.pass()) != feed.pass()) person.tracker->restart();
  person.standing =
      person.tracker->update(std::chrono::duration<double>(feed.time()).count(), feed.feet());
  // What the matte shows as feet need not stand on the floor: the tracker tells.
  FeetStatus seen = feed.feet().status;
  if (person.standing) {
    seen = person.standing->status;
  } else if (seen == FeetStatus::seen) {
    seen = FeetStatus::uncertain;
  }
  const bool was_seen = status.feet == compositing::name_of(FeetStatus::seen);
  // Nobody yet is no news; somebody who cannot be placed is, once.
  const bool unplaced = !person.standing && seen != FeetStatus::absent;
  if (person.standing && !person.standing->held && seen == FeetStatus::uncertain) {
    if (!std::exchange(person.doubted, true)) {
      person.notes.push_back(
          fmt::format("{}: its feet are uncertain: its camera sees them from too far above, or "
                      "leaning. Film from less than 45 degrees above, level or turned by 90",
                      status.name));
    }
  } else if (person.standing && was_seen && seen != FeetStatus::seen) {
    person.notes.push_back(fmt::format("{}: its feet are {}; it stays where it is", status.name,
                                       compositing::name_of(seen)));
  } else if (unplaced && !person.unplaced) {
    person.notes.push_back(
        fmt::format("{}: its feet are {}; it is not shown until they are seen on the floor",
                    status.name, compositing::name_of(seen)));
  }
  person.unplaced |= unplaced;
  status.feet = compositing::name_of(seen);
}

// All sources to the time; keyed is the one that tells the feet.
void PersonFeed::update(Person& person, capture::Time time) {
  for (std::size_t i = 0; i < person.cameras.size(); ++i) {
    PersonCameraFeed& feed = person.cameras[i].feed;
    feed.advance(time);
    for (const std::string& note : feed.take_notes())
      person.notes.push_back(person.name_of(i) + " " + note);
  }
  if (person.tracker || !person.has_several()) show(person, 0);
  // What has given no picture yet has no age.
  capture::Time youngest = capture::Time::max();
  for (const Person::Camera& camera : person.cameras) {
    if (camera.feed.has_picture())
      youngest = std::min(youngest, std::chrono::abs(camera.feed.age()));
  }
  for (Person::Camera& camera : person.cameras) {
    const PersonCameraFeed& feed = camera.feed;
    camera.late =
        !feed.has_picture() || std::chrono::abs(feed.age()) > youngest + feed.period() * 3 / 2;
  }
}

// Leaves a camera out, or takes it back.
void PersonFeed::judge(Person& person, std::size_t index, capture::Time time) {
  Person::Camera& camera = person.cameras[index];
  if (camera.feed.takes_plate()) {  // which was told
    camera.out_for = "its plate is being taken";
    camera.well.reset();
    return;
  }
  const char* wrong = camera.late                 ? "its picture is late"
                      : camera.feed.sees_nobody() ? "it sees nobody"
                                                  : nullptr;
  if (wrong) {
    if (!camera.is_out()) {
      person.notes.push_back(fmt::format("{}: left out, for {}", person.name_of(index), wrong));
    }
    camera.out_for = wrong;
    camera.well.reset();
  } else if (camera.is_out()) {
    if (!camera.well) camera.well = time;
    if (time - *camera.well < trial) return;
    camera.out_for = nullptr;
    person.notes.push_back(fmt::format("{}: taken back", person.name_of(index)));
  }
}

// What to show, with all that it takes keyed. Cameras that it takes may turn out to see nobody:
// then it is chosen anew without them.
void PersonFeed::choose(Person& person, capture::Time time, Vec3 viewer) {
  const PersonSettings& s = person.settings;
  const Vec3 at = person.position();
  std::vector<compositing::ShapeCamera> cameras(person.cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    // Whether somebody is seen again shows only in what is keyed.
    if (person.cameras[i].is_out() && !person.cameras[i].late) show(person, i);
    judge(person, i, time);
    const Vec3 camera = calibrate::position_of(s.cameras[i].cam_from_set);
    cameras[i] = {azimuth(at, camera), !person.cameras[i].is_out()};
  }
  compositing::ShapeQuestion question{s.shape, cameras, azimuth(at, viewer)};
  question.off_plane_m = s.by_feet ? compositing::off_foot_m : compositing::off_body_m;
  question.error_m = s.error_m;
  const auto before = std::exchange(person.choice, std::nullopt);
  person.no_hull = "";
  for (bool settled = false; !settled;) {
    person.choice = choose_shape(question, before);
    settled = true;
    std::vector<compositing::OutlinedView> views;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      if (!cameras[i].is_good || !(person.choice->hull || i == person.choice->camera)) continue;
      show(person, i);
      judge(person, i, time);
      if (person.cameras[i].is_out()) cameras[i].is_good = settled = false;
      const PersonCameraFeed& feed = person.cameras[i].feed;
      views.push_back({*s.cameras[i].lens, s.cameras[i].cam_from_set, feed.outline()});
    }
    if (!person.choice->hull || !settled) continue;
    person.box = compositing::person_box(views, at);
    if (!person.box) {
      person.no_hull =
          "there is no hull, for the outlines of its cameras do not meet: is a pose wrong?";
    } else if (person.box->has(viewer)) {
      person.no_hull = "the view is from within the hull's box";
    }
    if (!person.no_hull.empty()) question.hull_is_there = settled = false;
  }
  // With nobody good, the nearest one's last picture.
  show(person, person.choice->camera);
}

// Status of what was chosen, and notes of what changed.
void PersonFeed::tell(Person& person) {
  PersonStatus& status = person.frame.status;
  const compositing::ShapeChoice& now = *person.choice;
  const PersonSettings& s = person.settings;
  const bool first = !std::exchange(person.told, person.is_placed());
  const bool changed = now.hull != status.hull || static_cast<int>(now.camera) + 1 != status.camera;
  if (!first && (now.hull != status.hull || (changed && !now.hull))) {
    person.notes.push_back(
        fmt::format("{}: shown as {} from here, {:.0f} degrees off, for an error of "
                    "{:.3f} m",
                    status.name, words_for(now), now.view_rad / degree, now.error_m));
  }
  const bool takes_plates = std::ranges::any_of(
      person.cameras, [](const Person::Camera& camera) { return camera.feed.takes_plate(); });
  if (person.is_placed() && !now.holds && status.holds && !takes_plates) {
    person.notes.push_back(fmt::format(
        "{}: seen {:.0f} degrees off camera {}, nothing holds the error of {:g} m: {} has {:.3f} "
        "m, {}",
        status.name, now.view_rad / degree, now.camera + 1, s.error_m, words_for(now), now.error_m,
        person.no_hull.empty() ? fmt::format("the hull would have {:.3f} m", now.hull_error_m)
                               : std::string(person.no_hull)));
  }
  status.hull = now.hull;
  status.camera = static_cast<int>(now.camera) + 1;
  status.error_m = now.error_m;
  status.holds = now.holds || !person.is_placed();
  status.view_angle_deg = now.view_rad / degree;
  status.left_out.clear();
  for (std::size_t i = 0; i < person.cameras.size(); ++i) {
    if (person.cameras[i].is_out()) status.left_out.push_back(static_cast<int>(i) + 1);
  }
}

// Upright, and turned to the show's camera as far as the set says.
void PersonFeed::place_billboard(Person& person, Vec3 viewer) {
  const PersonSettings& s = person.settings;
  PersonStatus& status = person.frame.status;
  const std::size_t index = person.choice ? person.choice->camera : 0;
  const PersonCamera& camera = s.cameras[index];
  const PersonCameraFeed& feed = person.cameras[index].feed;
  const double off_plane = s.by_feet ? compositing::off_foot_m : compositing::off_body_m;
  auto& place = person.frame.places[index];
  if (camera.lens) {
    const std::array<float, 4> box = feed.person_box();
    std::span<const calibrate::Vec2> lower;
    if (s.by_feet) lower = person.cameras[index].lower;
    const auto placed = compositing::place_billboard(
        *camera.lens, camera.cam_from_set, status.position, box, viewer, s.turn_rad, lower);
    if (!placed) {
      const bool nobody = !(box[2] > box[0] && box[3] > box[1]);
      if (nobody) return;  // nothing is to be seen of it, wherever it is
      person.hide(index);
      if (!std::exchange(person.out_of_reach, true)) {
        person.notes.push_back(
            fmt::format("{}: is not shown: from its own camera the picture meets nothing where it "
                        "stands",
                        status.name));
      }
      return;
    }
    person.out_of_reach = false;
    place = placed->set_from_object;
    status.view_angle_deg = placed->view_angle_rad / degree;
    status.shallow = placed->shallow;
  } else {
    // Faces the way that the set says, and from there turns to the camera.
    const double to_viewer = std::atan2(viewer.x - s.position.x, -(viewer.y - s.position.y));
    const compositing::Facing facing = compositing::face(s.yaw_rad, to_viewer, s.turn_rad);
    status.view_angle_deg = facing.view_angle_rad / degree;
    status.shallow = facing.shallow;
    const double turned = facing.azimuth_rad;
    // No more of the video's picture than the window.
    const compositing::Window& window = feed.window();
    const auto high = static_cast<float>(s.height_m), wide = high * feed.aspect();
    const float width = wide * (window.right - window.left);
    const float right = wide * (0.5F * (window.left + window.right) - 0.5F);
    const auto c = static_cast<float>(std::cos(turned)),
               sine = static_cast<float>(std::sin(turned));
    const auto at = calibrate::to_float(s.position);
    place = {width * c,
             -sine,
             0,
             at.x + right * c,  //
             width * sine,
             c,
             0,
             at.y + right * sine,  //
             0,
             0,
             high * (window.bottom - window.top),
             at.z + high * (1 - window.bottom)};
  }
  status.error_m = compositing::billboard_error_m(status.view_angle_deg * degree, off_plane);
  status.holds = status.error_m <= s.error_m;
}

void PersonFeed::place(Person& person, Vec3 viewer) {
  PersonStatus& status = person.frame.status;
  PersonFrame& frame = person.frame;
  status.position = person.position();
  status.sigma_m = person.standing ? person.standing->sigma_m : 0;
  status.held = person.standing && person.standing->held;
  frame.hull_cameras.clear();
  std::ranges::fill(frame.pictures, person.clear);
  const bool known = person.is_placed();
  status.stands = known;
  const std::size_t cameras = person.cameras.size();
  const bool hull = person.choice && person.choice->hull;
  const std::size_t shown = hull ? cameras : person.choice ? person.choice->camera : 0;
  status.confidence = 1;
  for (std::size_t i = 0; i < cameras; ++i) {
    if (hull ? person.cameras[i].is_out() : i != shown) continue;
    const PersonCameraFeed& feed = person.cameras[i].feed;
    if (feed.confidence() <= status.confidence) {
      status.confidence = feed.confidence();
      status.key = feed.key();
    }
    if (known) frame.pictures[hull ? cameras + i : i] = feed.picture();
    if (hull) frame.hull_cameras.push_back(i);
  }
  if (!known) return;
  for (std::size_t i = 0; i < frame.places.size(); ++i) {
    if (i != shown) person.hide(i);
  }
  person.hidden[shown] = false;
  if (!hull) return place_billboard(person, viewer);
  status.shallow = false;
  frame.places[cameras] = compositing::placed_box(calibrate::to_float(person.box->lower),
                                                  calibrate::to_float(person.box->upper));
}

std::vector<PersonFrame> PersonFeed::at(capture::Time time, const calibrate::Pose& cam_from_set) {
  const Vec3 viewer = calibrate::position_of(cam_from_set);
  capture::parallel_for(std::size_t{0}, persons_.size(),
                        [&](std::size_t i) { show_at(*persons_[i], time, viewer); });
  std::vector<PersonFrame> frames;
  for (const auto& person : persons_) {
    std::ranges::move(person->notes, std::back_inserter(notes_));
    person->notes.clear();
    frames.push_back(person->frame);
  }
  return frames;
}

void PersonFeed::show_at(Person& person, capture::Time time, Vec3 viewer) {
  update(person, time);
  const bool was_shallow = person.frame.status.shallow;
  if (person.has_several()) {
    choose(person, time, viewer);
    tell(person);
  }
  place(person, viewer);
  const PersonStatus& status = person.frame.status;
  if (status.shallow && !was_shallow) {
    person.notes.push_back(
        fmt::format("{}: seen {:.0f} degrees from the side, more than it turns ({:.0f})",
                    status.name, status.view_angle_deg, person.settings.turn_rad / degree));
  }
}

std::vector<std::string> PersonFeed::take_notes() { return std::exchange(notes_, {}); }

}  // namespace studio
