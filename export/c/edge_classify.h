/* Decides what a robot's skin touches, from raw counts, with the bits of `edge-classify replay`.
   One contact at a time; no heap, no recursion, no mathematical library. Its RAM is static, but for a
   stack of less than 2 kB; EC_RAM in model.h is their sum.

   Compile every .c file of this folder with -std=c99 -ffp-contract=off. */
#ifndef EDGE_CLASSIFY_H
#define EDGE_CLASSIFY_H

#include <stdbool.h>
#include <stdint.h>

#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum { EC_ONSET_EVENT, EC_RELEASE_EVENT, EC_DECIDED_EVENT } ec_kind;
typedef enum { EC_NOTHING, EC_CONFIDENCE, EC_WINDOW } ec_stopped_by;

/* Reasons to doubt a decision, in the order of docs/formats.md. */
enum {
  EC_SHORT = 1 << 0,
  EC_GAP = 1 << 1,
  EC_FROZEN = 1 << 2,
  EC_STILL_JOINTS = 1 << 3,
  EC_JOINT_LIMITS = 1 << 4,
  EC_MISSING_TAXELS = 1 << 5,
  EC_MISSING_POSE = 1 << 6,
  EC_LATE = 1 << 7,
  EC_AS_TRAINED = 1 << 8,
  EC_OUT_OF_RANGE = 1 << 9,
  EC_UNUSUAL = 1 << 10,
  EC_UNKNOWN = 1 << 11,
  EC_TIE = 1 << 12,
  EC_FORCED = 1 << 13,
  EC_UNCERTIFIED = 1 << 14
};

typedef struct {
  ec_kind kind;
  double t_s; /* of the frame that brought it about */
  double onset_s;
  /* of a decision */
  double window_s;
  double confidence; /* to millionths; not a number of a model without calibration */
  uint32_t nearest;  /* the nearest training trial */
  int16_t label;     /* index into the task's labels; -1: null */
  uint16_t flags;
  uint8_t task;
  ec_stopped_by stopped_by; /* with an error rate */
} ec_event;

/* Errors of ec_push. */
enum {
  EC_BUSY = -1,       /* a contact begins while the last is being measured: see ec_push */
  EC_BAD_TIME = -2,   /* time is not finite or goes back */
  EC_BAD_JOINTS = -3, /* an angle is not finite, or beyond a million radians */
  EC_NO_MODEL = -4,   /* ec_model has accepted none */
};

#define EC_MOST_EVENTS (EC_MOST_TASKS + 2)

typedef enum {
  EC_ACCEPTED,
  EC_NO_MODEL_THERE,  /* or one of another format, or at an address that no 8 divides */
  EC_DAMAGED,         /* its digest is another */
  EC_OF_ANOTHER_SKIN, /* it needs a program of its own, as export writes it */
  EC_TOO_LARGE        /* for the memory of this program: likewise */
} ec_refusal;

/* Take up a model, before anything else: the bytes of model.bin, which are read where they lie, at a
   multiple of 8; or ec_image. Forgets all. */
ec_refusal ec_model(const void *address);

/* The model in the program itself, for one image: model.c. */
extern const void *const ec_image;

/* Whether this program computes with the bits that it should, which options of a compiler change; call
   it before ec_begin. */
bool ec_selftest(void);

/* Forget all: before the first frame, and where the stream has had a gap. */
void ec_begin(void);

/* Take in a frame, and tell onset and release. Decisions are left to ec_work. The rate of frames may
   be any.

   counts: above the baseline, by rows from elbow to wrist; valid: which could be read, or NULL of
   all; t_s: seconds; joints: the EC_DOF angles in radians, or NULL where not known.
   Returns the number of events, in the order of time, or an error below 0. After EC_BUSY call
   ec_work until it has nothing due, and push the frame again. */
int ec_push(
    const uint16_t *counts, const bool *valid, double t_s, const double *joints,
    ec_event events[EC_MOST_EVENTS]);

/* Whether ec_work has something to do. A decision is due when its window ends, or when the contact
   has ended: then it is made of what was felt. */
bool ec_is_due(void);

/* Go on with what is due, by a slice of bounded length; returns the number of events. */
int ec_work(ec_event events[EC_MOST_EVENTS]);

/* Whether a contact is under way, so that no baseline may follow. */
bool ec_is_touched(void);

/* End the stream: tasks that wait are due, flagged EC_SHORT. */
void ec_finish(void);

/* Takes a letter of a text. */
typedef void (*ec_put)(char letter);

/* Write an event as a line of JSON, with the keys of `edge-classify run`. now_s: of the answer, on the
   clock of the frames, from which a decision's latency is told. */
void ec_json(const ec_event *event, double now_s, ec_put put);

/* As ec_work and ec_push, with the events as lines of JSON; a frame for which ec_push is busy is
   pushed again, after all that is due. */
int ec_work_lines(double (*now_s)(void), ec_put put);
int ec_push_lines(
    const uint16_t *counts, const bool *valid, double t_s, const double *joints,
    double (*now_s)(void), ec_put put);

/* Texts in UTF-8; a label of -1 has none. */
const char *ec_task_name(uint32_t task);
const char *ec_label(uint32_t task, int16_t label);
const char *ec_model_name(void);

#ifdef __cplusplus
}
#endif

#endif
