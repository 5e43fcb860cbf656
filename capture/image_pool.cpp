// Images that are used again.
#include "capture/image_pool.h"

#include <utility>

namespace capture {
namespace {

// More than these are not kept: a consumer that once held many does not cost memory for ever.
constexpr std::size_t max_kept = 4;

}  // namespace

ImagePool::ImagePool() : shelf_(std::make_shared<Shelf>()) {}

std::shared_ptr<Image> ImagePool::lend() {
  std::unique_ptr<Image> image;
  {
    const std::lock_guard lock(shelf_->mutex);
    if (!shelf_->images.empty()) {
      image = std::move(shelf_->images.back());
      shelf_->images.pop_back();
    }
  }
  if (!image) {
    image = std::make_unique<Image>();
  }
  return {image.release(), [shelf = shelf_](Image* returned) {
            std::unique_ptr<Image> owned(returned);
            const std::lock_guard lock(shelf->mutex);
            if (shelf->images.size() < max_kept) {
              shelf->images.push_back(std::move(owned));
            }
          }};
}

}  // namespace capture
