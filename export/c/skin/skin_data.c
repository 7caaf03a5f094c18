/* The tables of the skin: export/skin_code.py has put them in. */
#include "skin_internal.h"

const uint8_t ec_retries[] = $retries;
const uint16_t ec_first_chips[] = $first_chips;
const bool ec_working[] = $working;
const int8_t ec_signs[] = $signs;
const ec_calibration ec_exported = $calibration;
static const ec_script scripts[] = $scripts;
const ec_chip ec_chips[] = $chips;
