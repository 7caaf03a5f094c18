/* Elementary functions of IEEE basic operations, as edge/elementary.py has them: the same bits on
   every machine, without a mathematical library. */
#include "internal.h"

#define PER_HALF_TURN 0.3183098861837907
#define HALF_TURN 3.1416015625
#define HALF_TURN_REST (-8.908910206761537e-6)
#define LN2 0.6931471805599453
#define LN2_HIGH 0.6931471803691238
#define LN2_LOW 1.9082149292705877e-10
#define SQRT_HALF 0.7071067811865476
#define TWO_52 4503599627370496.0
#define ROUNDING 6755399441055744.0

typedef union {
  double value;
  uint64_t bits;
} number;

/* 2^power, from -1022 to 1023. */
double ec_exp2(int power) {
  number x;
  x.bits = (uint64_t)(power + 1023) << 52;
  return x.value;
}

double ec_frexp(double x, int *power) {
  number y;
  y.value = x;
  *power = -1022;
  if (y.bits >> 52 == 0) { /* subnormal */
    y.value = x * TWO_52;
    *power -= 52;
  }
  *power += (int)(y.bits >> 52);
  y.bits = (y.bits & 0xFFFFFFFFFFFFFu) | (uint64_t)1022 << 52;
  return y.value;
}

double ec_rint(double x) {
  double whole = x < 0.0 ? (x - TWO_52) + TWO_52 : (x + TWO_52) - TWO_52;
  if (!(x > -TWO_52 && x < TWO_52)) return x;
  return whole == 0.0 ? x * 0.0 : whole;
}

double ec_sin(double x) {
  double turns = (x * PER_HALF_TURN + ROUNDING) - ROUNDING;
  double rest = (x - turns * HALF_TURN) - turns * HALF_TURN_REST;
  double square = rest * rest;
  double series = 1.0;
  for (int n = 22; n > 0; n -= 2) series = 1.0 - series * square / (n * (n + 1));
  double odd = turns - 2.0 * ((0.5 * turns + ROUNDING) - ROUNDING);
  return rest * series * (1.0 - 2.0 * odd * odd);
}

double ec_cos(double x) {
  double half = ec_sin(0.5 * x);
  return 1.0 - 2.0 * half * half;
}

/* Bit by bit, as in fdlibm's e_sqrt.c, rounded to the nearest. */
double ec_sqrt(double x) {
  if (!(x > 0.0) || x > 1.7976931348623157e308) return x < 0.0 ? (x - x) / (x - x) : x;
  int power;
  number y;
  y.value = ec_frexp(x, &power);
  uint64_t rest = (y.bits & 0xFFFFFFFFFFFFFu) | (uint64_t)1 << 52; /* 53 bits */
  power -= 1;
  if (power & 1) {
    rest <<= 1;
    power -= 1;
  }
  uint64_t root = 0;
  uint64_t twice = 0;
  for (uint64_t bit = (uint64_t)1 << 53; bit > 0; bit >>= 1) {
    rest <<= 1;
    if (twice + bit <= rest) {
      rest -= twice + bit;
      twice += 2 * bit;
      root += bit;
    }
  }
  root = (root >> 1) + (rest != 0 ? root & 1 : 0);
  return (double)root / TWO_52 * ec_exp2(power / 2);
}

double ec_log(double x) {
  int power;
  double fraction = ec_frexp(x, &power);
  if (fraction < SQRT_HALF) {
    fraction *= 2.0;
    power -= 1;
  }
  double f = fraction - 1.0;
  double s = f / (2.0 + f);
  double square = s * s;
  double series = 0.0;
  for (int n = 23; n > 0; n -= 2) series = series * square + 2.0 / n;
  return power * LN2_HIGH + (power * LN2_LOW + s * series);
}

double ec_logistic(double x) {
  double size = x < 0.0 ? -x : x;
  if (!(size < 700.0)) size = 700.0;
  int power = (int)(size / LN2);
  double rest = (size - power * LN2_HIGH) - power * LN2_LOW;
  if (rest < 0.0) rest = 0.0;
  double series = 1.0;
  for (int n = 16; n > 0; n--) series = 1.0 + rest * series / n;
  double odds = (series < 2.0 ? series : 2.0) * ec_exp2(power);
  return 1.0 / (1.0 + (x > 0.0 ? 1.0 / odds : odds));
}
