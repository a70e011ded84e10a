#pragma once

#include <string_view>

#include <nms/program/records.h>

/// The fields of a muscle by name, in the order of the text form. What is 0 or the first enumerator is not printed.
namespace nms::program {

/// Calls `visit(name, field)`; a field is an enumerator, a StringId, a float or float[3].
/// Name and kind are not among them: they stand on the muscle's own line.
template <typename AMuscle, typename Visit>
void visit_fields(AMuscle& muscle, const Visit& visit) {
  visit(std::string_view("side"), muscle.side);
  visit(std::string_view("falloff"), muscle.falloff);
  visit(std::string_view("frame"), muscle.frame);
  visit(std::string_view("attachment"), muscle.attachment);
  visit(std::string_view("attachment_offset"), muscle.attachment_offset);
  visit(std::string_view("insertion"), muscle.insertion);
  visit(std::string_view("insertion_offset"), muscle.insertion_offset);
  visit(std::string_view("region"), muscle.region);
  visit(std::string_view("except"), muscle.except);
  visit(std::string_view("angle"), muscle.angle);
  visit(std::string_view("insertion_radius"), muscle.insertion_radius);
  visit(std::string_view("dissipation_radius"), muscle.dissipation_radius);
  visit(std::string_view("perpendicular_radius"), muscle.perpendicular_radius);
  visit(std::string_view("major_radius"), muscle.major_radius);
  visit(std::string_view("minor_radius"), muscle.minor_radius);
  visit(std::string_view("limit"), muscle.limit);
  visit(std::string_view("amount"), muscle.amount);
  visit(std::string_view("slide"), muscle.slide);
  visit(std::string_view("closes"), muscle.closes);
}

/// Likewise of a channel, behind its name and kind; its track, an index, is not among them.
template <typename AChannel, typename Visit>
void visit_channel_fields(AChannel& channel, const Visit& visit) {
  visit(std::string_view("title"), channel.title);
  visit(std::string_view("positive"), channel.positive);
  visit(std::string_view("negative"), channel.negative);
  visit(std::string_view("au"), channel.au);
  visit(std::string_view("side"), channel.side);
  visit(std::string_view("motion"), channel.motion);
  visit(std::string_view("frame"), channel.frame);
  visit(std::string_view("full_scale"), channel.full_scale);
}

}  // namespace nms::program
