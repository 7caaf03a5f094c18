"""Reads the skin, takes in joint angles, publishes each decision with its time, and
ends with the error where the skin can no longer be read."""

import json
import re
import sys
import threading
from collections import deque

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from vision_msgs.msg import Classification, ObjectHypothesis

import edge
from edge.touch.joint_stream import Joints
from edge.wire.fake.clock import PacedClock
from edge.wire.fake.player import play, skin_file


def topic(task: str) -> str:
    """A task's name as a valid topic: letters, digits and underscores, no digit in
    front.

    >>> topic("Object-36"), topic("36 objects")
    ('object_36', 'task_36_objects')
    """
    name = re.sub(r"[^a-z0-9]+", "_", task.lower()).strip("_") or "task"
    return f"task_{name}" if name[0].isdigit() else name


def number(name: str, text: str) -> float | None:
    """The value of a parameter that is a number; None of 0, which asks for nothing.

    Raises:
        EdgeError: it is none.
    """
    try:
        return float(text) or None
    except ValueError:
        raise edge.EdgeError(f"{name} must be a number, not {text!r}") from None


class ClassifyNode(Node):
    """Publishes `~/TASK` (vision_msgs/Classification), `~/events` (JSON in
    std_msgs/String), and `/diagnostics` once a second.

    Attributes:
        failure: what ended the reading; None where it was closed or played to its end.
    """

    def __init__(self) -> None:
        super().__init__("edge_classify")
        self.failure: Exception | None = None
        # `error:=0` is a whole number to ROS, and so is a model called 7.
        any_type = ParameterDescriptor(dynamic_typing=True)
        parameters = {
            name: str(self.declare_parameter(name, default, any_type).value)
            for name, default in (
                ("model", ""),
                ("skin", ""),
                ("fake", ""),
                ("error", 0.0),
                ("frame_id", "forearm_skin"),
            )
        }
        self._frame_id = parameters["frame_id"]
        self._model = edge.Model(parameters["model"])
        self._skin, self._joints, self._lasts_s = self._open(
            parameters["skin"], parameters["fake"]
        )
        self._classifier = edge.Classifier(
            self._model,
            self._skin.layout,
            error=number("error", parameters["error"]),
        )
        self._events = self.create_publisher(String, "~/events", 10)
        self._tasks = {
            task: self.create_publisher(Classification, f"~/{topic(task)}", 10)
            for task in self._model.info.tasks
        }
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._decisions = 0
        self.create_timer(1.0, self.diagnose)
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
        """Watch the skin until the node is destroyed, the recording has ended, or
        reading fails; then the node ends too."""
        try:
            self._watch()
        except Exception as error:  # whatever it is, `main` tells it
            # After Ctrl-C nothing can be published, which is no failure.
            self.failure = error if rclpy.ok() else None
        finally:
            rclpy.try_shutdown()

    def _watch(self) -> None:
        with self._skin as skin:
            for event in self._classifier.watch(
                skin,
                joints=self._joints,
                lasts_s=self._lasts_s,
            ):
                if self._closing:
                    return
                self._publish(event)

    def diagnose(self) -> None:
        """Publish whether each chip of the skin is read."""
        chips = self._skin.status()
        down = [chip for chip in chips if chip.state != "running"]
        silent = [f"{chip.bus} {chip.spec.route}" for chip in down]
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if silent else DiagnosticStatus.OK,
            name="edge_classify: skin",
            message=f"not read: {', '.join(silent)}"
            if silent
            else "all chips are read",
            values=[
                KeyValue(key="chips", value=str(len(chips))),
                KeyValue(key="decisions", value=str(self._decisions)),
            ],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def _publish(self, event) -> None:
        self._events.publish(String(data=json.dumps(event.to_dict())))
        if not isinstance(event, edge.Decided) or event.label is None:
            return
        self._decisions += 1
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


def main() -> int:
    """Run the node until it is stopped; the exit status, 2 after an error."""
    rclpy.init()
    try:
        node = ClassifyNode()
    except edge.EdgeError as error:
        print(f"edge_classify: {error}", file=sys.stderr)
        rclpy.try_shutdown()
        return 2
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    if node.failure is None:
        return 0
    print(f"edge_classify: {node.failure}", file=sys.stderr)
    return 2
