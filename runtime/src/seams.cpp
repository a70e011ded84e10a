#include <nms/runtime/seams.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <nms/runtime/nurbs.h>

namespace nms::runtime {

namespace {

using program::Failure;

// Two knots nearer than this are one knot; knots are numbers of spans, so it is far below any real difference.
constexpr double kSameKnot = 1e-9;

struct Spline {
  int degree = 0;
  std::vector<double> knots;
  std::vector<Row> points;
};

// Boehm's insertion of one knot (Piegl and Tiller, eq. 5.15), on rows instead of points.
void insert_knot(Spline& s, double t) {
  const auto p = static_cast<std::size_t>(s.degree);
  const std::size_t k = find_span(s.knots, s.degree, t);
  std::vector<Row> fresh;
  fresh.reserve(s.points.size() + 1);
  for (std::size_t i = 0; i <= s.points.size(); ++i) {
    if (i + p <= k) {
      fresh.push_back(s.points[i]);
    } else if (i > k) {
      fresh.push_back(s.points[i - 1]);
    } else {
      const double width = s.knots[i + p] - s.knots[i];
      const double alpha = width > 0.0 ? (t - s.knots[i]) / width : 0.0;
      const Row* rows[] = {&s.points[i - 1], &s.points[i]};
      const double weights[] = {1.0 - alpha, alpha};
      fresh.push_back(combine(rows, weights));
    }
  }
  s.knots.insert(s.knots.begin() + static_cast<std::ptrdiff_t>(k) + 1, t);
  s.points = std::move(fresh);
}

std::size_t multiplicity(const std::vector<double>& knots, double t) {
  std::size_t n = 0;
  for (const double k : knots) n += std::abs(k - t) <= kSameKnot ? 1 : 0;
  return n;
}

bool is_clamped(const std::vector<double>& knots, int degree) {
  const auto p = static_cast<std::size_t>(degree);
  return knots[0] == knots[p] && knots[knots.size() - 1] == knots[knots.size() - 1 - p];
}

Failure bad_knots(const std::string& what, const std::string& name, const std::string& fault) {
  return {"bad_knots", fmt::format("{} '{}'", what, name), fault,
          "give control points + order knots that never fall, with the ends repeated order times"};
}

class Builder {
 public:
  explicit Builder(const SurfaceNet& net) : net_(net) {}

  tl::expected<Seams, Failure> run() {
    for (std::uint32_t i = 0; i < net_.node_count; ++i) add_point(PointOwner::Kind::node, i, 0);
    state_.assign(net_.curves.size(), State::untouched);
    out_.curves.resize(net_.curves.size());
    out_.surfaces.resize(net_.surfaces.size());
    for (std::uint32_t c = 0; c < net_.curves.size(); ++c) {
      if (auto f = check_curve(c)) return tl::unexpected(std::move(*f));
    }
    for (std::uint32_t c = 0; c < net_.curves.size(); ++c) {
      if (auto f = resolve_curve(c)) return tl::unexpected(std::move(*f));
    }
    for (std::uint32_t s = 0; s < net_.surfaces.size(); ++s) {
      if (auto f = resolve_surface(s)) return tl::unexpected(std::move(*f));
    }
    return std::move(out_);
  }

 private:
  enum class State : std::uint8_t { untouched, open, done };

  Row add_point(PointOwner::Kind kind, std::uint32_t owner, std::size_t index) {
    out_.points.push_back({kind, owner, static_cast<std::uint32_t>(index)});
    return {{static_cast<std::uint32_t>(out_.points.size() - 1), 1.0}};
  }

  std::optional<Failure> check_curve(std::uint32_t c) const {
    const MasterCurve& curve = net_.curves[c];
    const std::size_t extra = static_cast<std::size_t>(std::max(curve.degree, 0)) + 1;
    const std::size_t count = curve.knots.size() > extra ? curve.knots.size() - extra : 0;
    if (auto fault = knot_fault(curve.knots, curve.degree, count)) return bad_knots("curve", curve.name, *fault);
    if (!is_clamped(curve.knots, curve.degree)) return bad_knots("curve", curve.name, "a border curve is not clamped");
    for (const CurveEnd& end : curve.ends) {
      const bool on_node = end.node < net_.node_count;
      const bool on_curve = end.curve < net_.curves.size() && std::isfinite(end.at);
      if (on_node == on_curve) {
        return Failure{"missing_curve", fmt::format("curve '{}'", curve.name), "an end hangs on nothing that is here",
                       "name a node, or another curve and the place on it"};
      }
    }
    return std::nullopt;
  }

  std::optional<Failure> resolve_curve(std::uint32_t first) {
    // A stack of our own: a chain of a thousand curves must not exhaust the machine's.
    std::vector<std::uint32_t> stack{first};
    while (!stack.empty()) {
      const std::uint32_t c = stack.back();
      if (state_[c] == State::done) {
        stack.pop_back();
        continue;
      }
      bool waits = false;
      for (const CurveEnd& end : net_.curves[c].ends) {
        if (end.curve == kNoIndex || state_[end.curve] == State::done) continue;
        if (end.curve == c || state_[end.curve] == State::open) {
          return Failure{"curve_cycle", fmt::format("curve '{}'", net_.curves[c].name),
                         "its end hangs on a curve that hangs on this one", "put a node where the two meet"};
        }
        stack.push_back(end.curve);
        waits = true;
      }
      if (waits) {
        state_[c] = State::open;
        continue;
      }
      finish_curve(c);
      stack.pop_back();
    }
    return std::nullopt;
  }

  void finish_curve(std::uint32_t c) {
    const MasterCurve& curve = net_.curves[c];
    const std::size_t count = curve.knots.size() - static_cast<std::size_t>(curve.degree) - 1;
    auto end_row = [&](const CurveEnd& end) -> Row {
      if (end.node != kNoIndex) return {{end.node, 1.0}};
      return curve_row(net_, out_, end.curve, end.at);
    };
    std::vector<Row>& rows = out_.curves[c];
    rows.push_back(end_row(curve.ends[0]));
    for (std::size_t i = 1; i + 1 < count; ++i) rows.push_back(add_point(PointOwner::Kind::curve, c, i));
    rows.push_back(end_row(curve.ends[1]));
    state_[c] = State::done;
  }

  tl::expected<std::vector<Row>, Failure> side_rows(const NetSurface& surface, const SurfaceSide& side, int degree,
                                                    const std::vector<double>& knots) const {
    const std::string place = fmt::format("surface '{}'", surface.name);
    if (side.curve >= net_.curves.size()) {
      return tl::unexpected(Failure{"missing_curve", place, "a side names no curve", "name a curve of this net"});
    }
    const MasterCurve& curve = net_.curves[side.curve];
    const double low = std::min(side.from, side.to);
    const double high = std::max(side.from, side.to);
    if (!(high - low > kSameKnot) || !(low >= curve.knots.front() - kSameKnot) ||
        !(high <= curve.knots.back() + kSameKnot)) {
      return tl::unexpected(Failure{"open_border", place, fmt::format("a side leaves the curve '{}'", curve.name),
                                    "keep the side's from and to within the curve's knots"});
    }
    if (degree != curve.degree) {
      return tl::unexpected(Failure{"knots_not_nested", place,
                                    fmt::format("a side and its curve '{}' differ in order", curve.name),
                                    "give both the same order"});
    }
    // The side's knots on the curve, ascending.
    std::vector<double> wanted;
    wanted.reserve(knots.size());
    for (const double k : knots) {
      const double share = (k - knots.front()) / (knots.back() - knots.front());
      wanted.push_back(side.from + share * (side.to - side.from));
    }
    if (side.from > side.to) std::reverse(wanted.begin(), wanted.end());
    for (double& w : wanted) {  // a knot of the curve's, not a neighbour by one bit
      const auto near = std::lower_bound(curve.knots.begin(), curve.knots.end(), w - kSameKnot);
      if (near != curve.knots.end() && std::abs(*near - w) <= kSameKnot) w = *near;
    }
    for (const double k : curve.knots) {
      if (k <= low + kSameKnot || k >= high - kSameKnot) continue;
      if (multiplicity(wanted, k) < multiplicity(curve.knots, k)) {
        return tl::unexpected(Failure{"knots_not_nested", place,
                                      fmt::format("a side lacks knot {} of its curve '{}'", k, curve.name),
                                      "let the surface's knots contain those of the curves on its border"});
      }
    }
    Spline s{degree, curve.knots, out_.curves[side.curve]};
    const auto p = static_cast<std::size_t>(degree);
    for (std::size_t i = 0; i < wanted.size();) {
      const double t = wanted[i];
      std::size_t times = 0;
      while (i < wanted.size() && std::abs(wanted[i] - t) <= kSameKnot) ++i, ++times;
      const std::size_t need = std::min(times, p);
      for (std::size_t have = multiplicity(s.knots, t); have < need; ++have) insert_knot(s, t);
    }
    // The stretch begins at the control point that lies on the curve at `low`.
    std::size_t last = 0;
    while (last + 1 < s.knots.size() && s.knots[last + 1] <= low + kSameKnot) ++last;
    const std::size_t begin = last - p;
    const std::size_t count = knots.size() - p - 1;
    if (begin + count > s.points.size()) {
      return tl::unexpected(Failure{"knots_not_nested", place,
                                    fmt::format("a side does not fit its curve '{}'", curve.name),
                                    "let the surface's knots contain those of the curves on its border"});
    }
    std::vector<Row> rows(s.points.begin() + static_cast<std::ptrdiff_t>(begin),
                          s.points.begin() + static_cast<std::ptrdiff_t>(begin + count));
    if (side.from > side.to) std::reverse(rows.begin(), rows.end());
    return rows;
  }

  std::optional<Failure> resolve_surface(std::uint32_t index) {
    const NetSurface& surface = net_.surfaces[index];
    const auto check = [&](int degree, const std::vector<double>& knots) -> std::optional<Failure> {
      const std::size_t extra = static_cast<std::size_t>(std::max(degree, 0)) + 1;
      const std::size_t count = knots.size() > extra ? knots.size() - extra : 0;
      if (auto fault = knot_fault(knots, degree, count)) return bad_knots("surface", surface.name, *fault);
      if (surface.sides && !is_clamped(knots, degree)) {
        return bad_knots("surface", surface.name, "a surface with sides is not clamped");
      }
      return std::nullopt;
    };
    if (auto f = check(surface.degree_u, surface.knots_u)) return f;
    if (auto f = check(surface.degree_v, surface.knots_v)) return f;
    const std::size_t nu = surface.count_u();
    const std::size_t nv = surface.count_v();
    std::vector<Row>& rows = out_.surfaces[index];
    if (!surface.sides) {
      rows.reserve(nu * nv);
      for (std::size_t i = 0; i < nu * nv; ++i) rows.push_back(add_point(PointOwner::Kind::surface, index, i));
      return std::nullopt;
    }
    rows.resize(nu * nv);
    std::array<std::vector<Row>, 4> border;
    for (std::size_t k = 0; k < 4; ++k) {
      const bool along_u = k % 2 == 0;
      std::vector<double> knots = along_u ? surface.knots_u : surface.knots_v;
      if (k >= 2) {  // these sides run against the parameter
        std::reverse(knots.begin(), knots.end());
        for (double& t : knots) t = -t;
      }
      auto side = side_rows(surface, (*surface.sides)[k], along_u ? surface.degree_u : surface.degree_v, knots);
      if (!side) return std::move(side).error();
      border[k] = std::move(*side);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      if (!same_corner((*surface.sides)[k], (*surface.sides)[(k + 1) % 4])) {
        return Failure{"open_border", fmt::format("surface '{}'", surface.name),
                       fmt::format("side {} does not begin where side {} ends", (k + 1) % 4 + 1, k + 1),
                       "list the four sides in order, corner to corner"};
      }
    }
    for (std::size_t v = 0; v < nv; ++v) {
      for (std::size_t u = 0; u < nu; ++u) {
        Row& row = rows[u + nu * v];
        if (v == 0)
          row = border[0][u];
        else if (u + 1 == nu)
          row = border[1][v];
        else if (v + 1 == nv)
          row = border[2][nu - 1 - u];
        else if (u == 0)
          row = border[3][nv - 1 - v];
        else
          row = add_point(PointOwner::Kind::surface, index, u + nu * v);
      }
    }
    return std::nullopt;
  }

  bool same_corner(const SurfaceSide& a, const SurfaceSide& b) const {
    const CurveEnd p = canonical_place(net_, a.curve, a.to);
    const CurveEnd q = canonical_place(net_, b.curve, b.from);
    return p.node == q.node && p.curve == q.curve && (p.curve == kNoIndex || std::abs(p.at - q.at) <= kSameKnot);
  }

  const SurfaceNet& net_;
  Seams out_;
  std::vector<State> state_;
};

}  // namespace

tl::expected<Seams, program::Failure> build_seams(const SurfaceNet& net) { return Builder(net).run(); }

Row combine(std::span<const Row* const> rows, std::span<const double> weights) {
  Row all;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (weights[i] == 0.0) continue;
    for (const RowEntry& e : *rows[i]) all.push_back({e.point, e.weight * weights[i]});
  }
  std::stable_sort(all.begin(), all.end(), [](const RowEntry& a, const RowEntry& b) { return a.point < b.point; });
  Row out;
  for (const RowEntry& e : all) {
    if (!out.empty() && out.back().point == e.point)
      out.back().weight += e.weight;
    else
      out.push_back(e);
  }
  out.erase(std::remove_if(out.begin(), out.end(), [](const RowEntry& e) { return e.weight == 0.0; }), out.end());
  return out;
}

CurveEnd canonical_place(const SurfaceNet& net, std::uint32_t curve, double t) {
  for (;;) {
    const MasterCurve& c = net.curves[curve];
    const CurveEnd* end = nullptr;
    if (t <= c.knots.front() + kSameKnot) end = &c.ends[0];
    if (t >= c.knots.back() - kSameKnot) end = &c.ends[1];
    if (end == nullptr) return {kNoIndex, curve, t};
    if (end->node != kNoIndex) return {end->node, kNoIndex, 0.0};
    curve = end->curve;
    t = end->at;
  }
}

Row curve_row(const SurfaceNet& net, const Seams& seams, std::uint32_t curve, double t) {
  const CurveEnd place = canonical_place(net, curve, t);
  if (place.curve == kNoIndex) return {{place.node, 1.0}};
  const MasterCurve& c = net.curves[place.curve];
  const BasisValues b = basis(c.knots, c.degree, place.at);
  std::vector<const Row*> rows;
  for (int r = 0; r <= c.degree; ++r) rows.push_back(&seams.curves[place.curve][b.first + static_cast<std::size_t>(r)]);
  return combine(rows, {b.value, static_cast<std::size_t>(c.degree) + 1});
}

Row surface_row(const SurfaceNet& net, const Seams& seams, std::uint32_t surface, double u, double v,
                Derivative derivative) {
  const NetSurface& s = net.surfaces[surface];
  const BasisValues bu = basis(s.knots_u, s.degree_u, u);
  const BasisValues bv = basis(s.knots_v, s.degree_v, v);
  std::vector<const Row*> rows;
  std::vector<double> weights;
  double total = 0.0;
  for (int j = 0; j <= s.degree_v; ++j) {
    for (int i = 0; i <= s.degree_u; ++i) {
      const std::size_t at =
          bu.first + static_cast<std::size_t>(i) + s.count_u() * (bv.first + static_cast<std::size_t>(j));
      const double fu = derivative == Derivative::u ? bu.derivative[i] : bu.value[i];
      const double fv = derivative == Derivative::v ? bv.derivative[j] : bv.value[j];
      rows.push_back(&seams.surfaces[surface][at]);
      weights.push_back(fu * fv * (s.weights.empty() ? 1.0 : s.weights[at]));
      total += weights.back();
    }
  }
  if (!s.weights.empty() && derivative == Derivative::none) {
    for (double& w : weights) w /= total;
  }
  return combine(rows, weights);
}

}  // namespace nms::runtime
