"""The flags of a decision: the reasons to doubt it, in the order in which they
stand."""

FLAGS = {
    "no_contact": (
        "nothing was touched in the recording, and the training had a label `none` for "
        "this; `onset_s` is the end of the recording, and `strongest` the largest count "
        "of any taxel, divided by the onset count"
    ),
    "short": "the stream ended inside the window; the last values were held",
    "gap": (
        "more than a 24th of the window (0.05 s of 1.2 s), and more than two usual "
        "steps, lies between two frames; also if times are not in seconds"
    ),
    "frozen": (
        "frames repeat bit for bit for twice as long, as fewer than a fifth of the "
        "training trials do"
    ),
    "speed": (
        "the arm came more slowly than in 99 % of the training trials, so that what it "
        "would still have moved may be called fixed; or faster than in 99 %, by 15 %"
    ),
    "still_joints": (
        "a joint's angle stays the same for longer than in 99 % of the training trials, "
        "by more than a 24th of the window: it has stopped, or comes late"
    ),
    "joint_limits": "joint angles lie beyond their limits",
    "missing_taxels": "taxels could not be read in part of the window",
    "missing_pose": "joint angles were absent in part of the window",
    "late": "the contact was there in the first frame, so its onset is not known",
    "near_contact": (
        "as `no_contact`, but a taxel rose above the contact threshold: a weak touch may "
        "have been missed"
    ),
    "skin_motion": (
        "motion was measured on the skin, but the model was trained with motion in the "
        "world"
    ),
    "as_trained": (
        "the coordinates that the model compares are those of a training trial: nearly "
        "always the touch is that trial, replayed"
    ),
    "out_of_range": (
        "the features lie far outside those of training and were cut off; `label` is "
        "null where they could not be scaled at all"
    ),
    "unusual": (
        "the touch is unlike all training trials, as if the skin, the arm or their "
        "surroundings had changed: every answer is in doubt, and with `--error` waits "
        "for the full window"
    ),
    "unknown": (
        "the object is far from all that training met: `label` is null, and the answers "
        "of other tasks stand. Only the task that names objects, which has the most "
        "labels but for kinds such as category, has this flag"
    ),
    "tie": "another label had the same number of votes",
    "forced": "with `--error`: the window ended before the confidence was reached",
    "uncertified": "with `--error`: no rule is certified for this task",
}
"""{flag: its meaning}; docs/formats.md has the same table."""


def in_order(flags: set[str]) -> tuple[str, ...]:
    """Flags in the order of the table, which has them all."""
    return tuple(sorted(flags, key=list(FLAGS).index))
