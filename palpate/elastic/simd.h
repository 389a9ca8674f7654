#pragma once

#include <Eigen/Core>
#include <cmath>

namespace palpate {

/// Eight numbers side by side, of eight elements: what is written once for a number runs on the processor's vector
/// instructions.
struct alignas(64) Simd {
  static constexpr int kCount = 8;
  using Vector = double __attribute__((vector_size(kCount * sizeof(double))));

  Vector v;

  Simd() = default;
  Simd(double number) : v(number - Vector{}) {}
  explicit Simd(Vector vector) : v(vector) {}

  double operator[](int lane) const { return v[lane]; }
  void set(int lane, double number) { v[lane] = number; }

  Simd& operator+=(const Simd& b) { return v += b.v, *this; }
  Simd& operator-=(const Simd& b) { return v -= b.v, *this; }
  Simd& operator*=(const Simd& b) { return v *= b.v, *this; }
  Simd& operator/=(const Simd& b) { return v /= b.v, *this; }
  friend Simd operator+(const Simd& a, const Simd& b) { return Simd(a.v + b.v); }
  friend Simd operator-(const Simd& a, const Simd& b) { return Simd(a.v - b.v); }
  friend Simd operator*(const Simd& a, const Simd& b) { return Simd(a.v * b.v); }
  friend Simd operator/(const Simd& a, const Simd& b) { return Simd(a.v / b.v); }
  friend Simd operator-(const Simd& a) { return Simd(-a.v); }
};

/// f of each number.
template <class Function>
double each(double number, Function f) {
  return f(number);
}
template <class Function>
Simd each(const Simd& numbers, Function f) {
  Simd result;
  for (int lane = 0; lane < Simd::kCount; ++lane) result.set(lane, f(numbers[lane]));
  return result;
}

}  // namespace palpate

namespace Eigen {

template <>
struct NumTraits<palpate::Simd> : GenericNumTraits<palpate::Simd> {
  using Real = palpate::Simd;
  using NonInteger = palpate::Simd;
  using Nested = palpate::Simd;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};

/// So that matrices of lanes and plain numbers mix.
template <class Operation>
struct ScalarBinaryOpTraits<palpate::Simd, double, Operation> {
  using ReturnType = palpate::Simd;
};
template <class Operation>
struct ScalarBinaryOpTraits<double, palpate::Simd, Operation> {
  using ReturnType = palpate::Simd;
};

}  // namespace Eigen
