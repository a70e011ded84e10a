#pragma once

namespace nms::runtime {

/// X3D's colours are what the screen shows, glTF's are linear. sRGB to linear by a polynomial, since pow() is not the
/// same on every machine; error below 1/255.
inline double linear_of(double c) { return c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878); }

}  // namespace nms::runtime
