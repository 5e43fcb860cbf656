// What a show tells of itself, kept until it is told.
#include "studio/notes.h"

#include <algorithm>

namespace studio {
namespace {

constexpr std::size_t most_kept = 10;

}  // namespace

void Notes::add(std::string what) {
  const std::lock_guard lock(mutex_);
  new_.push_back(what);
  kept_.push_back(std::move(what));
  ++all_;
  if (kept_.size() <= most_kept) return;
  const std::string kind = kind_of_note(kept_.back());
  const auto same = std::ranges::find(kept_, kind, kind_of_note);
  kept_.erase(same + 1 == kept_.end() ? kept_.begin() : same);
}

std::pair<std::vector<std::string>, std::int64_t> Notes::told() const {
  const std::lock_guard lock(mutex_);
  return {kept_, all_};
}

std::vector<std::string> Notes::take_new() {
  const std::lock_guard lock(mutex_);
  return std::exchange(new_, {});
}

}  // namespace studio
