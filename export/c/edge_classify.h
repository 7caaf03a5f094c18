#ifndef EDGE_CLASSIFY_H
#define EDGE_CLASSIFY_H
#include "model.h"
enum { EC_TOO_FAST = -1, EC_BAD_TIME = -2, EC_BAD_JOINTS = -3 };
#endif
