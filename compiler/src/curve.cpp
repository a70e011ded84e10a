#include "curve.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <optional>

#include "cubic.h"

namespace nms::compiler {
namespace {

double magnitude(double x) { return x < 0.0 ? -x : x; }

/// The part of a cubic over [a, b], by blossoming; exact at 0 and 1.
Cubic part(const Cubic& c, double a, double b) {
  if (a == 0.0 && b == 1.0) return c;
  if (c.constant()) return c;
  const auto blossom = [&c](double r, double s, double t) {
    const auto mix = [](double x, double y, double u) { return (1.0 - u) * x + u * y; };
    const double a0 = mix(c.p0, c.p1, r), a1 = mix(c.p1, c.p2, r), a2 = mix(c.p2, c.p3, r);
    const double b0 = mix(a0, a1, s), b1 = mix(a1, a2, s);
    return mix(b0, b1, t);
  };
  return {a == 0.0 ? c.p0 : blossom(a, a, a), blossom(a, a, b), blossom(a, b, b), b == 1.0 ? c.p3 : blossom(b, b, b)};
}

/// Walks one curve along a rising list of cut times.
class Walk {
 public:
  explicit Walk(const Curve& curve) : curve_(curve) {}

  /// The cubic over [t0, t1], which has none of the curve's knots inside. `source` is of its segment.
  Cubic over(std::int64_t t0, std::int64_t t1, std::uint32_t& source) {
    const auto& k = curve_.knots;
    source = 0xFFFFFFFFU;
    if (k.empty()) return {};
    while (next_ < k.size() && k[next_].time_ns <= t0) ++next_;
    if (next_ == 0) return flat(k.front().value);
    const CurveKnot& left = k[next_ - 1];
    if (next_ == k.size()) return flat(left.value);
    source = left.source;
    const CurveKnot& right = k[next_];
    const double length = static_cast<double>(right.time_ns - left.time_ns);
    return part({left.value, left.b1, left.b2, right.value}, static_cast<double>(t0 - left.time_ns) / length,
                t1 == right.time_ns ? 1.0 : static_cast<double>(t1 - left.time_ns) / length);
  }

 private:
  static Cubic flat(double v) { return {v, v, v, v}; }
  const Curve& curve_;
  std::size_t next_ = 0;
};

/// Appends a cubic over [t0, t1]; a knot of the same time and value is shared, another value makes a jump.
void append(Curve& out, std::int64_t t0, std::int64_t t1, const Cubic& c, std::uint32_t source) {
  if (out.knots.empty()) {
    out.knots.push_back({t0, c.p0, c.p1, c.p2, source});
  } else {
    CurveKnot& last = out.knots.back();
    assert(last.time_ns == t0);
    // A value that differs by rounding only is no jump.
    if (magnitude(last.value - c.p0) <= 1e-12) {
      last.b1 = c.p1;
      last.b2 = c.p2;
      last.source = source;
    } else {
      last.b1 = last.b2 = last.value;
      if (out.knots.size() >= 2 && out.knots[out.knots.size() - 2].time_ns == t0) {
        last = {t0, c.p0, c.p1, c.p2, source};  // two knots at one time already
      } else {
        out.knots.push_back({t0, c.p0, c.p1, c.p2, source});
      }
    }
  }
  out.knots.push_back({t1, c.p3, c.p3, c.p3, source});
}

/// Rising times of all knots of the curves, each once.
std::vector<std::int64_t> cuts(std::initializer_list<const Curve*> curves) {
  std::vector<std::int64_t> times;
  for (const Curve* c : curves)
    for (const CurveKnot& k : c->knots) times.push_back(k.time_ns);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

/// A curve of a single knot, or the jump at the very last time, has no segment to carry it; this puts it back.
void close(Curve& out, std::int64_t end, double value, std::uint32_t source) {
  if (out.knots.empty() || out.knots.back().time_ns < end) {
    out.knots.push_back({end, value, value, value, source});
  } else if (magnitude(out.knots.back().value - value) > 1e-12) {
    CurveKnot& last = out.knots.back();
    last.b1 = last.b2 = last.value;
    out.knots.push_back({end, value, value, value, source});
  }
}

/// What a curve is before its first knot; a jump at the very first time has no segment in front of it to say so.
void open(Curve& out, double value) {
  if (out.knots.empty() || magnitude(out.knots.front().value - value) <= 1e-12) return;
  const CurveKnot first{out.knots.front().time_ns, value, value, value, out.knots.front().source};
  if (out.knots.size() >= 2 && out.knots[1].time_ns == first.time_ns)
    out.knots.front() = first;
  else
    out.knots.insert(out.knots.begin(), first);
}

/// Roots of a cubic in (0, 1), rising. Bracketed on monotone pieces.
std::size_t roots(const Cubic& c, std::array<double, 3>& out) {
  const MonotonePieces pieces = monotone_pieces(c);
  const auto f = [&c](double u) { return c.value(u); };
  std::size_t found = 0;
  for (std::size_t i = 0; i < pieces.count; ++i)
    if ((f(pieces.edge[i]) < 0.0) != (f(pieces.edge[i + 1]) < 0.0) && found < 3)
      out[found++] = bisected(f, pieces.edge[i], pieces.edge[i + 1]);
  return found;
}

/// Joins two curves interval by interval with a pointwise rule that is exact on cubics.
template <typename Rule>
Curve join(const Curve& a, const Curve& b, Rule rule) {
  const std::vector<std::int64_t> times = cuts({&a, &b});
  Curve out;
  if (times.empty()) return out;
  Walk wa(a), wb(b);
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    std::uint32_t sa = 0, sb = 0;
    const Cubic ca = wa.over(times[i], times[i + 1], sa);
    const Cubic cb = wb.over(times[i], times[i + 1], sb);
    rule(out, times[i], times[i + 1], ca, sa, cb, sb);
  }
  return out;
}

std::uint32_t stronger(const Cubic& a, std::uint32_t sa, const Cubic& b, std::uint32_t sb) {
  const auto weight = [](const Cubic& c) {
    return magnitude(c.p0) + magnitude(c.p1) + magnitude(c.p2) + magnitude(c.p3);
  };
  if (sa == 0xFFFFFFFFU) return sb;
  if (sb == 0xFFFFFFFFU) return sa;
  return weight(b) > weight(a) ? sb : sa;
}

/// Fits f over [t0, t1] by cubics through its values and slopes (cubic Hermite), halved until within kFitTolerance.
/// f(u) gives value and slope in u, where u runs over [0, 1] of the whole interval.
template <typename Function>
void fit(Curve& out, std::int64_t t0, std::int64_t t1, std::uint32_t source, const Function& f, double u0, double u1,
         int depth) {
  const auto [v0, d0] = f(u0);
  const auto [v1, d1] = f(u1);
  const double h = u1 - u0;
  const Cubic c{v0, v0 + d0 * h / 3.0, v1 - d1 * h / 3.0, v1};
  double worst = 0.0;
  for (const double u : {0.125, 0.25, 0.5, 0.75, 0.875})
    worst = std::max(worst, magnitude(c.value(u) - f(u0 + h * u).first));
  const std::int64_t middle = t0 + (t1 - t0) / 2;
  if (worst <= kFitTolerance || depth >= 12 || middle == t0 || middle == t1) {
    append(out, t0, t1, c, source);
    return;
  }
  const double um = u0 + h * (static_cast<double>(middle - t0) / static_cast<double>(t1 - t0));
  fit(out, t0, middle, source, f, u0, um, depth + 1);
  fit(out, middle, t1, source, f, um, u1, depth + 1);
}

/// A way from 0 to 1 where it passes a 24th of its time.
struct Passage {
  std::int64_t at;  ///< 24ths of the whole
  double value;
  double slope;  ///< in a whole
};

/// (1 - cos pi u) / 2 in four cubics; largest error 6.2e-5.
constexpr std::array<Passage, 5> kCosine{{{0, 0.0, 0.0},
                                          {6, 0.14644660940672624, 1.1107207345395915},
                                          {12, 0.5, 1.5707963267948966},
                                          {18, 0.85355339059327373, 1.1107207345395915},
                                          {24, 1.0, 0.0}}};

/// A damped spring: x(u) = 1 - exp(-zeta w u) (cos(d u) + (zeta w / d) sin(d u)) with zeta = 0.6, d = 3 pi and
/// w = d / sqrt(1 - zeta^2), so that zeta w / d = 0.75; divided by x(1) = 1.00085143834280516, so that it ends at 1.
/// Its slope is exp(-zeta w u) (0.75^2 + 1) d sin(d u): it swings 9.4 % past its end at a third, comes back to 1 %
/// before it at two thirds and rests at the end. In fourteen cubics; largest error 2.1e-4. Worked out to 40 digits.
constexpr std::array<Passage, 15> kSpring{{{0, 0.0, 0.0},
                                           {1, 0.097940229456734222, 4.1942171641798781},
                                           {2, 0.31313546275032368, 5.7727928232419538},
                                           {3, 0.5549810136057225, 5.6183143171101098},
                                           {4, 0.76844773563706256, 4.5298143484588294},
                                           {5, 0.92806764203474505, 3.1173492856699482},
                                           {6, 1.0293205631317398, 1.7772349242199257},
                                           {7, 1.0801161125358114, 0.71645548877501347},
                                           {8, 1.0938488799645186, 0.0},
                                           {10, 1.0641698303989907, -0.54714660175405028},
                                           {12, 1.021015230801393, -0.42933682244014704},
                                           {14, 0.99628964555623884, -0.16844672571489459},
                                           {16, 0.99017363717814226, 0.0},
                                           {20, 0.99707682682189792, 0.040692640563893452},
                                           {24, 1.0, 0.0}}};

/// Appends the way from the curve's last knot to (time, value) along a table; exact at both ends.
template <std::size_t N>
void ease_by(const std::array<Passage, N>& way, Curve& curve, std::int64_t time_ns, double value,
             std::uint32_t source) {
  const std::int64_t t0 = curve.knots.back().time_ns;
  const double v0 = curve.knots.back().value;
  const double rise = value - v0;
  for (std::size_t i = 1; i < N; ++i) {
    const Passage &from = way[i - 1], &to = way[i];
    CurveKnot& left = curve.knots.back();
    const std::int64_t t = t0 + (time_ns - t0) * to.at / 24;
    if (t == left.time_ns) continue;
    const double third = static_cast<double>(to.at - from.at) / 72.0;
    left.b1 = v0 + rise * (from.value + from.slope * third);
    left.b2 = v0 + rise * (to.value - to.slope * third);
    const double v = i + 1 == N ? value : v0 + rise * to.value;
    curve.knots.push_back({t, v, v, v, source});
  }
}

}  // namespace

double Curve::value(std::int64_t time_ns) const {
  if (knots.empty()) return 0.0;
  const auto after = std::upper_bound(knots.begin(), knots.end(), time_ns,
                                      [](std::int64_t t, const CurveKnot& k) { return t < k.time_ns; });
  if (after == knots.begin()) return knots.front().value;
  const CurveKnot& left = *(after - 1);
  if (after == knots.end()) return left.value;
  const double u = static_cast<double>(time_ns - left.time_ns) / static_cast<double>(after->time_ns - left.time_ns);
  return Cubic{left.value, left.b1, left.b2, after->value}.value(u);
}

void ease_to(Curve& curve, std::int64_t time_ns, double value, Easing easing, std::uint32_t source) {
  if (curve.knots.empty()) {
    curve.knots.push_back({time_ns, value, value, value, source});
    return;
  }
  CurveKnot& from = curve.knots.back();
  const std::int64_t t0 = from.time_ns;
  const double v0 = from.value;
  assert(time_ns >= t0);
  from.source = source;
  if (time_ns == t0) {
    if (v0 == value) return;
    from.b1 = from.b2 = v0;
    if (curve.knots.size() >= 2 && curve.knots[curve.knots.size() - 2].time_ns == t0) curve.knots.pop_back();
    curve.knots.push_back({time_ns, value, value, value, source});
    return;
  }
  switch (easing) {
    case Easing::smooth:
      from.b1 = v0;
      from.b2 = value;
      break;
    case Easing::linear:
      from.b1 = v0 + (value - v0) / 3.0;
      from.b2 = v0 + 2.0 * (value - v0) / 3.0;
      break;
    case Easing::step:
      from.b1 = from.b2 = v0;
      curve.knots.push_back({time_ns, v0, v0, v0, source});
      break;
    case Easing::cosine:
      return ease_by(kCosine, curve, time_ns, value, source);
    case Easing::spring:
      return ease_by(kSpring, curve, time_ns, value, source);
  }
  curve.knots.push_back({time_ns, value, value, value, source});
}

Curve until(const Curve& curve, std::int64_t time_ns) {
  const auto after = std::upper_bound(curve.knots.begin(), curve.knots.end(), time_ns,
                                      [](std::int64_t t, const CurveKnot& k) { return t < k.time_ns; });
  if (after == curve.knots.begin()) return {};
  Curve out;
  out.knots.assign(curve.knots.begin(), after);
  CurveKnot& left = out.knots.back();
  if (left.time_ns == time_ns) return out;
  const std::uint32_t source = left.source;
  double end = left.value;
  if (after != curve.knots.end()) {
    const double length = static_cast<double>(after->time_ns - left.time_ns);
    const Cubic c =
        part({left.value, left.b1, left.b2, after->value}, 0.0, static_cast<double>(time_ns - left.time_ns) / length);
    left.b1 = c.p1;
    left.b2 = c.p2;
    end = c.p3;
  } else {
    left.b1 = left.b2 = left.value;
  }
  out.knots.push_back({time_ns, end, end, end, source});
  return out;
}

Curve since(Curve curve, std::int64_t time_ns) {
  const auto after = std::upper_bound(curve.knots.begin(), curve.knots.end(), time_ns,
                                      [](std::int64_t t, const CurveKnot& k) { return t < k.time_ns; });
  if (after == curve.knots.begin()) return curve;
  CurveKnot& left = *(after - 1);
  if (left.time_ns != time_ns && after != curve.knots.end()) {
    const double length = static_cast<double>(after->time_ns - left.time_ns);
    const Cubic c =
        part({left.value, left.b1, left.b2, after->value}, static_cast<double>(time_ns - left.time_ns) / length, 1.0);
    left.value = c.p0;
    left.b1 = c.p1;
    left.b2 = c.p2;
  }
  left.time_ns = time_ns;
  curve.knots.erase(curve.knots.begin(), after - 1);
  return curve;
}

std::optional<std::size_t> most_pieces(Easing easing) {
  switch (easing) {
    case Easing::smooth:
    case Easing::linear:
      return 1;
    case Easing::step:
      return 2;
    case Easing::cosine:
      return 4;
    case Easing::spring:
      break;
  }
  return std::nullopt;
}

Curve scaled(Curve curve, double factor) {
  for (CurveKnot& k : curve.knots) {
    k.value *= factor;
    k.b1 *= factor;
    k.b2 *= factor;
  }
  return curve;
}

Curve add(const Curve& a, const Curve& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  Curve out = join(a, b,
                   [](Curve& o, std::int64_t t0, std::int64_t t1, const Cubic& x, std::uint32_t sx, const Cubic& y,
                      std::uint32_t sy) {
                     append(o, t0, t1, {x.p0 + y.p0, x.p1 + y.p1, x.p2 + y.p2, x.p3 + y.p3}, stronger(x, sx, y, sy));
                   });
  const std::int64_t end = std::max(a.knots.back().time_ns, b.knots.back().time_ns);
  close(out, end, a.value(end) + b.value(end), a.knots.back().source);
  open(out, a.knots.front().value + b.knots.front().value);
  return out;
}

Curve maximum(const Curve& a, const Curve& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  Curve out = join(a, b,
                   [](Curve& o, std::int64_t t0, std::int64_t t1, const Cubic& x, std::uint32_t sx, const Cubic& y,
                      std::uint32_t sy) {
                     const Cubic difference{x.p0 - y.p0, x.p1 - y.p1, x.p2 - y.p2, x.p3 - y.p3};
                     std::array<double, 3> root{};
                     const std::size_t count = roots(difference, root);
                     std::int64_t from = t0;
                     double u0 = 0.0;
                     for (std::size_t i = 0; i <= count; ++i) {
                       std::int64_t to = t1;
                       double u1 = 1.0;
                       if (i < count) {
                         to = t0 + static_cast<std::int64_t>(root[i] * static_cast<double>(t1 - t0) + 0.5);
                         if (to <= from || to >= t1) continue;
                         u1 = static_cast<double>(to - t0) / static_cast<double>(t1 - t0);
                       }
                       const double middle = 0.5 * (u0 + u1);
                       const bool first = x.value(middle) >= y.value(middle);
                       Cubic piece = part(first ? x : y, u0, u1);
                       // A crossing is rounded to a nanosecond, or away where there is no nanosecond between. Knots are
                       // exact all the same.
                       piece.p0 = std::max(x.value(u0), y.value(u0));
                       piece.p3 = std::max(x.value(u1), y.value(u1));
                       const std::uint32_t source =
                           first ? sx : sy;  // a level that cuts off has none: what is cut off made it
                       append(o, from, to, piece, source != 0xFFFFFFFFU ? source : first ? sy : sx);
                       from = to;
                       u0 = u1;
                     }
                   });
  const std::int64_t end = std::max(a.knots.back().time_ns, b.knots.back().time_ns);
  close(out, end, std::max(a.value(end), b.value(end)), a.knots.back().source);
  open(out, std::max(a.knots.front().value, b.knots.front().value));
  return out;
}

Curve clamped(const Curve& a, double low, double high) {
  bool inside = true;
  for (const CurveKnot& k : a.knots)
    for (const double v : {k.value, k.b1, k.b2}) inside = inside && v >= low && v <= high;
  if (inside || a.empty()) return a;
  const auto flat = [&a](double v) {
    Curve c;
    c.knots.push_back({a.knots.front().time_ns, v, v, v, a.knots.front().source});
    return c;
  };
  const Curve raised = maximum(a, flat(low));
  return scaled(maximum(scaled(raised, -1.0), flat(-high)), -1.0);
}

Curve either(const Curve& a, const Curve& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  Curve out =
      join(a, b,
           [](Curve& o, std::int64_t t0, std::int64_t t1, const Cubic& x, std::uint32_t sx, const Cubic& y,
              std::uint32_t sy) {
             const std::uint32_t source = stronger(x, sx, y, sy);
             const auto by_constant = [&](const Cubic& c, double k) {  // c + k - c k, exact
               append(o, t0, t1, {c.p0 + k - c.p0 * k, c.p1 + k - c.p1 * k, c.p2 + k - c.p2 * k, c.p3 + k - c.p3 * k},
                      source);
             };
             if (y.constant()) return by_constant(x, y.p0);
             if (x.constant()) return by_constant(y, x.p0);
             fit(
                 o, t0, t1, source,
                 [&](double u) {
                   const double p = x.value(u), q = y.value(u), dp = x.derivative(u), dq = y.derivative(u);
                   return std::pair{p + q - p * q, dp + dq - dp * q - p * dq};
                 },
                 0.0, 1.0, 0);
           });
  const std::int64_t end = std::max(a.knots.back().time_ns, b.knots.back().time_ns);
  const double p = a.value(end), q = b.value(end);
  close(out, end, p + q - p * q, a.knots.back().source);
  const double first_p = a.knots.front().value, first_q = b.knots.front().value;
  open(out, first_p + first_q - first_p * first_q);
  return out;
}

Curve replaced(const Curve& base, const Curve& over, const Curve& w) {
  if (base.empty()) return over;
  // base (1 - w): exact where either is constant; then over is added, which is exact.
  Curve rest = join(
      base, w,
      [](Curve& o, std::int64_t t0, std::int64_t t1, const Cubic& x, std::uint32_t sx, const Cubic& y, std::uint32_t) {
        if (y.constant()) {
          const double k = 1.0 - y.p0;
          append(o, t0, t1, {x.p0 * k, x.p1 * k, x.p2 * k, x.p3 * k}, sx);
        } else if (x.constant()) {
          const double k = x.p0;
          append(o, t0, t1, {k - k * y.p0, k - k * y.p1, k - k * y.p2, k - k * y.p3}, sx);
        } else {
          fit(
              o, t0, t1, sx,
              [&](double u) {
                const double p = x.value(u), q = 1.0 - y.value(u);
                return std::pair{p * q, x.derivative(u) * q - p * y.derivative(u)};
              },
              0.0, 1.0, 0);
        }
      });
  const std::int64_t end =
      std::max(base.knots.back().time_ns, w.empty() ? base.knots.back().time_ns : w.knots.back().time_ns);
  close(rest, end, base.value(end) * (1.0 - w.value(end)), base.knots.back().source);
  open(rest, base.knots.front().value * (1.0 - (w.empty() ? 0.0 : w.knots.front().value)));
  return add(rest, over);
}

void simplify(Curve& curve) {
  std::vector<CurveKnot> kept;
  kept.reserve(curve.knots.size());
  for (std::size_t i = 0; i < curve.knots.size(); ++i) {
    const CurveKnot& k = curve.knots[i];
    const bool flat_before =
        !kept.empty() && kept.back().value == k.value && kept.back().b1 == k.value && kept.back().b2 == k.value;
    const bool last = i + 1 == curve.knots.size();
    const bool flat_after = !last && k.b1 == k.value && k.b2 == k.value && curve.knots[i + 1].value == k.value;
    // In the middle of a level stretch, or after one that ends the curve: nothing would change without it.
    if (flat_before && (last || flat_after)) continue;
    kept.push_back(k);
  }
  curve.knots = std::move(kept);
}

}  // namespace nms::compiler
