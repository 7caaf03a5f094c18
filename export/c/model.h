/* The program: the skin that it is for, the quantities that it measures, and how large a model its
   memory has room for. export/c_code.py has put the numbers in. */
#ifndef EC_MODEL_H
#define EC_MODEL_H

#define EC_ROWS $rows
#define EC_COLS $cols
#define EC_WRAPS $wraps

/* Of these numbers and names. */
#define EC_PROGRAM ${program}u

/* about so many bytes of RAM: static, and 2 kB of the stack */
#define EC_RAM $ram

/* The sizes of a model, and the most of each. */
#define EC_MOST $most
$sizes

/* The quantities of edge/features/quantities.py, and those of zones in a frame. */
#define EC_QUANTITIES $quantity_names
#define EC_SURE_VALUES \
  $sure_values

#endif
