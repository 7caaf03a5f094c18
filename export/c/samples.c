/* A contact's frames to values at sample times, as they come: edge/touch/contact.py,
   edge/features/vector.py, zones.py, kernels.py.

   Frames are not kept: between two frames in which a value is known, it is interpolated to the sample
   times that lie there. What follows a lift-off is written as if the contact were over, and written
   again where it goes on. */
#include "internal.h"

#define CLOCK_ROUNDING_S 1e-6
#define BITS 14

double ec_values[EC_MOST_POINTS][EC_AT_LEAST_1(EC_MOST_VALUES)];
uint16_t ec_channels[EC_MOST_POINTS][EC_AT_LEAST_1(EC_MOST_CHANNELS)][EC_SAMPLES_OF_KERNELS];

typedef struct {
  double t; /* below 0: never known */
  double value;
} known;

/* All that later values depend on, up to a frame. */
typedef struct {
  ec_row row;
  known last[EC_UNSURE_VALUES];
} state;

static state felt; /* up to the last frame in which the contact is felt */
static state lifted; /* up to a later one */
static bool is_lifted;

static double absolute(double x) { return x < 0.0 ? -x : x; }

/* Variances and the covariance are whole numbers over force squared, so nothing cancels. */
static void spread(const int64_t *zone, double values[5]) {
  int64_t f = zone[2];
  int64_t r = zone[3];
  int64_t c = zone[4];
  double total = f > 1 ? (double)f : 1.0;
  double rows = (double)(f * zone[5] - r * r) / total / total;
  double cols = (double)(f * zone[7] - c * c) / total / total;
  double slant = (double)(f * zone[6] - r * c) / total / total;
  double across = rows - cols;
  double larger = 0.5 * (rows + cols + ec_sqrt(across * across + 4.0 * slant * slant));
  double determinant = rows * cols - slant * slant;
  if (!(determinant > 0.0)) determinant = 0.0;
  values[0] = ec_sqrt(rows);
  values[1] = ec_sqrt(cols);
  values[2] = slant;
  values[3] = ec_sqrt(larger);
  values[4] = ec_sqrt(larger > 0.0 ? determinant / larger : 0.0);
}

static double spread_of(ec_row *row, uint32_t zone, uint32_t i) {
  if (!EC_MOST_SPREADS) return 0.0;
  if (!row->is_spread[zone]) spread(row->zones[zone], row->spreads[zone]);
  row->is_spread[zone] = true;
  return row->spreads[zone][i];
}

#define SPREAD(i) spread_of(row, series->zone, i)

/* A value that is known in every frame. */
static double sure_value(const ec_time_series *series, uint32_t index, ec_row *row) {
  const int64_t *zone = row->zones[series->zone];
  switch (series->quantity) {
    EC_SURE_VALUES
    default: return 0.0;
  }
}

/* The place among what may be unknown; EC_UNSURE_VALUES of other quantities. */
static uint32_t unsure_place(const ec_time_series *series) {
  switch (series->quantity) {
    case EC_Q_ZONE_ALONG: return 2u * series->zone;
    case EC_Q_ZONE_AROUND: return 2u * series->zone + 1;
    case EC_Q_STIFFNESS: return EC_OF_STIFFNESS;
    case EC_Q_CONTACT_MOTION: return EC_OF_MOTION;
    case EC_Q_FORCE_MOTION: return EC_OF_FORCE_MOTION;
    case EC_Q_JOINT_ANGLE: return EC_OF_JOINTS;
    default: return EC_UNSURE_VALUES;
  }
}

/* From 0 on, below a turn. */
static double on_circle(double col) {
  if (col >= EC_COLS) return col - EC_COLS;
  return col < 0.0 ? col + EC_COLS : col;
}

/* A contact that crosses the seam goes on; it does not jump to the other end. */
static double unwrapped(const ec_row *before, ec_row *row, uint32_t zone, double col) {
  if (!EC_WRAPS) return col;
  double now = on_circle(col);
  double step = now - before->column[zone];
  row->column[zone] = now;
  if (before->column[zone] != before->column[zone]) return now;
  double nearest = on_circle(step + 0.5 * EC_COLS) - 0.5 * EC_COLS;
  if (nearest == -0.5 * EC_COLS && step > 0.0) nearest = 0.5 * EC_COLS;
  row->turns[zone] += absolute(step) < 0.5 * EC_COLS ? 0.0 : nearest - step;
  return now + row->turns[zone];
}

/* What may be unknown in a frame. */
static void complete(const state *before, ec_row *row) {
  for (uint32_t i = 0; ec_zone_names[i] != EC_NO_ZONE; i++) {
    const int64_t *zone = row->zones[i];
    double force = (double)zone[2];
    bool is_there = zone[2] > 0 && EC_MOST_CENTROIDS;
    row->is_spread[i] = false;
    row->column[i] = before->row.column[i];
    row->turns[i] = before->row.turns[i];
    row->unsure[2 * i] = is_there ? (double)zone[3] / force : EC_NAN;
    row->unsure[2 * i + 1] =
        is_there ? unwrapped(&before->row, row, i, (double)zone[4] / force) : EC_NAN;
    if (ec_zone_names[i] == EC_SKIN && EC_MOST_FORCE_MOTION) {
      row->unsure[EC_OF_STIFFNESS] =
          (force / EC_SCALE + EC_FORCE_FLOOR) / (row->motions[1] + EC_LENGTH_FLOOR);
    }
  }
  row->unsure[EC_OF_MOTION] = row->motions[0];
  row->unsure[EC_OF_FORCE_MOTION] = row->motions[1];
  for (uint32_t i = EC_JOINTS; i-- > 0;) row->unsure[EC_OF_JOINTS + i] = row->joints[i];
}

/* The first of n times, which are a step apart, that is not before t. */
static uint32_t first_at(double t, double step_s, double offset_s, uint32_t n) {
  if (!(t > offset_s)) return 0;
  double steps = (t - offset_s) / step_s;
  uint32_t i = steps < n ? (uint32_t)steps : n;
  while (i > 0 && (i - 1) * step_s + offset_s >= t) i--;
  while (i < n && i * step_s + offset_s < t) i++;
  return i;
}

/* Sample times from one frame to the next. */
typedef struct {
  double step_s;
  double t0;
  double t1;
  uint32_t begin;
  uint32_t end;
} span;

/* How far a sample time lies between the frames of a span. */
static double fraction_of(const span *s, uint32_t i) {
  static span last;
  static uint32_t last_i;
  static double fraction;
  if (i == last_i && s->t0 == last.t0 && s->t1 == last.t1 && s->step_s == last.step_s) {
    return fraction;
  }
  double step = s->t1 - s->t0;
  fraction = (i * s->step_s - s->t0) / (step == 0.0 ? 1.0 : step);
  fraction = fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction;
  last = *s;
  last_i = i;
  return fraction;
}

static void interpolate(const span *s, double low, double high, double *values) {
  for (uint32_t i = s->begin; i < s->end; i++) {
    double fraction = fraction_of(s, i);
    values[i] = fraction == 1.0 ? high : low + fraction * (high - low);
  }
}

/* What may be unknown, from the frame that knew it last; the first one counts for all before. */
static void interpolate_unsure(span s, const known *last, double value, double *values) {
  if (value != value) return;
  if (last->t < 0.0) {
    for (uint32_t i = 0; i < s.end; i++) values[i] = value;
    return;
  }
  if (last->t != s.t0) s.begin = first_at(last->t, s.step_s, 0.0, s.end);
  s.t0 = last->t;
  interpolate(&s, last->value, value, values);
}

/* A channel of kernels, times a power of two and cut off. No sum of a skin that export accepts
   reaches 2^48, so that the product fits. */
static uint16_t channel(const ec_row *row, int32_t index) {
  int32_t of_all_zones = (int32_t)EC_ZONE_CHANNELS;
  bool of_zones = index < of_all_zones;
  const ec_kernels *kernels = &ec_model_now.kernels[of_zones];
  int32_t place = of_zones ? index : index - of_all_zones;
  int64_t x = of_zones ? row->zones[place / EC_ZONE_WIDTH][place % EC_ZONE_WIDTH]
                       : row->kernel_cells[place];
  int8_t shift = (int8_t)ec_model_now.bytes[kernels->shifts + (uint32_t)place];
  x = shift > 0 ? x * ((int64_t)1 << shift) : x >> -shift;
  return (uint16_t)(x < (1 << BITS) - 1 ? x : (1 << BITS) - 1);
}

/* Channels are held from a frame to the next. */
static void hold_channels(uint32_t point, const ec_row *row, double until_s) {
  double step_s = ec_windows_s[point] / (EC_SAMPLES_OF_KERNELS - 1);
  uint32_t end = first_at(until_s, step_s, CLOCK_ROUNDING_S, EC_SAMPLES_OF_KERNELS);
  uint32_t begin = EC_MOST_CHANNELS ? first_at(row->t, step_s, CLOCK_ROUNDING_S, end) : end;
  for (int32_t c = 0; begin < end && c < (int32_t)EC_CHANNELS; c++) {
    uint16_t value = channel(row, c);
    for (uint32_t i = begin; i < end; i++) ec_channels[point][c][i] = value;
  }
}

/* Values between the last frame and this one. */
static void between(uint32_t point, state *from, ec_row *row) {
  span s = {0.0, from->row.t, row->t, 0, 0};
  uint32_t samples = 0;
  for (const ec_time_series *series = ec_sampled; series < ec_sampled + EC_SAMPLED; series++) {
    uint32_t unsure = unsure_place(series);
    double *values = ec_values[point] + series->place;
    if (series->samples != samples) {
      samples = series->samples;
      s.step_s = ec_windows_s[point] / (samples - 1);
      s.end = first_at(s.t1, s.step_s, 0.0, samples);
      s.begin = first_at(s.t0, s.step_s, 0.0, s.end);
    }
    for (uint32_t i = 0; i < series->rows; i++, values += samples) {
      if (unsure < EC_UNSURE_VALUES) {
        interpolate_unsure(s, &from->last[unsure + i], row->unsure[unsure + i], values);
      } else if (s.begin < s.end) {
        interpolate(&s, sure_value(series, i, &from->row), sure_value(series, i, row), values);
      }
    }
  }
  hold_channels(point, &from->row, row->t);
}

/* The last values go on. */
static void hold(uint32_t point, state *last) {
  for (const ec_time_series *series = ec_sampled; series < ec_sampled + EC_SAMPLED; series++) {
    uint32_t unsure = unsure_place(series);
    double *values = ec_values[point] + series->place;
    double step_s = ec_windows_s[point] / (series->samples - 1);
    for (uint32_t row = 0; row < series->rows; row++, values += series->samples) {
      bool is_sure = unsure == EC_UNSURE_VALUES;
      known end = {last->row.t, 0.0};
      if (is_sure) {
        end.value = sure_value(series, row, &last->row);
      } else if (last->last[unsure + row].t >= 0.0) {
        end = last->last[unsure + row];
      } else {
        end.t = 0.0; /* 0 where no frame knows it */
      }
      uint32_t begin = first_at(end.t, step_s, 0.0, series->samples);
      for (uint32_t i = begin; i < series->samples; i++) values[i] = end.value;
    }
  }
  hold_channels(point, &last->row, EC_INFINITY);
}

static void absorb(state *s, const ec_row *row) {
  s->row = *row;
  for (uint32_t i = 0; i < EC_UNSURE_VALUES; i++) {
    if (row->unsure[i] != row->unsure[i]) continue;
    s->last[i].t = row->t;
    s->last[i].value = row->unsure[i];
  }
}

/* Before the first frame of a contact. */
void ec_samples_begin(void) {
  is_lifted = false;
  felt.row.t = -1.0;
  for (uint32_t i = 0; i < EC_UNSURE_VALUES; i++) felt.last[i].t = -1.0;
  for (uint32_t i = 0; ec_zone_names[i] != EC_NO_ZONE; i++) {
    felt.row.column[i] = EC_NAN;
    felt.row.turns[i] = 0.0;
  }
  for (uint32_t point = 0; point < EC_POINTS; point++) {
    for (uint32_t i = 0; i < EC_SIZE(values); i++) ec_values[point][i] = 0.0;
  }
}

/* Take in a frame that no later reading replaces, for the decision points that wait. */
void ec_samples_take(ec_row *row, uint32_t first_point) {
  if (row->area) {
    is_lifted = false;
  } else if (!is_lifted) {
    is_lifted = true;
    lifted = felt;
  }
  state *before = is_lifted ? &lifted : &felt;
  complete(before, row);
  for (uint32_t point = first_point; point < EC_POINTS && before->row.t >= 0.0; point++) {
    between(point, before, row);
  }
  absorb(before, row);
}

/* Write the values behind the last frame that counts for a decision point; a later reading of its
   instant may still come. Frames without contact count if it is over. */
void ec_samples_close(uint32_t point, ec_row *row) {
  static state last;
  if (!row->area && !ec_released(felt.row.t, row->t)) {
    hold(point, &felt);
    return;
  }
  state *before = !row->area && is_lifted ? &lifted : &felt;
  complete(before, row);
  if (before->row.t >= 0.0) between(point, before, row);
  last = *before;
  absorb(&last, row);
  hold(point, &last);
}
