"""edge-classify as a ROS 2 node."""
