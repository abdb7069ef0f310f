// Vector lanes: one configuration (or one instant) per lane.
//
// GCC/Clang vector extensions: the same source compiles for SSE2, AVX2, AVX-512 and ARM. No fused multiply-add and no
// reassociation (see CMakeLists.txt): every build gives the same bits, so the same seed gives the same plan everywhere.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#ifndef MMP_LANES
#define MMP_LANES 8
#endif

#define MMP_INLINE inline __attribute__((always_inline))
// For large code that few queries need, called from loops that most of the time is spent in: inlined there, it takes
// their registers.
#define MMP_NOINLINE __attribute__((noinline))

namespace mmp {

typedef float Floats __attribute__((vector_size(4 * MMP_LANES)));
typedef double Doubles __attribute__((vector_size(4 * MMP_LANES)));

template <class V>
struct Lanes;
template <>
struct Lanes<Floats> {
  using Scalar = float;
  using Int = int32_t;
  typedef int32_t Mask __attribute__((vector_size(4 * MMP_LANES)));
  static constexpr int width = MMP_LANES;
};
template <>
struct Lanes<Doubles> {
  using Scalar = double;
  using Int = int64_t;
  typedef int64_t Mask __attribute__((vector_size(4 * MMP_LANES)));
  static constexpr int width = MMP_LANES / 2;
};
template <class V>
using Scalar = typename Lanes<V>::Scalar;
template <class V>
using Mask = typename Lanes<V>::Mask;
template <class V>
inline constexpr int width = Lanes<V>::width;

template <class V>
MMP_INLINE V splat(Scalar<V> x) {
  return V{} + x;
}
template <class V>
MMP_INLINE V load(const Scalar<V>* p) {
  V v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
template <class V>
MMP_INLINE void store(Scalar<V>* p, V v) {
  std::memcpy(p, &v, sizeof v);
}
template <class V>
MMP_INLINE V select(Mask<V> m, V a, V b) {
  return m ? a : b;
}
template <class V>
MMP_INLINE V min(V a, V b) {
  return a < b ? a : b;
}
template <class V>
MMP_INLINE V max(V a, V b) {
  return a > b ? a : b;
}
template <class V>
MMP_INLINE V abs(V a) {
  return a < V{} ? -a : a;
}

template <class V>
MMP_INLINE V sqrt(V a) {
#if defined(__AVX512F__) && MMP_LANES == 16
  if constexpr (std::is_same_v<V, Floats>) return (V)_mm512_mask_sqrt_ps((__m512)a, 0xffff, (__m512)a);
  else return (V)_mm512_mask_sqrt_pd((__m512d)a, 0xff, (__m512d)a);
#elif defined(__AVX__) && MMP_LANES == 8
  if constexpr (std::is_same_v<V, Floats>) return (V)_mm256_sqrt_ps((__m256)a);
  else return (V)_mm256_sqrt_pd((__m256d)a);
#else
  for (int i = 0; i < width<V>; ++i) a[i] = std::sqrt(a[i]);
  return a;
#endif
}

// One bit per lane, set where the mask is.
template <class V>
MMP_INLINE unsigned bits(Mask<V> m) {
#if defined(__AVX512DQ__) && MMP_LANES == 16
  if constexpr (std::is_same_v<V, Floats>) return _mm512_movepi32_mask((__m512i)m);
  else return _mm512_movepi64_mask((__m512i)m);
#elif defined(__AVX__) && MMP_LANES == 8
  if constexpr (std::is_same_v<V, Floats>) return static_cast<unsigned>(_mm256_movemask_ps((__m256)m));
  else return static_cast<unsigned>(_mm256_movemask_pd((__m256d)m));
#elif defined(__SSE2__) && MMP_LANES == 8
  __m128i half[2];
  std::memcpy(half, &m, sizeof m);
  if constexpr (std::is_same_v<V, Floats>)
    return static_cast<unsigned>(_mm_movemask_ps((__m128)half[0]) | _mm_movemask_ps((__m128)half[1]) << 4);
  else return static_cast<unsigned>(_mm_movemask_pd((__m128d)half[0]) | _mm_movemask_pd((__m128d)half[1]) << 2);
#else
  unsigned out = 0;
  for (int i = 0; i < width<V>; ++i) out |= (m[i] != 0 ? 1u : 0u) << i;
  return out;
#endif
}
template <class V>
inline constexpr unsigned all_bits = width<V> == 32 ? ~0u : (1u << width<V>)-1u;

template <class V>
MMP_INLINE Scalar<V> least(V a) {
  Scalar<V> m = a[0];
  for (int i = 1; i < width<V>; ++i) m = a[i] < m ? a[i] : m;
  return m;
}
template <class V>
MMP_INLINE Scalar<V> largest(V a) {
  Scalar<V> m = a[0];
  for (int i = 1; i < width<V>; ++i) m = a[i] > m ? a[i] : m;
  return m;
}

// Sine and cosine for |x| < 1e4. Reduction by multiples of pi/2 in three parts (Cody and Waite), then the minimax
// polynomials of Cephes (float, abs. error 1e-7) and fdlibm (double, 1e-16).
template <class V>
MMP_INLINE void sincos(V x, V& s, V& c) {
  using T = Scalar<V>;
  constexpr bool single = std::is_same_v<T, float>;
  const V magic =
      splat<V>(single ? T(12582912.0) : T(6755399441055744.0));  // 1.5 * 2^(mantissa bits): rounds to nearest
  const V shifted = x * T(0.63661977236758134308) + magic;
  const V k = shifted - magic;
  Mask<V> quadrant;
  std::memcpy(&quadrant, &shifted, sizeof quadrant);  // the low bits of the shifted number are those of k
  V r, ps, pc;
  if constexpr (single) {
    r = ((x - k * 1.5703125f) - k * 4.837512969970703125e-4f) - k * 7.549789948768648e-8f;
    const V z = r * r;
    ps = r + r * z * ((-1.9515295891e-4f * z + 8.3321608736e-3f) * z - 1.6666654611e-1f);
    pc = (1.0f - 0.5f * z) + z * z * ((2.443315711809948e-5f * z - 1.388731625493765e-3f) * z + 4.166664568298827e-2f);
  } else {
    r = ((x - k * 1.57079632673412561417) - k * 6.07710050630396597660e-11) - k * 2.02226624879595063154e-21;
    const V z = r * r;
    ps = r + r * z *
                 (-1.66666666666666324348e-01 +
                  z * (8.33333333332248946124e-03 +
                       z * (-1.98412698298579493134e-04 +
                            z * (2.75573137070700676789e-06 +
                                 z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    pc = (1.0 - 0.5 * z) + z * z *
                               (4.16666666666666019037e-02 +
                                z * (-1.38888888888741095749e-03 +
                                     z * (2.48015872894767294178e-05 +
                                          z * (-2.75573143513906633035e-07 +
                                               z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  }
  const Mask<V> odd = (quadrant & 1) != 0;
  const Mask<V> flip_s = (quadrant & 2) != 0;
  const Mask<V> flip_c = ((quadrant + 1) & 2) != 0;
  const V s0 = select<V>(odd, pc, ps), c0 = select<V>(odd, ps, pc);
  s = select<V>(flip_s, -s0, s0);
  c = select<V>(flip_c, -c0, c0);
}

// Copied by whole lanes. Compilers tuned for generic processors move structs in halves, and then the next load stalls:
// a state of eight arms cost 40 % more.
template <class V>
struct Vec3 {
  V x, y, z;
  Vec3() = default;
  MMP_INLINE Vec3(V a, V b, V c) : x(a), y(b), z(c) {}
  MMP_INLINE Vec3(const Vec3& o) : x(o.x), y(o.y), z(o.z) {}
  MMP_INLINE Vec3& operator=(const Vec3& o) {
    x = o.x;
    y = o.y;
    z = o.z;
    return *this;
  }
};
template <class V>
MMP_INLINE Vec3<V> operator-(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
MMP_INLINE Vec3<V> operator+(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
MMP_INLINE Vec3<V> operator*(const Vec3<V>& a, V s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class V>
MMP_INLINE V dot(const Vec3<V>& a, const Vec3<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class V>
MMP_INLINE Vec3<V> cross(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
MMP_INLINE V norm(const Vec3<V>& a) {
  return sqrt<V>(dot(a, a));
}

}  // namespace mmp
