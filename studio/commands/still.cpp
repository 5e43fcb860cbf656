// platelight still: one frame as a picture, with what helps to pose a set by eye.
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "capture/png.h"
#include "compositing/display.h"
#include "studio/commands/commands.h"
#include "studio/display_png.h"
#include "studio/figures.h"
#include "studio/overlay.h"
#include "studio/picture_error.h"
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
  std::optional<std::int64_t> reference;
};

// The frame's reference as its display shows it, in place of the kernel's picture.
struct ReferencePicture {
  std::vector<std::uint8_t> rgb8;
  ReferenceFigures figures;
  render::PictureError error;  // of the kernel's picture
};

ReferencePicture render_truth(const Set& set, const ShownFrame& shown, std::int64_t paths) {
  ReferencePicture reference;
  reference.figures.paths = static_cast<int>(paths + paths % 2);  // half of them in each
  const auto start = std::chrono::steady_clock::now();
  const Truth truth = truth_of(shown, reference.figures.paths);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  reference.figures.seconds = seconds.count();
  reference.error = error_against(truth, shown);
  const capture::HalfImage picture = capture::to_half(mean_of(truth));
  reference.rgb8.resize(picture.pixels.size() / 4 * 3);
  const compositing::Display display(display_settings(set));
  display.to_rgb8(picture, reference.rgb8, compositing::curve_of(shown.prepared.job.tone));
  return reference;
}

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
  std::optional<ReferencePicture> reference;
  if (options.reference) {
    reference = render_truth(set, shown, *options.reference);
    picture = reference->rgb8;
  }
  draw_overlays(set, shown, options.overlays, picture);
  capture::write_png(options.out, set.show.width, set.show.height, 3, picture, show.pixel_aspect());
  if (reference) {
    const auto& [rgb8, took, error] = *reference;
    console.figures(show_figures(set, *show.status(), error, took));
    console.say(fmt::format(
        "{} paths a pixel in {:.1f} s; the kernel's picture errs by {:.3f} % against them, whose "
        "own "
        "noise is {:.3f} %",
        took.paths, took.seconds, error.relative_rms * 100, error.reference_noise * 100));
  } else {
    console.figures(show_figures(set, *show.status(), {}));
  }
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
            arguments.option("--reference", o->reference, 2, 1 << 20,
                             "in place of the kernel's picture, that of so many paths a pixel, "
                             "followed to their ends");
            return [o](Console& console) {
              if (o->reference && !o->view.empty()) {
                throw UsageError(
                    "--reference and --view: a view is of what the kernel's pixels took; only one");
              }
              still(*o, console);
            };
          }};
}

}  // namespace studio
