// Points of charts as marks and lines.
#include "studio/chart_points.h"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>

namespace studio {
namespace {

// Of variants, and of peers.
constexpr std::array<Mark, 4> marks{Mark::disc, Mark::square, Mark::diamond, Mark::triangle};
constexpr std::string_view peer_dashes = "2 4";

constexpr std::string_view ink = chart_ink;
constexpr std::string_view faint_ink = faint_chart_ink;

template <class Texts>
std::size_t place_in(Texts& texts, const std::string& text) {
  const auto found = std::ranges::find(texts, text);
  if (found != texts.end()) return static_cast<std::size_t>(found - texts.begin());
  texts.push_back(text);
  return texts.size() - 1;
}

using Points = std::vector<const ChartPoint*>;

Points points_of(const Chart& chart, const std::string& scene) {
  Points points;
  for (const ChartPoint& p : chart.points) {
    if (p.scene == scene) points.push_back(&p);
  }
  return points;
}

using Value = std::function<std::optional<double>(const ChartPoint&)>;

std::optional<double> error_of(const ChartPoint& p) { return p.error; }
std::optional<double> time_of(const ChartPoint& p) { return p.time_ms; }

Value figure_named(const std::string& name) {
  if (name == "error") return error_of;
  if (name == "error_p99") return [](const ChartPoint& p) { return p.error_p99; };
  return [name](const ChartPoint& p) -> std::optional<double> {
    const auto found = std::ranges::find(p.figures, name, &std::pair<std::string, double>::first);
    return found == p.figures.end() ? std::nullopt : std::optional(found->second);
  };
}

struct Box {
  double x0, y0, x1, y1;
  bool meets(const Box& other) const {
    return x0 < other.x1 && other.x0 < x1 && y0 < other.y1 && other.y0 < y1;
  }
};

// Names points where there is room: the front first, and no name over another, a mark or the front.
void label_points(Svg& svg,
                  const Points& points,
                  const Axis& x,
                  const Axis& y,
                  const std::vector<std::pair<double, double>>& front) {
  constexpr double size = 11;
  std::vector<Box> taken;
  for (const ChartPoint* p : points) {
    const double px = x(p->time_ms);
    const double py = y(p->error);
    taken.push_back({px - 5, py - 5, px + 5, py + 5});
  }
  constexpr int pieces = 24;  // of each stretch of the front
  for (std::size_t i = 1; i < front.size(); ++i) {
    for (int j = 0; j <= pieces; ++j) {
      const double t = static_cast<double>(j) / pieces;
      const double px = front[i - 1].first + (front[i].first - front[i - 1].first) * t;
      const double py = front[i - 1].second + (front[i].second - front[i - 1].second) * t;
      taken.push_back({px - 1, py - 1, px + 1, py + 1});
    }
  }
  Points order = points;
  std::ranges::stable_sort(order, {}, [](const ChartPoint* p) {
    return p->by_default ? 0 : p->on_front ? 1 : p->peer ? 2 : 3;
  });
  for (const ChartPoint* p : order) {
    // Where variants crowd, the front's names and the peers' tell the others'.
    const bool strong = p->on_front || p->by_default;
    if (p->label.empty() || (!p->variant.empty() && !strong && !p->peer)) continue;
    const double w = text_width(p->label, size);
    const double px = x(p->time_ms);
    const double py = y(p->error);
    // Below left of the front is empty by its nature, so its own names go there.
    std::vector<std::pair<double, double>> places{{px + 9, py + 4},
                                                  {px + 8, py - 8},
                                                  {px - w / 2, py - 10},
                                                  {px - w - 9, py + 4},
                                                  {px - w / 2, py + 19}};
    if (strong) places.insert(places.begin(), {px - w - 8, py + 15});
    for (const auto& [tx, ty] : places) {
      const Box box{tx - 1, ty - size, tx + w + 1, ty + 2};
      const bool inside = box.x0 > x.from && box.x1 < x.to && box.y0 > y.to && box.y1 < y.from;
      if (!inside || std::ranges::any_of(taken, [&](const Box& b) { return b.meets(box); })) {
        continue;
      }
      svg.text(tx, ty, p->label, {size, Anchor::start, strong ? ink : faint_ink, strong});
      taken.push_back(box);
      break;
    }
  }
}

// 0 has none on a logarithmic axis: at its lower end it would look measured as that.
bool has_place(const Axis& axis, double value) { return !axis.logarithmic || value > 0; }

// The points' values against their time.
void draw_points(Svg& svg,
                 const std::vector<Series>& all,
                 const Value& value,
                 const Axis& x,
                 const Axis& y,
                 double radius,
                 const Value& across = time_of) {
  for (const bool lines : {true, false}) {
    for (const Series& series : all) {
      std::vector<std::pair<double, double>> places;
      for (const ChartPoint* p : series.points) {
        const auto u = across(*p);
        const auto v = value(*p);
        if (u && v && has_place(x, *u) && has_place(y, *v)) places.emplace_back(x(*u), y(*v));
      }
      if (lines && places.size() > 1) {
        svg.polyline(places, series.colour, series.peer ? 1.8 : 1, series.peer ? peer_dashes : "");
      }
      for (const auto& [px, py] : places) {
        if (!lines) svg.mark(px, py, series.mark, radius, series.colour, !series.peer);
      }
    }
  }
}

Points all_points(const Chart& chart) {
  Points points;
  for (const ChartPoint& p : chart.points) points.push_back(&p);
  return points;
}

std::vector<Series> series_in(const std::vector<Series>& all, const std::string& scene) {
  std::vector<Series> some;
  std::ranges::copy_if(all, std::back_inserter(some),
                       [&](const Series& s) { return s.scene == scene; });
  return some;
}

}  // namespace

// Every method has a colour, and every variant a mark; peers, which come last, have open marks.
std::vector<Series> series_of(const Chart& chart) {
  std::vector<Series> all;
  std::vector<std::string> methods, variants, peers;
  for (const bool peer : {false, true}) {
    for (const ChartPoint& p : chart.points) {
      if (p.peer != peer) continue;
      const std::size_t method = place_in(methods, p.method);
      const std::size_t mark = peer ? place_in(peers, p.method) : place_in(variants, p.variant);
      auto series = std::ranges::find_if(all, [&](const Series& s) {
        return s.scene == p.scene && s.peer == peer && s.method == p.method &&
               s.variant == p.variant;
      });
      if (series == all.end()) {
        series = all.insert(all.end(), {p.scene,
                                        p.method,
                                        p.variant,
                                        peer,
                                        chart_colours[method % chart_colours.size()],
                                        marks[mark % marks.size()],
                                        {}});
      }
      series->points.push_back(&p);
    }
  }
  return all;
}

std::vector<std::string> scenes_of(const Chart& chart) {
  std::vector<std::string> scenes;
  for (const ChartPoint& p : chart.points) place_in(scenes, p.scene);
  if (scenes.empty()) scenes.emplace_back();
  return scenes;
}

Axis axis_of(const Chart& chart, const std::vector<double>& errors, double from, double to) {
  return chart.relative ? error_axis(errors, from, to) : log_axis(errors, from, to);
}

void draw_figures(Svg& svg,
                  const Chart& chart,
                  const std::vector<Series>& all,
                  const FigurePanel& panel,
                  const PanelPlace& place) {
  const bool alone = !panel.scene.empty();
  const Points points = alone ? points_of(chart, panel.scene) : all_points(chart);
  const Value across = panel.across.empty() ? time_of : figure_named(panel.across);
  std::vector<double> places;
  for (const ChartPoint* p : points) {
    if (const auto at = across(*p)) places.push_back(*at);
  }
  const Axis x = log_axis(places, place.left, place.left + place.width);
  std::vector<double> values;
  for (const auto& [figure, word] : panel.figures) {
    for (const ChartPoint* p : points) values.push_back(figure_named(figure)(*p).value_or(0));
  }
  const Axis y = axis_of(chart, values, place.top + place.height, place.top);
  draw_axes(svg, x, y, panel.across.empty() ? chart.time_name : panel.across_name, panel.name,
            11.5);
  for (const auto& [figure, word] : panel.figures) {
    const Value value = figure_named(figure);
    draw_points(svg, alone ? series_in(all, panel.scene) : all, value, x, y, 3.2, across);
    double highest = 0;  // of our own
    for (const ChartPoint* p : points) {
      if (!p->peer) highest = std::max(highest, value(*p).value_or(0));
    }
    if (!word.empty() && highest > 0) {
      svg.text(place.left + place.width - 8, y(highest) - 10, word, {11, Anchor::end, faint_ink});
    }
  }
}

void draw_scene(Svg& svg,
                const Chart& chart,
                const std::vector<Series>& all,
                const std::string& scene,
                const PanelPlace& place,
                double text_size) {
  Points points = points_of(chart, scene);
  std::erase_if(points, [](const ChartPoint* p) { return !(p->error > 0); });
  std::vector<double> errors, times;
  for (const ChartPoint* p : points) {
    errors.push_back(p->error);
    times.push_back(p->time_ms);
  }
  const Axis x = log_axis(times, place.left, place.left + place.width);
  const Axis y = axis_of(chart, errors, place.top + place.height, place.top);
  draw_axes(svg, x, y, chart.time_name, chart.error_name, text_size);
  draw_points(svg, series_in(all, scene), error_of, x, y, 4.5);
  std::vector<std::pair<double, double>> front;
  for (const ChartPoint* p : points) {
    if (p->on_front) front.emplace_back(x(p->time_ms), y(p->error));
  }
  std::ranges::sort(front);
  if (front.size() > 1) svg.polyline(front, ink, 2);
  for (const auto& [px, py] : front) svg.mark(px, py, Mark::disc, 7.5, ink, false);
  label_points(svg, points, x, y, front);
}

void draw_legend(
    Svg& svg, const Chart& chart, const std::vector<Series>& all, double left, double top) {
  double y = top + 14;
  const auto entry = [&](std::string_view text) {
    svg.text(left + 30, y, text, {12.5});
    y += 22;
  };
  const auto heading = [&](std::string_view text) {
    svg.text(left, y, text, {13, Anchor::start, ink, true});
    y += 24;
  };
  std::vector<std::string> methods, variants, peers;
  const bool has_variants =
      std::ranges::any_of(all, [](const Series& s) { return s.variant != ""; });
  heading("method");
  for (const Series& s : all) {
    if (s.peer || std::ranges::find(methods, s.method) != methods.end()) continue;
    methods.push_back(s.method);
    svg.line(left, y - 4.5, left + 22, y - 4.5, s.colour, has_variants ? 4 : 1);
    if (!has_variants) svg.mark(left + 11, y - 4.5, s.mark, 5, s.colour);
    entry(s.method);
  }
  if (has_variants) {
    y += 8;
    heading(chart.variant_name);
  }
  for (const Series& s : all) {
    if (s.peer || !has_variants || std::ranges::find(variants, s.variant) != variants.end())
      continue;
    variants.push_back(s.variant);
    svg.mark(left + 11, y - 4.5, s.mark, 5, faint_ink);
    entry(s.variant);
  }
  for (const Series& s : all) {
    if (!s.peer) continue;
    if (peers.empty()) {
      y += 8;
      heading("for comparison");
    }
    if (std::ranges::find(peers, s.method) != peers.end()) continue;
    peers.push_back(s.method);
    svg.polyline({{left - 2, y - 4.5}, {left + 24, y - 4.5}}, s.colour, 1.8, peer_dashes);
    svg.mark(left + 11, y - 4.5, s.mark, 5, s.colour, false);
    entry(s.method);
  }
  y += 10;
  svg.line(left - 2, y - 4.5, left + 24, y - 4.5, ink, 2);
  svg.mark(left + 11, y - 4.5, Mark::disc, 7, ink, false);
  entry("Pareto front:");
  svg.text(left + 30, y - 6, "nothing of ours is both", {11, Anchor::start, faint_ink});
  svg.text(left + 30, y + 8, "faster and closer", {11, Anchor::start, faint_ink});
}

}  // namespace studio
