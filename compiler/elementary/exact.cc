#include "compiler/elementary/exact.h"

#include <limits>

namespace morphbus::elementary {
namespace {

/// MPFR keeps numbers such as pi for each thread, until told that the thread ends.
struct ConstantsOfThread {
  ~ConstantsOfThread() { mpfr_free_cache2(MPFR_FREE_LOCAL_CACHE); }
};

/// While it lives, MPFR's exponents are those of doubles, so that it sees overflow and subnormal
/// results.
class ExponentsOfDouble {
 public:
  ExponentsOfDouble() : least_(mpfr_get_emin()), most_(mpfr_get_emax()) {
    // MPFR's mantissas are in [1/2, 1): the smallest double is 1/2 * 2^-1073.
    mpfr_set_emin(-1073);
    mpfr_set_emax(1024);
  }
  ~ExponentsOfDouble() {
    mpfr_set_emin(least_);
    mpfr_set_emax(most_);
  }
  ExponentsOfDouble(const ExponentsOfDouble&) = delete;
  ExponentsOfDouble& operator=(const ExponentsOfDouble&) = delete;

 private:
  mpfr_exp_t least_, most_;
};

/// A number of MPFR's with the precision of doubles, on the stack.
class Number {
 public:
  explicit Number(double x = 0) {
    mpfr_custom_init(limbs_, std::numeric_limits<double>::digits);
    mpfr_custom_init_set(value_, MPFR_NAN_KIND, 0, std::numeric_limits<double>::digits, limbs_);
    mpfr_set_d(value_, x, MPFR_RNDN);
  }
  Number(const Number&) = delete;
  Number& operator=(const Number&) = delete;
  mpfr_ptr get() { return value_; }

  /// As a double, where `ternary` says on which side of the true result it was rounded.
  double Rounded(int ternary) {
    mpfr_subnormalize(value_, ternary, MPFR_RNDN);
    if (mpfr_nan_p(value_) != 0) return std::numeric_limits<double>::quiet_NaN();
    return mpfr_get_d(value_, MPFR_RNDN);
  }

 private:
  static_assert(mpfr_custom_get_size(std::numeric_limits<double>::digits) <= 2 * sizeof(mp_limb_t));
  mp_limb_t limbs_[2];  // one where limbs have 64 bits
  mpfr_t value_;
};

}  // namespace

double Exactly(int (*function)(mpfr_t, const mpfr_t, mpfr_rnd_t), double x) {
  static thread_local ConstantsOfThread constants;
  const ExponentsOfDouble exponents;
  Number in(x), out;
  return out.Rounded(function(out.get(), in.get(), MPFR_RNDN));
}

double Exactly(int (*function)(mpfr_t, const mpfr_t, const mpfr_t, mpfr_rnd_t), double x,
               double y) {
  static thread_local ConstantsOfThread constants;
  const ExponentsOfDouble exponents;
  Number in_x(x), in_y(y), out;
  return out.Rounded(function(out.get(), in_x.get(), in_y.get(), MPFR_RNDN));
}

}  // namespace morphbus::elementary
