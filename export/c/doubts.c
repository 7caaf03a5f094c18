/* Reasons to doubt the frames of a contact's window: edge/decide/doubts.py. */
#include "internal.h"

#define GAP_SHARE (1.0 / 24.0)
#define GAP_S 0.05
#define PERIODS 2.5
#define FEWEST 4
#define LIMIT_TOLERANCE 0.05

/* The longest time for which something stays the same from frame to frame. */
typedef struct {
  double changed_s; /* when it last was unlike the frame before; below 0: never */
  double longest_s;
} run;

typedef struct {
  double t; /* of the last frame */
  run counts;
  run joints[EC_AT_LEAST_1(EC_MOST_JOINTS)];
  double angles[EC_AT_LEAST_1(EC_MOST_JOINTS)];
  bool beyond; /* an angle was beyond its limits */
  double longest_s; /* from a frame to the next */
  double long_steps[EC_MOST_LONG_STEPS]; /* shorter ones do not matter */
  uint32_t longs;
  uint32_t frames;
} history;

static history past;

static void step_to(history *h, double t) {
  double step = t - h->t;
  if (step > h->longest_s) h->longest_s = step;
  if (step > EC_LONG_STEP_S && h->longs < EC_LONG_STEPS) h->long_steps[h->longs++] = step;
}

static void run_to(run *r, double t, bool changed) {
  if (changed) r->changed_s = t;
  if (r->changed_s >= 0.0 && t - r->changed_s > r->longest_s) r->longest_s = t - r->changed_s;
}

static void take(history *h, const ec_row *row) {
  if (h->frames > 0) step_to(h, row->t);
  h->frames++;
  h->t = row->t;
  run_to(&h->counts, row->t, !row->same || !row->area);
  for (uint32_t i = EC_JOINTS; i-- > 0;) {
    double angle = row->joints[i];
    run_to(&h->joints[i], row->t, angle != h->angles[i]);
    h->angles[i] = angle;
    if (angle < ec_limits[i].low - LIMIT_TOLERANCE) h->beyond = true;
    if (angle > ec_limits[i].high + LIMIT_TOLERANCE) h->beyond = true;
  }
}

void ec_doubts_begin(void) {
  past = (history){0};
  past.counts.changed_s = -1.0;
  for (uint32_t i = EC_JOINTS; i-- > 0;) past.angles[i] = EC_NAN;
}

/* Take in a frame that no later reading replaces. */
void ec_doubts_take(const ec_row *row) {
  take(&past, row);
}

/* The step that stands in the middle, of as many as there are frames; 0 of one too short to matter. */
static double usual_step(history *h) {
  uint32_t above = h->frames - 1 - h->frames / 2; /* how many are longer */
  if (h->frames < FEWEST || above >= h->longs) return 0.0;
  for (uint32_t i = 1; i < h->longs; i++) {
    double step = h->long_steps[i];
    uint32_t place = i;
    for (; place > 0 && h->long_steps[place - 1] < step; place--) {
      h->long_steps[place] = h->long_steps[place - 1];
    }
    h->long_steps[place] = step;
  }
  return h->long_steps[above];
}

/* The flags at the end of a window, with a frame that a later reading may still replace. */
uint16_t ec_doubts(const ec_row *row, double window_s) {
  static history h;
  uint16_t flags = 0;
  h = past;
  if (row->t <= window_s) take(&h, row);
  step_to(&h, row->t < window_s ? row->t : window_s);
  if (h.counts.changed_s < 0.0) h.counts.longest_s = h.t;
  double pause_s = GAP_SHARE * window_s > GAP_S ? GAP_SHARE * window_s : GAP_S;
  double usual_s = PERIODS * usual_step(&h);
  if (h.longest_s > (usual_s > pause_s ? usual_s : pause_s)) flags |= EC_GAP;
  for (uint32_t i = EC_JOINTS; i-- > 0;) {
    if (h.joints[i].longest_s > ec_limits[i].still_s + pause_s) flags |= EC_STILL_JOINTS;
  }
  if (h.beyond) flags |= EC_JOINT_LIMITS;
  double frozen_s = usual_s > 2.0 * pause_s ? usual_s : 2.0 * pause_s;
  if (!EC_REPEATS && h.counts.longest_s > frozen_s) flags |= EC_FROZEN;
  return flags;
}
