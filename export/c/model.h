/* What the model is measured and decided with: export/c_code.py has put its numbers in. */
#ifndef EC_MODEL_H
#define EC_MODEL_H

/* the skin: SkinLayout in edge/touch/layout.py */
#define EC_ROWS $rows
#define EC_COLS $cols
#define EC_WRAPS $wraps
#define EC_THRESHOLD_COUNTS $threshold_counts
#define EC_ONSET $onset
#define EC_RELEASE_S $release_s
#define EC_RADIUS_M $radius_m
#define EC_ROW0_Z_M $row0_z_m
#define EC_ALONG $along
#define EC_AROUND $around
#define EC_SCALE $scale
#define EC_COLUMN_ANGLES $column_angles

/* the arm */
#define EC_JOINTS $joints
#define EC_DOF $dof
#define EC_LINKS $links_count

/* a contact, and what is measured in its frames */
#define EC_DEBOUNCE $debounce
#define EC_WINDOW_S $window_s
#define EC_LONG_STEPS $long_steps
#define EC_REPEATS $repeats
#define EC_LONG_STEP_S $long_step_s
#define EC_ZONES ($zone_names_count - 1)
#define EC_CELLS $cells
#define EC_KERNEL_CELLS $kernel_cells
#define EC_MOTION $motion
#define EC_FORCE_MOTION $force_motion
#define EC_CENTROIDS $centroids
#define EC_SPREADS $spreads
#define EC_SURE_VALUES \
  $sure_values
#define EC_COURSES $courses_count
#define EC_VALUES $value_count
#define EC_ZONE_CHANNELS $zone_channels
#define EC_CHANNELS $channels

/* the features, and the quantities of edge/features/quantities.py */
enum { $quantity_names };
#define EC_FEATURES $features_count
#define EC_WIDTH $width
#define EC_FORCE_FLOOR $force_floor
#define EC_LENGTH_FLOOR $length_floor

/* about so many bytes of RAM: static, and 2 kB of the stack */
#define EC_RAM $ram

/* the graph, and where it leaves its outputs */
#define EC_ARENA $arena
#define EC_STEPS $steps_count
#define EC_MOST_COLUMNS $most_columns
#define EC_PLACE_OUT_OF_RANGE $place_out_of_range
#define EC_PLACE_NOVELTY $place_novelty
#define EC_PLACE_REMOTENESS $place_remoteness

/* decisions */
#define EC_TASKS $tasks_count
#define EC_MOST_LABELS $most_labels
#define EC_POINTS $windows_s_count
#define EC_EARLY $early
#define EC_HAS_NOVELTY $has_novelty
#define EC_NAMING $naming /* the task that names things; 255: none is unknown */

#endif
