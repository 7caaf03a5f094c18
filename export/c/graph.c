/* The exported graph, as edge/model/graph.py computes it, for one vector, in slices. All that
   decides is made of whole numbers below 2^53, so that the order of sums changes no bit. */
#include "internal.h"

double ec_arena[EC_ARENA];

static struct {
  uint32_t point;
  uint32_t step;
  uint32_t begin; /* of the step's parts, which the next slice computes */
  uint32_t end;
} now;

/* What a slice does about, in numbers of a matrix; other operators take as long for SHARE of them. */
#define SLICE 2048
#define SHARE 16

/* Sizes of a step that goes along an axis: before it, along it and behind it, and how many numbers
   it makes of those along it. */
enum { BEFORE, ALONG, BEHIND, COUNT };

/* A number of the arena or of a table. */
static double at(uint32_t place, uint32_t i) {
  if (place < EC_ARENA) return ec_arena[place + i];
  const ec_table *table = &ec_tables[place - EC_ARENA];
  i += now.point * table->stride;
  switch (table->type) {
    case EC_INT8: return ((const int8_t *)table->data)[i];
    case EC_INT16: return ((const int16_t *)table->data)[i];
    case EC_INT32: return ((const int32_t *)table->data)[i];
    case EC_FLOAT32: return (double)((const float *)table->data)[i];
    case EC_PALETTE: return table->palette[((const uint8_t *)table->data)[i]];
    default: return ((const double *)table->data)[i];
  }
}

/* The sizes are others here: of the output, and of the inputs, each as many or 1. */
static void element_wise(const ec_step *step) {
  const uint16_t *inputs = step->inputs;
  double *out = ec_arena + step->outputs[0];
  for (uint32_t i = now.begin; i < now.end; i++) {
    double x = at(inputs[0], step->sizes[1] > 1 ? i : 0);
    double y = step->sizes[2] ? at(inputs[1], step->sizes[2] > 1 ? i : 0) : 0.0;
    double z = step->sizes[3] ? at(inputs[2], step->sizes[3] > 1 ? i : 0) : 0.0;
    switch (step->operator) {
      case EC_ADD: out[i] = x + y; break;
      case EC_SUB: out[i] = x - y; break;
      case EC_MUL: out[i] = x * y; break;
      case EC_DIV: out[i] = x / y; break;
      case EC_MAX: out[i] = x > y || x != x ? x : y; break;
      case EC_LESSOREQUAL: out[i] = x <= y ? 1.0 : 0.0; break;
      case EC_WHERE: out[i] = x != 0.0 ? y : z; break;
      case EC_CLIP: out[i] = x < y ? y : x > z ? z : x; break;
      case EC_ROUND: out[i] = ec_rint(x); break;
      case EC_SQUEEZE: out[i] = x; break;
      default: out[i] = ec_sqrt(x);
    }
  }
}

/* The sums of a packed matrix's columns, row by row. */
static struct {
  const uint8_t *row;
  bool is_whole; /* all factors are whole numbers of 32 bits */
  int64_t sums[EC_AT_LEAST_1(EC_MOST_COLUMNS)];
  int64_t squares;
  double excess;
} product;

static void begin_product(const ec_table *matrix) {
  product.row = (const uint8_t *)matrix->data + now.point * matrix->stride;
  product.is_whole = true;
  product.squares = 0;
  product.excess = 0.0;
  for (uint32_t j = 0; j < matrix->columns; j++) product.sums[j] = 0;
}

/* A number of at most 25 bits that begins at a bit. */
static int32_t unpacked(const uint8_t *row, uint32_t bit, uint32_t bits) {
  const uint8_t *p = row + bit / 8;
  uint32_t word = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
  uint32_t mask = ((uint32_t)1 << bits) - 1;
  return (int32_t)(word >> bit % 8 & mask) - ((int32_t)1 << (bits - 1));
}

/* Add the products of a factor and the next row; a row of 0 bits is one of zeros. */
static void multiply(int32_t factor, uint32_t columns) {
  uint32_t bits = *product.row++;
  if (factor != 0) {
    for (uint32_t j = 0; bits && j < columns; j++) {
      product.sums[j] += (int64_t)factor * unpacked(product.row, j * bits, bits);
    }
  }
  product.row += (columns * bits + 7) / 8;
}

/* The same of a factor that is no such number. */
static void multiply_real(double factor, const ec_table *matrix, double *out) {
  uint32_t bits = *product.row++;
  double unit = ec_exp2(-matrix->shift);
  for (uint32_t j = 0; bits && j < matrix->columns; j++) {
    out[j] += factor * (unit * unpacked(product.row, j * bits, bits));
  }
  product.row += (matrix->columns * bits + 7) / 8;
}

static bool are_whole(uint32_t x, uint32_t n) {
  for (uint32_t i = 0; i < n; i++) {
    double factor = at(x, i);
    if (!(factor > -2147483648.0 && factor < 2147483648.0)) return false;
    if ((int32_t)factor != factor) return false;
  }
  return true;
}

static void end_product(const ec_table *matrix, const ec_step *step) {
  double *out = ec_arena + step->outputs[0];
  double unit = ec_exp2(-matrix->shift);
  for (uint32_t j = 0; product.is_whole && j < step->sizes[COUNT]; j++) {
    out[j] = j < matrix->columns ? (double)product.sums[j] * unit : 0.0;
  }
}

/* x (n) times a packed matrix (n, m), plus m numbers of a Gemm. */
static void packed_product(const ec_step *step) {
  const ec_table *matrix = &ec_tables[step->inputs[1] - EC_ARENA];
  uint32_t n = step->sizes[ALONG];
  double *out = ec_arena + step->outputs[0];
  if (now.begin == 0) {
    begin_product(matrix);
    product.is_whole = are_whole(step->inputs[0], n);
    for (uint32_t j = 0; j < step->sizes[COUNT]; j++) out[j] = 0.0;
  }
  for (uint32_t i = now.begin; i < now.end; i++) {
    double x = at(step->inputs[0], i);
    if (product.is_whole) {
      multiply((int32_t)x, matrix->columns);
    } else {
      multiply_real(x, matrix, out);
    }
  }
  if (now.end < n) return;
  end_product(matrix, step);
  for (uint32_t j = 0; step->operator == EC_GEMM && j < step->sizes[COUNT]; j++) {
    out[j] += at(step->inputs[2], j);
  }
}

/* Features, less their means and times their gains, rounded and cut off, times a packed matrix; how
   much was cut off; and the sum of their squares. */
enum { MEANS, GAINS, LIMIT, MATRIX, COLUMNS };

static void project(const ec_step *step) {
  const uint16_t *inputs = step->inputs;
  const ec_table *matrix = &ec_tables[inputs[MATRIX] - EC_ARENA];
  double limit = at(inputs[LIMIT], 0);
  if (now.begin == 0) begin_product(matrix);
  for (uint32_t i = now.begin; i < now.end; i++) {
    uint32_t feature = inputs[COLUMNS] == EC_NOWHERE ? i : (uint32_t)at(inputs[COLUMNS], i);
    double x = (ec_arena[feature] - at(inputs[MEANS], feature)) * at(inputs[GAINS], i);
    double rounded = ec_rint(x);
    double inside = rounded < -limit ? -limit : rounded > limit ? limit : rounded;
    double excess = rounded - inside;
    product.excess += excess < 0.0 ? -excess : excess;
    int32_t factor = inside == inside ? (int32_t)inside : 0;
    product.squares += (int64_t)factor * factor;
    multiply(factor, matrix->columns);
  }
  if (now.end < step->sizes[ALONG]) return;
  end_product(matrix, step);
  if (step->outputs[1] != EC_NOWHERE) ec_arena[step->outputs[1]] = product.excess;
  if (step->outputs[2] != EC_NOWHERE) ec_arena[step->outputs[2]] = (double)product.squares;
}

/* 0 where all numbers are finite. */
static void finite(const ec_step *step) {
  if (now.begin == 0) product.excess = 0.0;
  for (uint32_t i = now.begin; i < now.end; i++) {
    double zero = at(step->inputs[0], i) * 0.0;
    product.excess += zero;
  }
  ec_arena[step->outputs[0]] = product.excess;
}

/* x (n) times any matrix (n, m), plus m numbers of a Gemm. */
static void gemm(const ec_step *step) {
  uint32_t n = step->sizes[ALONG];
  uint32_t m = step->sizes[COUNT];
  for (uint32_t j = now.begin; j < now.end; j++) {
    double sum = 0.0;
    for (uint32_t i = 0; i < n; i++) {
      sum += at(step->inputs[0], i) * at(step->inputs[1], i * m + j);
    }
    if (step->operator == EC_GEMM) sum += at(step->inputs[2], j);
    ec_arena[step->outputs[0] + j] = sum;
  }
}

static void reduce(const ec_step *step) {
  uint32_t x = step->inputs[0];
  double *out = ec_arena + step->outputs[0];
  uint32_t along = step->sizes[ALONG];
  uint32_t behind = step->sizes[BEHIND];
  for (uint32_t i = now.begin; i < now.end; i++) {
    double sum = 0.0;
    for (uint32_t j = 0; j < along; j++) {
      double value = at(x, (i / behind * along + j) * behind + i % behind);
      if (step->operator == EC_REDUCEL1 && value < 0.0) value = -value;
      if (step->operator == EC_REDUCESUMSQUARE) value *= value;
      sum += value;
    }
    out[i] = step->operator == EC_REDUCEMEAN ? sum / along : sum;
  }
}

/* The k smallest of each row, in order, and their places; of equal ones the first comes first. */
static void top_k(const ec_step *step) {
  uint32_t x = step->inputs[0];
  uint32_t k = step->sizes[COUNT];
  for (uint32_t row = now.begin; row < now.end; row++) {
    double *values = ec_arena + step->outputs[0] + row * k;
    double *places = ec_arena + step->outputs[1] + row * k;
    uint32_t count = 0;
    for (uint32_t i = 0; i < step->sizes[ALONG]; i++) {
      double value = at(x, row * step->sizes[ALONG] + i);
      if (count == k && !(value < values[k - 1])) continue;
      uint32_t place = count < k ? count++ : k - 1;
      for (; place > 0 && value < values[place - 1]; place--) {
        values[place] = values[place - 1];
        places[place] = places[place - 1];
      }
      values[place] = value;
      places[place] = i;
    }
  }
}

/* Indices below 0 count from the end. */
static void gather(const ec_step *step) {
  uint32_t x = step->inputs[0];
  double *out = ec_arena + step->outputs[0];
  uint32_t along = step->sizes[ALONG];
  uint32_t behind = step->sizes[BEHIND];
  for (uint32_t i = 0; i < step->sizes[BEFORE]; i++) {
    for (uint32_t j = 0; j < step->sizes[COUNT]; j++) {
      double index = at(step->inputs[1], j);
      uint32_t place = (uint32_t)(index < 0.0 ? index + along : index);
      for (uint32_t l = 0; l < behind; l++) *out++ = at(x, (i * along + place) * behind + l);
    }
  }
}

static void pad(const ec_step *step) {
  uint32_t x = step->inputs[0];
  double *out = ec_arena + step->outputs[0];
  for (uint32_t i = 0; i < step->sizes[ALONG]; i++) out[i] = at(x, i);
  out[step->sizes[ALONG]] = at(step->inputs[2], 0);
}

static void arg_max(const ec_step *step) {
  uint32_t x = step->inputs[0];
  uint32_t best = 0;
  for (uint32_t i = 1; i < step->sizes[ALONG]; i++) {
    if (at(x, i) > at(x, best)) best = i;
  }
  ec_arena[step->outputs[0]] = best;
}

static bool is_packed(const ec_step *step) {
  return step->inputs[1] >= EC_ARENA && ec_tables[step->inputs[1] - EC_ARENA].type == EC_PACKED;
}

/* How many parts a step has, and how many of them a slice takes. */
static uint32_t parts(const ec_step *step, uint32_t *at_once) {
  const uint16_t *sizes = step->sizes;
  uint32_t matrix = step->inputs[step->operator == EC_PROJECT ? MATRIX : 1];
  uint32_t along = sizes[ALONG];
  uint32_t columns = matrix >= EC_ARENA ? ec_tables[matrix - EC_ARENA].columns : 0;
  *at_once = SLICE / SHARE;
  switch (step->operator) {
    case EC_GEMM:
    case EC_MATMUL:
      *at_once = 1 + SLICE / (is_packed(step) ? columns : SHARE * along);
      return is_packed(step) ? along : sizes[COUNT];
    case EC_PROJECT: *at_once = 1 + SLICE / (SHARE + columns); return along;
    case EC_FINITE: return along;
    case EC_REDUCEL1:
    case EC_REDUCESUM:
    case EC_REDUCESUMSQUARE:
    case EC_REDUCEMEAN:
      *at_once = 1 + *at_once / along;
      return (uint32_t)sizes[BEFORE] * sizes[BEHIND];
    case EC_TOPK: *at_once = 1 + *at_once / along; return sizes[BEFORE];
    case EC_GATHER:
    case EC_GATHERELEMENTS:
    case EC_GATHERND:
    case EC_PAD:
    case EC_ARGMAX: return 1;
    default: return sizes[0];
  }
}

static void compute(const ec_step *step) {
  switch (step->operator) {
    case EC_GEMM:
    case EC_MATMUL:
      if (is_packed(step)) {
        packed_product(step);
      } else {
        gemm(step);
      }
      break;
    case EC_PROJECT: project(step); break;
    case EC_FINITE: finite(step); break;
    case EC_REDUCEL1:
    case EC_REDUCESUM:
    case EC_REDUCESUMSQUARE:
    case EC_REDUCEMEAN: reduce(step); break;
    case EC_TOPK: top_k(step); break;
    case EC_GATHER:
    case EC_GATHERELEMENTS:
    case EC_GATHERND: gather(step); break;
    case EC_PAD: pad(step); break;
    case EC_ARGMAX: arg_max(step); break;
    default: element_wise(step);
  }
}

/* Before the first slice. */
void ec_graph_begin(void) {
  now.step = 0;
  now.begin = 0;
}

/* Compute a part of the graph, of the features at the arena's beginning; whether it was the last. */
bool ec_graph_slice(uint32_t point) {
  const ec_step *step = &ec_steps[now.step];
  uint32_t at_once;
  uint32_t count = parts(step, &at_once);
  now.point = point;
  now.end = count - now.begin < at_once ? count : now.begin + at_once;
  compute(step);
  now.begin = now.end;
  if (now.begin < count) return false;
  now.begin = 0;
  now.step++;
  return now.step == EC_STEPS;
}
