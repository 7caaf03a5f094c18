/* From features to labels, distances and doubts: the formula that export/graph.py writes as a graph,
   in slices. All that decides is made of whole numbers below 2^53, so that the order of sums changes
   no bit. */
#include "internal.h"

/* What a slice does about, in products; what a feature and a trial take beside these. */
#define SLICE 1536
#define SHARE 16

#define COMPONENTS EC_AT_LEAST_1(EC_MOST_COMPONENTS)

double ec_vector[EC_AT_LEAST_1(EC_MOST_WIDTH)];
ec_answer ec_answers[EC_AT_LEAST_1(EC_MOST_TASKS)];
ec_scores ec_scores_now;

typedef struct {
  int32_t coordinates[COMPONENTS];
  double excess; /* over its limits; not finite where a feature is not */
} coordinates_of_space;

static coordinates_of_space spaces[EC_AT_LEAST_1(EC_MOST_SPACES)];
static uint64_t sums[COMPONENTS];
static uint64_t squares; /* of steps */
static double excess;
static double nearest_squares; /* to a row of doubt, times its nearness */
static double nearest_weighted;
static int32_t whitened[COMPONENTS];
static double nearest[EC_MOST_NEAREST + 1]; /* to each label, one label after another */
static double near_squares[EC_MOST_NEIGHBOURS + 1];

/* A part is a space, the doubts' projection, their rows, or a task. */
static struct {
  uint32_t point;
  uint32_t part;
  uint32_t begin; /* of the part's features or trials, which the next slice takes */
  uint32_t end;
  const uint8_t *row; /* of a matrix, the next */
} now;

static double at(const ec_series *series, uint32_t i) {
  if (series->type == EC_FLOATS) return (double)ec_model_now.floats[series->place + i];
  if (series->type == EC_DOUBLES) return ec_model_now.doubles[series->place + i];
  return ec_model_now.doubles[series->palette + ec_model_now.bytes[series->place + i]];
}

/* A number of at most 25 bits that begins at a bit. */
static inline int32_t unpacked(const uint8_t *row, uint32_t bit, uint32_t bits) {
  const uint8_t *p = row + bit / 8;
  uint32_t word = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
  word = word >> bit % 8 & (((uint32_t)1 << bits) - 1);
  return (int32_t)(word - ((uint32_t)1 << (bits - 1)));
}

static const uint8_t *behind(const uint8_t *row, uint32_t columns) {
  return row + 1 + (columns * *row + 7) / 8;
}

/* Add the products of a factor and the next row; a row of 0 bits is one of zeros. */
static void multiply(int32_t factor, uint32_t columns) {
  uint32_t bits = *now.row;
  const uint8_t *row = now.row + 1;
  uint32_t size = factor ? columns * bits : 0;
  uint64_t *sum = sums;
  for (uint32_t bit = 0; bit < size; bit += bits, sum++) {
    *sum += (uint64_t)((int64_t)factor * unpacked(row, bit, bits));
  }
  now.row = behind(now.row, columns);
}

static void begin_product(uint32_t matrix) {
  now.row = ec_model_now.bytes + matrix;
  for (uint32_t i = 0; i < COMPONENTS; i++) sums[i] = 0;
}

static double product(uint32_t i, double factor) {
  return ec_rint((double)(int64_t)sums[i] * factor);
}

static double inside(double x, double limit) { return x < -limit ? -limit : x > limit ? limit : x; }

/* A coordinate of a vector that is refused may be anything. */
static int32_t whole(double x) { return x > -2147483648.0 && x < 2147483648.0 ? (int32_t)x : 0; }

/* How many parts of what is left a slice takes, which has so many products. */
static bool take(uint32_t count, uint32_t products) {
  uint32_t at_once = 1 + SLICE / (SHARE + products);
  now.end = count - now.begin < at_once ? count : now.begin + at_once;
  return now.end == count;
}

/* The sums of the steps' products; whether they are all. */
static bool projected(const ec_projection *p) {
  bool is_last = take(p->count, p->components);
  if (now.begin == 0) {
    begin_product(p->matrix);
    squares = 0;
    excess = 0.0;
  }
  for (uint32_t i = now.begin; i < now.end; i++) {
    uint32_t feature = p->columns == EC_NOWHERE ? i : ec_model_now.words[p->columns + i];
    double rounded = ec_rint((ec_vector[feature] - at(&p->means, feature)) * at(&p->gains, i));
    double step = inside(rounded, p->most_steps);
    if (step != rounded) excess += rounded < step ? step - rounded : rounded - step;
    int32_t factor = whole(step);
    squares += (uint64_t)((int64_t)factor * factor);
    multiply(factor, p->components);
  }
  return is_last;
}

static bool space(const ec_projection *p, coordinates_of_space *to) {
  if (!projected(p)) return false;
  for (uint32_t i = 0; i < p->components; i++) {
    double rounded = product(i, p->factor);
    double coordinate = inside(rounded, p->limit);
    excess += rounded < coordinate ? coordinate - rounded : rounded - coordinate;
    to->coordinates[i] = whole(coordinate);
  }
  for (uint32_t i = p->components; i < COMPONENTS; i++) to->coordinates[i] = 0;
  for (uint32_t i = 0; i < EC_WIDTH; i++) excess += ec_vector[i] * 0.0;
  to->excess = excess;
  return true;
}

/* The whitened coordinates, and how far the features lie outside the components. */
static bool doubt(const ec_doubt *d) {
  const ec_projection *p = &d->projection;
  if (!projected(p)) return false;
  int32_t z[COMPONENTS];
  for (uint32_t i = 0; i < p->components; i++) {
    z[i] = whole(product(i, p->factor));
    squares -= (uint64_t)((int64_t)z[i] * z[i]);
  }
  double outside = (double)(int64_t)squares;
  ec_scores_now.outlier_score = ec_sqrt(outside > 1.0 ? outside : 1.0);
  begin_product(d->whitening);
  for (uint32_t i = 0; i < p->components; i++) multiply(z[i], p->components);
  for (uint32_t i = 0; i < p->components; i++) {
    whitened[i] = whole(inside(product(i, d->factor), d->limit));
  }
  nearest_squares = nearest_weighted = EC_INFINITY;
  return true;
}

/* The coordinates of all trials, by components. */
static struct {
  const uint8_t *numbers;
  uint32_t bits;
} rows[COMPONENTS];

static void open_rows(uint32_t matrix, uint32_t components) {
  const uint8_t *row = ec_model_now.bytes + matrix;
  for (uint32_t i = 0; i < components; i++, row = behind(row, EC_TRIALS)) {
    rows[i].numbers = row + 1;
    rows[i].bits = *row;
  }
}

/* The difference of a coordinate and that of a trial, squared. */
static inline int64_t squared(uint32_t component, uint32_t trial, int32_t coordinate) {
  uint32_t bits = rows[component].bits;
  if (bits) coordinate -= unpacked(rows[component].numbers, trial * bits, bits);
  return (int64_t)coordinate * coordinate;
}

/* The nearest trial, where distances are longer the nearer it has others. */
static bool doubt_of_trials(const ec_doubt *d) {
  uint32_t components = d->projection.components;
  const uint16_t *weights = ec_model_now.words + d->weights;
  bool is_last = take(EC_TRIALS, 2 * components);
  open_rows(d->rows, components);
  for (uint32_t trial = now.begin; trial < now.end; trial++) {
    int64_t sum = 0;
    int64_t before = 0; /* of those with another weight */
    int64_t weighted = 0;
    for (uint32_t i = 0; i < components; i++) {
      sum += squared(i, trial, whitened[i]);
      if (i + 1 < components && weights[i + 1] == weights[i]) continue;
      weighted += (sum - before) * weights[i];
      before = sum;
    }
    double far = (double)sum * at(&d->nearness, trial);
    double unit = ec_exp2(-EC_FRACTION_BITS);
    double farther = (double)weighted * unit * at(&d->weighted_nearness, trial);
    if (far < nearest_squares) nearest_squares = far;
    if (farther < nearest_weighted) nearest_weighted = farther;
  }
  if (!is_last) return false;
  ec_scores_now.outlier_score *= ec_sqrt(nearest_squares);
  ec_scores_now.known_distance = ec_sqrt(nearest_weighted);
  return true;
}

/* Put a value into a list of the smallest, in order; of equal ones the first comes first. Returns its
   place, or the size. */
static uint32_t insert(double *values, uint32_t size, double value) {
  uint32_t place = size;
  for (; place > 0 && value < values[place - 1]; place--) {
    if (place < size) values[place] = values[place - 1];
  }
  if (place < size) values[place] = value;
  return place;
}

static void meet(const ec_task *task, ec_answer *a, uint32_t trial, double square) {
  uint32_t label = ec_model_now.words[task->trials + trial];
  uint32_t place = insert(near_squares, task->k, square);
  for (uint32_t i = task->k; i-- > place + 1;) a->neighbours[i] = a->neighbours[i - 1];
  if (place < task->k) a->neighbours[place] = (uint16_t)trial;
  if (task->counts == EC_NOWHERE) return;
  const uint16_t *counts = ec_model_now.words + task->counts;
  double *those = nearest;
  for (uint32_t i = 0; i < label; i++) those += counts[i];
  insert(those, counts[label], square);
}

/* The label with the most votes, of tied ones that of the nearest trial. */
static void vote(const ec_task *task, ec_answer *a) {
  const uint16_t *labels = ec_model_now.words + task->trials;
  for (uint32_t i = 0; i < task->labels; i++) a->votes[i] = 0;
  for (uint32_t i = 0; i < task->k; i++) a->votes[labels[a->neighbours[i]]]++;
  a->label = (int16_t)labels[a->neighbours[0]];
  for (uint32_t i = 1; i < task->k; i++) {
    uint16_t label = labels[a->neighbours[i]];
    if (a->votes[label] > a->votes[a->label]) a->label = (int16_t)label;
  }
}

static void measure(const ec_task *task, const ec_place *place, ec_answer *a) {
  const double *those = nearest;
  for (uint32_t i = 0; i < task->k; i++) a->distances[i] = ec_sqrt(near_squares[i]) * place->unit;
  for (uint32_t i = 0; task->counts != EC_NOWHERE && i < task->labels; i++) {
    uint32_t count = ec_model_now.words[task->counts + i];
    double total = 0.0;
    for (uint32_t j = 0; j < count; j++) total += ec_rint(ec_sqrt(*those++));
    a->label_distances[i] = total / count * place->scale;
  }
}

static void answer(const ec_task *task, const ec_place *place, ec_answer *a) {
  vote(task, a);
  measure(task, place, a);
  if (spaces[task->space].excess <= DBL_MAX) return;
  a->label = -1;
  for (uint32_t i = 0; i < task->labels; i++) a->votes[i] = 0;
}

/* The trials, slice by slice, and then what follows from the nearest. */
static bool task_of_trials(const ec_task *task, const ec_place *place, ec_answer *a) {
  const int32_t *z = spaces[task->space].coordinates;
  if (now.begin == EC_TRIALS) {
    answer(task, place, a);
    return true;
  }
  take(EC_TRIALS, 2 * place->components);
  if (now.begin == 0) {
    for (uint32_t i = 0; i <= EC_MOST_NEAREST; i++) nearest[i] = EC_INFINITY;
    for (uint32_t i = 0; i < task->k; i++) near_squares[i] = EC_INFINITY;
  }
  open_rows(place->rows, place->components);
  for (uint32_t trial = now.begin; trial < now.end; trial++) {
    int64_t sum = 0;
    if (ec_model_now.words[task->trials + trial] == UINT16_MAX) continue;
    for (uint32_t i = 0; i < place->components; i++) sum += squared(i, trial, z[i]);
    meet(task, a, trial, (double)sum);
  }
  return false;
}

/* Before the first slice. */
void ec_formula_begin(void) {
  now.part = 0;
  now.begin = 0;
}

static bool compute(uint32_t point) {
  uint32_t part = now.part;
  const ec_doubt *d = &ec_model_now.doubts[point];
  if (part < EC_SPACES) {
    return space(&ec_model_now.projections[point * EC_SPACES + part], &spaces[part]);
  }
  part -= EC_SPACES;
  if (part == 0 && EC_HAS_OUTLIERS) return doubt(d);
  if (part == 1 && EC_HAS_OUTLIERS) return doubt_of_trials(d);
  part -= EC_HAS_OUTLIERS ? 2 : 0;
  const ec_place *place = &ec_model_now.places[point * EC_TASKS + part];
  return task_of_trials(&ec_tasks[part], place, &ec_answers[part]);
}

/* Compute a part of the answers, of the features in ec_vector; whether it was the last. */
bool ec_formula_slice(uint32_t point) {
  bool is_done = compute(point);
  now.begin = is_done ? 0 : now.end;
  now.part += is_done;
  if (now.part < EC_SPACES + (EC_HAS_OUTLIERS ? 2 : 0) + EC_TASKS) return false;
  ec_scores_now.out_of_range = false;
  for (uint32_t i = 0; i < EC_SPACES; i++) {
    if (!(spaces[i].excess <= 0.0)) ec_scores_now.out_of_range = true;
  }
  return true;
}
