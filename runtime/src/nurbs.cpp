#include <nms/runtime/nurbs.h>

#include <algorithm>
#include <cmath>

namespace nms::runtime {

std::optional<std::string> knot_fault(std::span<const double> knots, int degree, std::size_t point_count) {
  if (degree < 1 || degree > kMaxNurbsDegree) return "the order lies outside 2 to 16";
  const auto p = static_cast<std::size_t>(degree);
  if (point_count < p + 1) return "there are fewer control points than the order";
  if (knots.size() != point_count + p + 1) return "the number of knots is not control points + order";
  for (std::size_t i = 0; i < knots.size(); ++i) {
    if (!std::isfinite(knots[i])) return "a knot is not a finite number";
    if (i > 0 && knots[i] < knots[i - 1]) return "the knots fall";
  }
  if (!(knots[point_count] > knots[p])) return "the knots span no interval";
  for (std::size_t i = p + 1; i + p + 1 < knots.size(); ++i) {
    const bool inner = knots[i] > knots[p] && knots[i] < knots[point_count];
    if (inner && knots[i + p] <= knots[i]) return "an inner knot is repeated more often than the degree";
  }
  return std::nullopt;
}

std::vector<double> clamped_uniform_knots(int degree, std::size_t spans) {
  const auto p = static_cast<std::size_t>(degree);
  std::vector<double> knots(p, 0.0);
  for (std::size_t i = 0; i <= spans; ++i) knots.push_back(static_cast<double>(i));
  knots.insert(knots.end(), p, static_cast<double>(spans));
  return knots;
}

std::size_t find_span(std::span<const double> knots, int degree, double u) {
  const auto p = static_cast<std::size_t>(degree);
  const std::size_t n = knots.size() - p - 1;
  const auto* begin = knots.data() + p;
  const auto* end = knots.data() + n;  // the domain's last knot is never the left border of a span
  const auto* above = std::upper_bound(begin, end, u);
  std::size_t span = above == begin ? p : static_cast<std::size_t>(above - knots.data()) - 1;
  while (span > p && knots[span] >= knots[span + 1]) --span;
  while (span + 1 < n && knots[span] >= knots[span + 1]) ++span;
  return span;
}

BasisValues basis(std::span<const double> knots, int degree, double u) {
  const auto p = static_cast<std::size_t>(degree);
  const std::size_t n = knots.size() - p - 1;
  u = std::clamp(u, knots[p], knots[n]);
  const std::size_t span = find_span(knots, degree, u);
  BasisValues out;
  out.first = span - p;
  out.degree = degree;
  double left[kMaxNurbsDegree + 1] = {};
  double right[kMaxNurbsDegree + 1] = {};
  double lower[kMaxNurbsDegree + 1] = {};  // the functions of degree p - 1, which the derivative needs
  out.value[0] = 1.0;
  for (std::size_t j = 1; j <= p; ++j) {
    if (j == p) std::copy(out.value, out.value + p, lower);
    left[j] = u - knots[span + 1 - j];
    right[j] = knots[span + j] - u;
    double saved = 0.0;
    for (std::size_t r = 0; r < j; ++r) {
      const double width = right[r + 1] + left[j - r];
      const double share = width > 0.0 ? out.value[r] / width : 0.0;
      out.value[r] = saved + right[r + 1] * share;
      saved = left[j - r] * share;
    }
    out.value[j] = saved;
  }
  // N'(i, p) = p N(i, p-1) / (k(i+p) - k(i)) - p N(i+1, p-1) / (k(i+p+1) - k(i+1))   (eq. 2.7)
  for (std::size_t r = 0; r <= p; ++r) {
    const std::size_t i = out.first + r;
    double d = 0.0;
    if (r > 0) {
      const double width = knots[i + p] - knots[i];
      if (width > 0.0) d += lower[r - 1] / width;
    }
    if (r < p) {
      const double width = knots[i + p + 1] - knots[i + 1];
      if (width > 0.0) d -= lower[r] / width;
    }
    out.derivative[r] = static_cast<double>(degree) * d;
  }
  return out;
}

std::vector<double> span_borders(std::span<const double> knots, int degree) {
  const auto p = static_cast<std::size_t>(degree);
  const std::size_t n = knots.size() - p - 1;
  std::vector<double> borders;
  for (std::size_t i = p; i <= n; ++i) {
    if (borders.empty() || knots[i] > borders.back()) borders.push_back(knots[i]);
  }
  return borders;
}

CurveSample evaluate(const NurbsCurve& curve, double u) {
  const BasisValues b = basis(curve.knots, curve.degree, u);
  glm::dvec3 a{0.0};
  glm::dvec3 da{0.0};
  double w = 0.0;
  double dw = 0.0;
  for (int r = 0; r <= curve.degree; ++r) {
    const std::size_t i = b.first + static_cast<std::size_t>(r);
    const double weight = curve.weights.empty() ? 1.0 : curve.weights[i];
    a += b.value[r] * weight * curve.points[i];
    da += b.derivative[r] * weight * curve.points[i];
    w += b.value[r] * weight;
    dw += b.derivative[r] * weight;
  }
  const glm::dvec3 point = a / w;
  return {point, (da - dw * point) / w};
}

SurfaceSample evaluate(const NurbsSurface& surface, double u, double v) {
  const BasisValues bu = basis(surface.knots_u, surface.degree_u, u);
  const BasisValues bv = basis(surface.knots_v, surface.degree_v, v);
  glm::dvec3 a{0.0};
  glm::dvec3 au{0.0};
  glm::dvec3 av{0.0};
  double w = 0.0;
  double wu = 0.0;
  double wv = 0.0;
  for (int s = 0; s <= surface.degree_v; ++s) {
    for (int r = 0; r <= surface.degree_u; ++r) {
      const std::size_t i =
          bu.first + static_cast<std::size_t>(r) + surface.count_u * (bv.first + static_cast<std::size_t>(s));
      const double weight = surface.weights.empty() ? 1.0 : surface.weights[i];
      const double f = bu.value[r] * bv.value[s] * weight;
      const double fu = bu.derivative[r] * bv.value[s] * weight;
      const double fv = bu.value[r] * bv.derivative[s] * weight;
      a += f * surface.points[i];
      au += fu * surface.points[i];
      av += fv * surface.points[i];
      w += f;
      wu += fu;
      wv += fv;
    }
  }
  const glm::dvec3 point = a / w;
  return {point, (au - wu * point) / w, (av - wv * point) / w};
}

}  // namespace nms::runtime
