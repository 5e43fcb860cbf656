// platelight still: one frame as a picture, with what helps to pose a set by eye.
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "capture/png.h"
#include "studio/commands/commands.h"
#include "studio/figures.h"
#include "studio/overlay.h"
#include "studio/set_files.h"
#include "studio/show.h"

namespace studio {
namespace {

struct StillOptions {
  std::string set;
  std::string out;
  std::optional<std::int64_t> frame;
  std::vector<std::string> overlays;
  std::string view;
};

void still(const StillOptions& options, Console& console) {
  Set set = read_set(options.set);
  set.show.sharpen = false;  // there is time
  ShowOptions show_options;
  show_options.first = options.frame.value_or(0);
  show_options.frames = 1;
  show_options.record = false;
  for (const std::string& written : {options.out, console.figures_file()}) {
    spare_sources(set, written);
  }
  if (!options.out.ends_with(".png")) {
    throw std::invalid_argument(options.out + ": stills are PNG files, name it *.png");
  }
  Show show(set, show_options);
  if (!options.view.empty()) show.post(SetView{render::ray_view_named(options.view)});
  ShownFrame shown;
  show.run([&](const ShownFrame& frame) { shown = frame; });
  if (!shown.rgb8) throw std::runtime_error(set.path + ": the plate has no such frame");
  for (const std::string& note : shown.notes) console.warn(note);

  std::vector<std::uint8_t> picture = shown.view_rgb8 ? *shown.view_rgb8 : *shown.rgb8;
  draw_overlays(set, shown, options.overlays, picture);
  capture::write_png(options.out, set.show.width, set.show.height, 3, picture);
  console.figures(show_figures(set, *show.status(), {}));
  console.say(fmt::format("{}: {}x{}", options.out, set.show.width, set.show.height));
}

}  // namespace

Command still_command() {
  return {"still", "Render one frame of a set to a PNG file",
          "platelight still demo/car.toml -o still.png --overlay grid,axes,stand_in",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<StillOptions>();
            arguments.positional("SET", o->set, "set file");
            arguments.option("-o,--out", o->out, "PNG file");
            arguments.required("--out");
            arguments.option("--frame", o->frame, 0, 100'000'000, "which frame of the set");
            arguments.choices("--overlay", o->overlays, overlay_names(), "what to draw over it");
            arguments.choice("--view", o->view, render::ray_view_names(),
                             "in place of the picture, what its pixels took, in false colours");
            return [o](Console& console) { still(*o, console); };
          }};
}

}  // namespace studio
