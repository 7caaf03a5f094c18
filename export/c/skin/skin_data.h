/* The numbers of the skin: export/skin_code.py has put them in. Times are in microseconds. */
#ifndef EC_SKIN_DATA_H
#define EC_SKIN_DATA_H

$numbers

#endif
