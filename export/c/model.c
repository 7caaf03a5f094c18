/* The model's tables: export/c_code.py has put its numbers in. */
#include "internal.h"

const bool ec_alive[] = $alive;
const ec_angle ec_angles[] = $angles;
const ec_limit ec_limits[] = $limits;
const ec_link ec_links[] = $links;

const uint8_t ec_zone_names[] = $zone_names;
const int16_t ec_cell_of_taxel[] = $cell_of_taxel;
const int16_t ec_kernel_cell_of_taxel[] = $kernel_cell_of_taxel;
const ec_course ec_courses[] = $courses;
const ec_feature ec_features[] = $features;
const ec_kernels ec_taxel_kernels = $taxel_kernels;
const ec_kernels ec_zone_kernels = $zone_kernels;

const ec_table ec_tables[] = $tables;
const ec_step ec_steps[] = $steps;

const double ec_windows_s[] = $windows_s;
const ec_task ec_tasks[] = $tasks;
const char *const *const ec_labels[] = $labels;
const char *const ec_task_names[] = $task_names;
const double ec_typical[] = $typical;
const double ec_novel[] = $novel;
const double ec_remote[] = $remote;
const double ec_middles[] = $middles;
const double ec_slopes[] = $slopes;
const uint64_t ec_checksum = UINT64_C($checksum);
