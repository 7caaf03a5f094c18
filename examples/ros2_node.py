"""Decisions as ROS 2 messages, from the lines that `edge-classify run --udp 127.0.0.1:47400` sends.

    python examples/ros2_node.py --ros-args -r touch:=/forearm/touch

publishes each line as a std_msgs/String on `touch`, and the label of each task's decision as a
std_msgs/String on `touch/<task>`, for example `touch/mobility`: "fixed".
"""

import json
import socket

import rclpy
from std_msgs.msg import String


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("edge_classify")
    publishers = {"": node.create_publisher(String, "touch", 10)}
    lines = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    lines.bind(("127.0.0.1", 47400))
    lines.settimeout(0.1)  # so that Ctrl-C is heard
    while rclpy.ok():
        try:
            line = lines.recv(65536).decode()
        except TimeoutError:
            continue
        publishers[""].publish(String(data=line))
        event = json.loads(line)
        if event["event"] == "decision" and event["label"] is not None:
            if event["task"] not in publishers:
                topic = f"touch/{event['task']}"
                publishers[event["task"]] = node.create_publisher(String, topic, 10)
            publishers[event["task"]].publish(String(data=event["label"]))


if __name__ == "__main__":
    main()
