#pragma once

#include <embree3/rtcore.h>

#include <tl/expected.hpp>

#include <nms/picture/render.h>

namespace nms::picture {

// clang-format off
#define NMS_EMBREE_FUNCTIONS(X) \
  X(rtcNewDevice) X(rtcReleaseDevice) X(rtcGetDeviceError) \
  X(rtcNewScene) X(rtcSetSceneFlags) X(rtcCommitScene) X(rtcReleaseScene) \
  X(rtcNewGeometry) X(rtcSetNewGeometryBuffer) X(rtcCommitGeometry) X(rtcAttachGeometry) X(rtcReleaseGeometry) \
  X(rtcIntersect1) X(rtcOccluded1)
// clang-format on

/// Embree's functions, by their own names.
struct EmbreeLibrary {
#define NMS_X(function) decltype(&::function) function = nullptr;
  NMS_EMBREE_FUNCTIONS(NMS_X)
#undef NMS_X
};

/// Opens Embree, which then stays until the process ends. It is opened by who draws, not linked: with what it needs it
/// takes several megabytes and as many milliseconds of every process, and most commands draw nothing.
///
/// @param file  the library, as dlopen takes it
/// Failures: it is not installed, or lacks a function.
[[nodiscard]] tl::expected<EmbreeLibrary, RenderFailure> open_embree(const char* file);

/// The library that this was built with, opened once for the process. Safe from many threads.
[[nodiscard]] const tl::expected<EmbreeLibrary, RenderFailure>& embree();

}  // namespace nms::picture
