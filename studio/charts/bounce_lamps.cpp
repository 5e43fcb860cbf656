// Light between surfaces, by so many lamps.
#include "studio/charts/bounce_lamps.h"

#include <vector>

#include <fmt/format.h>

#include "render/bounced_light.h"
#include "render/paper_scenes.h"
#include "render/reference.h"
#include "studio/charts/matte_shot.h"
#include "studio/least_time.h"
#include "studio/paper_shot.h"

namespace studio {
void add_bounce_lamps(bool quick, Chart& chart) {
  const int width = quick ? 64 : 240, height = quick ? 48 : 180, runs = quick ? 1 : 3;
  const std::vector<int> counts =
      quick ? std::vector{0, 16} : std::vector{0, 4, 8, 16, 32, 64, 128, 256};
  render::PaperScene room = render::made_paper_scene("tv_room");
  for (render::Material& material : room.scene.materials) {
    material = make_grey_material(material.name);
  }
  BenchScene shot = make_paper_shot(std::move(room), width, height).shot;
  const Truth truth = truth_of(shot.plate, [&](std::uint32_t seed) {
    return render::render_reference(shot.inputs(), shot.job, shot.plate,
                                    {.samples = quick ? 32 : 256, .seed = seed, .bounces = true});
  });
  const render::LightTable table = shot.job.lights;
  for (const int count : counts) {
    render::BouncedLight bounced;
    const double placing_ms = least_time_ms(
        [&] { bounced = render::BouncedLight(*shot.scene, table, {.lamps = count}); }, runs);
    const std::vector<render::LocalLight> lamps = bounced.lamps(table);
    shot.job.lights = table;
    shot.job.lights.lamps.insert(shot.job.lights.lamps.end(), lamps.begin(), lamps.end());
    ChartPoint point = measured_point(shot, truth, runs);
    point.time_ms += placing_ms;
    point.figures.emplace_back("placing_ms", placing_ms);
    point.scene = "grey TV room with light between surfaces, against the reference with all of it";
    point.method = "lamps of bounced light";
    point.settings = {{"bounce_lamps", static_cast<double>(count)}};
    point.by_default = count == render::Effort{}.bounce_lamps;
    point.label = fmt::format("{}{}", count, point.by_default ? ": default" : "");
    chart.points.push_back(std::move(point));
  }
}

}  // namespace studio
