#pragma once

#include <cstddef>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

/// How fast what is posed moves from one set of channels' values to another.
namespace nms::ada {

/// One step of a sweep.
struct SweepStep {
  double mm = 0.0;         ///< the furthest that a vertex goes in it
  int number = 0;          ///< from 1
  std::size_t vertex = 0;  ///< which
};

inline std::vector<float> between(const std::vector<float>& from, const std::vector<float>& to, int step, int steps) {
  std::vector<float> values(from.size());
  const float u = static_cast<float>(step) / static_cast<float>(steps);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = from[i] + u * (to[i] - from[i]);
  return values;
}

/// Of `steps` from one set of values to the other the one in which a vertex goes furthest.
///
/// @param at  the vertices under values [m]
template <typename Places>
SweepStep fastest_step(const Places& at, const std::vector<float>& from, const std::vector<float>& to, int steps) {
  SweepStep most;
  std::vector<glm::vec3> last = at(from);
  for (int k = 1; k <= steps; ++k) {
    const std::vector<glm::vec3>& now = at(between(from, to, k, steps));
    for (std::size_t v = 0; v < now.size(); ++v) {
      const double mm = 1000.0 * glm::distance(glm::dvec3(now[v]), glm::dvec3(last[v]));
      if (mm > most.mm) most = {mm, k, v};
    }
    last = now;
  }
  return most;
}

/// The fastest of all, and the finest look at it.
struct Sweep {
  SweepStep coarse, fine;
};

/// Looks at `coarse` steps, and at `fine` steps of the fastest of them.
template <typename Places>
Sweep sweep(const Places& at, const std::vector<float>& from, const std::vector<float>& to, int coarse, int fine) {
  Sweep out;
  out.coarse = fastest_step(at, from, to, coarse);
  out.fine = fastest_step(at, between(from, to, out.coarse.number - 1, coarse),
                          between(from, to, out.coarse.number, coarse), fine);
  return out;
}

}  // namespace nms::ada
