/* The model in the program itself: the bytes of model.bin, as numbers of their types. */
#include <math.h>

#include "edge_classify.h"
#include "image.h"

static const struct {
  ec_header header;
$fields
} image = {
  {
    EC_MAGIC,
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    $big_digests,
#else
    $digests,
#endif
    $header
  },
$tables
};

const void *const ec_image = &image;
