"""Reads the skin, takes in joint angles, and publishes each decision with its time."""

import json
import re
import threading
from collections import deque

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from vision_msgs.msg import Classification, ObjectHypothesis

import edge
from edge.fake.clock import PacedClock
from edge.fake.player import play, skin_file
from edge.touch.joint_stream import Joints


def topic(task: str) -> str:
    """A task's name as a valid topic: letters, digits and underscores, no digit in
    front.

    >>> topic("Object-36"), topic("36 objects")
    ('object_36', 'task_36_objects')
    """
    name = re.sub(r"[^a-z0-9]+", "_", task.lower()).strip("_") or "task"
    return f"task_{name}" if name[0].isdigit() else name


class ClassifyNode(Node):
    """Publishes `~/TASK` (vision_msgs/Classification) and `~/events` (JSON in
    std_msgs/String)."""

    def __init__(self) -> None:
        super().__init__("edge_classify")
        given = {
            name: self.declare_parameter(name, default).value
            for name, default in (
                ("model", ""),
                ("skin", ""),
                ("fake", ""),
                ("error", 0.0),
                ("frame_id", "forearm_skin"),
            )
        }
        self._frame_id = given["frame_id"]
        self._model = edge.Model(given["model"])
        self._skin, self._joints, self._lasts_s = self._open(
            given["skin"], given["fake"]
        )
        self._classifier = edge.Classifier(
            self._model, self._skin.layout, error=given["error"] or None
        )
        self._events = self.create_publisher(String, "~/events", 10)
        self._tasks = {
            task: self.create_publisher(Classification, f"~/{topic(task)}", 10)
            for task in self._model.info.tasks
        }
        self._reading = threading.Thread(target=self._read, daemon=True)
        self._closing = False
        self._reading.start()

    def _open(self, skin: str, fake: str):
        """The skin, where its joint angles come from, and how long there is something
        to read."""
        chain, dof = self._model.info.chain, self._model.info.dof
        if fake:
            recording = edge.load(fake)
            if chain is not None:
                recording = recording.for_joints(chain.names, fake)
            file = skin_file(recording.layout)
            opened, playback = play(file, recording, clock=PacedClock())
            return opened, playback, playback.ends
        opened = edge.Skin.open(skin)
        if dof is None:
            return opened, None, float("inf")
        lines: deque[bytes] = deque(maxlen=256)

        def on_joints(message: JointState) -> None:
            stamp = message.header.stamp
            t = stamp.sec + stamp.nanosec * 1e-9
            pose = {"t": t, "names": list(message.name), "q": list(message.position)}
            lines.append(json.dumps(pose).encode() + b"\n")

        self.create_subscription(JointState, "joint_states", on_joints, 50)
        stream = Joints(
            lambda: lines.popleft() if lines else b"",
            dof=dof,
            names=None if chain is None else chain.names,
            now=opened.clock.now,
        )
        return opened, stream, float("inf")

    def _read(self) -> None:
        """Watch the skin until the node is destroyed or the recording has ended."""
        with self._skin as skin:
            for event in self._classifier.watch(
                skin, joints=self._joints, lasts_s=self._lasts_s
            ):
                if self._closing:
                    return
                self._publish(event)

    def _publish(self, event) -> None:
        self._events.publish(String(data=json.dumps(event.to_dict())))
        if not isinstance(event, edge.Decided) or event.label is None:
            return
        message = Classification()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self._frame_id
        message.results = [
            ObjectHypothesis(class_id=event.label, score=event.confidence or 0.0)
        ]
        self._tasks[event.task].publish(message)

    def destroy_node(self) -> None:
        """Stop reading."""
        self._closing = True
        super().destroy_node()


def main() -> None:
    rclpy.init()
    node = ClassifyNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
