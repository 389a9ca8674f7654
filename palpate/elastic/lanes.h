#pragma once

#include <Eigen/Core>
#include <cmath>

namespace palpate {

/// Eight numbers side by side, of eight elements: what is written once for a number runs on the processor's vector
/// instructions.
struct alignas(64) Lanes {
  static constexpr int kCount = 8;
  using Vector = double __attribute__((vector_size(kCount * sizeof(double))));

  Vector v;

  Lanes() = default;
  Lanes(double number) : v(number - Vector{}) {}
  explicit Lanes(Vector vector) : v(vector) {}

  double operator[](int lane) const { return v[lane]; }
  void set(int lane, double number) { v[lane] = number; }

  Lanes& operator+=(const Lanes& b) { return v += b.v, *this; }
  Lanes& operator-=(const Lanes& b) { return v -= b.v, *this; }
  Lanes& operator*=(const Lanes& b) { return v *= b.v, *this; }
  Lanes& operator/=(const Lanes& b) { return v /= b.v, *this; }
  friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(a.v + b.v); }
  friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(a.v - b.v); }
  friend Lanes operator*(const Lanes& a, const Lanes& b) { return Lanes(a.v * b.v); }
  friend Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(a.v / b.v); }
  friend Lanes operator-(const Lanes& a) { return Lanes(-a.v); }
};

/// f of each number.
template <class Function>
double each(double number, Function f) {
  return f(number);
}
template <class Function>
Lanes each(const Lanes& numbers, Function f) {
  Lanes result;
  for (int lane = 0; lane < Lanes::kCount; ++lane) result.set(lane, f(numbers[lane]));
  return result;
}

}  // namespace palpate

namespace Eigen {

template <>
struct NumTraits<palpate::Lanes> : GenericNumTraits<palpate::Lanes> {
  using Real = palpate::Lanes;
  using NonInteger = palpate::Lanes;
  using Nested = palpate::Lanes;
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
struct ScalarBinaryOpTraits<palpate::Lanes, double, Operation> {
  using ReturnType = palpate::Lanes;
};
template <class Operation>
struct ScalarBinaryOpTraits<double, palpate::Lanes, Operation> {
  using ReturnType = palpate::Lanes;
};

}  // namespace Eigen
