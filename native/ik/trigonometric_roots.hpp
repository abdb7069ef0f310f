// Roots of trigonometric polynomials of degree two: mean + c1 cos x + s1 sin x + c2 cos 2x + s2 sin 2x = 0.
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <numbers>

namespace mmp::ik {

// mean + cosine cos x + sine sin x.
struct Wave {
  double mean = 0, cosine = 0, sine = 0;

  Wave operator+(const Wave& o) const { return {mean + o.mean, cosine + o.cosine, sine + o.sine}; }
  Wave operator*(double s) const { return {mean * s, cosine * s, sine * s}; }
};

struct TrigonometricPolynomial {
  double mean = 0, cosine = 0, sine = 0, cosine2 = 0, sine2 = 0;

  TrigonometricPolynomial operator+(const TrigonometricPolynomial& o) const {
    return {mean + o.mean, cosine + o.cosine, sine + o.sine, cosine2 + o.cosine2, sine2 + o.sine2};
  }
  TrigonometricPolynomial operator*(double s) const { return {mean * s, cosine * s, sine * s, cosine2 * s, sine2 * s}; }
};

inline TrigonometricPolynomial product(const Wave& a, const Wave& b) {
  return {a.mean * b.mean + (a.cosine * b.cosine + a.sine * b.sine) / 2, a.mean * b.cosine + a.cosine * b.mean,
          a.mean * b.sine + a.sine * b.mean, (a.cosine * b.cosine - a.sine * b.sine) / 2,
          (a.cosine * b.sine + a.sine * b.cosine) / 2};
}

// Angles of roots near the unit circle: up to four.
struct Angles {
  std::array<double, 4> values;
  int count = 0;
};

// Finds the roots of a complex polynomial, c[0] first, by the method of Ehrlich and Aberth. Double roots are accurate
// to half the digits.
inline Angles angles_of_roots(const std::complex<double>* c, int degree) {
  using Complex = std::complex<double>;
  constexpr int kSteps = 64;
  constexpr double kStill = 1e-14, kOffCircle = 0.1;
  std::array<Complex, 4> roots;
  for (int k = 0; k < degree; ++k) roots[k] = std::polar(1.1 - 0.15 * k, 0.7 + 2 * std::numbers::pi * k / degree);
  for (int step = 0; step < kSteps; ++step) {
    double moved = 0;
    for (int k = 0; k < degree; ++k) {
      Complex value = c[degree], slope = 0, others = 0;
      for (int i = degree - 1; i >= 0; --i) slope = slope * roots[k] + value, value = value * roots[k] + c[i];
      for (int i = 0; i < degree; ++i)
        if (i != k && roots[i] != roots[k]) others += 1.0 / (roots[k] - roots[i]);
      const Complex below = slope - value * others;
      if (value == 0.0 || below == 0.0) continue;
      const Complex change = value / below;
      roots[k] -= change;
      moved = std::max(moved, std::abs(change) / std::max(std::abs(roots[k]), 1e-3));
    }
    if (!(moved > kStill)) break;
  }
  Angles out;
  for (int k = 0; k < degree; ++k)
    if (std::abs(std::abs(roots[k]) - 1) < kOffCircle) out.values[out.count++] = std::arg(roots[k]);
  return out;
}

// Returns the angles x [rad] at which the polynomial is zero, and those at which it nearly is.
inline Angles roots_of(const TrigonometricPolynomial& p) {
  constexpr double kVanishing = 1e-14;
  const std::complex<double> outer(p.cosine2 / 2, -p.sine2 / 2), inner(p.cosine / 2, -p.sine / 2);
  // In z = exp(i x), times z^2.
  const std::array<std::complex<double>, 5> c{std::conj(outer), std::conj(inner), p.mean, inner, outer};
  const double size = std::max({std::abs(outer), std::abs(inner), std::abs(p.mean)});
  if (std::abs(outer) > kVanishing * size) return angles_of_roots(c.data(), 4);
  if (std::abs(inner) > kVanishing * size) return angles_of_roots(c.data() + 1, 2);
  return {};
}

}  // namespace mmp::ik
