/* One contact, frame by frame: edge/touch/track.py, contact.py, layout.py, arm.py. */
#include "internal.h"

#define TAXELS (EC_ROWS * EC_COLS)
#define CLOCK_ROUNDING_S 1e-6
#define TURN 6.283185307179586 /* radians */
#define RADIANS 0.017453292519943295 /* of a degree */

ec_contact ec_now; /* the contact that is followed */
static ec_row newest; /* a later reading of its instant may still replace it */
static double settled_motions[2]; /* of the frame before it */
static uint16_t before[TAXELS]; /* the counts of the last row */
static ec_set active;
static ec_region region;

bool ec_released(double touched_s, double now_s) {
  return now_s - touched_s >= EC_RELEASE_S - CLOCK_ROUNDING_S;
}

/* A point of the skin in the frame of its link. */
static void skin_point(double row, double col, double point[3]) {
  double angle;
  point[0] = col * EC_AROUND;
  point[1] = row * EC_ALONG;
  point[2] = 0.0;
  if (EC_RADIUS_M == 0.0) return;
  if (EC_COLUMN_ANGLES) {
    uint32_t column = (uint32_t)col;
    const ec_angle *place = &ec_angles[column % EC_COLS];
    angle = (place->angle_deg + (col - column) * place->step_deg) * RADIANS;
  } else {
    angle = TURN * col / EC_COLS;
  }
  point[0] = EC_RADIUS_M * ec_cos(angle);
  point[1] = EC_RADIUS_M * ec_sin(angle);
  point[2] = EC_ROW0_Z_M - row * EC_ALONG;
}

/* The point in the frame of the arm's base. */
static void carried(const double *joints, double p[3]) {
  uint32_t moving = EC_DOF;
  for (uint32_t number = EC_LINKS; number-- > 0;) {
    const ec_link *link = &ec_links[number];
    const double *k = link->axis;
    const double *step = link->step;
    for (uint32_t i = 0; i < 3; i++) p[i] = p[i] + link->after[i];
    if (link->kind == EC_PRISMATIC) {
      double travel = joints[--moving];
      for (uint32_t i = 0; i < 3; i++) p[i] = p[i] + k[i] * travel;
    } else if (link->kind != EC_FIXED) {
      double angle = joints[--moving];
      double half = ec_sin(0.5 * angle);
      double f = ec_sin(angle);
      double g = 2.0 * half * half;
      double ax = k[1] * p[2] - k[2] * p[1];
      double ay = k[2] * p[0] - k[0] * p[2];
      double az = k[0] * p[1] - k[1] * p[0];
      p[0] = p[0] + (f * ax + g * (k[1] * az - k[2] * ay));
      p[1] = p[1] + (f * ay + g * (k[2] * ax - k[0] * az));
      p[2] = p[2] + (f * az + g * (k[0] * ay - k[1] * ax));
    }
    double x = p[0];
    double y = p[1];
    double z = p[2];
    for (uint32_t i = 0; i < 3; i++, step += 4) {
      p[i] = step[0] * x + step[1] * y + step[2] * z + step[3];
    }
  }
}

/* Distance of the centroid of a zone's sums from where it was first seen; not a number without a
   pose. */
static double distance(ec_start *start, const int64_t *sums, const double *joints) {
  double p[3];
  double total = (double)sums[2];
  double col = (double)sums[4] / total;
  if (col >= EC_COLS) col -= EC_COLS;
  skin_point((double)sums[3] / total, col, p);
  if (EC_LINKS && !joints) {
    ec_now.missing_pose = true;
    return EC_NAN;
  }
  if (EC_LINKS) carried(joints, p);
  if (!start->is_known) {
    start->is_known = true;
    for (uint32_t i = 0; i < 3; i++) start->point[i] = p[i];
  }
  double x = p[0] - start->point[0];
  double y = p[1] - start->point[1];
  double z = p[2] - start->point[2];
  return ec_sqrt(x * x + y * y + z * z);
}

/* Of two readings of one instant the later one counts. */
static void forget_newest(void) {
  for (uint32_t i = 0; i < 2; i++) ec_now.starts[i].is_known = ec_now.starts[i].is_settled;
}

static void settle_newest(uint32_t first_point) {
  for (uint32_t i = 0; i < 2; i++) {
    settled_motions[i] = newest.motions[i];
    if (newest.motions[i] == newest.motions[i]) ec_now.starts[i].is_settled = true;
  }
  ec_samples_take(&newest, first_point);
  ec_doubts_take(&newest);
}

static void move(ec_row *row, const double *joints) {
  bool touched = region.area > 0;
  for (uint32_t i = 0; i < 2; i++) {
    row->motions[i] = touched ? 0.0 : settled_motions[i];
  }
  if (touched && EC_MOST_MOTION) {
    int64_t taxels[EC_ZONE_WIDTH];
    ec_zone(EC_CONTACT, active, &region, 0, taxels);
    taxels[4] %= EC_COLS * taxels[2];
    row->motions[0] = distance(&ec_now.starts[0], taxels, joints);
  }
  if (touched && EC_MOST_FORCE_MOTION) {
    row->motions[1] = distance(&ec_now.starts[1], row->zones[0], joints);
  }
}

/* The sums of the skin's cells. */
static void pool(
    const uint16_t *counts, const bool *valid, const int16_t *cell_of_taxel, uint32_t *cells,
    uint32_t size) {
  for (uint32_t i = 0; i < size; i++) cells[i] = 0;
  for (uint32_t i = 0; i < TAXELS; i++) {
    if (cell_of_taxel[i] >= 0 && EC_READABLE(valid, i)) cells[cell_of_taxel[i]] += counts[i];
  }
}

static void add(
    const uint16_t *counts, const bool *valid, const double *joints, double age_s,
    uint32_t first_point) {
  if (ec_now.has_row && age_s <= ec_now.age_s) {
    age_s = ec_now.age_s;
    forget_newest();
  } else if (ec_now.has_row) {
    settle_newest(first_point);
  }
  for (uint32_t i = 0; valid && i < TAXELS; i++) {
    if (!valid[i] && ec_alive[i]) ec_now.missing_taxels = true;
  }
  newest.same = ec_now.has_row;
  for (uint32_t i = 0; i < TAXELS; i++) {
    if (counts[i] != before[i]) newest.same = false;
    before[i] = counts[i];
  }
  newest.t = age_s;
  newest.peak = region.peak;
  newest.area = region.area;
  if (region.area) ec_now.region = region;
  for (uint32_t i = 0; ec_zone_names[i] != EC_NO_ZONE; i++) {
    ec_zone((ec_zone_name)ec_zone_names[i], active, &region, counts, newest.zones[i]);
  }
  move(&newest, joints);
  if (EC_MOST_CELLS) pool(counts, valid, ec_cell_of_taxel, newest.cells, EC_CELLS);
  if (EC_MOST_KERNEL_CELLS) {
    pool(counts, valid, ec_kernel_cell_of_taxel, newest.kernel_cells, EC_KERNEL_CELLS);
  }
  for (uint32_t i = EC_JOINTS; i-- > 0;) newest.joints[i] = joints ? joints[i] : EC_NAN;
  if (EC_JOINTS && !joints) ec_now.missing_pose = true;
  ec_now.has_row = true;
  ec_now.age_s = age_s;
}

/* Take a frame into the contact, and end it where it is over. The decision points before first_point
   are closed; a contact does not begin while the last one is still being measured. */
int ec_follow(
    const uint16_t *counts, const bool *valid, double t, const double *joints,
    uint32_t first_point, bool is_busy) {
  if (ec_now.ended) ec_now = (ec_contact){0};
  ec_largest(counts, valid, ec_now.region.taxels, active, &region);
  bool touched = region.area > 0;
  bool above = region.peak > EC_ONSET;
  if (!ec_now.under_way) {
    if (!above) return 0;
    if (is_busy) return EC_BUSY;
    ec_now.under_way = true;
    ec_now.onset_s = t;
    ec_samples_begin();
    ec_doubts_begin();
  }
  double age_s = t - ec_now.onset_s;
  bool confirmed = ec_now.frames >= EC_DEBOUNCE;
  if (!confirmed && !above) {
    ec_now.ended = true;
    return 0;
  }
  ec_now.frames++;
  /* A reading without contact replaces none of its instant. */
  bool is_new = touched || age_s > ec_now.age_s;
  if (is_new && (!confirmed || ec_now.age_s < EC_WINDOW_S)) {
    add(counts, valid, joints, age_s, first_point);
  }
  if (touched) {
    ec_now.touched_s = age_s;
  } else if (ec_released(ec_now.touched_s, age_s)) {
    ec_now.ended = true;
  }
  return 0;
}

/* The frames so far are all that count for a decision point; returns reasons to doubt them. */
uint16_t ec_close(uint32_t point) {
  ec_samples_close(point, &newest);
  uint16_t doubts = ec_doubts(&newest, ec_windows_s[point]);
  if (ec_now.missing_taxels) doubts |= EC_MISSING_TAXELS;
  if (ec_now.missing_pose) doubts |= EC_MISSING_POSE;
  if (ec_now.late) doubts |= EC_LATE;
  return doubts;
}
