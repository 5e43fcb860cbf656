// Figures of shows.
#include "studio/figures.h"
#include "studio/json_text.h"

#include <sys/resource.h>
#include <algorithm>

#include <nlohmann/json.hpp>

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

Json effort_json(const render::Effort& effort) {
  return {{"aa_samples", effort.aa_samples},
          {"aa_tolerance", effort.aa_tolerance},
          {"glint_contrast", effort.glint_contrast},
          {"light_samples", effort.light_samples},
          {"interleave", effort.interleave},
          {"bounce_lamps", effort.bounce_lamps},
          {"caustic_photons", effort.caustic_photons},
          {"adaptive_visibility", effort.adaptive_visibility},
          {"soft_lights", effort.soft_lights},
          {"cull_lights", effort.cull_lights},
          {"accuracy", effort.accuracy},
          {"chance_cuts", effort.chance_cuts},
          {"max_depth", effort.max_depth},
          {"max_rays", effort.max_rays},
          {"tile_size", effort.tile_size}};
}

Json probe_json(const ShowStatus& s) {
  const auto share_of = [&](capture::MergeStatus status) {
    return s.probe.shares[static_cast<std::size_t>(status)];
  };
  return {
      {"live", s.probe.live},
      {"age_frames", s.light_age_frames},
      {"age_frames_p99", s.light_age_frames_p99},
      {"kept_frames", s.kept_light_frames},
      {"kept_because", s.probe.kept_because},
      {"frames", s.probe.frames},
      {"lost", s.probe.lost},
      {"rejected", s.probe.rejected},
      {"shots", s.probe.shots},
      {"exposure_lag", s.probe.exposure_lag ? Json(*s.probe.exposure_lag) : Json(nullptr)},
      {"exposures_s", s.probe.exposures_s},
      {"too_bright", s.probe.too_bright},
      {"too_dark", s.probe.too_dark},
      {"refused", s.probe.refused},
      {"refusal", s.probe.refusal},
      {"flicker_hz", s.probe.flicker ? Json(s.probe.flicker->light_hz) : Json(nullptr)},
      {"flicker_modulation", s.probe.flicker ? Json(s.probe.flicker->modulation) : Json(nullptr)},
      {"good", share_of(capture::MergeStatus::good)},
      {"dark", share_of(capture::MergeStatus::dark)},
      {"inconsistent", share_of(capture::MergeStatus::inconsistent)},
      {"lower_bound", share_of(capture::MergeStatus::lower_bound)},
      {"missing", share_of(capture::MergeStatus::missing)}};
}

Json persons_json(const std::vector<PersonStatus>& persons) {
  Json rows = Json::array();
  for (const PersonStatus& p : persons) {
    rows.push_back(
        {{"name", p.name},
         {"confidence", p.confidence},
         {"key", p.key},
         {"feet", p.feet},
         {"held", p.held},
         {"position", p.stands ? Json{p.position.x, p.position.y, p.position.z} : Json()},
         {"sigma_m", p.stands ? Json(p.sigma_m) : Json()},
         {"view_angle_deg", p.view_angle_deg},
         {"shallow", p.shallow},
         {"shape", p.hull ? "hull" : "billboard"},
         {"camera", p.camera},
         {"error_m", p.error_m},
         {"holds", p.holds},
         {"left_out", p.left_out}});
  }
  return rows;
}

Json record_json(const Set& set, const compositing::RecorderStatus& recorder) {
  Json json{{"written", recorder.written},
            {"dropped", recorder.dropped},
            {"sounds_left_out", recorder.sounds_left_out},
            {"worst_write_ms", recorder.worst_write_s * 1000},
            {"write_ms", recorder.write_s * 1000}};
  if (!set.record.key.empty()) json["key_raised"] = recorder.raised_share;
  if (!recorder.error.empty()) json["error"] = recorder.error;
  for (const compositing::RecordedOutput& output : recorder.outputs) {
    Json row{{"name", output.name}, {"written", output.written}};
    if (!output.error.empty()) row["error"] = output.error;
    json["outputs"].push_back(std::move(row));
  }
  return json;
}

// None where no patch was looked at.
Json told_albedo(const render::MatchResult& match) {
  const bool any = std::ranges::any_of(match.implied_albedo, [](float a) { return a > 0; });
  return any ? Json(match.implied_albedo) : Json(nullptr);
}

}  // namespace

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

std::string show_figures(const Set& set,
                         const ShowStatus& s,
                         const std::optional<render::PictureError>& error,
                         const std::optional<ReferenceFigures>& reference) {
  Json stage_ms;
  for (std::size_t i = 0; i < stages; ++i) {
    stage_ms[std::string(name_of(static_cast<Stage>(i)))] = s.stage_ms[i];
  }
  Json json{{"set", set.path},
            {"width", set.show.width},
            {"height", set.show.height},
            {"frames", s.frames},
            {"dropped", s.dropped},
            {"fps", s.fps},
            {"frame_ms", {{"p50", s.frame_ms_p50}, {"p99", s.frame_ms_p99}}},
            {"first_frame_ms", s.first_frame_ms},
            {"sharpness", s.sharpness},
            {"stage_ms", stage_ms},
            {"rays",
             {{"primary", s.statistics.primary_rays},
              {"shadow", s.statistics.shadow_rays},
              {"secondary", s.statistics.secondary_rays},
              {"kept", s.statistics.kept_rays}}},
            {"delay_frames", s.delay_frames},
            {"delay_frames_p99", s.delay_frames_p99},
            {"probe", probe_json(s)},
            {"persons", persons_json(s.persons)},
            {"match", s.match.gain},
            {"match_exposure", s.match.exposure},
            {"match_note", s.match.note},
            {"match_pixels", s.match.pixels},
            {"match_spread", s.match.pixels > 0 ? Json(s.match.spread) : Json(nullptr)},
            {"implied_albedo", told_albedo(s.match)},
            {"lights", s.lights},
            {"light_error_estimate", s.light_error_estimate},
            {"unseen_share", s.unseen_share},
            {"lost_plate_frames", s.lost_plate_frames},
            {"held_shapes", s.held_shapes},
            {"damaged_plate_frames", s.damaged_plate_frames},
            {"clamped_values", s.statistics.clamped_values},
            {"depth_limit_hits", s.statistics.depth_limit_hits},
            {"ray_limit_hits", s.statistics.ray_limit_hits},
            {"clipped_plate_pixels", s.statistics.clipped_plate},
            {"virtual_pixels", s.statistics.virtual_pixels},
            {"affected_pixels", s.statistics.affected_pixels},
            {"display_nan", s.display_nan},
            {"effort", effort_json(s.effort)},
            {"recorder", record_json(set, s.recorder)},
            {"peak_memory_mb", peak_memory_mb()},
            {"notes", s.notes}};
  if (s.match.matrix) json["match_matrix"] = *s.match.matrix;
  if (set.display.tone) json["tone"] = {{"p", s.tone[0]}, {"brightest", s.tone[1]}};
  if (s.pixel_figures) {
    for (std::size_t i = 0; i < s.pixel_figures->size(); ++i) {
      const render::RayViewFigures& figures = (*s.pixel_figures)[i];
      json["per_pixel"][render::ray_view_names()[i]] = {{"mean", figures.mean},
                                                        {"max", figures.max}};
    }
  }
  if (reference) {
    json["reference"] = {{"paths", reference->paths}, {"seconds", reference->seconds}};
  }
  if (error) {
    json["error"] = {
        {"relative_rms", error->relative_rms},
        {"reference_noise", error->reference_noise},
        {"p99", error->p99},
        {"delta_e",
         {{"mean", error->delta_e_mean}, {"p95", error->delta_e_p95}, {"p99", error->delta_e_p99}}},
        {"pixels", error->pixels}};
  }
  return json_text(json);
}

}  // namespace studio
