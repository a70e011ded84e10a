#include <nms/runtime/face_form.h>

namespace nms::runtime {

namespace {

glm::dvec3 direction(program::Axis axis) {
  glm::dvec3 d(0.0);
  const int k = static_cast<int>(axis);
  d[k % 3] = k < 3 ? 1.0 : -1.0;
  return d;
}

}  // namespace

FaceForm face_form(const program::Program& program) {
  FaceForm form;
  if (program.faces.empty()) return form;
  const program::FaceReference& face = program.faces[0];
  form.unit_m = static_cast<double>(face.unit);
  form.up = face.up;
  form.forward = face.forward;
  form.origin = {face.origin[0], face.origin[1], face.origin[2]};
  form.low = {face.low[0], face.low[1], face.low[2]};
  form.high = {face.high[0], face.high[1], face.high[2]};
  form.bounded = form.low != form.high;
  for (const program::FacePart& p : program.face_parts) {
    form.parts.push_back({p.kind, std::string(program.string(p.name)), p.first, p.last});
  }
  for (const program::Landmark& l : program.landmarks) {
    form.landmarks.push_back({std::string(program.string(l.name)),
                              l.vertex,
                              std::string(program.string(l.surface)),
                              {l.position[0], l.position[1], l.position[2]}});
  }
  return form;
}

glm::dmat4 file_to_face(const FaceForm& form) {
  const glm::dvec3 up = direction(form.up);
  const glm::dvec3 forward = direction(form.forward);
  const glm::dvec3 left(up.y * forward.z - up.z * forward.y, up.z * forward.x - up.x * forward.z,
                        up.x * forward.y - up.y * forward.x);
  glm::dmat4 m(0.0);
  for (int k = 0; k < 3; ++k) {
    m[k][0] = form.unit_m * left[k];
    m[k][1] = form.unit_m * up[k];
    m[k][2] = form.unit_m * forward[k];
  }
  m[3] = glm::dvec4(-form.origin, 1.0);
  return m;
}

// Greedy, with one place to come back to: linear for one *, at most length times length for many.
bool fits(std::string_view pattern, std::string_view text) {
  std::size_t p = 0;
  std::size_t t = 0;
  std::size_t star = std::string_view::npos;
  std::size_t from = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      from = t;
    } else if (p < pattern.size() && pattern[p] == text[t]) {
      ++p;
      ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++from;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

}  // namespace nms::runtime
