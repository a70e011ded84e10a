#pragma once

#include <optional>
#include <string_view>

#include <pugixml.hpp>

#include <nms/program/failure.h>

namespace nms::runtime {

/// The attribute that holds the line a node began on, from 1.
inline constexpr const char* kVrmlLine = "vrml_line";

/// Reads VRML97, or X3D in its Classic VRML encoding, into the tree that X3D's XML encoding has (ISO/IEC 14772-1,
/// 19776-2): a node is an element, its plain fields are attributes, its nodes are children with their field's name as
/// containerField. VRML97's NurbsSurface becomes X3D's NurbsPatchSurface.
///
/// Prototypes, scripts, routes and what else cannot hold a surface are skipped, whatever is in them.
/// Failures: face_not_vrml; the place says the line.
[[nodiscard]] std::optional<program::Failure> read_vrml(std::string_view text, std::string_view name,
                                                        pugi::xml_document& document);

}  // namespace nms::runtime
